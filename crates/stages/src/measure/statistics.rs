//! Statistics of single surfaces: power spectra, autocorrelation, slopes and curvatures as
//! functions of the scale, bearing curve, roughness parameters.
//!
//! A table has one row for each surface and wavenumber, lag, scale or height, with the parameter
//! columns of the surface. Heights are not prepared further: surfaces are levelled, filled and
//! filtered when they are read. Maps that are not periodic are windowed only for spectra.

use std::f64::consts::TAU;

use arrow::array::ArrayRef;
use serde::Serialize;

use crate::StageError;
use crate::columns::*;
use crate::measure::areal::Areal;
use crate::measure::profile::Profile;
use crate::surface::Origin;
use crate::version::Version;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::autocorrelation::Autocorrelation;
use asperity_mechanics::topography::descriptors::Roughness;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::surface::{Axis, Surface};
use asperity_mechanics::topography::{differences, height_distribution, power_spectrum};
use asperity_tables::column::{Column, integers, optional_reals, reals, texts};

/// Statistic that is measured on one surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "of", rename_all = "kebab-case")]
pub enum Statistic {
    /// Power spectral density over rings of wavevectors.
    Spectrum {
        /// Version of the spectra of surfaces that have yielded. Omitted from the recipe for other
        /// surfaces, so that existing keys stay valid.
        #[serde(skip_serializing_if = "Option::is_none")]
        yielded_version: Option<u32>,
    },
    /// Power spectral density of profiles along x and y.
    ProfileSpectrum,
    /// Autocorrelation along x, along y, and averaged over all directions.
    Autocorrelation {
        /// Version of the numbers.
        version: u32,
    },
    /// Slope and curvature as functions of the scale, along x and y.
    Scales,
    /// Bearing curve (areal material ratio).
    Bearing {
        /// Number of intervals between planes.
        bins: u32,
        /// Height of the highest plane, in rms heights.
        range: f64,
    },
    /// Roughness parameters Sq, Sa, Sz, Ssk, Sku and Sdq of ISO 25178.
    Roughness,
    /// Selected parameters of ISO 25178.
    Areal(Areal),
    /// Parameters of a profile, ISO 21920-2.
    Profile(Profile),
    /// Power spectral density of a profile along x.
    SingleProfileSpectrum,
}

/// Version of the spectra of surfaces that have yielded.
pub const YIELDED_VERSION: Version =
    Version::new(1, &["the modes of a measured map that has yielded count as those of the map"]);

/// Version of the autocorrelation, which is part of its keys only.
pub const AUTOCORRELATION_VERSION: Version = Version::new(
    1,
    &["lag zero of the radial mean is the mean square height also where Δx and Δy differ by more \
       than a factor of two"],
);

/// Returns the columns of all statistics.
pub fn all_columns() -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    for statistic in Statistic::each() {
        let own = statistic.columns().into_iter();
        columns.extend(own.filter(|column| !columns.contains(column)).collect::<Vec<_>>());
    }
    columns
}

/// Measured columns, all of the same length.
type Measured = Vec<(Column, ArrayRef)>;

impl Statistic {
    /// The autocorrelation in its present version.
    pub const AUTOCORRELATION: Statistic =
        Statistic::Autocorrelation { version: AUTOCORRELATION_VERSION.number() };

    fn each() -> [Statistic; 8] {
        [
            Statistic::Spectrum { yielded_version: None },
            Statistic::ProfileSpectrum,
            Statistic::AUTOCORRELATION,
            Statistic::Scales,
            Statistic::Bearing { bins: 1, range: 1.0 },
            Statistic::Roughness,
            Statistic::Areal(Areal::all()),
            Statistic::Profile(Profile::ALL),
        ]
    }

    /// Returns the columns without the parameter columns of the surface.
    pub fn columns(&self) -> Vec<Column> {
        match self {
            Statistic::Spectrum { .. } => {
                vec![WAVENUMBER, MODES, DEGREES_OF_FREEDOM, SPECTRAL_DENSITY]
            }
            Statistic::ProfileSpectrum | Statistic::SingleProfileSpectrum => {
                vec![ALONG, WAVENUMBER, PROFILE_DENSITY]
            }
            Statistic::Autocorrelation { .. } => vec![ALONG, LAG, AUTOCORRELATION],
            Statistic::Scales => vec![ALONG, DISTANCE, SLOPE_AT_SCALE, CURVATURE_AT_SCALE],
            Statistic::Bearing { .. } => vec![BEARING_LEVEL, HEIGHT, BEARING_SHARE],
            Statistic::Roughness => ROUGHNESS.to_vec(),
            Statistic::Areal(areal) => areal.columns(),
            Statistic::Profile(profile) => profile.columns(),
        }
    }

    /// Measures a surface and returns the number of rows and the columns.
    ///
    /// # Errors
    /// If a profile is shorter than one of its sections.
    pub fn measure(
        &self,
        surface: &Surface,
        origin: &Origin,
    ) -> Result<(usize, Measured), StageError> {
        let boundary = if origin.is_open() { Boundary::Free } else { Boundary::Periodic };
        Ok(match self {
            Statistic::Spectrum { .. } => spectrum(surface, origin, boundary),
            Statistic::ProfileSpectrum => profile_spectrum(surface, boundary, &Axis::BOTH),
            Statistic::SingleProfileSpectrum => profile_spectrum(surface, boundary, &[Axis::X]),
            Statistic::Autocorrelation { .. } => autocorrelation(surface, boundary),
            Statistic::Scales => slopes_and_curvatures(surface, boundary),
            Statistic::Bearing { bins, range } => bearing_curve(surface, *bins, *range),
            Statistic::Roughness => roughness(surface, boundary),
            Statistic::Areal(areal) => (1, areal.measure(surface, boundary)),
            Statistic::Profile(profile) => (1, profile.measure(surface, origin)?),
        })
    }

    /// Returns the cost of the statistic, in pairs of FFTs (forward and inverse) on the mesh of the
    /// surface.
    pub fn pairs(&self) -> f64 {
        match self {
            Statistic::Autocorrelation { .. } => 5.0,
            Statistic::Areal(areal) => areal.pairs(),
            _ => 2.0,
        }
    }

    /// Returns the memory per node in bytes, without the surface.
    pub fn bytes_per_node(&self) -> f64 {
        match self {
            // A map that is not periodic is padded to four times its nodes, and transformed.
            Statistic::Autocorrelation { .. } | Statistic::Areal(_) => 100.0,
            _ => 28.0,
        }
    }
}

fn spectrum(surface: &Surface, origin: &Origin, boundary: Boundary) -> (usize, Measured) {
    let longer_side = surface.grid().cell().longer_side();
    let rings = power_spectrum::rings(surface, boundary);
    let independent = independent_fraction(origin);
    let columns = vec![
        (WAVENUMBER, reals(rings.iter().map(|ring| ring.wavenumber(longer_side)))),
        (MODES, integers(rings.iter().map(|ring| ring.modes.into()))),
        (DEGREES_OF_FREEDOM, reals(rings.iter().map(|ring| independent * f64::from(ring.modes)))),
        (SPECTRAL_DENSITY, reals(rings.iter().map(|ring| ring.density))),
    ];
    (rings.len(), columns)
}

/// Returns the number of independent real amplitudes per mode of a surface.
pub fn independent_fraction(origin: &Origin) -> f64 {
    match origin {
        // The modes of a mirrored map are real, and modes that are reflections of each other are
        // equal.
        Origin::File(file) if file.edges == Edges::Mirror => 0.25,
        Origin::Yielded(yielded) => independent_fraction(&yielded.body.origin),
        origin if origin.is_open() => power_spectrum::INDEPENDENT_FRACTION,
        _ => 1.0,
    }
}

fn profile_spectrum(surface: &Surface, boundary: Boundary, axes: &[Axis]) -> (usize, Measured) {
    let rows = axes.iter().flat_map(|&axis| {
        let side = axis.select(surface.grid().cell().size());
        let densities = power_spectrum::profiles(surface, axis, boundary);
        let waves = (1..).map(f64::from).zip(densities);
        waves.map(move |(waves, density)| (axis.name(), [TAU * waves / side, density]))
    });
    beside_direction(rows, [WAVENUMBER, PROFILE_DENSITY])
}

fn autocorrelation(surface: &Surface, boundary: Boundary) -> (usize, Measured) {
    let correlation = Autocorrelation::from_surface(surface, boundary);
    let spacing = surface.grid().spacing();
    let along_axes = Axis::BOTH.into_iter().flat_map(|axis| {
        let step = axis.select(spacing);
        let lags = (0..).map(f64::from).zip(correlation.along(axis));
        lags.map(move |(lag, value)| (axis.name(), [step * lag, value]))
    });
    let step = spacing[0].max(spacing[1]);
    let all = correlation.rings().into_iter();
    let rings = all.map(|ring| ("radial", [step * f64::from(ring.steps), ring.value]));
    beside_direction(along_axes.chain(rings), [LAG, AUTOCORRELATION])
}

fn slopes_and_curvatures(surface: &Surface, boundary: Boundary) -> (usize, Measured) {
    let rows = Axis::BOTH.into_iter().flat_map(|axis| {
        let step = axis.select(surface.grid().spacing());
        let scales = differences::along(surface, axis, boundary).into_iter();
        scales.map(move |scale| {
            let distance = step * scale.steps as f64;
            (axis.name(), [distance, scale.slope, scale.curvature])
        })
    });
    beside_direction(rows, [DISTANCE, SLOPE_AT_SCALE, CURVATURE_AT_SCALE])
}

fn bearing_curve(surface: &Surface, bins: u32, range: f64) -> (usize, Measured) {
    let levels = height_distribution::bearing_curve(surface, bins as usize, range);
    let columns = vec![
        (BEARING_LEVEL, reals(levels.iter().map(|level| level.level))),
        (HEIGHT, reals(levels.iter().map(|level| level.height))),
        (BEARING_SHARE, reals(levels.iter().map(|level| level.material_ratio))),
    ];
    (levels.len(), columns)
}

fn roughness(surface: &Surface, boundary: Boundary) -> (usize, Measured) {
    let Roughness { sq, sa, sz, ssk, sku, sdq, .. } = Roughness::from_surface(surface, boundary);
    let values = [Some(sq), Some(sa), Some(sz), ssk, sku, Some(sdq)];
    let columns =
        ROUGHNESS.into_iter().zip(values).map(|(column, value)| (column, optional_reals([value])));
    (1, columns.collect())
}

/// Returns the number of rows and the columns. The first column holds the direction of each row.
fn beside_direction<const N: usize>(
    rows: impl Iterator<Item = (&'static str, [f64; N])>,
    columns: [Column; N],
) -> (usize, Measured) {
    let (directions, values): (Vec<_>, Vec<_>) = rows.unzip();
    let count = directions.len();
    let mut measured = vec![(ALONG, texts(directions))];
    for (index, column) in columns.into_iter().enumerate() {
        measured.push((column, reals(values.iter().map(|row| row[index]))));
    }
    (count, measured)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::per_axis::PerAxis;
    use asperity_mechanics::grid::Grid;
    use asperity_mechanics::topography::shapes::Shape;

    #[test]
    fn every_statistic_has_the_columns_that_it_declares() {
        let shape = Shape::WaveSum { amplitude: 0.1, waves: 2 };
        let origin = Origin::Shape { nodes: PerAxis::same(16), shape, unit: String::new() };
        let surface = shape.draw(Grid::square(16, 1.0).unwrap());
        for statistic in Statistic::each() {
            let (rows, measured) = statistic.measure(&surface, &origin).unwrap();
            let columns: Vec<Column> = measured.iter().map(|(column, _)| *column).collect();
            assert_eq!(columns, statistic.columns());
            assert!(rows > 0);
            assert!(measured.iter().all(|(_, values)| values.len() == rows));
        }
    }

    #[test]
    fn a_statistic_is_serialised_by_its_name() {
        let written = |statistic: Statistic| {
            serde_json::to_string(&crate::measure::Params::Surface(statistic)).unwrap()
        };
        let spectrum = |yielded_version| written(Statistic::Spectrum { yielded_version });
        assert_eq!(spectrum(None), r#"{"of":"spectrum"}"#);
        assert_eq!(spectrum(Some(2)), r#"{"of":"spectrum","yielded_version":2}"#);
        let bearing = Statistic::Bearing { bins: 100, range: 4.0 };
        assert_eq!(written(bearing), r#"{"of":"bearing","bins":100,"range":4.0}"#);
    }
}
