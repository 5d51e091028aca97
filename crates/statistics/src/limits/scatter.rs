//! Power law of the scatter between surfaces, and prediction of the standard error of a limit.
//!
//! The standard deviation s between surfaces is a power law of the small parameters,
//! ln s = a₀ + Σ aⱼ ln xⱼ, fitted by least squares to the standard deviations of all points.

use nalgebra::{DMatrix, DVector};

use super::{LimitFit, LimitPoint, LimitProblem, TermForm};
use crate::least_squares::Design;

/// Power law s = exp(a₀) Π xⱼ^aⱼ of the standard deviation between surfaces.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// Coefficient a₀, followed by the exponents aⱼ of the small parameters.
    coefficients: Vec<f64>,
}

impl Scatter {
    /// Fits the power law to the standard deviations of the points.
    ///
    /// If the points do not determine the exponents aⱼ, the standard deviation is constant.
    pub fn new(points: &[LimitPoint]) -> Scatter {
        let terms = points.first().map_or(0, |point| point.small.len());
        let logarithm = |point: &LimitPoint| {
            let surfaces = point.observed.surfaces() as f64;
            let deviation = point.observed.standard_error() * surfaces.sqrt();
            libm::log(deviation) - bias(surfaces - 1.0)
        };
        let logarithms: Vec<f64> = points.iter().map(logarithm).collect();
        let row = |point: usize, column: usize| match column {
            0 => 1.0,
            _ => libm::log(points[point].small[column - 1]),
        };
        let columns = DMatrix::from_fn(points.len(), 1 + terms, row);
        let design = (points.len() > 1 + terms).then(|| Design::new(columns));
        let coefficients = match design.flatten() {
            Some(design) => design.solve(&DVector::from_vec(logarithms)).as_slice().to_vec(),
            None => vec![logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64],
        };
        Scatter { coefficients }
    }

    /// Returns the standard error of a mean over `surfaces` surfaces at the small parameters
    /// `small`.
    pub fn standard_error(&self, small: &[f64], surfaces: usize) -> f64 {
        let slopes = self.coefficients.iter().skip(1);
        let terms = slopes.zip(small).map(|(slope, small)| slope * libm::log(*small));
        let logarithm = self.coefficients[0] + terms.sum::<f64>();
        libm::exp(logarithm) / (surfaces as f64).sqrt()
    }
}

/// Returns the mean of ln(s/σ) over samples of a normal distribution, for the sample standard
/// deviation s with ν = `freedom` degrees of freedom.
///
/// It is an expansion of [ψ(ν/2) − ln(ν/2)]/2. Its error is 0.035 at ν = 1 and below 0.001 for
/// ν ≥ 3.
fn bias(freedom: f64) -> f64 {
    -0.5 / freedom - 1.0 / (6.0 * freedom * freedom)
}

impl LimitProblem {
    /// Returns the predicted standard error of the limit Q₀ after adding points, divided by the
    /// present standard error.
    ///
    /// `more` contains the small parameters of the new points. Each new point is assumed to have as
    /// many surfaces as the point with the fewest surfaces, and the scatter of the fitted power
    /// law. The prediction is of first order in the free exponents and assumes independent points.
    /// Returns `None` if the points do not determine the terms.
    pub fn predicted_error_ratio(
        &self,
        forms: &[TermForm],
        fit: &LimitFit,
        more: &[Vec<f64>],
    ) -> Option<f64> {
        let surfaces = self.surfaces();
        let small = self.points.iter().map(|point| point.small.as_slice());
        let now: Vec<(&[f64], f64)> = small.zip(self.scales.iter().copied()).collect();
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

/// Returns the derivatives of the law with respect to its limit, coefficients and free exponents,
/// in this order of columns.
///
/// `points` contains the small parameters and the inverse standard error of each point. The row of
/// a point is multiplied by this inverse standard error.
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
                // The derivative is ∂(c xᵉ)/∂e = c xᵉ ln x.
                _ => {
                    let free = free[column - linear];
                    fit.coefficients[free] * term(free) * libm::log(small[free])
                }
            }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Observed;
    use crate::random::normal;

    #[test]
    fn scatter_that_is_a_power_of_small_numbers_is_found_without_bias() {
        let sigma = |small: f64| 0.3 * small.powf(1.5);
        let point = |index: usize| {
            let small = 0.9_f64.powi(index as i32 % 20);
            let draws = normal(index as u64, 4);
            let values = draws.iter().map(|z| 1.0 + sigma(small) * z).collect();
            LimitPoint { small: vec![small], observed: Observed::from_realizations(values) }
        };
        let points: Vec<LimitPoint> = (0..4000).map(point).collect();
        let scatter = Scatter::new(&points);
        for small in [0.15, 0.5, 1.0] {
            // For four surfaces, ln s has a standard deviation of 0.5, which gives an error of 0.01
            // with 4000 points.
            let found = scatter.standard_error(&[small], 9) * 3.0 / sigma(small);
            assert!((found - 1.0).abs() < 0.04, "{small}: {found}");
        }
    }

    #[test]
    fn few_points_have_a_constant_scatter() {
        let point = |small: f64| LimitPoint {
            small: vec![small],
            observed: Observed::from_realizations(vec![1.0, 1.0 + 2.0_f64.sqrt()]),
        };
        let scatter = Scatter::new(&[point(1.0), point(0.5)]);
        let known = libm::exp(-bias(1.0));
        assert!((scatter.standard_error(&[0.1], 1) - known).abs() < 1e-14);
    }

    fn problem(small: &[f64]) -> LimitProblem {
        // All standard errors are 0.1.
        let point = |&small: &f64| LimitPoint {
            small: vec![small],
            observed: Observed::from_realizations(vec![small - 0.1, small + 0.1]),
        };
        LimitProblem::new(small.iter().map(point).collect()).unwrap()
    }

    #[test]
    fn the_error_ratio_of_a_line_is_that_of_its_intercept() {
        let (forms, small) = ([TermForm::Power(1.0)], [1.0, 0.5, 0.25]);
        let problem = problem(&small);
        let fit = problem.fit(&forms).unwrap();
        // The variance of the intercept of a line is Σx²/(n Σ(x − x̄)²).
        let variance = |small: &[f64]| {
            let count = small.len() as f64;
            let mean = small.iter().sum::<f64>() / count;
            let squares: f64 = small.iter().map(|x| x * x).sum();
            let spread: f64 = small.iter().map(|x| (x - mean).powi(2)).sum();
            squares / (count * spread)
        };
        let known = (variance(&[1.0, 0.5, 0.25, 0.125]) / variance(&small)).sqrt();
        let found = problem.predicted_error_ratio(&forms, &fit, &[vec![0.125]]).unwrap();
        assert!((found - known).abs() < 1e-12, "{found} {known}");
        assert_eq!(problem.predicted_error_ratio(&forms, &fit, &[]), Some(1.0));
    }

    #[test]
    fn repeated_points_reduce_the_error_by_the_square_root_of_two() {
        let small = [1.0, 0.5, 0.25, 0.125];
        let problem = problem(&small);
        for forms in [[TermForm::Power(1.0)], [TermForm::Logarithm], [TermForm::FreePower]] {
            let fit = problem.fit(&forms).unwrap();
            let again = small.map(|small| vec![small]);
            let found = problem.predicted_error_ratio(&forms, &fit, &again).unwrap();
            assert!((found - 0.5_f64.sqrt()).abs() < 1e-9, "{forms:?}: {found}");
        }
    }
}
