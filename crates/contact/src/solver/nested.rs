//! Nested iteration for an initial guess from coarser meshes.
//!
//! The contact is first solved on a mesh of every second node along both axes. Its initial guess
//! comes from a mesh of every fourth node, and so on down to a mesh of negligible cost (Brandt,
//! *Math. Comput.* 31, 1977, 333). Pressure p and gap g of a mesh are combined in one map, s p − g,
//! which is positive in contact and negative where the gap is open. This map is interpolated to the
//! next finer mesh, where its positive part is the initial pressure (`prolongation`). The first
//! residual is then a few tenths of a mesh step, for any load and mesh.
//!
//! On the coarser meshes except the smallest, the contact is solved in single precision only, to a
//! residual of a hundredth of their own mesh step. Meanwhile the maps of the finer mesh are not
//! needed, so coarser meshes borrow their memory.

use std::iter::successors;
use std::sync::Arc;

use super::conjugate_gradients::{End, Goal};
use super::inner_solver::{InnerSolver, Mesh};
use super::line_search::History;
use super::passes::PendingUpdate;
use super::press::has_yielded;
use super::problem::Problem;
use super::prolongation::{CoarseContact, RATIO};
use super::start::Start;
use super::{Hardness, Outcome, Settings, Solver, Watch};
use crate::elasticity::ElasticOperator;
use crate::grid::Grid;
use crate::threads::Threads;

/// Minimum number of nodes along the shorter side of the smallest mesh.
const MIN_NODES: usize = 128;

/// Minimum number of meshes for nested iteration, including the finest mesh. With two meshes, on
/// 256² nodes, nested iteration takes longer than a solution on one mesh.
const MIN_MESHES: usize = 3;

/// Residual to reach on a coarser mesh, in units of rms slope × its smaller mesh step. Half or
/// twice this value takes as many pairs.
const TOLERANCE: f64 = 1e-2;

/// Maximum number of transform pairs on a coarser mesh: three times the usual number.
const PAIR_LIMIT: u32 = 60;

/// Coarser meshes of a surface, shared by its solvers.
pub struct CoarserMeshes {
    /// Intermediate meshes from the finest to the coarsest.
    levels: Vec<Arc<Mesh>>,
    /// Smallest mesh, without a hardness.
    coarsest: Arc<Problem>,
}

/// Solvers on coarser meshes.
pub struct Coarser {
    /// Intermediate meshes from the finest to the coarsest.
    levels: Vec<Level>,
    coarsest: Coarsest,
}

struct Level {
    inner: InnerSolver,
    found: CoarseContact,
}

/// Smallest mesh.
struct Coarsest {
    solver: Solver,
    found: CoarseContact,
}

/// Load, bound of the pressures and observer, which are the same for all meshes.
#[derive(Clone, Copy)]
struct LoadCase<'a> {
    load: f64,
    bound: Option<Hardness>,
    watch: &'a dyn Watch,
}

impl CoarserMeshes {
    /// Prepares the coarser meshes of a surface.
    ///
    /// Returns `None` if the mesh is too small or cannot be halved often enough, or if the body has
    /// no coarser version.
    pub fn new(threads: &Threads, body: &dyn ElasticOperator, heights: &[f64]) -> Option<Self> {
        let row_nodes = body.grid().nodes()[1];
        let grids = coarser_grids(body.grid());
        let bodies: Option<Vec<_>> = grids.iter().map(|grid| body.on_coarser(*grid)).collect();
        let mut bodies = bodies?;
        let coarsest = bodies.pop()?;
        let mut stride = 1;
        let mut sampled = || -> Vec<f64> {
            stride *= 2;
            every_so_many(stride, heights, row_nodes).collect()
        };
        let levels =
            bodies.iter().map(|body| Arc::new(Mesh::from_heights(threads, &**body, &sampled())));
        let levels = levels.collect();
        let coarsest = Problem::new(threads, coarsest, None, &sampled());
        Some(Self { levels, coarsest: Arc::new(coarsest) })
    }
}

impl Coarser {
    pub fn new(threads: &Threads, meshes: &CoarserMeshes) -> Self {
        let levels = meshes.levels.iter().map(|mesh| Level::new(threads, mesh.clone()));
        let solver = Solver::of_problem(threads.clone(), meshes.coarsest.clone());
        let found = CoarseContact::empty(solver.inner.mesh.nodes);
        Self { levels: levels.collect(), coarsest: Coarsest { solver, found } }
    }

    pub fn set_threads(&mut self, threads: &Threads) {
        for level in &mut self.levels {
            level.inner.set_threads(threads.clone());
        }
        self.coarsest.solver.set_threads(threads.clone());
    }

    /// Solves the contact under `load` on all coarser meshes, from the smallest up, and returns the
    /// result on the finest of them.
    ///
    /// `bound` is the upper bound of the pressures. The gaps, pressure increments and last steps of `finer` are overwritten.
    pub fn find(
        &mut self,
        finer: &mut InnerSolver,
        load: f64,
        bound: Option<Hardness>,
        watch: &dyn Watch,
    ) -> &CoarseContact {
        let case = LoadCase { load, bound, watch };
        find(&mut self.levels, &mut self.coarsest, finer, case)
    }
}

fn coarser_grids(grid: Grid) -> Vec<Grid> {
    let grids: Vec<Grid> = successors(coarsened(&grid), coarsened).collect();
    if grids.len() + 1 < MIN_MESHES {
        return Vec::new();
    }
    grids
}

/// Returns whether `grid` has enough nodes that loads are first solved on coarser meshes.
pub fn is_nested(grid: Grid) -> bool {
    !coarser_grids(grid).is_empty()
}

/// Returns the grid of every second node along both axes, if it is large enough.
fn coarsened(grid: &Grid) -> Option<Grid> {
    let coarser = grid.coarsened()?;
    let is_large = coarser.nodes().into_iter().all(|nodes| nodes >= MIN_NODES);
    is_large.then_some(coarser)
}

/// Returns the heights of every `stride`-th node along both axes.
fn every_so_many(stride: usize, heights: &[f64], row_nodes: usize) -> impl Iterator<Item = f64> {
    let rows = heights.chunks_exact(row_nodes).step_by(stride);
    rows.flat_map(move |row| row.iter().step_by(stride).copied())
}

/// Solves the contact on the smallest mesh and then on all `levels`, from the last to the first.
/// Returns the result on the finest of them. `finer` is the next finer mesh, which lends its maps.
fn find<'a>(
    levels: &'a mut [Level],
    coarsest: &'a mut Coarsest,
    finer: &mut InnerSolver,
    case: LoadCase,
) -> &'a CoarseContact {
    let compliance = finer.compliance();
    let Some((level, coarser)) = levels.split_first_mut() else {
        return coarsest.find(compliance, case);
    };
    level.inner.borrow_from(finer);
    let found = find(coarser, coarsest, &mut level.inner, case);
    level.find_from(found, compliance, case);
    finer.borrow_from(&mut level.inner);
    &level.found
}

impl Level {
    fn new(threads: &Threads, mesh: Arc<Mesh>) -> Self {
        let found = CoarseContact::empty(mesh.nodes);
        let mut inner = InnerSolver::new(threads, mesh);
        inner.drop_maps();
        Self { inner, found }
    }

    /// Solves the contact from the result on the next coarser mesh, and sets `found` to the result,
    /// a map s p − g with s = `compliance`.
    fn find_from(&mut self, coarse: &CoarseContact, compliance: f64, case: LoadCase) {
        let Self { inner, found } = self;
        inner.prepare(case);
        match inner.begin_from(coarse) {
            None => found.clear(),
            Some(start) => {
                let (pending, offset) = inner.find_coarse(start, case.watch);
                found.take_iterate(inner, pending, offset, compliance);
            }
        }
        found.pairs = f64::from(inner.pairs) + coarse.pairs / RATIO;
    }
}

impl Coarsest {
    fn find(&mut self, compliance: f64, case: LoadCase) -> &CoarseContact {
        let settings = Settings { tolerance: TOLERANCE, pair_limit: PAIR_LIMIT };
        let watch = || case.watch.is_interrupted();
        let outcome = match case.bound {
            None => self.solver.press(case.load, &settings, &watch),
            Some(_) => {
                self.solver.begin_load(case.load, &settings);
                self.solver.solve_within(case.bound, &settings, &watch)
            }
        };
        self.found.take_solution(&self.solver, &outcome, compliance);
        &self.found
    }
}

impl InnerSolver {
    fn prepare(&mut self, case: LoadCase) {
        self.load = case.load;
        self.bound = case.bound;
        self.extension.is_enabled = true;
        self.pairs = 0;
    }

    /// Iterates from `start` until the residual is at most [`TOLERANCE`]. Returns the update that
    /// is still to be applied to the pressures, and the mean gap in contact.
    fn find_coarse(&mut self, mut start: Start, watch: &dyn Watch) -> (PendingUpdate, f64) {
        let goal = Goal { residual: TOLERANCE, is_evaluated: false };
        let stop = |pairs| pairs >= PAIR_LIMIT || watch.is_interrupted();
        let mut history = History::nested();
        loop {
            let End::Residual { pending, offset, is_reached } =
                self.iterate(&mut history, start, goal, &stop)
            else {
                unreachable!("no step is left to evaluate");
            };
            if is_reached || stop(self.pairs) {
                return (pending, offset);
            }
            start = self.begin_again(pending, offset);
        }
    }

    /// Frees the maps that are borrowed from a finer mesh during a solve.
    fn drop_maps(&mut self) {
        for map in self.lent_maps() {
            *map = Vec::new();
        }
    }

    /// Swaps the maps with the larger maps of a finer mesh, and takes the scratch of that mesh.
    fn borrow_from(&mut self, finer: &mut Self) {
        for (own, map) in self.lent_maps().into_iter().zip(finer.lent_maps()) {
            std::mem::swap(own, map);
        }
        self.buffers.scratch.take_over(&mut finer.buffers.scratch);
    }

    fn lent_maps(&mut self) -> [&mut Vec<f32>; 3] {
        [&mut self.gap, &mut self.pressure_increment, &mut self.last_step]
    }
}

/// Smallest ratio of the tolerance to the rounding error of the largest displacement in contact for
/// which the first iterations are in single precision.
///
/// With ratios up to 3.1, rounding kept the residual above the tolerance on 4096² and 8192² nodes,
/// and the iterations had to start again. A start in double precision takes a tenth more time.
const DIGITS: f64 = 3.5;

impl Solver {
    /// Solves the present load, first on coarser meshes and then on this mesh. Returns `None` if
    /// there are no coarser meshes, if the load is light, or if the coarser meshes give no positive
    /// pressure.
    ///
    /// The hardness bounds the pressures only if elastic pressures exceed it, so that all other
    /// loads have the same solution as without a hardness.
    pub(super) fn press_nested(
        &mut self,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        if self.is_light(self.inner.load) {
            return None;
        }
        let mut coarser = self.coarser.take()?;
        self.inner.buffers.scratch.take_over(&mut self.double_scratch);
        let outcome = self.press_from(&mut coarser, settings, watch);
        self.coarser = Some(coarser);
        outcome
    }

    fn press_from(
        &mut self,
        coarser: &mut Coarser,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        let load = self.inner.load;
        let mut found = coarser.find(&mut self.inner, load, None, watch);
        let passed = |hardness: &Hardness| found.peak_pressure > hardness.pressure();
        if let Some(hardness) = self.problem.hardness.filter(passed) {
            self.inner.pairs += found.finer_pairs();
            found = coarser.find(&mut self.inner, load, Some(hardness), watch);
            let outcome = self.solve_from(found, Some(hardness), settings, watch)?;
            if has_yielded(&outcome) {
                return Some(outcome);
            }
            found = coarser.find(&mut self.inner, load, None, watch);
        }
        let outcome = self.solve_from(found, None, settings, watch)?;
        Some(self.solve_again_if_yielding(outcome, settings, watch))
    }

    /// Solves the present load from `found`, the result on the next coarser mesh, with `bound` as
    /// upper bound of the pressures. Returns `None` if no interpolated pressure is positive.
    fn solve_from(
        &mut self,
        found: &CoarseContact,
        bound: Option<Hardness>,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        self.inner.bound = bound;
        self.inner.extension.is_enabled = true;
        self.inner.pairs += found.finer_pairs();
        let mut history = History::nested();
        // The mean displacement is zero. The displacement of a node in contact is its height plus
        // the reference.
        let displacement = self.problem.highest + found.reference;
        let digit = self.inner.residual(f64::from(f32::EPSILON) * displacement);
        let evaluation = if settings.tolerance > DIGITS * digit {
            let start = self.inner.begin_from(found)?;
            self.approach(&mut history, start, settings, watch)
        } else {
            self.evaluate_prolonged(found, settings)?
        };
        Some(self.solve(history, evaluation, settings, watch))
    }
}
