//! Which nodes are expected to come into contact under the next load.
//!
//! On a straight line through two solutions gaps close too soon: towards an edge of contact they fall
//! with the power 3/2 of the distance, so that what the next load will leave open seems to penetrate,
//! under a load twice the last one half of the mesh. A search lets go of half of what it took for
//! contact by mistake in an iteration. But how many nodes will be in contact is known to a per cent,
//! for the contact grows with the load in proportion over a few steps; and first in contact are those
//! whose gap is the smallest part of what it was before. So they alone are free when a search begins. If that
//! is too few, gaps show it after the first move.

use super::Solver;
use super::lanes::over_rows;
use super::passes::{CountNearing, Nearing};

/// Nodes that are free from the start, over those by which the contact is expected to grow.
const EXCESS: f64 = 1.1;

impl Solver {
    /// Which nodes are expected in contact so far beyond the last load, in units of the way to it from the
    /// one before: fewer than all that seem to penetrate there, if any.
    pub(super) fn nearing(&mut self, reach: f64) -> Option<Nearing> {
        let grown = self.contact_nodes - self.earlier_contact_nodes;
        if !(reach > 0.0 && grown > 0.0) {
            return None;
        }
        let penetrate = Nearing {
            part: (reach / (1.0 + reach)) as f32,
            offset: self.offset as f32,
            earlier_offset: self.earlier_offset as f32,
        };
        let mut pass = CountNearing::new(penetrate, &self.search.gap, &self.earlier_gap);
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut pass);
        pass.first(EXCESS * reach * grown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::PeriodicHalfSpace;
    use crate::grid::samples::square;
    use crate::solver::Settings;
    use crate::topography::random::{Amplitude, RandomSurface};
    use crate::topography::spectrum::Spectrum;

    fn solver() -> Solver {
        let surface = RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower: 2,
                k_rolloff: 2,
                k_upper: 16,
                anisotropy: None,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: 11,
            realization: 0,
        };
        let grid = square(128, 1.0);
        let surface = surface.draw(grid);
        Solver::new(PeriodicHalfSpace::new(grid), surface.heights())
    }

    /// Whether each node has pressure.
    fn contact(solver: &Solver) -> Vec<bool> {
        solver.pressure().iter().map(|p| *p > 0.0).collect()
    }

    /// Nodes outside the contact whose gap is less than a part of the one before.
    fn near(solver: &Solver, nearing: Nearing) -> Vec<bool> {
        let nodes = solver.search.gap.iter().zip(&solver.earlier_gap);
        let nodes = nodes.zip(solver.pressure());
        nodes
            .map(|((gap, earlier), p)| {
                let before = earlier - nearing.earlier_offset;
                *p == 0.0 && gap - nearing.offset < nearing.part * before
            })
            .collect()
    }

    fn count(nodes: impl Iterator<Item = bool>) -> f64 {
        nodes.filter(|counts| *counts).count() as f64
    }

    #[test]
    fn most_nodes_that_come_into_contact_are_expected_and_few_of_the_others_that_seem_to() {
        // The second load from the first alone, and the third one from both.
        let mut solver = solver();
        let press = |solver: &mut Solver, load| {
            solver.press(load, &Settings::default(), &|| false);
        };
        press(&mut solver, 0.02);
        for load in [0.04, 0.06] {
            let nearing = solver.nearing(1.0).expect("the contact grows");
            let expected = near(&solver, nearing);
            let penetrate = Nearing { part: 0.5, ..nearing };
            let seem = near(&solver, penetrate);
            let before = contact(&solver);
            press(&mut solver, load);
            let come: Vec<bool> =
                contact(&solver).iter().zip(&before).map(|(now, before)| *now && !before).collect();
            let both = |some: &[bool]| count(come.iter().zip(some).map(|(a, b)| *a && *b));
            let all = |some: &[bool]| count(some.iter().copied());
            assert!(both(&expected) > 0.8 * all(&come), "{load}");
            let [others, other_seem] = [&expected, &seem].map(|some| all(some) - both(some));
            assert!(others < 0.5 * other_seem, "{load}: {others}, {other_seem}");
        }
    }

    #[test]
    fn none_are_expected_where_the_load_falls() {
        let mut solver = solver();
        for load in [0.06, 0.04] {
            solver.press(load, &Settings::default(), &|| false);
        }
        assert!(solver.nearing(0.5).is_none());
    }
}
