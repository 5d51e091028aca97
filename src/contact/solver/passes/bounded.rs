//! Pressures up to the hardness: brought up to date with a search, added up, and scaled.

use pulp::Simd;

use super::super::flags::{SATURATED, has};
use super::super::in_order::InOrder;
use super::super::lanes::{LANES, Pass, greater, sum_by, weight};
use super::base::Base;
use super::evaluate::promote;
use crate::contact::fft::Row;

/// Brings pressures up to date with their search, and adds them up. Single precision knows the hardness
/// less well.
pub struct PromoteYielding<'a> {
    pub hardness: f64,
    pub base: &'a Base,
    pub increment: &'a [f32],
    /// Marked where nodes are saturated.
    pub carry: &'a [f32],
    pub tally: Tally,
}

impl Pass<f64> for PromoteYielding<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        promote(1.0, self.base.row(row), row.of(self.increment), pressure);
        for (p, carry) in pressure.iter_mut().zip(row.of(self.carry)) {
            let is_saturated = has(*carry, SATURATED) || *p > self.hardness;
            *p = if is_saturated { self.hardness } else { *p };
        }
        self.tally.add(pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self {
            tally: Tally::below(self.hardness),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.tally.join(later.tally);
    }
}

/// Σ of elastic pressures, and how many others there are. As a pass of its own it brings down to the
/// hardness what is above.
pub struct Tally {
    pub hardness: f64,
    pub elastic: InOrder<f64>,
    pub saturated_nodes: f64,
}

impl Tally {
    /// Nothing so far, under this hardness.
    pub fn below(hardness: f64) -> Self {
        Self {
            hardness,
            elastic: InOrder::new(),
            saturated_nodes: 0.0,
        }
    }

    #[inline(always)]
    fn add(&mut self, pressure: &[f64]) {
        let hardness = self.hardness;
        self.elastic.push(sum_by(pressure, pressure, |p, _| {
            weight::<f64>(p < hardness) * p
        }));
        self.saturated_nodes += sum_by(pressure, pressure, |p, _| weight::<f64>(p >= hardness));
    }

    fn join(&mut self, later: Self) {
        self.elastic.append(later.elastic);
        self.saturated_nodes += later.saturated_nodes;
    }
}

impl Pass<f64> for Tally {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, pressure: &mut [f64]) {
        for p in &mut *pressure {
            *p = p.min(self.hardness);
        }
        self.add(pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::below(self.hardness)
    }

    fn append(&mut self, later: Self) {
        self.join(later);
    }
}

/// Scales elastic pressures.
pub struct ScaleElastic {
    pub scale: f64,
    pub hardness: f64,
    /// Of what was scaled, lane by lane.
    pub highest: [f64; LANES],
}

impl ScaleElastic {
    #[inline(always)]
    fn scale(&mut self, pressure: &mut [f64]) {
        for (highest, p) in self.highest.iter_mut().zip(pressure) {
            let is_elastic = *p < self.hardness;
            *p *= if is_elastic { self.scale } else { 1.0 };
            *highest = greater(*highest, weight::<f64>(is_elastic) * *p);
        }
    }
}

impl Pass<f64> for ScaleElastic {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, pressure: &mut [f64]) {
        let (chunks, rest) = pressure.as_chunks_mut::<LANES>();
        for chunk in chunks {
            self.scale(chunk);
        }
        self.scale(rest);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self {
            highest: [0.0; LANES],
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        for (highest, later) in self.highest.iter_mut().zip(later.highest) {
            *highest = greater(*highest, later);
        }
    }
}
