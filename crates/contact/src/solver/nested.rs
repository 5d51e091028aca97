//! Nested iteration: where a search begins if no loads before lead there, or only loads far away.
//!
//! The contact under a load is solved for on a mesh of every second node along both axes first, and
//! there from one of every fourth, down to a mesh so small that it costs next to nothing (Brandt,
//! *Math. Comput.* 31, 1977, 333). What pressure p and gap g are on a mesh is one map, s p − g:
//! positive where there is pressure, negative where there is a gap. Between its nodes is
//! interpolated, and with what is positive there the next finer search begins (`prolongation`). Its
//! residual is a few tenths of a mesh step then, whatever the load and however large the mesh; on
//! the straight line through two loads far apart it is one to a hundred steps.
//!
//! All meshes but the smallest one search in single precision alone, to a hundredth of their own
//! mesh step. As long as they do, what a finer mesh has of gap and pressure is of no use yet, and
//! its memory is lent to them.

use std::iter::successors;

use super::conjugate_gradients::{End, Goal};
use super::line_search::{History, Steps};
use super::passes::PendingUpdate;
use super::prolongation::{CoarseContact, RATIO};
use super::search::Search;
use super::start::Start;
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};
use crate::elasticity::ElasticOperator;
use crate::grid::Grid;
use crate::threads::Threads;

/// Nodes along the shorter side of the smallest mesh, at least.
const FEWEST: usize = 128;

/// Meshes to a surface, at least, its own among them: on 256² nodes a load takes longer by way of
/// coarser ones.
const FEWEST_MESHES: usize = 3;

/// The largest residual on a coarser mesh, in steps of that mesh. With half or twice it as many
/// pairs.
const TOLERANCE: f64 = 1e-2;

/// Pairs of transforms after which a coarser mesh is left as it is: three times what most take.
const PAIR_LIMIT: u32 = 60;

/// The meshes on which a contact is solved for before it is on that of a surface.
pub struct Coarser {
    /// From the finest on.
    levels: Vec<Level>,
    coarsest: Coarsest,
}

struct Level {
    search: Search,
    found: CoarseContact,
}

/// The smallest mesh, whose solvers press each load as a first one.
struct Coarsest {
    elastic: Solver,
    /// Where pressures are kept below the hardness.
    yielding: Option<Solver>,
    found: CoarseContact,
}

/// What is case of all meshes.
#[derive(Clone, Copy)]
struct LoadCase<'a> {
    load: f64,
    bound: Option<Hardness>,
    watch: &'a dyn Watch,
}

impl Coarser {
    /// Of a surface on a body; none if there are too few meshes of every second node, or if the
    /// body is on none.
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
        let found = CoarseContact::nothing(&*coarsest);
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

    /// Lets these threads share the work from now on.
    pub fn set_threads(&mut self, threads: &Threads) {
        for level in &mut self.levels {
            level.search.set_threads(threads.clone());
        }
        self.coarsest.elastic.set_threads(threads.clone());
        if let Some(yielding) = &mut self.coarsest.yielding {
            yielding.set_threads(threads.clone());
        }
    }

    /// Finds the contact under a load on all meshes, with pressures below a bound if there is one,
    /// of which the body has told. The maps of the finer search are lost.
    pub fn find(
        &mut self,
        finer: &mut Search,
        load: f64,
        bound: Option<Hardness>,
        watch: &dyn Watch,
    ) -> &CoarseContact {
        let case = LoadCase { load, bound, watch };
        find(&mut self.levels, &mut self.coarsest, finer, case)
    }
}

/// The grids of coarser meshes, if there are enough of them.
fn coarser_grids(grid: Grid) -> Vec<Grid> {
    let grids: Vec<Grid> = successors(coarsened(&grid), coarsened).collect();
    if grids.len() + 1 < FEWEST_MESHES {
        return Vec::new();
    }
    grids
}

/// Whether loads far from those before are solved for on coarser meshes first.
pub fn is_nested(grid: Grid) -> bool {
    !coarser_grids(grid).is_empty()
}

/// The grid of every second node, if it is large enough.
fn coarsened(grid: &Grid) -> Option<Grid> {
    let coarser = grid.coarsened()?;
    let is_large = coarser.nodes().into_iter().all(|nodes| nodes >= FEWEST);
    is_large.then_some(coarser)
}

/// One height of so many along both axes.
fn every_so_many(stride: usize, heights: &[f64], row_nodes: usize) -> impl Iterator<Item = f64> {
    let rows = heights.chunks_exact(row_nodes).step_by(stride);
    rows.flat_map(move |row| row.iter().step_by(stride).copied())
}

/// Finds the contact on the first of these levels, by way of the others.
fn find<'a>(
    levels: &'a mut [Level],
    coarsest: &'a mut Coarsest,
    finer: &mut Search,
    case: LoadCase,
) -> &'a CoarseContact {
    let compliance = finer.compliance();
    let Some((level, coarser)) = levels.split_first_mut() else {
        return coarsest.find(compliance, case);
    };
    level.search.borrow_from(finer);
    let found = find(coarser, coarsest, &mut level.search, case);
    level.find_from(found, compliance, case);
    finer.borrow_from(&mut level.search);
    &level.found
}

impl Level {
    fn new(
        threads: &Threads,
        body: &dyn ElasticOperator,
        heights: impl Iterator<Item = f64>,
    ) -> Self {
        let heights = heights.map(|height| height as f32).collect();
        let mut search = Search::new(threads, body, heights);
        search.drop_maps();
        Self { search, found: CoarseContact::nothing(body) }
    }

    /// Finds the contact from what was found on the next coarser mesh.
    fn find_from(&mut self, coarse: &CoarseContact, compliance: f64, case: LoadCase) {
        let Self { search, found } = self;
        search.prepare(case);
        match search.begin_from(coarse) {
            None => found.clear(),
            Some(start) => {
                let (pending, offset) = search.find_coarse(start, case.watch);
                found.take_search(search, pending, offset, compliance);
            }
        }
        found.pairs = f64::from(search.pairs) + coarse.pairs / RATIO;
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

impl Search {
    fn prepare(&mut self, case: LoadCase) {
        self.load = case.load;
        self.bound = case.bound;
        // Bits of a load are to depend on the loads before by what a solver keeps of them alone.
        self.nested_steps = Steps::default();
        self.extension.continues = true;
        self.pairs = 0;
    }

    /// Iterates to where a finer mesh can begin: with this still to be done to pressures, and gaps
    /// in contact about as high as that.
    fn find_coarse(&mut self, mut start: Start, watch: &dyn Watch) -> (PendingUpdate, f64) {
        let goal = Goal { residual: TOLERANCE, is_evaluated: false };
        let stop = |pairs| pairs >= PAIR_LIMIT || watch.is_interrupted();
        let mut history = History::nested();
        loop {
            let End::Residual { pending, offset, is_reached } =
                self.iterate(&mut history, start, goal, &stop)
            else {
                unreachable!("no move is to be evaluated");
            };
            if is_reached || stop(self.pairs) {
                return (pending, offset);
            }
            start = self.begin_again(pending, offset);
        }
    }

    /// Has no maps of gap and pressure, but when they are lent.
    fn drop_maps(&mut self) {
        for map in self.lent_maps() {
            *map = Vec::new();
        }
    }

    /// Takes over the maps of a finer mesh, whose first parts are enough, and what its transforms
    /// write on the way.
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

/// A load over the last one, or the other way around, from which on it is solved for on coarser
/// meshes first. On 1024² and 2048² nodes that takes less time from 1.2 to 1.4 on, on 512² from 1.4
/// to 1.6 on.
const FAR: f64 = 1.3;

/// Where the tolerance is more than this many times the last digit, in single precision, of the
/// highest displacement, a search begins in single precision. With 3.1 and less it ended above the
/// tolerance, by rounding, on 4096² and 8192² nodes, and went on from there; beginning in double
/// precision takes a tenth more time.
const DIGITS: f64 = 3.5;

/// Whether a load is far from the last one, or the first.
pub fn is_far(last: Option<f64>, load: f64) -> bool {
    last.is_none_or(|last| load > FAR * last || last > FAR * load)
}

impl Solver {
    /// The outcome under a load, if it is far from the last one and the mesh is large enough for
    /// coarser ones.
    pub(super) fn press_far(
        &mut self,
        load: f64,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        let last = Some(self.search.load).filter(|last| *last > 0.0);
        if !is_far(last, load) || self.is_light(load) {
            return None;
        }
        let (threads, body) = (&self.search.threads, &*self.body);
        let coarser = self.coarser.take();
        let coarser = coarser
            .or_else(|| Coarser::new(threads, body, self.hardness, &self.heights).map(Box::new));
        let mut coarser = coarser?;
        self.count_heights_from(0.0);
        self.save_previous();
        self.search.load = load;
        self.search.scratch.take_over(&mut self.double_scratch);
        let outcome = self.press_from(&mut coarser, settings, watch);
        self.coarser = Some(coarser);
        if outcome.is_none() {
            self.reset();
        }
        outcome
    }

    /// Solves by way of coarser meshes. Elastic loads owe nothing to a hardness that they do not
    /// pass, so that coarser meshes are case without it first.
    fn press_from(
        &mut self,
        coarser: &mut Coarser,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        let load = self.search.load;
        if let Some(hardness) = self.hardness.filter(|_| load >= self.yields_from) {
            let found = coarser.find(&mut self.search, load, Some(hardness), watch);
            return self.solve_from(found, Some(hardness), settings, watch);
        }
        let mut found = coarser.find(&mut self.search, load, None, watch);
        let passed = |hardness: &Hardness| found.peak_pressure > hardness.pressure();
        if let Some(hardness) = self.hardness.filter(passed) {
            self.search.pairs += found.finer_pairs();
            let steps = self.search.nested_steps.clone();
            found = coarser.find(&mut self.search, load, Some(hardness), watch);
            let outcome = self.solve_from(found, Some(hardness), settings, watch)?;
            if outcome.saturated_nodes > 0 || outcome.stop != Stop::Converged {
                self.yields_from = load;
                return Some(outcome);
            }
            self.search.nested_steps = steps;
            found = coarser.find(&mut self.search, load, None, watch);
        }
        let outcome = self.solve_from(found, None, settings, watch)?;
        Some(self.yield_if_passed(outcome, settings, watch))
    }

    /// Solves from what was found on coarser meshes, for pressures below a bound if there is one.
    fn solve_from(
        &mut self,
        found: &CoarseContact,
        bound: Option<Hardness>,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        self.search.bound = bound;
        self.search.extension.continues = true;
        self.search.pairs += found.finer_pairs();
        let mut history = History::nested();
        // The mean displacement is zero, and that of a node in contact its height above the
        // reference.
        let displacement = self.highest + found.reference;
        let digit = self.search.residual(f64::from(f32::EPSILON) * displacement);
        let evaluation = if settings.tolerance > DIGITS * digit {
            let start = self.search.begin_from(found)?;
            self.approach(&mut history, start, settings, watch)
        } else {
            self.evaluate_prolonged(found, settings)?
        };
        Some(self.solve(history, evaluation, settings, watch))
    }
}
