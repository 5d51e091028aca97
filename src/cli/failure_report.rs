//! What went wrong in a run, told.

use arrow::array::Array;
use arrow::util::display::array_value_to_string;

use super::{counted, warn};
use asperity_pipeline::results::failures::{COMMAND, FAILED, NOT_STARTED, OUTCOME, REASON, STAGE};
use asperity_stages::columns::{METHOD, SIDE, SIDE_X, SIDE_Y, SURFACE};
use asperity_tables::table::{Table, TableError};

/// Failures that are told one by one; the table has them all.
const TOLD: usize = 10;

/// Says which tasks failed, and why.
///
/// # Errors
/// When the table is none of failures.
pub fn tell(failures: &Table) -> Result<(), TableError> {
    let outcomes = failures.texts(OUTCOME.name)?;
    let with = |outcome: &'static str| {
        (0..failures.rows()).filter(move |&row| outcomes.value(row) == outcome)
    };
    for row in with(FAILED).take(TOLD) {
        warn(&told(failures, row)?);
    }
    if let more @ 1.. = with(FAILED).count().saturating_sub(TOLD) {
        warn(&format!("… {} failed", counted(more, "more task")));
    }
    if let dropped @ 1.. = with(NOT_STARTED).count() {
        let dropped = counted(dropped, "task");
        warn(&format!("{dropped} not started for want of what failed"));
    }
    Ok(())
}

/// A failed task: where it stands in the study, what went wrong, what would do.
fn told(failures: &Table, row: usize) -> Result<String, TableError> {
    let text = |name: &str| Ok::<_, TableError>(failures.texts(name)?.value(row).to_owned());
    let place = place(&failures.coordinates(), row);
    Ok(format!(
        "error: stage `{}`, {place}: {}\n  again, alone: {}",
        text(STAGE.name)?,
        text(REASON.name)?,
        text(COMMAND.name)?,
    ))
}

/// Coordinates as `view` takes them.
fn place(coordinates: &Table, row: usize) -> String {
    let hidden = [SURFACE, METHOD, SIDE, SIDE_X, SIDE_Y].map(|column| column.name);
    let columns = coordinates.without(&hidden);
    let columns = columns.names().into_iter().zip(columns.batch().columns());
    let known = columns.filter(|(_, values)| values.is_valid(row));
    let words = known.map(|(name, values)| {
        let value = array_value_to_string(values, row).unwrap_or_default();
        format!("{name}={value}")
    });
    words.collect::<Vec<_>>().join(" ")
}
