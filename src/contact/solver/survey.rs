//! What a pass over the gap reveals: the contact, its level, and how far off it is.

use super::lanes::{LANES, greater, lesser, weight};
use crate::contact::fft::Real;

/// Where a search stands.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// Mean of the gap over the contact, where the rigid surface is to be shifted to.
    pub level: f64,
    /// The largest gap in contact or penetration anywhere, measured from the level.
    pub error: f64,
}

/// A standing in the making, row by row.
pub struct Survey<T> {
    contact_nodes: usize,
    contact_sum: f64,
    highest_in_contact: [T; LANES],
    lowest: [T; LANES],
}

impl<T: Real> Survey<T> {
    pub fn new() -> Self {
        Self {
            contact_nodes: 0,
            contact_sum: 0.0,
            highest_in_contact: [-T::MAX; LANES],
            lowest: [T::MAX; LANES],
        }
    }

    /// Adds a row: where it carries pressure, and its gap.
    #[inline(always)]
    pub fn add(&mut self, contact: &[bool], gap: &[T]) {
        self.contact_nodes += contact.iter().filter(|contact| **contact).count();
        let (contact, contact_rest) = contact.as_chunks::<LANES>();
        let (gap, gap_rest) = gap.as_chunks::<LANES>();
        let mut sum = [T::zero(); LANES];
        // Copies, which stay in registers as fields would not.
        let (mut highest, mut lowest) = (self.highest_in_contact, self.lowest);
        let mut node = |lane: usize, contact: bool, gap: T| {
            let weight = weight::<T>(contact);
            sum[lane] = sum[lane] + weight * gap;
            highest[lane] = greater(highest[lane], gap - (T::one() - weight) * T::MAX);
            lowest[lane] = lesser(lowest[lane], gap);
        };
        for (contact, gap) in contact.iter().zip(gap) {
            for lane in 0..LANES {
                node(lane, contact[lane], gap[lane]);
            }
        }
        for (lane, (contact, gap)) in contact_rest.iter().zip(gap_rest).enumerate() {
            node(lane, *contact, *gap);
        }
        self.contact_sum += sum.into_iter().map(Into::into).sum::<f64>();
        (self.highest_in_contact, self.lowest) = (highest, lowest);
    }

    pub fn standing(&self) -> Standing {
        let level = self.contact_sum / self.contact_nodes as f64;
        let highest: f64 = self
            .highest_in_contact
            .into_iter()
            .fold(-T::MAX, greater)
            .into();
        let lowest: f64 = self.lowest.into_iter().fold(T::MAX, lesser).into();
        Standing {
            level,
            error: (highest - level).max(level - lowest),
        }
    }
}
