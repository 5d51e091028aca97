//! A part of a measured map.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::scan::Window;
use crate::grid::Grid;

/// A rectangle of a map, by lengths along x and y in the unit of its sides.
///
/// ```
/// use asperity_contact::grid::{Cell, Grid};
/// use asperity_contact::topography::crop::Crop;
///
/// let grid = Grid::new([100, 50], Cell::new([20e-6, 10e-6])?)?;
/// let crop = Crop { from: [4e-6, 0.0], size: [8e-6, 5.05e-6] };
/// let window = crop.window(grid).unwrap();
/// assert_eq!(window.first, [20, 0]);
/// assert_eq!(window.nodes, [40, 25]);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Crop {
    /// Where its first node lies, from that of the map.
    pub from: [f64; 2],
    /// Its sides: nodes × step, as everywhere.
    pub size: [f64; 2],
}

/// Why a rectangle is no part of a map.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum CropError {
    #[error("along {axis} it reaches from {from} to {to}, the map from 0 to {side}")]
    Outside { axis: char, from: f64, to: f64, side: f64 },
    #[error("along {axis} its side {size} is less than a node, which are {step} apart")]
    Empty { axis: char, size: f64, step: f64 },
}

impl Crop {
    /// The nodes that are meant: first node and number of nodes are rounded, along either axis.
    ///
    /// # Errors
    /// When the rectangle reaches beyond the map by half a step or more, or has no node.
    pub fn window(&self, grid: Grid) -> Result<Window, CropError> {
        let mut window = Window { first: [0; 2], nodes: [0; 2] };
        for (axis, name) in ['x', 'y'].into_iter().enumerate() {
            let (from, size) = (self.from[axis], self.size[axis]);
            let step = grid.spacing()[axis];
            let [first, nodes] = [from, size].map(|length| (length / step).round());
            let is_inside = first >= 0.0 && first + nodes <= grid.nodes()[axis] as f64;
            if !is_inside {
                return Err(CropError::Outside {
                    axis: name,
                    from,
                    to: from + size,
                    side: grid.cell().size()[axis],
                });
            }
            if nodes < 1.0 {
                let axis = name;
                return Err(CropError::Empty { axis, size, step });
            }
            window.first[axis] = first as usize;
            window.nodes[axis] = nodes as usize;
        }
        Ok(window)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::rectangle;

    fn window(from: [f64; 2], size: [f64; 2]) -> Result<Window, CropError> {
        Crop { from, size }.window(rectangle([10, 20], [1.0, 4.0]))
    }

    #[test]
    fn the_whole_map_is_a_part_of_it() {
        let whole = window([0.0, 0.0], [1.0, 4.0]).unwrap();
        assert_eq!((whole.first, whole.nodes), ([0, 0], [10, 20]));
        // Half a step of 0.1 and of 0.2 is nothing.
        let rounded = window([0.04, -0.09], [1.0, 4.0]).unwrap();
        assert_eq!(rounded, whole);
    }

    #[test]
    fn what_is_no_part_of_a_map_is_refused_with_the_axis() {
        let beyond = window([0.5, 1.0], [0.5, 3.2]).unwrap_err();
        assert_eq!(beyond.to_string(), "along y it reaches from 1 to 4.2, the map from 0 to 4");
        assert!(matches!(
            window([-0.2, 0.0], [0.5, 1.0]),
            Err(CropError::Outside { axis: 'x', .. })
        ));
        let empty = window([0.5, 1.0], [0.04, 3.0]).unwrap_err();
        assert_eq!(
            empty.to_string(),
            "along x its side 0.04 is less than a node, which are 0.1 apart"
        );
        for odd in [f64::NAN, f64::INFINITY] {
            assert!(window([odd, 0.0], [0.5, 1.0]).is_err());
            assert!(window([0.0, 0.0], [0.5, odd]).is_err());
        }
    }
}
