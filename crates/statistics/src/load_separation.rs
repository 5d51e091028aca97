//! The exponential relation of load and mean gap.
//!
//! Of self-affine roughness pressed by intermediate loads, p₀ = p_c exp(−ū/u₀) with the mean gap ū
//! (Persson 2007, *Relation between interfacial separation and load: a general theory of contact
//! mechanics*, Phys. Rev. Lett. 99, 125502): the length u₀ is of the order of the rms height, and
//! the interface as stiff as −dp₀/dū = p₀/u₀. Under lighter loads few summits of a finite surface
//! touch, under heavier ones contacts grow together: of surfaces on 512² nodes with H = 0.5 and 0.8
//! from k = 1 … 8 to 64, u₀ is 0.45 … 0.48 of the rms height at loads of 0.01 to 0.1, where ln p₀
//! follows the line to 0.02, but 0.3 … 0.4 at 0.002 and 0.2 … 0.3 at 0.3.
//!
//! The loads are exact and the gaps scatter from surface to surface, so the straight line is
//! ū = u₀ (ln p_c − ln p₀), by least squares of the mean gap. All data weigh the same: what they
//! deviate from a line is no scatter, for surfaces move along their own lines. The line of the mean
//! is the mean of the lines of the surfaces.

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::curves::Data;
use super::least_squares::{Quality, line};
use super::{Curves, FitError, GoodnessOfFit, Window};

/// One more than the parameters, so that the residual says something.
const LEAST_DATA: usize = 3;

/// An exponential relation of load and mean gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadSeparation {
    /// u₀: how much the mean gap falls while the load grows by the factor e; in the unit of gaps.
    pub decay_length: f64,
    /// p_c: the load at which the line has no gap left, in units of E* × rms slope.
    pub closing_load: f64,
    /// Residuals of ū/u₀, that is of ln p₀, determination of the mean gap; masked are loads under
    /// which no gap is left.
    pub goodness: GoodnessOfFit,
}

/// Mean gaps, ready to be fitted.
#[derive(Debug, Clone)]
pub struct LoadSeparationProblem {
    gaps: Data,
}

impl LoadSeparationProblem {
    /// Takes the loads inside a window; `gaps` are curves of the mean gap.
    pub fn new(gaps: &Curves, window: Window) -> Self {
        Self { gaps: gaps.area_data(window) }
    }

    /// Fits the mean over the realizations.
    ///
    /// # Errors
    /// With fewer than three loads under which a gap is left, or if it does not fall with the load.
    pub fn fit(&self) -> Result<LoadSeparation, FitError> {
        self.fit_mean(&self.gaps.mean())
    }

    /// Intervals of the decay length and the closing load, in this order.
    pub fn bootstrap(&self, fit: &LoadSeparation, bootstrap: &Bootstrap) -> Intervals {
        let estimates = [fit.decay_length, fit.closing_load].map(Estimate::Positive);
        bootstrap.intervals(self.gaps.surfaces(), &estimates, |multiplicities| {
            let fit = self.fit_mean(&self.gaps.resampled_mean(multiplicities))?;
            Ok(vec![fit.decay_length, fit.closing_load])
        })
    }

    fn fit_mean(&self, mean: &[f64]) -> Result<LoadSeparation, FitError> {
        let window = self.gaps.window;
        let open = self.gaps.loads.iter().zip(mean);
        let open = open.filter(|&(_, &gap)| gap > 0.0);
        let (ln_loads, gaps): (Vec<f64>, Vec<f64>) =
            open.map(|(load, &gap)| (load.ln(), gap)).unzip();
        let data = gaps.len();
        if data < LEAST_DATA {
            return Err(FitError::TooFew { window, found: data, needed: LEAST_DATA });
        }
        let falling = line(&ln_loads, &gaps).filter(|(slope, _)| *slope < 0.0);
        let (slope, intercept) = falling.ok_or(FitError::NoDecay { window })?;
        let predicted: Vec<f64> = ln_loads.iter().map(|ln| intercept + slope * ln).collect();
        let quality = Quality::of(&gaps, &predicted, None);
        Ok(LoadSeparation {
            decay_length: -slope,
            closing_load: (intercept / -slope).exp(),
            goodness: GoodnessOfFit {
                rms_residual: quality.rms_residual / -slope,
                ..GoodnessOfFit::of(&quality, data, mean.len())
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;

    const WINDOW: Window = Window { from: 0.01, to: 0.2 };

    /// Loads by equal factors from 1e-3 to 1.
    fn loads() -> Vec<f64> {
        (0..=30).map(|step| 10f64.powf(f64::from(step) / 10.0 - 3.0)).collect()
    }

    /// Surfaces with u₀ = 0.5 of their rms height each, and p_c = 0.4.
    fn gaps(rms_heights: &[f64]) -> Curves {
        let of_surface = |height: &f64| {
            let gap = |load: &f64| 0.5 * height * (0.4 / load).ln();
            loads().iter().map(gap).map(|gap| gap.max(0.0)).collect()
        };
        let gaps = rms_heights.iter().map(of_surface).collect();
        Curves::new(loads(), gaps).expect("well formed")
    }

    #[test]
    fn an_exact_relation_is_recovered_in_the_unit_of_the_gaps() {
        let fit = LoadSeparationProblem::new(&gaps(&[2e-6]), WINDOW).fit().unwrap();
        assert!((fit.decay_length / 1e-6 - 1.0).abs() < 1e-12, "{fit:?}");
        assert!((fit.closing_load / 0.4 - 1.0).abs() < 1e-12, "{fit:?}");
        assert!(fit.goodness.rms_residual < 1e-12 && fit.goodness.r_squared > Some(1.0 - 1e-12));
        // 0.01, 0.0126 … 0.2.
        assert_eq!((fit.goodness.data, fit.goodness.masked), (14, 0));
    }

    #[test]
    fn closed_gaps_are_masked() {
        let all = LoadSeparationProblem::new(&gaps(&[1.0]), Window::ALL).fit().unwrap();
        // From 0.501 on.
        assert_eq!((all.goodness.data, all.goodness.masked), (27, 4));
        assert!((all.decay_length - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_length_of_several_surfaces_is_the_mean_of_theirs() {
        let heights: Vec<f64> = normal(3, 40).iter().map(|draw| 1.0 + 0.2 * draw).collect();
        let mean = heights.iter().sum::<f64>() / 40.0;
        let problem = LoadSeparationProblem::new(&gaps(&heights), WINDOW);
        let fit = problem.fit().unwrap();
        assert!((fit.decay_length / (0.5 * mean) - 1.0).abs() < 1e-12);
        let intervals =
            problem.bootstrap(&fit, &Bootstrap { replicates: 400, seed: 1, level: 0.95 });
        let [length, load] = intervals.intervals.expect("no failures")[..] else {
            panic!("two parameters")
        };
        // 20 % of 0.5 over √40, known to 1/√80 from the surfaces.
        assert!((length.standard_error / 0.0158 - 1.0).abs() < 0.35, "{length:?}");
        assert!(length.lower < 0.5 && 0.5 < length.upper);
        // All lines meet at the same closing load.
        assert!((load.upper / load.lower - 1.0).abs() < 1e-9, "{load:?}");
    }

    #[test]
    fn what_has_no_exponential_relation_says_so() {
        let constant = Curves::new(loads(), vec![vec![1.0; 31]]).expect("well formed");
        let failed = |curves: &Curves, window| {
            let problem = LoadSeparationProblem::new(curves, window);
            problem.fit().unwrap_err().to_string()
        };
        let told = failed(&constant, WINDOW);
        assert!(told.contains("does not fall") && told.contains("[0.01, 0.2]"), "{told}");
        let light = Window { from: 0.0, to: 0.0012 };
        let told = failed(&gaps(&[1.0]), light);
        assert!(told.contains("1 usable data"), "{told}");
    }
}
