//! How well a law with nothing free but its own parameters fits its data.

use super::least_squares::Quality;

/// What a fit leaves, and what it left out. Of which quantity residuals are, each law says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodnessOfFit {
    /// Root mean square residual.
    pub rms_residual: f64,
    /// Coefficient of determination; `None` where the data do not differ.
    pub r_squared: Option<f64>,
    /// Number of data.
    pub data: usize,
    /// Data in the window that could not be used.
    pub masked: usize,
}

impl GoodnessOfFit {
    /// Of so many of `all` data that could be used.
    pub fn of(quality: &Quality, data: usize, all: usize) -> Self {
        Self {
            rms_residual: quality.rms_residual,
            r_squared: quality.r_squared,
            data,
            masked: all - data,
        }
    }
}
