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
//! channels that percolate. Conductances are rounded to single precision. The relative change of
//! the flow is at most that of one conductance, 6e-8. Everything else on the grid has double
//! precision.
//!
//! Near percolation, conductances span many decades, and the norm of the residual does not bound
//! the error of the flow. The solution is therefore enclosed by two bounds. Pressures are periodic
//! except for a step of one at a seam of the cell, so that the flow is the conductance of the map.
//!
//! - Upper bound (Dirichlet's principle): the dissipation Σ k (Δp)² of any pressures.
//! - Lower bound (Thomson's principle): J²/(Σ f²/k) of any flux f that conserves mass, where J is
//!   its flow through the seam. The flux f = k Δp of the pressures does not exactly conserve mass.
//!   The residual of each node therefore flows along a spanning tree to its root.
//!
//! The error of the flow is the square of the error of the pressures in the norm of the matrix.

use thiserror::Error;

use super::grid::Grid;

mod channels;
mod elimination;
mod graph;
mod multigrid;

use channels::{Channels, Links, ParentLink};
use graph::{Network, Pair};
use multigrid::{Multigrid, three_rows};

/// Maximum relative distance (upper − lower)/upper between the bounds of the flow, including the
/// rounding of the conductances. The iteration stops when both axes fulfil it.
pub const TOLERANCE: f64 = 1e-6;

/// Maximum number of conjugate-gradient iterations for a flow; six to thirteen are usual.
pub const ITERATION_LIMIT: u32 = 60;

/// Memory that [`flow_through`] uses per node, in bytes, without the map of gaps.
pub const BYTES_PER_NODE: f64 = 120.0;

/// Effective conductivity of a fluid film along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// Effective conductivity K, in the cube of the unit of the gap.
    ///
    /// K is 12 μ × flow per unit width, divided by the pressure gradient. It is exactly zero if no
    /// channel percolates along the axis.
    pub conductivity: f64,
    /// Upper bound of the relative error of K: the relative distance between its bounds, plus
    /// `f32::EPSILON` for the rounding of the conductances. K is the upper bound.
    pub residual: f64,
}

/// Error for a flow with lower and upper bounds that remain too far apart.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "the flow did not converge in {ITERATION_LIMIT} iterations: its bounds differ by {residual:.1e}, \
     more than {TOLERANCE:.0e}"
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
/// Fails for an axis if the relative distance between its bounds exceeds [`TOLERANCE`].
///
/// # Panics
/// Panics if the number of gaps is not the number of nodes.
///
/// ```
/// use asperity_mechanics::flow::flow_through;
/// use asperity_mechanics::grid::Grid;
///
/// // Channels of unit depth along x cover three of four nodes along y: K is the mean of g³ along
/// // the channels and zero across.
/// let grid = Grid::square(16, 1.0)?;
/// let gap: Vec<f64> = (0..grid.count()).map(|node| f64::from(node % 4 != 0)).collect();
/// let [along_x, along_y] = flow_through(grid, &gap);
/// assert!((along_x.unwrap().conductivity - 0.75).abs() < 1e-6);
/// assert_eq!(along_y.unwrap().conductivity, 0.0);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
pub fn flow_through(grid: Grid, gap: &[f64]) -> [Result<Flow, Unconverged>; 2] {
    flow_through_interruptible(grid, gap, &|| false).expect("the computation is not interrupted")
}

/// Computes the same as [`flow_through`], or returns `None` if `is_interrupted` returns `true`.
///
/// A flow on 1024² nodes takes about a second, on 4096² nodes about twenty.
pub fn flow_through_interruptible(
    grid: Grid,
    gap: &[f64],
    is_interrupted: &dyn Fn() -> bool,
) -> Option<[Result<Flow, Unconverged>; 2]> {
    assert_eq!(gap.len(), grid.count(), "there is one gap for each node");
    let none = Flow { conductivity: 0.0, residual: 0.0 };
    let deepest = gap.iter().fold(0.0, |deepest: f64, gap| deepest.max(*gap));
    let mut links = Links::between(grid, gap, deepest);
    let channels = Channels::new(&mut links);
    if channels.order.is_empty() {
        return Some([Ok(none); 2]);
    }
    let [size_x, size_y] = grid.cell().size();
    let (found, _) = conductances(&links, &channels, is_interrupted)?;
    let along = [(0, size_x / size_y), (1, size_y / size_x)];
    Some(along.map(|(axis, aspect)| {
        let residual = found[axis].residual();
        if !channels.percolates[axis] {
            Ok(none)
        } else if residual <= TOLERANCE {
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
    /// Returns the relative distance (upper − lower)/upper, increased by the rounding of the
    /// conductances. It is zero if both are zero.
    pub fn residual(&self) -> f64 {
        if self.upper > 0.0 {
            ((self.upper - self.lower) / self.upper).max(0.0) + f64::from(f32::EPSILON)
        } else {
            0.0
        }
    }
}

/// Computes bounds of the conductances along x and y, with the number of iterations. Returns `None`
/// if `is_interrupted` returns `true`.
fn conductances(
    links: &Links,
    channels: &Channels,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<([Conductance; 2], u32)> {
    let mut multigrid = Multigrid::new(links);
    let film = Film { links, channels };
    let mut net_inflow = [0, 1].map(|_| vec![0.0; links.count()]);
    // The inflow at potentials of zero is the current of the steps at the seams.
    film.dissipation(&multigrid.potentials, &mut net_inflow);
    multigrid.start(&net_inflow, is_interrupted)?;
    let mut pressures = multigrid.potentials.clone();
    let [mut dissipation, _] = film.dissipation(&pressures, &mut net_inflow);
    let mut bounds = dissipation.map(|upper| Conductance { upper, lower: 0.0 });
    let mut direction = [0, 1].map(|_| vec![0.0; links.count()]);
    let mut last_slope = [0.0; 2];
    for iteration in 1..=ITERATION_LIMIT {
        multigrid.precondition(&net_inflow, is_interrupted)?;
        let slope = [0, 1].map(|axis| dot(&multigrid.potentials[axis], &net_inflow[axis]));
        let keep = [0, 1].map(|axis| ratio(slope[axis], last_slope[axis]));
        last_slope = slope;
        // The correction is no longer needed once it is part of the direction.
        let correction = &mut multigrid.potentials;
        let curvature = film.turn(&mut direction, keep, correction);
        let outflow = correction;
        let length = [0, 1].map(|axis| ratio(slope[axis], curvature[axis]));
        for axis in [0, 1] {
            add(&mut pressures[axis], length[axis], &direction[axis]);
            add(&mut net_inflow[axis], -length[axis], &outflow[axis]);
        }
        let gain = [0, 1].map(|axis| length[axis] * slope[axis]);
        dissipation = [0, 1].map(|axis| dissipation[axis] - gain[axis]);
        let is_slow = |dissipation: Pair| {
            [0, 1].into_iter().all(|axis| gain[axis] <= TOLERANCE * dissipation[axis])
        };
        let is_last = iteration == ITERATION_LIMIT;
        if !is_slow(dissipation) && iteration % REFRESH_INTERVAL != 0 && !is_last {
            continue;
        }
        let sums = film.dissipation(&pressures, &mut net_inflow);
        dissipation = sums[0];
        if is_slow(dissipation) || is_last {
            bounds = film.bounds(&pressures, &net_inflow, sums, &mut multigrid.potentials);
            if bounds.iter().all(|bounds| bounds.residual() <= TOLERANCE) {
                return Some((bounds, iteration));
            }
        }
    }
    Some((bounds, ITERATION_LIMIT))
}

/// Returns the quotient, or zero if the denominator is not positive.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

/// Returns the scalar product, as the sum of eight sums.
fn dot(one: &[f64], other: &[f64]) -> f64 {
    let (ones, last) = one.as_chunks::<8>();
    let (others, other_last) = other.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (one, other) in ones.iter().zip(others) {
        for lane in 0..8 {
            sums[lane] += one[lane] * other[lane];
        }
    }
    let rest = last.iter().zip(other_last).map(|(one, other)| one * other);
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}

/// Fluid film in the percolating channels.
struct Film<'a> {
    links: &'a Links,
    channels: &'a Channels,
}

impl Film<'_> {
    /// Replaces `direction` by `correction` + `keep` × `direction`, and `correction` by the current
    /// that leaves each node under the new direction. Returns the scalar products of both.
    fn turn(
        &self,
        direction: &mut [Vec<f64>; 2],
        keep: Pair,
        correction: &mut [Vec<f64>; 2],
    ) -> Pair {
        let rows = self.links.nodes[0];
        let mut products = [0.0; 2];
        for axis in [0, 1] {
            let (direction, correction) = (&mut direction[axis], &mut correction[axis]);
            let turn_row = |row: usize, direction: &mut [f64], correction: &[f64]| {
                let row = self.links.row(row);
                let corrections = &correction[row.clone()];
                for (direction, correction) in direction[row].iter_mut().zip(corrections) {
                    *direction = correction + keep[axis] * *direction;
                }
            };
            turn_row(rows - 1, direction, correction);
            if rows > 1 {
                turn_row(0, direction, correction);
            }
            for row in 0..rows {
                // The currents of a row need the new direction of the next row.
                if row + 2 < rows {
                    turn_row(row + 1, direction, correction);
                }
                let outflow = &mut correction[self.links.row(row)];
                self.links.row_outflow(row, three_rows(self.links, direction, row), outflow);
                products[axis] += dot(&direction[self.links.row(row)], outflow);
            }
        }
        products
    }

    /// Returns the dissipation Σ k (Δp)² of the flows along x and y and the flows k Δp through the
    /// seams, and writes the net inflow Σ k Δp of each node to `net_inflow`.
    fn dissipation(&self, pressures: &[Vec<f64>; 2], net_inflow: &mut [Vec<f64>; 2]) -> [Pair; 2] {
        let links = self.links;
        let [rows, row_nodes] = links.nodes;
        let (mut dissipation, mut through_seam) = ([0.0; 2], [0.0; 2]);
        let [mut drop, mut flux] = [0, 1].map(|_| vec![0.0; row_nodes]);
        net_inflow.iter_mut().for_each(|inflow| inflow.fill(0.0));
        for row in 0..rows {
            let [_, down, right] = links.row_conductances(row);
            let [here, below] = [row, links.adjacent_rows(row)[1]].map(|row| links.row(row));
            for axis in [0, 1] {
                let (pressures, inflow) = (&pressures[axis], &mut net_inflow[axis]);
                let own = &pressures[here.clone()];
                let is_seam = |across: usize, index: usize| {
                    across == axis && index == links.seams[axis] && self.channels.percolates[axis]
                };
                let step = if is_seam(0, row) { 1.0 } else { 0.0 };
                for (drop, (own, next)) in
                    drop.iter_mut().zip(own.iter().zip(&pressures[below.clone()]))
                {
                    *drop = own - next + step;
                }
                multiply(down, &drop, &mut flux);
                dissipation[axis] += dot(&flux, &drop);
                through_seam[axis] += step * flux.iter().sum::<f64>();
                add(&mut inflow[here.clone()], -1.0, &flux);
                add(&mut inflow[below.clone()], 1.0, &flux);
                for (drop, pair) in drop.iter_mut().zip(own.windows(2)) {
                    *drop = pair[0] - pair[1];
                }
                let last = row_nodes - 1;
                drop[last] = own[last] - own[0];
                let seam = (0..row_nodes).find(|index| is_seam(1, *index));
                if let Some(seam) = seam {
                    drop[seam] += 1.0;
                }
                multiply(right, &drop, &mut flux);
                dissipation[axis] += dot(&flux, &drop);
                through_seam[axis] += seam.map_or(0.0, |seam| flux[seam]);
                let inflow = &mut inflow[here.clone()];
                add(inflow, -1.0, &flux);
                add(&mut inflow[1..], 1.0, &flux[..last]);
                inflow[0] += flux[last];
            }
        }
        [dissipation, through_seam]
    }

    /// Returns the bounds of the conductances along x and y for the given pressures. `net_inflow`
    /// and the sums are the results of [`Film::dissipation`]; `excess` is overwritten.
    fn bounds(
        &self,
        pressures: &[Vec<f64>; 2],
        net_inflow: &[Vec<f64>; 2],
        [upper, mut flow]: [Pair; 2],
        excess: &mut [Vec<f64>; 2],
    ) -> [Conductance; 2] {
        let mut dissipation = upper;
        excess.clone_from(net_inflow);
        for link in self.channels.parent_links(self.links) {
            let ParentLink { node, parent, conductance, crossings } = link;
            for axis in [0, 1] {
                let crossings = f64::from(crossings[axis]);
                let drop = pressures[axis][node] - pressures[axis][parent] + crossings;
                let correction = excess[axis][node];
                excess[axis][parent] += correction;
                flow[axis] += crossings * correction;
                dissipation[axis] += correction * (2.0 * drop + correction / conductance);
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

/// Adds `factor` × `others` to `values`.
fn add(values: &mut [f64], factor: f64, others: &[f64]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value += factor * other;
    }
}

/// Writes the fluxes of links with the given conductances and pressure drops to `fluxes`.
fn multiply(conductances: &[f32], drops: &[f64], fluxes: &mut [f64]) {
    for (flux, (conductance, drop)) in fluxes.iter_mut().zip(conductances.iter().zip(drops)) {
        *flux = f64::from(*conductance) * drop;
    }
}

#[cfg(test)]
mod tests;
