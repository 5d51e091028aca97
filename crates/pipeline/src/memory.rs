//! How much memory tasks take, and what there is for them.
//!
//! What a task takes is known before it begins: so much for each node of its mesh. One that does not
//! fit is refused before anything starts, and tasks begin as others leave their room
//! ([`crate::runner`]).

use std::hint::black_box;
use std::num::NonZeroUsize;

use bytesize::ByteSize;

use crate::plan::Plan;
use asperity_stages::Footprint;
use asperity_tables::parquet::Columns;

mod allowance;

pub use allowance::{Allowance, TooLarge};

/// What the program takes before it holds a surface.
pub const PROGRAM: ByteSize = ByteSize::mib(64);

/// How often a table is in memory while it is finished: values, columns, pages and the file.
const COPIES: f64 = 4.0;

/// Copies of input tables in memory at once: as they are read, stacked, and as columns to be
/// reduced.
pub const COPIES_OF_INPUTS: f64 = 3.0;

/// Whether the system gives so much memory to this process, here and now.
pub fn is_there(size: ByteSize) -> bool {
    let mut memory = Vec::<u8>::new();
    let size = usize::try_from(size.0).unwrap_or(usize::MAX);
    let is_given = memory.try_reserve_exact(size).is_ok();
    // Memory that nobody looks at need not be asked for, says the compiler.
    black_box(&memory);
    is_given
}

/// The most that any of these tasks takes.
pub fn of_largest(plan: &Plan, tasks: &[usize]) -> ByteSize {
    let each = tasks.iter().map(|&task| of_task(plan, task, 1));
    each.max().unwrap_or(ByteSize(0))
}

/// How many threads may work on tasks: as many as are asked for, unless some task draws a surface on
/// each of them, and there is room for fewer.
pub fn threads(plan: &Plan, tasks: &[usize], room: ByteSize, most: NonZeroUsize) -> NonZeroUsize {
    let pooling = tasks.iter().filter(|&&task| plan.tasks[task].recipe.pools_surfaces());
    let fit = pooling.map(|&task| room.0 / of_task(plan, task, 1).0.max(1));
    let fewest = usize::try_from(fit.min().unwrap_or(u64::MAX)).unwrap_or(usize::MAX);
    NonZeroUsize::new(fewest).map_or(NonZeroUsize::MIN, |fewest| fewest.min(most))
}

/// What a task takes at its peak, with so many threads to draw the surfaces on that it pools.
pub fn of_task(plan: &Plan, task: usize, threads: usize) -> ByteSize {
    let task = &plan.tasks[task];
    let reads_maps = task.recipe.columns_read() == Columns::All;
    let inputs = task.inputs.iter().filter(|_| reads_maps);
    let read: f64 = inputs.map(|&input| plan.tasks[input].recipe.footprint().table).sum();
    let Footprint { work, table } = task.recipe.footprint();
    let at_once = match task.recipe.pools_surfaces() {
        true => threads.min(task.inputs.len()),
        false => 1,
    };
    let [nodes_x, nodes_y] = task.nodes.map(|nodes| nodes as f64);
    let nodes = nodes_x * nodes_y;
    ByteSize((nodes * (work * at_once as f64 + COPIES * table + read)) as u64)
}

#[cfg(test)]
pub mod tests {
    use std::path::Path;

    use super::*;
    use crate::study::Study;

    pub fn plan(nodes: usize, more: &str) -> Plan {
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
        Plan::of(
            &Study::parse(&manifest, "study.toml", Path::new(""), crate::study::no_claims).unwrap(),
        )
    }

    pub fn all(plan: &Plan) -> Vec<usize> {
        (0..plan.tasks.len()).collect()
    }

    /// Bytes of the largest task, over the nodes of the mesh.
    fn bytes_per_node(nodes: usize, more: &str) -> f64 {
        let plan = plan(nodes, more);
        of_largest(&plan, &all(&plan)).0 as f64 / (nodes * nodes) as f64
    }

    #[test]
    fn memory_is_that_of_the_maps() {
        let few = "loads = [0.1, 0.2]";
        assert_eq!(bytes_per_node(256, few), bytes_per_node(64, few));
        let fine = bytes_per_node(64, "loads = [0.1, 0.2]\ntolerance = 1e-8");
        assert_eq!(fine, bytes_per_node(64, few) + 4.0);
        let free = bytes_per_node(64, "loads = [0.1, 0.2]\nboundary = \"free\"");
        assert_eq!(free, bytes_per_node(64, few) + 44.0);
        let kept = bytes_per_node(64, "loads = [0.1, 0.2]\npressures = \"all\"");
        assert!(kept > bytes_per_node(64, few) + 2.0 * 8.0);
        let contacts = bytes_per_node(64, "loads = { to = 0.2, steps = 90 }");
        assert!(contacts > bytes_per_node(64, few) + 88.0 / 8.0);
    }

    #[test]
    fn surfaces_are_pooled_on_as_many_threads_as_they_fit() {
        let pool = "loads = [0.1]
            [stage.heights]
            kind = \"measure\"
            from = \"surfaces\"
            pool = true";
        let plan = plan(64, pool);
        let pooled = plan.stages[2].tasks.clone();
        let one = of_task(&plan, pooled[0], 1);
        let eight = NonZeroUsize::new(8).unwrap();
        let threads = |room: u64| threads(&plan, &all(&plan), ByteSize(room), eight).get();
        assert_eq!([threads(0), threads(3 * one.0), threads(100 * one.0)], [1, 3, 8]);
    }

    #[test]
    fn more_memory_than_there_are_addresses_is_not_there() {
        assert!(is_there(ByteSize::mib(1)));
        assert!(!is_there(ByteSize(u64::MAX)));
        assert!(!is_there(ByteSize(1 << 62)));
    }
}
