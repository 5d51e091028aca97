//! What measurements share that read all surfaces of their stages at once.

use crate::columns::*;
use crate::surface::Params;
use crate::{Context, Input, Recipe, StageError};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::table::Table;

/// Draws or reads the surface of each input in turn, and returns what `measure` makes of it.
///
/// # Errors
/// Returns an error if a surface cannot be read, if `measure` fails, or if the run is interrupted.
pub fn of_each<T>(
    inputs: &[Input],
    context: &Context,
    mut measure: impl FnMut(&Params, &Table, Surface) -> Result<T, StageError>,
) -> Result<Vec<T>, StageError> {
    let measured = inputs.iter().map(|Input { recipe, table, .. }| {
        if (context.interrupted)() {
            return Err(StageError::Interrupted);
        }
        let Recipe::Generate(params) = recipe else {
            unreachable!("validation accepts only surfaces for this measurement")
        };
        measure(params, table, params.surface(table, context.sources, context.threads)?)
    });
    measured.collect()
}

/// Returns the joint name of the surfaces.
///
/// # Errors
/// Returns an error if a table is damaged.
pub fn name(inputs: &[Input]) -> Result<String, StageError> {
    let names = inputs.iter().map(|input| Ok(input.table.texts(SURFACE.name)?.value(0)));
    Ok(names.collect::<Result<Vec<&str>, StageError>>()?.join("+"))
}

/// Returns the unit of length of the surfaces in the rows of a table, the only parameter that all
/// of them share in any study.
pub fn unit_of(surfaces: &Table) -> Table {
    surfaces.keep(|name, _| name == UNIT.name)
}

/// Returns the unit of length, once for each of `rows` rows.
///
/// # Errors
/// Returns an error if the tables have columns of the same name with different types.
pub fn unit(inputs: &[Input], rows: usize) -> Result<Table, StageError> {
    let tables: Vec<Table> = inputs.iter().map(|input| unit_of(&input.table)).collect();
    Ok(Table::stack(&tables)?.pick(&vec![0; rows]))
}
