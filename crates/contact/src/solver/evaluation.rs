//! Evaluation of pressures in double precision: gap, contact, offset and error.

use pulp::Simd;

use super::balance::Balance;
use super::flags::{PRESSED, SATURATED, has};
use super::lanes::{Accumulate, InOrder, Lanes, Wide, over_rows, sum_by, total, weight};
use super::line_search::{History, LastStep, LineSearch};
use super::passes::{
    GapOutput, PendingUpdate, PressureInput, Promote, PromotedInput, StepOutput, StepScaling,
    TakeBack,
};
use super::{Hardness, Settings, Solver};
use crate::fft::Band;

#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    pub convergence: Convergence,
    pub contact_nodes: f64,
    /// Mean gap over the map; nodes in contact count as zero.
    pub mean_gap: f64,
    /// Mean over the map of the negative gaps of saturated nodes, as a positive depth.
    pub yielded_depth: f64,
    /// Elastic energy per area, half the mean of pressure × displacement.
    pub energy: f64,
}

impl Solver {
    /// Computes the gap under the present pressures and evaluates it; takes one transform pair.
    /// Sets the last steps to zero.
    pub(super) fn evaluate(&mut self) -> Evaluation {
        let mut pass = Wide(PressureInput {
            pressure: &self.pressure,
            hardness: self.inner.ceiling(),
            last_step: Band::new(&mut self.inner.last_step),
            keeps_steps: false,
        });
        self.double_scratch.take_over(&mut self.inner.buffers.scratch);
        self.problem.transform.begin(&mut pass, &mut self.double_scratch);
        self.finish_gap()
    }

    /// Evaluates an initial guess. If rounding of the gaps hides the error of the guess, changes
    /// the reference of the gaps and evaluates the guess again.
    ///
    /// This happens if gaps differ much from their reference. The inner solver could not improve
    /// such a guess.
    pub(super) fn evaluate_guess(&mut self, settings: &Settings) -> Evaluation {
        let evaluation = self.evaluate();
        let Convergence { offset, error } = evaluation.convergence;
        let is_seen = error > f64::from(f32::EPSILON) * offset.abs();
        if is_seen || self.is_solved(settings, &evaluation) {
            return evaluation;
        }
        self.inner.reference += offset;
        self.evaluate()
    }

    /// Sets the pressures to those of the inner solver after the update `pending`, and evaluates
    /// them.
    ///
    /// Adds `offset`, approximately the mean gap in contact, to the reference of the gaps, so that
    /// gaps in contact become small and keep all their digits.
    pub(super) fn evaluate_inner(&mut self, pending: PendingUpdate, offset: f64) -> Evaluation {
        if let Some(hardness) = self.inner.bound {
            self.promote_yielding(hardness, pending);
            self.inner.reference += offset;
            return self.evaluate();
        }
        if pending.part == 1.0 {
            self.begin_promoted(pending.scale, offset);
            return self.finish_gap();
        }
        let mut promote = Promote {
            factor: pending.of_pressure(),
            reference_pressure: &self.inner.reference_pressure,
            pressure_increment: &self.inner.pressure_increment,
        };
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.mesh.nodes[1], &mut promote);
        self.evaluate_without(1.0 - pending.part, offset)
    }

    fn evaluate_without(&mut self, part: f64, offset: f64) -> Evaluation {
        self.take_back(part);
        self.impose_load();
        self.inner.reference += offset;
        self.evaluate()
    }

    pub(super) fn take_back(&mut self, part: f64) {
        let mut pass =
            TakeBack { part, hardness: self.inner.ceiling(), last_step: &self.inner.last_step };
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.mesh.nodes[1], &mut pass);
    }

    /// Evaluates the pressures after the step that `line` describes. If only a part of the step is
    /// to be kept, undoes the rest and evaluates again.
    ///
    /// `offset` is approximately the mean gap in contact before the step. `history` is updated.
    pub(super) fn evaluate_step(
        &mut self,
        history: &mut History,
        line: &LineSearch,
        offset: f64,
    ) -> Evaluation {
        let offset_change = line.expected_offset();
        self.begin_promoted(line.scale, offset_change);
        let (evaluation, curvature) = self.finish_step::<false>(line.scale, offset_change);
        self.keep_step(history, line.best(curvature), curvature, evaluation, offset_change - offset)
    }

    /// Evaluates the pressures after a step as [`Solver::evaluate_step`] does, in a material that
    /// yields. `balance` describes the pressures before the step.
    pub(super) fn evaluate_yielding_step(
        &mut self,
        history: &mut History,
        line: &LineSearch,
        hardness: Hardness,
        balance: &Balance,
        offset: f64,
    ) -> Evaluation {
        let scale = self.promote_yielding(hardness, PendingUpdate::NONE);
        self.inner.reference += offset;
        self.begin_keeping_steps(hardness);
        let (evaluation, curvature) = self.finish_step::<true>(scale, offset);
        let best = line.then_scaled(scale, balance.free_offset).best(curvature);
        self.keep_step(history, best, curvature, evaluation, 0.0)
    }

    /// Ends the convolution of the pressures after a step d, and computes the gap. Returns the
    /// evaluation of the gap, and the curvature ⟨d, A d⟩ of the energy along the step.
    ///
    /// The step includes a multiplication of the pressures by `scale`. `reference_change` was added
    /// to the reference of the gaps.
    fn finish_step<const YIELDS: bool>(
        &mut self,
        scale: f64,
        reference_change: f64,
    ) -> (Evaluation, f64) {
        let work =
            self.problem.transform.multiply(&self.problem.displacement, &mut self.double_scratch);
        let mut pass = Wide(StepOutput::<YIELDS> {
            heights: &self.problem.heights,
            reference: self.inner.reference,
            scaling: StepScaling { scale: scale as f32, reference_change: reference_change as f32 },
            sums_gaps: !self.problem.body.has_zero_mean_displacement(),
            statistics: InOrder::new(),
            curvature: InOrder::new(),
            reference_pressure: &self.inner.reference_pressure,
            pressure_increment: &self.inner.pressure_increment,
            gap: Band::new(&mut self.inner.gap),
            last_step: Band::new(&mut self.inner.last_step),
            sample: self.inner.sample.band(),
            found: vec![0.0; self.inner.mesh.nodes[1]],
        });
        self.problem.transform.finish(&mut pass, &mut self.double_scratch);
        let (statistics, curvature) = (pass.0.statistics.total(), pass.0.curvature.total());
        (self.evaluation(&statistics, work), curvature)
    }

    /// Adapts `history` to an evaluated step along which the energy is lowest at the fraction
    /// `best`.
    ///
    /// If the whole step is to be kept, stores it in `history` and returns `evaluation`. Otherwise
    /// undoes a part of it and evaluates again.
    fn keep_step(
        &mut self,
        history: &mut History,
        best: f64,
        curvature: f64,
        evaluation: Evaluation,
        offset_change: f64,
    ) -> Evaluation {
        let part = self.inner.learn(history, best);
        if part < 1.0 {
            return self.evaluate_without(1.0 - part, evaluation.convergence.offset);
        }
        history.last = (best > 0.0).then_some(LastStep {
            pending: PendingUpdate::NONE,
            curvature,
            missed: (best - 1.0).min(1.0),
            offset_change,
        });
        evaluation
    }

    fn begin_promoted(&mut self, scale: f64, offset: f64) {
        self.inner.reference += offset;
        let mut pass = Wide(PromotedInput {
            scale,
            reference_pressure: &self.inner.reference_pressure,
            pressure_increment: &self.inner.pressure_increment,
            pressure: Band::new(&mut self.pressure),
        });
        self.double_scratch.take_over(&mut self.inner.buffers.scratch);
        self.problem.transform.begin(&mut pass, &mut self.double_scratch);
    }

    fn finish_gap(&mut self) -> Evaluation {
        match self.inner.bound {
            None => self.finish_gap_as::<false>(),
            Some(_) => self.finish_gap_as::<true>(),
        }
    }

    fn finish_gap_as<const YIELDS: bool>(&mut self) -> Evaluation {
        let work =
            self.problem.transform.multiply(&self.problem.displacement, &mut self.double_scratch);
        let mut pass = Wide(GapOutput::<YIELDS> {
            heights: &self.problem.heights,
            reference: self.inner.reference,
            gap: Band::new(&mut self.inner.gap),
            last_step: &self.inner.last_step,
            sums_gaps: !self.problem.body.has_zero_mean_displacement(),
            statistics: InOrder::new(),
        });
        self.problem.transform.finish(&mut pass, &mut self.double_scratch);
        let statistics = pass.0.statistics.total();
        self.evaluation(&statistics, work)
    }

    fn evaluation(&mut self, statistics: &GapStatistics, work: f64) -> Evaluation {
        let convergence = statistics.convergence();
        self.inner.pairs += 1;
        self.offset = convergence.offset;
        let cells = self.pressure.len() as f64;
        let yielded_depth = match statistics.saturated_nodes() {
            0.0 => 0.0,
            nodes => (nodes * convergence.offset - statistics.saturated_sum) / cells,
        };
        let mean_gap = match statistics.gap_sum {
            Some(sum) => sum / cells - convergence.offset,
            // Displacements and heights have zero mean.
            None => -(self.inner.reference + convergence.offset),
        };
        // Yielded nodes count as zero gap. If all nodes are in contact, only rounding remains.
        let mean_gap = match yielded_depth {
            0.0 => mean_gap,
            depth => (mean_gap + depth).max(0.0),
        };
        Evaluation {
            convergence,
            contact_nodes: statistics.contact_nodes,
            mean_gap,
            yielded_depth,
            energy: 0.5 * work / cells,
        }
    }
}

/// Offset of the gaps, and their largest violation of the contact conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Mean gap in elastic contact, or an estimate of it if few or no nodes are elastic.
    pub offset: f64,
    /// Largest violation of the contact conditions by the gap above the offset: |gap − offset| in
    /// elastic contact, penetration outside contact, and positive gaps at saturated nodes.
    pub error: f64,
}

/// Highest gap in contact, and lowest gap of nodes that are not saturated.
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    pub highest_in_contact: f32,
    pub lowest: f32,
}

impl Extremes {
    pub const NONE: Self = Self { highest_in_contact: -f32::MAX, lowest: f32::MAX };

    /// Returns the offset that violates the contact conditions least if all contact nodes are
    /// saturated.
    ///
    /// This is the mean of both extremes, or the highest gap if all nodes are saturated.
    pub fn middle(self) -> f64 {
        let highest = f64::from(self.highest_in_contact);
        if self.lowest == Self::NONE.lowest {
            return highest;
        }
        0.5 * (highest + f64::from(self.lowest))
    }

    pub fn convergence(self, offset: f64) -> Convergence {
        let highest = f64::from(self.highest_in_contact) - offset;
        let lowest = f64::from(self.lowest) - offset;
        Convergence { offset, error: highest.max(-lowest) }
    }

    #[inline(always)]
    pub fn of<S: Simd, const R: usize>(
        highest_in_contact: Lanes<S, R>,
        lowest: Lanes<S, R>,
    ) -> Self {
        Self { highest_in_contact: highest_in_contact.highest(), lowest: lowest.lowest() }
    }

    #[inline(always)]
    pub fn add(&mut self, others: Self) {
        self.highest_in_contact = self.highest_in_contact.max(others.highest_in_contact);
        self.lowest = self.lowest.min(others.lowest);
    }
}

/// Counts of nodes, and sums and extremes of the gap.
#[derive(Debug, Clone, Copy)]
pub struct GapStatistics {
    pub contact_nodes: f64,
    pub elastic_nodes: f64,
    /// Σ gap over elastic nodes, in double precision.
    pub elastic_sum: f64,
    /// Σ gap over saturated nodes, in double precision.
    pub saturated_sum: f64,
    /// Σ gap over the map; `None` if displacements have zero mean.
    pub gap_sum: Option<f64>,
    extremes: Extremes,
}

impl Accumulate for GapStatistics {
    const ZERO: Self = Self {
        contact_nodes: 0.0,
        elastic_nodes: 0.0,
        elastic_sum: 0.0,
        saturated_sum: 0.0,
        gap_sum: None,
        extremes: Extremes::NONE,
    };

    fn add(&mut self, later: Self) {
        self.contact_nodes += later.contact_nodes;
        self.elastic_nodes += later.elastic_nodes;
        self.elastic_sum += later.elastic_sum;
        self.saturated_sum += later.saturated_sum;
        if let Some(sum) = later.gap_sum {
            self.gap_sum = Some(self.gap_sum.unwrap_or(0.0) + sum);
        }
        self.extremes.add(later.extremes);
    }
}

impl GapStatistics {
    /// Creates empty statistics, with or without a sum of gaps over the map.
    pub fn new(sums_gaps: bool) -> Self {
        Self { gap_sum: sums_gaps.then_some(0.0), ..Self::ZERO }
    }

    /// Adds a row of gaps to the sums over elastic nodes, saturated nodes and the map. `last_step`
    /// holds the flags of the nodes.
    #[inline(always)]
    pub fn add_gaps<const YIELDS: bool>(&mut self, gap: &[f64], last_step: &[f32]) {
        self.elastic_sum += sum_by(gap, last_step, |gap, last_step| {
            let is_elastic = has(last_step, PRESSED) && !(YIELDS && has(last_step, SATURATED));
            weight::<f64>(is_elastic) * gap
        });
        if YIELDS {
            self.saturated_sum += sum_by(gap, last_step, |gap, last_step| {
                weight::<f64>(has(last_step, SATURATED)) * gap
            });
        }
        if let Some(sum) = &mut self.gap_sum {
            *sum += total(gap);
        }
    }

    /// Adds a row of gaps to the counts of nodes and to the extremes. `last_step` holds the flags
    /// of the nodes.
    #[inline(always)]
    pub fn add<S: Simd, const R: usize, const YIELDS: bool>(
        &mut self,
        simd: S,
        gap: &[[S::f32s; R]],
        last_step: &[[S::f32s; R]],
    ) {
        let (zero, one) = (Lanes::all(simd, 0.0), Lanes::all(simd, 1.0));
        let mut nodes = zero;
        let mut saturated_nodes = zero;
        let mut highest = Lanes::all(simd, -f32::MAX);
        let mut lowest = Lanes::all(simd, f32::MAX);
        for (gap, last_step) in gap.iter().zip(last_step) {
            let (gap, last_step) = (Lanes::of(simd, *gap), Lanes::of(simd, *last_step));
            let pressed = last_step.has(PRESSED);
            nodes = nodes + pressed.or_zero(one);
            highest = pressed.choose(highest.max(gap), highest);
            let lower = lowest.min(gap);
            if YIELDS {
                let saturated = last_step.has(SATURATED);
                saturated_nodes = saturated_nodes + saturated.or_zero(one);
                lowest = saturated.choose(lowest, lower);
            } else {
                lowest = lower;
            }
        }
        let nodes = nodes.total();
        self.contact_nodes += nodes;
        self.elastic_nodes += nodes - saturated_nodes.total();
        self.extremes.add(Extremes::of(highest, lowest));
    }

    pub fn saturated_nodes(&self) -> f64 {
        self.contact_nodes - self.elastic_nodes
    }

    pub fn convergence(&self) -> Convergence {
        let offset = if self.elastic_nodes > 0.0 || self.contact_nodes == 0.0 {
            self.elastic_sum / self.elastic_nodes
        } else {
            self.extremes.middle()
        };
        self.extremes.convergence(offset)
    }
}
