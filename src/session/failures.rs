//! What a run could not compute, as rows of the table of failures, and that table.

use std::path::{Path, PathBuf};

use super::Session;
use super::error::SessionError;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::PublishedTable;
use asperity_pipeline::results::failures;
use asperity_pipeline::results::failures::{Failures, stacked};
use asperity_pipeline::runner::RunOutcome;
use asperity_tables::store::Store;
use asperity_tables::store::key::TaskKey;
use asperity_tables::table::{Table, TableError};

/// The tasks that a run could not compute, a row each.
pub fn of_run(session: &Session, plan: &Plan, outcome: &RunOutcome) -> Result<Table, TableError> {
    let command = |key| command(session, key);
    let failures = Failures { plan, command: &command };
    failures.of_run(outcome)
}

/// Writes the table of failures: the rows of this run, of earlier ones as far as their tasks are
/// missing still, and of loads that were given up. Where it is, if it has a row.
pub fn write(
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
    // What cannot be read of earlier failures is lost, and no failure of this run.
    let kept = before.ok().map(|before| failures.kept(&before, &now, tried, store));
    let kept = kept.and_then(Result::ok);
    let all = kept.and_then(|kept| stacked(&[now.clone(), kept]).ok());
    Ok(failures::write(&all.unwrap_or(now), &folder, study)?)
}

/// What computes a task alone.
fn command(session: &Session, key: TaskKey) -> String {
    let word = |path: &Path| {
        let path = path.to_string_lossy();
        let quoted = shlex::try_quote(&path).map(|word| word.into_owned());
        quoted.unwrap_or_else(|_| path.into_owned())
    };
    let [data, manifest] = [session.data().path(), session.manifest()].map(word);
    format!("asperity --data {data} run {manifest} --only {key}")
}
