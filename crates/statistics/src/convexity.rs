//! The least proportionality for which fitted slopes are convex.
//!
//! The slope of a contact evolution law is convex at all loads if and only if μ ≤ 1, and the μ
//! fitted at a given κ falls as κ grows. So the least convex κ of a curve is the root of
//! μ_fit(κ) = 1, and that of several curves the largest of theirs. It depends on the window and
//! lies below the true proportionality: a lower bound, as Yastrebov, Anciaux & Molinari 2015 use it.
//!
//! The root is found without fitting μ: with β the best for μ = 1, the sign of the derivative of
//! the sum of squares by ln μ tells on which side of one the best exponent lies. Far from the root
//! a full fit may run away, this cannot.

use super::FitError;
use super::bootstrap::{Bootstrap, Estimate, Intervals, Resample};
use super::evolution::residuals::{Hyperbola, Model};
use super::evolution::{EvolutionFit, EvolutionProblem, Kappa};
use super::least_squares::minimize;

/// Ratio of neighbouring κ in the search for a sign change.
const SCAN_RATIO: f64 = 0.9;
/// Steps of the scan from the root of the whole sample, when a resample is searched.
const NEAR_STEPS: i32 = 6;
/// Doublings of κ above the largest slope of the data before giving up.
const DOUBLINGS: usize = 6;
/// Relative tolerance on κ, below any scatter by orders.
const KAPPA_TOLERANCE: f64 = 1e-10;
/// The Illinois method is superlinear; bisection alone would need some thirty.
const ROOT_ITERATIONS: usize = 60;

/// Several curves fitted with one κ.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonKappa {
    /// The least κ for which every fitted slope is convex.
    pub kappa: f64,
    /// The least convex κ of each curve alone.
    pub own: Vec<Result<f64, FitError>>,
    /// The fit of each curve with the common κ.
    pub fits: Vec<Result<EvolutionFit, FitError>>,
}

impl CommonKappa {
    /// Fits all curves with the largest of their least convex κ; curves without one do not take
    /// part in choosing it.
    ///
    /// # Errors
    /// If no curve has a least convex κ.
    pub fn fit(problems: &[EvolutionProblem]) -> Result<Self, FitError> {
        let own: Vec<_> = problems
            .iter()
            .map(|problem| problem.least_convex_kappa(&problem.mean, None))
            .collect();
        let kappa = own
            .iter()
            .flatten()
            .copied()
            .reduce(f64::max)
            .ok_or(FitError::NoCommonKappa { curves: problems.len() })?;
        let fits = problems.iter().map(|problem| problem.fit(Kappa::Given(kappa))).collect();
        Ok(Self { kappa, own, fits })
    }

    /// Interval of the common κ, over the curves that have one.
    ///
    /// `units` holds the numbers of the surfaces of each curve. A surface has the same number in
    /// all curves and is drawn equally often for each of them, because curves share realizations.
    pub fn bootstrap(
        &self,
        problems: &[EvolutionProblem],
        units: &[Vec<usize>],
        bootstrap: &Bootstrap,
    ) -> Intervals {
        let curves = problems.iter().zip(units).zip(&self.own);
        let bounded: Vec<(&EvolutionProblem, &[usize], f64)> = curves
            .filter_map(|((problem, units), own)| Some((problem, &units[..], *own.as_ref().ok()?)))
            .collect();
        let resample = Resample::of(bounded.iter().map(|(_, units, _)| *units));
        let estimates = [Estimate::Positive(self.kappa)];
        bootstrap.of_units(resample, &estimates, |_, times| {
            let mut largest = 0.0f64;
            for &(problem, units, near) in &bounded {
                let times: Vec<u32> = units.iter().map(|&unit| times[unit]).collect();
                if times.iter().any(|&times| times > 0) {
                    let mean = problem.data.resampled_mean(&times);
                    largest = largest.max(problem.least_convex_kappa(&mean, Some(near))?);
                }
            }
            Ok(vec![largest])
        })
    }
}

impl EvolutionProblem {
    /// The least κ for which the fit of a mean curve is convex, searched first near a guess.
    pub(super) fn least_convex_kappa(
        &self,
        mean: &[f64],
        near: Option<f64>,
    ) -> Result<f64, FitError> {
        let mut tilt = Tilt { model: Model { problem: self, mean }, ln_beta: 0.0 };
        let found = near
            .and_then(|kappa| bracket_near(&mut tilt, kappa))
            .map_or_else(|| self.bracket(mean, &mut tilt), Ok)?;
        Ok(root(&mut tilt, found))
    }

    /// Looks for the sign change from large κ downwards, so that all above the root are convex.
    fn bracket(&self, mean: &[f64], tilt: &mut Tilt) -> Result<Bracket, FitError> {
        let mean_slope = self.proportionality(mean);
        let steepest = self
            .data
            .loads
            .iter()
            .zip(mean)
            .map(|(&load, &value)| self.slope_of(load, value))
            .fold(mean_slope, f64::max);
        let none =
            |upper| FitError::NoConvexKappa { lower: mean_slope, upper, window: self.data.window };
        let mut upper = 2.0 * steepest;
        let mut at_upper = tilt.at(upper);
        for _ in 0..DOUBLINGS {
            if at_upper > 0.0 {
                break;
            }
            upper *= 2.0;
            at_upper = tilt.at(upper);
        }
        let top = upper;
        // Below the mean slope of the data the best law is a straight line.
        while at_upper > 0.0 && upper > mean_slope && mean_slope > 0.0 {
            let lower = (upper * SCAN_RATIO).max(mean_slope * (1.0 + KAPPA_TOLERANCE));
            let at_lower = tilt.at(lower);
            if at_lower <= 0.0 {
                return Ok(Bracket { lower, upper, at_lower, at_upper });
            }
            if lower >= upper * (1.0 - KAPPA_TOLERANCE) {
                break;
            }
            (upper, at_upper) = (lower, at_lower);
        }
        Err(none(top))
    }
}

struct Bracket {
    lower: f64,
    upper: f64,
    at_lower: f64,
    at_upper: f64,
}

fn bracket_near(tilt: &mut Tilt, kappa: f64) -> Option<Bracket> {
    let at = tilt.at(kappa);
    let ratio: f64 = if at > 0.0 { 0.99 } else { 1.01 };
    let (mut inner, mut at_inner) = (kappa, at);
    for step in 1..=NEAR_STEPS {
        let outer = kappa * ratio.powi(1 << (step - 1));
        let at_outer = tilt.at(outer);
        if (at_outer > 0.0) != (at > 0.0) {
            let (lower, upper) = ((inner, at_inner), (outer, at_outer));
            let (lower, upper) = if at > 0.0 { (upper, lower) } else { (lower, upper) };
            return Some(Bracket {
                lower: lower.0,
                at_lower: lower.1,
                upper: upper.0,
                at_upper: upper.1,
            });
        }
        (inner, at_inner) = (outer, at_outer);
    }
    None
}

/// False position with the Illinois weighting.
fn root(tilt: &mut Tilt, bracket: Bracket) -> f64 {
    let Bracket { mut lower, mut upper, mut at_lower, mut at_upper } = bracket;
    let mut kappa = upper;
    let mut moved_upper = None;
    for _ in 0..ROOT_ITERATIONS {
        let next = (lower * at_upper - upper * at_lower) / (at_upper - at_lower);
        let step = (next - kappa).abs();
        kappa = next;
        let at = tilt.at(kappa);
        if step <= KAPPA_TOLERANCE * kappa || at == 0.0 {
            break;
        }
        if at > 0.0 {
            (upper, at_upper) = (kappa, at);
            at_lower *= if moved_upper == Some(true) { 0.5 } else { 1.0 };
        } else {
            (lower, at_lower) = (kappa, at);
            at_upper *= if moved_upper == Some(false) { 0.5 } else { 1.0 };
        }
        moved_upper = Some(at > 0.0);
    }
    kappa
}

/// Half the derivative of the sum of squares by ln μ at μ = 1, where β is the best: positive
/// where a smaller exponent would fit better.
struct Tilt<'a> {
    model: Model<'a>,
    /// Where the last search for β ended, and the next starts.
    ln_beta: f64,
}

impl Tilt<'_> {
    fn at(&mut self, kappa: f64) -> f64 {
        let hyperbola = Hyperbola(self.model, kappa);
        let found = minimize(&hyperbola, [self.ln_beta]);
        let [ln_beta] = found.parameters;
        let law = hyperbola.law([ln_beta]);
        // A straight line cannot start the next search.
        self.ln_beta = if ln_beta > -10.0 { ln_beta } else { 0.0 };
        let mut residuals = vec![0.0; self.model.mean.len()];
        self.model.residuals(&law, &mut residuals);
        residuals.iter().enumerate().map(|(i, r)| r * self.model.gradient(&law, i)[1]).sum()
    }
}

#[cfg(test)]
mod tests;
