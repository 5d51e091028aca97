//! How much of a fluid flows through the gap of a contact: Reynolds' equation, solved as a network of
//! resistors on the mesh.
//!
//! A thin film of viscosity μ under the pressure p carries q = −g³/(12 μ) ∇p for each unit of width, and
//! ∇·q = 0. What a map of gaps g carries as a whole is ⟨q⟩ = −K/(12 μ) ⟨∇p⟩: its effective conductivity
//! K, in units of length cubed, is g³ of parallel walls, and K over the cube of the mean gap is the flow
//! factor of Patir & Cheng (*J. Lubr. Technol.* 100, 1978, 12). The film is periodic, as the contact is,
//! and the pressure falls by one over each period along the direction asked for.
//!
//! Neighbours are joined by half a cell of either gap in series, so that the conductance of a link is the
//! harmonic mean of both g³: exact where the gap is constant in each cell, of second order where it is
//! smooth, and zero where either node is in contact. What carries a fluid is then what a channel of nodes
//! that are neighbours joins, as for the percolation of maps.
//!
//! `links` are the conductances, `channels` what goes around the cell; `graph` is what is left of
//! the mesh, `aggregates` and `multigrid` the preconditioner of the conjugate gradients in
//! `pressure`. Conductances span many decades near percolation, where the norm of a residual says
//! little about the flow. The solution is therefore held between two bounds: by Dirichlet's principle the
//! dissipation of no pressure is below K, and by Thomson's that of no flux that conserves mass either. All
//! is done on one thread, in one order.

mod aggregates;
mod channels;
mod factors;
mod graph;
mod links;
mod multigrid;
mod pressure;
mod search;

use thiserror::Error;

use crate::grid::Grid;
use channels::Channels;
use links::Links;

/// The distance of the bounds at which the search ends, over the conductivity.
pub const TOLERANCE: f64 = 1e-8;

/// The distance of the bounds from which on a flow was not found. Near percolation rounding keeps them
/// further apart than [`TOLERANCE`].
pub const UNCONVERGED_ABOVE: f64 = 1e-6;

/// Iterations after which the search ends in any case; some sixteen are usual.
pub const ITERATION_LIMIT: u32 = 60;

/// Bytes that [`flow_through`] holds for each node besides the gap.
pub const BYTES_PER_NODE: f64 = 270.0;

/// What a film carries along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// The effective conductivity K, in the unit of the gap cubed: 12 μ × the flow for each unit of width,
    /// over the gradient of the pressure. Exactly zero where no channel goes around the cell that way.
    pub conductivity: f64,
    /// The most that K may be too large by, over K; it is never too small.
    pub residual: f64,
}

/// A flow that was not found.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "a flow was not found in {ITERATION_LIMIT} iterations: its bounds are apart by {residual:.1e}"
)]
pub struct Unconverged {
    /// How far the bounds are apart, over the upper one.
    pub residual: f64,
}

/// What flows along x and along y through a periodic map of gaps, one for each node of the grid. Where
/// the gap is not positive nothing flows.
///
/// # Errors
/// Of each direction, when the bounds do not meet within [`UNCONVERGED_ABOVE`].
///
/// # Panics
/// When there are more or fewer gaps than nodes.
///
/// ```
/// use asperity_contact::flow::flow_through;
/// use asperity_contact::grid::Grid;
///
/// // Channels along x, three in four of unit depth: along them the mean of g³, across them nothing.
/// let grid = Grid::square(16, 1.0)?;
/// let gap: Vec<f64> = (0..grid.count()).map(|node| f64::from(node % 4 != 0)).collect();
/// let [along_x, along_y] = flow_through(grid, &gap);
/// assert!((along_x.unwrap().conductivity - 0.75).abs() < 1e-8);
/// assert_eq!(along_y.unwrap().conductivity, 0.0);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
pub fn flow_through(grid: Grid, gap: &[f64]) -> [Result<Flow, Unconverged>; 2] {
    flow_unless(grid, gap, &|| false).expect("nothing interrupts it")
}

/// The same, unless it is interrupted: near percolation one flow takes half a minute on 1024² nodes.
pub fn flow_unless(
    grid: Grid,
    gap: &[f64],
    is_interrupted: &dyn Fn() -> bool,
) -> Option<[Result<Flow, Unconverged>; 2]> {
    assert_eq!(gap.len(), grid.count(), "gaps fill the mesh");
    let none = Flow { conductivity: 0.0, residual: 0.0 };
    let deepest = gap.iter().fold(0.0, |deepest: f64, gap| deepest.max(*gap));
    let links = Links::between(grid, gap, deepest);
    let channels = Channels::along(&links);
    if channels.count == 0 {
        return Some([Ok(none); 2]);
    }
    let [size_x, size_y] = grid.cell().size();
    let found = pressure::conductances(&links, &channels, is_interrupted)?;
    let along = [(0, size_x / size_y), (1, size_y / size_x)];
    Some(along.map(|(axis, aspect)| {
        let residual = found[axis].residual();
        match channels.go_around[axis] {
            false => Ok(none),
            true if residual <= UNCONVERGED_ABOVE => {
                Ok(Flow { conductivity: found[axis].upper * aspect * deepest.powi(3), residual })
            }
            true => Err(Unconverged { residual }),
        }
    }))
}

#[cfg(test)]
mod tests;
