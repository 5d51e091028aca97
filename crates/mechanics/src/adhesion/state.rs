//! Computation of the next state of a path from the previous state, and the quantities of a state.

use super::body::{gather, spread};
use super::descent::{Control, End, Fields};
use super::exponential::exponential;
use super::passes::visit;
use super::{AdhesivePath, Settings, Stop, Target};
use crate::solver::Watch;

/// Largest relative error of the mean gap of an isolated patch.
const GAP_ERROR: f64 = 1e-11;

/// Tolerance during the search for the load of pull-off, as a fraction of its accuracy. The error
/// of the load at which a state becomes unstable is about the residual.
const SEARCH_TOLERANCE: f64 = 0.1;

/// Largest residual of a state, as a fraction of the largest attraction and of the load. With a
/// larger one the state need not bear its load: both are far below E* h′ for stiff bodies.
const MAX_SHARE: f64 = 1e-2;

/// Residual that rounding leaves.
const ROUNDING: f64 = 1e-10;

/// State of an adhesive contact, without its maps.
///
/// Gaps and displacements are in units of a L, pressures in units of a E*, and energies are per
/// area of the map, in units of a² E* L, with the number a of [`Adhesion`](super::Adhesion).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AdhesiveState {
    /// Reason why the computation ended.
    pub stop: Stop,
    /// Largest tension under which the bodies stay together, as a negative mean pressure; `None`
    /// unless they have been pulled off.
    pub pull_off_load: Option<f64>,
    /// Number of transform pairs used.
    pub pairs: u32,
    /// Largest violation of balance at a node, as a pressure: |p + (w/ρ) exp(−g/ρ)| outside
    /// contact, and in contact the tension by which p falls short of −w/ρ.
    pub residual: f64,
    /// Mean gap ⟨g⟩ over the map; infinite if the bodies are apart.
    pub mean_gap: f64,
    /// Mean net pressure p₀ over the map.
    pub mean_pressure: f64,
    /// Mean displacement ⟨u⟩ over the map; zero for a body that a uniform pressure does not
    /// displace.
    pub mean_displacement: f64,
    /// Number of nodes with g = 0.
    pub contact_nodes: usize,
    /// Number of nodes with p > 0.
    pub repulsive_nodes: usize,
    /// Mean of max(−p, 0) over the map.
    pub attractive_pressure: f64,
    /// Mean of max(p, 0) over the map.
    pub repulsive_pressure: f64,
    /// Mean over the map of the net pressures of the nodes with g = 0.
    pub pressure_in_contact: f64,
    /// Largest net pressure.
    pub peak_pressure: f64,
    /// Lowest net pressure, at least −w/ρ except for the residual.
    pub lowest_pressure: f64,
    /// Elastic energy ½⟨p u⟩.
    pub elastic_energy: f64,
    /// Energy of the interaction ⟨φ(g)⟩, which is not positive.
    pub adhesion_energy: f64,
}

/// Result of a descent at a mean gap over the mesh.
#[derive(Debug, Clone, Copy)]
struct Trial {
    /// Mean gap over the mesh.
    on_mesh: f64,
    /// Mean gap over the map, less the prescribed one.
    error: f64,
}

/// Search for the mean gap over the doubled mesh of an isolated patch at which the mean gap over
/// the map is the prescribed one.
///
/// The secant method, within a bracket once both signs of the error were found. If the bracket
/// becomes narrow beside the errors at its ends, these belong to two branches of states, and the
/// map jumps between them. The search then follows the branch of the last trial to the other side.
/// It ends if the map jumps back.
#[derive(Debug, Default)]
struct GapSearch {
    last: Option<Trial>,
    below: Option<Trial>,
    above: Option<Trial>,
    /// Width of the bracket when it was last halved, and the trials since then.
    width: Option<f64>,
    slow: u32,
    /// Change of the mean gap over the mesh per change over the map.
    ratio: Option<f64>,
    jumps: u32,
    trials: u32,
}

impl GapSearch {
    /// Maximum number of trials, far more than usual.
    const TRIALS: u32 = 60;
    /// Jumps after which no state with the prescribed mean gap is expected.
    const JUMPS: u32 = 3;
    /// Width of a bracket at which the map jumps, as a fraction of the change of its mean gap.
    const NARROW: f64 = 1e-3;
    /// Number of trials after which a bracket that was not halved is bisected.
    const SLOW: u32 = 3;
    /// Smallest ratio, and the largest as a multiple of the ratio before.
    const RATIOS: [f64; 2] = [0.2, 4.0];

    /// Returns the mean gap over the mesh of the next trial, or `None` if no state is expected.
    fn next(&mut self, trial: Trial) -> Option<f64> {
        self.trials += 1;
        let is_below = trial.error < 0.0;
        *(if is_below { &mut self.below } else { &mut self.above }) = Some(trial);
        if let (Some(below), Some(above)) = (self.below, self.above)
            && above.on_mesh - below.on_mesh <= Self::NARROW * (above.error - below.error)
        {
            *(if is_below { &mut self.above } else { &mut self.below }) = None;
            (self.last, self.width, self.ratio) = (None, None, None);
            self.jumps += 1;
        }
        if self.jumps == Self::JUMPS || self.trials == Self::TRIALS {
            return None;
        }
        let secant = self
            .last
            .map_or(f64::NAN, |last| (trial.on_mesh - last.on_mesh) / (trial.error - last.error));
        let has_last = self.last.replace(trial).is_some();
        let (Some(below), Some(above)) = (self.below, self.above) else {
            let [least, growth] = Self::RATIOS;
            let before = self.ratio.unwrap_or(1.0);
            let largest = growth * before;
            let ratio = match secant {
                secant if secant > 0.0 && secant.is_finite() => secant.clamp(least, largest),
                _ if has_last => largest,
                _ => before,
            };
            self.ratio = Some(ratio);
            return Some(trial.on_mesh - ratio * trial.error);
        };
        let width = above.on_mesh - below.on_mesh;
        if self.width.is_none_or(|before| width <= 0.5 * before) {
            (self.width, self.slow) = (Some(width), 0);
        } else {
            self.slow += 1;
        }
        let next = trial.on_mesh - secant * trial.error;
        let is_inside = below.on_mesh < next && next < above.on_mesh;
        let middle = 0.5 * (below.on_mesh + above.on_mesh);
        Some(if is_inside && self.slow < Self::SLOW { next } else { middle })
    }
}

impl AdhesivePath {
    /// Computes the state at `target` from the last state of the path.
    ///
    /// If the bodies are apart, a state at a mean gap or under a load that is not negative begins
    /// with the undeformed surface, whose highest node touches the body.
    ///
    /// If no state bears the load, the load of pull-off is found by bisection between the load of
    /// the last state and the target, and the bodies are apart. If the pair limit is reached during
    /// the bisection, the bodies are apart without a load of pull-off.
    ///
    /// The mean gap of an isolated patch may jump past the target. The state then has another mean
    /// gap, and [stops](AdhesiveState::stop) with [`Stop::GapNotReached`].
    ///
    /// # Panics
    ///
    /// Panics if the target is not finite, or if a mean gap is not positive.
    pub fn step(
        &mut self,
        target: Target,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> AdhesiveState {
        let settings = &Settings { tolerance: self.tolerance(target, settings), ..*settings };
        self.pairs = 0;
        match target {
            Target::MeanGap(gap) => {
                assert!(gap.is_finite() && gap > 0.0, "the mean gap must be positive and finite");
                self.step_to_gap(gap, settings, watch)
            }
            Target::Load(load) => {
                assert!(load.is_finite(), "the load must be finite");
                self.step_to_load(load, settings, watch)
            }
        }
    }

    /// Returns the largest residual of a state: the given tolerance, or less if the attraction or
    /// the load is small beside it.
    fn tolerance(&self, target: Target, settings: &Settings) -> f64 {
        let load = if let Target::Load(load) = target { load.abs() } else { 0.0 };
        let scales = [self.adhesion.largest_attraction(), load];
        let is_given = |scale: &f64| *scale > 0.0;
        let smallest = scales.into_iter().filter(is_given).fold(f64::INFINITY, f64::min);
        settings.tolerance.min((MAX_SHARE * smallest).max(ROUNDING))
    }

    fn step_to_load(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> AdhesiveState {
        let is_not_adhesive = self.adhesion.work == 0.0;
        if self.is_apart && load < 0.0 || is_not_adhesive && load <= 0.0 {
            return self.pulled_off(None);
        }
        let was_apart = self.is_apart;
        let end = self.try_load(load, settings, watch);
        if end.stop != Stop::PulledOff {
            return self.stored(end);
        }
        if was_apart {
            return self.pulled_off(None);
        }
        // At the gaps of the last state, its load follows from balance.
        self.restore();
        let end = self.descend(Control::MeanGap, settings, watch);
        if end.stop != Stop::Converged {
            return self.failed(end);
        }
        let holds = end.mean_pressure / self.on_mesh();
        match self.search_pull_off([holds, load], settings, watch) {
            Ok(load) => self.pulled_off(Some(load)),
            Err(end) => self.failed(end),
        }
    }

    /// Returns the lowest load that the bodies bear, given the load of the last state and a lower
    /// load that they did not bear, or the end of a trial without an answer.
    ///
    /// A long step may tear off bodies that would bear the load if it grew slowly. The search
    /// therefore ends only after a short step from a state that holds has torn them off.
    fn search_pull_off(
        &mut self,
        [mut holds, mut fails]: [f64; 2],
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Result<f64, End> {
        let accuracy = settings.pull_off_tolerance * self.adhesion.largest_attraction();
        let tolerance = settings.tolerance.min(SEARCH_TOLERANCE * accuracy);
        let settings = &Settings { tolerance, ..*settings };
        let (mut torn_from, mut stride) = (holds, accuracy);
        loop {
            let is_close = holds - fails <= accuracy;
            let load = if is_close { fails } else { 0.5 * (holds + fails) };
            let is_certain = is_close && torn_from - fails <= 2.0 * accuracy;
            let is_rounding = load >= holds || load <= fails && !is_close;
            if is_certain || is_rounding {
                return Ok(holds);
            }
            let end = self.try_load(load, settings, watch);
            match end.stop {
                Stop::Converged => {
                    self.store(end.mean_pressure);
                    holds = load;
                    if load <= fails {
                        // The bodies may bear far more than the load that had torn them off.
                        stride *= 4.0;
                        (fails, torn_from) = (load - stride, f64::INFINITY);
                    }
                }
                Stop::PulledOff => (fails, torn_from) = (load, holds),
                _ => return Err(end),
            }
        }
    }

    /// Descends under `load` from the last state of the path, and keeps that state.
    fn try_load(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> End {
        if load < -self.adhesion.largest_attraction() {
            return End { stop: Stop::PulledOff, residual: 0.0, mean_pressure: 0.0 };
        }
        self.restore();
        self.descend(Control::Load(load * self.on_mesh()), settings, watch)
    }

    /// Returns the ratio of the mean pressure over the mesh to that over the map.
    fn on_mesh(&self) -> f64 {
        self.body.domain.map_nodes() as f64 / self.body.domain.mesh_nodes() as f64
    }

    /// Parts the bodies after a descent without an answer.
    fn failed(&mut self, End { stop, residual, .. }: End) -> AdhesiveState {
        AdhesiveState { stop, residual, ..self.pulled_off(None) }
    }

    /// Parts the bodies.
    fn pulled_off(&mut self, pull_off_load: Option<f64>) -> AdhesiveState {
        let pairs = self.pairs;
        self.is_apart = true;
        self.pressure.fill(0.0);
        AdhesiveState { pull_off_load, pairs, mean_gap: f64::INFINITY, ..AdhesiveState::default() }
    }

    fn step_to_gap(&mut self, gap: f64, settings: &Settings, watch: &dyn Watch) -> AdhesiveState {
        self.restore();
        self.move_by(gap - self.mean_gap());
        let mut search = GapSearch::default();
        loop {
            let on_mesh = self.mean_gap_of_mesh();
            let end = self.descend(Control::MeanGap, settings, watch);
            let error = self.mean_gap() - gap;
            let is_found = error.abs() <= GAP_ERROR * gap || !self.body.is_padded();
            if is_found || end.stop != Stop::Converged {
                return self.stored(end);
            }
            let Some(next) = search.next(Trial { on_mesh, error }) else {
                return self.stored(End { stop: Stop::GapNotReached, ..end });
            };
            self.move_by(-error);
            self.move_surroundings(next);
        }
    }

    /// Sets the gaps on the mesh to those of the last state, or of the undeformed surface if the
    /// bodies are apart.
    ///
    /// Outside the map of an isolated patch, heights count as zero, so that the gap is the
    /// displacement of the body less the offset δ. It is estimated there: the displacement on the
    /// map, less its mean, needs certain pressures if the surroundings do not move. Those on the
    /// map displace the surroundings.
    fn restore(&mut self) {
        let domain = self.body.domain;
        let heights = &self.body.heights[..];
        if self.is_apart {
            let outputs = [&mut self.fields.gap[..]];
            visit(&self.threads, domain, [heights], outputs, |_, [height], [_]| {
                ([-height], [0.0; 0], [0.0; 0])
            });
            return;
        }
        if !self.body.is_padded() {
            self.fields.gap.copy_from_slice(&self.gap);
            return;
        }
        let gap = spread(domain, &self.gap, 0.0);
        let Fields { gap: new, step, pressure, pull, .. } = &mut self.fields;
        let found = visit(&self.threads, domain, [&gap[..], heights], [], |site, [gap, h], []| {
            ([], [site.weight * (gap + h)], [0.0; 0])
        });
        let mean = found.sums[0] / domain.map_nodes() as f64;
        let inputs = [&gap[..], heights];
        visit(&self.threads, domain, inputs, [&mut step[..]], |site, [gap, height], [_]| {
            ([site.weight * (gap + height - mean)], [0.0; 0], [0.0; 0])
        });
        self.body.stiffness(step, pressure, &mut self.scratch);
        visit(&self.threads, domain, [], [&mut pressure[..]], |site, [], [pressure]| {
            ([site.weight * pressure], [0.0; 0], [0.0; 0])
        });
        self.body.compliance(pressure, pull, &mut self.scratch);
        let moved = self.body.mean_on_map(&self.threads, pull);
        let inputs = [&gap[..], &pull[..]];
        visit(&self.threads, domain, inputs, [&mut new[..]], |site, [gap, displacement], [_]| {
            let outside = displacement - moved + mean;
            ([if site.weight > 0.0 { gap } else { outside }], [0.0; 0], [0.0; 0])
        });
        self.pairs += 2;
    }

    fn mean_gap(&self) -> f64 {
        self.body.mean_on_map(&self.threads, &self.fields.gap)
    }

    /// Returns the mean gap over the mesh, which a descent with [`Control::MeanGap`] keeps.
    fn mean_gap_of_mesh(&self) -> f64 {
        let domain = self.body.domain;
        let gap = &self.fields.gap[..];
        let found = visit(&self.threads, domain, [gap], [], |_, [gap], []| ([], [gap], [0.0; 0]));
        found.sums[0] / domain.mesh_nodes() as f64
    }

    /// Moves the nodes outside the map so that the mean gap over the mesh is `mean`.
    fn move_surroundings(&mut self, mean: f64) {
        let domain = self.body.domain;
        let nodes = domain.mesh_nodes() as f64;
        let missing = (mean - self.mean_gap_of_mesh()) * nodes;
        let rise = missing / (nodes - domain.map_nodes() as f64);
        visit(&self.threads, domain, [], [&mut self.fields.gap[..]], |site, [], [gap]| {
            ([if site.weight > 0.0 { gap } else { gap + rise }], [0.0; 0], [0.0; 0])
        });
    }

    /// Changes the mean gap over the map by `change`: gaps are reduced by the same amount and not
    /// below zero, or enlarged by the same factor, so that nodes in contact remain so. If all nodes
    /// are in contact, all gaps rise.
    fn move_by(&mut self, change: f64) {
        let domain = self.body.domain;
        let (threads, gap) = (&self.threads, &mut self.fields.gap);
        let before = self.body.mean_on_map(threads, gap);
        let mut shift = 0.0;
        if change < 0.0 {
            let nodes = domain.map_nodes() as f64;
            // Newton's method on a convex function: shifts rise to the solution.
            loop {
                let found = visit(threads, domain, [&gap[..]], [], |site, [gap], []| {
                    let open = if gap > shift { site.weight } else { 0.0 };
                    ([], [open * gap, open], [0.0; 0])
                });
                let [sum, open] = found.sums;
                let next = (sum - (before + change) * nodes) / open;
                if next.is_nan() || next <= shift {
                    break;
                }
                shift = next;
            }
            visit(threads, domain, [], [&mut gap[..]], |site, [], [gap]| {
                let moved = gap - shift;
                ([if moved > site.floor { moved } else { site.floor }], [0.0; 0], [0.0; 0])
            });
        }
        // Also corrects the rounding of the shift.
        let mean = self.body.mean_on_map(threads, gap);
        let rest = before + change - mean;
        let (factor, rise) = if mean > 0.0 { (1.0 + rest / mean, 0.0) } else { (1.0, rest) };
        visit(threads, domain, [], [&mut gap[..]], |site, [], [gap]| {
            let on_map = factor * gap + rise;
            ([if site.weight > 0.0 { on_map } else { gap + rest }], [0.0; 0], [0.0; 0])
        });
    }

    /// Stores the gaps and the net pressures of the map.
    fn store(&mut self, mean_pressure: f64) {
        self.is_apart = false;
        let domain = self.body.domain;
        gather(domain, &self.fields.gap, &mut self.gap);
        let Self { fields, threads, .. } = self;
        let inputs = [&fields.gap[..], &fields.pull[..]];
        let outputs = [&mut fields.pressure[..]];
        visit(threads, domain, inputs, outputs, |site, [gap, pull], [pressure]| {
            let in_contact = pressure + mean_pressure;
            let net = if gap > site.floor { -pull } else { in_contact };
            ([net], [0.0; 0], [0.0; 0])
        });
        gather(domain, &self.fields.pressure, &mut self.pressure);
    }

    /// Stores the state that a descent has reached, and describes it.
    fn stored(&mut self, end: End) -> AdhesiveState {
        self.store(end.mean_pressure);
        self.describe(end)
    }

    fn describe(&mut self, end: End) -> AdhesiveState {
        let domain = self.body.domain;
        let nodes = domain.map_nodes() as f64;
        let gap = spread(domain, &self.gap, 0.0);
        let pressure = spread(domain, &self.pressure, 0.0);
        // Displacements without their mean, on the map.
        let displacement = &mut self.fields.step[..];
        self.body.compliance(&pressure, displacement, &mut self.scratch);
        let inputs = [&gap[..], &pressure[..], &displacement[..]];
        let (work, range) = (self.adhesion.work, self.adhesion.range);
        let found = visit(&self.threads, domain, inputs, [], |site, [gap, pressure, moved], []| {
            let counts = |so: bool| if so { site.weight } else { 0.0 };
            let attractive = if pressure < 0.0 { -pressure } else { 0.0 };
            let interaction = -site.weight * work * exponential(-gap / range);
            let closed = counts(gap == 0.0);
            let repulsive = counts(pressure > 0.0);
            let high = |value: f64| if site.weight > 0.0 { value } else { f64::NEG_INFINITY };
            (
                [],
                [
                    site.weight * gap,
                    closed,
                    repulsive,
                    attractive,
                    pressure * moved,
                    interaction,
                    site.weight * moved,
                    pressure,
                    counts(gap == 0.0) * pressure,
                ],
                [high(pressure), high(-pressure)],
            )
        });
        let [gap, closed, repulsive, attractive, energy, interaction, moved, net, in_contact] =
            found.sums;
        let [peak, lowest] = found.highest;
        let (mut elastic, mut displacement) = (0.5 * energy / nodes, moved / nodes);
        let uniform = self.body.uniform_stiffness;
        if uniform > 0.0 {
            // The uniform wave of the pressure on the mesh. The pressures of a state that did not
            // converge have another mean than the load.
            let mean = net / nodes * self.on_mesh();
            elastic += 0.5 * mean * mean / uniform / self.on_mesh();
            displacement += mean / uniform;
        } else {
            displacement = 0.0;
        }
        AdhesiveState {
            stop: end.stop,
            pull_off_load: None,
            pairs: self.pairs + 1,
            residual: end.residual,
            mean_gap: gap / nodes,
            mean_pressure: end.mean_pressure / self.on_mesh(),
            mean_displacement: displacement,
            contact_nodes: closed as usize,
            repulsive_nodes: repulsive as usize,
            attractive_pressure: attractive / nodes,
            repulsive_pressure: (net + attractive) / nodes,
            pressure_in_contact: in_contact / nodes,
            peak_pressure: peak,
            lowest_pressure: -lowest,
            elastic_energy: elastic,
            adhesion_energy: interaction / nodes,
        }
    }
}
