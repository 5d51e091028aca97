//! Nested iteration for an initial guess from coarser meshes, for loads far from earlier ones.
//!
//! The contact is first solved on a mesh of every second node along both axes. Its initial guess
//! comes from a mesh of every fourth node, and so on down to a mesh of negligible cost (Brandt,
//! *Math. Comput.* 31, 1977, 333). Pressure p and gap g of a mesh are combined in one map, s p − g,
//! which is positive in contact and negative where the gap is open. This map is interpolated to the
//! next finer mesh, where its positive part is the initial pressure (`prolongation`). The first
//! residual is then a few tenths of a mesh step, for any load and mesh. By extrapolation between
//! loads far apart it would be one to a hundred steps.
//!
//! On the coarser meshes except the smallest, the contact is solved in single precision only, to a
//! residual of a hundredth of their own mesh step. Meanwhile the maps of the finer mesh are not
//! needed, so coarser meshes borrow their memory.

use std::iter::successors;

use super::conjugate_gradients::{End, Goal};
use super::inner_solver::InnerSolver;
use super::line_search::{History, StepLengths};
use super::passes::PendingUpdate;
use super::prolongation::{CoarseContact, RATIO};
use super::start::Start;
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};
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

pub struct Coarser {
    /// Intermediate meshes from the finest to the coarsest.
    levels: Vec<Level>,
    coarsest: Coarsest,
}

struct Level {
    inner: InnerSolver,
    found: CoarseContact,
}

/// Smallest mesh. Each load is solved on it as if it were the first load.
struct Coarsest {
    elastic: Solver,
    /// Solver with pressures bounded by the hardness.
    yielding: Option<Solver>,
    found: CoarseContact,
}

/// Load, bound of the pressures and observer, which are the same for all meshes.
#[derive(Clone, Copy)]
struct LoadCase<'a> {
    load: f64,
    bound: Option<Hardness>,
    watch: &'a dyn Watch,
}

impl Coarser {
    /// Creates the coarser meshes of a surface, for pressures with and without the bound
    /// `hardness`.
    ///
    /// Returns `None` if the mesh is too small or cannot be halved often enough, or if the body has
    /// no coarser version.
    pub fn new(
        threads: &Threads,
        body: &dyn ElasticOperator,
        hardness: Option<Hardness>,
        heights: &[f64],
    ) -> Option<Self> {
        let row_nodes = body.grid().nodes()[1];
        let grids = coarser_grids(body.grid());
        let bodies: Option<Vec<_>> = grids.iter().map(|grid| body.on_coarser(*grid)).collect();
        let mut bodies = bodies?;
        let coarsest = bodies.pop()?;
        let mut stride = 1;
        let mut sampled = || {
            stride *= 2;
            every_so_many(stride, heights, row_nodes)
        };
        let levels = bodies.iter();
        let levels = levels.map(|body| Level::new(threads, &**body, sampled()));
        let levels = levels.collect();
        let heights: Vec<f64> = sampled().collect();
        let found = CoarseContact::empty(&*coarsest);
        let yielding = hardness.and_then(|hardness| {
            let body = body.on_coarser(coarsest.grid())?;
            Some(Solver {
                yields_from: 0.0,
                ..Solver::with_threads(threads.clone(), body, Some(hardness), &heights)
            })
        });
        Some(Self {
            levels,
            coarsest: Coarsest {
                elastic: Solver::with_threads(threads.clone(), coarsest, None, &heights),
                yielding,
                found,
            },
        })
    }

    pub fn set_threads(&mut self, threads: &Threads) {
        for level in &mut self.levels {
            level.inner.set_threads(threads.clone());
        }
        self.coarsest.elastic.set_threads(threads.clone());
        if let Some(yielding) = &mut self.coarsest.yielding {
            yielding.set_threads(threads.clone());
        }
    }

    /// Solves the contact under `load` on all coarser meshes, from the smallest up, and returns the
    /// result on the finest of them.
    ///
    /// `bound` is the upper bound of the pressures; it requires that [`Coarser::new`] was given a
    /// hardness. The gaps, pressure increments and last steps of `finer` are overwritten.
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

/// Returns whether `grid` has enough nodes that loads far from earlier ones are first solved on
/// coarser meshes.
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
    fn new(
        threads: &Threads,
        body: &dyn ElasticOperator,
        heights: impl Iterator<Item = f64>,
    ) -> Self {
        let heights = heights.map(|height| height as f32).collect();
        let mut inner = InnerSolver::new(threads, body, heights);
        inner.drop_maps();
        Self { inner, found: CoarseContact::empty(body) }
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
        let solver = match (case.bound, &mut self.yielding) {
            (Some(_), Some(yielding)) => yielding,
            _ => &mut self.elastic,
        };
        solver.reset();
        let settings = Settings { tolerance: TOLERANCE, pair_limit: PAIR_LIMIT };
        let outcome = solver.press(case.load, &settings, &|| case.watch.is_interrupted());
        self.found.take_solution(solver, &outcome, compliance);
        &self.found
    }
}

impl InnerSolver {
    fn prepare(&mut self, case: LoadCase) {
        self.load = case.load;
        self.bound = case.bound;
        // The result of a load may depend on earlier loads only through the saved state of the
        // solver.
        self.nested_step_lengths = StepLengths::default();
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
        self.scratch.take_over(&mut finer.scratch);
    }

    fn lent_maps(&mut self) -> [&mut Vec<f32>; 3] {
        [&mut self.gap, &mut self.pressure_increment, &mut self.last_step]
    }
}

/// Ratio of consecutive loads above which a load is first solved on coarser meshes.
///
/// This saves time above a ratio of 1.2 to 1.4 on 1024² and 2048² nodes, and above 1.4 to 1.6 on
/// 512².
const FAR: f64 = 1.3;

/// Smallest ratio of the tolerance to the rounding error of the largest displacement in contact for
/// which the first iterations are in single precision.
///
/// With ratios up to 3.1, rounding kept the residual above the tolerance on 4096² and 8192² nodes,
/// and the iterations had to start again. A start in double precision takes a tenth more time.
const DIGITS: f64 = 3.5;

/// Returns whether `load` and the last load differ by a factor of more than [`FAR`], or there is no
/// last load.
pub fn is_far(last: Option<f64>, load: f64) -> bool {
    last.is_none_or(|last| load > FAR * last || last > FAR * load)
}

impl Solver {
    /// Solves `load`, first on coarser meshes and then on this mesh, if it is far from the last
    /// load and not light, and if the mesh is large enough. Otherwise returns `None`.
    ///
    /// If the coarser meshes give no positive pressure, resets the solver to the state before the
    /// first load and returns `None`.
    pub(super) fn press_far(
        &mut self,
        load: f64,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        let last = Some(self.inner.load).filter(|last| *last > 0.0);
        if !is_far(last, load) || self.is_light(load) {
            return None;
        }
        let (threads, body) = (&self.inner.threads, &*self.body);
        let coarser = self.coarser.take();
        let coarser = coarser
            .or_else(|| Coarser::new(threads, body, self.hardness, &self.heights).map(Box::new));
        let mut coarser = coarser?;
        self.set_height_reference(0.0);
        self.save_previous();
        self.inner.load = load;
        self.inner.scratch.take_over(&mut self.double_scratch);
        let outcome = self.press_from(&mut coarser, settings, watch);
        self.coarser = Some(coarser);
        if outcome.is_none() {
            self.reset();
        }
        outcome
    }

    /// Solves the present load, first on coarser meshes and then on this mesh. Returns `None` if
    /// the coarser meshes give no positive pressure.
    ///
    /// The hardness bounds the pressures only if elastic pressures exceed it, so that all other
    /// loads have the same solution as without a hardness.
    fn press_from(
        &mut self,
        coarser: &mut Coarser,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        let load = self.inner.load;
        if let Some(hardness) = self.hardness.filter(|_| load >= self.yields_from) {
            let found = coarser.find(&mut self.inner, load, Some(hardness), watch);
            return self.solve_from(found, Some(hardness), settings, watch);
        }
        let mut found = coarser.find(&mut self.inner, load, None, watch);
        let passed = |hardness: &Hardness| found.peak_pressure > hardness.pressure();
        if let Some(hardness) = self.hardness.filter(passed) {
            self.inner.pairs += found.finer_pairs();
            let step_lengths = self.inner.nested_step_lengths.clone();
            found = coarser.find(&mut self.inner, load, Some(hardness), watch);
            let outcome = self.solve_from(found, Some(hardness), settings, watch)?;
            if outcome.saturated_nodes > 0 || outcome.stop != Stop::Converged {
                self.yields_from = load;
                return Some(outcome);
            }
            self.inner.nested_step_lengths = step_lengths;
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
        let displacement = self.highest + found.reference;
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
