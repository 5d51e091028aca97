//! Failed tasks of a run: their rows, the table of failures, and the messages about them.

use std::path::PathBuf;

use arrow::array::Array;
use arrow::util::display::array_value_to_string;

use super::formatting::{counted, shell_word};
use super::{Session, SessionError, Setting};
use asperity_pipeline::outcome::RunOutcome;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::PublishedTable;
use asperity_pipeline::results::failures::{
    self, FAILED, Failures, NOT_STARTED, OUTCOME, REASON, STAGE, stacked,
};
use asperity_stages::columns::{METHOD, SIDE, SIDE_X, SIDE_Y, SURFACE};
use asperity_tables::key::TaskKey;
use asperity_tables::store::Store;
use asperity_tables::table::{Table, TableError};

pub(crate) use asperity_pipeline::results::failures::COMMAND;

/// Returns the failed tasks of a run, one row per task.
pub(super) fn failed_tasks(
    session: &Session,
    plan: &Plan,
    outcome: &RunOutcome,
) -> Result<Table, TableError> {
    let command = |key| command(session, key);
    let failures = Failures { plan, command: &command };
    failures.of_run(outcome)
}

/// Writes the table of failures and returns its path, or `None` if it has no rows.
///
/// The table contains the failures of this run, earlier failures of tasks that are still missing,
/// and loads that did not converge.
pub(super) fn write(
    session: &Session,
    plan: &Plan,
    failed: Table,
    tried: &[usize],
    tables: &[PublishedTable],
    store: &Store,
) -> Result<Option<PathBuf>, SessionError> {
    let (folder, study) = (session.data().results(), &plan.study);
    let before = failures::read(&folder, study);
    if tried.is_empty() && before.as_ref().is_ok_and(|table| table.rows() == 0) {
        return Ok(None);
    }
    let command = |key| command(session, key);
    let failures = Failures { plan, command: &command };
    let now = stacked(&[failed, failures.of_loads(tables)?])?;
    // If the earlier table cannot be read, its rows are lost; the run does not fail.
    let kept = before.ok().and_then(|before| failures.kept(&before, &now, tried, store).ok());
    let all = kept.and_then(|kept| stacked(&[now.clone(), kept]).ok());
    Ok(failures::write(&all.unwrap_or(now), &folder, study)?)
}

/// Returns the command that computes a single task.
fn command(session: &Session, key: TaskKey) -> String {
    let [data, manifest] = [session.data().path(), session.manifest()].map(shell_word);
    let settings: String = session.settings().iter().map(Setting::option).collect();
    format!("asperity --data {data} run {manifest}{settings} --only {key}")
}

/// Describes up to `limit` failed tasks, one line each, and counts the remaining ones.
///
/// # Errors
/// Returns an error if the table is not a table of failures.
pub(crate) fn text_lines(failures: &Table, limit: usize) -> Result<Vec<String>, TableError> {
    let outcomes = failures.texts(OUTCOME.name)?;
    let with = |outcome: &'static str| {
        (0..failures.rows()).filter(move |&row| outcomes.value(row) == outcome)
    };
    let failed = with(FAILED).take(limit).map(|row| task_line(failures, row));
    let mut lines: Vec<String> = failed.collect::<Result<_, _>>()?;
    if let more @ 1.. = with(FAILED).count().saturating_sub(limit) {
        lines.push(format!("… {} failed", counted(more, "more task")));
    }
    if let dropped @ 1.. = with(NOT_STARTED).count() {
        lines.push(format!("{} not started, because an input failed", counted(dropped, "task")));
    }
    Ok(lines)
}

/// Describes a failed task: its stage and parameters, the reason, and the command that repeats it.
fn task_line(failures: &Table, row: usize) -> Result<String, TableError> {
    let text = |name: &str| Ok::<_, TableError>(failures.texts(name)?.value(row).to_owned());
    // The same format as the arguments of `asperity view`.
    let hidden = [SURFACE, METHOD, SIDE, SIDE_X, SIDE_Y].map(|column| column.name);
    let coordinates = failures.coordinates().without(&hidden);
    let columns = coordinates.names().into_iter().zip(coordinates.batch().columns());
    let known = columns.filter(|(_, values)| values.is_valid(row));
    let words = known.map(|(name, values)| {
        let value = array_value_to_string(values, row).unwrap_or_default();
        format!("{name}={value}")
    });
    Ok(format!(
        "error: stage `{}`, {}: {}\n  to repeat it: {}",
        text(STAGE.name)?,
        words.collect::<Vec<_>>().join(" "),
        text(REASON.name)?,
        text(COMMAND.name)?,
    ))
}
