//! Counter-based random numbers for the modes of a surface.
//!
//! With a sequential generator, the surface would depend on the mesh and on the upper cutoff. Here
//! every mode (k_x, k_y) owns four words of a ChaCha8 stream. The key of the stream holds the seed
//! and the realization; k_x selects the stream and k_y the position in it. A finer mesh or a higher
//! cutoff adds modes and does not change the others.
//!
//! [`Waves`] sums the modes on a mesh with one inverse transform.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rustfft::num_complex::Complex;

use crate::fft::Transform;
use crate::threads::Threads;

/// Part of the ChaCha key that separates these random numbers from other uses of the seed. Its last
/// digit is a version.
const DOMAIN: [u8; 20] = *b"asperity mode draws1";

/// Number of 32-bit words of the ChaCha stream for each mode. They give two random numbers of 53
/// bits.
const WORDS_PER_MODE: u128 = 4;

/// Random numbers of all modes of one realization.
#[derive(Debug, Clone, PartialEq)]
pub struct Draws {
    key: [u8; 32],
}

/// Two independent uniform random numbers of one mode, which give a complex Gaussian number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeDraw {
    /// Uniform random number in (0, 1], from which the modulus is computed.
    magnitude: f64,
    /// Uniform random number in [0, 1): the phase, as a fraction of a turn.
    turn: f64,
}

impl Draws {
    pub fn new(seed: u64, realization: u32) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..12].copy_from_slice(&realization.to_le_bytes());
        key[12..].copy_from_slice(&DOMAIN);
        Self { key }
    }

    #[cfg(test)]
    pub fn mode(&self, k_x: i32, k_y: u32) -> ModeDraw {
        ModeDraw::next(&mut self.generator(k_x, k_y))
    }

    /// Iterates over the random numbers of the modes (k_x, `first`), (k_x, `first` + 1), …
    pub fn row(&self, k_x: i32, first: u32) -> impl Iterator<Item = ModeDraw> + use<> {
        let mut generator = self.generator(k_x, first);
        std::iter::repeat_with(move || ModeDraw::next(&mut generator))
    }

    fn generator(&self, k_x: i32, k_y: u32) -> ChaCha8Rng {
        let mut generator = ChaCha8Rng::from_seed(self.key);
        generator.set_stream(zigzag(k_x));
        generator.set_word_pos(WORDS_PER_MODE * u128::from(k_y));
        generator
    }
}

impl ModeDraw {
    /// Returns |z|² of a complex Gaussian number z. It is exponentially distributed with mean one.
    pub fn power(self) -> f64 {
        -libm::log(self.magnitude)
    }

    /// Returns z/|z| of the complex Gaussian number z of [`power`](Self::power). It is uniform over
    /// the unit circle and independent of |z|.
    ///
    /// z = (n₁ + i n₂)/√2, with two standard normal numbers n₁ and n₂ (Box & Muller).
    pub fn phase(self) -> Complex<f64> {
        let (sine, cosine) = libm::sincos(TAU * self.turn);
        Complex::new(cosine, sine)
    }

    fn next(generator: &mut ChaCha8Rng) -> Self {
        let mut integer = || (generator.next_u64() >> 11) as f64;
        let scale = f64::EPSILON / 2.0;
        Self {
            // The number is never zero, because `power` takes its logarithm.
            magnitude: (integer() + 1.0) * scale,
            turn: integer() * scale,
        }
    }
}

/// Maps `k` = 0, −1, 1, −2, 2, … to 0, 1, 2, 3, 4, …
fn zigzag(k: i32) -> u64 {
    let k = i64::from(k);
    ((k << 1) ^ (k >> 63)) as u64
}

/// Wave c e^(i q·x) + c* e^(−i q·x).
pub(super) struct Wave {
    /// Numbers of periods k_x and k_y ≥ 0 along both sides.
    pub waves: [i32; 2],
    /// Coefficient c.
    pub coefficient: Complex<f64>,
}

/// Sum over waves c e^(i q·x) + c* e^(−i q·x) on the nodes of a mesh, with one coefficient c per
/// wave.
pub(super) struct Waves {
    transform: Transform<f64>,
    nodes: [usize; 2],
    half: Vec<Complex<f64>>,
}

impl Waves {
    pub fn new(nodes: [usize; 2]) -> Self {
        let transform = Transform::new(nodes);
        let half = vec![Complex::default(); transform.spectrum_len()];
        Self { transform, nodes, half }
    }

    /// Adds a wave with |k_x| ≤ N_x/2 and 0 ≤ k_y ≤ N_y/2.
    pub fn add(&mut self, Wave { waves: [k_x, k_y], coefficient }: Wave) {
        let [nodes_x, nodes_y] = self.nodes;
        let columns = self.transform.spectrum_columns();
        let k_y = k_y as usize;
        self.half[row_of(k_x, nodes_x) * columns + k_y] += coefficient;
        // The half spectrum stores the opposite mode −k only in these columns. If k and −k share an
        // entry, the sum 2 Re(c) gives the same heights at the nodes as on a finer mesh.
        if k_y == 0 || 2 * k_y == nodes_y {
            self.half[row_of(-k_x, nodes_x) * columns + k_y] += coefficient.conj();
        }
    }

    /// Returns the sum of the waves at the nodes, multiplied by `factor`.
    pub fn heights(mut self, threads: &Threads, factor: f64) -> Vec<f64> {
        let mut heights = vec![0.0; self.nodes[0] * self.nodes[1]];
        let scratch = &mut self.transform.scratch_on(threads.clone());
        self.transform.inverse(&mut self.half, &mut heights, scratch);
        heights.iter_mut().for_each(|height| *height *= factor);
        heights
    }
}

/// Returns the index of the row of a spectrum with `nodes` rows that contains the signed wavenumber
/// `k_x`.
pub(super) fn row_of(k_x: i32, nodes: usize) -> usize {
    let k_x = k_x as isize;
    k_x.rem_euclid(nodes as isize) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_draws_the_same_alone_and_in_a_row() {
        let draws = Draws::new(2015, 3);
        for k_x in [-40, -1, 0, 1, 77] {
            for first in [0, 1, 15, 16, 33] {
                let row: Vec<_> = draws.row(k_x, first).take(100).collect();
                for (k_y, draw) in (first..).zip(row) {
                    assert_eq!(draws.mode(k_x, k_y), draw, "({k_x}, {k_y})");
                }
            }
        }
    }

    #[test]
    fn another_seed_realization_or_mode_draws_otherwise() {
        let draw = Draws::new(1, 0).mode(2, 3);
        let others = [
            Draws::new(2, 0).mode(2, 3),
            Draws::new(1 << 32, 0).mode(2, 3),
            Draws::new(1, 1).mode(2, 3),
            Draws::new(1, 0).mode(-2, 3),
            Draws::new(1, 0).mode(3, 3),
            Draws::new(1, 0).mode(3, 2),
            Draws::new(1, 0).mode(2, 4),
        ];
        for other in others {
            assert_ne!(draw.magnitude, other.magnitude);
            assert_ne!(draw.turn, other.turn);
        }
    }

    #[test]
    fn streams_of_opposite_wavenumbers_are_neighbours() {
        assert_eq!([0, -1, 1, -2, 2].map(zigzag), [0, 1, 2, 3, 4]);
        assert_eq!(zigzag(i32::MIN), u64::from(u32::MAX));
    }

    #[test]
    fn coefficients_are_complex_gaussian() {
        let draws = Draws::new(7, 0);
        let count = 256 * 256;
        let (mut power, mut fourth, mut sum) = (0.0, 0.0, Complex::default());
        let (mut square, mut real_fourth) = (Complex::default(), 0.0);
        for k_x in -128..128 {
            for draw in draws.row(k_x, 0).take(256) {
                let coefficient = draw.power().sqrt() * draw.phase();
                sum += coefficient;
                square += coefficient * coefficient;
                power += draw.power();
                fourth += draw.power().powi(2);
                real_fourth += coefficient.re.powi(4);
            }
        }
        let mean = |sum: f64| sum / f64::from(count);
        // The tolerances are four standard errors; the variances are 1, 2, 1, 20 and 6 in turn.
        let tolerance = |variance: f64| 4.0 * (variance / f64::from(count)).sqrt();
        assert!(mean(sum.norm()) < tolerance(1.0));
        assert!(mean(square.norm()) < tolerance(2.0));
        assert!((mean(power) - 1.0).abs() < tolerance(1.0));
        assert!((mean(fourth) - 2.0).abs() < tolerance(20.0));
        assert!((mean(real_fourth) - 0.75).abs() < tolerance(6.0));
    }

    #[test]
    fn powers_and_phases_of_neighbours_are_uncorrelated() {
        let draws = Draws::new(7, 1);
        let row: Vec<_> = draws.row(5, 0).take(20_001).collect();
        let product = |pair: &[ModeDraw]| (pair[0].power() - 1.0) * (pair[1].power() - 1.0);
        let powers: f64 = row.windows(2).map(product).sum();
        let phases: Complex<f64> =
            row.windows(2).map(|pair| pair[0].phase() * pair[1].phase().conj()).sum();
        // The tolerances are four standard errors of a sum of 20 000 terms of unit variance.
        assert!(powers.abs() < 4.0 * 20_000_f64.sqrt());
        assert!(phases.norm() < 4.0 * 20_000_f64.sqrt());
    }

    #[test]
    fn draws_have_not_changed() {
        // If this fails, every surface changes: bump the version of the stage that draws them.
        let found = [(1, 0), (0, 1), (-3, 4)].map(|(k_x, k_y)| {
            let draw = Draws::new(2015, 0).mode(k_x, k_y);
            (draw.magnitude, draw.turn)
        });
        // An independent implementation of ChaCha8 computed these numbers.
        let expected = [
            (0.6030630787277061, 0.9425794694386633),
            (0.6734914596882503, 0.6233259838074692),
            (0.9148629181923289, 0.18628381058583587),
        ];
        assert_eq!(found, expected);
    }
}
