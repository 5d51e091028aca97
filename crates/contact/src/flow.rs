//! How much of a fluid flows through the gap of a contact: Reynolds' equation, solved as a network
//! of resistors on the mesh.
//!
//! A thin film of viscosity μ under the pressure p carries q = −g³/(12 μ) ∇p for each unit of
//! width, and ∇·q = 0. What a map of gaps g carries as a whole is ⟨q⟩ = −K/(12 μ) ⟨∇p⟩: its
//! effective conductivity K, in units of length cubed, is g³ of parallel walls, and K over the cube
//! of the mean gap is the flow factor of Patir & Cheng (*J. Lubr. Technol.* 100, 1978, 12). The
//! film is periodic, as the contact is, and the pressure falls by one over each period along the
//! direction asked for.
//!
//! Neighbours are joined by half a cell of either gap in series, so that the conductance of a link
//! is the harmonic mean of both g³: exact where the gap is constant in each cell, of second order
//! where it is smooth, and zero where either node is in contact. What carries a fluid is then what
//! a channel of nodes that are neighbours joins, as for the percolation of maps.
//!
//! `channels` has the conductances of links and what of them goes around the cell, `graph` what is
//! left of the mesh, and `multigrid` the preconditioner of the conjugate gradients here.
//! Conductances span many decades near percolation, where the norm of a residual says little about
//! the flow. The solution is therefore held between two bounds: by Dirichlet's principle the
//! dissipation of no pressure is below K, and by Thomson's that of no flux that conserves mass
//! either. All is done on one thread, in one order.
//!
//! Pressures are periodic but for a step of one at a seam of the cell, across x for the flow along
//! x and across y for the other, so that the conductance of the map is what flows. For any
//! pressures the dissipation Σ k (Δp)² is no less than it. For any flux f that conserves mass, of
//! which J goes around, J²/Σ f²/k is no more: such a flux is that of the pressures, with what they
//! leave of each node's balance led to the root of its tree.

use thiserror::Error;

use super::grid::Grid;

mod channels;
mod graph;
mod multigrid;

use channels::{Channels, Links};
use graph::{Pair, Search, add};
use multigrid::Multigrid;

/// The distance of the bounds at which the search ends, over the conductivity.
pub const TOLERANCE: f64 = 1e-8;

/// The distance of the bounds from which on a flow was not found. Near percolation rounding keeps
/// them further apart than [`TOLERANCE`].
pub const UNCONVERGED_ABOVE: f64 = 1e-6;

/// Iterations after which the search ends in any case; some sixteen are usual.
pub const ITERATION_LIMIT: u32 = 60;

/// Bytes that [`flow_through`] holds for each node besides the gap.
pub const BYTES_PER_NODE: f64 = 270.0;

/// What a film carries along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// The effective conductivity K, in the unit of the gap cubed: 12 μ × the flow for each unit of
    /// width, over the gradient of the pressure. Exactly zero where no channel goes around the cell
    /// that way.
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

/// What flows along x and along y through a periodic map of gaps, one for each node of the grid.
/// Where the gap is not positive nothing flows.
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

/// The same, unless it is interrupted: near percolation one flow takes half a minute on 1024²
/// nodes.
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
    let found = conductances(&links, &channels, is_interrupted)?;
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

/// Iterations after which rounding is taken out of what is left.
const REFRESHED: u32 = 8;

/// The conductance of the map along an axis, for a pressure that falls by one over the period.
#[derive(Debug, Clone, Copy)]
struct Conductance {
    /// The dissipation of the pressure that was found: no less than the conductance.
    pub upper: f64,
    /// No more than the conductance.
    pub lower: f64,
}

impl Conductance {
    /// The distance of the bounds, over the upper one.
    pub fn residual(&self) -> f64 {
        if self.upper > 0.0 { ((self.upper - self.lower) / self.upper).max(0.0) } else { 0.0 }
    }
}

/// The conductance of all channels along x, and along y, unless the search is interrupted.
fn conductances(
    links: &Links,
    channels: &Channels,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<[Conductance; 2]> {
    let mut multigrid = Multigrid::of(channels.graph(links));
    let film = Film { links, channels };
    let mut pressures = vec![[0.0; 2]; channels.count];
    let mut surplus = pressures.clone();
    let mut search = Search::new(channels.count);
    let mut dissipation = film.dissipation(&pressures, &mut surplus);
    let mut bounds = dissipation.map(|upper| Conductance { upper, lower: 0.0 });
    for iteration in 1..=ITERATION_LIMIT {
        multigrid.precondition(&surplus, is_interrupted)?;
        let step = search.turn(multigrid.graph(), multigrid.potentials(), &surplus);
        add(&mut pressures, step.length, &search.direction);
        add(&mut surplus, step.length.map(|length| -length), &search.image);
        dissipation = [0, 1].map(|axis| dissipation[axis] - step.gain[axis]);
        let is_slow = |dissipation: Pair| {
            let mut axes = [0, 1].into_iter();
            axes.all(|axis| step.gain[axis] <= TOLERANCE * dissipation[axis])
        };
        let is_last = iteration == ITERATION_LIMIT;
        if !is_slow(dissipation) && iteration % REFRESHED != 0 && !is_last {
            continue;
        }
        dissipation = film.dissipation(&pressures, &mut surplus);
        if is_slow(dissipation) || is_last {
            bounds = film.bounds(&pressures, &surplus, dissipation);
            if bounds.iter().all(|bounds| bounds.residual() <= TOLERANCE) {
                break;
            }
        }
    }
    Some(bounds)
}

/// The film in all channels.
struct Film<'a> {
    links: &'a Links,
    channels: &'a Channels,
}

/// A link and what happens along it.
struct Passage {
    conductance: f64,
    from: usize,
    to: usize,
    /// By how much the pressure of either flow falls.
    fall: Pair,
    /// The seam that is crossed.
    seam: Option<usize>,
}

impl Film<'_> {
    fn passages(&self, pressures: &[Pair]) -> impl Iterator<Item = Passage> {
        self.channels.links(self.links).map(|(link, [from, to])| {
            let seam = link.crosses_seam.then_some(link.axis);
            let seam = seam.filter(|axis| self.channels.go_around[*axis]);
            let mut fall = [0, 1].map(|axis| pressures[from][axis] - pressures[to][axis]);
            if let Some(axis) = seam {
                fall[axis] += 1.0;
            }
            Passage { conductance: link.conductance, from, to, fall, seam }
        })
    }

    /// The dissipation of these pressures, and by how much more flows to each node than from it.
    fn dissipation(&self, pressures: &[Pair], surplus: &mut [Pair]) -> Pair {
        surplus.fill([0.0; 2]);
        let mut dissipation = [0.0; 2];
        for passage in self.passages(pressures) {
            for axis in [0, 1] {
                let flux = passage.conductance * passage.fall[axis];
                surplus[passage.from][axis] -= flux;
                surplus[passage.to][axis] += flux;
                dissipation[axis] += flux * passage.fall[axis];
            }
        }
        dissipation
    }

    /// What Dirichlet's principle says of these pressures, and Thomson's of their flux made to
    /// conserve mass.
    fn bounds(&self, pressures: &[Pair], surplus: &[Pair], upper: Pair) -> [Conductance; 2] {
        let mut flow = [0.0; 2];
        for passage in self.passages(pressures) {
            if let Some(axis) = passage.seam {
                flow[axis] += passage.conductance * passage.fall[axis];
            }
        }
        let mut dissipation = upper;
        let mut surplus = surplus.to_vec();
        for twig in &self.channels.twigs {
            let [node, parent] = [twig.node, twig.parent].map(|number| number as usize);
            for axis in [0, 1] {
                let crossings = f64::from(twig.crossings[axis]);
                let fall = pressures[node][axis] - pressures[parent][axis] + crossings;
                let led = surplus[node][axis];
                surplus[parent][axis] += led;
                flow[axis] += crossings * led;
                dissipation[axis] += led * (2.0 * fall + led / twig.conductance);
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
