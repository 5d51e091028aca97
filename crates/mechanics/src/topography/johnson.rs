//! Johnson's system of distributions: one member for each possible pair of skewness and kurtosis.
//!
//! A member is a function of a standard normal variable z (Johnson 1949). Up to location and scale,
//! and with a width ε > 0 and a symmetry t from 0 to 1, the members with positive skewness are
//!
//! - S_U, unbounded: e^(εz) − t e^(−εz);
//! - S_B, bounded: e^(εz)/(1 + t e^(εz));
//! - S_L, lognormal: e^(εz), the limit t = 0 of both.
//!
//! Both families are symmetric for t = 1 and approach the normal distribution for ε → 0. At a given
//! skewness, the kurtosis of S_U grows with ε, from the kurtosis of S_L without bound. That of S_B
//! falls from there to skewness² + 1, the kurtosis of a variable with two values. Members with
//! negative skewness are mirror images.

use thiserror::Error;

/// Largest |skewness| for which [`Johnson::with_moments`] finds a member.
pub const MAX_SKEWNESS: f64 = 5.0;
/// Largest kurtosis for which [`Johnson::with_moments`] finds a member.
pub const MAX_KURTOSIS: f64 = 100.0;

/// Largest |z| and step of the sums over the normal distribution. The fourth moments of S_L and S_U
/// with the largest kurtosis come from z ≈ 5 ± 3.
const RANGE: f64 = 10.0;
const STEP: f64 = 0.04;
/// Bounds of the width ε. Below the lower one, the distribution is normal. The upper one is wide
/// enough for the largest kurtosis (S_U), or steeper than the sums resolve (S_B).
const WIDTHS: [f64; 2] = [1e-4, 3.0];
const MAX_BOUNDED_WIDTH: f64 = 40.0;
/// −ln t at which S_U and S_B are lognormal to rounding errors.
const LOGNORMAL: f64 = 40.0;
/// Number of halvings of an interval that contains a root.
const HALVINGS: usize = 50;

/// Distribution of Johnson's system, up to location and scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Johnson {
    is_bounded: bool,
    is_mirrored: bool,
    /// Width ε.
    width: f64,
    /// −ln t, with the symmetry t.
    asymmetry: f64,
}

/// Reason why a pair of skewness and kurtosis has no distribution of Johnson's system.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum MomentsError {
    #[error(
        "no distribution has the skewness {skewness} and the kurtosis {kurtosis}: the kurtosis must \
         exceed skewness² + 1 = {}", skewness * skewness + 1.0
    )]
    Impossible { skewness: f64, kurtosis: f64 },
    #[error(
        "skewness {skewness} and kurtosis {kurtosis} are out of range: skewness from \
         −{MAX_SKEWNESS} to {MAX_SKEWNESS}, kurtosis up to {MAX_KURTOSIS}"
    )]
    OutOfRange { skewness: f64, kurtosis: f64 },
}

/// Checks that a distribution with this skewness and kurtosis exists and is within the bounds.
///
/// # Errors
/// Fails if kurtosis ≤ skewness² + 1, or beyond [`MAX_SKEWNESS`] and [`MAX_KURTOSIS`].
pub fn check_moments(skewness: f64, kurtosis: f64) -> Result<(), MomentsError> {
    if kurtosis <= skewness * skewness + 1.0 {
        Err(MomentsError::Impossible { skewness, kurtosis })
    } else if skewness.abs() <= MAX_SKEWNESS && kurtosis <= MAX_KURTOSIS {
        Ok(())
    } else {
        Err(MomentsError::OutOfRange { skewness, kurtosis })
    }
}

impl Johnson {
    /// Returns the member with this skewness ⟨h³⟩/⟨h²⟩^(3/2) and kurtosis ⟨h⁴⟩/⟨h²⟩², which is 3
    /// for a normal distribution.
    ///
    /// If the kurtosis is within a few hundredths of skewness² + 1, it is that of the nearest
    /// member which the sums over the normal distribution resolve.
    ///
    /// ```
    /// use asperity_mechanics::topography::johnson::Johnson;
    ///
    /// let normal = Johnson::with_moments(0.0, 3.0)?;
    /// assert!((normal.at(2.0) / normal.at(1.0) - 2.0).abs() < 1e-6);
    /// assert!(Johnson::with_moments(-2.0, 5.0).is_err(), "5 = (−2)² + 1");
    /// # Ok::<(), asperity_mechanics::topography::johnson::MomentsError>(())
    /// ```
    ///
    /// # Errors
    /// As [`check_moments`].
    pub fn with_moments(skewness: f64, kurtosis: f64) -> Result<Johnson, MomentsError> {
        check_moments(skewness, kurtosis)?;
        let normal = normal_weights();
        let lognormal = |width: f64| Johnson {
            is_bounded: false,
            is_mirrored: false,
            width,
            asymmetry: LOGNORMAL,
        };
        let wanted = skewness.abs();
        let narrowest = root(WIDTHS, |width| lognormal(width).moments(&normal)[0] < wanted);
        let is_bounded = kurtosis < lognormal(narrowest).moments(&normal)[1];
        let widest = if is_bounded { MAX_BOUNDED_WIDTH } else { WIDTHS[1] };
        let with_skewness = |width: f64| {
            let member = |asymmetry: f64| Johnson { is_bounded, asymmetry, ..lognormal(width) };
            // A step of S_B at z = 8 is as rare as rounding errors.
            let bounds = [0.0, LOGNORMAL.max(8.0 * width)];
            member(root(bounds, |asymmetry| member(asymmetry).moments(&normal)[0] < wanted))
        };
        let width = root([narrowest, widest], |width| {
            let reached = with_skewness(width).moments(&normal)[1];
            if is_bounded { reached > kurtosis } else { reached < kurtosis }
        });
        Ok(Johnson { is_mirrored: skewness < 0.0, ..with_skewness(width) })
    }

    /// Returns the value of the variable at the value `z` of the standard normal variable. It
    /// increases with `z`.
    pub fn at(&self, z: f64) -> f64 {
        if self.is_mirrored { -self.skewed_right(-z) } else { self.skewed_right(z) }
    }

    fn skewed_right(&self, z: f64) -> f64 {
        // Differences to z = 0 keep all digits of narrow distributions.
        let symmetry = libm::exp(-self.asymmetry);
        let rise = libm::expm1(self.width * z);
        if self.is_bounded {
            symmetry * rise / (1.0 + symmetry * (rise + 1.0))
        } else {
            rise - symmetry * libm::expm1(-self.width * z)
        }
    }

    /// Returns skewness and kurtosis, by sums over pairs (z, weight).
    fn moments(&self, normal: &[[f64; 2]]) -> [f64; 2] {
        let values: Vec<[f64; 2]> =
            normal.iter().map(|&[z, weight]| [self.at(z), weight]).collect();
        let mean: f64 = values.iter().map(|[value, weight]| weight * value).sum();
        let [mut second, mut third, mut fourth] = [0.0; 3];
        for [value, weight] in values {
            let deviation = value - mean;
            let square = deviation * deviation;
            second += weight * square;
            third += weight * square * deviation;
            fourth += weight * square * square;
        }
        [third / (second * second.sqrt()), fourth / (second * second)]
    }
}

/// Returns values z of a standard normal variable with their weights, which add up to one.
fn normal_weights() -> Vec<[f64; 2]> {
    let half = (RANGE / STEP) as i32;
    let weighted = (-half..=half).map(|index| {
        let z = STEP * f64::from(index);
        [z, libm::exp(-z * z / 2.0)]
    });
    let mut weighted: Vec<[f64; 2]> = weighted.collect();
    let sum: f64 = weighted.iter().map(|[_, weight]| weight).sum();
    weighted.iter_mut().for_each(|[_, weight]| *weight /= sum);
    weighted
}

/// Returns the number at which `is_below` changes from true to false, by bisection.
fn root([mut low, mut high]: [f64; 2], is_below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reached(skewness: f64, kurtosis: f64) -> [f64; 2] {
        Johnson::with_moments(skewness, kurtosis).unwrap().moments(&normal_weights())
    }

    #[test]
    fn members_have_their_skewness_and_kurtosis_in_the_whole_region() {
        for skewness in [-5.0, -2.0, -1.0, -0.3, 0.0, 0.01, 0.5, 1.5, 3.0] {
            for ratio in [1.05, 1.4, 1.6, 2.0, 3.0, 3.8] {
                let kurtosis = ratio * (skewness * skewness + 1.0);
                let [found_skewness, found_kurtosis] = reached(skewness, kurtosis);
                let case = format!("({skewness}, {kurtosis}): {found_skewness}, {found_kurtosis}");
                assert!((found_skewness - skewness).abs() < 1e-6, "{case}");
                assert!((found_kurtosis / kurtosis - 1.0).abs() < 1e-6, "{case}");
            }
        }
    }

    #[test]
    fn known_members_are_found() {
        // Lognormal: with ω = e^(ε²), skewness (ω + 2) √(ω − 1), kurtosis ω⁴ + 2ω³ + 3ω² − 3.
        let omega: f64 = libm::exp(0.25);
        let skewness = (omega + 2.0) * (omega - 1.0).sqrt();
        let kurtosis = omega.powi(4) + 2.0 * omega.powi(3) + 3.0 * omega.powi(2) - 3.0;
        let lognormal = Johnson::with_moments(skewness, kurtosis).unwrap();
        let rise = |from: f64| lognormal.at(from + 1.0) - lognormal.at(from);
        assert!((rise(1.0) / rise(0.0) / libm::exp(0.5) - 1.0).abs() < 1e-3);
        // The symmetric S_U sinh(εz) has the kurtosis (ω⁴ + 2ω² + 3)/2.
        let kurtosis = (omega.powi(4) + 2.0 * omega.powi(2) + 3.0) / 2.0;
        let symmetric = Johnson::with_moments(0.0, kurtosis).unwrap();
        let ratio = symmetric.at(2.0) / symmetric.at(1.0);
        assert!((ratio - libm::sinh(1.0) / libm::sinh(0.5)).abs() < 1e-6, "{ratio}");
    }

    #[test]
    fn mirrored_members_have_the_opposite_skewness() {
        let [left, right] =
            [-1.2, 1.2].map(|skewness| Johnson::with_moments(skewness, 5.0).unwrap());
        for z in [-3.0, -0.5, 0.1, 2.0] {
            assert_eq!(left.at(z), -right.at(-z));
        }
        let rises =
            (-50..50).all(|z| left.at(f64::from(z + 1) / 10.0) > left.at(f64::from(z) / 10.0));
        assert!(rises);
    }

    #[test]
    fn impossible_pairs_are_refused() {
        let error = Johnson::with_moments(-2.0, 4.5).unwrap_err().to_string();
        assert!(error.contains("must exceed skewness² + 1 = 5"), "{error}");
        assert!(Johnson::with_moments(0.0, 1.0).is_err());
        assert!(Johnson::with_moments(6.0, 60.0).unwrap_err().to_string().contains("−5 to 5"));
        assert!(Johnson::with_moments(f64::NAN, 3.0).is_err());
    }
}
