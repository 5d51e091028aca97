//! Table rows that describe generated surfaces: parameter columns and roughness descriptors.

use arrow::array::ArrayRef;

use super::coordinates::{coordinates_of, descriptor};
use super::origin::{MeasuredSurface, ReadSurface};
use super::{Origin, Params};
use crate::columns::*;
use crate::table_columns::Values::{Count, OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column, column_if};
use asperity_mechanics::grid::{Boundary, Cell, Grid};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::descriptors::{Descriptors, skewness_and_excess_kurtosis};
use asperity_mechanics::topography::differences;
use asperity_mechanics::topography::moments::{Continuum, Moments};
use asperity_mechanics::topography::random::RandomSurface;
use asperity_mechanics::topography::reliability::{NoiseFloor, Reliability};
use asperity_mechanics::topography::surface::{Axis, Surface};
use asperity_tables::column::{Column, Value};

/// Roughness descriptors of a surface, for the row of the surface in a table.
pub struct Description {
    moments: Moments,
    rms_slope: f64,
    /// Effective number of modes of the surface; `None` for a map that is not periodic.
    effective_modes: Option<f64>,
    /// Expected values for a random self-affine surface; `None` for other surfaces.
    expected: Option<Expected>,
    /// Descriptors that need heights on a mesh; `None` for a surface described by its modes alone.
    seen: Option<Seen>,
}

/// Descriptors that need the heights of a surface.
pub struct Seen {
    skewness: Option<f64>,
    excess_kurtosis: Option<f64>,
    /// Load of full contact in units of E* × `rms_slope`; `None` if no formula gives it.
    full_contact_load: Option<f64>,
}

/// Spectral moments that a random self-affine surface has on average, and its roll-off wavenumber.
pub struct Expected {
    /// Moments for a continuous spectrum; `None` for an anisotropic spectrum, which has no closed
    /// form.
    continuum: Option<Continuum>,
    k_rolloff: f64,
    /// Moments summed over the discrete modes of the cell, with the expected power of each mode.
    lattice: Moments,
}

impl Description {
    /// Describes a random self-affine surface by its modes, independently of any mesh.
    pub fn from_modes(surface: &RandomSurface, cell: Cell) -> Description {
        let (moments, lattice) = surface.realized_and_expected_moments(cell);
        Description {
            moments,
            // The scaled surface has this slope up to rounding. Rows of one spectrum must be equal.
            rms_slope: surface.rms_slope,
            effective_modes: Some(moments.effective_modes()),
            expected: Some(Expected {
                continuum: match surface.spectrum.anisotropy {
                    Some(_) => None,
                    None => Some(surface.spectrum.continuum()),
                },
                k_rolloff: f64::from(surface.spectrum.k_rolloff),
                lattice,
            }),
            seen: None,
        }
    }

    /// Describes a surface by its heights. A random self-affine surface is also described by its
    /// modes.
    pub fn from_surface(origin: &Origin, surface: &Surface, threads: &Threads) -> Description {
        if origin.is_profile() {
            return Description::from_profile(surface);
        }
        if origin.is_open() {
            return Description::from_open_map(surface);
        }
        let seen = Descriptors::from_surface_on(threads, surface);
        let known = match origin {
            Origin::Random { .. } => {
                let cell = surface.grid().cell();
                let drawn = origin.random_surface(cell).expect("the origin is random");
                Description::from_modes(&drawn, cell)
            }
            _ => Description {
                moments: seen.moments,
                // The slope of a scaled surface differs from the given one only by rounding.
                rms_slope: origin.given_rms_slope().unwrap_or(seen.rms_slope),
                effective_modes: Some(seen.moments.effective_modes()),
                expected: None,
                seen: None,
            },
        };
        // The slope on the mesh may differ slightly from that of the modes.
        let unit = if known.rms_slope > 0.0 { seen.rms_slope / known.rms_slope } else { 1.0 };
        Description {
            seen: Some(Seen {
                skewness: seen.skewness,
                excess_kurtosis: seen.excess_kurtosis,
                full_contact_load: Some(seen.full_contact_load * unit),
            }),
            ..known
        }
    }

    /// Describes a profile by the differences between neighbouring points.
    fn from_profile(surface: &Surface) -> Description {
        let scales = differences::along(surface, Axis::X, Boundary::Free);
        let rms_slope = scales.first().map_or(0.0, |neighbours| neighbours.slope);
        // The other moments are zero: the profile has no differences across its line.
        let moments = Moments { m20: rms_slope * rms_slope, ..differences::moments(surface) };
        let (skewness, excess_kurtosis) = skewness_and_excess_kurtosis(surface).unzip();
        Description {
            moments,
            rms_slope,
            effective_modes: None,
            expected: None,
            seen: Some(Seen { skewness, excess_kurtosis, full_contact_load: None }),
        }
    }

    /// Describes a map that is not periodic, by finite differences.
    fn from_open_map(surface: &Surface) -> Description {
        let moments = differences::moments(surface);
        let (skewness, excess_kurtosis) = skewness_and_excess_kurtosis(surface).unzip();
        Description {
            moments,
            rms_slope: moments.rms_slope(),
            effective_modes: None,
            expected: None,
            seen: Some(Seen { skewness, excess_kurtosis, full_contact_load: None }),
        }
    }

    /// Returns the columns and values of the row of a surface.
    pub fn row(&self, params: &Params, grid: Grid) -> Vec<(Column, ArrayRef)> {
        let cell = grid.cell();
        let coordinates = coordinates_of(params, grid.nodes(), cell.size(), Some(self.rms_slope));
        let one_row = |(column, value): (Column, Value)| (column, value.repeated(1));
        let mut columns: Vec<(Column, ArrayRef)> = coordinates.into_iter().map(one_row).collect();
        let &Description { ref moments, effective_modes, ref seen, .. } = self;
        let described = Described { moments, effective_modes, seen: seen.as_ref(), cell };
        columns.extend(descriptors().filled(&params.origin, &[described]));
        for (column, _) in &mut columns {
            *column = descriptor(&params.origin, *column);
        }
        if let Some(expected) = &self.expected {
            columns.extend(spectrum_descriptors().filled(&(), &[(expected, cell)]));
        }
        columns
    }
}

/// A description of a surface on a cell.
pub struct Described<'a> {
    moments: &'a Moments,
    effective_modes: Option<f64>,
    seen: Option<&'a Seen>,
    cell: Cell,
}

/// Returns the columns of the moments and descriptors of a surface. A given rms height is among the
/// coordinates instead.
pub fn descriptors<'a>() -> TableColumns<Origin, Described<'a>> {
    TableColumns::<Origin, Described>::new([
        column(M00, Real(|row| row.moments.m00)),
        column(M20, Real(|row| row.moments.m20)),
        column_if(is_map, M02, Real(|row| row.moments.m02)),
        column_if(is_map, M22, Real(|row| row.moments.m22)),
        column_if(is_map, M40, Real(|row| row.moments.m40)),
        column_if(is_map, M04, Real(|row| row.moments.m04)),
        column_if(is_map, NAYAK, OptionalReal(|row| row.moments.nayak())),
        column_if(is_map, SUMMIT_DENSITY, Real(|row| row.moments.summit_density())),
        column_if(
            is_map,
            SUMMIT_DENSITY_INTEGER,
            Real(|row| row.moments.summit_density_integer(row.cell)),
        ),
        column_if(
            |origin| origin.given_rms_height().is_none(),
            RMS_HEIGHT,
            Real(|row| row.moments.rms_height()),
        ),
        column(SKEWNESS, OptionalReal(|row| row.seen?.skewness)),
        column(EXCESS_KURTOSIS, OptionalReal(|row| row.seen?.excess_kurtosis)),
        column_if(is_map, EFFECTIVE_MODES, OptionalReal(|row| row.effective_modes)),
        column_if(is_map, FULL_CONTACT_LOAD, OptionalReal(|row| row.seen?.full_contact_load)),
    ])
}

/// Returns whether a surface is a map. Profiles have no statistics across their line.
fn is_map(origin: &Origin) -> bool {
    !origin.is_profile()
}

/// Returns the columns of descriptors that follow from the prescribed spectrum of a random surface,
/// without the heights.
pub fn spectrum_descriptors<'a>() -> TableColumns<(), (&'a Expected, Cell)> {
    TableColumns::<(), (&Expected, Cell)>::new([
        column(NAYAK_CONTINUUM, OptionalReal(|(of, _)| Some(of.continuum?.nayak()))),
        column(
            SUMMIT_DENSITY_CONTINUUM,
            OptionalReal(|(of, _)| Some(of.continuum?.summit_density(of.k_rolloff))),
        ),
        column(NAYAK_LATTICE, OptionalReal(|(of, _)| of.lattice.nayak())),
        column(SUMMIT_DENSITY_LATTICE, Real(|(of, cell)| of.lattice.summit_density_integer(*cell))),
        column(EFFECTIVE_MODES_LATTICE, Real(|(of, _)| of.lattice.effective_modes())),
    ])
}

/// Returns the columns of the heights of a surface with a prescribed height distribution, whose
/// rows hold the deviation from it.
pub fn height_columns() -> TableColumns<Origin, Option<f64>> {
    TableColumns::<Origin, Option<f64>>::new([column_if(
        |origin| origin.prescribed_heights().is_some(),
        HEIGHT_DEVIATION,
        OptionalReal(|deviation| *deviation),
    )])
}

/// A measured surface as its recipe describes it, and as it was read.
type InFile<'a> = (&'a MeasuredSurface, &'a ReadSurface);

/// Returns the columns that describe the file of a surface, and the wavelengths that the instrument
/// resolved. A NumPy array only has a number of filled nodes.
pub fn file_columns<'a>() -> TableColumns<MeasuredSurface, InFile<'a>> {
    TableColumns::<MeasuredSurface, InFile>::new([
        column_if(
            |file| file.reader.is_some(),
            FORMAT,
            Text(|(file, _)| file.reader.as_ref().map_or("", |reader| &reader.format)),
        ),
        column_if(
            |file| file.reader.is_some(),
            CHANNEL_READ,
            Text(|(_, found)| &found.channel.name),
        ),
        column_if(|file| file.reader.is_some(), CHANNELS, Count(|(_, found)| found.channel.of)),
        column_if(
            |file| file.preparation.spikes.is_some(),
            REMOVED_SPIKES,
            Count(|(_, found)| found.prepared.removed.spikes),
        ),
        column_if(
            |file| file.preparation.islands.is_some(),
            REMOVED_ISLANDS,
            Count(|(_, found)| found.prepared.removed.islands),
        ),
        column_if(
            |file| file.preparation.fill.is_some(),
            FILLED_NODES,
            Count(|(_, found)| found.prepared.filled),
        ),
        column_if(
            |file| file.preparation.tip_radius.is_some(),
            TIP_WAVELENGTH,
            OptionalReal(|file| limit(file)?.tip),
        ),
        column_if(
            finds_noise,
            NOISE_WAVELENGTH,
            OptionalReal(|file| Some(noise(file)?.wavelength)),
        ),
        column_if(
            finds_noise,
            NOISE_RMS_HEIGHT,
            OptionalReal(|file| Some(noise(file)?.rms_height)),
        ),
        column_if(
            is_tested,
            RELIABLE_WAVELENGTH,
            OptionalReal(|file| Some(limit(file)?.wavelength)),
        ),
        column_if(is_tested, RMS_SLOPE_RELIABLE, OptionalReal(|file| Some(limit(file)?.rms_slope))),
        column_if(
            is_tested,
            UNRELIABLE_SHARE,
            OptionalReal(|file| Some(limit(file)?.unreliable_share)),
        ),
    ])
}

fn finds_noise(file: &MeasuredSurface) -> bool {
    file.preparation.noise_floor
}

fn is_tested(file: &MeasuredSurface) -> bool {
    file.preparation.tests_reliability()
}

fn limit((_, found): &InFile) -> Option<Reliability> {
    found.prepared.reliability
}

fn noise(file: &InFile) -> Option<NoiseFloor> {
    limit(file)?.noise
}
