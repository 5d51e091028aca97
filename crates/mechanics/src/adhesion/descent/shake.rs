//! Perturbation of the states of symmetric surfaces.
//!
//! A descent keeps every symmetry of surface and gaps, and thus ends at a saddle point of the
//! energy if the state is unstable only against displacements without the symmetry. Small
//! displacements without any symmetry, followed by a second descent, return to a minimum and leave
//! a saddle point.

use super::{Descent, Fields};
use crate::adhesion::passes::visit;

/// Amplitude of the displacements, as a fraction of the range, or of the gap if it is smaller.
const AMPLITUDE: f64 = 0.01;

impl Descent<'_> {
    /// Displaces the open nodes of the map at random, and keeps the mean gap. No node closes.
    pub(super) fn shake(&mut self) {
        let Fields { gap, step, .. } = &mut *self.fields;
        let (threads, domain) = (self.threads, self.body.domain);
        for (node, noise) in step.iter_mut().enumerate() {
            *noise = noise_at(node / domain.mesh[1], node % domain.mesh[1], domain.mesh);
        }
        let range = self.adhesion.range();
        let amplitude =
            move |weight: f64, gap: f64| weight * AMPLITUDE * if gap < range { gap } else { range };
        let inputs = [&gap[..], &step[..]];
        let found = visit(threads, domain, inputs, [], |site, [gap, noise], []| {
            let amplitude = amplitude(site.weight, gap);
            ([], [amplitude * noise, amplitude], [0.0; 0])
        });
        let [sum, amplitudes] = found.sums;
        let mean = if amplitudes > 0.0 { sum / amplitudes } else { 0.0 };
        visit(threads, domain, [&step[..]], [&mut gap[..]], |site, [noise], [gap]| {
            let moved = if site.weight > 0.0 { amplitude(1.0, gap) * (noise - mean) } else { 0.0 };
            ([gap + moved], [0.0; 0], [0.0; 0])
        });
    }
}

/// Returns a number from −1 to 1 that depends on the node only. Blocks of all sizes contribute
/// equally, so that it contains all wavelengths.
fn noise_at(row: usize, column: usize, mesh: [usize; 2]) -> f64 {
    let levels = usize::BITS - mesh[0].max(mesh[1]).leading_zeros();
    let of_block = |level: u32| {
        let [row, column] = [row, column].map(|index| (index >> level) as u64);
        scattered(u64::from(level) << 58 ^ row << 29 ^ column)
    };
    (0..levels).map(of_block).sum::<f64>() / f64::from(levels)
}

/// Returns a number from −1 to 1 that looks random: the output function of SplitMix64.
fn scattered(seed: u64) -> f64 {
    let mut bits = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits ^ bits >> 31) as f64 / 2f64.powi(63) - 1.0
}
