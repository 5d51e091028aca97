//! Heights on the nodes of a grid: a [`Surface`], and a [`Scan`] some of whose points are missing.

use thiserror::Error;

use crate::grid::{Cell, Grid, GridError};

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

/// A direction in which the nodes of a map follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Lines of equal y.
    X,
    /// Lines of equal x.
    Y,
}

impl Axis {
    /// Both.
    pub const BOTH: [Axis; 2] = [Axis::X, Axis::Y];

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Axis::X => "x",
            Axis::Y => "y",
        }
    }

    /// What belongs to the axis, of a pair along x and y.
    pub fn of<T: Copy>(self, [x, y]: [T; 2]) -> T {
        match self {
            Axis::X => x,
            Axis::Y => y,
        }
    }
}

/// Visits the heights of every line along an axis, in the order of the other.
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

/// Heights on the nodes of a grid, peaks up, as an instrument has measured them.
///
/// Holding one means: a finite height for every node that was measured, NaN for every other one.
///
/// ```
/// use asperity_contact::grid::{Cell, Grid};
/// use asperity_contact::topography::surface::Scan;
///
/// let grid = Grid::new([2, 2], Cell::new([1.0, 1.0])?)?;
/// let scan = Scan::new(grid, vec![0.5, f64::NAN, 0.25, 1.0])?;
/// assert_eq!(scan.missing(), 1);
/// assert_eq!(scan.measured().map(|(node, _)| node).collect::<Vec<_>>(), [0, 2, 3]);
/// assert_eq!(scan.whole().unwrap_err().missing, 1);
/// # Ok::<(), asperity_contact::topography::surface::SurfaceError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scan {
    grid: Grid,
    heights: Vec<f64>,
}

/// A map with points that are missing is no surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{missing} of {count} points are missing")]
pub struct MissingPoints {
    /// How many were not measured.
    pub missing: usize,
    /// Of how many.
    pub count: usize,
}

/// A rectangle of nodes of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Its first node, along x and y.
    pub first: [usize; 2],
    /// Its nodes along x and y, at least one.
    pub nodes: [usize; 2],
}

impl Scan {
    /// One number for each node, row-major, in the unit of the grid's lengths; what is not finite
    /// is missing.
    ///
    /// # Errors
    /// When there are more or fewer numbers than nodes.
    pub fn new(grid: Grid, mut heights: Vec<f64>) -> Result<Scan, SurfaceError> {
        if grid.count() != heights.len() {
            return Err(SurfaceError::Count { found: heights.len(), nodes: grid.nodes() });
        }
        let infinite = heights.iter_mut().filter(|height| height.is_infinite());
        infinite.for_each(|height| *height = f64::NAN);
        Ok(Scan { grid, heights })
    }

    /// Where the heights are.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Heights, row-major; NaN where they are missing.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Whether a node was not measured.
    pub fn is_missing(&self, node: usize) -> bool {
        self.heights[node].is_nan()
    }

    /// How many nodes were not measured.
    pub fn missing(&self) -> usize {
        self.heights.len() - self.measured().count()
    }

    /// The nodes that were measured, ascending, and their heights.
    pub fn measured(&self) -> impl Iterator<Item = (usize, f64)> {
        let nodes = self.heights.iter().copied().enumerate();
        nodes.filter(|(_, height)| !height.is_nan())
    }

    /// The same map with other heights at the nodes that were measured.
    pub(super) fn changed(&self, change: impl Fn(usize, f64) -> f64) -> Scan {
        let heights = self.heights.iter().enumerate();
        let heights = heights
            .map(|(node, height)| if height.is_nan() { f64::NAN } else { change(node, *height) });
        Scan { grid: self.grid, heights: heights.collect() }
    }

    /// The same map with heights at some of its nodes.
    pub(super) fn with(mut self, heights: impl IntoIterator<Item = (usize, f64)>) -> Scan {
        for (node, height) in heights {
            self.heights[node] = height;
        }
        self
    }

    /// The nodes of a window, on a cell that is as much smaller.
    ///
    /// # Panics
    /// When the window is not within the map.
    pub fn cropped(&self, window: Window) -> Scan {
        let [first_x, first_y] = window.first;
        let [nodes_x, nodes_y] = window.nodes;
        let length = self.grid.nodes()[1];
        let rows = (first_x..first_x + nodes_x).map(|i| i * length + first_y);
        let heights = rows.flat_map(|start| &self.heights[start..start + nodes_y]);
        let spacing = self.grid.spacing();
        let size = [0, 1].map(|axis| match window.nodes[axis] == self.grid.nodes()[axis] {
            // The same to the last bit, which a quotient and a product need not give.
            true => self.grid.cell().size()[axis],
            false => spacing[axis] * window.nodes[axis] as f64,
        });
        let grid = Cell::new(size).and_then(|cell| Grid::new(window.nodes, cell));
        Scan {
            heights: heights.copied().collect(),
            grid: grid.expect("a part of a map can be counted and measured"),
        }
    }

    /// The surface, if every node was measured.
    ///
    /// # Errors
    /// When points are missing, and how many.
    pub fn whole(self) -> Result<Surface, MissingPoints> {
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

    /// A map of heights over x and y, without the nodes that are said to be missing.
    pub fn scan(
        nodes: [usize; 2],
        size: [f64; 2],
        height: impl Fn(f64, f64) -> f64,
        is_missing: impl Fn(usize, usize) -> bool,
    ) -> Scan {
        let grid = rectangle(nodes, size);
        let [step_x, step_y] = grid.spacing();
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.place(node);
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
        assert_eq!(few.to_string(), "3 heights do not fill a mesh of 2 × 3 nodes");
        let heights = vec![0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0];
        assert_eq!(
            Surface::new(grid, heights).unwrap_err().to_string(),
            "height at row 1, column 1 is NaN, every height must be finite"
        );
        let error = check_range(grid, &[0.0, 1e308, f64::INFINITY]).unwrap_err().to_string();
        assert!(error.contains("1e308, more than 1e100"), "{error}");
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
        assert_eq!(map.cropped(window).whole(), map.clone().whole());
    }

    #[test]
    fn what_is_not_finite_is_missing() {
        let map = scan([2, 2], [1.0, 1.0], |x, _| 1.0 / x, |_, _| false);
        assert_eq!(map.missing(), 2);
        let missing = MissingPoints { missing: 2, count: 4 };
        assert_eq!(map.whole(), Err(missing));
        assert_eq!(missing.to_string(), "2 of 4 points are missing");
    }
}
