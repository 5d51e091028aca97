//! Fit of free exponents by variable projection (Golub & Pereyra 1973; Kaufman 1975).
//!
//! For given exponents, the limit and the coefficients follow from linear least squares. Only the
//! logarithms of the exponents are nonlinear parameters.

use std::cell::RefCell;

use nalgebra::{DMatrix, DVector};

use super::{EXPONENTS, LimitFit, LimitProblem, TermForm};
use crate::FitError;
use crate::least_squares::{Design, Residuals, minimize};

/// Initial values of the free exponents. With a single start, the iteration may end in a local
/// minimum.
const STARTS: [f64; 3] = [1.0, 0.4, 2.5];

/// Fits a law with `free` parameters to the points selected by `used`. More than `free` points must
/// be selected. The mean of point i is `means[i]`.
pub fn fit(
    problem: &LimitProblem,
    forms: &[TermForm],
    means: &[f64],
    used: &[bool],
    start: Option<&LimitFit>,
    free: usize,
) -> Result<LimitFit, FitError> {
    let rows: Vec<usize> = (0..used.len()).filter(|&i| used[i]).collect();
    let data = rows.iter().map(|&i| means[i] * problem.scales[i]);
    let projection = VariableProjection {
        problem,
        forms,
        data: DVector::from_iterator(rows.len(), data),
        rows: &rows,
        terms: (0..forms.len()).filter(|&term| forms[term] == TermForm::FreePower).collect(),
        last: RefCell::new(None),
    };
    let exponents = match projection.terms.len() {
        0 => Ok(Vec::new()),
        1 => projection.minimum::<1>(start),
        2 => projection.minimum::<2>(start),
        3 => projection.minimum::<3>(start),
        _ => projection.minimum::<4>(start),
    }?;
    projection.outcome(&exponents, free)
}

struct VariableProjection<'a> {
    problem: &'a LimitProblem,
    forms: &'a [TermForm],
    /// Mean of the observable at each used point, divided by its standard error.
    data: DVector<f64>,
    /// Indices of the used points.
    rows: &'a [usize],
    /// Indices of the terms with a free exponent.
    terms: Vec<usize>,
    /// Last free exponents and their linear solution, which residuals and derivatives share.
    last: RefCell<Option<(Vec<f64>, Solved)>>,
}

/// Linear least-squares solution for given free exponents.
struct Solved {
    columns: DMatrix<f64>,
    design: Design,
    solution: DVector<f64>,
}

impl VariableProjection<'_> {
    /// Returns the free exponents that minimise χ². The iteration starts from the exponents of
    /// `start` if it is given, otherwise from each of [`STARTS`].
    fn minimum<const P: usize>(&self, start: Option<&LimitFit>) -> Result<Vec<f64>, FitError> {
        let known = start.map(|fit| {
            let of_term = |&term: &usize| fit.exponents[term].unwrap_or(1.0);
            let logarithms: Vec<f64> = self.terms.iter().map(of_term).map(libm::log).collect();
            std::array::from_fn(|i| logarithms.get(i).copied().unwrap_or(0.0))
        });
        let starts = match known {
            Some(known) => vec![known],
            None => STARTS.map(|exponent| [libm::log(exponent); P]).to_vec(),
        };
        let mut best: Option<([f64; P], f64)> = None;
        let mut diverged = None;
        for start in starts {
            let found = minimize(self, start);
            let exponents = found.parameters.map(libm::exp);
            let chi_square = match self.solved(&exponents) {
                Some(solved) if found.converged => self.residual(&solved).norm_squared(),
                _ => {
                    diverged = diverged.or(Self::outside(&exponents));
                    continue;
                }
            };
            if best.is_none_or(|(_, least)| chi_square < least) {
                best = Some((found.parameters, chi_square));
            }
        }
        let (logarithms, _) = best.ok_or(diverged.unwrap_or(FitError::NotConverged))?;
        Ok(logarithms.iter().copied().map(libm::exp).collect())
    }

    fn outcome(&self, exponents: &[f64], free: usize) -> Result<LimitFit, FitError> {
        if let Some(error) = Self::outside(exponents) {
            return Err(error);
        }
        let solved = self.solved(exponents).ok_or(FitError::DependentTerms)?;
        let chi_square = self.residual(&solved).norm_squared();
        let all = (0..self.forms.len()).map(|term| self.exponent(term, exponents));
        Ok(LimitFit {
            limit: solved.solution[0],
            coefficients: solved.solution.iter().skip(1).copied().collect(),
            exponents: all.collect(),
            chi_square,
            free,
        })
    }

    /// Returns an error if a free exponent is outside the range [`EXPONENTS`], otherwise `None`.
    fn outside(exponents: &[f64]) -> Option<FitError> {
        let [least, most] = EXPONENTS;
        let is_outside = exponents.iter().any(|one| *one < least || *one > most);
        is_outside.then_some(FitError::NoExponent)
    }

    /// Returns the exponent of a term for given free exponents, or `None` for a logarithm.
    fn exponent(&self, term: usize, free: &[f64]) -> Option<f64> {
        match self.forms[term] {
            TermForm::Power(exponent) => Some(exponent),
            TermForm::Logarithm => None,
            TermForm::FreePower => {
                let index = self.terms.iter().position(|&other| other == term)?;
                free.get(index).copied()
            }
        }
    }

    fn solved(&self, exponents: &[f64]) -> Option<Solved> {
        let columns = self.columns(exponents);
        let design = Design::new(columns.clone())?;
        let solution = design.solve(&self.data);
        Some(Solved { columns, design, solution })
    }

    fn columns(&self, exponents: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows.len(), 1 + self.forms.len(), |row, column| {
            let point = self.rows[row];
            let scale = self.problem.scales[point];
            if column == 0 {
                return scale;
            }
            let small = self.problem.points[point].small[column - 1];
            scale
                * match self.exponent(column - 1, exponents) {
                    Some(exponent) => libm::pow(small, exponent),
                    None => libm::log(small),
                }
        })
    }

    fn residual(&self, solved: &Solved) -> DVector<f64> {
        &solved.columns * &solved.solution - &self.data
    }

    /// Calls `work` with the linear solution for the given free exponents, and caches this
    /// solution.
    ///
    /// Returns `None` if the terms are linearly dependent.
    fn with<T>(&self, exponents: Vec<f64>, work: impl FnOnce(&Solved) -> T) -> Option<T> {
        let mut last = self.last.borrow_mut();
        if last.as_ref().is_none_or(|(known, _)| *known != exponents) {
            *last = self.solved(&exponents).map(|solved| (exponents, solved));
        }
        last.as_ref().map(|(_, solved)| work(solved))
    }
}

impl<const P: usize> Residuals<P> for VariableProjection<'_> {
    fn count(&self) -> usize {
        self.rows.len()
    }

    fn residuals(&self, logarithms: [f64; P], into: &mut [f64]) {
        let exponents = logarithms.map(libm::exp).to_vec();
        let residual = self.with(exponents, |solved| self.residual(solved));
        match residual {
            Some(residual) => into.copy_from_slice(residual.as_slice()),
            // The iteration reduces its step after residuals that are not finite.
            None => into.fill(f64::NAN),
        }
    }

    fn gradients(&self, logarithms: [f64; P], into: &mut [[f64; P]]) {
        let exponents = logarithms.map(libm::exp).to_vec();
        let known = self.with(exponents.clone(), |solved| {
            for (index, &term) in self.terms.iter().enumerate() {
                // The derivative is ∂(c xᵉ)/∂ ln e = c e xᵉ ln x.
                let factor = solved.solution[1 + term] * exponents[index];
                let column = solved.columns.column(1 + term);
                let logarithm =
                    |row: usize| libm::log(self.problem.points[self.rows[row]].small[term]);
                let change =
                    DVector::from_fn(column.len(), |row, _| factor * column[row] * logarithm(row));
                let change = solved.design.residual(&change);
                for (gradient, one) in into.iter_mut().zip(change.iter()) {
                    gradient[index] = *one;
                }
            }
        });
        if known.is_none() {
            into.fill([f64::NAN; P]);
        }
    }
}
