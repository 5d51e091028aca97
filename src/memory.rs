//! How much memory tasks take, and how many of them fit into it at once.

use bytesize::ByteSize;
use sysinfo::{ProcessesToUpdate, System};

use crate::plan::Plan;
use crate::runner::columns_read_by;
use crate::stages::Footprint;
use crate::store::parquet::Columns;

/// What the program takes before it holds a surface.
pub const PROGRAM: ByteSize = ByteSize::mib(64);

/// How often a table is in memory while it is finished: values, columns, pages and the file.
const COPIES: f64 = 4.0;

/// What the machine has, or as much of it as this process may use. What cannot be found out does
/// not limit anything.
pub fn of_machine() -> ByteSize {
    let mut system = System::new();
    system.refresh_memory();
    let mut limits = vec![system.total_memory()];
    limits.extend(system.cgroup_limits().map(|limits| limits.total_memory));
    if let Ok(own) = sysinfo::get_current_pid() {
        system.refresh_processes(ProcessesToUpdate::Some(&[own]), false);
        let own = system
            .process(own)
            .and_then(|process| process.cgroup_limits());
        limits.extend(own.map(|limits| limits.total_memory));
    }
    let known = limits.into_iter().filter(|&limit| limit > 0);
    ByteSize(known.min().unwrap_or(u64::MAX))
}

/// The most that any of these tasks takes.
pub fn of_largest(plan: &Plan, tasks: &[usize]) -> ByteSize {
    let each = tasks.iter().map(|&task| of_task(plan, task));
    ByteSize(each.max().unwrap_or(0))
}

/// How many tasks of this size fit into the memory at once; one is always tried.
pub fn workers(largest: ByteSize, memory: ByteSize) -> usize {
    let room = memory.0.saturating_sub(PROGRAM.0);
    let workers = room / largest.0.max(1);
    usize::try_from(workers).unwrap_or(usize::MAX).max(1)
}

/// Bytes that a task takes at its peak.
fn of_task(plan: &Plan, task: usize) -> u64 {
    let task = &plan.tasks[task];
    let reads_maps = columns_read_by(&task.recipe) == Columns::All;
    let inputs = task.inputs.iter().filter(|_| reads_maps);
    let read: f64 = inputs
        .map(|&input| plan.tasks[input].recipe.footprint().table)
        .sum();
    let Footprint { work, table } = task.recipe.footprint();
    let nodes = (task.nodes as f64).powi(2);
    (nodes * (work + COPIES * table + read)) as u64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::study::Study;

    /// Bytes of the largest task, over the nodes of the mesh.
    fn bytes_per_node(nodes: usize, more: &str) -> f64 {
        let manifest = format!(
            "
            [study]
            name = \"study\"
            [stage.surfaces]
            kind = \"generate\"
            nodes = {nodes}
            hurst = 0.8
            k_lower = 2
            k_upper = 8
            heights = \"redraw\"
            [stage.contact]
            kind = \"solve\"
            from = \"surfaces\"
            {more}
            "
        );
        let study = Study::parse(&manifest, "study.toml", Path::new("")).unwrap();
        let plan = Plan::of(&study);
        let tasks: Vec<usize> = (0..plan.tasks.len()).collect();
        of_largest(&plan, &tasks).0 as f64 / (nodes * nodes) as f64
    }

    #[test]
    fn memory_is_that_of_the_maps() {
        let few = "loads = [0.1, 0.2]";
        assert_eq!(bytes_per_node(256, few), bytes_per_node(64, few));
        let kept = bytes_per_node(64, "loads = [0.1, 0.2]\npressures = \"all\"");
        assert!(kept > bytes_per_node(64, few) + 2.0 * 8.0);
        let contacts = bytes_per_node(64, "loads = { to = 0.2, steps = 90 }");
        assert!(contacts > bytes_per_node(64, few) + 88.0 / 8.0);
    }

    #[test]
    fn as_many_work_as_fit_and_one_always_does() {
        let largest = ByteSize::mib(100);
        assert_eq!(workers(largest, PROGRAM + ByteSize::mib(399)), 3);
        assert_eq!(workers(largest, PROGRAM + ByteSize::mib(400)), 4);
        assert_eq!(workers(largest, ByteSize(1)), 1);
        assert_eq!(workers(ByteSize(0), ByteSize::gib(1)), 960 << 20);
    }

    #[test]
    fn the_machine_has_memory() {
        let memory = of_machine();
        assert!(memory > PROGRAM, "{memory}");
    }
}
