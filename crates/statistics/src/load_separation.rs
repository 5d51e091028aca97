//! Fit of the exponential relation between load and mean gap.
//!
//! For self-affine roughness under intermediate loads, p₀ = p_c exp(−ū/u₀) with the mean gap ū
//! (Persson 2007, *Relation between interfacial separation and load: a general theory of contact
//! mechanics*, Phys. Rev. Lett. 99, 125502). The length u₀ is of the order of the rms height, and
//! the normal stiffness of the interface is −dp₀/dū = p₀/u₀. The relation fails under lighter
//! loads, where few summits of a finite surface are in contact, and under heavier loads, where
//! contacts merge.
//!
//! The following values were measured on surfaces of 512² nodes with H = 0.5 and 0.8,
//! k_lower = 1 … 8 and k_upper = 64:
//!
//! | load | u₀/rms height |
//! |---|---|
//! | 0.002 | 0.3 … 0.4 |
//! | 0.01 to 0.1 | 0.45 … 0.48; ln p₀ deviates from the line by 0.02 |
//! | 0.3 | 0.2 … 0.3 |
//!
//! The loads are exact, and the gaps scatter between surfaces. The line ū = u₀ (ln p_c − ln p₀) is
//! therefore fitted by least squares of the mean gap. Weights are equal, because the deviations
//! from the line are mostly systematic. The line fitted to the mean gap is the mean of the lines
//! fitted to each surface.

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::curves::Data;
use super::least_squares::{Quality, line};
use super::{Curves, FitError, GoodnessOfFit, Window};

/// Minimum number of data, one more than the number of parameters.
const LEAST_DATA: usize = 3;

/// Fitted exponential relation between load and mean gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadSeparation {
    /// Decay length u₀, in the unit of the gaps.
    pub decay_length: f64,
    /// Load p_c at which the fitted mean gap is zero, in units of E* h′.
    pub closing_load: f64,
    /// Goodness of fit: residuals of ū/u₀, which are the residuals of ln p₀, and R² of the mean gap
    /// ū.
    ///
    /// Loads at which the mean gap is not positive are masked.
    pub goodness: GoodnessOfFit,
}

/// Mean gaps of all surfaces, to which the exponential relation is fitted.
#[derive(Debug, Clone)]
pub struct LoadSeparationProblem {
    gaps: Data,
}

impl LoadSeparationProblem {
    /// Creates a problem from the mean gaps at the loads inside a window. The values in `gaps` are
    /// mean gaps instead of areas.
    pub fn new(gaps: &Curves, window: Window) -> Self {
        Self { gaps: gaps.area_data(window) }
    }

    /// Fits the relation to the mean gap averaged over the realizations.
    ///
    /// # Errors
    /// Fails if this gap is positive at fewer than three loads, or if it does not decrease with the
    /// load.
    pub fn fit(&self) -> Result<LoadSeparation, FitError> {
        self.fit_mean(&self.gaps.mean())
    }

    /// Computes confidence intervals of the decay length u₀ and the closing load p_c, in this
    /// order, by resampling surfaces.
    pub fn bootstrap(&self, fit: &LoadSeparation, bootstrap: &Bootstrap) -> Intervals {
        let estimates = [fit.decay_length, fit.closing_load].map(Estimate::Positive);
        bootstrap.intervals(self.gaps.surfaces(), &estimates, |multiplicities| {
            let fit = self.fit_mean(&self.gaps.resampled_mean(multiplicities))?;
            Ok(vec![fit.decay_length, fit.closing_load])
        })
    }

    fn fit_mean(&self, mean: &[f64]) -> Result<LoadSeparation, FitError> {
        let window = self.gaps.window;
        let points = self.gaps.loads.iter().zip(mean);
        let open = points.filter(|&(_, &gap)| gap > 0.0);
        let (ln_loads, gaps): (Vec<f64>, Vec<f64>) =
            open.map(|(load, &gap)| (libm::log(*load), gap)).unzip();
        let data = gaps.len();
        if data < LEAST_DATA {
            return Err(FitError::TooFew { window, found: data, needed: LEAST_DATA });
        }
        let falling = line(&ln_loads, &gaps).filter(|(slope, _)| *slope < 0.0);
        let (slope, intercept) = falling.ok_or(FitError::NoDecay)?;
        let predicted: Vec<f64> = ln_loads.iter().map(|ln| intercept + slope * ln).collect();
        let quality = Quality::new(&gaps, &predicted, None);
        Ok(LoadSeparation {
            decay_length: -slope,
            closing_load: libm::exp(intercept / -slope),
            goodness: GoodnessOfFit {
                rms_residual: quality.rms_residual / -slope,
                ..GoodnessOfFit::new(&quality, data, mean.len())
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;

    const WINDOW: Window = Window { from: 0.01, to: 0.2 };

    /// Returns loads from 1e-3 to 1 with equal ratios between neighbours.
    fn loads() -> Vec<f64> {
        (0..=30).map(|step| 10f64.powf(f64::from(step) / 10.0 - 3.0)).collect()
    }

    /// Returns the mean gaps of surfaces with the given rms heights, with u₀ = 0.5 rms height and
    /// p_c = 0.4.
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
        // The loads are 0.01, 0.0126, …, 0.2.
        assert_eq!((fit.goodness.data, fit.goodness.masked), (14, 0));
    }

    #[test]
    fn closed_gaps_are_masked() {
        let all = LoadSeparationProblem::new(&gaps(&[1.0]), Window::ALL).fit().unwrap();
        // The gaps are closed from 0.501 on.
        assert_eq!((all.goodness.data, all.goodness.masked), (27, 4));
        assert!((all.decay_length - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_decay_length_of_several_surfaces_is_their_mean() {
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
        // The standard error is 20 % of 0.5 divided by √40, with a relative error of 1/√80.
        assert!((length.standard_error / 0.0158 - 1.0).abs() < 0.35, "{length:?}");
        assert!(length.lower < 0.5 && 0.5 < length.upper);
        // All lines have the same closing load.
        assert!((load.upper / load.lower - 1.0).abs() < 1e-9, "{load:?}");
    }

    #[test]
    fn gaps_without_an_exponential_relation_are_an_error() {
        let constant = Curves::new(loads(), vec![vec![1.0; 31]]).expect("well formed");
        let failed = |curves: &Curves, window| {
            let problem = LoadSeparationProblem::new(curves, window);
            problem.fit().unwrap_err().to_string()
        };
        let error = failed(&constant, WINDOW);
        assert!(error.contains("does not decrease"), "{error}");
        let light = Window { from: 0.0, to: 0.0012 };
        let error = failed(&gaps(&[1.0]), light);
        assert!(error.contains("1 usable data"), "{error}");
    }
}
