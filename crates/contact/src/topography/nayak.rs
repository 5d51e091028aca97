//! Nayak's parameter and the density of summits of a spectrum over continuous wavenumbers.

use std::f64::consts::PI;

/// An isotropic spectrum of a cell much larger than its longest wavelength.
///
/// A plateau from k_lower to k_rolloff, then a power law to k_upper; both results follow from the
/// ratios of the cutoffs and the Hurst exponent, appendix A of Yastrebov, Anciaux & Molinari 2015.
/// The sum over the discrete modes of a periodic cell differs, the more the smaller `k_lower`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Continuum {
    /// Hurst exponent, 0 to 1, both limits included.
    pub hurst: f64,
    /// ξ = k_lower / k_rolloff, 0 to 1; 1 where there is no plateau.
    pub plateau: f64,
    /// ζ = k_upper / k_rolloff, at least 1.
    pub magnification: f64,
}

impl Continuum {
    /// Nayak's parameter α = m0 m4 / m2², at least 3/2.
    pub fn nayak(&self) -> f64 {
        if self.is_ring() {
            return 1.5;
        }
        1.5 * self.moment(0.0) * self.moment(4.0) / self.moment(2.0).powi(2)
    }

    /// Summits per unit area, D = √3/(18π) m4/m2, where `k_rolloff` is the angular wavenumber.
    ///
    /// With the integer wavenumber instead, the value tabulated in the paper, which is smaller than
    /// the number of summits in the cell by (2π)².
    pub fn summit_density(&self, k_rolloff: f64) -> f64 {
        let ratio = if self.is_ring() { 1.0 } else { self.moment(4.0) / self.moment(2.0) };
        3_f64.sqrt() / (24.0 * PI) * k_rolloff * k_rolloff * ratio
    }

    /// All wavenumbers alike: every moment of the ring vanishes, their ratios do not.
    fn is_ring(&self) -> bool {
        self.plateau == 1.0 && self.magnification == 1.0
    }

    /// ∫ Φ k^(order + 1) dk, wavenumbers in units of k_rolloff.
    fn moment(&self, order: f64) -> f64 {
        let plateau = -libm::expm1((order + 2.0) * libm::log(self.plateau)) / (order + 2.0);
        let log_magnification = libm::log(self.magnification);
        let exponent = (order - 2.0 * self.hurst) * log_magnification;
        // The logarithm that the power law turns into, at H = 0 in m0 and at H = 1 in m2.
        let decay = if exponent == 0.0 {
            log_magnification
        } else {
            log_magnification * libm::expm1(exponent) / exponent
        };
        plateau + decay
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn self_affine(hurst: f64, magnification: f64) -> Continuum {
        Continuum { hurst, plateau: 1.0, magnification }
    }

    fn assert_close(found: f64, exact: f64) {
        assert!((found / exact - 1.0).abs() < 1e-12, "{found} should be {exact}");
    }

    /// D in units of its value on a ring of radius k_rolloff.
    fn relative_density(continuum: Continuum) -> f64 {
        continuum.summit_density(1.0) / (3_f64.sqrt() / (24.0 * PI))
    }

    #[test]
    fn hurst_exponents_of_zero_one_half_and_one_have_closed_forms() {
        for z in [1.5, 8.0, 32.0, 512.0] {
            let (square, log) = (z * z, f64::ln(z));
            let zero = self_affine(0.0, z);
            assert_close(zero.nayak(), 1.5 * log * (square + 1.0) / (square - 1.0));
            assert_close(relative_density(zero), (square + 1.0) / 2.0);
            let half = self_affine(0.5, z);
            assert_close(half.nayak(), (square + z + 1.0) / (2.0 * z));
            assert_close(relative_density(half), (square + z + 1.0) / 3.0);
            let one = self_affine(1.0, z);
            let nayak = 0.375 * (square - 1.0).powi(2) / (square * log * log);
            assert_close(one.nayak(), nayak);
            assert_close(relative_density(one), (square - 1.0) / (2.0 * log));
        }
    }

    #[test]
    fn the_limits_in_the_hurst_exponent_are_continuous() {
        for limit in [0.0, 1.0] {
            let nearby = self_affine((limit - 1e-14_f64).abs(), 32.0);
            assert_close(nearby.nayak(), self_affine(limit, 32.0).nayak());
        }
    }

    #[test]
    fn a_single_wavelength_has_the_smallest_nayak_parameter() {
        let ring = self_affine(0.8, 1.0);
        assert_eq!(ring.nayak(), 1.5);
        assert_eq!(relative_density(ring), 1.0);
        // α − 3/2 = (ζ − 1)²/2 is below the rounding of one.
        let thin = self_affine(0.8, 1.0 + 1e-8);
        assert_close(thin.nayak(), 1.5);
        assert!((relative_density(thin) - 1.0).abs() < 1e-7);
        assert!((self_affine(0.8, 1.001).nayak() - 1.5 - 0.5e-6).abs() < 1e-9);
    }

    #[test]
    fn a_plateau_alone_goes_from_three_halves_to_two() {
        let disc = |plateau: f64| Continuum { hurst: 0.8, plateau, magnification: 1.0 };
        for x in [0.9, 0.5, 0.1] {
            let six = 1.0 - f64::powi(x, 6);
            let four = 1.0 - f64::powi(x, 4);
            assert_close(disc(x).nayak(), 2.0 * (1.0 - x * x) * six / (four * four));
            assert_close(relative_density(disc(x)), 2.0 / 3.0 * six / four);
        }
        assert_close(disc(0.0).nayak(), 2.0);
    }

    #[test]
    fn nayak_parameter_grows_as_the_magnification_to_twice_the_hurst_exponent() {
        let hurst: f64 = 0.3;
        let prefactor = 3.0 * (1.0 - hurst).powi(2) / (2.0 * hurst * (2.0 - hurst));
        let z: f64 = 1e30;
        let found = self_affine(hurst, z).nayak() / z.powf(2.0 * hurst);
        // Corrections are of relative order ζ^(−2H) = 1e-18.
        assert_close(found, prefactor);
    }

    #[test]
    fn published_table_is_reproduced_to_its_last_digit() {
        // (hurst, k_lower, k_upper, α, D) from the analytical tables of the paper.
        let cells = [
            (0.3, 1.0, 16.0, 6.43, 2.47),
            (0.3, 1.0, 512.0, 59.43, 2480.04),
            (0.3, 8.0, 64.0, 4.00, 40.94),
            (0.8, 1.0, 32.0, 28.33, 5.23),
            (0.8, 4.0, 64.0, 11.60, 23.37),
            (0.8, 1.0, 512.0, 1604.91, 1093.87),
            (0.8, 32.0, 64.0, 1.76, 52.49),
        ];
        for (hurst, k_lower, k_upper, nayak, density) in cells {
            let continuum = self_affine(hurst, k_upper / k_lower);
            assert!((continuum.nayak() - nayak).abs() < 0.00501);
            assert!((continuum.summit_density(k_lower) - density).abs() < 0.00501);
        }
    }
}
