//! Flow of a fluid through the gap of a contact: Reynolds' equation on a network of resistors.
//!
//! # Equations
//!
//! A thin film of viscosity μ under the pressure p has the flow q = −g³/(12 μ) ∇p per unit width,
//! with ∇·q = 0. The mean flow through a map of gaps g is ⟨q⟩ = −K/(12 μ) ⟨∇p⟩. This defines the
//! effective conductivity K, in length³, which is g³ for parallel walls. The flow factor of Patir &
//! Cheng (*J. Lubr. Technol.* 100, 1978, 12) is K divided by the cube of the mean gap. The film is
//! periodic, and the pressure drops by one over each period along the direction of the flow.
//!
//! # Discretisation
//!
//! A link joins two neighbouring nodes. It consists of half a cell of each gap in series, so its
//! conductance is the harmonic mean of both g³. The conductance is exact for gaps that are constant
//! in each cell, and of second order for smooth gaps. It is zero if one of the nodes is in contact.
//! A fluid therefore flows through chains of 4 nearest neighbours, as in the percolation of contact
//! maps.
//!
//! # Solution and bounds
//!
//! Conjugate gradients with the preconditioner of module `multigrid` solve for the pressures, on
//! one thread and in a fixed order. Module `channels` computes the conductances and finds the
//! channels that percolate. Module `graph` contains the matrix.
//!
//! Near percolation, conductances span many decades, and the norm of the residual does not bound
//! the error of the flow. The solution is therefore enclosed by two bounds. Pressures are periodic
//! except for a step of one at a seam of the cell, so that the flow is the conductance of the map.
//!
//! - Upper bound (Dirichlet's principle): the dissipation Σ k (Δp)² of any pressures.
//! - Lower bound (Thomson's principle): J²/(Σ f²/k) of any flux f that conserves mass, where J is
//!   its flow through the seam. The flux f = k Δp of the pressures does not exactly conserve mass.
//!   The residual of each node therefore flows along a spanning tree to its root.

use thiserror::Error;

use super::grid::Grid;

mod channels;
mod graph;
mod multigrid;

use channels::{Channels, Links};
use graph::{ConjugateDirection, Pair, add};
use multigrid::Multigrid;

/// Maximum relative distance (upper − lower)/upper between the bounds of the flow for which the
/// iteration stops.
pub const TOLERANCE: f64 = 1e-8;

/// Relative distance (upper − lower)/upper between the bounds above which a flow counts as not
/// converged.
///
/// Near percolation, rounding errors keep the bounds farther apart than [`TOLERANCE`].
pub const UNCONVERGED_ABOVE: f64 = 1e-6;

/// Maximum number of conjugate-gradient iterations for a flow; about sixteen are usual.
pub const ITERATION_LIMIT: u32 = 60;

/// Memory that [`flow_through`] uses per node, in bytes, without the map of gaps.
pub const BYTES_PER_NODE: f64 = 270.0;

/// Effective conductivity of a fluid film along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// Effective conductivity K, in the cube of the unit of the gap.
    ///
    /// K is 12 μ × flow per unit width, divided by the pressure gradient. It is exactly zero if no
    /// channel percolates along the axis.
    pub conductivity: f64,
    /// Upper bound of the relative error of K. K is at least the exact value, and exceeds it by at
    /// most this fraction.
    pub residual: f64,
}

/// Error for a flow with lower and upper bounds that remain too far apart.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "the flow did not converge in {ITERATION_LIMIT} iterations: its bounds differ by {residual:.1e}, \
     more than {UNCONVERGED_ABOVE:.0e}"
)]
pub struct Unconverged {
    /// Relative distance (upper − lower)/upper between the bounds of the flow.
    pub residual: f64,
}

/// Computes the effective conductivities K along x and y of a periodic map of gaps, one gap per
/// node.
///
/// A gap that is not positive blocks the flow.
///
/// # Errors
/// Fails for an axis if the relative distance between its bounds exceeds [`UNCONVERGED_ABOVE`].
///
/// # Panics
/// Panics if the number of gaps is not the number of nodes.
///
/// ```
/// use asperity_contact::flow::flow_through;
/// use asperity_contact::grid::Grid;
///
/// // Channels of unit depth along x cover three of four nodes along y: K is the mean of g³ along
/// // the channels and zero across.
/// let grid = Grid::square(16, 1.0)?;
/// let gap: Vec<f64> = (0..grid.count()).map(|node| f64::from(node % 4 != 0)).collect();
/// let [along_x, along_y] = flow_through(grid, &gap);
/// assert!((along_x.unwrap().conductivity - 0.75).abs() < 1e-8);
/// assert_eq!(along_y.unwrap().conductivity, 0.0);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
pub fn flow_through(grid: Grid, gap: &[f64]) -> [Result<Flow, Unconverged>; 2] {
    flow_through_interruptible(grid, gap, &|| false).expect("the computation is not interrupted")
}

/// Computes the same as [`flow_through`], or returns `None` if `is_interrupted` returns `true`.
///
/// Near percolation, a flow on 1024² nodes takes half a minute.
pub fn flow_through_interruptible(
    grid: Grid,
    gap: &[f64],
    is_interrupted: &dyn Fn() -> bool,
) -> Option<[Result<Flow, Unconverged>; 2]> {
    assert_eq!(gap.len(), grid.count(), "there is one gap for each node");
    let none = Flow { conductivity: 0.0, residual: 0.0 };
    let deepest = gap.iter().fold(0.0, |deepest: f64, gap| deepest.max(*gap));
    let links = Links::between(grid, gap, deepest);
    let channels = Channels::new(&links);
    if channels.count == 0 {
        return Some([Ok(none); 2]);
    }
    let [size_x, size_y] = grid.cell().size();
    let found = conductances(&links, &channels, is_interrupted)?;
    let along = [(0, size_x / size_y), (1, size_y / size_x)];
    Some(along.map(|(axis, aspect)| {
        let residual = found[axis].residual();
        if !channels.percolates[axis] {
            Ok(none)
        } else if residual <= UNCONVERGED_ABOVE {
            Ok(Flow { conductivity: found[axis].upper * aspect * deepest.powi(3), residual })
        } else {
            Err(Unconverged { residual })
        }
    }))
}

/// Number of iterations after which the residual is computed again from the pressures, to remove
/// rounding errors.
const REFRESH_INTERVAL: u32 = 8;

/// Bounds of the conductance J of the map along an axis: its flow under a pressure drop of one per
/// period.
#[derive(Debug, Clone, Copy)]
struct Conductance {
    /// Upper bound of J by Dirichlet's principle.
    pub upper: f64,
    /// Lower bound of J by Thomson's principle.
    pub lower: f64,
}

impl Conductance {
    /// Returns the relative distance (upper − lower)/upper, which is zero if both are zero.
    pub fn residual(&self) -> f64 {
        if self.upper > 0.0 { ((self.upper - self.lower) / self.upper).max(0.0) } else { 0.0 }
    }
}

/// Computes bounds of the conductances along x and y, or returns `None` if `is_interrupted` returns
/// `true`.
fn conductances(
    links: &Links,
    channels: &Channels,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<[Conductance; 2]> {
    let mut multigrid = Multigrid::new(channels.graph(links));
    let film = Film { links, channels };
    let mut pressures = vec![[0.0; 2]; channels.count];
    let mut net_inflow = pressures.clone();
    let mut conjugate = ConjugateDirection::new(channels.count);
    let mut dissipation = film.dissipation(&pressures, &mut net_inflow);
    let mut bounds = dissipation.map(|upper| Conductance { upper, lower: 0.0 });
    for iteration in 1..=ITERATION_LIMIT {
        multigrid.precondition(&net_inflow, is_interrupted)?;
        let step = conjugate.step(multigrid.graph(), multigrid.potentials(), &net_inflow);
        add(&mut pressures, step.length, &conjugate.direction);
        add(&mut net_inflow, step.length.map(|length| -length), &conjugate.image);
        dissipation = [0, 1].map(|axis| dissipation[axis] - step.gain[axis]);
        let is_slow = |dissipation: Pair| {
            let mut axes = [0, 1].into_iter();
            axes.all(|axis| step.gain[axis] <= TOLERANCE * dissipation[axis])
        };
        let is_last = iteration == ITERATION_LIMIT;
        if !is_slow(dissipation) && iteration % REFRESH_INTERVAL != 0 && !is_last {
            continue;
        }
        dissipation = film.dissipation(&pressures, &mut net_inflow);
        if is_slow(dissipation) || is_last {
            bounds = film.bounds(&pressures, &net_inflow, dissipation);
            if bounds.iter().all(|bounds| bounds.residual() <= TOLERANCE) {
                break;
            }
        }
    }
    Some(bounds)
}

/// Fluid film in the percolating channels.
struct Film<'a> {
    links: &'a Links,
    channels: &'a Channels,
}

/// Link between two nodes of the channels, and the pressure drop along it.
struct LinkState {
    conductance: f64,
    from: usize,
    to: usize,
    /// Pressure drop from `from` to `to` in the flow along x and in the flow along y, including the
    /// step at a seam.
    drop: Pair,
    /// Axis of the seam that the link crosses, if the pressure has a step there.
    seam: Option<usize>,
}

impl Film<'_> {
    fn link_states(&self, pressures: &[Pair]) -> impl Iterator<Item = LinkState> {
        self.channels.links(self.links).map(|(link, [from, to])| {
            let across = link.crosses_seam && self.channels.percolates[link.axis];
            let seam = across.then_some(link.axis);
            let mut drop = [0, 1].map(|axis| pressures[from][axis] - pressures[to][axis]);
            if let Some(axis) = seam {
                drop[axis] += 1.0;
            }
            LinkState { conductance: link.conductance, from, to, drop, seam }
        })
    }

    /// Returns the dissipation Σ k (Δp)² of the flows along x and y, and writes the net inflow Σ k
    /// Δp of each node to `net_inflow`.
    fn dissipation(&self, pressures: &[Pair], net_inflow: &mut [Pair]) -> Pair {
        net_inflow.fill([0.0; 2]);
        let mut dissipation = [0.0; 2];
        for link in self.link_states(pressures) {
            for axis in [0, 1] {
                let flux = link.conductance * link.drop[axis];
                net_inflow[link.from][axis] -= flux;
                net_inflow[link.to][axis] += flux;
                dissipation[axis] += flux * link.drop[axis];
            }
        }
        dissipation
    }

    /// Returns the bounds of the conductances along x and y for the given pressures. `upper` and
    /// `net_inflow` are the results of [`Film::dissipation`].
    fn bounds(&self, pressures: &[Pair], net_inflow: &[Pair], upper: Pair) -> [Conductance; 2] {
        let mut flow = [0.0; 2];
        for link in self.link_states(pressures) {
            if let Some(axis) = link.seam {
                flow[axis] += link.conductance * link.drop[axis];
            }
        }
        let mut dissipation = upper;
        let mut excess = net_inflow.to_vec();
        for link in &self.channels.parent_links {
            let [node, parent] = [link.node, link.parent].map(|number| number as usize);
            for axis in [0, 1] {
                let crossings = f64::from(link.crossings[axis]);
                let drop = pressures[node][axis] - pressures[parent][axis] + crossings;
                let correction = excess[node][axis];
                excess[parent][axis] += correction;
                flow[axis] += crossings * correction;
                dissipation[axis] += correction * (2.0 * drop + correction / link.conductance);
            }
        }
        [0, 1].map(|axis| Conductance {
            upper: upper[axis],
            lower: if dissipation[axis] > 0.0 {
                flow[axis] * flow[axis] / dissipation[axis]
            } else {
                0.0
            },
        })
    }
}

#[cfg(test)]
mod tests;
