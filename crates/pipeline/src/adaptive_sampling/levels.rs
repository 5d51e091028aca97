//! Numbers of surfaces on the meshes of multilevel means.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::MeshSurfaces;
use super::conditions::{
    Condition, Finding, SamplingError, input_chain, read, stage_of, tasks_of_surfaces,
};
use crate::plan::Plan;
use crate::study::{KnownMean, Limit};
use asperity_stages::aggregate::{FinestMean, finest_means};
use asperity_stages::columns::PAIRS;
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::{Kind, StageError};
use asperity_statistics::multilevel::{LevelCost, Term, best_numbers};
use asperity_tables::store::TaskTables;
use asperity_tables::table::Table;

/// Pairs of transforms of a surface besides those of its loads, for drawing and describing it.
const PAIRS_OF_SURFACE: f64 = 6.0;

/// Returns the meshes of a stage, from the coarsest, with their numbers of surfaces.
pub fn meshes(surfaces: &[PlannedSurfaces]) -> Vec<MeshSurfaces> {
    let mesh = |planned: &PlannedSurfaces| MeshSurfaces {
        nodes: planned.params.nodes(),
        surfaces: planned.surfaces(),
    };
    let mut meshes: Vec<MeshSurfaces> = surfaces.iter().map(mesh).collect();
    let order =
        |mesh: &MeshSurfaces| (mesh.nodes[0] * mesh.nodes[1], mesh.nodes, Reverse(mesh.surfaces));
    meshes.sort_by_key(order);
    meshes.dedup_by_key(|mesh| mesh.nodes);
    meshes
}

/// Evaluates the condition on a multilevel mean for a stage that generates surfaces. `surfaces` is
/// the index of this stage.
///
/// # Errors
/// Returns an error if a table cannot be read or lacks the column of the mean.
pub fn evaluate(
    plan: &Plan,
    surfaces: usize,
    mean: &KnownMean,
    task_tables: &impl TaskTables,
) -> Result<Condition, SamplingError> {
    let observed = &stage_of(plan, mean).tasks;
    let inputs = observed.iter().flat_map(|&task| plan.tasks[task].inputs.iter().copied());
    let is_of_surfaces = tasks_of_surfaces(plan, surfaces);
    let tasks: Vec<usize> = inputs.filter(is_of_surfaces).collect();
    let chains = tasks.iter().flat_map(|&task| input_chain(plan, task));
    let mut solved: Vec<usize> =
        chains.filter(|&task| plan.tasks[task].recipe.kind() == Kind::Solve).collect();
    solved.sort_unstable();
    solved.dedup();
    let all = [tasks.as_slice(), &solved].concat();
    let tables = match read(plan, &all, task_tables)? {
        Ok(tables) => tables,
        Err(open) => return Ok(open),
    };
    let (observed, contacts) = tables.split_at(tasks.len());
    let costs = costs(plan, &solved, contacts);
    let means = Table::stack(observed)
        .map_err(StageError::from)
        .and_then(|table| finest_means(&table, &mean.column))
        .map_err(|source| SamplingError::Mean { until: mean.to_string(), source })?;
    Ok(judged(&means, mean.limit, &costs))
}

/// Compares the standard errors of means with a limit, and finds the best numbers of surfaces.
/// Means without scatter are skipped.
fn judged(means: &[FinestMean], limit: Limit, costs: &BTreeMap<usize, f64>) -> Condition {
    // Without any mean the condition cannot hold.
    let mut largest: f64 = if means.is_empty() { f64::INFINITY } else { 0.0 };
    let mut best: BTreeMap<usize, f64> = BTreeMap::new();
    for found in means.iter().filter(|found| found.mean.error > 0.0) {
        let limit = match limit {
            Limit::Absolute(limit) => limit,
            Limit::Relative(share) => share * found.mean.value.abs(),
        };
        largest = largest.max(found.mean.error / limit);
        let meshes = found.meshes.iter().map(|&nodes| usize::try_from(nodes).unwrap_or(0));
        let level = |(nodes, term): (usize, &Term)| LevelCost {
            variance: term.weighted_variance,
            cost: costs.get(&nodes).copied().unwrap_or(nodes as f64 * PAIRS_OF_SURFACE),
        };
        let levels: Vec<_> = meshes.clone().zip(&found.mean.terms).map(level).collect();
        let numbers = best_numbers(&levels, limit * limit);
        for (nodes, number) in meshes.zip(numbers) {
            let most = best.entry(nodes).or_insert(0.0);
            *most = most.max(number);
        }
    }
    let finding = Finding::Levels { error: largest, best };
    if largest < 1.0 { Condition::Holds(finding) } else { Condition::Fails(finding) }
}

/// Returns the next numbers of surfaces: the best ones, but at least the present ones and at most
/// twice as many, and at most `at_most`. No mesh has fewer surfaces than a finer one.
pub fn next_numbers(
    now: &[MeshSurfaces],
    best: &BTreeMap<usize, f64>,
    at_most: u32,
) -> Vec<MeshSurfaces> {
    let next = |mesh: &MeshSurfaces| {
        let present = f64::from(mesh.surfaces);
        let wanted = best.get(&(mesh.nodes[0] * mesh.nodes[1])).copied().unwrap_or(0.0).ceil();
        let surfaces = wanted.clamp(present, 2.0 * present) as u32;
        MeshSurfaces { surfaces: surfaces.min(at_most).max(mesh.surfaces), ..*mesh }
    };
    let mut numbers: Vec<MeshSurfaces> = now.iter().map(next).collect();
    for mesh in (1..numbers.len()).rev() {
        numbers[mesh - 1].surfaces = numbers[mesh - 1].surfaces.max(numbers[mesh].surfaces);
    }
    numbers
}

/// Returns the cost of a surface on each mesh, by its number of nodes: nodes times pairs of
/// transforms. It is counted and not timed, so that the numbers of surfaces do not depend on the
/// machine. `solved` are tasks with the tables `contacts`.
fn costs(plan: &Plan, solved: &[usize], contacts: &[Table]) -> BTreeMap<usize, f64> {
    let mut counted: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for (&task, table) in solved.iter().zip(contacts) {
        let [x, y] = plan.tasks[task].nodes;
        let pairs = table.integers(PAIRS.name).into_iter().flat_map(|pairs| pairs.iter());
        let (all, tasks) = counted.entry(x * y).or_default();
        *all += pairs.flatten().sum::<i64>() as f64;
        *tasks += 1.0;
    }
    let cost = |(nodes, (all, tasks)): (usize, (f64, f64))| {
        (nodes, nodes as f64 * (PAIRS_OF_SURFACE + all / tasks))
    };
    counted.into_iter().map(cost).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_meshes(numbers: [u32; 3]) -> Vec<MeshSurfaces> {
        let mesh = |(side, surfaces): (usize, u32)| MeshSurfaces { nodes: [side; 2], surfaces };
        [64, 128, 256].into_iter().zip(numbers).map(mesh).collect()
    }

    #[test]
    fn numbers_approach_the_best_ones_by_at_most_a_factor_of_two() {
        let next = |now, best: [f64; 3], at_most| {
            let best = [64 * 64, 128 * 128, 256 * 256].into_iter().zip(best).collect();
            next_numbers(&on_meshes(now), &best, at_most)
        };
        assert_eq!(next([10, 10, 10], [400.0, 14.2, 3.0], 1000), on_meshes([20, 15, 10]));
        assert_eq!(next([320, 15, 10], [400.0, 14.2, 3.0], 1000), on_meshes([400, 15, 10]));
        assert_eq!(next([320, 15, 10], [400.0, 14.2, 3.0], 350), on_meshes([350, 15, 10]));
        assert_eq!(next([10, 10, 10], [2.0, 3.0, 16.5], 1000), on_meshes([17, 17, 17]));
        assert_eq!(next([10, 10, 10], [0.0; 3], 5), on_meshes([10, 10, 10]));
    }
}
