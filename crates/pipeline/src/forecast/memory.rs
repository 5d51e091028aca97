//! Forecast of the memory that tasks take, and the memory limit of a run.
//!
//! The memory of a task is a known number of bytes per node of its mesh. If a task does not fit
//! into the limit, the run ends with an error before any task starts. Otherwise each task starts
//! when enough memory is free ([`crate::runner`]).

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::{fmt, fs};

use bytesize::ByteSize;
use sysinfo::{ProcessesToUpdate, System};

use crate::plan::Plan;
use asperity_stages::Footprint;
use asperity_tables::parquet::Columns;

/// Memory that the program takes in addition to the memory of its tasks.
pub const PROGRAM: ByteSize = ByteSize::mib(64);

/// Number of copies of a table in memory while it is written: values, columns, pages and the file.
const COPIES: f64 = 4.0;

/// Number of copies of input tables in memory: as read, stacked, and as columns to be reduced.
pub const COPIES_OF_INPUTS: f64 = 3.0;

/// Returns whether the process can allocate this much memory now.
pub fn is_available(size: ByteSize) -> bool {
    let mut memory = Vec::<u8>::new();
    let size = usize::try_from(size.0).unwrap_or(usize::MAX);
    let is_given = memory.try_reserve_exact(size).is_ok();
    // The compiler may remove an allocation that is never used.
    black_box(&memory);
    is_given
}

/// Returns the largest memory that one of these tasks takes.
pub fn of_largest(plan: &Plan, tasks: &[usize]) -> ByteSize {
    let each = tasks.iter().map(|&task| of_task(plan, task, 1));
    each.max().unwrap_or(ByteSize(0))
}

/// Returns the number of threads for a run that has `room` for its tasks: `most`, or fewer if a
/// task draws one surface per thread and these surfaces would not fit into `room`.
pub fn threads(plan: &Plan, tasks: &[usize], room: ByteSize, most: NonZeroUsize) -> NonZeroUsize {
    let pooling = tasks.iter().filter(|&&task| plan.tasks[task].recipe.pools_surfaces());
    let fit = pooling.map(|&task| room.0 / of_task(plan, task, 1).0.max(1));
    let fewest = usize::try_from(fit.min().unwrap_or(u64::MAX)).unwrap_or(usize::MAX);
    NonZeroUsize::new(fewest).map_or(NonZeroUsize::MIN, |fewest| fewest.min(most))
}

/// Returns the peak memory of a task. If the task draws several surfaces, it draws up to `threads`
/// of them at the same time.
pub fn of_task(plan: &Plan, task: usize, threads: usize) -> ByteSize {
    let task = &plan.tasks[task];
    let reads_maps = task.recipe.columns_read() == Columns::All;
    let inputs = task.inputs.iter().filter(|_| reads_maps);
    let read: f64 = inputs.map(|&input| plan.tasks[input].recipe.footprint().table).sum();
    let Footprint { work, table } = task.recipe.footprint();
    let at_once = if task.recipe.pools_surfaces() { threads.min(task.inputs.len()) } else { 1 };
    let [nodes_x, nodes_y] = task.nodes.map(|nodes| nodes as f64);
    let nodes = nodes_x * nodes_y;
    ByteSize((nodes * (work * at_once as f64 + COPIES * table + read)) as u64)
}

/// Address space that a thread reserves: its stack, and 64 MiB for the allocator of glibc. Most of
/// it is never used.
const OF_A_THREAD: ByteSize = ByteSize::mib(66);

/// Number of threads that compute no task: the main thread, and threads that show progress or wait
/// for signals.
const OTHER_THREADS: u64 = 4;

/// Limit on the memory of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemoryLimit {
    size: ByteSize,
    limit: LimitedBy,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum LimitedBy {
    Asked,
    Machine,
    Addresses,
}

impl MemoryLimit {
    /// Creates the limit for a run on `threads` threads.
    ///
    /// The limit is the size `asked` that the user allows, by default seven eighths of the memory
    /// of the machine. It is lower if the process has less address space left.
    pub fn new(asked: Option<ByteSize>, threads: usize) -> MemoryLimit {
        let allowance = match asked {
            Some(size) => MemoryLimit { size, limit: LimitedBy::Asked },
            None => {
                MemoryLimit { size: ByteSize(of_machine().0 / 8 * 7), limit: LimitedBy::Machine }
            }
        };
        match addresses_left(threads) {
            Some(size) if size < allowance.size => {
                MemoryLimit { size, limit: LimitedBy::Addresses }
            }
            _ => allowance,
        }
    }

    /// Returns the memory that all running tasks together may take: the limit minus [`PROGRAM`].
    pub fn room(self) -> ByteSize {
        ByteSize(self.size.0.saturating_sub(PROGRAM.0))
    }

    /// Checks that each task fits into the limit when it runs alone.
    ///
    /// # Errors
    /// Returns an error about the largest task if it does not fit.
    pub fn fits(self, plan: &Plan, tasks: &[usize]) -> Result<(), TooLarge> {
        let of = |&task: &usize| of_task(plan, task, 1).0;
        // `max_by_key` returns the last of equal tasks, so the order is reversed to get the first.
        let Some(largest) = tasks.iter().copied().rev().max_by_key(of) else {
            return Ok(());
        };
        let task_takes = of_task(plan, largest, 1);
        let takes = PROGRAM + task_takes;
        if takes <= self.size {
            return Ok(());
        }
        let nodes = plan.tasks[largest].nodes;
        let share = self.room().0 as f64 / task_takes.0 as f64;
        let mut stages = plan.stages.iter();
        let stage = stages.find(|stage| stage.tasks.contains(&largest));
        Err(TooLarge {
            stage: stage.map_or_else(String::new, |stage| stage.name.clone()),
            mesh: (task_takes.0 > 0).then(|| {
                let most = nodes.map(|nodes| (nodes as f64 * share.sqrt()) as usize);
                [nodes, most]
            }),
            takes,
            allowance: self,
        })
    }
}

impl fmt::Display for MemoryLimit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.size.display().si();
        match self.limit {
            LimitedBy::Asked => write!(formatter, "the {size} of `--memory`"),
            LimitedBy::Machine => {
                write!(formatter, "{size}, seven eighths of the memory available to this process")
            }
            LimitedBy::Addresses => {
                write!(formatter, "the {size} of address space that `ulimit -v` leaves")
            }
        }
    }
}

/// A task takes more memory than the limit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct TooLarge {
    stage: String,
    /// Nodes along x and y of the mesh of the task, and of the largest mesh that would fit. `None`
    /// if the memory of the task does not depend on a mesh.
    mesh: Option<[[usize; 2]; 2]>,
    takes: ByteSize,
    allowance: MemoryLimit,
}

impl fmt::Display for TooLarge {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stage, allowance, .. } = self;
        let takes = rounded_up(self.takes);
        write!(formatter, "a task of stage `{stage}` needs {takes} of memory")?;
        if let Some([[nodes_x, nodes_y], _]) = self.mesh {
            write!(formatter, " on its mesh of {nodes_x} × {nodes_y} nodes")?;
        }
        write!(formatter, ", more than {allowance}: ")?;
        match allowance.limit {
            LimitedBy::Asked => write!(formatter, "increase it")?,
            LimitedBy::Machine => write!(formatter, "try it anyway with `--memory {takes}`")?,
            LimitedBy::Addresses => write!(formatter, "raise that limit")?,
        }
        match self.mesh {
            Some([_, [most_x, most_y]]) if most_x > 0 && most_y > 0 => {
                write!(formatter, ", or reduce the mesh to {most_x} × {most_y} nodes")
            }
            _ => Ok(()),
        }
    }
}

/// Formats a size with one decimal, rounded up.
fn rounded_up(size: ByteSize) -> String {
    let (unit, name) = match size.0 {
        1_000_000_000.. => (1e9, "GB"),
        _ => (1e6, "MB"),
    };
    format!("{:.1}{name}", (10.0 * size.0 as f64 / unit).ceil() / 10.0)
}

/// Returns the memory of the machine, or the limit for this process if that is lower. Limits that
/// cannot be determined are ignored.
pub fn of_machine() -> ByteSize {
    let mut system = System::new();
    system.refresh_memory();
    let mut limits = vec![system.total_memory()];
    limits.extend(system.cgroup_limits().map(|limits| limits.total_memory));
    if let Ok(own) = sysinfo::get_current_pid() {
        system.refresh_processes(ProcessesToUpdate::Some(&[own]), false);
        let own = system.process(own).and_then(|process| process.cgroup_limits());
        limits.extend(own.map(|limits| limits.total_memory));
    }
    let known = limits.into_iter().filter(|&limit| limit > 0);
    ByteSize(known.min().unwrap_or(u64::MAX))
}

/// Returns the address space left for a run on `threads` threads, or `None` without a limit. Linux
/// counts reserved addresses even if they are not backed by memory.
fn addresses_left(threads: usize) -> Option<ByteSize> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let limit = address_limit(&limits)?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let taken: ByteSize =
        status.lines().find_map(|line| line.strip_prefix("VmSize:"))?.trim().parse().ok()?;
    // polars starts a thread for each core, and each of our threads may have a helper.
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (2 * threads + cores) as u64 + OTHER_THREADS;
    let needed = taken.0 + threads * OF_A_THREAD.0;
    Some(ByteSize(limit.saturating_sub(needed)))
}

/// Parses the limit of the address space in bytes from `/proc/self/limits`.
fn address_limit(limits: &str) -> Option<u64> {
    let mut lines = limits.lines();
    let limit = lines.find_map(|line| line.strip_prefix("Max address space"))?;
    limit.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
pub mod tests;
