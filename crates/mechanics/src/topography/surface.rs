//! Heights on the nodes of a grid, complete ([`Surface`]) or with missing points ([`Scan`]).

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::grid::{Cell, Grid, GridError};

/// Heights of a surface on the nodes of a grid, positive towards the elastic body.
///
/// Each node has a finite height.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::surface::{Surface, SurfaceError};
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

/// Reason why heights do not form a surface.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum SurfaceError {
    #[error("{found} heights for a grid of {} × {} nodes; give one height for each node", nodes[0], nodes[1])]
    Count { found: usize, nodes: [usize; 2] },
    #[error(transparent)]
    Grid(#[from] GridError),
    #[error("the height at row {row}, column {column} is {height}; every height must be finite")]
    NotFinite { row: usize, column: usize, height: f64 },
    #[error(
        "the height at row {row}, column {column} is {height:e}, beyond ±{HIGHEST:e}: squares of such heights \
         overflow; use a smaller unit"
    )]
    TooHigh { row: usize, column: usize, height: f64 },
}

/// Maximum |h| of input heights. Up to this magnitude, all computed results are finite.
pub const HIGHEST: f64 = 1e100;

/// Checks that no |h| exceeds [`HIGHEST`], ignoring heights that are not finite.
///
/// # Errors
/// Fails if |h| exceeds [`HIGHEST`] at a node. The error has the indices of this node on `grid`.
pub fn check_range(grid: Grid, heights: &[f64]) -> Result<(), SurfaceError> {
    let beyond = |height: &f64| height.is_finite() && height.abs() > HIGHEST;
    let Some(index) = heights.iter().position(beyond) else {
        return Ok(());
    };
    let [row, column] = grid.indices(index);
    Err(SurfaceError::TooHigh { row, column, height: heights[index] })
}

impl Surface {
    /// Creates a surface from one height per node, row-major and in the unit of the grid's sides.
    ///
    /// # Errors
    /// Fails if the number of heights is not the number of nodes, or if a height is not finite.
    pub fn new(grid: Grid, heights: Vec<f64>) -> Result<Self, SurfaceError> {
        if grid.count() != heights.len() {
            return Err(SurfaceError::Count { found: heights.len(), nodes: grid.nodes() });
        }
        if let Some(index) = heights.iter().position(|height| !height.is_finite()) {
            let [row, column] = grid.indices(index);
            return Err(SurfaceError::NotFinite { row, column, height: heights[index] });
        }
        Ok(Self { grid, heights })
    }

    /// Returns the grid of the heights.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns the heights in row-major order.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Returns the surface with all heights multiplied by `factor`.
    ///
    /// # Errors
    /// Fails if a height overflows.
    pub fn scaled(mut self, factor: f64) -> Result<Self, SurfaceError> {
        self.heights.iter_mut().for_each(|height| *height *= factor);
        Self::new(self.grid, self.heights)
    }

    /// Consumes the surface and returns its heights, row-major.
    pub fn into_heights(self) -> Vec<f64> {
        self.heights
    }
}

/// Axis of a map, along which its lines run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The x axis: y is constant on a line.
    X,
    /// The y axis: x is constant on a line.
    Y,
}

impl Axis {
    /// Both axes, with x first.
    pub const BOTH: [Axis; 2] = [Axis::X, Axis::Y];

    /// Returns the name used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Axis::X => "x",
            Axis::Y => "y",
        }
    }

    /// Returns the first value of a pair for the x axis, the second for the y axis.
    pub fn select<T: Copy>(self, [x, y]: [T; 2]) -> T {
        match self {
            Axis::X => x,
            Axis::Y => y,
        }
    }
}

/// Calls `visit` with the heights of each line along `axis`, in ascending order of the position
/// across the lines.
pub(super) fn for_each_line(surface: &Surface, axis: Axis, mut visit: impl FnMut(&[f64])) {
    let [nodes_x, nodes_y] = surface.grid().nodes();
    match axis {
        Axis::Y => surface.heights().chunks_exact(nodes_y).for_each(visit),
        Axis::X => {
            let mut line = vec![0.0; nodes_x];
            for j in 0..nodes_y {
                for (i, height) in line.iter_mut().enumerate() {
                    *height = surface.heights()[i * nodes_y + j];
                }
                visit(&line);
            }
        }
    }
}

/// Heights measured by an instrument on the nodes of a grid, positive towards the elastic body.
///
/// Measured nodes have a finite height, missing points have NaN.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::surface::Scan;
///
/// let grid = Grid::new([2, 2], Cell::new([1.0, 1.0])?)?;
/// let scan = Scan::new(grid, vec![0.5, f64::NAN, 0.25, 1.0])?;
/// assert_eq!(scan.missing(), 1);
/// assert_eq!(scan.measured().map(|(node, _)| node).collect::<Vec<_>>(), [0, 2, 3]);
/// assert_eq!(scan.into_surface().unwrap_err().missing, 1);
/// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scan {
    grid: Grid,
    heights: Vec<f64>,
}

/// Error for a map with missing points where a complete surface is required.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{missing} of {count} points are missing; fill them, or crop the map")]
pub struct MissingPoints {
    /// Number of points that were not measured.
    pub missing: usize,
    /// Number of all points of the map.
    pub count: usize,
}

/// Rectangle of nodes of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Indices of the first node along x and y.
    pub first: [usize; 2],
    /// Numbers of nodes along x and y, at least one.
    pub nodes: [usize; 2],
}

impl Scan {
    /// Creates a map from one height per node, row-major and in the unit of the grid's sides.
    ///
    /// A height that is not finite marks a missing point.
    ///
    /// # Errors
    /// Fails if the number of heights is not the number of nodes.
    pub fn new(grid: Grid, mut heights: Vec<f64>) -> Result<Scan, SurfaceError> {
        if grid.count() != heights.len() {
            return Err(SurfaceError::Count { found: heights.len(), nodes: grid.nodes() });
        }
        let infinite = heights.iter_mut().filter(|height| height.is_infinite());
        infinite.for_each(|height| *height = f64::NAN);
        Ok(Scan { grid, heights })
    }

    /// Returns the grid of the heights.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns the heights in row-major order, with NaN at missing points.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Returns `true` if the node was not measured.
    pub fn is_missing(&self, node: usize) -> bool {
        self.heights[node].is_nan()
    }

    /// Returns the number of missing points.
    pub fn missing(&self) -> usize {
        self.heights.len() - self.measured().count()
    }

    /// Iterates over the measured nodes in ascending order, with their heights.
    pub fn measured(&self) -> impl Iterator<Item = (usize, f64)> {
        let nodes = self.heights.iter().copied().enumerate();
        nodes.filter(|(_, height)| !height.is_nan())
    }

    /// Returns the map with each measured height replaced by `change(node, height)`.
    pub(super) fn map_measured(&self, change: impl Fn(usize, f64) -> f64) -> Scan {
        let nodes = self.heights.iter().enumerate();
        let heights = nodes
            .map(|(node, height)| if height.is_nan() { f64::NAN } else { change(node, *height) });
        Scan { grid: self.grid, heights: heights.collect() }
    }

    /// Returns the map with the heights of the given (node, height) pairs replaced.
    pub(super) fn with(mut self, heights: impl IntoIterator<Item = (usize, f64)>) -> Scan {
        for (node, height) in heights {
            self.heights[node] = height;
        }
        self
    }

    /// Returns the map with these nodes missing.
    pub fn without(self, nodes: &[usize]) -> Scan {
        self.with(nodes.iter().map(|node| (*node, f64::NAN)))
    }

    /// Returns the part of the map inside a window, with the same grid spacing.
    ///
    /// # Panics
    /// Panics if the window extends outside the map.
    pub fn cropped(&self, window: Window) -> Scan {
        let [first_x, first_y] = window.first;
        let [nodes_x, nodes_y] = window.nodes;
        let length = self.grid.nodes()[1];
        let rows = (first_x..first_x + nodes_x).map(|i| i * length + first_y);
        let heights = rows.flat_map(|start| &self.heights[start..start + nodes_y]);
        let spacing = self.grid.spacing();
        let size = [0, 1].map(|axis| {
            if window.nodes[axis] == self.grid.nodes()[axis] {
                // An uncropped side keeps all its bits; step × nodes may round differently.
                self.grid.cell().size()[axis]
            } else {
                spacing[axis] * window.nodes[axis] as f64
            }
        });
        let grid = Cell::new(size).and_then(|cell| Grid::new(window.nodes, cell));
        Scan {
            heights: heights.copied().collect(),
            grid: grid.expect("a part of a valid grid is a valid grid"),
        }
    }

    /// Converts the map to a surface.
    ///
    /// # Errors
    /// Fails if points are missing.
    pub fn into_surface(self) -> Result<Surface, MissingPoints> {
        let (missing, count) = (self.missing(), self.heights.len());
        Surface::new(self.grid, self.heights).map_err(|_| MissingPoints { missing, count })
    }
}

impl From<Surface> for Scan {
    fn from(surface: Surface) -> Scan {
        Scan { grid: surface.grid(), heights: surface.into_heights() }
    }
}

#[cfg(test)]
pub(super) mod samples {

    use super::*;

    use crate::grid::samples::rectangle;

    /// Creates a map of the heights `height(x, y)`. The points with `is_missing(i, j)` are missing.
    pub fn scan(
        nodes: [usize; 2],
        size: [f64; 2],
        height: impl Fn(f64, f64) -> f64,
        is_missing: impl Fn(usize, usize) -> bool,
    ) -> Scan {
        let grid = rectangle(nodes, size);
        let [step_x, step_y] = grid.spacing();
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.indices(node);
            if is_missing(i, j) { f64::NAN } else { height(i as f64 * step_x, j as f64 * step_y) }
        });
        Scan::new(grid, heights.collect()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::samples::scan;
    use super::*;
    use crate::grid::samples::rectangle;

    #[test]
    fn heights_that_are_no_surface_are_refused() {
        let grid = rectangle([2, 3], [1.0, 1.0]);
        let few = Surface::new(grid, vec![0.0; 3]).unwrap_err();
        assert_eq!(
            few.to_string(),
            "3 heights for a grid of 2 × 3 nodes; give one height for each node"
        );
        let heights = vec![0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0];
        assert_eq!(
            Surface::new(grid, heights).unwrap_err().to_string(),
            "the height at row 1, column 1 is NaN; every height must be finite"
        );
        let error = check_range(grid, &[0.0, 1e308, f64::INFINITY]).unwrap_err().to_string();
        assert!(error.contains("1e308, beyond ±1e100"), "{error}");
    }

    #[test]
    fn a_window_has_the_heights_and_the_steps_of_the_map() {
        let map = scan([5, 4], [1.0, 2.0], |x, y| 10.0 * x + y, |i, j| (i, j) == (2, 2));
        let window = Window { first: [1, 2], nodes: [3, 2] };
        let part = map.cropped(window);
        assert_eq!(part.grid().nodes(), [3, 2]);
        assert!((part.grid().cell().size()[0] - 0.6).abs() < 1e-15);
        assert_eq!(part.grid().cell().size()[1], 1.0);
        let at = |i: usize, j: usize| map.heights()[i * 4 + j];
        assert_eq!(part.heights()[0], at(1, 2));
        assert_eq!(part.heights()[5], at(3, 3));
        assert!(part.is_missing(2));
        assert_eq!(part.missing(), 1);
    }

    #[test]
    fn the_whole_window_is_the_map_to_the_last_bit() {
        let map = scan([7, 3], [0.1, 0.3], |x, y| x * y, |_, _| false);
        let window = Window { first: [0, 0], nodes: [7, 3] };
        assert_eq!(map.cropped(window).into_surface(), map.clone().into_surface());
    }

    #[test]
    fn heights_that_are_not_finite_are_missing() {
        let map = scan([2, 2], [1.0, 1.0], |x, _| 1.0 / x, |_, _| false);
        assert_eq!(map.missing(), 2);
        let missing = MissingPoints { missing: 2, count: 4 };
        assert_eq!(map.into_surface(), Err(missing));
        assert_eq!(missing.to_string(), "2 of 4 points are missing; fill them, or crop the map");
    }
}
