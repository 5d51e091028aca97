//! Rectangular cells, the nodes of maps, and the boundary condition.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Boundary condition at the edges of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// The surface is periodic along x and y.
    #[default]
    Periodic,
    /// The map is an isolated patch on a half-space. The pressure outside the edges is zero,
    /// displacements are relative to points far away, and contact and clusters end at the edges.
    Free,
}

impl Boundary {
    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Boundary::Periodic => "periodic",
            Boundary::Free => "free",
        }
    }

    /// Returns `true` if the map is periodic.
    pub fn is_periodic(&self) -> bool {
        *self == Boundary::Periodic
    }

    pub(crate) fn of(is_periodic: bool) -> Self {
        if is_periodic { Boundary::Periodic } else { Boundary::Free }
    }
}

/// Rectangle with the sides L_x × L_y, in any unit of length.
///
/// Wavenumbers k count waves along the longer side L, so that q = 2πk/L. Reduced lengths are
/// multiples of L.
///
/// Both sides are positive and finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    size: [f64; 2],
}

/// Evenly spaced nodes of a [`Cell`], N_x × N_y.
///
/// Maps are row-major: node (i, j) is element i·N_y + j, at x = iΔx, y = jΔy.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
///
/// let grid = Grid::new([192, 320], Cell::new([0.6, 1.0])?)?;
/// assert_eq!(grid.count(), 192 * 320);
/// assert_eq!(grid.spacing(), [0.6 / 192.0, 1.0 / 320.0]);
/// // Three waves along the shorter side are as long as five along the longer one.
/// assert!((grid.cell().wavenumber([3.0, 0.0]) - 5.0).abs() < 1e-15);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
///
/// A grid has at least one node, and N_x N_y does not overflow `usize`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    nodes: [usize; 2],
    cell: Cell,
}

/// Reason why a grid or a cell cannot be created.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum GridError {
    #[error("a grid without nodes; give at least one node along each axis")]
    Empty,
    #[error("a grid of {} × {} nodes is too large; use fewer nodes", nodes[0], nodes[1])]
    TooMany { nodes: [usize; 2] },
    #[error("a side of the cell is {side}; it must be positive and finite")]
    Side { side: f64 },
}

impl Cell {
    /// Creates a cell from its sides along x and y.
    ///
    /// # Errors
    /// Fails if a side is not positive and finite.
    pub fn new(size: [f64; 2]) -> Result<Self, GridError> {
        match size.into_iter().find(|side| !is_length(*side)) {
            Some(side) => Err(GridError::Side { side }),
            None => Ok(Self { size }),
        }
    }

    /// Creates a square cell from its side.
    ///
    /// # Errors
    /// Fails if the side is not positive and finite.
    pub fn square(side: f64) -> Result<Self, GridError> {
        Self::new([side; 2])
    }

    /// Returns the sides along x and y.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// Returns the longer side L.
    #[inline]
    pub fn longer_side(&self) -> f64 {
        self.size[0].max(self.size[1])
    }

    /// Returns the area L_x L_y.
    pub fn area(&self) -> f64 {
        self.size[0] * self.size[1]
    }

    /// Converts the numbers of waves along x and y to the wavevector (k_x, k_y) = (`waves[0]`
    /// L/L_x, `waves[1]` L/L_y).
    #[inline]
    pub fn wavevector(&self, waves: [f64; 2]) -> [f64; 2] {
        let [aspect_x, aspect_y] = self.aspect();
        [waves[0] * aspect_x, waves[1] * aspect_y]
    }

    /// Converts the numbers of waves along x and y to the wavenumber k = (k_x² + k_y²)^½ of
    /// [`wavevector`](Self::wavevector).
    #[inline]
    pub fn wavenumber(&self, waves: [f64; 2]) -> f64 {
        let [k_x, k_y] = self.wavevector(waves);
        (k_x * k_x + k_y * k_y).sqrt()
    }

    /// Returns [L/L_x, L/L_y], with the longer side L.
    ///
    /// Both are exactly one on a square, so that its wavevectors have integer components.
    #[inline]
    pub fn aspect(&self) -> [f64; 2] {
        self.size.map(|side| self.longer_side() / side)
    }
}

fn is_length(side: f64) -> bool {
    side > 0.0 && side.is_finite()
}

impl Grid {
    /// Creates a grid of N_x × N_y nodes on a cell.
    ///
    /// # Errors
    /// Fails if there is no node or if N_x N_y overflows.
    pub fn new(nodes: [usize; 2], cell: Cell) -> Result<Self, GridError> {
        match nodes[0].checked_mul(nodes[1]) {
            Some(0) => Err(GridError::Empty),
            None => Err(GridError::TooMany { nodes }),
            Some(_) => Ok(Self { nodes, cell }),
        }
    }

    /// Creates a grid of `nodes` × `nodes` nodes on a square cell.
    ///
    /// # Errors
    ///
    /// Fails for the reasons for which [`Grid::new`] and [`Cell::new`] fail.
    pub fn square(nodes: usize, side: f64) -> Result<Self, GridError> {
        Self::new([nodes; 2], Cell::square(side)?)
    }

    /// Returns the numbers of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Returns the cell of the grid.
    pub fn cell(&self) -> Cell {
        self.cell
    }

    /// Returns the total number of nodes, N_x N_y.
    pub fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Returns the grid of every second node along both axes, starting with the first node.
    ///
    /// Returns `None` if N_x or N_y is odd.
    pub fn coarsened(&self) -> Option<Self> {
        let is_even = self.nodes.iter().all(|nodes| nodes.is_multiple_of(2));
        is_even.then(|| Self { nodes: self.nodes.map(|nodes| nodes / 2), ..*self })
    }

    /// Returns the distances Δx and Δy between neighbouring nodes.
    pub fn spacing(&self) -> [f64; 2] {
        let [size_x, size_y] = self.cell.size;
        [size_x / self.nodes[0] as f64, size_y / self.nodes[1] as f64]
    }

    /// Returns L/min(Δx, Δy), the number of nodes per longer side at the smaller spacing.
    pub fn smaller_steps(&self) -> f64 {
        let [aspect_x, aspect_y] = self.cell.aspect();
        let along_x = self.nodes[0] as f64 * aspect_x;
        along_x.max(self.nodes[1] as f64 * aspect_y)
    }

    /// Returns L/max(Δx, Δy), the number of nodes per longer side at the larger spacing.
    pub fn larger_steps(&self) -> f64 {
        let [aspect_x, aspect_y] = self.cell.aspect();
        let along_x = self.nodes[0] as f64 * aspect_x;
        along_x.min(self.nodes[1] as f64 * aspect_y)
    }

    /// Returns `true` if Δx = Δy up to rounding.
    pub fn has_square_cells(&self) -> bool {
        self.smaller_steps() - self.larger_steps() <= 1e-9 * self.smaller_steps()
    }

    /// Returns the indices (i, j) along x and y of the node with index `node` in a map.
    #[inline]
    pub fn indices(&self, node: usize) -> [usize; 2] {
        [node / self.nodes[1], node % self.nodes[1]]
    }

    /// Returns the node `steps` from a node, or `None` beyond a free boundary.
    pub fn moved(&self, node: usize, steps: [isize; 2], boundary: Boundary) -> Option<usize> {
        let from = self.indices(node);
        let mut moved = [0; 2];
        for axis in 0..2 {
            let index = from[axis] as isize + steps[axis];
            let wrapped = index.rem_euclid(self.nodes[axis] as isize);
            if boundary == Boundary::Free && wrapped != index {
                return None;
            }
            moved[axis] = wrapped as usize;
        }
        Some(moved[0] * self.nodes[1] + moved[1])
    }
}

/// Returns |k| = min(`index`, `nodes` − `index`), the wavenumber of entry `index` of a discrete
/// Fourier transform of length `nodes`.
///
/// On N nodes, k and k − N are the same wave.
pub(crate) fn magnitude(index: usize, nodes: usize) -> usize {
    index.min(nodes - index)
}

#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    pub fn square(nodes: usize, side: f64) -> Grid {
        Grid::square(nodes, side).unwrap()
    }

    pub fn cell(side: f64) -> Cell {
        Cell::square(side).unwrap()
    }

    pub fn rectangle(nodes: [usize; 2], size: [f64; 2]) -> Grid {
        Grid::new(nodes, Cell::new(size).unwrap()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::samples::{rectangle, square};
    use super::*;

    #[test]
    fn what_is_no_rectangle_is_refused() {
        for side in [0.0, -1.0, f64::INFINITY] {
            let error = Err(GridError::Side { side });
            assert_eq!(Cell::new([side, 1.0]), error);
            assert_eq!(Cell::new([1.0, side]), error);
        }
        assert!(Cell::square(f64::NAN).is_err());
        assert_eq!(Grid::square(0, 1.0), Err(GridError::Empty));
        let nodes = [usize::MAX, 2];
        let many = Grid::new(nodes, Cell::square(1.0).unwrap());
        assert_eq!(many, Err(GridError::TooMany { nodes }));
    }

    #[test]
    fn wavenumbers_of_a_square_are_those_of_its_waves() {
        let cell = square(7, 0.3).cell();
        assert_eq!(cell.wavevector([3.0, 4.0]), [3.0, 4.0]);
        assert_eq!(cell.wavenumber([3.0, 4.0]), 5.0);
    }

    #[test]
    fn a_turned_rectangle_has_the_same_wavenumbers_turned() {
        let (lying, standing) = ([2.0, 0.5], [0.5, 2.0]);
        let of = |size, waves| Cell::new(size).unwrap().wavenumber(waves);
        assert_eq!(of(lying, [3.0, 2.0]), of(standing, [2.0, 3.0]));
        assert_eq!(of(lying, [8.0, 0.0]), of(lying, [0.0, 2.0]));
    }

    #[test]
    fn the_smaller_distance_fits_the_longer_side_so_often() {
        assert_eq!(square(7, 3.0).smaller_steps(), 7.0);
        assert_eq!(rectangle([256, 160], [1.0, 1.25]).smaller_steps(), 320.0);
        assert_eq!(rectangle([10, 10], [1.0, 2.0]).smaller_steps(), 20.0);
    }

    #[test]
    fn the_larger_distance_fits_the_longer_side_so_often() {
        assert_eq!(square(7, 3.0).larger_steps(), 7.0);
        assert_eq!(rectangle([256, 160], [1.0, 1.25]).larger_steps(), 160.0);
    }

    #[test]
    fn cells_of_a_rectangle_may_be_square_and_those_of_a_square_need_not() {
        let are = |nodes, size| rectangle(nodes, size).has_square_cells();
        assert!(are([7, 7], [0.3, 0.3]));
        // 0.6/192 and 1/320 may differ in their last bit.
        assert!(are([192, 320], [0.6, 1.0]));
        assert!(!are([64, 32], [1.0, 1.0]));
        assert!(!are([64, 64], [1.0, 2.0]));
    }

    #[test]
    fn maps_are_row_major() {
        let grid = rectangle([2, 3], [1.0, 1.0]);
        let indices: Vec<_> = (0..grid.count()).map(|node| grid.indices(node)).collect();
        assert_eq!(indices, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
    }
}
