//! What went wrong in a run, told and written down.

use std::path::{Path, PathBuf};

use arrow::array::Array;
use arrow::util::display::array_value_to_string;

use super::{Data, Failure, chain, counted, warn};
use crate::failures::{self, stacked};
use crate::failures::{COMMAND, FAILED, Failures, NOT_STARTED, OUTCOME, REASON, STAGE};
use crate::plan::Plan;
use crate::results::StageTable;
use crate::runner::Outcome;
use crate::stages::columns::{METHOD, SIDE, SURFACE};
use crate::store::Store;
use crate::store::key::TaskKey;
use crate::store::table::{Table, TableError};

/// Failures that are told one by one; the table has them all.
const TOLD: usize = 10;

/// A run, as far as its failures go.
pub struct FailureReport<'a> {
    pub plan: &'a Plan,
    pub manifest: &'a Path,
    pub data: &'a Data,
}

impl FailureReport<'_> {
    /// Says which tables were damaged and which tasks failed, and why; the rows of the latter.
    pub fn tell(&self, outcome: &Outcome) -> Result<Table, Failure> {
        for damage in &outcome.damaged {
            let aside = damage.aside.display();
            let cause = chain(&damage.cause);
            warn(&format!("warning: {cause}; set aside as `{aside}`"));
        }
        let command = |key| self.command(key);
        let failures = self.failures(&command).of_run(outcome)?;
        let outcomes = failures.texts(OUTCOME.name)?;
        let with = |outcome: &'static str| {
            (0..failures.rows()).filter(move |&row| outcomes.value(row) == outcome)
        };
        for row in with(FAILED).take(TOLD) {
            warn(&told(&failures, row)?);
        }
        if let more @ 1.. = with(FAILED).count().saturating_sub(TOLD) {
            warn(&format!("… {} failed", counted(more, "more task")));
        }
        if let dropped @ 1.. = with(NOT_STARTED).count() {
            let dropped = counted(dropped, "task");
            warn(&format!("{dropped} not started for want of what failed"));
        }
        Ok(failures)
    }

    /// Writes the table of failures: the rows of this run, of earlier ones as far as their tasks are
    /// missing still, and of loads that were given up. Where it is, if it has a row.
    pub fn write(
        &self,
        failed: Table,
        tried: &[usize],
        tables: &[StageTable],
        store: &Store,
    ) -> Result<Option<PathBuf>, Failure> {
        let (folder, study) = (self.data.results(), &self.plan.study);
        let before = failures::read(&folder, study);
        if tried.is_empty() && before.as_ref().is_ok_and(|table| table.rows() == 0) {
            return Ok(None);
        }
        let command = |key| self.command(key);
        let failures = self.failures(&command);
        let now = stacked(&[failed, failures.of_loads(tables)?])?;
        // What cannot be read of earlier failures is lost, and no failure of this run.
        let kept = before
            .ok()
            .map(|before| failures.kept(&before, &now, tried, store));
        let kept = kept.and_then(Result::ok);
        let all = kept.and_then(|kept| stacked(&[now.clone(), kept]).ok());
        Ok(failures::write(&all.unwrap_or(now), &folder, study)?)
    }

    fn failures<'a>(&'a self, command: &'a dyn Fn(TaskKey) -> String) -> Failures<'a> {
        Failures {
            plan: self.plan,
            command,
        }
    }

    /// What computes a task alone.
    fn command(&self, key: TaskKey) -> String {
        let word = |path: &Path| {
            let path = path.to_string_lossy();
            let quoted = shlex::try_quote(&path).map(|word| word.into_owned());
            quoted.unwrap_or_else(|_| path.into_owned())
        };
        let [data, manifest] = [&*self.data.0, self.manifest].map(word);
        format!("asperity --data {data} run {manifest} --only {key}")
    }
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
    let hidden = [SURFACE, METHOD, SIDE].map(|column| column.name);
    let columns = coordinates.without(&hidden);
    let columns = columns.names().into_iter().zip(columns.batch().columns());
    let known = columns.filter(|(_, values)| values.is_valid(row));
    let words = known.map(|(name, values)| {
        let value = array_value_to_string(values, row).unwrap_or_default();
        format!("{name}={value}")
    });
    words.collect::<Vec<_>>().join(" ")
}
