//! The mean pressure that the load asks for, and what the pressures that have it are like.

use pulp::Simd;

use super::Solver;
use super::in_order::InOrder;
use super::lanes::{LANES, Pass, greater, over_rows, total};
use crate::contact::fft::Row;

impl Solver {
    /// Brings the pressure to its mean within its bounds, and says what it is like.
    pub(super) fn impose_load(&mut self) -> PressureSummary {
        let scale = match self.search.bound {
            None => self.scale_to_load(),
            Some(hardness) => {
                self.share_out(hardness);
                1.0
            }
        };
        let mut pass = ScaleAndCount {
            scale,
            hardness: self.search.ceiling(),
            contact_nodes: 0.0,
            saturated_nodes: 0.0,
            peak: [0.0; LANES],
        };
        over_rows(
            &self.search.threads,
            &mut self.pressure,
            self.search.nodes[1],
            &mut pass,
        );
        PressureSummary {
            contact_nodes: pass.contact_nodes as usize,
            saturated_nodes: pass.saturated_nodes as usize,
            peak_pressure: pass.peak.into_iter().fold(0.0, greater),
        }
    }

    /// What pressures without a bound are to be scaled by.
    fn scale_to_load(&mut self) -> f64 {
        let mut sum = self.sum_of_pressures();
        if sum <= 0.0 {
            // A search leaves nothing of a pressure too small for single precision.
            self.guess_from_heights(self.search.load);
            sum += self.sum_of_pressures();
        }
        self.search.load * self.pressure.len() as f64 / sum
    }

    fn sum_of_pressures(&mut self) -> f64 {
        let mut sum = Total(InOrder::new());
        over_rows(
            &self.search.threads,
            &mut self.pressure,
            self.search.nodes[1],
            &mut sum,
        );
        sum.0.total()
    }
}

/// A pressure at a glance.
#[derive(Debug, Clone, Copy)]
pub struct PressureSummary {
    pub contact_nodes: usize,
    pub saturated_nodes: usize,
    pub peak_pressure: f64,
}

struct Total(InOrder<f64>);

impl Pass<f64> for Total {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, values: &mut [f64]) {
        self.0.push(total(values));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self(InOrder::new())
    }

    fn append(&mut self, later: Self) {
        self.0.append(later.0);
    }
}

struct ScaleAndCount {
    scale: f64,
    hardness: f64,
    contact_nodes: f64,
    saturated_nodes: f64,
    peak: [f64; LANES],
}

impl Pass<f64> for ScaleAndCount {
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

    fn split_off(&mut self, _: Row) -> Self {
        Self {
            contact_nodes: 0.0,
            saturated_nodes: 0.0,
            peak: [0.0; LANES],
            ..*self
        }
    }

    /// Counts are whole numbers, which come to the same in any order.
    fn append(&mut self, later: Self) {
        self.contact_nodes += later.contact_nodes;
        self.saturated_nodes += later.saturated_nodes;
        for (peak, later) in self.peak.iter_mut().zip(later.peak) {
            *peak = greater(*peak, later);
        }
    }
}
