//! The mean pressure that the load asks for, counts of the nodes that bear it, and pressures within
//! their bounds: not above the hardness, and of that mean.
//!
//! Few nodes are in elastic contact where a material yields, strips around saturated ones. They are
//! gathered, for their pressures may have to be scaled several times.

use std::ops::RangeInclusive;

use pulp::Simd;

use super::evaluation::Evaluation;
use super::flags::{FREE, SATURATED, has};
use super::heights::range;
use super::lanes::{InOrder, LANES, Pass, Wide, greater, over_rows, sum_by, total, weight};
use super::passes::{PendingUpdate, PressureInput, ReferencePressure, promote};
use super::{Hardness, Solver};
use crate::fft::{Band, Row};

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

/// What elastic pressures are scaled by after a search, and at least in any case: if they were to
/// make still more room for saturated ones, rather all are scaled.
const SCALES: RangeInclusive<f64> = 0.5..=2.0;

/// What is left of a load by saturated nodes that bear it all.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// In so many rounds, scaling saturates the last node that it is going to, or there is hardly
/// anything to scale.
const ROUNDS: usize = 50;

impl Solver {
    /// Makes of the present pressure and gap, a solution that knew no hardness, a guess for the
    /// same load that does, and evaluates it.
    ///
    /// Pressures rise all over by what a lowered surface asks each node for, until those within
    /// their bounds bear the load: the nodes that saturate spread to where the gap is smallest.
    pub(super) fn guess_yielding(&mut self, hardness: Hardness) -> Evaluation {
        self.search.bound = Some(hardness);
        for (p, gap) in self.pressure.iter_mut().zip(&self.search.gap) {
            *p -= (f64::from(*gap) - self.offset) / self.search.nodal_compliance;
        }
        let [lowest, highest] =
            range(&self.search.threads, &mut self.pressure, self.search.nodes[1]);
        self.raise_to(self.search.load, (-highest, hardness.pressure() - lowest));
        self.impose_load();
        self.evaluate()
    }

    /// Takes over the pressure where a search led, within its bounds and of the mean asked for, but
    /// for what is to be taken back. Returns by how much elastic nodes were scaled.
    pub(super) fn promote_yielding(&mut self, hardness: Hardness, pending: PendingUpdate) -> f64 {
        let mut promote = PromoteYielding {
            hardness: hardness.pressure(),
            reference_pressure: &self.search.reference_pressure,
            pressure_increment: &self.search.pressure_increment,
            last_step: &self.search.last_step,
            tally: Tally::below(hardness.pressure()),
        };
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut promote);
        let mut tally = promote.tally;
        if pending.part < 1.0 {
            self.take_back(1.0 - pending.part);
            tally = self.tally(hardness);
        }
        if SCALES.contains(&self.scale_after(&tally)) {
            return self.share_out_after(tally);
        }
        self.shift_free_nodes(hardness);
        self.share_out(hardness)
    }

    /// Shifts the pressure of nodes that were free, within its bounds, so that it comes to what it
    /// should: there may be so few elastic nodes that these cannot make up for what others lack.
    fn shift_free_nodes(&mut self, hardness: Hardness) {
        let hardness = hardness.pressure();
        let sum: f64 = self.pressure.iter().sum();
        let missing_load = self.search.load * self.pressure.len() as f64 - sum;
        self.search.candidates.clear();
        for (p, last_step) in self.pressure.iter().zip(&self.search.last_step) {
            if has(*last_step, FREE) {
                self.search.candidates.push(*p as f32, 0.0);
            }
        }
        let Some(shift) = self.search.candidates.shift(missing_load, hardness as f32) else {
            return;
        };
        for (p, last_step) in self.pressure.iter_mut().zip(&self.search.last_step) {
            if has(*last_step, FREE) {
                *p = (*p + shift).clamp(0.0, hardness);
            }
        }
    }

    /// Begins an evaluation of the present pressure; moves are kept.
    pub(super) fn begin_with_moves_kept(&mut self, hardness: Hardness) {
        let mut pass = Wide(PressureInput {
            pressure: &self.pressure,
            hardness: hardness.pressure(),
            last_step: Band::new(&mut self.search.last_step),
            keeps_moves: true,
        });
        self.double_scratch.take_over(&mut self.search.scratch);
        self.double.begin(&mut pass, &mut self.double_scratch);
    }

    /// Scales elastic pressures so that they bear what saturated ones leave, and returns by how
    /// much; what passes the hardness on the way is saturated.
    pub(super) fn share_out(&mut self, hardness: Hardness) -> f64 {
        let tally = self.tally(hardness);
        self.share_out_after(tally)
    }

    fn share_out_after(&mut self, mut tally: Tally) -> f64 {
        let mut scaled = 1.0;
        for _ in 0..ROUNDS {
            let scale = self.scale_after(&tally);
            // Saturated nodes may bear it all.
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

    /// Finds elastic nodes; those above the hardness are brought down to it.
    fn tally(&mut self, hardness: Hardness) -> Tally {
        let mut tally = Tally::below(hardness.pressure());
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut tally);
        tally
    }

    /// By what elastic pressures are to be scaled.
    fn scale_after(&self, tally: &Tally) -> f64 {
        let total = self.search.load * self.pressure.len() as f64;
        let rest = total - tally.saturated_nodes * tally.hardness;
        let elastic = tally.elastic_sum(&self.pressure, self.search.nodes[1]);
        if rest.abs() <= ROUNDING * total {
            return if elastic == 0.0 { 1.0 } else { 0.0 };
        }
        rest / elastic
    }

    /// The same where there are too many saturated nodes, or nearly no others: with none saturated,
    /// or from the heights alone.
    fn share_out_anew(&mut self) {
        let total = self.search.load * self.pressure.len() as f64;
        let sum: f64 = self.pressure.iter().sum();
        if sum >= total {
            self.pressure.iter_mut().for_each(|p| *p *= total / sum);
        } else {
            self.guess_from_heights(self.search.load);
        }
    }
}

/// Brings pressures up to date with their search, and tallies them. Single precision knows the
/// hardness less well.
pub struct PromoteYielding<'a> {
    pub hardness: f64,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
    /// Marked where nodes are saturated.
    pub last_step: &'a [f32],
    pub tally: Tally,
}

impl Pass<f64> for PromoteYielding<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        promote(1.0, self.reference_pressure.row(row), row.of(self.pressure_increment), pressure);
        for (p, last_step) in pressure.iter_mut().zip(row.of(self.last_step)) {
            let is_saturated = has(*last_step, SATURATED) || *p > self.hardness;
            *p = if is_saturated { self.hardness } else { *p };
        }
        self.tally.add(row, pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { tally: Tally::below(self.hardness), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.tally.join(later.tally);
    }
}

/// Nodes in elastic contact, and how many saturated ones there are. As a pass of its own it brings
/// down to the hardness what is above.
pub struct Tally {
    pub hardness: f64,
    pub saturated_nodes: f64,
    /// Ascending. Meshes with more of them than this holds fit into no memory.
    elastic: Vec<u32>,
}

impl Tally {
    /// Nothing so far, under this hardness.
    pub fn below(hardness: f64) -> Self {
        Self { hardness, saturated_nodes: 0.0, elastic: Vec::new() }
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

    /// Gathers elastic nodes of no more than a group of neighbours, from the first one on.
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

    fn join(&mut self, mut later: Self) {
        self.saturated_nodes += later.saturated_nodes;
        self.elastic.append(&mut later.elastic);
    }

    /// Σ of elastic pressures: row by row, sixteen partial sums in each.
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

    /// Scales elastic pressures, and says how many nodes are saturated then that were not.
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

impl Pass<f64> for Tally {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for p in &mut *pressure {
            *p = p.min(self.hardness);
        }
        self.add(row, pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::below(self.hardness)
    }

    fn append(&mut self, later: Self) {
        self.join(later);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::lanes::over_rows;
    use crate::threads::Threads;

    #[test]
    fn elastic_nodes_are_scaled_until_they_saturate() {
        // Rows of a whole group and four nodes of the next.
        let nodes = 20;
        let mut pressure: Vec<f64> = [0.0, 0.25, 1.5, 0.5].repeat(10);
        let mut tally = Tally::below(1.0);
        over_rows(&Threads::one(), &mut pressure, nodes, &mut tally);
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
