//! Columns of the table of a stage, each declared with the tables that have it and with its value.
//!
//! One list gives all columns for the reference, the columns of a table before it is computed, and
//! the computed columns. A new column is one entry of such a list.

use arrow::array::ArrayRef;

use asperity_tables::column::{
    Column, Role, flags, integers, optional_flags, optional_reals, reals, texts,
};

/// Columns of a table, in their order. `S` are the settings that decide which columns a table has,
/// and `R` is a row.
pub struct TableColumns<S, R>(Vec<TableColumn<S, R>>);

/// A column of some tables of a stage, with its value in a row.
pub struct TableColumn<S, R> {
    column: Column,
    /// Role of the column if it depends on the settings, or `None` if the table lacks the column.
    role: Option<fn(&S) -> Option<Role>>,
    /// Returns whether tables with these settings have the column.
    is_in: fn(&S) -> bool,
    values: Values<R>,
}

/// Function that returns the value of a column in a row.
pub enum Values<R> {
    Real(fn(&R) -> f64),
    OptionalReal(fn(&R) -> Option<f64>),
    Count(fn(&R) -> usize),
    Flag(fn(&R) -> bool),
    OptionalFlag(fn(&R) -> Option<bool>),
    Text(fn(&R) -> &str),
}

use Values::*;

impl<R> Values<R> {
    fn of(&self, rows: &[R]) -> ArrayRef {
        let rows = rows.iter();
        match *self {
            Real(value) => reals(rows.map(value)),
            OptionalReal(value) => optional_reals(rows.map(value)),
            Count(value) => integers(rows.map(|row| value(row) as i64)),
            Flag(value) => flags(rows.map(value)),
            OptionalFlag(value) => optional_flags(rows.map(value)),
            Text(value) => texts(rows.map(value)),
        }
    }
}

/// Declares a column with its value in a row.
pub fn column<S, R>(column: Column, values: Values<R>) -> TableColumn<S, R> {
    TableColumn { column, role: None, is_in: |_| true, values }
}

/// Declares a column of the tables whose settings satisfy a condition.
pub fn column_if<S, R>(is_in: fn(&S) -> bool, own: Column, values: Values<R>) -> TableColumn<S, R> {
    TableColumn { is_in, ..column(own, values) }
}

/// Declares a column whose role depends on the settings, and which a table lacks if it is `None`.
pub fn column_in_role<S, R>(
    own: Column,
    role: fn(&S) -> Option<Role>,
    values: Values<R>,
) -> TableColumn<S, R> {
    TableColumn { role: Some(role), ..column(own, values) }
}

impl<S, R> TableColumn<S, R> {
    fn in_table(&self, settings: &S) -> Option<Column> {
        let role = self.role.map_or(Some(self.column.role), |role| role(settings))?;
        (self.is_in)(settings).then(|| self.column.with_role(role))
    }
}

impl<S, R> TableColumns<S, R> {
    /// Creates a list of columns.
    pub fn new<const N: usize>(columns: [TableColumn<S, R>; N]) -> Self {
        Self(columns.into())
    }

    /// Returns the columns of all tables.
    pub fn all(&self) -> Vec<Column> {
        self.0.iter().map(|one| one.column).collect()
    }

    /// Returns the columns of a table with these settings.
    pub fn of(&self, settings: &S) -> Vec<Column> {
        self.0.iter().filter_map(|one| one.in_table(settings)).collect()
    }

    /// Returns the columns of a table with these settings, with their values.
    pub fn filled(&self, settings: &S, rows: &[R]) -> Vec<(Column, ArrayRef)> {
        let own = self.0.iter();
        own.filter_map(|one| Some((one.in_table(settings)?, one.values.of(rows)))).collect()
    }
}
