//! Loads that are far from those before.

use super::coarse_contact::CoarseContact;
use super::history::History;
use super::nested::Coarser;
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};

/// A load over the last one, or the other way around, from which on it is solved for on coarser meshes first. On 1024² and
/// 2048² nodes that takes less time from 1.2 to 1.4 on, on 512² from 1.4 to 1.6 on.
const FAR: f64 = 1.3;

/// Where the tolerance is more than this many times the last digit, in single precision, of the highest displacement, a
/// search begins in single precision. With 3.1 and less it ended above the tolerance, by rounding, on 4096² and 8192²
/// nodes, and went on from there; beginning in double precision takes a tenth more time.
const DIGITS: f64 = 3.5;

/// Whether a load is far from the last one, or the first.
pub fn is_far(last: Option<f64>, load: f64) -> bool {
    last.is_none_or(|last| load > FAR * last || last > FAR * load)
}

impl Solver {
    /// The outcome under a load, if it is far from the last one and the mesh is large enough for coarser ones.
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
        self.remember();
        self.search.load = load;
        self.search.scratch.take_over(&mut self.double_scratch);
        let outcome = self.press_from(&mut coarser, settings, watch);
        self.coarser = Some(coarser);
        if outcome.is_none() {
            self.forget();
        }
        outcome
    }

    /// Solves by way of coarser meshes. Elastic loads owe nothing to a hardness that they do not pass, so that
    /// coarser meshes are asked without it first.
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
        // The mean displacement is zero, and that of a node in contact its height above the reference.
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
