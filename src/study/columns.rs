//! The tables of a study before it is run: every column, and no row.

use super::{Reduction, Study, Work};
use crate::stages::aggregate::{self, Sql};
use crate::stages::columns::*;
use crate::stages::generate::Form;
use crate::stages::{StageError, fit, generate, measure};
use crate::store::column::{Column, Role};
use crate::store::table::{Table, TableError};

impl Study {
    /// The table of each stage, without rows: names, types, units and meanings of its columns.
    ///
    /// # Errors
    /// When a query cannot be answered.
    pub fn empty_tables(&self) -> Result<Vec<Table>, StageError> {
        let mut tables: Vec<(String, Table)> = Vec::new();
        for stage in &self.stages {
            let inputs = stage.inputs.iter().map(|&input| tables[input].clone());
            let table = empty_table(&stage.work, &inputs.collect::<Vec<_>>())?;
            tables.push((stage.name.clone(), table));
        }
        Ok(tables.into_iter().map(|(_, table)| table).collect())
    }
}

/// A stage's table without rows, given those of the stages that it reads and their names.
///
/// # Errors
/// When a query cannot be answered, or a column is missing that the work needs.
pub fn empty_table(work: &Work, inputs: &[(String, Table)]) -> Result<Table, StageError> {
    match work {
        Work::Fit(fits) => {
            let input = stacked(inputs)?;
            let fitted = fits.iter().map(|params| fit::fitted(params, &input));
            Ok(Table::stack(&fitted.collect::<Result<Vec<_>, _>>()?)?)
        }
        Work::Aggregate(Reduction::Groups(groups)) => aggregate::grouped(&stacked(inputs)?, groups),
        Work::Aggregate(Reduction::Sql { query, columns }) => {
            let tables: Vec<Table> = inputs.iter().map(|(_, table)| table.clone()).collect();
            let sql = Sql {
                query: query.clone(),
                tables: inputs.iter().map(|(name, _)| (name.clone(), 1)).collect(),
                columns: columns.clone(),
            };
            aggregate::sql::query(&tables, &sql)
        }
        Work::Generate(_) | Work::Solve(_) | Work::Measure(_) | Work::Correct(_) => {
            let own = Table::empty(&own_columns(work));
            let above = stacked(inputs)?.coordinates();
            let above = match work {
                Work::Measure(measure::Params::Pool { .. }) => above.in_role(Role::Parameter),
                _ => above,
            };
            let names = above.names();
            Ok(above.beside(&own.without(&names)))
        }
    }
}

/// The tables one under the other, as a stage reads them that is no query.
pub fn stacked(inputs: &[(String, Table)]) -> Result<Table, TableError> {
    let tables: Vec<Table> = inputs.iter().map(|(_, table)| table.clone()).collect();
    Table::stack(&tables)
}

/// What work adds to the coordinates of its inputs.
fn own_columns(work: &Work) -> Vec<Column> {
    match work {
        Work::Generate(ensembles) => {
            let forms = || ensembles.iter().map(|ensemble| &ensemble.params.form);
            let mut columns = vec![SURFACE, METHOD, NODES, SIDE, RMS_SLOPE];
            for place in forms().flat_map(generate::own_columns) {
                if !columns.contains(&place) {
                    columns.push(place);
                }
            }
            columns.extend(DESCRIPTORS);
            if forms().any(|form| matches!(form, Form::Random { .. })) {
                columns.extend(REFERENCES);
            }
            columns
        }
        Work::Solve(_) => SOLVED.to_vec(),
        Work::Measure(measure::Params::Contacts) => CONTACT_MEASURES.to_vec(),
        Work::Measure(measure::Params::Heights { .. }) => HEIGHT_MEASURES.to_vec(),
        Work::Measure(measure::Params::Pool { .. }) => POOLED_HEIGHTS.to_vec(),
        Work::Correct(_) => CORRECTED.to_vec(),
        Work::Fit(_) | Work::Aggregate(_) => Vec::new(),
    }
}
