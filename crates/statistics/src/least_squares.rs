//! Nonlinear least squares (Levenberg–Marquardt), linear least squares (QR), and goodness of fit.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::storage::Owned;
use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, SVector};

/// Relative tolerance of [`minimize`] for the sum of squares, the parameters and the gradient.
///
/// It is far below statistical errors and far above rounding errors.
const TOLERANCE: f64 = 1e-12;

/// Parameters at which the iteration of [`minimize`] ended.
pub struct Minimum<const P: usize> {
    pub parameters: [f64; P],
    /// `true` if the iteration ended at a stationary point.
    pub converged: bool,
}

/// Model with `P` parameters, defined by its residuals and their derivatives.
pub trait Residuals<const P: usize> {
    /// Returns the number of residuals.
    fn count(&self) -> usize;
    /// Writes the residuals at the given parameters to `into`.
    fn residuals(&self, parameters: [f64; P], into: &mut [f64]);
    /// Writes the gradient of each residual, its derivatives with respect to the parameters, to
    /// `into`.
    fn gradients(&self, parameters: [f64; P], into: &mut [[f64; P]]);
}

/// Minimises the sum of squared residuals by the Levenberg–Marquardt method, starting from the
/// parameters `start`.
pub fn minimize<const P: usize>(model: &impl Residuals<P>, start: [f64; P]) -> Minimum<P> {
    let problem = Problem { model, parameters: SVector::from(start) };
    let (problem, report) = LevenbergMarquardt::new()
        .with_ftol(TOLERANCE)
        .with_xtol(TOLERANCE)
        .with_gtol(TOLERANCE)
        .minimize::<Const<P>, Dyn, _>(problem);
    let converged = report.termination.was_successful()
        // For an exact fit, rounding errors exceed the tolerances.
        || matches!(report.termination, TerminationReason::NoImprovementPossible(_));
    Minimum { parameters: problem.parameters.into(), converged }
}

struct Problem<'a, M, const P: usize> {
    model: &'a M,
    parameters: SVector<f64, P>,
}

impl<M: Residuals<P>, const P: usize> LeastSquaresProblem<f64, Dyn, Const<P>>
    for Problem<'_, M, P>
{
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Const<P>>;
    type ParameterStorage = Owned<f64, Const<P>>;

    fn set_params(&mut self, parameters: &SVector<f64, P>) {
        self.parameters = *parameters;
    }

    fn params(&self) -> SVector<f64, P> {
        self.parameters
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let mut residuals = DVector::zeros(self.model.count());
        self.model.residuals(self.parameters.into(), residuals.as_mut_slice());
        residuals.iter().all(|residual| residual.is_finite()).then_some(residuals)
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, Const<P>>> {
        let mut gradients = vec![[0.0; P]; self.model.count()];
        self.model.gradients(self.parameters.into(), &mut gradients);
        gradients
            .iter()
            .flatten()
            .all(|derivative| derivative.is_finite())
            .then(|| OMatrix::from_fn_generic(Dyn(gradients.len()), Const, |i, j| gradients[i][j]))
    }
}

/// Goodness of fit of predicted to observed data, with weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Root mean square of the unweighted residuals, in the unit of the data.
    pub rms_residual: f64,
    /// Weighted coefficient of determination R²; `None` if all data are equal up to rounding.
    pub r_squared: Option<f64>,
    /// Weighted sum of squared residuals.
    pub chi_square: f64,
}

impl Quality {
    /// Computes the goodness of fit. Without `weights`, all weights are one.
    pub fn new(observed: &[f64], predicted: &[f64], weights: Option<&[f64]>) -> Self {
        let weight = |i: usize| weights.map_or(1.0, |weights| weights[i]);
        let indices = 0..observed.len();
        let total: f64 = indices.clone().map(weight).sum();
        let mean = indices.clone().map(|i| weight(i) * observed[i]).sum::<f64>() / total;
        let squared = |i: usize| (observed[i] - predicted[i]).powi(2);
        let chi_square: f64 = indices.clone().map(|i| weight(i) * squared(i)).sum();
        let scatter: f64 = indices.clone().map(|i| weight(i) * (observed[i] - mean).powi(2)).sum();
        let square: f64 = indices.clone().map(|i| weight(i) * observed[i].powi(2)).sum();
        let rounding = observed.len() as f64 * f64::EPSILON.powi(2) * square;
        let mean_square = indices.map(squared).sum::<f64>() / observed.len() as f64;
        Self {
            rms_residual: mean_square.sqrt(),
            r_squared: (scatter > rounding).then(|| 1.0 - chi_square / scatter),
            chi_square,
        }
    }
}

/// Goodness of a fit, with the numbers of used and unused data.
///
/// Each law documents the quantity to which the residuals refer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodnessOfFit {
    /// Root mean square of the residuals.
    pub rms_residual: f64,
    /// Coefficient of determination R², or `None` if all data are equal.
    pub r_squared: Option<f64>,
    /// Number of data in the fit.
    pub data: usize,
    /// Number of data in the window that the fit cannot use.
    pub masked: usize,
}

impl GoodnessOfFit {
    /// Creates the goodness of a fit that uses `data` of `all` data in its window.
    pub fn new(quality: &Quality, data: usize, all: usize) -> Self {
        Self {
            rms_residual: quality.rms_residual,
            r_squared: quality.r_squared,
            data,
            masked: all - data,
        }
    }
}

/// Minimum diagonal element of R at which columns count as linearly independent, for columns
/// normalised to unit length.
const RANK: f64 = 1e-9;

/// QR factorisation (Householder) of the design matrix of a weighted linear fit. The matrix has
/// full rank.
pub struct Design {
    orthogonal: DMatrix<f64>,
    triangle: DMatrix<f64>,
    /// Length of each column before normalisation.
    lengths: Vec<f64>,
}

impl Design {
    /// Factorises a design matrix, given by its columns. Each row must be divided by the standard
    /// error of its datum.
    ///
    /// Returns `None` if the columns are linearly dependent.
    pub fn new(mut columns: DMatrix<f64>) -> Option<Design> {
        let lengths: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
        if lengths.iter().any(|length| !(*length > 0.0 && length.is_finite())) {
            return None;
        }
        for (mut column, length) in columns.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let factors = columns.qr();
        let triangle = factors.r();
        let diagonal = triangle.diagonal();
        let is_full = diagonal.iter().all(|one| one.abs() > RANK);
        is_full.then(|| Design { orthogonal: factors.q(), triangle, lengths })
    }

    /// Returns the least-squares coefficients of the columns. Each element of `data` is a datum
    /// divided by the standard error of this datum.
    pub fn solve(&self, data: &DVector<f64>) -> DVector<f64> {
        let projected = self.orthogonal.tr_mul(data);
        let solved = self.triangle.solve_upper_triangular(&projected);
        let mut solution = solved.expect("the matrix has full rank");
        for (one, length) in solution.iter_mut().zip(&self.lengths) {
            *one /= length;
        }
        solution
    }

    /// Returns the part of a vector that is orthogonal to the columns of the design matrix.
    pub fn residual(&self, vector: &DVector<f64>) -> DVector<f64> {
        vector - &self.orthogonal * self.orthogonal.tr_mul(vector)
    }

    /// Returns the variance of the first coefficient of [`solve`](Self::solve) for independent data
    /// of unit variance.
    pub fn variance_of_first(&self) -> f64 {
        let count = self.triangle.ncols();
        let mut first = DVector::zeros(count);
        first[0] = 1.0;
        // The solution z of Rᵀ z = e₁ is the first row of R⁻¹.
        let solved = self.triangle.tr_solve_upper_triangular(&first);
        let row = solved.expect("the matrix has full rank");
        row.norm_squared() / self.lengths[0].powi(2)
    }
}

/// Fits a straight line by least squares of the ordinates, and returns its slope and intercept.
///
/// Returns `None` if all abscissae are equal.
pub fn line(abscissae: &[f64], ordinates: &[f64]) -> Option<(f64, f64)> {
    let count = abscissae.len() as f64;
    let (x_mean, y_mean) =
        (abscissae.iter().sum::<f64>() / count, ordinates.iter().sum::<f64>() / count);
    let spread: f64 = abscissae.iter().map(|x| (x - x_mean).powi(2)).sum();
    let shared: f64 =
        abscissae.iter().zip(ordinates).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    let slope = shared / spread;
    (spread > 0.0 && slope.is_finite()).then_some((slope, y_mean - slope * x_mean))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Data (x, y) for the model y = exp(−p x) + q with the parameters p and q.
    struct Decay(Vec<(f64, f64)>);

    impl Residuals<2> for Decay {
        fn count(&self) -> usize {
            self.0.len()
        }

        fn residuals(&self, [rate, offset]: [f64; 2], into: &mut [f64]) {
            for (residual, (x, y)) in into.iter_mut().zip(&self.0) {
                *residual = (-rate * x).exp() + offset - y;
            }
        }

        fn gradients(&self, [rate, _]: [f64; 2], into: &mut [[f64; 2]]) {
            for (gradient, (x, _)) in into.iter_mut().zip(&self.0) {
                *gradient = [-x * (-rate * x).exp(), 1.0];
            }
        }
    }

    #[test]
    fn minimum_of_exact_data_is_the_truth() {
        let point = |i: u32| (0.1 * f64::from(i), (-0.17 * f64::from(i)).exp() + 0.3);
        let found = minimize(&Decay((0..20).map(point).collect()), [1.0, 0.0]);
        assert!(found.converged);
        assert!((found.parameters[0] - 1.7).abs() < 1e-10);
        assert!((found.parameters[1] - 0.3).abs() < 1e-10);
    }

    #[test]
    fn data_that_are_not_numbers_do_not_converge() {
        assert!(!minimize(&Decay(vec![(f64::NAN, 1.0); 3]), [1.0, 0.0]).converged);
    }

    #[test]
    fn line_minimizes_the_squared_ordinates() {
        let (slope, intercept) = line(&[0.0, 1.0, 2.0], &[1.0, 0.0, 2.0]).expect("a spread");
        assert!((slope - 0.5).abs() < 1e-15 && (intercept - 0.5).abs() < 1e-15);
        assert_eq!(line(&[1.0, 1.0], &[0.0, 1.0]), None);
    }

    #[test]
    fn r_squared_is_zero_for_the_mean_and_one_for_the_data() {
        let observed = [1.0, 2.0, 6.0];
        let weights = [1.0, 2.0, 1.0];
        let mean = [2.75; 3];
        let none = Quality::new(&observed, &mean, Some(&weights)).r_squared;
        assert!(none.expect("data that differ").abs() < 1e-15);
        assert_eq!(Quality::new(&observed, &observed, None).r_squared, Some(1.0));
        let off = Quality::new(&observed, &[0.0, 3.0, 5.0], Some(&weights));
        assert_eq!((off.rms_residual, off.chi_square), (1.0, 4.0));
    }

    #[test]
    fn data_that_are_equal_to_rounding_have_no_scatter_to_be_explained() {
        let nearly = [0.1, 0.1 + f64::EPSILON / 8.0, 0.1];
        for observed in [[0.1; 3], nearly, [0.0; 3]] {
            assert_eq!(Quality::new(&observed, &[0.3; 3], None).r_squared, None);
        }
    }

    #[test]
    fn a_line_through_three_points_has_the_textbook_intercept_and_variance() {
        let columns = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
        let design = Design::new(columns).unwrap();
        let solution = design.solve(&DVector::from_row_slice(&[1.0, 0.0, 2.0]));
        assert!((solution[0] - 0.5).abs() < 1e-14 && (solution[1] - 0.5).abs() < 1e-14);
        // The variance of the intercept is Σx²/(n Σ(x − x̄)²) = 5/6.
        assert!((design.variance_of_first() - 5.0 / 6.0).abs() < 1e-14);
    }

    #[test]
    fn columns_that_depend_on_each_other_are_no_design() {
        assert!(
            Design::new(DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 1.0, 2.0, 1.0, 2.0])).is_none()
        );
        assert!(Design::new(DMatrix::from_row_slice(2, 1, &[0.0, 0.0])).is_none());
    }
}
