//! Nested iteration for an initial guess from coarser meshes.
//!
//! The contact is first solved on a mesh of every second node along both axes. Its initial guess
//! comes from a mesh of every fourth node, and so on down to a mesh of negligible cost (Brandt,
//! *Math. Comput.* 31, 1977, 333). Pressure p and gap g of a mesh are combined in one map, s p − g,
//! which is positive in contact and negative where the gap is open. This map is interpolated to the
//! next finer mesh, where its positive part is the initial pressure (`prolongation`). The first
//! residual is then a few tenths of a mesh step, for any load and mesh, or a few steps if the map
//! is not periodic.
//!
//! On the coarser meshes except the smallest, the contact is solved in single precision only, to a
//! residual of a hundredth of their own mesh step. Meanwhile the maps of the finer mesh are not
//! needed, so coarser meshes borrow their memory.

use std::sync::Arc;

use super::inner::{End, Goal, InnerSolver, State};
use super::lanes::for_rows_with;
use super::line_search::StepControl;
use super::mesh::Mesh;
use super::passes::PendingUpdate;
use super::problem::CoarserMeshes;
use super::prolongation::CoarseMap;
use super::refinement::Evaluation;
use super::{Hardness, Outcome, Settings, Solver, Watch};
use crate::threads::Threads;

/// Residual to reach on a coarser mesh, in units of rms slope × its smaller mesh step. Half or
/// twice this value takes as many pairs.
const TOLERANCE: f64 = 1e-2;

/// Maximum number of transform pairs on a coarser mesh: three times the usual number.
const PAIR_LIMIT: u32 = 60;

/// Solvers on coarser meshes.
pub struct Coarser {
    /// Intermediate meshes from the finest to the coarsest.
    levels: Vec<Level>,
    pub coarsest: Coarsest,
    /// Hardness for which the contact under the present load was found, if it was.
    pub found_for: Option<Option<Hardness>>,
}

struct Level {
    inner: InnerSolver,
    found: CoarseContact,
}

/// Smallest mesh.
pub struct Coarsest {
    pub solver: Solver,
    found: CoarseContact,
}

/// Load, hardness and observer, which are the same for all meshes.
#[derive(Clone, Copy)]
struct LoadCase<'a> {
    load: f64,
    /// Upper bound of the pressures on a mesh if those on the next coarser mesh exceed it.
    hardness: Option<Hardness>,
    watch: &'a dyn Watch,
}

impl Coarser {
    pub fn new(threads: &Threads, meshes: &CoarserMeshes) -> Self {
        let levels = meshes.levels.iter().map(|mesh| Level::new(threads, mesh.clone()));
        let solver = Solver::of_problem(threads.clone(), meshes.coarsest.clone());
        let found = CoarseContact::empty(&solver.inner.mesh);
        Self { levels: levels.collect(), coarsest: Coarsest { solver, found }, found_for: None }
    }

    pub fn set_threads(&mut self, threads: &Threads) {
        for level in &mut self.levels {
            level.inner.set_threads(threads.clone());
        }
        self.coarsest.solver.set_threads(threads.clone());
    }

    /// Solves the contact under the load of `finer` on all coarser meshes, from the smallest up,
    /// and returns the result on the finest of them.
    ///
    /// `hardness` bounds the pressures from the first mesh on that follows a mesh with larger
    /// pressures. The gaps, pressure increments and last steps of `finer` are overwritten.
    fn find(
        &mut self,
        finer: &mut InnerSolver,
        hardness: Option<Hardness>,
        watch: &dyn Watch,
    ) -> &CoarseContact {
        let case = LoadCase { load: finer.load, hardness, watch };
        self.found_for = Some(hardness);
        find(&mut self.levels, &mut self.coarsest, finer, case)
    }

    /// Returns the contact that was found last, on the finest of the coarser meshes.
    fn found(&self) -> &CoarseContact {
        self.levels.first().map_or(&self.coarsest.found, |level| &level.found)
    }
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
        let found = CoarseContact::empty(&mesh);
        let mut inner = InnerSolver::new(threads, mesh);
        inner.drop_maps();
        Self { inner, found }
    }

    /// Solves the contact from the result on the next coarser mesh, and sets `found` to the result,
    /// a map s p − g with s = `compliance`.
    fn find_from(&mut self, coarse: &CoarseContact, compliance: f64, case: LoadCase) {
        let Self { inner, found } = self;
        inner.begin_bounded(case.load, coarse.next_bound(case.hardness));
        match inner.begin_from(coarse.map(), coarse.reference) {
            None => found.clear(),
            Some(start) => {
                let (pending, offset) = Self::approach(inner, start, case.watch);
                found.take_iterate(inner, pending, offset, compliance);
            }
        }
        found.pairs = f64::from(inner.pairs) + coarse.pairs / RATIO;
    }

    /// Iterates from `start` until the residual is at most [`TOLERANCE`]. Returns the update that
    /// is still to be applied to the pressures, and the mean gap in contact.
    fn approach(
        inner: &mut InnerSolver,
        mut start: State,
        watch: &dyn Watch,
    ) -> (PendingUpdate, f64) {
        let goal = Goal { residual: TOLERANCE, is_evaluated: false };
        let stop = |pairs| pairs >= PAIR_LIMIT || watch.is_interrupted();
        let mut control = inner.step_control(true);
        loop {
            let End::Residual { pending, offset, is_reached } =
                inner.iterate(&mut control, start, goal, &stop)
            else {
                unreachable!("no step is left to evaluate");
            };
            if is_reached || stop(inner.pairs) {
                return (pending, offset);
            }
            start = inner.begin_again(pending, offset);
        }
    }
}

impl Coarsest {
    fn find(&mut self, compliance: f64, case: LoadCase) -> &CoarseContact {
        let settings = Settings { tolerance: TOLERANCE, pair_limit: PAIR_LIMIT };
        let watch = || case.watch.is_interrupted();
        let solver = &mut self.solver;
        let outcome = solver.press(case.load, &settings, &watch);
        self.found.take_solution(solver, &outcome, compliance);
        let bound = self.found.next_bound(case.hardness);
        if bound.is_some() {
            let outcome = solver.solve_within(bound, &settings, &watch);
            self.found.take_solution(solver, &outcome, compliance);
        }
        &self.found
    }
}

/// Ratio of the numbers of nodes of a mesh and of the next coarser mesh.
pub const RATIO: f64 = 4.0;

pub struct CoarseContact {
    /// Map s p − g of the pressure p and the gap g, with a compliance s.
    pressure_less_gap: Vec<f32>,
    nodes: [usize; 2],
    is_periodic: bool,
    pub reference: f64,
    peak_pressure: f64,
    /// Bound with which the pressures were found, or `None` if they were not bounded.
    bound: Option<Hardness>,
    /// Number of transform pairs used; pairs on coarser meshes count in proportion to their nodes.
    pub pairs: f64,
}

impl CoarseContact {
    pub fn empty(mesh: &Mesh) -> Self {
        Self {
            pressure_less_gap: Vec::new(),
            nodes: mesh.nodes,
            is_periodic: !mesh.has_margin(),
            reference: 0.0,
            peak_pressure: 0.0,
            bound: None,
            pairs: 0.0,
        }
    }

    pub fn map(&self) -> CoarseMap<'_> {
        let Self { pressure_less_gap: values, nodes, is_periodic, .. } = self;
        CoarseMap { values, nodes: *nodes, is_periodic: *is_periodic }
    }

    /// Returns the bound of the pressures on the next finer mesh: `hardness` if the pressures on
    /// this mesh exceed it, otherwise none.
    fn next_bound(&self, hardness: Option<Hardness>) -> Option<Hardness> {
        self.bound.or(hardness.filter(|hardness| self.peak_pressure > hardness.pressure()))
    }

    pub fn clear(&mut self) {
        self.pressure_less_gap.clear();
        self.pressure_less_gap.resize(self.nodes[0] * self.nodes[1], 0.0);
        self.peak_pressure = 0.0;
    }

    /// Sets the map to s p − g of `inner` after the update `pending`, with s = `compliance`. Gaps
    /// are measured from `offset`, approximately the mean gap in contact.
    pub fn take_iterate(
        &mut self,
        inner: &InnerSolver,
        pending: PendingUpdate,
        offset: f64,
        compliance: f64,
    ) {
        self.pressure_less_gap.resize(inner.mesh.cells(), 0.0);
        let map = &mut self.pressure_less_gap;
        self.peak_pressure = inner.pressure_less_gap(pending, offset, compliance, map);
        self.bound = inner.bound;
        self.reference = inner.reference + offset;
    }

    /// Sets the map to s p − g of the last solution of `solver`, which has this outcome, with s =
    /// `compliance`.
    pub fn take_solution(&mut self, solver: &Solver, outcome: &Outcome, compliance: f64) {
        let (gap, offset) = (&solver.inner.gap, solver.offset);
        let nodes = solver.pressure.iter().zip(gap);
        let less_gap = nodes.map(|(p, gap)| (compliance * p - (f64::from(*gap) - offset)) as f32);
        self.pressure_less_gap.clear();
        self.pressure_less_gap.extend(less_gap);
        self.reference = solver.inner.reference + offset;
        self.peak_pressure = outcome.peak_pressure;
        self.bound = solver.inner.bound;
        self.pairs = f64::from(outcome.pairs);
    }
}

impl Solver {
    /// Sets the pressures to those interpolated from a coarser mesh, imposes the load and evaluates
    /// them. Returns `None` if no interpolated pressure is positive.
    pub(super) fn evaluate_prolonged(
        &mut self,
        coarse: &CoarseContact,
        settings: &Settings,
    ) -> Option<Evaluation> {
        let prolonged = self.inner.prolonged(coarse.map())?;
        let row_nodes = self.inner.mesh.nodes[1];
        let (threads, hardness) = (&self.inner.threads, self.inner.ceiling());
        let state = (prolonged, vec![0.0; row_nodes]);
        for_rows_with(threads, &mut self.pressure, row_nodes, state, |state, row, pressure| {
            let (prolonged, single) = state;
            prolonged.set_row(row, single);
            for (p, single) in pressure.iter_mut().zip(single) {
                // The hardness may not be a single-precision number.
                *p = if *single >= prolonged.ceiling { hardness } else { f64::from(*single) };
            }
        });
        self.impose_load();
        self.inner.reference = coarse.reference;
        Some(self.evaluate_guess(settings))
    }
}

/// Smallest ratio of the tolerance to the rounding error of the largest displacement in contact for
/// which the first iterations are in single precision.
///
/// With ratios up to 3.1, rounding kept the residual above the tolerance on 4096² and 8192² nodes,
/// and the iterations had to start again. A start in double precision takes a tenth more time.
const DIGITS: f64 = 3.5;

impl Solver {
    /// Returns whether the material yields under the present load on the finest of the coarser
    /// meshes, or `None` if they are not used.
    pub(super) fn yields_on_coarser(
        &mut self,
        hardness: Hardness,
        watch: &dyn Watch,
    ) -> Option<bool> {
        let hardness = Some(hardness);
        self.with_coarser(hardness, watch, |_, found| Some(found.next_bound(hardness).is_some()))
    }

    /// Finds initial pressures for the present load and bound from coarser meshes, and solves the
    /// load in single precision. Returns `None` if coarser meshes are not used, or if no
    /// interpolated pressure is positive.
    pub(super) fn guess_from_coarser(
        &mut self,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<(StepControl, Evaluation)> {
        self.with_coarser(self.inner.bound, watch, |solver, found| {
            let mut control = solver.inner.step_control(true);
            // The mean displacement is zero. The displacement of a node in contact is its height
            // plus the reference.
            let displacement = solver.problem.highest + found.reference;
            let digit = solver.inner.residual(f64::from(f32::EPSILON) * displacement);
            let evaluation = if settings.tolerance > DIGITS * digit {
                let start = solver.inner.begin_from(found.map(), found.reference)?;
                solver.approach(&mut control, start, settings, watch)
            } else {
                solver.evaluate_prolonged(found, settings)?
            };
            Some((control, evaluation))
        })
    }

    /// Calls `use_found` with the contact under the present load on the finest of the coarser
    /// meshes, in a material of this hardness. Returns `None` if there are no coarser meshes or if
    /// the load is light.
    fn with_coarser<R>(
        &mut self,
        hardness: Option<Hardness>,
        watch: &dyn Watch,
        use_found: impl FnOnce(&mut Self, &CoarseContact) -> Option<R>,
    ) -> Option<R> {
        if self.is_light() {
            return None;
        }
        let mut coarser = self.coarser.take()?;
        self.inner.scratch.take_over(&mut self.double_scratch);
        let is_found = coarser.found_for.is_some_and(|found_for| {
            found_for == hardness || hardness.is_none() && coarser.found().bound.is_none()
        });
        if !is_found {
            let found = coarser.find(&mut self.inner, hardness, watch);
            // As many pairs on this mesh take as long.
            self.inner.pairs += (found.pairs / RATIO).round() as u32;
        }
        let result = use_found(self, coarser.found());
        self.coarser = Some(coarser);
        result
    }
}
