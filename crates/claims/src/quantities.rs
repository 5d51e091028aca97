//! The quantities of a claim, and the judgement of them.

use crate::{ClaimOutcome, Judgement};
use asperity_statistics::expectation::Expectation;
use asperity_statistics::intervals::{Bound, FEWEST_SURFACES, Weights, jackknife};

/// Quantities of one claim, with standard errors.
#[derive(Default)]
pub struct Quantities {
    bounds: Vec<Bound>,
    /// True if a quantity had too few surfaces for an interval.
    lacks_surfaces: bool,
    /// Labels of quantities that cannot be computed from all surfaces, or from all surfaces but
    /// one.
    without_value: Vec<String>,
}

impl Quantities {
    /// Adds a quantity, with its standard error from a jackknife over the surfaces and the
    /// additional systematic standard error `systematic`. `value` computes the quantity from the
    /// surfaces that the weights select. `surfaces` holds the number of surfaces of each group on
    /// which the quantity depends.
    pub fn add(
        &mut self,
        label: String,
        surfaces: &[usize],
        systematic: f64,
        value: impl Fn(&Weights) -> Option<f64>,
    ) {
        let too_few = surfaces.iter().any(|&count| count < FEWEST_SURFACES);
        self.lacks_surfaces |= too_few;
        match jackknife(label.clone(), surfaces, value) {
            Some(bound) => self.bounds.push(Bound { systematic, ..bound }),
            None if !too_few => self.without_value.push(label),
            None => {}
        }
    }

    /// Adds a quantity of results of fits or of means, with its value and its standard error.
    /// `surfaces` is the number of surfaces on which it is based.
    pub fn add_estimate(
        &mut self,
        label: String,
        surfaces: usize,
        value: impl Fn() -> Option<(f64, f64)>,
    ) {
        if surfaces < FEWEST_SURFACES {
            self.lacks_surfaces = true;
            return;
        }
        match value() {
            Some((value, error)) => self.bounds.push(Bound {
                label,
                value,
                error,
                systematic: 0.0,
                surfaces: Some(surfaces),
            }),
            None => self.without_value.push(label),
        }
    }

    /// Judges the claim that all quantities are as expected. If there is no quantity, `needs`
    /// returns the requirement that the study does not meet.
    pub fn judge(self, expected: Expectation, needs: impl FnOnce() -> String) -> ClaimOutcome {
        let judgement = Judgement::new(expected, self.bounds);
        if let Some(judgement) = judgement {
            return ClaimOutcome::Judged(judgement.with_missing(&self.without_value));
        }
        ClaimOutcome::NotComputed(match (self.lacks_surfaces, self.without_value.last()) {
            (true, _) => format!(
                "{FEWEST_SURFACES} or more surfaces of each group, to estimate their scatter"
            ),
            (false, Some(label)) => {
                format!("{}; the quantity cannot be computed for {label}", needs())
            }
            (false, None) => needs(),
        })
    }
}
