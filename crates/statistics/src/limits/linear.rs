//! Weighted linear least squares of a few columns, by Householder's orthogonalization.

use nalgebra::{DMatrix, DVector};

/// Of the largest diagonal element of R: a smaller one is the rounding of a column that depends on
/// those before.
const RANK: f64 = 1e-9;

/// A design that tells its columns apart.
pub struct Design {
    orthogonal: DMatrix<f64>,
    triangle: DMatrix<f64>,
    /// The lengths of the columns, divided out before.
    lengths: Vec<f64>,
}

impl Design {
    /// Of rows that are already divided by their standard errors; `None` where a column depends on
    /// the others.
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

    /// The coefficients of the columns that come closest to the data.
    pub fn solve(&self, data: &DVector<f64>) -> DVector<f64> {
        let projected = self.orthogonal.tr_mul(data);
        let solved = self.triangle.solve_upper_triangular(&projected);
        let mut solution = solved.expect("the diagonal was looked at");
        for (one, length) in solution.iter_mut().zip(&self.lengths) {
            *one /= length;
        }
        solution
    }

    /// What is left of a vector by the space of the columns.
    pub fn residual(&self, vector: &DVector<f64>) -> DVector<f64> {
        vector - &self.orthogonal * self.orthogonal.tr_mul(vector)
    }

    /// Variance of the first coefficient where the data have variance one and are independent.
    pub fn variance_of_first(&self) -> f64 {
        let count = self.triangle.ncols();
        let mut first = DVector::zeros(count);
        first[0] = 1.0;
        // First row of R⁻¹, as Rᵀ z = e₁.
        let solved = self.triangle.tr_solve_upper_triangular(&first);
        let row = solved.expect("the diagonal was looked at");
        row.norm_squared() / self.lengths[0].powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_three_points_has_the_textbook_intercept_and_variance() {
        let columns = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
        let design = Design::new(columns).unwrap();
        let solution = design.solve(&DVector::from_row_slice(&[1.0, 0.0, 2.0]));
        assert!((solution[0] - 0.5).abs() < 1e-14 && (solution[1] - 0.5).abs() < 1e-14);
        // Σx²/(n Σ(x − x̄)²) = 5/6.
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
