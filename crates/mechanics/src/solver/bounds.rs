//! Enforcement of the bounds and the mean of the pressures, and counts of nodes.
//!
//! If the material yields, few nodes are in elastic contact, in strips around saturated ones. They
//! are collected in a list, because their pressures may have to be scaled several times.

use std::ops::RangeInclusive;

use super::lanes::{
    Accumulate, LANES, Shared, for_rows, for_rows_with, greater, highest_of, sum_by, sum_rows,
    total, weight,
};
use super::passes::{PendingUpdate, promote};
use super::{Hardness, InnerSolver, Solver};
use crate::fft::Row;
use crate::solver::marks::{SATURATED, has};
use crate::threads::Threads;

impl Solver {
    /// Scales the pressures so that their mean is the load. If the hardness bounds the pressures,
    /// scales elastic pressures only.
    pub(super) fn impose_load(&mut self) {
        match self.inner.bound {
            None => {
                let scale = self.scale_to_load();
                let (threads, row_nodes) = (&self.inner.threads, self.inner.mesh.nodes[1]);
                for_rows(threads, &mut self.pressure, row_nodes, |_, pressure| {
                    pressure.iter_mut().for_each(|p| *p *= scale);
                });
            }
            Some(hardness) => {
                self.share_out(hardness);
            }
        }
    }

    /// Counts the nodes in contact and the saturated nodes, and finds the largest pressure.
    pub(super) fn summarise(&mut self) -> PressureSummary {
        let hardness = self.inner.ceiling();
        let (threads, row_nodes) = (&self.inner.threads, self.inner.mesh.nodes[1]);
        sum_rows(threads, &mut self.pressure, row_nodes, |_, pressure| PressureSummary {
            contact_nodes: pressure.iter().filter(|p| **p > 0.0).count(),
            saturated_nodes: pressure.iter().filter(|p| **p >= hardness).count(),
            peak_pressure: highest_of(pressure),
        })
    }

    /// Returns load / mean pressure, the factor of all pressures that restores the load.
    ///
    /// If no pressure is positive, first replaces the pressures by a guess from the heights.
    fn scale_to_load(&mut self) -> f64 {
        let mut sum = self.sum_of_pressures();
        if sum <= 0.0 {
            // The inner solver clears pressures that are too small for single precision.
            self.guess_from_heights(self.inner.load);
            sum += self.sum_of_pressures();
        }
        self.inner.total() / sum
    }

    fn sum_of_pressures(&mut self) -> f64 {
        let (threads, row_nodes) = (&self.inner.threads, self.inner.mesh.nodes[1]);
        sum_rows(threads, &mut self.pressure, row_nodes, |_, pressure| total(pressure))
    }
}

/// Counts of nodes with pressure and of saturated nodes, and the largest pressure.
#[derive(Debug, Clone, Copy, Default)]
pub struct PressureSummary {
    pub contact_nodes: usize,
    pub saturated_nodes: usize,
    pub peak_pressure: f64,
}

impl Accumulate for PressureSummary {
    fn add(&mut self, later: Self) {
        self.contact_nodes += later.contact_nodes;
        self.saturated_nodes += later.saturated_nodes;
        self.peak_pressure = greater(self.peak_pressure, later.peak_pressure);
    }
}

/// Range of factors by which elastic pressures may be scaled to restore the load.
///
/// Outside this range, [`Solver::promote_yielding`] first shifts the pressures of free nodes. Below
/// it, [`Solver::share_out`] changes saturated pressures, too.
const SCALES: RangeInclusive<f64> = 0.5..=2.0;

/// Fraction of the load up to which the load on elastic nodes counts as zero, because it is only a
/// rounding error.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Maximum number of times that [`Solver::share_out`] scales elastic pressures. Each time, more
/// nodes may become saturated, so that the others must bear more.
const ROUNDS: usize = 50;

impl Solver {
    /// Sets the pressures in double precision to the pressures of the inner solver after the update
    /// `pending`, within their bounds and with the load as mean.
    ///
    /// Returns the factor by which elastic pressures were scaled.
    pub(super) fn promote_yielding(&mut self, hardness: Hardness, pending: PendingUpdate) -> f64 {
        let bound = hardness.pressure();
        let (threads, row_nodes) = (&self.inner.threads, self.inner.mesh.nodes[1]);
        let reference_pressure = &self.inner.reference_pressure;
        let (increment, last_step) = (&self.inner.pressure_increment, &self.inner.last_step);
        let tally = Tally::below(bound);
        let mut tally =
            for_rows_with(threads, &mut self.pressure, row_nodes, tally, |tally, row, pressure| {
                promote(1.0, reference_pressure.row(row), row.of(increment), pressure);
                for (p, last_step) in pressure.iter_mut().zip(row.of(last_step)) {
                    // Single precision may not represent the hardness.
                    let is_saturated = has(*last_step, SATURATED) || *p > bound;
                    *p = if is_saturated { bound } else { *p };
                }
                tally.add(row, pressure);
            });
        if pending.part < 1.0 {
            self.inner.take_back(1.0 - pending.part, &mut self.pressure);
            tally = self.tally(hardness);
        }
        if SCALES.contains(&self.scale_after(&tally)) {
            return self.share_out_after(tally);
        }
        // Scaling elastic pressures alone may not suffice, because there may be too few of them.
        self.inner.shift_free_nodes(hardness.pressure(), &mut self.pressure);
        self.share_out(hardness)
    }

    /// Begins the convolution of the present pressures in double precision.
    ///
    /// Updates the flags in the last steps, but keeps the steps, unlike [`Solver::evaluate`].
    pub(super) fn begin_keeping_steps(&mut self) {
        self.double_scratch.take_over(&mut self.inner.scratch);
        self.problem
            .transform
            .begin(&mut self.inner.pressure_input(&self.pressure, true), &mut self.double_scratch);
    }

    /// Scales elastic pressures so that the mean of all pressures is the load, and returns the
    /// factor.
    ///
    /// Nodes whose pressure reaches the hardness become saturated. If the factor would be below the
    /// range [`SCALES`], redistributes the load over all nodes and returns 1.
    pub(super) fn share_out(&mut self, hardness: Hardness) -> f64 {
        let tally = self.tally(hardness);
        self.share_out_after(tally)
    }

    fn share_out_after(&mut self, mut tally: Tally) -> f64 {
        let mut scaled = 1.0;
        for _ in 0..ROUNDS {
            let scale = self.scale_after(&tally);
            // A factor of zero means that saturated nodes bear the whole load.
            let is_possible = scale >= *SCALES.start() && scale.is_finite() || scale == 0.0;
            if !is_possible {
                break;
            }
            if scale == 1.0 {
                return scaled;
            }
            let saturated = tally.scale(&mut self.pressure, scale);
            if scale == 0.0 {
                return scaled;
            }
            scaled *= scale;
            if saturated == 0 {
                return scaled;
            }
        }
        self.share_out_anew();
        1.0
    }

    /// Reduces pressures above the hardness to the hardness, and returns the elastic nodes and the
    /// number of saturated nodes.
    fn tally(&mut self, hardness: Hardness) -> Tally {
        let InnerSolver { threads, mesh, .. } = &self.inner;
        Tally::of(threads, &mut self.pressure, mesh.nodes[1], hardness.pressure())
    }

    /// Returns the factor (P − H n)/Σ p of elastic pressures p that restores the load.
    ///
    /// P is the sum of all pressures that the load requires, H the hardness, and n the number of
    /// saturated nodes. If P − H n is only a rounding error, returns 0, or 1 if elastic pressures
    /// are already zero.
    fn scale_after(&self, tally: &Tally) -> f64 {
        let total = self.inner.total();
        let rest = total - tally.saturated_nodes * tally.hardness;
        let elastic = tally.elastic_sum(&self.pressure, self.inner.mesh.nodes[1]);
        if rest.abs() <= ROUNDING * total {
            return if elastic == 0.0 { 1.0 } else { 0.0 };
        }
        rest / elastic
    }

    /// Scales all pressures, including saturated ones, down to the mean of the load. If their mean
    /// is below the load, guesses the pressures from the heights instead.
    fn share_out_anew(&mut self) {
        let total = self.inner.total();
        let sum: f64 = self.pressure.iter().sum();
        if sum >= total {
            self.pressure.iter_mut().for_each(|p| *p *= total / sum);
        } else {
            self.guess_from_heights(self.inner.load);
        }
    }
}

/// Indices of the nodes in elastic contact, and number of saturated nodes.
pub struct Tally {
    pub hardness: f64,
    pub saturated_nodes: f64,
    /// Indices of elastic nodes in ascending order. Meshes with more nodes than `u32` can index do
    /// not fit into memory.
    elastic: Vec<u32>,
}

impl Tally {
    pub fn below(hardness: f64) -> Self {
        Self { hardness, saturated_nodes: 0.0, elastic: Vec::new() }
    }

    fn of(threads: &Threads, pressure: &mut [f64], row_nodes: usize, hardness: f64) -> Self {
        for_rows_with(
            threads,
            pressure,
            row_nodes,
            Self::below(hardness),
            |tally, row, pressure| {
                for p in &mut *pressure {
                    *p = p.min(tally.hardness);
                }
                tally.add(row, pressure);
            },
        )
    }

    #[inline(always)]
    fn add(&mut self, row: Row, pressure: &[f64]) {
        let hardness = self.hardness;
        self.saturated_nodes += sum_by(pressure, pressure, |p, _| weight::<f64>(p >= hardness));
        let (groups, rest) = pressure.as_chunks::<LANES>();
        let mut first = row.range().start as u32;
        for group in groups {
            self.gather(first, group);
            first += LANES as u32;
        }
        self.gather(first, rest);
    }

    /// Appends the indices of the elastic nodes (0 < p < hardness) among at most [`LANES`] adjacent
    /// nodes. The first of these nodes has the index `first`.
    #[inline(always)]
    fn gather(&mut self, first: u32, pressures: &[f64]) {
        let mut elastic = [0; LANES];
        let mut count = 0;
        let mut any = false;
        for p in pressures {
            any |= (*p != 0.0) & (*p < self.hardness);
        }
        if !any {
            return;
        }
        for (node, p) in (first..).zip(pressures) {
            elastic[count] = node;
            count += usize::from((*p != 0.0) & (*p < self.hardness));
        }
        self.elastic.extend_from_slice(&elastic[..count]);
    }

    /// Returns the sum of `pressure` over elastic nodes, with sixteen partial sums in each row of
    /// `row_nodes` nodes.
    pub fn elastic_sum(&self, pressure: &[f64], row_nodes: usize) -> f64 {
        let mut sum = 0.0;
        for nodes in self
            .elastic
            .chunk_by(|one, next| *one as usize / row_nodes == *next as usize / row_nodes)
        {
            let mut partial = [0.0; LANES];
            for node in nodes {
                partial[*node as usize % row_nodes % LANES] += pressure[*node as usize];
            }
            sum += partial.into_iter().sum::<f64>();
        }
        sum
    }

    /// Multiplies `pressure` at elastic nodes by `scale`, clips it at the hardness, and returns the
    /// number of nodes that become saturated.
    ///
    /// These nodes are removed from the list of elastic nodes and counted as saturated.
    pub fn scale(&mut self, pressure: &mut [f64], scale: f64) -> usize {
        let before = self.elastic.len();
        let hardness = self.hardness;
        self.elastic.retain(|node| {
            let p = &mut pressure[*node as usize];
            *p *= scale;
            let stays = *p < hardness;
            *p = p.min(hardness);
            stays
        });
        let saturated = before - self.elastic.len();
        self.saturated_nodes += saturated as f64;
        saturated
    }
}

impl Shared for Tally {
    fn split_off(&mut self, _: Row) -> Self {
        Self::below(self.hardness)
    }

    fn append(&mut self, mut later: Self) {
        self.saturated_nodes += later.saturated_nodes;
        self.elastic.append(&mut later.elastic);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elastic_nodes_are_scaled_until_they_saturate() {
        // Rows of one whole group and four further nodes.
        let nodes = 20;
        let mut pressure: Vec<f64> = [0.0, 0.25, 1.5, 0.5].repeat(10);
        let mut tally = Tally::of(&Threads::one(), &mut pressure, nodes, 1.0);
        let odd = Vec::from_iter((1..40).step_by(2));
        assert_eq!((tally.saturated_nodes, &tally.elastic), (10.0, &odd));
        assert_eq!(tally.elastic_sum(&pressure, nodes), 7.5);

        assert_eq!(tally.scale(&mut pressure, 2.0), 10);
        assert_eq!(pressure, [0.0, 0.5, 1.0, 1.0].repeat(10));
        assert_eq!(tally.saturated_nodes, 20.0);
        assert_eq!(tally.elastic_sum(&pressure, nodes), 5.0);
        assert_eq!(tally.scale(&mut pressure, 1.5), 0);
    }
}
