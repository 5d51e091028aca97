//! Which rows are not independent: those of one sampling unit.
//!
//! Points of a sweep share random numbers. The surface of one seed and realization has the same
//! phases at every parameter point, so that its rows there are correlated: together they are one
//! sample of a population of surfaces, and not several. Statistics over rows of several points
//! therefore count sampling units.

use std::collections::HashMap;

use arrow::array::Array;

use super::{Member, Members, grouped};
use crate::stages::columns::{
    CHANNEL, CONTENT, CROP_FROM_X, CROP_FROM_Y, CROP_SIZE_X, CROP_SIZE_Y, SURFACE,
};
use crate::store::table::{Table, TableError};

/// What makes one region of a measured surface, however it is filtered or scaled afterwards.
const REGION: [&str; 6] = [
    CONTENT.name,
    CHANNEL.name,
    CROP_FROM_X.name,
    CROP_FROM_Y.name,
    CROP_SIZE_X.name,
    CROP_SIZE_Y.name,
];

/// The number of the sampling unit of each row, from 0 on in the order of appearance.
///
/// A drawn surface is the unit of its seed and realization, and a region of a file is one unit. Other
/// surfaces are units of their own, and so are rows that are not about single surfaces.
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

/// What a row is a sample of.
#[derive(PartialEq, Eq, Hash)]
enum Unit<'a> {
    Drawn(Member),
    Region(usize),
    Surface(&'a str),
    Row(usize),
}

/// The number of the group of equal rows to which each row belongs.
fn numbered(table: &Table) -> Vec<usize> {
    let mut numbers = vec![0; table.rows()];
    for (number, rows) in grouped(table).into_iter().enumerate() {
        rows.into_iter().for_each(|row| numbers[row] = number);
    }
    numbers
}
