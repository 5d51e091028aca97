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
    /// Lets nodes go whose pressure is no more than what is left of the residual: nodes that were
    /// in contact at an earlier load or in an earlier iteration, and whose pressure fades away. The
    /// lowest of them stays.
    ///
    /// Taking the pressure off such a node lowers its own gap by less than its height, so that it
    /// stays open.
    pub(super) fn release(&mut self, offset: f64) {
        let mut pass = Release {
            asked: UNDECIDED * self.search.nodal_stiffness,
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

struct Release<'a> {
    asked: f64,
    offset: f64,
    gap: &'a [f32],
}

impl Pass<f64> for Release<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, gap) in pressure.iter_mut().zip(row.of(self.gap)) {
            // The lowest gap in contact is no higher than their mean, but may be rounded to be.
            let rounding = f64::from(f32::EPSILON * gap.abs());
            let above = f64::from(*gap) - self.offset - rounding;
            *p *= weight::<f64>(*p >= self.asked * above);
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}
