//! The methods of `generate` stages, each with its table of keys.

use toml::de::DeTable;

use super::files::FileTable;
use super::growth::{Growing, PlannedSurfaces, Realizations};
use super::random::RandomTable;
use super::shapes::{ParaboloidTable, PunchTable, WaveShape, WaveTable};
use super::spectrum::SpectrumTable;
use super::yielded::YieldedTable;
use super::{Heights, Origin, Params, PerAxis, files, random, shapes, spectrum, yielded};
use crate::form::FromKey;
use crate::{CheckContext, Reads, RowKind};
use asperity_contact::topography::random::Amplitude;
use asperity_contact::topography::shapes::Shape;
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::{GridPoint, KeyTable, Layout, Section, reader};

/// The value of the key `method`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Random self-affine surfaces, whose modes have random or deterministic amplitudes.
    Random(Amplitude),
    /// Random surfaces with a given power spectral density.
    Spectrum,
    /// Measured surfaces, which are read from files.
    File,
    /// Surfaces that have yielded in a contact.
    Yielded,
    /// A paraboloid, for comparison with Hertz contact.
    Paraboloid,
    /// A wave, or the product or sum of two waves.
    Wave(WaveShape),
    /// A flat circular punch.
    FlatPunch,
}

/// Parameter points of a `generate` stage, by method.
#[derive(Debug)]
pub enum SurfacePoints {
    Random(Amplitude, Section<RandomTable>),
    Spectrum(Section<SpectrumTable>),
    File(Section<FileTable>),
    Yielded(Section<YieldedTable>),
    Paraboloid(Section<ParaboloidTable>),
    Wave(WaveShape, Section<WaveTable>),
    FlatPunch(Section<PunchTable>),
}

impl Method {
    /// All methods, in the order of the documentation; the first one is the default.
    pub const ALL: [Method; 10] = [
        Method::Random(Amplitude::Gaussian),
        Method::Random(Amplitude::Deterministic),
        Method::Spectrum,
        Method::File,
        Method::Yielded,
        Method::Paraboloid,
        Method::Wave(WaveShape::Single),
        Method::Wave(WaveShape::Product),
        Method::Wave(WaveShape::Sum),
        Method::FlatPunch,
    ];

    /// Returns the value of `method` in manifests.
    pub fn word(self) -> &'static str {
        match self {
            Method::Random(Amplitude::Gaussian) => "filter",
            Method::Random(Amplitude::Deterministic) => "random-phase",
            Method::Spectrum => "spectrum",
            Method::File => "file",
            Method::Yielded => "yielded",
            Method::Paraboloid => "paraboloid",
            Method::Wave(WaveShape::Single) => "wave",
            Method::Wave(WaveShape::Product) => "wave-product",
            Method::Wave(WaveShape::Sum) => "wave-sum",
            Method::FlatPunch => "flat-punch",
        }
    }

    /// Returns whether the surfaces are shapes with closed-form solutions, and not rough.
    pub fn is_shape(self) -> bool {
        matches!(self, Method::Paraboloid | Method::Wave(_) | Method::FlatPunch)
    }

    /// Returns the method that makes surfaces of this origin.
    pub fn from_origin(origin: &Origin) -> Method {
        match origin {
            Origin::Random { surface, .. } => Method::Random(surface.amplitude),
            Origin::Spectrum { .. } => Method::Spectrum,
            Origin::File(_) => Method::File,
            Origin::Pair(pair) => Method::from_origin(&pair.body.origin),
            Origin::Yielded(_) => Method::Yielded,
            Origin::Shape { shape, .. } => match shape {
                Shape::Paraboloid { .. } => Method::Paraboloid,
                Shape::Wave { .. } => Method::Wave(WaveShape::Single),
                Shape::WaveProduct { .. } => Method::Wave(WaveShape::Product),
                Shape::WaveSum { .. } => Method::Wave(WaveShape::Sum),
                Shape::Punch { .. } => Method::FlatPunch,
            },
        }
    }

    /// Returns the description of the method for editors and the guide.
    pub fn about(self) -> &'static str {
        match self {
            Method::Random(Amplitude::Gaussian) => {
                "Random self-affine surfaces with a plateau up to `k_rolloff` and a power law up to \
                 `k_upper`. The modes have complex Gaussian amplitudes whose mean power is the \
                 spectrum."
            }
            Method::Random(Amplitude::Deterministic) => {
                "Random self-affine surfaces with random phases. Each mode has exactly the power of the \
                 spectrum."
            }
            Method::Spectrum => {
                "Gaussian random surfaces with a given isotropic power spectral density C(q), \
                 normalised so that ∫ C d²q/(2π)² is their mean square height."
            }
            Method::File => {
                "A measured surface, read from the file of an instrument. Its keys are applied in this \
                 order: channel, unit and side, `crop`, `spikes`, `islands`, `align`, `level` or \
                 `level_through`, `fill`, `tip_radius` and `noise_floor`, `high_pass`, `low_pass`, \
                 `resample`, `edges`."
            }
            Method::Yielded => {
                "Surfaces that keep their plastic depth after a `solve` stage with a `hardness`, \
                 which `from` names. They can be measured, and pressed again to study running-in."
            }
            Method::Paraboloid => "Paraboloid −r²/(2R), for comparison with Hertz contact.",
            Method::Wave(WaveShape::Single) => {
                "Wave Δ cos(2πnx/L), for comparison with the solution of Westergaard."
            }
            Method::Wave(WaveShape::Product) => {
                "Product of waves Δ cos(2πnx/L) cos(2πny/L), for comparison with the solution of \
                 Johnson, Greenwood & Higginson."
            }
            Method::Wave(WaveShape::Sum) => {
                "Sum of waves Δ (cos(2πnx/L) + cos(2πny/L)): `\"wave-product\"` turned by 45°."
            }
            Method::FlatPunch => "Flat circular punch in the middle of the cell.",
        }
    }

    /// Returns whether stages with this method have a key `from`.
    pub fn from_key(self) -> FromKey {
        match self {
            Method::Spectrum => FromKey::Optional,
            Method::Yielded => FromKey::Required,
            _ => FromKey::Absent,
        }
    }

    /// Returns the declarations of the keys of this method.
    pub fn layout(self) -> &'static Layout {
        match self {
            Method::Random(_) => RandomTable::layout(),
            Method::Spectrum => SpectrumTable::layout(),
            Method::File => FileTable::layout(),
            Method::Yielded => YieldedTable::layout(),
            Method::Paraboloid => ParaboloidTable::layout(),
            Method::Wave(_) => WaveTable::layout(),
            Method::FlatPunch => PunchTable::layout(),
        }
    }

    /// Reads the table of a stage with this method.
    pub fn read(
        self,
        table: DeTable,
        span: Span,
        expected: &ExpectedKeys<'_>,
        problems: &mut Problems,
    ) -> SurfacePoints {
        use SurfacePoints as Points;
        match self {
            Method::Random(amplitude) => {
                Points::Random(amplitude, reader::read(table, span, expected, problems))
            }
            Method::Spectrum => Points::Spectrum(reader::read(table, span, expected, problems)),
            Method::File => Points::File(reader::read(table, span, expected, problems)),
            Method::Yielded => Points::Yielded(reader::read(table, span, expected, problems)),
            Method::Paraboloid => Points::Paraboloid(reader::read(table, span, expected, problems)),
            Method::Wave(shape) => {
                Points::Wave(shape, reader::read(table, span, expected, problems))
            }
            Method::FlatPunch => Points::FlatPunch(reader::read(table, span, expected, problems)),
        }
    }
}

impl SurfacePoints {
    /// Returns the surfaces of each parameter point, or `None` after reporting problems.
    pub fn surfaces(&self, context: &mut CheckContext) -> Option<Vec<PlannedSurfaces>> {
        match self {
            SurfacePoints::Random(amplitude, section) => {
                random::random(*amplitude, section, context)
            }
            SurfacePoints::Spectrum(section) => spectrum::spectra(section, context),
            SurfacePoints::File(section) => files::files(section, context),
            SurfacePoints::Yielded(section) => yielded::surfaces(section, context),
            SurfacePoints::Paraboloid(section) => shapes::paraboloid(section, context.problems),
            SurfacePoints::Wave(shape, section) => shapes::wave(*shape, section, context.problems),
            SurfacePoints::FlatPunch(section) => shapes::punch(section, context.problems),
        }
    }

    /// Returns whether surfaces of the stage are described by their modes alone and have no
    /// heights.
    pub fn lack_heights(&self) -> bool {
        let SurfacePoints::Random(_, section) = self else {
            return false;
        };
        section.points.iter().any(|point| point.table.heights.value() == Some(Heights::None))
    }

    /// Returns the kinds of rows that the method reads from other stages, or `None` if it reads no
    /// stage.
    pub fn reads(&self) -> Option<Reads> {
        match self {
            SurfacePoints::Spectrum(_) => Some(Reads {
                rows: &[RowKind::PowerSpectra],
                from:
                    "`measure` stages with `what = \"spectrum\"` or `\"stitched-spectrum\"`, where \
                       its method is `spectrum`"
                        .into(),
            }),
            SurfacePoints::Yielded(_) => Some(Reads {
                rows: &[RowKind::Loads],
                from: "`solve` stages, where its method is `yielded`".into(),
            }),
            _ => None,
        }
    }

    /// Returns the keys of adaptive sampling, or `None` for a fixed number of surfaces. All
    /// parameter points of the stage share these keys.
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

/// Applies `surfaces` to each parameter point and reports points with equal parameters. Returns
/// `None` if the surfaces of a point could not be determined.
pub fn surfaces<T: KeyTable>(
    section: &Section<T>,
    problems: &mut Problems,
    mut surfaces: impl FnMut(&T, &mut Checks) -> Option<PlannedSurfaces>,
) -> Option<Vec<PlannedSurfaces>> {
    let mut checked =
        |point: &GridPoint<T>| surfaces(&point.table, &mut Checks::new(section, point, problems));
    let planned: Vec<Option<_>> = section.points.iter().map(&mut checked).collect();
    let planned: Vec<_> = planned.into_iter().collect::<Option<_>>()?;
    let params = planned.iter().map(|surfaces| &surfaces.params);
    report_equal_points(section, params, problems);
    Some(planned)
}

/// Plans a single surface, for files and shapes, which have no realizations.
pub fn single(heights: Heights, side: Option<PerAxis<f64>>, origin: Origin) -> PlannedSurfaces {
    PlannedSurfaces {
        params: Params { heights, side, origin },
        realizations: 1,
        growth: None,
        may_be_swept: false,
    }
}
