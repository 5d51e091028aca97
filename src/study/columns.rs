//! Columns that a stage's table will have, for checks of what aggregates ask for.

use super::Work;
use crate::stages::aggregate::ONE_SURFACE;
use crate::stages::columns::*;
use crate::stages::generate::Form;
use crate::stages::measure;
use crate::store::column::{Column, Role};

/// The columns of a stage's table, given those of its inputs; `None` where only its run can tell.
pub fn columns_of(work: &Work, inputs: &[Vec<Column>]) -> Option<Vec<Column>> {
    let mut columns = Vec::new();
    for input in inputs {
        let coordinates = input
            .iter()
            .filter(|column| column.role == Role::Coordinate);
        extend(&mut columns, coordinates);
    }
    match work {
        Work::Generate(ensembles) => {
            extend(&mut columns, &[SURFACE, METHOD, NODES, SIDE, RMS_SLOPE]);
            for ensemble in ensembles {
                extend(&mut columns, own(&ensemble.params.form));
            }
            extend(&mut columns, &DESCRIPTORS);
            let is_random = |form: &Form| matches!(form, Form::Random { .. });
            if ensembles
                .iter()
                .any(|ensemble| is_random(&ensemble.params.form))
            {
                extend(&mut columns, &REFERENCES);
            }
        }
        Work::Solve(_) => extend(&mut columns, &SOLVED),
        Work::Measure(measure::Params::Contacts) => extend(&mut columns, &CONTACT_MEASURES),
        Work::Measure(measure::Params::Heights { .. }) => {
            extend(&mut columns, &[BIN, COUNT, DENSITY]);
        }
        Work::Measure(measure::Params::Pool { .. }) => {
            columns.retain(|column| !ONE_SURFACE.contains(&column.name));
            extend(&mut columns, &POOLED);
        }
        Work::Correct(_) => extend(&mut columns, &CORRECTED),
        Work::Fit(_) | Work::Aggregate(_) => return None,
    }
    Some(columns)
}

/// The columns that tables have together.
pub fn all(tables: &[Vec<Column>]) -> Vec<Column> {
    let mut columns = Vec::new();
    extend(&mut columns, tables.iter().flatten());
    columns
}

/// Adds the columns that are not there yet.
fn extend<'a>(columns: &mut Vec<Column>, more: impl IntoIterator<Item = &'a Column>) {
    for column in more {
        if columns.iter().all(|known| known.name != column.name) {
            columns.push(*column);
        }
    }
}

const SOLVED: [Column; 11] = [
    YOUNGS_MODULUS,
    TOLERANCE,
    LOAD,
    PRESSURE,
    CONTACT_NODES,
    MEAN_GAP,
    ENERGY,
    PEAK_PRESSURE,
    PAIRS,
    RESIDUAL,
    STOP,
];

const POOLED: [Column; 5] = [BIN, SURFACES, DENSITY_MEAN, DENSITY_SD, DENSITY_NORMAL];

const CORRECTED: [Column; 11] = [
    CORRECTION,
    COEFFICIENT,
    AREA_CORRECTED,
    AREA_LOWER,
    AREA_UPPER,
    ERROR_ABSOLUTE,
    ERROR_RELATIVE,
    AREA_FRACTION,
    SWITCHES,
    CONTACT_NODES,
    STOP,
];

/// What places a surface among others of its method.
fn own(form: &Form) -> &'static [Column] {
    match form {
        Form::Random { .. } => &[HURST, K_LOWER, K_ROLLOFF, K_UPPER, SEED, REALIZATION],
        Form::File(_) => &[CONTENT, UNIT, HEIGHT_SCALE, EDGES, TAPER_FRACTION],
        Form::Shape { .. } => &[RADIUS, AMPLITUDE, WAVES, DEPTH],
    }
}
