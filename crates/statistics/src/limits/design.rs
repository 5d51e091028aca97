//! What more points would make of the standard error of a limit, from the design alone.

use nalgebra::DMatrix;

use super::linear::Design;
use super::{LimitFit, LimitProblem, TermForm};

impl LimitProblem {
    /// The factor by which points at these small numbers, added to those that there are, change the
    /// standard error of the limit; `None` where the design does not tell.
    ///
    /// To first order in the free exponents, as if points were independent, with as many surfaces at new
    /// points as the fewest have, which scatter by the same power law.
    pub fn narrowing(&self, forms: &[TermForm], fit: &LimitFit, more: &[Vec<f64>]) -> Option<f64> {
        let surfaces = self.surfaces();
        let now = self.points.iter().map(|point| point.small.as_slice());
        let now: Vec<(&[f64], f64)> = now.zip(self.scales.iter().copied()).collect();
        let after = more.iter().map(|small| {
            let error = self.scatter.standard_error(small, surfaces);
            (small.as_slice(), 1.0 / error)
        });
        let after: Vec<(&[f64], f64)> = now.iter().copied().chain(after).collect();
        let variance = |points: &[(&[f64], f64)]| {
            let design = Design::new(design(forms, fit, points))?;
            Some(design.variance_of_first())
        };
        Some((variance(&after)? / variance(&now)?).sqrt())
    }
}

/// Derivatives of the law by limit, coefficients and free exponents, over standard errors.
fn design(forms: &[TermForm], fit: &LimitFit, points: &[(&[f64], f64)]) -> DMatrix<f64> {
    let free: Vec<usize> =
        (0..forms.len()).filter(|&term| forms[term] == TermForm::FreePower).collect();
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
            observed: Observed::of_realizations(vec![small - 0.1, small + 0.1]),
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
        for forms in [[TermForm::Power(1.0)], [TermForm::Logarithm], [TermForm::FreePower]] {
            let fit = problem.fit(&forms).unwrap();
            let again = small.map(|small| vec![small]);
            let found = problem.narrowing(&forms, &fit, &again).unwrap();
            assert!((found - 0.5_f64.sqrt()).abs() < 1e-9, "{forms:?}: {found}");
        }
    }
}
