//! Table of the tasks that failed or could not start, and of the loads that did not converge.
//!
//! Tasks that do not depend on a failed task run as usual. The file of the table exists only while
//! the table has rows.

use std::path::{Path, PathBuf};
use std::{fs, io};

use arrow::array::Array;

use crate::outcome::{RunOutcome, TaskError};
use crate::plan::{Plan, PlannedStage};
use crate::results::{PublishedTable, ResultsError, path};
use asperity_manifest::diagnostics::{chain, counted};
use asperity_manifest::names::FAILURES;
use asperity_stages::columns::{PAIRS, RESIDUAL, STOP, TOLERANCE};
use asperity_stages::solve::NOT_REACHED;
use asperity_stages::solve::adhesion::{GAP_NOT_REACHED, STALLED};
use asperity_stages::solve::is_unconverged;
use asperity_stages::{Kind, Recipe};
use asperity_tables::column::ColumnKind::Text;
use asperity_tables::column::{Code, Column, texts};
use asperity_tables::key::TaskKey;
use asperity_tables::parquet;
use asperity_tables::parquet::{Columns, Metadata};
use asperity_tables::store::files::{read_whole, write_whole};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::{Table, TableError};

/// Value of `outcome` for a task whose computation failed.
pub const FAILED: &str = "failed";
/// Value of `outcome` for a task that was not started because one of its inputs failed.
pub const NOT_STARTED: &str = "not-started";
/// Value of `outcome` for a load that did not converge. Its row in the stage's table exists.
pub const NOT_CONVERGED: &str = "not-converged";

/// Column with the stage of the task.
pub const STAGE: Column = Column::result("stage", Text, "", "stage of the task");
/// Column with the key of the task.
pub const TASK: Column = Column::result("task", Text, "", "key of the task");
/// Column with the outcome of the task.
pub const OUTCOME: Column = Column::result(
    "outcome",
    Text,
    "",
    "outcome of the task",
)
.with_codes(&[
    Code { word: FAILED, meaning: "the task could not be computed" },
    Code { word: NOT_STARTED, meaning: "a task that it reads failed" },
    Code {
        word: NOT_CONVERGED,
        meaning: "a load did not converge, or a mean gap was not reached; its row is in the table of \
                  the stage",
    },
]);
/// Column with the reason of the failure.
pub const REASON: Column = Column::result("reason", Text, "", "reason of the failure");
/// Column with the command that recomputes the task.
pub const COMMAND: Column =
    Column::result("command", Text, "", "command that recomputes only this task");

/// Columns that every row has, before the parameter columns.
const OWN: [Column; 5] = [STAGE, TASK, OUTCOME, REASON, COMMAND];

/// Collector of the failures of a study.
pub struct Failures<'a> {
    pub plan: &'a Plan,
    /// Function that returns the command that computes one task.
    pub command: &'a dyn Fn(TaskKey) -> String,
}

impl Failures<'_> {
    /// Lists the tasks that a run could not compute, one per row.
    ///
    /// # Errors
    /// Returns an error if two parameters of the same name differ in type. This would be a bug of a
    /// stage.
    pub fn of_run(&self, outcome: &RunOutcome) -> Result<Table, TableError> {
        let rows = outcome.failed.iter().filter_map(|(task, error)| {
            let kind = match error {
                TaskError::Upstream(_) => NOT_STARTED,
                _ => FAILED,
            };
            Some(self.row(self.plan.index_of(*task)?, kind, chain(error)))
        });
        stacked(&rows.collect::<Result<Vec<_>, _>>()?)
    }

    /// Lists the loads that did not converge, one per row.
    pub fn of_loads(&self, tables: &[PublishedTable]) -> Result<Table, ResultsError> {
        let stages = self.plan.stages.iter().zip(tables);
        let solved =
            stages.filter(|(stage, table)| stage.kind == Kind::Solve && table.finished > 0);
        let rows = solved.map(|(stage, table)| {
            let read = table.read()?;
            let given_up = self.given_up(stage, &read);
            given_up.map_err(|source| ResultsError::Table { stage: stage.name.clone(), source })
        });
        let mut tables = rows.collect::<Result<Vec<_>, _>>()?;
        tables.retain(|table| table.rows() > 0);
        stacked(&tables)
            .map_err(|source| ResultsError::Table { stage: FAILURES.to_owned(), source })
    }

    fn given_up(&self, stage: &PlannedStage, table: &Table) -> Result<Table, TableError> {
        let stops = table.texts(STOP.name)?;
        let is_given_up = |row: &usize| is_unconverged(stops.value(*row));
        let rows: Vec<usize> = (0..table.rows()).filter(is_given_up).collect();
        let picked = table.pick(&rows);
        let [residual, tolerance] = [RESIDUAL, TOLERANCE].map(|column| picked.reals(column.name));
        let (pairs, residual, tolerance) = (picked.integers(PAIRS.name)?, residual?, tolerance?);
        let keys = picked.texts(TASK.name)?;
        let limit = |row: usize| {
            let task = self.plan.task_of(keys.value(row).parse().ok()?)?;
            match &self.plan.tasks[task].recipe {
                Recipe::Solve(params) => Some(params.max_pairs),
                Recipe::Adhesion(params) => Some(params.max_pairs),
                _ => None,
            }
        };
        let stops = picked.texts(STOP.name)?;
        let reason = |row: usize| {
            let errors =
                residual.is_valid(row).then(|| [residual.value(row), tolerance.value(row)]);
            reason(stops.value(row), pairs.value(row), limit(row), errors)
        };
        let tasks = keys.iter().flatten();
        let command = |key: &str| key.parse().map_or_else(|_| String::new(), self.command);
        let columns = [
            texts(vec![stage.name.clone(); rows.len()]),
            texts(tasks.clone()),
            texts(vec![NOT_CONVERGED; rows.len()]),
            texts((0..rows.len()).map(reason)),
            texts(tasks.map(command)),
        ];
        let own = Table::new(rows.len(), OWN.into_iter().zip(columns).collect());
        Ok(own.beside(&picked.coordinates()))
    }

    fn row(&self, task: usize, outcome: &str, reason: String) -> Result<Table, TableError> {
        let key = self.plan.tasks[task].table.key;
        let stage = self.plan.stage_of(task);
        let values = [
            stage.map_or_else(String::new, |stage| stage.name.clone()),
            key.to_string(),
            outcome.to_owned(),
            reason,
            (self.command)(key),
        ];
        let columns = values.map(|value| texts([value]));
        let own = Table::new(1, OWN.into_iter().zip(columns).collect());
        Ok(own.beside(&self.plan.coordinates(task)?))
    }

    /// Returns the rows of the table `before` that still apply after a run.
    ///
    /// Such a row is about a task that the run did not try (`tried`) and that still has no table.
    /// In addition, `before` or `now`, the table of this run, must say that the task or one of its
    /// inputs failed.
    ///
    /// # Errors
    /// Returns an error if one of the tables is not a table of failures.
    pub fn kept(
        &self,
        before: &Table,
        now: &Table,
        tried: &[usize],
        store: &Store,
    ) -> Result<Table, TableError> {
        let mut left = self.ends(before)?;
        left.retain(|(_, task, _)| {
            tried.binary_search(task).is_err() && !store.has(&self.plan.tasks[*task].table)
        });
        let now = self.ends(now)?;
        let mut waits = vec![false; self.plan.tasks.len()];
        for (_, task, outcome) in left.iter().chain(&now) {
            waits[*task] |= *outcome == FAILED;
        }
        for (task, reads) in self.plan.tasks.iter().enumerate() {
            waits[task] |= reads.inputs.iter().any(|&input| waits[input]);
        }
        let rows: Vec<usize> =
            left.iter().filter(|(_, task, _)| waits[*task]).map(|(row, ..)| *row).collect();
        Ok(before.pick(&rows))
    }

    /// Returns (row, task, outcome) of each row about a task of this plan that failed or was not
    /// started.
    fn ends<'t>(&self, failures: &'t Table) -> Result<Vec<(usize, usize, &'t str)>, TableError> {
        let (keys, outcomes) = (failures.texts(TASK.name)?, failures.texts(OUTCOME.name)?);
        let ends = (0..failures.rows()).filter_map(|row| {
            let task = self.plan.task_of(keys.value(row).parse().ok()?)?;
            let outcome = outcomes.value(row);
            (outcome != NOT_CONVERGED).then_some((row, task, outcome))
        });
        Ok(ends.collect())
    }
}

/// Returns why a load did not converge after `pairs` of transforms, of which there may be `limit`.
/// `errors` are the residual and the tolerance; a search for the load of pull-off has none.
fn reason(stop: &str, pairs: i64, limit: Option<u32>, errors: Option<[f64; 2]>) -> String {
    if stop == GAP_NOT_REACHED {
        return "did not reach its mean gap: the contact of the isolated patch jumps past it. \
                `mean_gap` is that of the state"
            .to_owned();
    }
    if stop == NOT_REACHED {
        return "no load has the prescribed mean gap or displacement; the row is that of the nearest \
                load, as in full contact, where a half-space does not come nearer"
            .to_owned();
    }
    let reached = limit.filter(|_| stop != STALLED);
    let limit = reached.map_or_else(String::new, |limit| format!(" (`max_pairs = {limit}`)"));
    let stopped = format!("stopped after {} of transforms{limit}", counted(pairs as usize, "pair"));
    match errors {
        Some([residual, tolerance]) => format!(
            "did not converge: {stopped} with a residual of {residual:.2e}, above the tolerance \
             {tolerance:.2e}"
        ),
        None => format!("the search for the load at which the surfaces separate {stopped}"),
    }
}

/// Reads the table of failures of a study. If the file does not exist, the table has no rows.
pub fn read(folder: &Path, study: &str) -> Result<Table, StoreError> {
    match read_whole(&path(folder, study, FAILURES), Columns::All) {
        Ok((table, _)) => Ok(table),
        Err(StoreError::Read { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            Ok(Table::empty(&OWN))
        }
        Err(error) => Err(error),
    }
}

/// Writes the table of failures and returns its path. If the table has no rows, deletes the file
/// and returns `None`.
pub fn write(table: &Table, folder: &Path, study: &str) -> Result<Option<PathBuf>, StoreError> {
    let path = path(folder, study, FAILURES);
    if table.rows() == 0 {
        return match fs::remove_file(&path) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                Err(StoreError::writing(path, source))
            }
            _ => Ok(None),
        };
    }
    let columns = serde_json::to_string(&table.descriptions()).expect("plain text");
    let metadata = Metadata {
        key: None,
        entries: vec![("study".to_owned(), study.to_owned()), ("columns".to_owned(), columns)],
    };
    let bytes = parquet::encode(table, &metadata);
    let beside = path.parent().unwrap_or(folder);
    write_whole(&path, &bytes, beside)?;
    Ok(Some(path))
}

pub fn stacked(tables: &[Table]) -> Result<Table, TableError> {
    let empty = Table::empty(&OWN);
    let tables: Vec<Table> = [empty].into_iter().chain(tables.iter().cloned()).collect();
    Table::stack(&tables)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::solve::PAIR_LIMIT;

    #[test]
    fn reasons_say_what_ended_and_what_is_known() {
        let errors = Some([0.0123, 5e-5]);
        assert_eq!(
            reason(PAIR_LIMIT, 20, Some(20), errors),
            "did not converge: stopped after 20 pairs of transforms (`max_pairs = 20`) with a \
             residual of 1.23e-2, above the tolerance 5.00e-5"
        );
        assert_eq!(
            reason(STALLED, 1, Some(20), errors),
            "did not converge: stopped after 1 pair of transforms with a residual of 1.23e-2, \
             above the tolerance 5.00e-5"
        );
        assert_eq!(
            reason(PAIR_LIMIT, 20, Some(20), None),
            "the search for the load at which the surfaces separate stopped after 20 pairs of \
             transforms (`max_pairs = 20`)"
        );
        assert!(reason(GAP_NOT_REACHED, 20, Some(20), errors).contains("jumps past it"));
    }
}
