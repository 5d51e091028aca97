//! Loads on the command line, in the unit of the study.

use std::fmt;

use crate::cli::{Failure, Misused, show};
use asperity_stages::columns::LOAD;
use asperity_stages::ensemble::load_column;
use asperity_tables::table::Table;

/// Relative difference between a typed number and a column, since tables show rounded numbers.
pub const ROUNDING: f64 = 1e-3;

/// A load, in the unit of its study.
#[derive(Debug, Clone, Copy)]
pub struct ShownLoad {
    /// The column that holds it: `load` where loads are reduced, `pressure` where they are in
    /// pascals.
    pub column: &'static str,
    /// Its value.
    pub value: f64,
}

impl ShownLoad {
    /// Returns the load of a row.
    ///
    /// # Errors
    /// When the table has no loads.
    pub fn of(table: &Table, row: usize) -> Result<ShownLoad, Failure> {
        let column = load_column(table);
        let value = table.reals(column)?.value(row);
        Ok(ShownLoad { column, value })
    }
}

/// The value as captions and names of files state it: `0.1000`, or `1e8` in pascals.
impl fmt::Display for ShownLoad {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.column {
            name if name == LOAD.name => write!(formatter, "{:.4}", self.value),
            _ => formatter.write_str(&written(self.value)),
        }
    }
}

/// A load as a user would write it: `0.1`, `1e8`.
fn written(load: f64) -> String {
    match (1e-4..1e6).contains(&load) {
        true => show::short(load),
        false => format!("{load:e}"),
    }
}

/// Returns those of the rows that have this load.
///
/// # Errors
/// When there is none; the message names the nearest load.
pub fn rows_under(table: &Table, rows: &[usize], load: f64) -> Result<Vec<usize>, Failure> {
    let column = load_column(table);
    let loads = table.reals(column)?;
    let distance = |row: usize| (loads.value(row) - load).abs();
    let is_meant = |row: &usize| distance(*row) <= ROUNDING * load.abs();
    let found: Vec<usize> = rows.iter().copied().filter(is_meant).collect();
    if found.is_empty() {
        let by_distance =
            |one: &&usize, other: &&usize| distance(**one).total_cmp(&distance(**other));
        let nearest = rows.iter().min_by(by_distance).ok_or("there is no load")?;
        let [asked, nearest] = [load, loads.value(*nearest)].map(written);
        return Err(Misused(format!(
            "no row has `{column}` = {asked}; the nearest is {nearest}, which `--load {nearest}` draws"
        ))
        .into());
    }
    Ok(found)
}
