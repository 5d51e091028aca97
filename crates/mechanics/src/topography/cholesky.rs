//! Solution of small symmetric equations.

/// Cholesky factor of a symmetric matrix. Rows that depend on the rows before them are left out, so
/// that their unknowns are zero.
pub(super) struct Cholesky {
    factor: Vec<f64>,
    count: usize,
}

impl Cholesky {
    /// Factorises a matrix of `count` rows, of which only the lower triangle is read.
    ///
    /// A row depends on the rows before it if the rest of its diagonal element is at most the
    /// fraction `independent` of the element.
    pub fn new(mut matrix: Vec<f64>, count: usize, independent: f64) -> Self {
        for i in 0..count {
            for j in 0..=i {
                let products: f64 =
                    (0..j).map(|k| matrix[i * count + k] * matrix[j * count + k]).sum();
                let (element, diagonal) = (matrix[i * count + j], matrix[j * count + j]);
                let rest = element - products;
                matrix[i * count + j] = if i > j && diagonal > 0.0 {
                    rest / diagonal
                } else if i == j && rest > independent * element {
                    rest.sqrt()
                } else {
                    0.0
                };
            }
            if matrix[i * count + i] == 0.0 {
                matrix[i * count..=i * count + i].fill(0.0);
            }
        }
        Self { factor: matrix, count }
    }

    /// Returns whether no row depends on others.
    pub fn is_definite(&self) -> bool {
        (0..self.count).all(|i| self.at(i, i) > 0.0)
    }

    /// Replaces the right side by the solution.
    pub fn solve(&self, right: &mut [f64]) {
        for i in 0..self.count {
            let known: f64 = (0..i).map(|k| self.at(i, k) * right[k]).sum();
            right[i] = self.divided(right[i] - known, i);
        }
        for i in (0..self.count).rev() {
            let known: f64 = (i + 1..self.count).map(|k| self.at(k, i) * right[k]).sum();
            right[i] = self.divided(right[i] - known, i);
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.factor[i * self.count + j]
    }

    fn divided(&self, value: f64, i: usize) -> f64 {
        if self.at(i, i) > 0.0 { value / self.at(i, i) } else { 0.0 }
    }
}
