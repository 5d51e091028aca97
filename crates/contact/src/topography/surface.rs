//! Heights on the nodes of a grid.

use thiserror::Error;

use crate::grid::{Grid, GridError};

/// Heights of a surface on the nodes of a grid, peaks up.
///
/// Holding one means: as many finite heights as nodes.
///
/// ```
/// use asperity_contact::grid::{Cell, Grid};
/// use asperity_contact::topography::surface::{Surface, SurfaceError};
///
/// let grid = Grid::new([2, 3], Cell::new([0.2, 0.3])?)?;
/// let surface = Surface::new(grid, vec![0.0, 0.1, 0.2, 1.0, 1.1, 1.2])?;
/// // Node (1, 2) is the last one of the second row, at x = 0.1, y = 0.2.
/// assert_eq!(surface.heights()[5], 1.2);
/// let missing = Surface::new(grid, vec![0.0; 5]);
/// assert_eq!(missing, Err(SurfaceError::Count { found: 5, nodes: [2, 3] }));
/// # Ok::<(), SurfaceError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    grid: Grid,
    heights: Vec<f64>,
}

/// Why heights do not make a surface.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum SurfaceError {
    #[error("{found} heights do not fill a mesh of {} × {} nodes", nodes[0], nodes[1])]
    Count { found: usize, nodes: [usize; 2] },
    #[error(transparent)]
    Grid(#[from] GridError),
    #[error("height at row {row}, column {column} is {height}, every height must be finite")]
    NotFinite { row: usize, column: usize, height: f64 },
    #[error(
        "height at row {row}, column {column} is {height:e}, more than {HIGHEST:e}: squares and sums of such \
         heights are no numbers"
    )]
    TooHigh { row: usize, column: usize, height: f64 },
}

/// How far from zero heights may be that somebody gives: what is made of them then stays finite.
pub const HIGHEST: f64 = 1e100;

/// Looks at heights that somebody gives; what is not finite is not looked at.
///
/// # Errors
/// When one is beyond [`HIGHEST`].
pub fn check_range(grid: Grid, heights: &[f64]) -> Result<(), SurfaceError> {
    let beyond = |height: &f64| height.is_finite() && height.abs() > HIGHEST;
    let Some(index) = heights.iter().position(beyond) else {
        return Ok(());
    };
    let [row, column] = grid.place(index);
    Err(SurfaceError::TooHigh { row, column, height: heights[index] })
}

impl Surface {
    /// The surface with one height for each node, row-major, in the unit of the grid's lengths.
    ///
    /// # Errors
    /// When there are more or fewer heights than nodes, or one is not finite.
    pub fn new(grid: Grid, heights: Vec<f64>) -> Result<Self, SurfaceError> {
        if grid.count() != heights.len() {
            return Err(SurfaceError::Count { found: heights.len(), nodes: grid.nodes() });
        }
        if let Some(index) = heights.iter().position(|height| !height.is_finite()) {
            let [row, column] = grid.place(index);
            return Err(SurfaceError::NotFinite { row, column, height: heights[index] });
        }
        Ok(Self { grid, heights })
    }

    /// Where the heights are.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Heights, row-major.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// The surface with its heights multiplied by a factor.
    ///
    /// # Errors
    /// When a height leaves the range of floating-point numbers.
    pub fn scaled(mut self, factor: f64) -> Result<Self, SurfaceError> {
        self.heights.iter_mut().for_each(|height| *height *= factor);
        Self::new(self.grid, self.heights)
    }

    /// The heights, given away.
    pub fn into_heights(self) -> Vec<f64> {
        self.heights
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::rectangle;

    #[test]
    fn heights_that_are_no_surface_are_refused() {
        let grid = rectangle([2, 3], [1.0, 1.0]);
        let few = Surface::new(grid, vec![0.0; 3]).unwrap_err();
        assert_eq!(few.to_string(), "3 heights do not fill a mesh of 2 × 3 nodes");
        let heights = vec![0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0];
        assert_eq!(
            Surface::new(grid, heights).unwrap_err().to_string(),
            "height at row 1, column 1 is NaN, every height must be finite"
        );
        let error = check_range(grid, &[0.0, 1e308, f64::INFINITY]).unwrap_err().to_string();
        assert!(error.contains("1e308, more than 1e100"), "{error}");
    }
}
