//! What a pass over the gap reveals: the contact, its offset, and how far off it is.

use pulp::Simd;

use super::flags::PRESSED;
use super::lanes::{Lanes, total};

/// Where a search stands.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// Mean of the gap over the contact, where the rigid surface is to be shifted to.
    pub offset: f64,
    /// The largest gap in contact or penetration anywhere, measured from the offset.
    pub error: f64,
}

/// The lowest gap, and the highest in contact.
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    pub highest_in_contact: f32,
    pub lowest: f32,
}

impl Extremes {
    pub const NONE: Self = Self {
        highest_in_contact: -f32::MAX,
        lowest: f32::MAX,
    };

    pub fn seen_from(self, offset: f64) -> Standing {
        let highest = f64::from(self.highest_in_contact) - offset;
        let lowest = f64::from(self.lowest) - offset;
        Standing {
            offset,
            error: highest.max(-lowest),
        }
    }

    #[inline(always)]
    pub fn add<S: Simd, const R: usize>(
        &mut self,
        highest_in_contact: Lanes<S, R>,
        lowest: Lanes<S, R>,
    ) {
        self.highest_in_contact = self.highest_in_contact.max(highest_in_contact.highest());
        self.lowest = self.lowest.min(lowest.lowest());
    }
}

/// A standing in the making, row by row.
#[derive(Debug, Clone, Copy)]
pub struct Survey {
    pub contact_nodes: f64,
    /// Σ gap over the contact, left to whoever knows it in double precision.
    pub contact_sum: f64,
    /// Σ gap over the map, likewise, where it tells what no mean displacement is.
    pub gap_sum: Option<f64>,
    extremes: Extremes,
}

impl Survey {
    /// Nothing so far, of gaps that are to be summed or not.
    pub fn new(sums_gaps: bool) -> Self {
        Self {
            contact_nodes: 0.0,
            contact_sum: 0.0,
            gap_sum: sums_gaps.then_some(0.0),
            extremes: Extremes::NONE,
        }
    }

    /// Adds the gaps of a row, in double precision.
    #[inline(always)]
    pub fn add_gaps(&mut self, gap: &[f64]) {
        if let Some(sum) = &mut self.gap_sum {
            *sum += total(gap);
        }
    }

    /// Adds a row of gaps but to their sums, and of numbers that are marked where there is pressure.
    #[inline(always)]
    pub fn add<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        gap: &[[S::f32s; R]],
        carry: &[[S::f32s; R]],
    ) {
        let (zero, one) = (Lanes::all(simd, 0.0), Lanes::all(simd, 1.0));
        let mut nodes = zero;
        let mut highest = Lanes::all(simd, -f32::MAX);
        let mut lowest = Lanes::all(simd, f32::MAX);
        for (gap, carry) in gap.iter().zip(carry) {
            let gap = Lanes::of(simd, *gap);
            let pressed = Lanes::of(simd, *carry).has(PRESSED);
            nodes = nodes + pressed.or_zero(one);
            highest = pressed.choose(highest.max(gap), highest);
            lowest = lowest.min(gap);
        }
        self.contact_nodes += nodes.total();
        self.extremes.add(highest, lowest);
    }

    pub fn standing(&self) -> Standing {
        let offset = self.contact_sum / self.contact_nodes;
        self.extremes.seen_from(offset)
    }
}
