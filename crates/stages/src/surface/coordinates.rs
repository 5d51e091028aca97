//! Parameter columns of surfaces.

use arrow::array::Array;

use crate::columns::*;
use crate::grids;
use crate::map_file::MapChoice;
use crate::per_axis::PerAxis;
use crate::reduced_units::PressureUnit;
use crate::surface::method::Method;
use crate::surface::pair::{Pair, Yielded};
use crate::surface::spectrum::{PrescribedHeights, Source};
use crate::surface::{Origin, Params};
use asperity_mechanics::topography::alignment::{Alignment, LineFit};
use asperity_mechanics::topography::level::ThreePoints;
use asperity_mechanics::topography::outliers::Spikes;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::preparation::{Crop, FoundCutoff, LowPass, Preparation};
use asperity_mechanics::topography::shapes::Shape;
use asperity_tables::column::{Column, Role, Value};
use asperity_tables::table::Table;

/// Number of digits of the columns `against` and `heights_of`, which figures show.
const SHORT_NAME: usize = 8;

/// Returns the parameter columns of a surface with their values, as far as they are known before
/// the surface is drawn, and its labels, which the table of the surface lacks.
pub fn coordinates(params: &Params) -> Vec<(Column, Value)> {
    let rms_slope = params.origin.given_rms_slope();
    let mut coordinates = coordinates_of(params, params.nodes(), params.size(), rms_slope);
    if is_unread(&params.origin) {
        // The name of the surface depends on the table that it reads.
        coordinates.retain(|(column, _)| *column != SURFACE);
    }
    match params.origin.labels() {
        Some(labels) => labels.added_to(coordinates),
        None => coordinates,
    }
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
pub fn coordinates_of(
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
        let values = nodes.map(|nodes| Value::Integer(i64::from(nodes)));
        columns.extend([RESAMPLED_X, RESAMPLED_Y].into_iter().zip(values));
    }
    columns.extend(preparation.tip_radius.map(|radius| length(TIP_RADIUS, radius)));
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
            let grain = surface.spectrum.anisotropy.map(|grain| [grain.ratio(), grain.angle()]);
            if let Some([ratio, angle]) = grain.or(has_unit_ratio.then_some([1.0, 0.0])) {
                columns.push(real(ANISOTROPY_RATIO, ratio));
                columns.push(real(ANISOTROPY_ANGLE, angle));
            }
            columns.extend(height_distribution(origin));
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
            columns.extend(height_distribution(origin));
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
            let MapChoice { channel, missing, ignores_mask, profile: _, line } = &file.choice;
            columns.extend(channel.as_ref().map(|channel| text(CHANNEL, channel.to_string())));
            columns.extend(missing.map(|number| real(MISSING, number)));
            columns.extend(ignores_mask.then(|| text(MASK, "ignored".to_owned())));
            columns.extend(line.map(|line| whole(LINE, line)));
            columns.extend(preparation_coordinates(&file.preparation));
            columns
        }
        Origin::Pair(pair) => of_pair(pair),
        Origin::Yielded(yielded) => of_yielded(yielded),
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

/// Returns the columns of the prescribed height distribution, if there is one.
fn height_distribution(origin: &Origin) -> Vec<(Column, Value)> {
    match origin.prescribed_heights() {
        Some(PrescribedHeights::Moments { skewness, kurtosis }) => vec![
            (TARGET_SKEWNESS, Value::Real(*skewness)),
            (TARGET_KURTOSIS, Value::Real(*kurtosis)),
        ],
        Some(PrescribedHeights::Surface { from }) => {
            let mut name = from.surface_key().to_string();
            name.truncate(SHORT_NAME);
            vec![(HEIGHTS_OF, Value::Text(name))]
        }
        None => vec![],
    }
}

/// Returns the columns of the rms height and of the unit of length, each if it is given.
fn height_and_unit(origin: &Origin, unit: &str) -> Vec<(Column, Value)> {
    let rms_height =
        origin.given_rms_height().map(|height| (RMS_HEIGHT_GIVEN, Value::Real(height)));
    let unit = (!unit.is_empty()).then(|| (UNIT, Value::Text(unit.to_owned())));
    rms_height.into_iter().chain(unit).collect()
}

/// Returns the parameter columns of the pair with their values: those of the surface in `from`,
/// and those that identify the other surface and its position.
///
/// `seed` and `realization` identify the pair.
fn of_pair(pair: &Pair) -> Vec<(Column, Value)> {
    let [body, against] = [&pair.body, &pair.against].map(|params| &params.origin);
    let text =
        |column: Column, params: &Params| (column, Value::Text(params.surface_key().to_string()));
    let identifies = [SEED.name, REALIZATION.name];
    let mut columns = coordinates_of_body(body);
    columns.retain(|(column, _)| !identifies.contains(&column.name));
    columns.push(text(FROM_SURFACE, &pair.body));
    let mut ensemble = pair.against.realization(0).surface_key().to_string();
    ensemble.truncate(SHORT_NAME);
    columns.push((AGAINST, Value::Text(ensemble)));
    columns.push(text(AGAINST_SURFACE, &pair.against));
    let PerAxis([shift_x, shift_y]) = pair.shift;
    columns.extend([(SHIFT_X, Value::Real(shift_x)), (SHIFT_Y, Value::Real(shift_y))]);
    let axis = pair.mirror.map(|axis| axis.axis().name().to_owned());
    columns.extend(axis.map(|axis| (MIRROR, Value::Text(axis))));
    let drawn = [body.random_numbers(), against.random_numbers()];
    let seed = drawn.iter().flatten().map(|(seed, _)| *seed).next();
    columns.extend(seed.map(|seed| (SEED, Value::Integer(seed.cast_signed()))));
    let number = drawn.iter().flatten().map(|(_, realization)| *realization).max();
    columns.extend(number.map(|number| (REALIZATION, Value::Integer(i64::from(number)))));
    columns
}

/// Returns the parameter columns of a surface from which another one is made, with their values.
///
/// A slope or height to which the surface is scaled has a column of its own, because `rms_slope`
/// and `rms_height` are those of the other surface.
fn coordinates_of_body(body: &Origin) -> Vec<(Column, Value)> {
    let mut columns = own_coordinates(body);
    for (column, _) in &mut columns {
        if *column == RMS_HEIGHT_GIVEN {
            *column = FROM_RMS_HEIGHT;
        }
    }
    let slope = body.given_rms_slope();
    columns.extend(slope.map(|slope| (FROM_RMS_SLOPE, Value::Real(slope))));
    columns
}

/// Returns the parameter columns of the surface with their values: those of the surface
/// before, and those of the contact in which it yielded.
fn of_yielded(yielded: &Yielded) -> Vec<(Column, Value)> {
    let mut columns = coordinates_of_body(&yielded.body.origin);
    let original = yielded.body.surface_key().to_string();
    columns.push((ORIGINAL_SURFACE, Value::Text(original)));
    let unit = |unit: PressureUnit, relative: Column, absolute: Column| match unit {
        PressureUnit::Relative => relative,
        PressureUnit::Absolute => absolute,
    };
    let load = unit(yielded.load_unit, YIELDED_LOAD, YIELDED_PRESSURE);
    let hardness = unit(yielded.hardness.unit, YIELDED_HARDNESS_REDUCED, YIELDED_HARDNESS);
    columns.push((load, Value::Real(yielded.load)));
    columns.push((hardness, Value::Real(yielded.hardness.pressure)));
    columns
}

/// Names of the descriptors of a pair, or of a surface that has yielded, that the tables of its
/// contacts have, too.
const OF_CONTACTS: [&str; 4] = ["rms_height", "nayak", "summit_density", "full_contact_load"];

/// Returns the column of a descriptor of surfaces of this origin. Later tables contain some
/// descriptors of pairs and of surfaces that have yielded, because their spectra are not those
/// that the parameters describe.
pub fn descriptor(origin: &Origin, column: Column) -> Column {
    match origin {
        Origin::Pair(_) | Origin::Yielded(_) if OF_CONTACTS.contains(&column.name) => {
            column.with_role(Role::Surface)
        }
        _ => column,
    }
}

/// Returns whether the spectrum of the surface in a row differs from the one that the columns of
/// the row describe, because the surface is a pair of surfaces or has yielded.
pub fn is_altered(table: &Table, row: usize) -> bool {
    let batch = table.batch();
    let mut columns = ALTERATIONS.iter().filter_map(|name| batch.column_by_name(name));
    columns.any(|column| column.is_valid(row))
}
