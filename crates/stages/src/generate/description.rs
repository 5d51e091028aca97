//! Table rows that describe generated surfaces: parameter columns and roughness descriptors.

use arrow::array::ArrayRef;

use super::method::Method;
use super::origin::ReadSurface;
use super::pair::descriptor;
use super::spectrum::Source;
use super::{MeasuredSurface, Origin, Params};
use crate::columns::*;
use crate::grids;
use asperity_contact::grid::{Cell, Grid};
use asperity_contact::threads::Threads;
use asperity_contact::topography::alignment::{Alignment, LineFit};
use asperity_contact::topography::descriptors::{Descriptors, skewness_and_excess_kurtosis};
use asperity_contact::topography::differences;
use asperity_contact::topography::level::ThreePoints;
use asperity_contact::topography::moments::{Continuum, Moments};
use asperity_contact::topography::outliers::Spikes;
use asperity_contact::topography::periodic::Edges;
use asperity_contact::topography::preparation::{
    Crop, FoundCutoff, LowPass, Preparation, Prepared,
};
use asperity_contact::topography::random::RandomSurface;
use asperity_contact::topography::reliability::Reliability;
use asperity_contact::topography::shapes::Shape;
use asperity_contact::topography::surface::Surface;
use asperity_tables::column::{Column, Role, Value, integers, optional_reals, texts};

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
        let described = DESCRIPTORS.into_iter().zip(described);
        // A given rms height is among the coordinates.
        let described = described.filter(|(column, _)| {
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

/// Returns the parameter columns of a surface with their values, as far as they are known before
/// the surface is drawn.
pub fn coordinates(params: &Params) -> Vec<(Column, Value)> {
    let rms_slope = params.origin.given_rms_slope();
    let mut coordinates = coordinates_of(params, params.nodes(), params.size(), rms_slope);
    if is_unread(&params.origin) {
        // The name of the surface depends on the table that it reads.
        coordinates.retain(|(column, _)| *column != SURFACE);
    }
    coordinates
}

/// Returns whether the spectrum of a surface comes from the table of another task and has not been
/// read yet.
fn is_unread(origin: &Origin) -> bool {
    matches!(origin, Origin::Spectrum { surface, .. } if surface.source.is_unread())
}

/// Returns the columns of nodes and sides.
pub fn columns_of_grid(params: &Params) -> Vec<Column> {
    let cells = grids::coordinates(params.nodes(), params.size()).into_iter();
    cells.map(|(column, _)| column).collect()
}

/// Returns the column of the rms slope. The meaning of the column states how the slope is computed.
pub fn column_of_slope(origin: &Origin) -> Column {
    let is_random = matches!(origin, Origin::Random { .. } | Origin::Spectrum { .. });
    match origin {
        Origin::Pair(_) | Origin::Yielded(_) if origin.is_open() => {
            RMS_SLOPE_OF_DIFFERENCES.with_role(Role::Surface)
        }
        Origin::Pair(_) | Origin::Yielded(_) => RMS_SLOPE_OF_SURFACE,
        _ if is_random && origin.given_rms_slope().is_none() => RMS_SLOPE_OF_SURFACE,
        _ if origin.is_open() => RMS_SLOPE_OF_DIFFERENCES,
        _ => RMS_SLOPE,
    }
}

/// Returns the parameter columns of a surface with their values, in the order of the table.
fn coordinates_of(
    params: &Params,
    nodes: [usize; 2],
    size: [f64; 2],
    rms_slope: Option<f64>,
) -> Vec<(Column, Value)> {
    let mut coordinates = vec![
        (SURFACE, Value::Text(params.surface_key().to_string())),
        (METHOD, Value::Text(Method::from_origin(&params.origin).word().to_owned())),
    ];
    coordinates.extend(grids::coordinates(nodes, size));
    let slope = column_of_slope(&params.origin);
    coordinates.extend(rms_slope.map(|value| (slope, Value::Real(value))));
    coordinates.extend(own_coordinates(&params.origin));
    coordinates
}

/// Returns the parameter columns of the preparation, with their values. Only keys that the manifest
/// contains have a column.
fn preparation_coordinates(preparation: &Preparation) -> Vec<(Column, Value)> {
    let mut columns = Vec::new();
    if let Some(Crop { from, size }) = preparation.crop {
        let lengths = [from[0], from[1], size[0], size[1]].map(Value::Real);
        let names = [CROP_FROM_X, CROP_FROM_Y, CROP_SIZE_X, CROP_SIZE_Y];
        columns.extend(names.into_iter().zip(lengths));
    }
    let word = |column: Column, word: &str| (column, Value::Text(word.to_owned()));
    let length = |column: Column, length: f64| (column, Value::Real(length));
    let whole = |column: Column, value: u32| (column, Value::Integer(i64::from(value)));
    if let Some(Spikes { threshold, window }) = preparation.spikes {
        columns.extend([length(SPIKES, threshold), whole(SPIKE_WINDOW, window)]);
    }
    columns.extend(preparation.islands.map(|islands| whole(ISLANDS, islands)));
    if let Some(Alignment { along, by }) = preparation.align {
        columns.extend([word(ALIGN, by.name()), word(ALIGN_ALONG, along.name())]);
        if let LineFit::Polynomial { degree } = by {
            columns.push(whole(ALIGN_DEGREE, degree));
        }
    }
    columns.extend(preparation.level.map(|level| word(LEVEL, level.name())));
    if let Some(ThreePoints { a, b, c }) = preparation.level_through {
        columns
            .extend(LEVEL_THROUGH.into_iter().zip([a, b, c].concat().into_iter().map(Value::Real)));
    }
    columns.extend(preparation.fill.map(|fill| word(FILL, fill.name())));
    columns.extend(preparation.high_pass.map(|cutoff| length(HIGH_PASS, cutoff)));
    columns.extend(preparation.low_pass.map(|cutoff| match cutoff {
        LowPass::Wavelength(cutoff) => length(LOW_PASS, cutoff),
        LowPass::Found(FoundCutoff::Reliable) => word(LOW_PASS_AT, "reliable"),
    }));
    if let Some(nodes) = preparation.resample {
        let nodes = nodes.map(|nodes| Value::Integer(i64::from(nodes)));
        columns.extend([RESAMPLED_X, RESAMPLED_Y].into_iter().zip(nodes));
    }
    columns.extend(preparation.tip_radius.map(|radius| length(TIP_RADIUS, radius)));
    columns
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

/// Returns the parameter columns of the method that makes the surface, such as `hurst` and `seed`,
/// with their values. Columns that all surfaces have are left out.
pub fn own_coordinates(origin: &Origin) -> Vec<(Column, Value)> {
    let whole = |column: Column, value: u32| (column, Value::Integer(i64::from(value)));
    let real = |column: Column, value: f64| (column, Value::Real(value));
    let text = |column: Column, value: String| (column, Value::Text(value));
    match origin {
        Origin::Random { surface, has_unit_ratio, unit, .. } => {
            let mut columns = height_and_unit(origin, unit);
            columns.extend([
                real(HURST, surface.spectrum.hurst),
                whole(K_LOWER, surface.spectrum.k_lower),
                whole(K_ROLLOFF, surface.spectrum.k_rolloff),
                whole(K_UPPER, surface.spectrum.k_upper),
            ]);
            let grain = surface.spectrum.anisotropy;
            let grain = grain.map(|grain| [grain.ratio(), grain.angle()]);
            if let Some([ratio, angle]) = grain.or(has_unit_ratio.then_some([1.0, 0.0])) {
                columns.push(real(ANISOTROPY_RATIO, ratio));
                columns.push(real(ANISOTROPY_ANGLE, angle));
            }
            columns.push((SEED, Value::Integer(surface.seed.cast_signed())));
            columns.push(whole(REALIZATION, surface.realization));
            columns
        }
        Origin::Spectrum { surface, .. } => {
            let mut columns = match &surface.source {
                Source::File { content, unit, .. } => {
                    vec![text(CONTENT_OF_SPECTRUM, content.to_string()), text(UNIT, unit.clone())]
                }
                Source::Stage { spectrum_of } => {
                    let known = spectrum_of.iter();
                    known.map(|name| text(SPECTRUM_OF, name.clone())).collect()
                }
            };
            columns.extend(height_and_unit(origin, ""));
            columns.extend([
                (SEED, Value::Integer(surface.seed.cast_signed())),
                whole(REALIZATION, surface.realization),
            ]);
            columns
        }
        Origin::File(file) => {
            let mut columns = vec![
                text(CONTENT, file.content.to_string()),
                text(UNIT, file.unit.clone()),
                real(HEIGHT_SCALE, file.height_scale),
                text(EDGES, file.edges.name().to_owned()),
            ];
            if let Edges::Taper { taper_fraction } = file.edges {
                columns.push(real(TAPER_FRACTION, taper_fraction));
            }
            let channel = file.channel.as_ref();
            columns.extend(channel.map(|channel| text(CHANNEL, channel.to_string())));
            columns.extend(file.missing.map(|number| real(MISSING, number)));
            columns.extend(preparation_coordinates(&file.preparation));
            columns
        }
        Origin::Pair(pair) => pair.own_coordinates(),
        Origin::Yielded(yielded) => yielded.own_coordinates(),
        Origin::Shape { shape, unit, .. } => {
            let mut columns = height_and_unit(origin, unit);
            columns.extend(match *shape {
                Shape::Paraboloid { radius } => vec![real(RADIUS, radius)],
                Shape::Wave { amplitude, waves }
                | Shape::WaveProduct { amplitude, waves }
                | Shape::WaveSum { amplitude, waves } => {
                    vec![real(AMPLITUDE, amplitude), whole(WAVES, waves)]
                }
                Shape::Punch { radius, depth } => vec![real(RADIUS, radius), real(DEPTH, depth)],
            });
            columns
        }
    }
}

/// Returns the columns of the rms height and of the unit of length, each if it is given.
fn height_and_unit(origin: &Origin, unit: &str) -> Vec<(Column, Value)> {
    let rms_height = origin.given_rms_height();
    let rms_height = rms_height.map(|height| (RMS_HEIGHT_GIVEN, Value::Real(height)));
    let unit = (!unit.is_empty()).then(|| (UNIT, Value::Text(unit.to_owned())));
    rms_height.into_iter().chain(unit).collect()
}
