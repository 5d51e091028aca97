//! A periodic surface on a square mesh.

use thiserror::Error;

/// Heights of a surface on the nodes of a periodic square cell, peaks up.
///
/// Holding one means: at least one node, a positive side, and as many finite heights as nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    nodes: usize,
    side: f64,
    heights: Vec<f64>,
}

/// Why heights do not make a surface.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum SurfaceError {
    #[error("{found} heights do not fill a mesh of {nodes} × {nodes} nodes")]
    Count { found: usize, nodes: usize },
    #[error("a surface needs at least one node")]
    Empty,
    #[error("side of the cell is {side}, it must be positive and finite")]
    Side { side: f64 },
    #[error("height at row {row}, column {column} is {height}, every height must be finite")]
    NotFinite {
        row: usize,
        column: usize,
        height: f64,
    },
}

impl Surface {
    /// A surface of `nodes` × `nodes` heights, row-major, on a cell of the given side; heights and
    /// side in the same unit.
    pub fn new(nodes: usize, side: f64, heights: Vec<f64>) -> Result<Self, SurfaceError> {
        if nodes == 0 {
            return Err(SurfaceError::Empty);
        }
        if nodes.checked_mul(nodes) != Some(heights.len()) {
            let found = heights.len();
            return Err(SurfaceError::Count { found, nodes });
        }
        if !(side > 0.0 && side.is_finite()) {
            return Err(SurfaceError::Side { side });
        }
        if let Some(index) = heights.iter().position(|height| !height.is_finite()) {
            return Err(SurfaceError::NotFinite {
                row: index / nodes,
                column: index % nodes,
                height: heights[index],
            });
        }
        Ok(Self {
            nodes,
            side,
            heights,
        })
    }

    /// Nodes per side.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Side of the cell.
    pub fn side(&self) -> f64 {
        self.side
    }

    /// Distance between neighbouring nodes.
    pub fn spacing(&self) -> f64 {
        self.side / self.nodes as f64
    }

    /// Heights, row-major: node (i, j) at `i * nodes + j`, at x = i spacing, y = j spacing.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// The surface with its heights multiplied by a factor.
    ///
    /// # Errors
    /// When a height leaves the range of floating-point numbers.
    pub fn scaled(mut self, factor: f64) -> Result<Self, SurfaceError> {
        self.heights.iter_mut().for_each(|height| *height *= factor);
        Self::new(self.nodes, self.side, self.heights)
    }

    /// The heights, given away.
    pub fn into_heights(self) -> Vec<f64> {
        self.heights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_that_are_no_surface_are_refused() {
        let empty = Surface::new(0, 1.0, vec![]);
        assert_eq!(empty, Err(SurfaceError::Empty));
        let few = Surface::new(2, 1.0, vec![0.0; 3]);
        assert_eq!(few, Err(SurfaceError::Count { found: 3, nodes: 2 }));
        for side in [0.0, -1.0, f64::INFINITY] {
            let error = Surface::new(1, side, vec![0.0]);
            assert_eq!(error, Err(SurfaceError::Side { side }));
        }
        let error = Surface::new(2, 1.0, vec![0.0, 0.0, 0.0, f64::NAN]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "height at row 1, column 1 is NaN, every height must be finite"
        );
    }
}
