//! Stacking of tables: their rows one under the other.

use std::sync::Arc;

use arrow::array::{Array, ArrayRef, new_null_array};
use arrow::compute::concat;
use arrow::datatypes::{Field, Schema, SchemaRef};

use super::column::Role;
use super::table::{Table, TableError};

/// Columns of stacked tables. Thousands of tables have few different schemas, so that tables of one
/// schema share a layout.
#[derive(Debug, Default)]
pub struct Stacking {
    /// All columns, in the order in which they appear.
    fields: Vec<Arc<Field>>,
    layouts: Vec<Layout>,
}

/// Positions of the columns in tables of one schema.
#[derive(Debug)]
struct Layout {
    schema: SchemaRef,
    /// Position of each stacked column in these tables. Columns that were added later are missing
    /// at the end.
    places: Vec<Option<usize>>,
}

impl Stacking {
    /// Adds the columns of a table and returns the number of its layout.
    pub fn add(&mut self, table: &Table) -> usize {
        let batch = table.batch();
        let schema = batch.schema_ref();
        let layouts = self.layouts.iter();
        let known = layouts
            .clone()
            .position(|known| Arc::ptr_eq(&known.schema, schema))
            .or_else(|| layouts.clone().position(|known| known.schema == *schema));
        known.unwrap_or_else(|| {
            self.add_fields(schema);
            let place = |known: &Arc<Field>| schema.index_of(known.name()).ok();
            self.layouts.push(Layout {
                schema: schema.clone(),
                places: self.fields.iter().map(place).collect(),
            });
            self.layouts.len() - 1
        })
    }

    fn add_fields(&mut self, schema: &Schema) {
        for field in schema.fields() {
            let mut known = self.fields.iter_mut();
            match known.find(|known| known.name() == field.name()) {
                None => self.fields.push(field.clone()),
                Some(known) => {
                    let roles = [field.as_ref(), known.as_ref()].map(Role::of);
                    if let [Some(new), Some(old)] = roles
                        && new.prevails_over(old)
                    {
                        *known = field.clone();
                    }
                }
            }
        }
    }

    /// Returns the names of all columns, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|field| field.name().as_str())
    }

    /// Returns the position of a stacked column in the tables of a layout.
    pub fn place(&self, layout: usize, column: usize) -> Option<usize> {
        self.layouts[layout].places.get(column).copied().flatten()
    }

    /// Stacks tables, each of which comes with the number of its layout. A column that a table
    /// lacks is null in its rows.
    ///
    /// # Errors
    /// When two tables have a column of one name and different types.
    pub fn stack(&self, tables: &[(usize, Table)]) -> Result<Table, TableError> {
        let arrays = self.fields.iter().enumerate().map(|(column, field)| {
            let nulls = |rows| new_null_array(field.data_type(), rows);
            let parts = tables.iter().map(|(layout, table)| {
                let place = self.place(*layout, column);
                place.map_or_else(
                    || nulls(table.rows()),
                    |place| table.batch().column(place).clone(),
                )
            });
            let parts: Vec<ArrayRef> = parts.collect();
            match parts.is_empty() {
                true => Ok(nulls(0)),
                false => concat(&parts.iter().map(AsRef::as_ref).collect::<Vec<&dyn Array>>()),
            }
        });
        let arrays = arrays.collect::<Result<Vec<_>, _>>()?;
        let rows = tables.iter().map(|(_, table)| table.rows()).sum();
        Ok(Table::of(rows, Schema::new(self.fields.clone()), arrays))
    }
}

impl Table {
    /// Tables one under the other. A column that a table lacks is null in its rows.
    ///
    /// # Errors
    /// When two tables have a column of one name and different types.
    pub fn stack(tables: &[Table]) -> Result<Table, TableError> {
        if let [only] = tables {
            return Ok(only.clone());
        }
        let mut stacking = Stacking::default();
        let parts = tables.iter().map(|table| (stacking.add(table), table.clone()));
        let parts: Vec<(usize, Table)> = parts.collect();
        stacking.stack(&parts)
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::{Column, ColumnKind, reals};
    use super::*;

    const LOAD: Column = Column::parameter("load", ColumnKind::Real, "1", "load");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    #[test]
    fn a_column_that_one_stacked_table_lacks_is_null_in_its_rows() {
        let columns = vec![(LOAD, reals([0.1, 0.2])), (AREA, reals([0.3, 0.5]))];
        let table = Table::new(2, columns);
        for tables in [[table.clone(), table.without(&["area"])], [table.without(&["area"]), table]]
        {
            let stacked = Table::stack(&tables).unwrap();
            assert_eq!(stacked.rows(), 4);
            assert_eq!(stacked.reals("area").unwrap().null_count(), 2);
            assert_eq!(stacked.reals("load").unwrap().null_count(), 0);
        }
    }

    #[test]
    fn what_tells_surfaces_apart_in_one_table_does_so_in_a_stack() {
        let slope = Column::parameter("rms_slope", ColumnKind::Real, "1", "slope");
        let of_surface = slope.with_role(Role::Surface);
        let tables = [slope, of_surface].map(|column| Table::new(1, vec![(column, reals([0.1]))]));
        for stack in [[0, 1], [1, 0]] {
            let stacked = Table::stack(&stack.map(|place| tables[place].clone())).unwrap();
            assert_eq!(stacked.in_role(Role::Surface).names(), ["rms_slope"]);
        }
    }

    #[test]
    fn a_coordinate_stays_one_beside_tables_that_derive_it() {
        let load = LOAD.with_role(Role::Load);
        let tables = [load, load.with_role(Role::Derived)]
            .map(|column| Table::new(1, vec![(column, reals([0.1]))]));
        for stack in [[0, 1], [1, 0]] {
            let stacked = Table::stack(&stack.map(|place| tables[place].clone())).unwrap();
            assert_eq!(stacked.in_role(Role::Load).names(), ["load"]);
        }
    }
}
