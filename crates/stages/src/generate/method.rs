//! The ways to make surfaces, and the keys of each.

use toml::de::DeTable;

use super::checks::{self, WaveShape};
use super::files;
use super::files::keys::FileTable;
use super::growth::PlannedSurfaces;
use super::keys::{
    Growing, ParaboloidTable, PunchTable, RandomHeights, RandomTable, Realizations, WaveTable,
};
use super::spectrum_checks;
use super::spectrum_keys::SpectrumTable;
use crate::{Given, Reads, Rows};
use asperity_contact::topography::random::Amplitude;
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::written::advice::Wanted;
use asperity_manifest::written::{Layout, Section, Table, reader};

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
            SurfacePoints::Random(amplitude, section) => checks::random(*amplitude, section, given),
            SurfacePoints::Spectrum(section) => spectrum_checks::spectra(section, given),
            SurfacePoints::File(section) => files::files(section, given),
            SurfacePoints::Paraboloid(section) => checks::paraboloid(section, given.problems),
            SurfacePoints::Wave(shape, section) => checks::wave(*shape, section, given.problems),
            SurfacePoints::FlatPunch(section) => checks::punch(section, given.problems),
        }
    }

    /// Whether none of the surfaces can be pressed: they are described by their modes alone.
    pub fn lack_heights(&self) -> bool {
        let SurfacePoints::Random(_, section) = self else {
            return false;
        };
        let mut heights = section.points.iter().map(|point| &point.table.heights);
        heights.any(|key| key.written().map(|heights| heights.value) == Some(RandomHeights::None))
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
