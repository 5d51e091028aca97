//! Isotropic power spectral densities that are given by numbers.
//!
//! Densities are C(q) of angular wavenumbers with ∫ C d²q/(2π)² = h_rms², and zero beyond the
//! wavenumbers that are given.

use thiserror::Error;

/// How far, as a share of it, a wavenumber may be from one that is given and still be that one: what
/// twelve digits of a number that a person writes out leave.
const ROUNDING: f64 = 1e-9;

/// An isotropic power spectral density.
///
/// Holding one means: wavenumbers are positive and ascend, densities are finite, not negative, and
/// some are positive.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralDensity(Shape);

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    /// Wavenumbers and densities, between which the logarithm of the density is linear in that of
    /// the wavenumber; where a neighbour is zero, so is the density.
    Points(Vec<[f64; 2]>),
    /// Densities of rings by their number: wavenumbers that are that many steps, to the nearest.
    Rings { step: f64, densities: Vec<f64> },
}

/// Why numbers are no spectral density.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum SpectralDensityError {
    #[error("{found} wavenumbers are no spectrum, it takes at least 2")]
    TooFew { found: usize },
    #[error("wavenumber {number} is {wavenumber:?}, it must be positive and above those before")]
    Wavenumber { number: usize, wavenumber: f64 },
    #[error("density {number} is {density:?}, it must be finite and not negative")]
    Density { number: usize, density: f64 },
    #[error("every density is zero")]
    Flat,
}

impl SpectralDensity {
    /// A density that is known at some wavenumbers, and between them by a power law from each to the
    /// next.
    ///
    /// # Errors
    /// When wavenumbers are fewer than two or do not ascend, or a density is none.
    pub fn through(points: Vec<[f64; 2]>) -> Result<Self, SpectralDensityError> {
        if points.len() < 2 {
            let found = points.len();
            return Err(SpectralDensityError::TooFew { found });
        }
        let mut before = 0.0;
        for (number, &[wavenumber, _]) in (1..).zip(&points) {
            if !(wavenumber.is_finite() && wavenumber > before) {
                return Err(SpectralDensityError::Wavenumber { number, wavenumber });
            }
            before = wavenumber;
        }
        check_densities(points.iter().map(|&[_, density]| density))?;
        Ok(Self(Shape::Points(points)))
    }

    /// The mean densities of rings of wavenumbers, each as wide as `step` about so many steps: every
    /// mode has the density of its ring. Rings that are not named have none.
    ///
    /// On a cell of the side L = 2π/step surfaces have the density of every ring on average, where a
    /// curve through the rings would not: within the first few the density falls by more than half.
    ///
    /// # Errors
    /// When a density is none.
    pub fn of_rings(
        step: f64,
        rings: impl IntoIterator<Item = (u32, f64)>,
    ) -> Result<Self, SpectralDensityError> {
        let mut densities = Vec::new();
        for (ring, density) in rings {
            let ring = ring as usize;
            densities.resize(densities.len().max(ring + 1), 0.0);
            densities[ring] = density;
        }
        check_densities(densities.iter().copied())?;
        Ok(Self(Shape::Rings { step, densities }))
    }

    /// The same surface in a unit of length of which there are `factor` in the unit so far.
    #[must_use]
    pub fn in_unit(mut self, factor: f64) -> Self {
        let square = factor * factor;
        let fourth = square * square;
        match &mut self.0 {
            Shape::Points(points) => {
                for [wavenumber, density] in points {
                    *wavenumber /= factor;
                    *density *= fourth;
                }
            }
            Shape::Rings { step, densities } => {
                *step /= factor;
                densities.iter_mut().for_each(|density| *density *= fourth);
            }
        }
        self
    }

    /// C(q); zero where nothing is known.
    pub fn at(&self, wavenumber: f64) -> f64 {
        match &self.0 {
            Shape::Rings { step, densities } => {
                let ring = (wavenumber / step).round() as usize;
                densities.get(ring).copied().unwrap_or(0.0)
            }
            Shape::Points(points) => {
                let next = points.partition_point(|&[known, _]| known < wavenumber);
                let is_at = |known: f64| (wavenumber / known - 1.0).abs() <= ROUNDING;
                match (next.checked_sub(1).map(|left| points[left]), points.get(next)) {
                    (_, Some(&[known, density])) if is_at(known) => density,
                    (Some([known, density]), _) if is_at(known) => density,
                    (Some(left), Some(&right)) => between(left, right, wavenumber),
                    _ => 0.0,
                }
            }
        }
    }

    /// The smallest and the largest wavenumber that may have a density.
    pub fn range(&self) -> [f64; 2] {
        match &self.0 {
            Shape::Points(points) => [points[0][0], points[points.len() - 1][0]],
            Shape::Rings { step, densities } => [0.5 * step, (densities.len() as f64 - 0.5) * step],
        }
    }
}

/// The power law through two points.
fn between([left, low]: [f64; 2], [right, high]: [f64; 2], wavenumber: f64) -> f64 {
    if low == 0.0 || high == 0.0 {
        return 0.0;
    }
    let share = log_ratio(wavenumber, left) / log_ratio(right, left);
    let rise = share * log_ratio(high, low);
    let factor = libm::exp(rise);
    match factor.is_finite() && factor > 0.0 {
        true => low * factor,
        false => libm::exp(libm::log(low) + rise),
    }
}

/// ln(a/b), also where the ratio is no number of double precision.
fn log_ratio(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    match ratio.is_finite() && ratio > 0.0 {
        true => libm::log(ratio),
        false => libm::log(a) - libm::log(b),
    }
}

fn check_densities(densities: impl Iterator<Item = f64>) -> Result<(), SpectralDensityError> {
    let mut is_flat = true;
    for (number, density) in (1..).zip(densities) {
        if !(density.is_finite() && density >= 0.0) {
            return Err(SpectralDensityError::Density { number, density });
        }
        is_flat &= density == 0.0;
    }
    match is_flat {
        true => Err(SpectralDensityError::Flat),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn power_law(exponent: f64, waves: [f64; 2]) -> SpectralDensity {
        let point = |k: f64| [TAU * k, 1e-6 * libm::pow(k, -exponent)];
        SpectralDensity::through(waves.map(point).to_vec()).unwrap()
    }

    #[test]
    fn between_two_points_the_density_is_a_power_law() {
        let density = power_law(3.6, [1.0, 100.0]);
        for k in [1.0, 1.7, 10.0, 99.0, 100.0] {
            let exact = 1e-6 * libm::pow(k, -3.6);
            assert!((density.at(TAU * k) / exact - 1.0).abs() < 1e-13);
        }
        assert_eq!(density.at(TAU * 0.999), 0.0);
        assert!(density.at(TAU * (1.0 - 1e-12)) > 0.0);
        assert_eq!(density.at(TAU * 100.001), 0.0);
    }

    #[test]
    fn a_power_law_goes_on_where_its_ratios_are_beyond_double_precision() {
        let falling = vec![[1e-200, 1e200], [1e200, 1e-200]];
        let rising = vec![[1e-200, 1e-200], [1e200, 1e200]];
        for q in [1e-199, 1e-3, 1.0, 1e199] {
            let at = |points: &[[f64; 2]]| SpectralDensity::through(points.to_vec()).unwrap().at(q);
            assert!((at(&falling) * q - 1.0).abs() < 1e-12, "{q}");
            assert!((at(&rising) / q - 1.0).abs() < 1e-12, "{q}");
        }
    }

    #[test]
    fn a_density_beside_zero_is_zero() {
        let points = vec![[1.0, 2.0], [2.0, 0.0], [3.0, 1.0], [4.0, 1.0]];
        let density = SpectralDensity::through(points).unwrap();
        let found = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5].map(|q| density.at(q));
        assert_eq!(found, [2.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn numbers_that_are_no_density_are_refused() {
        let found = |points: Vec<[f64; 2]>| SpectralDensity::through(points).unwrap_err();
        let number = 2;
        assert_eq!(found(vec![[1.0, 1.0]]), SpectralDensityError::TooFew { found: 1 });
        assert_eq!(
            found(vec![[1.0, 1.0], [1.0, 1.0]]),
            SpectralDensityError::Wavenumber { number, wavenumber: 1.0 }
        );
        assert_eq!(
            found(vec![[1.0, 1.0], [2.0, -1.0]]),
            SpectralDensityError::Density { number, density: -1.0 }
        );
        assert_eq!(found(vec![[1.0, 0.0], [2.0, 0.0]]), SpectralDensityError::Flat);
    }
}
