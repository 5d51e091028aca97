//! What a table of surfaces has found, in words.

use crate::StageError;
use crate::caveats;
use crate::columns::{CHANNEL_READ, CHANNELS, FILLED_NODES, FORMAT, UNIT};
use crate::stage::{distinct, range};
use asperity_manifest::diagnostics::{counted, listed};
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// What surfaces were drawn or read, in a few words each.
///
/// # Errors
/// When the table describes no surfaces.
pub fn of(source: &TableSource) -> Result<Vec<String>, StageError> {
    let table = source.table().map_err(StageError::Store)?;
    let parts = [
        Some(counted(table.rows(), "surface")),
        read_from_files(&table, source)?,
        range(source, "nayak", "Nayak α")?,
        range(source, "full_contact_load", "full contact at")?,
        caveat(&table)?,
    ];
    Ok(parts.into_iter().flatten().collect())
}

/// What was found in the files of measured surfaces: the map that was read where there are several,
/// the nodes that were filled, the unit where the file says it.
fn read_from_files(table: &Table, source: &TableSource) -> Result<Option<String>, StageError> {
    if !table.has(FORMAT.name) && !table.has(FILLED_NODES.name) {
        return Ok(None);
    }
    let mut parts = Vec::new();
    if table.has(FORMAT.name) {
        let units = distinct(source, UNIT.name)?;
        let unit = units.iter().find(|unit| !unit.is_empty());
        let unit = unit.map_or_else(|| "no unit".to_owned(), |unit| format!("lengths in {unit}"));
        parts.push(format!("{}, {unit}", distinct(source, FORMAT.name)?.join(", ")));
        let most = table.integers(CHANNELS.name)?.iter().flatten().max();
        if most > Some(1) {
            let read = distinct(source, CHANNEL_READ.name)?;
            parts.push(format!("channel {}", listed(read.iter().map(String::as_str), "and")));
        }
    }
    if table.has(FILLED_NODES.name) {
        let filled = table.integers(FILLED_NODES.name)?.iter().flatten();
        let most = filled.max().unwrap_or(0);
        parts.push(format!("{most} missing nodes filled"));
    }
    Ok(Some(parts.join(", ")))
}

/// Of how many parameter points the theories do not speak, and why of the first.
fn caveat(surfaces: &Table) -> Result<Option<String>, StageError> {
    let points = caveats::points(surfaces)?;
    let others: Vec<_> = points.iter().filter(|point| !point.departures.is_empty()).collect();
    Ok(others.first().map(|first| {
        let number = match points.len() {
            1 => String::new(),
            all => format!("{} of {all} points ", others.len()),
        };
        let why = first.departures.join(", ");
        let such_as = if others.len() > 1 { "such as " } else { "" };
        format!("{number}no isotropic Gaussian roughness: {such_as}{why}")
    }))
}
