//! The tables that a condition looks at.

use super::condition::Condition;
use crate::plan::Plan;
use asperity_tables::store::{StoreError, TaskTables};
use asperity_tables::table::Table;

/// The tables of some tasks, in their order; or the condition as it stands, if some are not there.
///
/// # Errors
/// When one cannot be read that computing it again would not mend.
pub fn read(
    plan: &Plan,
    tasks: &[usize],
    there: &impl TaskTables,
) -> Result<Result<Vec<Table>, Condition>, StoreError> {
    let lines = || tasks.iter().flat_map(|&task| line(plan, task)).collect();
    let keys: Vec<_> = tasks.iter().map(|&task| plan.tasks[task].key).collect();
    if there.have(&keys).contains(&false) {
        return Ok(Err(Condition::open(lines())));
    }
    let mut tables = Vec::with_capacity(tasks.len());
    let mut damaged = Vec::new();
    for (&task, key) in tasks.iter().zip(keys) {
        match there.light(key) {
            Ok(table) => tables.push(table),
            Err(error) if error.is_mendable() => damaged.push((task, error)),
            Err(error) => return Err(error),
        }
    }
    Ok(match damaged.is_empty() {
        true => Ok(tables),
        false => Err(Condition::Open { tasks: lines(), damaged }),
    })
}

/// A task and those that it depends on, up to its surface and the spectrum of that: each reads one
/// other.
pub fn line(plan: &Plan, task: usize) -> Vec<usize> {
    let above = |&task: &usize| plan.tasks[task].inputs.first().copied();
    std::iter::successors(Some(task), above).collect()
}
