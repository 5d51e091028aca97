//! Which nodes of an accepted solution are in contact.

use pulp::Simd;

use super::Solver;
use super::lanes::{Pass, over_rows, weight};
use crate::contact::fft::Row;

/// A node is let go if it carries less than this part of the pressure that its gap alone asks to
/// be taken off it. Whoever carries more than the whole stays in contact for certain; near one half
/// as many nodes are let go too early as too late, in sweeps from 256² to 1024².
const UNDECIDED: f64 = 0.5;

impl Solver {
    /// Decides what the residual leaves open.
    ///
    /// Nodes are let go whose pressure is no more than what is left of the residual: nodes that were
    /// in contact at an earlier load or in an earlier iteration, and whose pressure fades away. The
    /// lowest of them stays. Taking the pressure off such a node lowers its own gap by less than its
    /// height, so that it stays open.
    ///
    /// Nodes without pressure that still penetrate come into contact, with the pressure that closes their own
    /// gap: of 31 of them under twenty loads of two surfaces, 27 are in contact when the residual is 1e-10.
    pub(super) fn decide(&mut self, offset: f64) {
        let mut pass = Decide {
            stiffness: self.search.nodal_stiffness,
            offset,
            gap: &self.search.gap,
        };
        over_rows(
            &self.search.threads,
            &mut self.pressure,
            self.search.nodes[1],
            &mut pass,
        );
    }
}

struct Decide<'a> {
    /// Pressure that closes a gap of one node.
    stiffness: f64,
    offset: f64,
    gap: &'a [f32],
}

impl Pass<f64> for Decide<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, gap) in pressure.iter_mut().zip(row.of(self.gap)) {
            // The lowest gap in contact is no higher than their mean, but may be rounded to be.
            let rounding = f64::from(f32::EPSILON * gap.abs());
            let above = f64::from(*gap) - self.offset;
            let closes = self.stiffness * (-above - rounding).max(0.0) * weight::<f64>(*p == 0.0);
            let is_held = *p >= UNDECIDED * self.stiffness * (above - rounding);
            *p = closes + *p * weight::<f64>(is_held);
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rough, solver};
    use super::super::{Settings, Stop};

    /// Nodes that are in contact.
    fn contact(solver: &super::Solver) -> Vec<bool> {
        solver.pressure().iter().map(|p| *p > 0.0).collect()
    }

    #[test]
    fn no_node_that_penetrates_is_left_open_and_contact_is_closer_to_that_of_a_smaller_residual() {
        let heights = rough(256, 4);
        let press = |tolerance: f64| {
            let mut solver = solver(256, &heights);
            let settings = Settings {
                tolerance,
                ..Settings::default()
            };
            let outcome = solver.press(0.2, &settings, &|| false);
            assert_eq!(outcome.stop, Stop::Converged);
            solver
        };
        let (loose, tight) = (press(1e-2), press(1e-10));
        let nodes = loose.pressure().iter().zip(&loose.search.gap);
        for (p, gap) in nodes {
            let rounding = f64::from(f32::EPSILON * gap.abs());
            assert!(*p > 0.0 || f64::from(*gap) - loose.offset >= -rounding);
        }
        // Those that are decided are few: of nodes in one of both alone hardly any.
        let (found, exact) = (contact(&loose), contact(&tight));
        let wrong = found.iter().zip(&exact).filter(|(a, b)| a != b).count();
        let edge = exact.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(100 * wrong < edge, "{wrong} of {edge}");
    }
}
