//! Tables with named, typed and documented columns.

use std::ops::Range;
use std::sync::Arc;

use arrow::array::{
    Array, ArrayRef, AsArray, BooleanArray, Float64Array, Int64Array, LargeBinaryArray,
    LargeListArray, StringArray, UInt32Array, new_null_array,
};
use arrow::compute::{concat, take};
use arrow::datatypes::{DataType, Field, Float64Type, Int64Type, Metadata, Schema, SchemaRef};
use arrow::record_batch::{RecordBatch, RecordBatchOptions};

use super::column::{Column, DIMENSION, Description, Role, Value, WORDING};

/// Table with named columns. Cloning is cheap, because clones share their data.
#[derive(Debug, Clone, PartialEq)]
pub struct Table(RecordBatch);

/// Error of reading a column, checking values or combining tables.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    #[error("the table has no column `{name}`")]
    Missing { name: String },
    #[error("column `{name}` holds {found}, not {expected}")]
    Type { name: String, found: DataType, expected: &'static str },
    #[error("column `{name}` would hold {value} in row {row}")]
    NotFinite {
        name: String,
        /// Number of the row, counted from 1.
        row: usize,
        value: f64,
    },
    #[error("an Arrow operation on a table failed")]
    Arrow(#[from] arrow::error::ArrowError),
}

impl Table {
    /// Creates a table from columns with `rows` rows each.
    ///
    /// # Panics
    /// Panics if a column has another length or another type than declared, which is a bug of a
    /// stage.
    pub fn new(rows: usize, columns: Vec<(Column, ArrayRef)>) -> Table {
        let (fields, arrays): (Vec<_>, Vec<_>) =
            columns.into_iter().map(|(column, array)| (column.field(), array)).unzip();
        Table::from_arrays(rows, Schema::new(fields), arrays)
    }

    /// Creates a table with one row.
    pub fn row(cells: &[(Column, Value)]) -> Table {
        Table::new(1, cells.iter().map(|(column, value)| (*column, value.repeated(1))).collect())
    }

    /// Creates a table with these columns and no rows.
    pub fn empty(columns: &[Column]) -> Table {
        let none = |column: &Column| new_null_array(&column.kind.data_type(), 0);
        Table::new(0, columns.iter().map(|c| (*c, none(c))).collect())
    }

    /// Creates a table from a schema that is known only at run time.
    ///
    /// # Panics
    /// Panics if an array has another length than `rows`, or another type than in the schema.
    pub fn from_arrays(rows: usize, schema: Schema, arrays: Vec<ArrayRef>) -> Table {
        let options = RecordBatchOptions::new().with_row_count(Some(rows));
        let batch = RecordBatch::try_new_with_options(Arc::new(schema), arrays, &options)
            .expect("columns have the type and length that their stage declares");
        Table(batch)
    }

    /// Concatenates the rows of tables. If a table lacks a column, its rows are null there.
    ///
    /// # Errors
    /// Returns an error if two tables have a column of the same name with different types.
    pub fn stack(tables: &[Table]) -> Result<Table, TableError> {
        if let [only] = tables {
            return Ok(only.clone());
        }
        let mut stacking = Stacking::default();
        let parts: Vec<(usize, Table)> =
            tables.iter().map(|table| (stacking.add(table), table.clone())).collect();
        stacking.stack(&parts)
    }

    pub fn rows(&self) -> usize {
        self.0.num_rows()
    }

    /// Returns the names of the columns, in order.
    pub fn names(&self) -> Vec<&str> {
        let fields = self.0.schema_ref().fields();
        fields.iter().map(|field| field.name().as_str()).collect()
    }

    /// Returns the descriptions of the columns, in order.
    pub fn descriptions(&self) -> Vec<Description> {
        let fields = self.0.schema_ref().fields().iter();
        fields.map(|field| field.as_ref().into()).collect()
    }

    /// Returns the descriptions of the columns with the units that
    /// [`with_named_units`](Table::with_named_units) has named.
    pub fn descriptions_in_units(&self) -> Vec<Description> {
        let fields = self.0.schema_ref().fields().iter();
        fields.map(|field| Description::in_units(field)).collect()
    }

    /// Returns the table with the units, meanings and codes that columns of the same names have in
    /// `other`. Columns that `other` lacks remain unchanged.
    pub fn described_by(&self, other: &Table) -> Table {
        let words = other.0.schema_ref();
        self.with_fields(|field| {
            let Ok(known) = words.field_with_name(field.name()) else { return field };
            let wording = known.metadata().iter().filter(|(entry, _)| WORDING.contains(&&***entry));
            let metadata =
                wording.fold(without_wording(&field), |all, (entry, text)| all.with(entry, text));
            field.with_metadata(metadata)
        })
    }

    /// Returns the table with the units that `name` gives to the declared units of its columns, for
    /// other programs. [`Description`] keeps the declared ones.
    pub fn with_named_units(&self, name: impl Fn(&str) -> String) -> Table {
        self.with_fields(|field| {
            let known = Description::in_units(&field).unit;
            let unit = name(&known);
            if unit == known {
                return field;
            }
            let declared = Description::from(&field).unit;
            let metadata = field.metadata().clone().with(DIMENSION, declared).with("unit", unit);
            field.with_metadata(metadata)
        })
    }

    /// Returns the table as the file of a task stores it: without units, meanings and codes.
    pub fn without_wording(&self) -> Table {
        self.with_fields(|field| {
            let metadata = without_wording(&field);
            field.with_metadata(metadata)
        })
    }

    /// Returns the table with changed names or metadata of its columns.
    pub fn with_fields(&self, change: impl Fn(Field) -> Field) -> Table {
        let fields = self.0.schema_ref().fields().iter();
        let changed: Vec<Field> = fields.map(|field| change(field.as_ref().clone())).collect();
        Table::from_arrays(self.rows(), Schema::new(changed), self.0.columns().to_vec())
    }

    /// Returns the memory in bytes that the table holds, including memory shared with other tables.
    pub fn bytes_held(&self) -> usize {
        let columns = self.0.columns().iter();
        let sizes = columns.map(|array| array.to_data().get_slice_memory_size().unwrap_or(0));
        sizes.sum()
    }

    /// Returns the table as an Arrow record batch.
    pub fn batch(&self) -> &RecordBatch {
        &self.0
    }

    /// Returns a column of real numbers.
    ///
    /// # Errors
    /// Returns an error if the column is missing or has another type. The following five methods
    /// return the same errors.
    pub fn reals(&self, name: &str) -> Result<&Float64Array, TableError> {
        self.typed(name, "real numbers", |array| array.as_primitive_opt::<Float64Type>())
    }

    pub fn integers(&self, name: &str) -> Result<&Int64Array, TableError> {
        self.typed(name, "integers", |array| array.as_primitive_opt::<Int64Type>())
    }

    pub fn texts(&self, name: &str) -> Result<&StringArray, TableError> {
        self.typed(name, "text", |array| array.as_string_opt::<i32>())
    }

    pub fn flags(&self, name: &str) -> Result<&BooleanArray, TableError> {
        self.typed(name, "flags", |array| array.as_boolean_opt())
    }

    pub fn bytes(&self, name: &str) -> Result<&LargeBinaryArray, TableError> {
        self.typed(name, "bytes", |array| array.as_binary_opt::<i64>())
    }

    /// Returns a column of lists of real numbers.
    pub fn lists(&self, name: &str) -> Result<&LargeListArray, TableError> {
        self.typed(name, "lists of real numbers", |array| array.as_list_opt::<i64>())
    }

    fn typed<'a, A>(
        &'a self,
        name: &str,
        expected: &'static str,
        cast: impl FnOnce(&'a ArrayRef) -> Option<&'a A>,
    ) -> Result<&'a A, TableError> {
        let column = self.0.column_by_name(name);
        let array = column.ok_or_else(|| TableError::Missing { name: name.to_owned() })?;
        let found = || array.data_type().clone();
        cast(array).ok_or_else(|| TableError::Type {
            name: name.to_owned(),
            found: found(),
            expected,
        })
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.column_by_name(name).is_some()
    }

    /// Returns the column that `read` returns, such as [`Table::reals`], or `None` if the table has
    /// no such column.
    ///
    /// # Errors
    /// Returns an error if the column has another type.
    pub fn optional<'t, A>(
        &'t self,
        name: &str,
        read: impl FnOnce(&'t Table, &str) -> Result<&'t A, TableError>,
    ) -> Result<Option<&'t A>, TableError> {
        self.has(name).then(|| read(self, name)).transpose()
    }

    /// Checks that every number of the table, including numbers in lists, is finite or null.
    ///
    /// # Errors
    /// Returns an error for the first number that is infinite or NaN.
    pub fn check_finite(&self) -> Result<(), TableError> {
        let fields = self.0.schema_ref().fields().iter();
        for (field, array) in fields.zip(self.0.columns()) {
            let lists = array.as_list_opt::<i64>();
            let numbers = lists.map_or(array, LargeListArray::values);
            let Some(numbers) = numbers.as_primitive_opt::<Float64Type>() else {
                continue;
            };
            let mut values = numbers.iter().enumerate();
            let found = values.find_map(|(index, value)| {
                Some((index, value.filter(|value| !value.is_finite())?))
            });
            if let Some((index, value)) = found {
                let offsets = lists.map(LargeListArray::value_offsets);
                let row = offsets.map_or(index + 1, |offsets| {
                    offsets.partition_point(|&offset| offset <= index as i64)
                });
                let name = field.name().clone();
                return Err(TableError::NotFinite { name, row, value });
            }
        }
        Ok(())
    }

    /// Returns a table with only the columns that identify rows.
    pub fn coordinates(&self) -> Table {
        self.keep(|_, role| role.is_some_and(Role::is_coordinate))
    }

    pub fn in_role(&self, wanted: Role) -> Table {
        self.keep(|_, role| role == Some(wanted))
    }

    pub fn not_in_role(&self, unwanted: Role) -> Table {
        self.keep(|_, role| role != Some(unwanted))
    }

    /// Returns the table with only the named columns, in the order of the table.
    pub fn only(&self, names: &[&str]) -> Table {
        self.keep(|name, _| names.contains(&name))
    }

    /// Returns the table without the named columns.
    pub fn without(&self, names: &[&str]) -> Table {
        self.keep(|name, _| !names.contains(&name))
    }

    /// Returns the table with only the columns for which `wanted` returns true. The arguments of
    /// `wanted` are the name and the role of a column.
    pub fn keep(&self, wanted: impl Fn(&str, Option<Role>) -> bool) -> Table {
        let schema = self.0.schema_ref();
        let chosen: Vec<usize> = (0..schema.fields().len())
            .filter(|&index| {
                let field = schema.field(index);
                wanted(field.name(), Role::from_field(field))
            })
            .collect();
        self.project(&chosen)
    }

    /// Returns a table of the rows with the given indices, in the order of the indices. Indices may
    /// be repeated.
    pub fn pick(&self, rows: &[usize]) -> Table {
        self.take(&UInt32Array::from_iter_values(rows.iter().map(|&row| row_number(row))))
    }

    /// Returns a table of the rows with the given indices, with nulls in place of `None`.
    pub(crate) fn pick_or_null(&self, rows: &[Option<usize>]) -> Table {
        self.take(&UInt32Array::from_iter(rows.iter().map(|row| row.map(row_number))))
    }

    fn take(&self, rows: &UInt32Array) -> Table {
        let columns = self.0.columns().iter();
        let arrays =
            columns.map(|array| take(array, rows, None).expect("the indices lie within the table"));
        let schema = self.0.schema_ref().as_ref().clone();
        Table::from_arrays(rows.len(), schema, arrays.collect())
    }

    /// Returns a table of the columns with the given indices, in the order of the indices.
    pub(crate) fn project(&self, columns: &[usize]) -> Table {
        let batch = self.0.project(columns);
        Table(batch.expect("the indices lie within the table"))
    }

    /// Returns a range of rows without copying them.
    pub fn slice(&self, rows: Range<usize>) -> Table {
        Table(self.0.slice(rows.start, rows.len()))
    }

    /// Returns a table with one row and those columns whose value is the same in all rows.
    pub fn common(&self) -> Table {
        let is_common = |name: &str| {
            let values = self.0.column_by_name(name).map(|array| array.to_data());
            values.is_some_and(|values| {
                (1..values.len()).all(|row| values.slice(row, 1) == values.slice(0, 1))
            })
        };
        self.keep(|name, _| is_common(name)).pick(&[0])
    }

    /// Returns the table with additional columns after the existing ones.
    pub fn with(&self, columns: Vec<(Column, ArrayRef)>) -> Table {
        let schema = self.0.schema_ref();
        let mut fields: Vec<Field> = schema.fields().iter().map(|f| f.as_ref().clone()).collect();
        let mut arrays = self.0.columns().to_vec();
        for (column, array) in columns {
            fields.push(column.field());
            arrays.push(array);
        }
        Table::from_arrays(self.rows(), Schema::new(fields), arrays)
    }

    /// Returns the table with the values of one column replaced.
    pub fn replacing(&self, name: &str, values: ArrayRef) -> Table {
        let schema = self.0.schema_ref();
        let columns = schema.fields().iter().zip(self.0.columns());
        let arrays = columns.map(
            |(field, array)| if field.name() == name { values.clone() } else { array.clone() },
        );
        Table::from_arrays(self.rows(), schema.as_ref().clone(), arrays.collect())
    }

    /// Returns a table with the columns of `self`, then those of `other`. Both tables must have the
    /// same number of rows.
    pub fn beside(&self, other: &Table) -> Table {
        let schemas = [&self.0, &other.0].map(|batch| batch.schema_ref().fields().iter().cloned());
        let fields: Vec<Arc<Field>> = schemas.into_iter().flatten().collect();
        let arrays = [self.0.columns(), other.0.columns()].concat();
        Table::from_arrays(self.rows(), Schema::new(fields), arrays)
    }
}

fn row_number(row: usize) -> u32 {
    u32::try_from(row).expect("a table has fewer than 2³² rows")
}

fn without_wording(field: &Field) -> Metadata {
    let mut metadata = field.metadata().clone();
    metadata.retain(|entry, _| !WORDING.contains(&entry.as_str()));
    metadata
}

impl From<RecordBatch> for Table {
    fn from(batch: RecordBatch) -> Table {
        Table(batch)
    }
}

/// Columns of the concatenation of many tables. Thousands of tables have only a few different
/// schemas, and all tables of the same schema share a layout.
#[derive(Debug, Default)]
pub struct Stacking {
    /// Columns of the concatenation, in the order in which they first appear.
    fields: Vec<Arc<Field>>,
    layouts: Vec<Layout>,
}

/// Mapping of the columns of the concatenation to the columns of tables with a given schema.
#[derive(Debug)]
struct Layout {
    schema: SchemaRef,
    /// For each column of the concatenation, its index in tables with this schema, or `None` if
    /// they lack it. The list ends early if columns were added to the concatenation later.
    indices: Vec<Option<usize>>,
}

impl Stacking {
    /// Adds the columns of a table and returns the index of its layout.
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
            let index = |known: &Arc<Field>| schema.index_of(known.name()).ok();
            self.layouts.push(Layout {
                schema: schema.clone(),
                indices: self.fields.iter().map(index).collect(),
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
                    let roles = [field.as_ref(), known.as_ref()].map(Role::from_field);
                    if let [Some(new), Some(old)] = roles
                        && new.prevails_over(old)
                    {
                        *known = field.clone();
                    }
                }
            }
        }
    }

    /// Returns the names of the columns of the concatenation, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|field| field.name().as_str())
    }

    /// Returns the index that a column of the concatenation has in the tables of a layout, or
    /// `None` if these lack it.
    pub fn index_in(&self, layout: usize, column: usize) -> Option<usize> {
        self.layouts[layout].indices.get(column).copied().flatten()
    }

    /// Concatenates the rows of tables, each given with the index of its layout. If a table lacks a
    /// column, its rows are null in that column.
    ///
    /// # Errors
    /// Returns an error if two tables have a column of the same name with different types.
    pub fn stack(&self, tables: &[(usize, Table)]) -> Result<Table, TableError> {
        let stacked = |(column, field): (usize, &Arc<Field>)| {
            let nulls = |rows| new_null_array(field.data_type(), rows);
            let part = |(layout, table): &(usize, Table)| {
                let index = self.index_in(*layout, column);
                index.map_or_else(
                    || nulls(table.rows()),
                    |index| table.batch().column(index).clone(),
                )
            };
            let parts: Vec<ArrayRef> = tables.iter().map(part).collect();
            if parts.is_empty() {
                Ok(nulls(0))
            } else {
                concat(&parts.iter().map(AsRef::as_ref).collect::<Vec<&dyn Array>>())
            }
        };
        let arrays = self.fields.iter().enumerate().map(stacked).collect::<Result<Vec<_>, _>>()?;
        let rows = tables.iter().map(|(_, table)| table.rows()).sum();
        Ok(Table::from_arrays(rows, Schema::new(self.fields.clone()), arrays))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::{ColumnKind, bytes, lists, optional_reals, reals};

    const LOAD: Column = Column::parameter("load", ColumnKind::Real, "1", "load");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const MAP: Column = Column::result("map", ColumnKind::Bytes, "", "map").with_role(Role::Heavy);

    fn table() -> Table {
        Table::new(
            2,
            vec![
                (LOAD, reals([0.1, 0.2])),
                (AREA, reals([0.3, 0.5])),
                (MAP, bytes([[1u8], [3u8]])),
            ],
        )
    }

    #[test]
    fn coordinates_exclude_results_and_maps() {
        assert_eq!(table().coordinates().names(), ["load"]);
    }

    #[test]
    fn picked_rows_are_in_the_order_of_the_indices() {
        let picked = table().pick(&[1, 0, 1]);
        assert_eq!(picked.reals("area").unwrap().values(), &[0.5, 0.3, 0.5]);
    }

    #[test]
    fn numbers_are_finite_or_null() {
        let gap = Column::result("gap", ColumnKind::Real, "1", "gap");
        let of = |values: [Option<f64>; 3]| Table::new(3, vec![(gap, optional_reals(values))]);
        assert!(of([Some(1e308), None, Some(0.0)]).check_finite().is_ok());
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let error = of([Some(1.0), None, Some(odd)]).check_finite().unwrap_err();
            assert_eq!(error.to_string(), format!("column `gap` would hold {odd} in row 3"));
        }
        let heights = Column::result("heights", ColumnKind::Reals, "", "heights");
        let values = Float64Array::from(vec![1.0, 2.0, f64::NAN, 4.0]);
        let lists = Table::new(2, vec![(heights, lists(values, [2, 2]))]);
        let error = lists.check_finite().unwrap_err();
        assert!(matches!(error, TableError::NotFinite { row: 2, .. }));
    }

    #[test]
    fn a_missing_column_and_a_wrong_type_are_named() {
        let missing = table().reals("pressure").unwrap_err();
        assert_eq!(missing.to_string(), "the table has no column `pressure`");
        let wrong = table().texts("load").unwrap_err();
        assert_eq!(wrong.to_string(), "column `load` holds Float64, not text");
    }

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
    fn a_column_that_distinguishes_surfaces_in_one_table_does_so_in_a_stack() {
        let slope = Column::parameter("rms_slope", ColumnKind::Real, "1", "slope");
        let of_surface = slope.with_role(Role::Surface);
        let tables = [slope, of_surface].map(|column| Table::new(1, vec![(column, reals([0.1]))]));
        for stack in [[0, 1], [1, 0]] {
            let stacked = Table::stack(&stack.map(|index| tables[index].clone())).unwrap();
            assert_eq!(stacked.in_role(Role::Surface).names(), ["rms_slope"]);
        }
    }

    #[test]
    fn a_coordinate_stays_a_coordinate_if_another_stacked_table_derives_it() {
        let load = LOAD.with_role(Role::Load);
        let tables = [load, load.with_role(Role::Derived)]
            .map(|column| Table::new(1, vec![(column, reals([0.1]))]));
        for stack in [[0, 1], [1, 0]] {
            let stacked = Table::stack(&stack.map(|index| tables[index].clone())).unwrap();
            assert_eq!(stacked.in_role(Role::Load).names(), ["load"]);
        }
    }
}
