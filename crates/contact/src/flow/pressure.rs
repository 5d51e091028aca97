//! The pressure in the channels of a map, by conjugate gradients, and the flow between two bounds.
//!
//! Pressures are periodic but for a step of one at a seam of the cell, across x for the flow along x and
//! across y for the other, so that the conductance of the map is what flows. For any pressures the
//! dissipation Σ k (Δp)² is no less than it. For any flux f that conserves mass, of which J goes around,
//! J²/Σ f²/k is no more: such a flux is that of the pressures, with what they leave of each node's
//! balance led to the root of its tree.

use super::channels::Channels;
use super::graph::Pair;
use super::links::Links;
use super::multigrid::Multigrid;
use super::search::{Search, add};
use super::{ITERATION_LIMIT, TOLERANCE};

/// Iterations after which rounding is taken out of what is left.
const REFRESHED: u32 = 8;

/// The conductance of the map along an axis, for a pressure that falls by one over the period.
#[derive(Debug, Clone, Copy)]
pub struct Conductance {
    /// The dissipation of the pressure that was found: no less than the conductance.
    pub upper: f64,
    /// No more than the conductance.
    pub lower: f64,
}

impl Conductance {
    /// The distance of the bounds, over the upper one.
    pub fn residual(&self) -> f64 {
        match self.upper > 0.0 {
            true => ((self.upper - self.lower) / self.upper).max(0.0),
            false => 0.0,
        }
    }
}

/// The conductance of all channels along x, and along y, unless the search is interrupted.
pub fn conductances(
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

    /// What Dirichlet's principle says of these pressures, and Thomson's of their flux made to conserve
    /// mass.
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
            lower: match dissipation[axis] > 0.0 {
                true => flow[axis] * flow[axis] / dissipation[axis],
                false => 0.0,
            },
        })
    }
}
