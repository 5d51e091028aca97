//! One load, from a guess to a solution.

use super::evaluation::Evaluation;
use super::history::History;
use super::load::PressureSummary;
use super::passes::{Base, Expected};
use super::start::Start;
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};

/// The largest residual over the displacement of one node under the mean pressure in contact. Beyond
/// it, contact would be whatever a guess took for it.
const SHARE_OF_DISPLACEMENT: f64 = 0.1;

/// The largest part of the tolerance by which the residual may be rounded.
const ROUNDED_PART: f64 = 0.01;

/// How often the undecided nodes of a solution are decided. What comes after the last time is a
/// solution within the tolerance all the same.
const DECISIONS: u32 = 2;

impl Solver {
    /// Finds the contact under a mean pressure `load` > 0, in units of E* × rms slope: one that the
    /// hardness bears, if there is one ([`Hardness::bear`]).
    ///
    /// Loads may come in any order; those in ascending order are found fastest. However light the
    /// load, and however it ends, some node bears it. Whoever watches is told of every iteration and
    /// may end it: `&|| false` goes on to the end.
    pub fn press(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> Outcome {
        assert!(load.is_finite() && load > 0.0, "a load presses");
        if let Some(hardness) = self.hardness {
            hardness.bear(load).expect("the caller has asked");
        }
        self.search.pairs = 0;
        self.expected = Expected::All;
        self.search.extension.continues = true;
        self.search.base.prepare(settings.tolerance);
        self.search.active.prepare(Base::is_map(settings.tolerance));
        if self.is_flattened_by(load) {
            self.search.bound = None;
            self.flatten(load);
            let evaluation = self.evaluate();
            let summary = self.summarise();
            return Outcome {
                mean_gap: 0.0,
                ..self.outcome(Stop::FullContact, evaluation, summary)
            };
        }
        if let Some(outcome) = self.press_far(load, settings, watch) {
            return outcome;
        }
        if let Some(outcome) = self.press_if_yielding(load, settings, watch) {
            return outcome;
        }
        self.search.bound = self.hardness.filter(|_| load >= self.yields_from);
        let outcome = self.solve_within_bound(load, settings, watch);
        self.yield_if_passed(outcome, settings, watch)
    }

    /// The outcome under the hardness, if the pressures of this one pass it.
    pub(super) fn yield_if_passed(
        &mut self,
        outcome: Outcome,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        match self.hardness {
            Some(hardness) if outcome.peak_pressure > hardness.pressure() => {
                self.yields_from = self.yields_from.min(self.search.load);
                let evaluation = self.guess_yielding(hardness);
                self.search.extension.continues = true;
                self.solve(History::default(), evaluation, settings, watch)
            }
            _ => outcome,
        }
    }

    /// The outcome under a first load that is expected to make the material yield, if it does: then it need
    /// not be solved for without the hardness.
    fn press_if_yielding(
        &mut self,
        load: f64,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<Outcome> {
        let is_first = self.search.load == 0.0;
        let hardness = self.hardness.filter(|_| is_first)?;
        if !self.is_expected_to_pass(hardness, load) {
            return None;
        }
        self.search.bound = Some(hardness);
        let outcome = self.solve_within_bound(load, settings, watch);
        if outcome.saturated_nodes == 0 && outcome.stop == Stop::Converged {
            self.forget();
            return None;
        }
        self.yields_from = load;
        Some(outcome)
    }

    /// Solves from a guess, for pressures below the bound if there is one.
    fn solve_within_bound(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> Outcome {
        let mut history = History::default();
        let evaluation = match self.guess(load) {
            Some(start) => self.approach(&mut history, start, settings, watch),
            None => self.evaluate_guess(settings),
        };
        self.solve(history, evaluation, settings, watch)
    }

    /// Whether the load presses all nodes into contact and makes none of them yield.
    pub fn is_flattened_by(&self, load: f64) -> bool {
        let ceiling = self.hardness.map_or(f64::INFINITY, Hardness::pressure);
        self.full_contact.is_some_and(|full| load >= full.load && load + full.peak <= ceiling)
    }

    /// Iterates from an evaluation until it is a solution, with its undecided nodes decided.
    ///
    /// What is returned has been evaluated: no pressure changes after the residual is known.
    pub(super) fn solve(
        &mut self,
        mut history: History,
        mut evaluation: Evaluation,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        let mut decisions = DECISIONS;
        loop {
            if self.is_solved(settings, &evaluation) {
                if self.is_rounded(settings, &evaluation) {
                    self.search.reference += evaluation.standing.offset;
                    evaluation = self.evaluate();
                    continue;
                }
                let summary = self.summarise();
                if decisions > 0 && self.decide(evaluation.standing.offset, summary) {
                    decisions -= 1;
                    evaluation = self.evaluate();
                    continue;
                }
                return self.outcome(Stop::Converged, evaluation, summary);
            }
            let stop = if self.search.pairs >= settings.pair_limit {
                Stop::PairLimit
            } else if watch.is_interrupted() {
                Stop::Interrupted
            } else {
                let start = self.ask(evaluation.standing);
                evaluation = self.approach(&mut history, start, settings, watch);
                continue;
            };
            let summary = self.summarise();
            return self.outcome(stop, evaluation, summary);
        }
    }

    /// Iterates to where the tolerance is met, or as far as single precision reaches.
    pub(super) fn approach(
        &mut self,
        history: &mut History,
        start: Start,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Evaluation {
        let tolerance = self.tolerance(settings, self.search.free_nodes);
        let stop = |pairs| {
            watch.spent(pairs);
            pairs >= settings.pair_limit || watch.is_interrupted()
        };
        self.refine(history, start, tolerance, &stop)
    }

    pub(super) fn is_solved(&self, settings: &Settings, evaluation: &Evaluation) -> bool {
        let tolerance = self.tolerance(settings, evaluation.contact_nodes);
        self.search.residual(evaluation.standing.error) <= tolerance
    }

    /// Whether the residual is known no better than a small part of the tolerance: gaps are kept in
    /// single precision, and those in contact are too far from the reference that they count from.
    fn is_rounded(&self, settings: &Settings, evaluation: &Evaluation) -> bool {
        let Evaluation { standing, contact_nodes, .. } = evaluation;
        let rounding = f64::from(f32::EPSILON) * standing.offset.abs();
        let tolerance = self.tolerance(settings, *contact_nodes);
        self.search.residual(rounding) > ROUNDED_PART * tolerance
    }

    /// The tolerance asked for, or what tells which of so many nodes bear the load, if that is less
    /// and heights are known so well.
    fn tolerance(&self, settings: &Settings, contact_nodes: f64) -> f64 {
        let mean_pressure = self.search.load * self.pressure.len() as f64 / contact_nodes;
        let share = SHARE_OF_DISPLACEMENT * self.search.nodal_compliance * mean_pressure;
        let rounding = f64::EPSILON * self.highest;
        settings.tolerance.min(self.search.residual(share.max(rounding)))
    }

    fn outcome(&mut self, stop: Stop, evaluation: Evaluation, summary: PressureSummary) -> Outcome {
        self.contact_nodes = summary.contact_nodes as f64;
        Outcome {
            stop,
            pairs: self.search.pairs,
            // Where all contact is saturated, the error is below zero by what is left to the bounds.
            residual: self.search.residual(evaluation.standing.error.max(0.0)),
            contact_nodes: summary.contact_nodes,
            saturated_nodes: summary.saturated_nodes,
            mean_gap: evaluation.mean_gap,
            yielded_depth: evaluation.yielded_depth,
            energy: evaluation.energy,
            peak_pressure: summary.peak_pressure,
        }
    }
}
