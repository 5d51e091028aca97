//! Sampling units: the rows of one unit are not independent of each other.
//!
//! Points of a sweep share random numbers. The surface of one seed and realization has the same
//! phases at every parameter point, so that its rows there are correlated: together they are one
//! sample of a population of surfaces, and not several. Statistics over rows of several points
//! therefore count sampling units.

use std::collections::HashMap;

use arrow::array::Array;

use super::{Member, Members, grouped};
use crate::columns::{
    CHANNEL, CONTENT, CROP_FROM_X, CROP_FROM_Y, CROP_SIZE_X, CROP_SIZE_Y, SURFACE,
};
use asperity_tables::table::{Table, TableError};

/// Columns that tell regions of measured surfaces apart, however these are filtered or scaled.
const REGION: [&str; 6] = [
    CONTENT.name,
    CHANNEL.name,
    CROP_FROM_X.name,
    CROP_FROM_Y.name,
    CROP_SIZE_X.name,
    CROP_SIZE_Y.name,
];

/// Returns the number of the sampling unit of each row, from 0 in the order of appearance.
///
/// A pair of seed and realization is one unit, and so is a region of a file. Every other surface is
/// a unit of its own, and so is every row that is not about a single surface.
///
/// # Errors
/// When seeds, realizations or names of surfaces have another type.
pub fn sampling_units(table: &Table) -> Result<Vec<i64>, TableError> {
    let members = Members::of(table)?;
    let regions = numbered(&table.only(&REGION));
    let contents = table.has(CONTENT.name).then(|| table.texts(CONTENT.name));
    let contents = contents.transpose()?;
    let names = table.has(SURFACE.name).then(|| table.texts(SURFACE.name));
    let names = names.transpose()?;
    let mut known: HashMap<Unit, i64> = HashMap::new();
    let unit = |row: usize| {
        let unit = match members.of_row(row) {
            member @ Member::Drawn { .. } => Unit::Drawn(member),
            Member::Sole if contents.is_some_and(|contents| contents.is_valid(row)) => {
                Unit::Region(regions[row])
            }
            Member::Sole => match names {
                Some(names) => Unit::Surface(names.value(row)),
                None => Unit::Row(row),
            },
        };
        let next = known.len() as i64;
        *known.entry(unit).or_insert(next)
    };
    Ok((0..table.rows()).map(unit).collect())
}

/// Identity of a sampling unit.
#[derive(PartialEq, Eq, Hash)]
enum Unit<'a> {
    Drawn(Member),
    Region(usize),
    Surface(&'a str),
    Row(usize),
}

/// Numbers groups of equal rows and returns the number for each row.
fn numbered(table: &Table) -> Vec<usize> {
    let mut numbers = vec![0; table.rows()];
    for (number, rows) in grouped(table).into_iter().enumerate() {
        rows.into_iter().for_each(|row| numbers[row] = number);
    }
    numbers
}
