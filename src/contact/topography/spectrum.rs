//! The power spectral density of a self-affine surface, and the modes that it occupies.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::nayak::Continuum;

/// Isotropic power spectral density, eq. (PSD) of Yastrebov, Anciaux & Molinari 2015.
///
/// Constant for `k_lower ≤ |k| < k_rolloff`, proportional to `|k|^(−2(1 + hurst))` for
/// `k_rolloff ≤ |k| ≤ k_upper`, zero elsewhere; both cutoffs belong to the spectrum, which is what
/// reproduces the Nayak parameters tabulated in the paper. Wavenumbers are in units of 2π/L and
/// `1 ≤ k_lower ≤ k_rolloff ≤ k_upper`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spectrum {
    /// Hurst exponent, 0 to 1.
    pub hurst: f64,
    /// Lower cutoff.
    pub k_lower: u32,
    /// End of the plateau; equal to `k_lower` where there is none.
    pub k_rolloff: u32,
    /// Upper cutoff.
    pub k_upper: u32,
}

/// Densities of a spectrum, each computed once: the modes of a mesh are many times more than their
/// lengths, and a power costs more than drawing a mode.
#[derive(Debug, Clone)]
pub struct Densities {
    spectrum: Spectrum,
    /// By |k|²; not a number where nobody has asked.
    known: Vec<f64>,
}

/// Squared lengths above it are not remembered: they would fill memory.
const MOST_KNOWN: u64 = 1 << 20;

impl Densities {
    /// [`Spectrum::density`], to the last bit.
    pub fn at(&mut self, k_squared: u64) -> f64 {
        let Some(known) = self.known.get_mut(k_squared as usize) else {
            return self.spectrum.density(k_squared);
        };
        if known.is_nan() {
            *known = self.spectrum.density(k_squared);
        }
        *known
    }
}

/// The modes of a spectrum that share one `k_x`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeRow {
    /// Wavenumber along x, signed.
    pub k_x: i32,
    /// Wavenumbers along y, never negative.
    pub k_y: RangeInclusive<u32>,
}

impl Spectrum {
    /// Density at `|k|² = k_squared`, relative to the plateau; `k_squared` lies between the cutoffs.
    pub fn density(&self, k_squared: u64) -> f64 {
        let rolloff_squared = square(self.k_rolloff);
        if k_squared < rolloff_squared {
            return 1.0;
        }
        let ratio = k_squared as f64 / rolloff_squared as f64;
        libm::pow(ratio, -(1.0 + self.hurst))
    }

    /// Densities of many modes.
    pub fn densities(&self) -> Densities {
        let lengths = square(self.k_upper).min(MOST_KNOWN) as usize + 1;
        Densities {
            spectrum: *self,
            known: vec![f64::NAN; lengths],
        }
    }

    /// One of each pair of modes ±k: all with k_y > 0, and of those with k_y = 0 the ones with
    /// k_x > 0. Ascending in k_x, and in k_y within a row.
    pub fn rows(&self) -> impl Iterator<Item = ModeRow> + use<> {
        let (lower, upper) = (square(self.k_lower), square(self.k_upper));
        let k_upper = i64::from(self.k_upper);
        (-k_upper..=k_upper).filter_map(move |k_x| {
            let across = k_x.unsigned_abs().pow(2);
            let first = ceil_sqrt(lower.saturating_sub(across)).max(u64::from(k_x <= 0));
            let last = (upper - across).isqrt();
            (first <= last).then_some(ModeRow {
                k_x: k_x as i32,
                k_y: first as u32..=last as u32,
            })
        })
    }

    /// The same density over continuous wavenumbers, where moments have closed forms.
    pub fn continuum(&self) -> Continuum {
        let rolloff = f64::from(self.k_rolloff);
        Continuum {
            hurst: self.hurst,
            plateau: f64::from(self.k_lower) / rolloff,
            magnification: f64::from(self.k_upper) / rolloff,
        }
    }
}

fn square(k: u32) -> u64 {
    u64::from(k).pow(2)
}

fn ceil_sqrt(value: u64) -> u64 {
    let root = value.isqrt();
    root + u64::from(root * root < value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spectrum(k_lower: u32, k_rolloff: u32, k_upper: u32) -> Spectrum {
        Spectrum {
            hurst: 0.8,
            k_lower,
            k_rolloff,
            k_upper,
        }
    }

    fn modes(spectrum: &Spectrum) -> Vec<(i32, i32)> {
        let row = |row: ModeRow| row.k_y.map(move |k_y| (row.k_x, k_y as i32));
        spectrum.rows().flat_map(row).collect()
    }

    #[test]
    fn modes_are_half_of_the_annulus_cutoffs_included() {
        let half_plane = |&(k_x, k_y): &(i32, i32)| k_y > 0 || (k_y == 0 && k_x > 0);
        for (k_lower, k_upper) in [(1, 1), (1, 8), (3, 5), (5, 5), (7, 13)] {
            let k = k_upper as i32;
            let expected: Vec<_> = (-k..=k)
                .flat_map(|k_x| (-k..=k).map(move |k_y| (k_x, k_y)))
                .filter(half_plane)
                .filter(|(k_x, k_y)| {
                    let squared = (k_x * k_x + k_y * k_y) as u32;
                    (k_lower * k_lower..=k_upper * k_upper).contains(&squared)
                })
                .collect();
            assert_eq!(modes(&spectrum(k_lower, k_lower, k_upper)), expected);
        }
    }

    #[test]
    fn densities_that_are_remembered_are_those_that_are_computed() {
        let spectrum = spectrum(2, 4, 8192);
        let mut densities = spectrum.densities();
        for _ in 0..2 {
            for k_squared in [4, 15, 16, 17, MOST_KNOWN, MOST_KNOWN + 1, 1 << 26] {
                assert_eq!(densities.at(k_squared), spectrum.density(k_squared));
            }
        }
    }

    #[test]
    fn cutoffs_out_of_order_leave_no_modes() {
        assert_eq!(modes(&spectrum(8, 8, 4)), []);
    }

    #[test]
    fn density_is_flat_then_falls_with_the_hurst_exponent() {
        let spectrum = spectrum(2, 4, 64);
        assert_eq!(spectrum.density(4), 1.0);
        assert_eq!(spectrum.density(15), 1.0);
        assert_eq!(spectrum.density(16), 1.0);
        // Ten times the wavenumber of the rolloff: 10^(−3.6).
        let fallen = spectrum.density(1600);
        assert!((fallen / 10_f64.powf(-3.6) - 1.0).abs() < 1e-15);
    }
}
