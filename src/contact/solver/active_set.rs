//! Which nodes of an accepted solution are in contact.

use pulp::Simd;

use super::Solver;
use super::lanes::{LANES, Pass, greater, over_rows, total, weight};
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
            asked: UNDECIDED * self.nodal_stiffness,
            offset,
            gap: &self.gap,
        };
        over_rows(&mut self.pressure, self.nodes[1], &mut pass);
    }

    /// Brings the pressure to its mean within its bounds, and says what it is like.
    pub(super) fn conclude(&mut self) -> Conclusion {
        let scale = match self.bound {
            None => self.scale_to_load(),
            Some(hardness) => {
                self.share_out(hardness);
                1.0
            }
        };
        let mut pass = Conclude {
            scale,
            hardness: self.ceiling(),
            contact_nodes: 0.0,
            saturated_nodes: 0.0,
            peak: [0.0; LANES],
        };
        over_rows(&mut self.pressure, self.nodes[1], &mut pass);
        Conclusion {
            contact_nodes: pass.contact_nodes as usize,
            saturated_nodes: pass.saturated_nodes as usize,
            peak_pressure: pass.peak.into_iter().fold(0.0, greater),
        }
    }

    /// What pressures without a bound are to be scaled by.
    fn scale_to_load(&mut self) -> f64 {
        let mut sum = Total(0.0);
        over_rows(&mut self.pressure, self.nodes[1], &mut sum);
        if sum.0 <= 0.0 {
            // A search leaves nothing of a pressure too small for single precision.
            self.guess_from_heights(self.load);
            over_rows(&mut self.pressure, self.nodes[1], &mut sum);
        }
        self.load * self.pressure.len() as f64 / sum.0
    }
}

/// A pressure at a glance.
#[derive(Debug, Clone, Copy)]
pub struct Conclusion {
    pub contact_nodes: usize,
    pub saturated_nodes: usize,
    pub peak_pressure: f64,
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
}

struct Total(f64);

impl Pass<f64> for Total {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, values: &mut [f64]) {
        self.0 += total(values);
    }
}

struct Conclude {
    scale: f64,
    hardness: f64,
    contact_nodes: f64,
    saturated_nodes: f64,
    peak: [f64; LANES],
}

impl Pass<f64> for Conclude {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, pressure: &mut [f64]) {
        for p in &mut *pressure {
            *p *= self.scale;
        }
        for chunk in pressure.chunks(LANES) {
            for (peak, p) in self.peak.iter_mut().zip(chunk) {
                *peak = greater(*peak, *p);
            }
        }
        let hardness = self.hardness;
        self.contact_nodes += pressure.iter().filter(|p| **p > 0.0).count() as f64;
        self.saturated_nodes += pressure.iter().filter(|p| **p >= hardness).count() as f64;
    }
}
