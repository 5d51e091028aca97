//! What a pass over the gap reveals: the contact, its offset, and how far off it is.

use pulp::Simd;

use super::flags::{PRESSED, SATURATED, has};
use super::in_order::Found;
use super::lanes::{Lanes, sum_by, total, weight};

/// Where a search stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Mean of the gap over the contact, but where the material yields: where the rigid surface is
    /// to be shifted to.
    pub offset: f64,
    /// The largest gap in contact, or penetration anywhere but where the material yields, measured
    /// from the offset.
    pub error: f64,
}

/// The lowest gap but of saturated nodes, and the highest in contact.
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    pub highest_in_contact: f32,
    pub lowest: f32,
}

impl Extremes {
    pub const NONE: Self = Self { highest_in_contact: -f32::MAX, lowest: f32::MAX };

    /// An offset that contradicts the least, where all contact is saturated.
    pub fn middle(self) -> f64 {
        let highest = f64::from(self.highest_in_contact);
        if self.lowest == Self::NONE.lowest {
            return highest;
        }
        0.5 * (highest + f64::from(self.lowest))
    }

    pub fn seen_from(self, offset: f64) -> Standing {
        let highest = f64::from(self.highest_in_contact) - offset;
        let lowest = f64::from(self.lowest) - offset;
        Standing { offset, error: highest.max(-lowest) }
    }

    #[inline(always)]
    pub fn of<S: Simd, const R: usize>(
        highest_in_contact: Lanes<S, R>,
        lowest: Lanes<S, R>,
    ) -> Self {
        Self { highest_in_contact: highest_in_contact.highest(), lowest: lowest.lowest() }
    }

    #[inline(always)]
    pub fn add(&mut self, others: Self) {
        self.highest_in_contact = self.highest_in_contact.max(others.highest_in_contact);
        self.lowest = self.lowest.min(others.lowest);
    }
}

/// A standing in the making, row by row.
#[derive(Debug, Clone, Copy)]
pub struct Survey {
    pub contact_nodes: f64,
    /// Of these, the ones that are not saturated.
    pub elastic_nodes: f64,
    /// Σ gap over elastic nodes, left to whoever knows it in double precision,
    pub elastic_sum: f64,
    /// and over saturated ones.
    pub saturated_sum: f64,
    /// Σ gap over the map, likewise, where it tells what no mean displacement is.
    pub gap_sum: Option<f64>,
    extremes: Extremes,
}

impl Found for Survey {
    const NOTHING: Self = Self {
        contact_nodes: 0.0,
        elastic_nodes: 0.0,
        elastic_sum: 0.0,
        saturated_sum: 0.0,
        gap_sum: None,
        extremes: Extremes::NONE,
    };

    fn add(&mut self, later: Self) {
        self.contact_nodes += later.contact_nodes;
        self.elastic_nodes += later.elastic_nodes;
        self.elastic_sum += later.elastic_sum;
        self.saturated_sum += later.saturated_sum;
        if let Some(sum) = later.gap_sum {
            self.gap_sum = Some(self.gap_sum.unwrap_or(0.0) + sum);
        }
        self.extremes.add(later.extremes);
    }
}

impl Survey {
    /// Nothing so far, of gaps that are to be summed or not.
    pub fn new(sums_gaps: bool) -> Self {
        Self { gap_sum: sums_gaps.then_some(0.0), ..Self::NOTHING }
    }

    /// Adds a row of gaps, in double precision, and of numbers that are marked by pressure.
    #[inline(always)]
    pub fn add_gaps<const YIELDS: bool>(&mut self, gap: &[f64], carry: &[f32]) {
        self.elastic_sum += sum_by(gap, carry, |gap, carry| {
            let is_elastic = has(carry, PRESSED) && !(YIELDS && has(carry, SATURATED));
            weight::<f64>(is_elastic) * gap
        });
        if YIELDS {
            self.saturated_sum +=
                sum_by(gap, carry, |gap, carry| weight::<f64>(has(carry, SATURATED)) * gap);
        }
        if let Some(sum) = &mut self.gap_sum {
            *sum += total(gap);
        }
    }

    /// Adds a row of gaps but to their sums, and of numbers that are marked by pressure.
    #[inline(always)]
    pub fn add<S: Simd, const R: usize, const YIELDS: bool>(
        &mut self,
        simd: S,
        gap: &[[S::f32s; R]],
        carry: &[[S::f32s; R]],
    ) {
        let (zero, one) = (Lanes::all(simd, 0.0), Lanes::all(simd, 1.0));
        let mut nodes = zero;
        let mut saturated_nodes = zero;
        let mut highest = Lanes::all(simd, -f32::MAX);
        let mut lowest = Lanes::all(simd, f32::MAX);
        for (gap, carry) in gap.iter().zip(carry) {
            let (gap, carry) = (Lanes::of(simd, *gap), Lanes::of(simd, *carry));
            let pressed = carry.has(PRESSED);
            nodes = nodes + pressed.or_zero(one);
            highest = pressed.choose(highest.max(gap), highest);
            let lower = lowest.min(gap);
            if YIELDS {
                let saturated = carry.has(SATURATED);
                saturated_nodes = saturated_nodes + saturated.or_zero(one);
                lowest = saturated.choose(lowest, lower);
            } else {
                lowest = lower;
            }
        }
        let nodes = nodes.total();
        self.contact_nodes += nodes;
        self.elastic_nodes += nodes - saturated_nodes.total();
        self.extremes.add(Extremes::of(highest, lowest));
    }

    pub fn saturated_nodes(&self) -> f64 {
        self.contact_nodes - self.elastic_nodes
    }

    pub fn standing(&self) -> Standing {
        let offset = if self.elastic_nodes > 0.0 || self.contact_nodes == 0.0 {
            self.elastic_sum / self.elastic_nodes
        } else {
            self.extremes.middle()
        };
        self.extremes.seen_from(offset)
    }
}
