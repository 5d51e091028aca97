//! What more points would make of the standard error of a limit, from the design alone.

use nalgebra::{DMatrix, DVector};

use super::linear::Design;
use super::{LimitFit, LimitProblem, TermForm};

impl LimitProblem {
    /// The factor by which points at these small numbers, added to those that there are, change the
    /// standard error of the limit; `None` where the design does not tell.
    ///
    /// To first order in the free exponents and as if points were independent. A point's own standard
    /// error is taken from those that there are: its logarithm by least squares, linear in the
    /// logarithms of the small numbers.
    pub fn narrowing(&self, forms: &[TermForm], fit: &LimitFit, more: &[Vec<f64>]) -> Option<f64> {
        let errors = self.expected_errors(more);
        let now = self.points.iter().map(|point| point.small.as_slice());
        let now: Vec<(&[f64], f64)> = now.zip(self.scales.iter().copied()).collect();
        let more = more.iter().zip(&errors);
        let after = more.map(|(small, error)| (small.as_slice(), 1.0 / error));
        let after: Vec<(&[f64], f64)> = now.iter().copied().chain(after).collect();
        let variance = |points: &[(&[f64], f64)]| {
            let design = Design::new(design(forms, fit, points))?;
            Some(design.variance_of_first())
        };
        Some((variance(&after)? / variance(&now)?).sqrt())
    }

    /// Standard errors to be expected at other small numbers, with as many surfaces.
    fn expected_errors(&self, at: &[Vec<f64>]) -> Vec<f64> {
        let logarithms: Vec<f64> = self.scales.iter().map(|scale| -libm::log(*scale)).collect();
        let terms = self.points.first().map_or(0, |point| point.small.len());
        let row = |small: &[f64], column: usize| match column {
            0 => 1.0,
            _ => libm::log(small[column - 1]),
        };
        let columns = DMatrix::from_fn(self.points.len(), 1 + terms, |point, column| {
            row(&self.points[point].small, column)
        });
        let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
        let Some(design) = Design::new(columns) else {
            return vec![libm::exp(mean); at.len()];
        };
        let slopes = design.solve(&DVector::from_vec(logarithms));
        let expected = |small: &Vec<f64>| {
            let terms = slopes.iter().enumerate();
            libm::exp(
                terms
                    .map(|(column, slope)| slope * row(small, column))
                    .sum(),
            )
        };
        at.iter().map(expected).collect()
    }
}

/// Derivatives of the law by limit, coefficients and free exponents, over standard errors.
fn design(forms: &[TermForm], fit: &LimitFit, points: &[(&[f64], f64)]) -> DMatrix<f64> {
    let free: Vec<usize> = (0..forms.len())
        .filter(|&term| forms[term] == TermForm::FreePower)
        .collect();
    let linear = 1 + forms.len();
    DMatrix::from_fn(points.len(), linear + free.len(), |row, column| {
        let (small, scale) = points[row];
        let term = |term: usize| match fit.exponents[term] {
            Some(exponent) => libm::pow(small[term], exponent),
            None => libm::log(small[term]),
        };
        scale
            * match column {
                0 => 1.0,
                _ if column < linear => term(column - 1),
                // ∂(c xᵉ)/∂e = c xᵉ ln x
                _ => {
                    let free = free[column - linear];
                    fit.coefficients[free] * term(free) * libm::log(small[free])
                }
            }
    })
}

#[cfg(test)]
mod tests {
    use super::super::{LimitPoint, Observed};
    use super::*;

    fn problem(small: &[f64]) -> LimitProblem {
        // Standard errors of 0.1, whatever the point.
        let point = |&small: &f64| LimitPoint {
            small: vec![small],
            observed: Observed::Surfaces(vec![small - 0.1, small + 0.1]),
        };
        LimitProblem::new(small.iter().map(point).collect()).unwrap()
    }

    #[test]
    fn a_line_is_narrowed_as_its_intercept_says() {
        let (forms, small) = ([TermForm::Power(1.0)], [1.0, 0.5, 0.25]);
        let problem = problem(&small);
        let fit = problem.fit(&forms).unwrap();
        // Σx²/(n Σ(x − x̄)²)
        let variance = |small: &[f64]| {
            let count = small.len() as f64;
            let mean = small.iter().sum::<f64>() / count;
            let squares: f64 = small.iter().map(|x| x * x).sum();
            let spread: f64 = small.iter().map(|x| (x - mean).powi(2)).sum();
            squares / (count * spread)
        };
        let known = (variance(&[1.0, 0.5, 0.25, 0.125]) / variance(&small)).sqrt();
        let found = problem.narrowing(&forms, &fit, &[vec![0.125]]).unwrap();
        assert!((found - known).abs() < 1e-12, "{found} {known}");
        assert_eq!(problem.narrowing(&forms, &fit, &[]), Some(1.0));
    }

    #[test]
    fn the_same_points_again_narrow_by_the_root_of_two() {
        let small = [1.0, 0.5, 0.25, 0.125];
        let problem = problem(&small);
        for forms in [
            [TermForm::Power(1.0)],
            [TermForm::Logarithm],
            [TermForm::FreePower],
        ] {
            let fit = problem.fit(&forms).unwrap();
            let again = small.map(|small| vec![small]);
            let found = problem.narrowing(&forms, &fit, &again).unwrap();
            assert!((found - 0.5_f64.sqrt()).abs() < 1e-9, "{forms:?}: {found}");
        }
    }
}
