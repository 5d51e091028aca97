//! Reduced units of a surface, in which contacts are solved.
//!
//! The contact depends only on the reduced load p₀/(E* h′), with the mean pressure p₀, the
//! effective modulus E* and the rms slope h′. Solvers therefore count
//!
//! - heights and gaps in units of h′ L, where L is the longer side of the map;
//! - pressures, loads and hardness in units of E* h′;
//! - energies per area in units of E* h′² L.
//!
//! [`ReducedHeights`] are the only heights that a solver accepts, and [`Units`] convert all other
//! quantities.

use thiserror::Error;

use crate::grid::{Cell, Grid};
use crate::topography::surface::{Surface, SurfaceError};

/// Number of significant digits to which computed pressures are rounded.
const DIGITS: usize = 12;

/// Heights in units of h′ L, one finite height for each node of a grid, positive towards the
/// elastic body.
///
/// ```
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::reduced::{ReducedHeights, Units};
/// use asperity_mechanics::topography::moments::Moments;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // A wave of 10 nm on 2 µm.
/// let wave = Shape::Wave { amplitude: 1e-8, waves: 1 }.draw(Grid::square(16, 2e-6)?);
/// let units = Units::new(wave.grid().cell(), Moments::from_surface(&wave).rms_slope(), 1e11)?;
/// let heights = units.reduced_heights(wave)?;
/// assert!((heights.as_slice()[0] * units.length() - 1e-8).abs() < 1e-20);
/// assert!(ReducedHeights::reduced(heights.grid(), vec![0.0; 3]).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedHeights(Surface);

impl ReducedHeights {
    /// Accepts heights that are in units of h′ L already, row-major.
    ///
    /// # Errors
    /// Fails if the number of heights is not the number of nodes, or if a height is not finite.
    pub fn reduced(grid: Grid, heights: Vec<f64>) -> Result<Self, SurfaceError> {
        Surface::new(grid, heights).map(Self)
    }

    /// Returns the grid of the heights. Its sides may have any unit.
    pub fn grid(&self) -> Grid {
        self.0.grid()
    }

    /// Returns the heights in row-major order.
    pub fn as_slice(&self) -> &[f64] {
        self.0.heights()
    }

    /// Returns the heights minus a depth at each node.
    ///
    /// # Errors
    /// Fails if the number of depths is not the number of nodes, or if a depth is not finite.
    pub fn lowered(self, depths: &[f64]) -> Result<Self, SurfaceError> {
        let (grid, mut heights) = (self.grid(), self.0.into_heights());
        if depths.len() != heights.len() {
            return Err(SurfaceError::Count { found: depths.len(), nodes: grid.nodes() });
        }
        heights.iter_mut().zip(depths).for_each(|(height, depth)| *height -= depth);
        Self::reduced(grid, heights)
    }
}

/// Units of length and of pressure of the solvers for one surface, h′ L and E* h′.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    side: f64,
    slope: f64,
    pressure: f64,
}

/// Reason why a surface and a modulus have no reduced units.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum UnitsError {
    /// The rms slope is negative, infinite or not a number.
    #[error("the rms slope of the surface is {0}; it must be finite and at least zero")]
    Slope(f64),
    /// The effective modulus is not a positive, finite number.
    #[error("the effective modulus is {0}; it must be positive and finite")]
    Modulus(f64),
}

impl Units {
    /// Creates the units of a surface from its cell, its rms slope h′ and the effective modulus E*.
    ///
    /// A slope of zero counts as 1: a flat surface has no slope, and its contact does not depend on
    /// the unit.
    ///
    /// # Errors
    /// Fails if the slope is not finite or negative, or if the modulus is not positive and finite.
    pub fn new(cell: Cell, rms_slope: f64, effective_modulus: f64) -> Result<Self, UnitsError> {
        if !(rms_slope >= 0.0 && rms_slope.is_finite()) {
            return Err(UnitsError::Slope(rms_slope));
        }
        if !(effective_modulus > 0.0 && effective_modulus.is_finite()) {
            return Err(UnitsError::Modulus(effective_modulus));
        }
        let slope = if rms_slope > 0.0 { rms_slope } else { 1.0 };
        Ok(Self { side: cell.longer_side(), slope, pressure: effective_modulus * slope })
    }

    /// Returns the unit of length, h′ L.
    pub fn length(&self) -> f64 {
        self.side * self.slope
    }

    /// Returns the unit of pressure, E* h′.
    pub fn pressure(&self) -> f64 {
        self.pressure
    }

    /// Divides the heights of a surface by the unit of length.
    ///
    /// # Errors
    /// Fails if a height overflows.
    pub fn reduced_heights(&self, surface: Surface) -> Result<ReducedHeights, SurfaceError> {
        let (unit, grid) = (self.length(), surface.grid());
        let mut heights = surface.into_heights();
        heights.iter_mut().for_each(|height| *height /= unit);
        ReducedHeights::reduced(grid, heights)
    }

    /// Converts a pressure to units of E* h′, rounded to twelve digits so that loads that are given
    /// in either unit are equal.
    pub fn reduced_pressure(&self, pressure: f64) -> f64 {
        nearest(pressure / self.pressure)
    }

    /// Converts a load in units of E* h′ to a mean pressure, rounded to twelve digits.
    pub fn mean_pressure(&self, load: f64) -> f64 {
        nearest(load * self.pressure)
    }
}

/// Rounds a number to twelve significant digits, as manifests round theirs.
pub fn nearest(value: f64) -> f64 {
    let written = format!("{value:.*e}", DIGITS - 1);
    written.parse::<f64>().map_or(value, |value| value + 0.0)
}

#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    pub fn on(grid: Grid, heights: &[f64]) -> ReducedHeights {
        ReducedHeights::reduced(grid, heights.to_vec()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{cell, square};

    #[test]
    fn heights_that_are_too_few_or_not_finite_are_errors() {
        let grid = square(2, 1.0);
        let count = |found| Err(SurfaceError::Count { found, nodes: [2, 2] });
        assert_eq!(ReducedHeights::reduced(grid, vec![0.0; 3]), count(3));
        assert!(ReducedHeights::reduced(grid, vec![f64::NAN; 4]).is_err());
        let heights = ReducedHeights::reduced(grid, vec![1.0; 4]).unwrap();
        assert_eq!(heights.clone().lowered(&[0.0; 5]), count(5));
        assert_eq!(heights.lowered(&[0.25; 4]).unwrap().as_slice(), [0.75; 4]);
    }

    #[test]
    fn slopes_and_moduli_without_units_are_errors() {
        for slope in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(Units::new(cell(1.0), slope, 1.0), Err(UnitsError::Slope(_))));
        }
        for modulus in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Units::new(cell(1.0), 0.1, modulus);
            assert!(matches!(error, Err(UnitsError::Modulus(_))));
        }
        assert_eq!(Units::new(cell(2.0), 0.0, 3.0).unwrap().length(), 2.0);
    }

    #[test]
    fn loads_in_either_unit_are_equal() {
        let units = Units::new(cell(1.0), 0.1, 3.0).unwrap();
        assert_eq!(units.reduced_pressure(units.mean_pressure(0.07)), 0.07);
        assert_ne!(0.1 * 3.0, 0.3);
        assert_eq!(units.mean_pressure(1.0), 0.3);
    }
}
