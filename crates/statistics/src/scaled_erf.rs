//! Persson's error function with a scaled load, for the approach to full contact.
//!
//! Persson 2001 gives 1 − a = erfc(√2 y). Fig. 10 of Yastrebov, Anciaux & Molinari 2015
//! describes computed curves by erfc(β√2 y). The non-contact fraction decreases over orders of
//! magnitude. The fit therefore minimises the squared residuals of ln(1 − a), which gives all
//! decades equal weight. Residuals of a would give weight to the lightest loads of the window only.
//! Because β is not exactly constant, the fit also returns the factor that reproduces each area.

use std::f64::consts::SQRT_2;

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::curves::Data;
use super::least_squares::{Quality, Residuals, minimize};
use super::{Curves, FitError, GoodnessOfFit, Window};
use asperity_mechanics::theory::persson::{erfc_inverse, ln_erfc, ln_erfc_slope};

/// Minimum number of data, one more than the number of parameters.
const LEAST_DATA: usize = 2;

/// Scaled error function 1 − a = erfc(β√2 y), fitted to the approach to full contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaledErf {
    /// Factor β of the load in erfc(β√2 y). It is one in Persson's theory.
    pub beta: f64,
    /// Goodness of fit of ln(1 − a).
    ///
    /// Data with a ≤ 0 or a ≥ 1 are masked.
    pub goodness: GoodnessOfFit,
    /// Load y of each datum, and the factor β that reproduces its area exactly.
    pub local: Vec<(f64, f64)>,
}

/// Areas at the loads of a window, to which a scaled error function is fitted.
#[derive(Debug, Clone)]
pub struct ScaledErfProblem {
    data: Data,
}

impl ScaledErfProblem {
    /// Creates a problem from the areas at the loads inside a window.
    pub fn new(curves: &Curves, window: Window) -> Self {
        Self { data: curves.area_data(window) }
    }

    /// Fits the function to the mean over the realizations.
    ///
    /// # Errors
    /// Fails if fewer than two loads have partial contact, if all areas are equal, or if the
    /// iteration does not converge.
    pub fn fit(&self) -> Result<ScaledErf, FitError> {
        let approach = self.approach(&self.data.mean())?;
        let local = approach.local();
        let beta = approach.fit(&local)?;
        let predicted: Vec<f64> = approach.x.iter().map(|x| ln_erfc(beta * x)).collect();
        let quality = Quality::new(&approach.ln_noncontact, &predicted, None);
        if quality.r_squared.is_none() {
            return Err(FitError::EqualAreas);
        }
        Ok(ScaledErf {
            beta,
            goodness: GoodnessOfFit::new(&quality, approach.x.len(), self.data.loads.len()),
            local: approach.x.iter().zip(local).map(|(x, beta)| (x / SQRT_2, beta)).collect(),
        })
    }

    /// Computes the confidence interval of the factor β by resampling surfaces.
    pub fn bootstrap(&self, fit: &ScaledErf, bootstrap: &Bootstrap) -> Intervals {
        let estimates = [Estimate::Positive(fit.beta)];
        bootstrap.intervals(self.data.surfaces(), &estimates, |multiplicities| {
            let approach = self.approach(&self.data.resampled_mean(multiplicities))?;
            Ok(vec![approach.fit(&approach.local())?])
        })
    }

    fn approach(&self, mean: &[f64]) -> Result<Approach, FitError> {
        let usable =
            self.data.loads.iter().zip(mean).filter(|&(_, &area)| 0.0 < area && area < 1.0);
        // Areas are multiples of the area of a cell, so that small values of 1 − a are exact.
        let (x, ln_noncontact): (Vec<f64>, Vec<f64>) =
            usable.map(|(load, area)| (SQRT_2 * load, libm::log1p(-area))).unzip();
        let (window, found) = (self.data.window, x.len());
        if found < LEAST_DATA {
            return Err(FitError::TooFew { window, found, needed: LEAST_DATA });
        }
        Ok(Approach { x, ln_noncontact })
    }
}

struct Approach {
    /// Argument √2 y of each datum.
    x: Vec<f64>,
    ln_noncontact: Vec<f64>,
}

impl Approach {
    /// Returns the factor β that reproduces each datum exactly.
    fn local(&self) -> Vec<f64> {
        self.x
            .iter()
            .zip(&self.ln_noncontact)
            .map(|(x, ln)| erfc_inverse(libm::exp(*ln)).expect("the data have partial contact") / x)
            .collect()
    }

    fn fit(&self, local: &[f64]) -> Result<f64, FitError> {
        let start = local.iter().sum::<f64>() / local.len() as f64;
        let found = minimize(self, [libm::log(start)]);
        let converged = found.converged.then_some(libm::exp(found.parameters[0]));
        converged.ok_or(FitError::NotConverged)
    }
}

/// Residuals ln erfc(βx) − ln(1 − a). The parameter is ln β, which keeps β positive.
impl Residuals<1> for Approach {
    fn count(&self) -> usize {
        self.x.len()
    }

    fn residuals(&self, [ln_beta]: [f64; 1], into: &mut [f64]) {
        let beta = libm::exp(ln_beta);
        for ((residual, x), ln_noncontact) in into.iter_mut().zip(&self.x).zip(&self.ln_noncontact)
        {
            *residual = ln_erfc(beta * x) - ln_noncontact;
        }
    }

    fn gradients(&self, [ln_beta]: [f64; 1], into: &mut [[f64; 1]]) {
        let beta = libm::exp(ln_beta);
        for (gradient, x) in into.iter_mut().zip(&self.x) {
            *gradient = [beta * x * ln_erfc_slope(beta * x)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::curves::{persson_curve, uniform};
    use crate::random::normal;

    const HEAVY: Window = Window { from: 0.6, to: 3.0 };

    fn scaled(beta: f64, factors: &[f64]) -> Curves {
        let loads = uniform(2.0, 40);
        let row = |factor: &f64| {
            loads.iter().map(|y| libm::erf(beta * factor * SQRT_2 * y)).collect::<Vec<f64>>()
        };
        let areas = factors.iter().map(row).collect();
        Curves::new(loads.clone(), areas).expect("well formed")
    }

    fn fit(curves: &Curves) -> ScaledErf {
        ScaledErfProblem::new(curves, HEAVY).fit().expect("loads near full contact")
    }

    #[test]
    fn factor_of_perssons_theory_is_one() {
        let fit = fit(&persson_curve(uniform(2.0, 40)));
        // Rounding of areas near one causes relative errors of 2e-12 in 1 − a = 6e-5, and of 1e-12
        // in β.
        assert!((fit.beta - 1.0).abs() < 1e-11 && fit.goodness.rms_residual < 1e-10);
        assert!(fit.local.iter().all(|(_, beta)| (beta - 1.0).abs() < 1e-11));
        assert!(fit.goodness.r_squared > Some(1.0 - 1e-12));
    }

    #[test]
    fn factor_is_recovered() {
        for beta in [0.8, 1.09, 1.16] {
            assert!((fit(&scaled(beta, &[1.0])).beta - beta).abs() < 1e-9);
        }
    }

    #[test]
    fn full_contact_is_masked() {
        let mut areas: Vec<f64> = uniform(2.0, 40).iter().map(|&y| libm::erf(SQRT_2 * y)).collect();
        areas[37..].fill(1.0);
        let curves = Curves::new(uniform(2.0, 40), vec![areas; 3]).expect("well formed");
        let fit = fit(&curves);
        assert_eq!((fit.goodness.data, fit.goodness.masked), (26, 3));
        assert_eq!(fit.local.len(), 26);
        assert!((fit.beta - 1.0).abs() < 1e-11);
    }

    #[test]
    fn nothing_out_of_contact_is_no_data() {
        let curves = Curves::new(vec![1.0, 2.0, 3.0], vec![vec![1.0; 3]]).expect("well formed");
        let error = ScaledErfProblem::new(&curves, HEAVY).fit().unwrap_err();
        assert_eq!(error, FitError::TooFew { window: HEAVY, found: 0, needed: 2 });
    }

    #[test]
    fn equal_areas_have_no_factor() {
        let curves = Curves::new(vec![1.0, 2.0, 3.0], vec![vec![0.9; 3]]).expect("well formed");
        let error = ScaledErfProblem::new(&curves, HEAVY).fit().unwrap_err();
        assert_eq!(error, FitError::EqualAreas);
    }

    #[test]
    fn factor_lies_among_those_of_the_loads() {
        // 1 − a is three quarters of Persson's value, so that the factor decreases towards one.
        let loads = uniform(2.0, 40);
        let areas = loads.iter().map(|y| 1.0 - 0.75 * libm::erfc(SQRT_2 * y)).collect();
        let fit = fit(&Curves::new(loads, vec![areas]).expect("well formed"));
        let (first, last) = (fit.local[0].1, fit.local[fit.local.len() - 1].1);
        assert!(first > fit.beta && fit.beta > last && last > 1.0);
        assert!(fit.local.windows(2).all(|pair| pair[0].1 > pair[1].1));
    }

    #[test]
    fn interval_contains_the_factor_and_is_as_wide_as_the_scatter() {
        let factors: Vec<f64> = normal(4, 50).iter().map(|draw| 1.0 + 0.01 * draw).collect();
        let problem = ScaledErfProblem::new(&scaled(1.1, &factors), HEAVY);
        let bootstrap = Bootstrap { replicates: 300, seed: 2, level: 0.95 };
        let fit = problem.fit().expect("open contact");
        let intervals = problem.bootstrap(&fit, &bootstrap).intervals;
        let interval = intervals.expect("no failures")[0];
        assert!(interval.lower <= 1.1 && 1.1 <= interval.upper);
        // The standard error is 1 % of 1.1 divided by √50, with a relative error of 1/√100.
        assert!((interval.standard_error / 0.001_56 - 1.0).abs() < 0.3);
    }
}
