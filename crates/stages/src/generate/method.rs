//! The ways to make surfaces, and the keys of each.

use schemars::JsonSchema;
use serde::Deserialize;
use toml::de::DeTable;

use super::files::FileTable;
use super::growth::{Growing, PlannedSurfaces, Realizations};
use super::random::RandomTable;
use super::shapes::{ParaboloidTable, PunchTable, WaveShape, WaveTable};
use super::spectrum::SpectrumTable;
use super::{Heights, Origin, Params, PerAxis, files, random, shapes, spectrum};
use crate::{Given, Reads, Rows};
use asperity_contact::topography::random::Amplitude;
use asperity_contact::topography::shapes::Shape;
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::written::advice::Wanted;
use asperity_manifest::written::checks::{Checks, report_equal_points};
use asperity_manifest::written::{Key, Layout, Point, Section, Table, reader};

/// The word after `method =`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// A random self-affine surface.
    Random(Amplitude),
    /// A random one with a given spectrum.
    Spectrum,
    /// A measured one.
    File,
    /// A paraboloid.
    Paraboloid,
    /// A wave.
    Wave(WaveShape),
    /// A flat disc.
    FlatPunch,
}

/// The points of a stage's grid, by what they say.
#[derive(Debug)]
pub enum SurfacePoints {
    Random(Amplitude, Section<RandomTable>),
    Spectrum(Section<SpectrumTable>),
    File(Section<FileTable>),
    Paraboloid(Section<ParaboloidTable>),
    Wave(WaveShape, Section<WaveTable>),
    FlatPunch(Section<PunchTable>),
}

impl Method {
    /// Every one, the one that is meant when nothing is said first.
    pub const ALL: [Method; 9] = [
        Method::Random(Amplitude::Gaussian),
        Method::Random(Amplitude::Deterministic),
        Method::Spectrum,
        Method::File,
        Method::Paraboloid,
        Method::Wave(WaveShape::Single),
        Method::Wave(WaveShape::Product),
        Method::Wave(WaveShape::Sum),
        Method::FlatPunch,
    ];

    /// The word itself.
    pub fn word(self) -> &'static str {
        match self {
            Method::Random(Amplitude::Gaussian) => "filter",
            Method::Random(Amplitude::Deterministic) => "random-phase",
            Method::Spectrum => "spectrum",
            Method::File => "file",
            Method::Paraboloid => "paraboloid",
            Method::Wave(WaveShape::Single) => "wave",
            Method::Wave(WaveShape::Product) => "wave-product",
            Method::Wave(WaveShape::Sum) => "wave-sum",
            Method::FlatPunch => "flat-punch",
        }
    }

    /// The method that makes a surface.
    pub fn of(origin: &Origin) -> Method {
        match origin {
            Origin::Random { surface, .. } => Method::Random(surface.amplitude),
            Origin::Spectrum { .. } => Method::Spectrum,
            Origin::File(_) => Method::File,
            Origin::Shape { shape, .. } => match shape {
                Shape::Paraboloid { .. } => Method::Paraboloid,
                Shape::Wave { .. } => Method::Wave(WaveShape::Single),
                Shape::WaveProduct { .. } => Method::Wave(WaveShape::Product),
                Shape::WaveSum { .. } => Method::Wave(WaveShape::Sum),
                Shape::Punch { .. } => Method::FlatPunch,
            },
        }
    }

    /// What it makes, in a sentence for editors and the guide.
    pub fn about(self) -> &'static str {
        match self {
            Method::Random(Amplitude::Gaussian) => {
                "Random self-affine surfaces, a plateau up to `k_rolloff` and a power law up to \
                 `k_upper`: complex Gaussian amplitudes with the spectrum as their mean power."
            }
            Method::Random(Amplitude::Deterministic) => {
                "The same with exactly the spectrum, and random phases."
            }
            Method::Spectrum => {
                "Gaussian random surfaces with a given isotropic power spectral density C(q), \
                 normalised so that ∫ C d²q/(2π)² is their mean square height."
            }
            Method::File => {
                "A measured surface, of the file that the instrument wrote. What is asked for is done \
                 in this order: channel, unit and side, `crop`, `level`, `fill`, `high_pass`, \
                 `low_pass`, `resample`, `edges`."
            }
            Method::Paraboloid => "A paraboloid, −r²/(2R): the contact of Hertz.",
            Method::Wave(WaveShape::Single) => "Δ cos(2πnx/L): the contact of Westergaard.",
            Method::Wave(WaveShape::Product) => {
                "Δ cos(2πnx/L) cos(2πny/L): the contact of Johnson, Greenwood & Higginson."
            }
            Method::Wave(WaveShape::Sum) => {
                "Δ (cos(2πnx/L) + cos(2πny/L)): the same, turned by 45°."
            }
            Method::FlatPunch => "A flat disc in the middle of the cell.",
        }
    }

    /// Whether a stage may be read, which `from` names.
    pub fn may_read(self) -> bool {
        self == Method::Spectrum
    }

    /// The keys beside it.
    pub fn layout(self) -> &'static Layout {
        match self {
            Method::Random(_) => RandomTable::layout(),
            Method::Spectrum => SpectrumTable::layout(),
            Method::File => FileTable::layout(),
            Method::Paraboloid => ParaboloidTable::layout(),
            Method::Wave(_) => WaveTable::layout(),
            Method::FlatPunch => PunchTable::layout(),
        }
    }

    /// Reads them.
    pub fn read(
        self,
        table: DeTable,
        place: Span,
        wanted: &Wanted,
        problems: &mut Problems,
    ) -> SurfacePoints {
        use SurfacePoints as Points;
        match self {
            Method::Random(amplitude) => {
                Points::Random(amplitude, reader::read(table, place, wanted, problems))
            }
            Method::Spectrum => Points::Spectrum(reader::read(table, place, wanted, problems)),
            Method::File => Points::File(reader::read(table, place, wanted, problems)),
            Method::Paraboloid => Points::Paraboloid(reader::read(table, place, wanted, problems)),
            Method::Wave(shape) => {
                Points::Wave(shape, reader::read(table, place, wanted, problems))
            }
            Method::FlatPunch => Points::FlatPunch(reader::read(table, place, wanted, problems)),
        }
    }
}

impl SurfacePoints {
    /// The surfaces, point by point of the grid.
    pub fn surfaces(&self, given: &mut Given) -> Option<Vec<PlannedSurfaces>> {
        match self {
            SurfacePoints::Random(amplitude, section) => random::random(*amplitude, section, given),
            SurfacePoints::Spectrum(section) => spectrum::spectra(section, given),
            SurfacePoints::File(section) => files::files(section, given),
            SurfacePoints::Paraboloid(section) => shapes::paraboloid(section, given.problems),
            SurfacePoints::Wave(shape, section) => shapes::wave(*shape, section, given.problems),
            SurfacePoints::FlatPunch(section) => shapes::punch(section, given.problems),
        }
    }

    /// Whether none of the surfaces can be pressed: they are described by their modes alone.
    pub fn lack_heights(&self) -> bool {
        let SurfacePoints::Random(_, section) = self else {
            return false;
        };
        section.points.iter().any(|point| point.table.heights.value() == Some(Heights::None))
    }

    /// What the method reads of other stages; most read nothing.
    pub fn reads(&self) -> Option<Reads> {
        matches!(self, SurfacePoints::Spectrum(_)).then(|| Reads {
            rows: &[Rows::PowerSpectra],
            from: "`measure` stages with `what = \"spectrum\"`, where its method is `spectrum`"
                .into(),
        })
    }

    /// How the number of surfaces grows, as it is written; the points of a grid share it.
    pub fn growing(&self) -> Option<&Growing> {
        let realizations = match self {
            SurfacePoints::Random(_, section) => &section.points.first()?.table.realizations,
            SurfacePoints::Spectrum(section) => &section.points.first()?.table.realizations,
            _ => return None,
        };
        match &realizations.written()?.value {
            Realizations::Until(growing) => Some(growing),
            Realizations::Number(_) => None,
        }
    }
}

/// What becomes of the heights of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum KeptHeights {
    /// They are stored.
    Keep,
    /// They are drawn, or read, again when needed.
    Redraw,
}

impl From<KeptHeights> for Heights {
    fn from(kept: KeptHeights) -> Heights {
        match kept {
            KeptHeights::Keep => Heights::Keep,
            KeptHeights::Redraw => Heights::Redraw,
        }
    }
}

/// The surfaces of a stage, point by point of its grid.
pub fn surfaces<T: Table>(
    section: &Section<T>,
    problems: &mut Problems,
    mut surfaces: impl FnMut(&T, &mut Checks) -> Option<PlannedSurfaces>,
) -> Option<Vec<PlannedSurfaces>> {
    let mut checked =
        |point: &Point<T>| surfaces(&point.table, &mut Checks::of(section, point, problems));
    let planned: Vec<Option<_>> = section.points.iter().map(&mut checked).collect();
    let planned: Vec<_> = planned.into_iter().collect::<Option<_>>()?;
    let params = planned.iter().map(|surfaces| &surfaces.params);
    report_equal_points(section, params, problems);
    Some(planned)
}

/// A surface of which there is one.
pub fn single(
    heights: &Key<KeptHeights>,
    side: Option<PerAxis<f64>>,
    origin: Origin,
) -> PlannedSurfaces {
    PlannedSurfaces {
        params: Params {
            heights: heights.value().map_or(Heights::Keep, Heights::from),
            side,
            origin,
        },
        realizations: 1,
        growth: None,
        may_be_swept: false,
    }
}
