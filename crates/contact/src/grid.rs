//! Rectangular meshes.

use asperity_mechanics::grid as mechanics;
use asperity_mechanics::topography::surface::HIGHEST;
use thiserror::Error;

use crate::Length;

/// Evenly spaced nodes of a rectangle, N_x × N_y on the sides L_x × L_y.
///
/// Maps are row-major: node (i, j) is element i·N_y + j, at x = i L_x/N_x, y = j L_y/N_y.
///
/// ```
/// use asperity_contact::{Grid, Length};
///
/// let grid = Grid::new([128, 256], [Length::micrometres(50.0), Length::micrometres(100.0)])?;
/// assert_eq!(grid.spacing()[0], grid.spacing()[1]);
/// assert!(Grid::square(0, Length::micrometres(1.0)).is_err());
/// assert!(Grid::square(64, Length::micrometres(-1.0)).is_err());
/// # Ok::<(), asperity_contact::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid(mechanics::Grid);

/// Largest number of nodes of a grid, 16384 × 16384.
const MOST_NODES: usize = 1 << 28;

/// Reason why a grid cannot be created.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum GridError {
    /// A side has no nodes, or there are more than 16384 × 16384 nodes.
    #[error("a grid of {} × {} nodes; give at least 1 and at most 2²⁸ nodes", nodes[0], nodes[1])]
    #[non_exhaustive]
    Nodes {
        /// Numbers of nodes along x and y.
        nodes: [usize; 2],
    },
    /// A side is not positive and finite, or beyond all surfaces.
    #[error("a side of {side}; it must be positive, between 1e-100 m and 1e100 m")]
    #[non_exhaustive]
    Side {
        /// The side.
        side: Length,
    },
}

impl Grid {
    /// Creates a grid from its numbers of nodes and its sides along x and y.
    ///
    /// # Errors
    /// Fails if a side is not positive and finite, or if there is no node or too many.
    pub fn new(nodes: [usize; 2], sides: [Length; 2]) -> Result<Self, GridError> {
        let count = nodes[0].checked_mul(nodes[1]);
        if !count.is_some_and(|count| (1..=MOST_NODES).contains(&count)) {
            return Err(GridError::Nodes { nodes });
        }
        // Squares of these sides are finite.
        let is_side = |side: &Length| (1.0 / HIGHEST..=HIGHEST).contains(&side.in_metres());
        if let Some(&side) = sides.iter().find(|side| !is_side(side)) {
            return Err(GridError::Side { side });
        }
        let cell = mechanics::Cell::new(sides.map(Length::in_metres));
        let grid = cell.and_then(|cell| mechanics::Grid::new(nodes, cell));
        grid.map(Self).map_err(|_| GridError::Nodes { nodes })
    }

    /// Creates a grid of `nodes` × `nodes` nodes on a square.
    ///
    /// # Errors
    /// Fails as [`Grid::new`].
    pub fn square(nodes: usize, side: Length) -> Result<Self, GridError> {
        Self::new([nodes; 2], [side; 2])
    }

    /// Returns the numbers of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.0.nodes()
    }

    /// Returns the sides along x and y.
    pub fn sides(&self) -> [Length; 2] {
        self.0.cell().size().map(Length::metres)
    }

    /// Returns the distances between neighbouring nodes along x and y.
    pub fn spacing(&self) -> [Length; 2] {
        self.0.spacing().map(Length::metres)
    }

    pub(crate) fn of(grid: mechanics::Grid) -> Self {
        Self(grid)
    }

    pub(crate) fn inner(&self) -> mechanics::Grid {
        self.0
    }
}
