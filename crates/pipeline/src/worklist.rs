//! The tasks of a study one by one, for those who share it out themselves: among the machines of
//! a cluster, say.

use crate::cost::CostModel;
use crate::plan::Plan;
use asperity_tables::column::{Column, ColumnKind, reals, texts};
use asperity_tables::table::{Table, TableError};

/// Tasks to a table: a row takes kilobytes while its table is put together.
const CHUNK: usize = 1024;

const STAGE: Column = Column::result("stage", ColumnKind::Text, "", "stage of the task");
const TASK: Column = Column::result("task", ColumnKind::Text, "", "key of the task");
const STATE: Column = Column::result("state", ColumnKind::Text, "", "cached or missing");
const CORE_SECONDS: Column = Column::result(
    "core_seconds",
    ColumnKind::Real,
    "s",
    "time of one core that the task is expected to take",
);

/// A row for each task, with what places it in its study: inputs before the tasks that read them,
/// a task of several stages under the first. `missing` ascend.
pub fn tables(
    plan: &Plan,
    missing: &[usize],
    cost: &CostModel,
) -> impl Iterator<Item = Result<Table, TableError>> {
    let mut is_listed = vec![false; plan.tasks.len()];
    let stages = plan.stages.iter().flat_map(move |stage| {
        let is_new = |task: &usize| !std::mem::replace(&mut is_listed[*task], true);
        let own: Vec<usize> = stage.tasks.iter().copied().filter(is_new).collect();
        let chunks = own.chunks(CHUNK).map(|tasks| (&stage.name, tasks.to_vec()));
        chunks.collect::<Vec<_>>()
    });
    stages.map(|(stage, tasks)| {
        let state = |task: &usize| match missing.binary_search(task) {
            Ok(_) => "missing",
            Err(_) => "cached",
        };
        let tasks = tasks.iter();
        let own = Table::new(
            tasks.len(),
            vec![
                (STAGE, texts(tasks.clone().map(|_| stage))),
                (TASK, texts(tasks.clone().map(|&task| plan.tasks[task].key.to_string()))),
                (STATE, texts(tasks.clone().map(state))),
                (CORE_SECONDS, reals(tasks.clone().map(|&task| cost.seconds(&plan.tasks[task])))),
            ],
        );
        let coordinates = tasks.map(|&task| plan.coordinates(task));
        Ok(own.beside(&Table::stack(&coordinates.collect::<Result<Vec<_>, _>>()?)?))
    })
}
