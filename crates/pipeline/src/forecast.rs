//! Forecasts of the time that tasks take on this machine and, in [`memory`], of their memory.
//!
//! Except on small meshes, pairs of Fourier transforms take nearly all of the time. Their time is
//! the expected number of pairs times the measured time of one pair. All other work is estimated
//! roughly.

pub mod memory;
pub mod remaining;

use std::cell::RefCell;
use std::collections::BTreeMap;

use self::remaining::Remaining;
use crate::plan::sources::Sources;
use crate::plan::{Plan, Task};
use asperity_mechanics::solver::cost;
use asperity_stages::{Effort, Extent};
use asperity_tables::column::{Column, ColumnKind, optional_texts, reals, texts};
use asperity_tables::table::{Table, TableError};

/// Cost model that estimates the core-seconds of tasks.
#[derive(Debug, Default)]
pub struct CostModel {
    seconds_per_pair: RefCell<BTreeMap<[usize; 2], f64>>,
    /// Rows that remain of tasks that are stored in part.
    remaining: Remaining,
}

impl CostModel {
    /// Creates a model from the measured core-seconds of a pair of transforms, by mesh.
    pub fn measured(seconds_per_pair: BTreeMap<[usize; 2], f64>) -> CostModel {
        CostModel { seconds_per_pair: RefCell::new(seconds_per_pair), ..CostModel::default() }
    }

    /// Limits the cost of tasks to the rows that remain of them.
    pub fn for_remaining(self, remaining: Remaining) -> CostModel {
        CostModel { remaining, ..self }
    }

    /// Returns the rows that remain of tasks.
    pub fn remaining(&self) -> &Remaining {
        &self.remaining
    }

    /// Estimates the core-seconds of what remains of a task.
    pub fn seconds(&self, plan: &Plan, task: usize) -> f64 {
        self.in_seconds(self.remaining.effort(plan, task), plan.tasks[task].nodes)
    }

    /// Estimates the core-seconds that a whole task would take on a mesh of `nodes`.
    pub fn seconds_on(&self, task: &Task, nodes: [usize; 2]) -> f64 {
        self.in_seconds(effort(task, nodes), nodes)
    }

    fn in_seconds(&self, effort: Effort, nodes: [usize; 2]) -> f64 {
        let in_pairs = match effort.pairs {
            0.0 => 0.0,
            pairs => pairs * self.seconds_per_pair(nodes),
        };
        effort.seconds + in_pairs
    }

    /// Estimates the core-seconds of several tasks of a plan in total.
    pub fn seconds_of(&self, plan: &Plan, tasks: &[usize]) -> f64 {
        let seconds = tasks.iter().map(|&task| self.seconds(plan, task));
        // Not `sum`, which returns −0.0 for an empty iterator.
        seconds.fold(0.0, |sum, seconds| sum + seconds)
    }

    /// Returns the core-seconds of a pair of transforms, which are measured once for each mesh.
    fn seconds_per_pair(&self, nodes: [usize; 2]) -> f64 {
        let mut known = self.seconds_per_pair.borrow_mut();
        *known.entry(nodes).or_insert_with(|| cost::seconds_per_pair(nodes))
    }
}

fn effort(task: &Task, nodes: [usize; 2]) -> Effort {
    let extent = Extent { nodes, ..extent(task) };
    task.recipe.effort(extent).and_reading(extent.tables)
}

fn extent(Task { nodes, longer_side, rows, inputs, .. }: &Task) -> Extent {
    Extent { nodes: *nodes, longer_side: *longer_side, rows: *rows, tables: inputs.len() }
}

/// Number of tasks in each table of [`worklist`]. While a table is built, a row takes kilobytes.
const CHUNK: usize = 1024;

const STAGE: Column = Column::result("stage", ColumnKind::Text, "", "stage of the task");
const TASK: Column = Column::result("task", ColumnKind::Text, "", "key of the task");
const STATE: Column = Column::result("state", ColumnKind::Text, "", "cached or missing");
const STORE: Column =
    Column::result("store", ColumnKind::Text, "", "read-only store of the table of the task");
const CORE_SECONDS: Column =
    Column::result("core_seconds", ColumnKind::Real, "s", "expected core-seconds of the task");

/// Lists the tasks of a study in tables, so that users can distribute the tasks among machines.
///
/// Each task is one row with the parameter columns of the task. Inputs come before the tasks that
/// read them. A task that belongs to several stages is listed under the first one. The indices in
/// `missing` must be in ascending order. If tasks are read from read-only stores, a column names
/// these stores.
pub fn worklist(
    plan: &Plan,
    missing: &[usize],
    cost: &CostModel,
    sources: &Sources,
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
                (TASK, texts(tasks.clone().map(|&task| plan.tasks[task].table.key.to_string()))),
                (STATE, texts(tasks.clone().map(state))),
                (CORE_SECONDS, reals(tasks.clone().map(|&task| cost.seconds(plan, task)))),
            ],
        );
        let store = |&task: &usize| {
            let stores: Vec<_> =
                sources.of_task(task).map(|store| store.display().to_string()).collect();
            (!stores.is_empty()).then(|| stores.join(" "))
        };
        let own = if sources.is_empty() {
            own
        } else {
            own.with(vec![(STORE, optional_texts(tasks.clone().map(store)))])
        };
        let coordinates = tasks.map(|&task| plan.coordinates(task));
        Ok(own.beside(&Table::stack(&coordinates.collect::<Result<Vec<_>, _>>()?)?))
    })
}

/// Returns the model name of this processor, or its architecture if the name is unknown.
pub fn processor() -> String {
    let information = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model =
        information.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or(std::env::consts::ARCH, |(_, model)| model.trim()).to_owned()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::study::Study;

    use super::*;

    /// Returns the expected pairs of transforms and the other seconds of the last task of a study.
    fn last(realizations: u32, stages: &str) -> (f64, f64) {
        let manifest = format!(
            "
            [study]
            name = \"study\"
            [stage.surfaces]
            kind = \"generate\"
            nodes = 32
            hurst = 0.8
            k_lower = 2
            k_upper = 8
            realizations = {realizations}
            heights = \"redraw\"
            {stages}
            "
        );
        let study = Study::parse(&manifest, "study.toml", Path::new("")).unwrap();
        let plan = Plan::new(&study);
        let Effort { pairs, seconds } = {
            let task = plan.tasks.last().unwrap();
            effort(task, task.nodes)
        };
        (pairs, seconds)
    }

    fn fit(loads: u32, keys: &str) -> f64 {
        let stages = format!(
            "
            [stage.contact]
            kind = \"solve\"
            from = \"surfaces\"
            loads = {{ to = 0.06, steps = {loads} }}
            [stage.area]
            kind = \"measure\"
            from = \"contact\"
            [stage.law]
            kind = \"fit\"
            from = \"area\"
            law = \"contact-evolution\"
            {keys}
            "
        );
        last(5, &stages).1
    }

    #[test]
    fn a_fit_with_a_free_kappa_takes_longer_the_more_loads_there_are() {
        assert!(fit(40, "") > 3.0 * fit(10, ""));
        assert!(fit(10, "") > 3.0 * fit(10, "kappa = 2.5"));
        assert!(fit(10, "bootstrap = 10") < 0.1 * fit(10, ""));
        assert!(fit(10, "bootstrap = 0") < 0.01);
    }

    #[test]
    fn heights_of_a_pool_are_drawn_again() {
        let pool = "
            [stage.density]
            kind = \"measure\"
            from = \"surfaces\"
            pool = true
        ";
        assert_eq!(last(60, pool).0, 60.0 * last(1, pool).0);
    }
}
