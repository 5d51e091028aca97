//! The lines of nodes along one axis of a map.

use super::surface::Surface;

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
