//! Seeded random numbers, for made-up data.

use std::f64::consts::PI;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Returns `count` standard normal numbers, the same for the same seed.
pub fn normal(seed: u64, count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::from_seed([7; 32]);
    random.set_stream(seed);
    // Odd multiples of 2⁻⁵⁴: never zero.
    let mut uniform = || ((random.next_u64() >> 11) as f64 + 0.5) * 2f64.powi(-53);
    (0..count)
        .map(|_| {
            let (radius, angle) = (libm::sqrt(-2.0 * libm::log(uniform())), 2.0 * PI * uniform());
            radius * libm::cos(angle)
        })
        .collect()
}
