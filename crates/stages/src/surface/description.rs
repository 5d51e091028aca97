//! Table rows that describe generated surfaces: parameter columns and roughness descriptors.

use arrow::array::ArrayRef;

use super::coordinates::{coordinates_of, descriptor};
use super::origin::{MeasuredSurface, ReadSurface};
use super::{Origin, Params};
use crate::columns::*;
use asperity_contact::grid::{Cell, Grid};
use asperity_contact::threads::Threads;
use asperity_contact::topography::descriptors::{Descriptors, skewness_and_excess_kurtosis};
use asperity_contact::topography::differences;
use asperity_contact::topography::moments::{Continuum, Moments};
use asperity_contact::topography::preparation::{Preparation, Prepared};
use asperity_contact::topography::random::RandomSurface;
use asperity_contact::topography::reliability::Reliability;
use asperity_contact::topography::surface::Surface;
use asperity_tables::column::{Column, Value, integers, optional_reals, texts};

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
struct Seen {
    skewness: Option<f64>,
    excess_kurtosis: Option<f64>,
    /// Load of full contact in units of E* × `rms_slope`; `None` if no formula gives it.
    full_contact_load: Option<f64>,
}

/// Spectral moments that a random self-affine surface has on average, and its roll-off wavenumber.
struct Expected {
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
            Origin::Spectrum { .. }
            | Origin::File(_)
            | Origin::Shape { .. }
            | Origin::Pair(_)
            | Origin::Yielded(_) => Description {
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
        let rms_slope = Some(self.rms_slope);
        let coordinates =
            coordinates_of(params, grid.nodes(), grid.cell().size(), rms_slope).into_iter();
        let cell = |(column, value): (Column, Value)| (column, value.repeated(1));
        let mut columns: Vec<(Column, ArrayRef)> = coordinates.map(cell).collect();
        let described = self.descriptors(grid.cell());
        let pairs = DESCRIPTORS.into_iter().zip(described);
        // A given rms height is among the coordinates.
        let described = pairs.filter(|(column, _)| {
            *column != RMS_HEIGHT || params.origin.given_rms_height().is_none()
        });
        columns.extend(described.map(|(column, value)| {
            (descriptor(Some(&params.origin), column), optional_reals([value]))
        }));
        if let Some(expected) = &self.expected {
            let values = expected.values(grid.cell()).map(|value| optional_reals([value]));
            columns.extend(SPECTRUM_DESCRIPTORS.into_iter().zip(values));
        }
        columns
    }

    /// Returns the values of [`DESCRIPTORS`], in their order.
    fn descriptors(&self, cell: Cell) -> [Option<f64>; 14] {
        let moments = &self.moments;
        let seen = self.seen.as_ref();
        [
            Some(moments.m00),
            Some(moments.m20),
            Some(moments.m02),
            Some(moments.m22),
            Some(moments.m40),
            Some(moments.m04),
            moments.nayak(),
            Some(moments.summit_density()),
            Some(moments.summit_density_integer(cell)),
            Some(moments.rms_height()),
            seen.and_then(|seen| seen.skewness),
            seen.and_then(|seen| seen.excess_kurtosis),
            self.effective_modes,
            seen.and_then(|seen| seen.full_contact_load),
        ]
    }
}

impl Expected {
    /// Returns the values of [`SPECTRUM_DESCRIPTORS`], in their order.
    fn values(&self, cell: Cell) -> [Option<f64>; 5] {
        [
            self.continuum.map(|continuum| continuum.nayak()),
            self.continuum.map(|continuum| continuum.summit_density(self.k_rolloff)),
            self.lattice.nayak(),
            Some(self.lattice.summit_density_integer(cell)),
            Some(self.lattice.effective_modes()),
        ]
    }
}

/// Returns the columns that describe the file of a surface. A NumPy array only has a number of
/// filled nodes.
pub fn columns_of_file(origin: &Origin) -> Vec<Column> {
    let Origin::File(file) = origin else {
        return vec![];
    };
    let mut columns = Vec::new();
    if file.reader.is_some() {
        columns.extend([FORMAT, CHANNEL_READ, CHANNELS]);
    }
    let Preparation { spikes, islands, fill, .. } = &file.preparation;
    columns.extend(spikes.is_some().then_some(REMOVED_SPIKES));
    columns.extend(islands.is_some().then_some(REMOVED_ISLANDS));
    columns.extend(fill.is_some().then_some(FILLED_NODES));
    let reliability = columns_of_reliability(&file.preparation).into_iter();
    columns.extend(reliability.map(|(column, _)| column));
    columns
}

/// Returns the columns of the wavelengths that the instrument resolved, with their values, if the
/// manifest asks for them.
fn columns_of_reliability(preparation: &Preparation) -> Vec<(Column, ReliabilityValue)> {
    let mut columns: Vec<(Column, ReliabilityValue)> = Vec::new();
    if preparation.tip_radius.is_some() {
        columns.push((TIP_WAVELENGTH, |found| found.tip));
    }
    if preparation.noise_floor {
        columns.push((NOISE_WAVELENGTH, |found| found.noise.map(|noise| noise.wavelength)));
        columns.push((NOISE_RMS_HEIGHT, |found| found.noise.map(|noise| noise.rms_height)));
    }
    if preparation.tests_reliability() {
        columns.push((RELIABLE_WAVELENGTH, |found| Some(found.wavelength)));
        columns.push((RMS_SLOPE_RELIABLE, |found| Some(found.rms_slope)));
        columns.push((UNRELIABLE_SHARE, |found| Some(found.unreliable_share)));
    }
    columns
}

/// Function that returns the value of a column of the reliability of a map.
type ReliabilityValue = fn(&Reliability) -> Option<f64>;

/// Returns the columns that describe the file of a surface, with their values.
pub fn found_in_file(file: &MeasuredSurface, found: &ReadSurface) -> Vec<(Column, ArrayRef)> {
    let mut columns = Vec::new();
    if let Some(reader) = &file.reader {
        columns.push((FORMAT, texts([&reader.format])));
        columns.push((CHANNEL_READ, texts([&found.channel.name])));
        columns.push((CHANNELS, integers([found.channel.of as i64])));
    }
    let Prepared { removed, filled, .. } = &found.prepared;
    let Preparation { spikes, islands, fill, .. } = &file.preparation;
    let counts = [
        (REMOVED_SPIKES, spikes.is_some(), removed.spikes),
        (REMOVED_ISLANDS, islands.is_some(), removed.islands),
        (FILLED_NODES, fill.is_some(), *filled),
    ];
    let given = counts.into_iter().filter(|(_, is_given, _)| *is_given);
    columns.extend(given.map(|(column, _, count)| (column, integers([count as i64]))));
    if let Some(reliability) = &found.prepared.reliability {
        let values = columns_of_reliability(&file.preparation).into_iter();
        columns
            .extend(values.map(|(column, value)| (column, optional_reals([value(reliability)]))));
    }
    columns
}
