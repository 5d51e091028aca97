//! The mean pressure that the load asks for, and counts of the nodes that bear it.

use pulp::Simd;

use super::Solver;
use super::in_order::InOrder;
use super::lanes::{LANES, Pass, greater, over_rows, total};
use crate::fft::Row;

impl Solver {
    /// Brings the pressures to the mean that the load asks for, within their bounds.
    pub(super) fn impose_load(&mut self) {
        match self.search.bound {
            None => {
                let mut pass = Scale(self.scale_to_load());
                let (threads, row_nodes) = (&self.search.threads, self.search.nodes[1]);
                over_rows(threads, &mut self.pressure, row_nodes, &mut pass);
            }
            Some(hardness) => {
                self.share_out(hardness);
            }
        }
    }

    /// Counts the nodes in contact and finds the largest pressure.
    pub(super) fn summarise(&mut self) -> PressureSummary {
        let mut pass = Count {
            hardness: self.search.ceiling(),
            contact_nodes: 0.0,
            saturated_nodes: 0.0,
            peak: [0.0; LANES],
        };
        let (threads, row_nodes) = (&self.search.threads, self.search.nodes[1]);
        over_rows(threads, &mut self.pressure, row_nodes, &mut pass);
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
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut sum);
        sum.0.total()
    }
}

/// How many nodes bear a pressure, how many the hardness, and the largest pressure.
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

/// Multiplies pressures by one factor.
struct Scale(f64);

impl Pass<f64> for Scale {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, pressure: &mut [f64]) {
        for p in pressure {
            *p *= self.0;
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self(self.0)
    }

    fn append(&mut self, _: Self) {}
}

struct Count {
    hardness: f64,
    contact_nodes: f64,
    saturated_nodes: f64,
    peak: [f64; LANES],
}

impl Pass<f64> for Count {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, pressure: &mut [f64]) {
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
        Self { contact_nodes: 0.0, saturated_nodes: 0.0, peak: [0.0; LANES], ..*self }
    }

    /// Counts are whole numbers, whose sum does not depend on the order.
    fn append(&mut self, later: Self) {
        self.contact_nodes += later.contact_nodes;
        self.saturated_nodes += later.saturated_nodes;
        for (peak, later) in self.peak.iter_mut().zip(later.peak) {
            *peak = greater(*peak, later);
        }
    }
}
