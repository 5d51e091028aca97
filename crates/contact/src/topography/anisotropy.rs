//! Surfaces that are longer in one direction: a grain.

use std::f64::consts::FRAC_1_SQRT_2;

use serde::{Deserialize, Serialize};

/// An isotropic surface that has been stretched along one direction.
///
/// Its power spectral density at the wavevector k is that of the isotropic surface at
/// k′ = (ratio × k∥, k⊥), of which k∥ = k_x cos θ + k_y sin θ lies along the grain and
/// k⊥ = k_y cos θ − k_x sin θ across: wavelengths, and with them correlation lengths, are `ratio`
/// times as long along the grain, and across it what they were. Mean square slopes along and across
/// are as 1 to ratio².
///
/// Holding one means: the ratio is above one, and the angle from 0 up to but not with 180 degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anisotropy {
    #[serde(rename = "anisotropy_ratio")]
    ratio: f64,
    #[serde(rename = "anisotropy_angle")]
    angle: f64,
}

/// |k′|² = xx k_x² + 2 xy k_x k_y + yy k_y².
#[derive(Debug, Clone, Copy)]
pub(super) struct SquareLength {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Anisotropy {
    /// Correlation lengths along the grain are `ratio` times those across, the grain at an angle from
    /// the x axis in degrees; none where both are alike.
    ///
    /// Ratios below one are those of a grain at right angles to it.
    ///
    /// ```
    /// use asperity_contact::topography::anisotropy::Anisotropy;
    ///
    /// assert_eq!(Anisotropy::new(1.0, 30.0), None);
    /// assert_eq!(Anisotropy::new(0.5, 30.0), Anisotropy::new(2.0, 120.0));
    /// assert_eq!(Anisotropy::new(2.0, -60.0), Anisotropy::new(2.0, 120.0));
    /// ```
    pub fn new(ratio: f64, angle: f64) -> Option<Self> {
        let (ratio, angle) = match ratio < 1.0 {
            true => (1.0 / ratio, angle + 90.0),
            false => (ratio, angle),
        };
        let angle = angle.rem_euclid(180.0);
        (ratio > 1.0).then_some(Self { ratio, angle })
    }

    /// How many times longer wavelengths are along the grain than across.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Direction of the grain from the x axis, in degrees.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    pub(super) fn square_length(&self) -> SquareLength {
        let (sine, cosine) = match self.angle {
            // Exactly, so that cutoffs hold to the wave.
            45.0 => (FRAC_1_SQRT_2, FRAC_1_SQRT_2),
            90.0 => (1.0, 0.0),
            135.0 => (FRAC_1_SQRT_2, -FRAC_1_SQRT_2),
            angle => libm::sincos(angle.to_radians()),
        };
        let square = self.ratio * self.ratio;
        SquareLength {
            xx: square * cosine * cosine + sine * sine,
            xy: (square - 1.0) * cosine * sine,
            yy: square * sine * sine + cosine * cosine,
        }
    }
}

impl SquareLength {
    /// Without a grain.
    pub const ISOTROPIC: Self = Self { xx: 1.0, xy: 0.0, yy: 1.0 };

    /// Of a wavevector.
    pub fn of(&self, [x, y]: [f64; 2]) -> f64 {
        // In this order, x and y may change places.
        self.xx * (x * x) + self.yy * (y * y) + 2.0 * self.xy * (x * y)
    }

    /// The largest components of any wavevector whose length is at most one.
    pub fn most(&self) -> [f64; 2] {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        [self.yy, self.xx].map(|other| (other / determinant).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square_length(ratio: f64, angle: f64) -> SquareLength {
        Anisotropy::new(ratio, angle).unwrap().square_length()
    }

    #[test]
    fn wavevectors_along_the_grain_count_for_longer_ones() {
        for angle in [0.0, 20.0, 90.0, 135.0] {
            let length = square_length(3.0, angle);
            let (sine, cosine) = f64::to_radians(angle).sin_cos();
            assert!((length.of([cosine, sine]) - 9.0).abs() < 1e-14);
            assert!((length.of([-sine, cosine]) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn along_an_axis_lengths_are_exact() {
        assert_eq!(square_length(2.0, 0.0).of([3.0, 4.0]), 52.0);
        assert_eq!(square_length(2.0, 90.0).of([3.0, 4.0]), 73.0);
        assert_eq!(SquareLength::ISOTROPIC.of([3.0, 4.0]), 25.0);
    }

    #[test]
    fn no_wavevector_within_the_ellipse_goes_beyond_its_box() {
        for angle in [0.0, 30.0, 45.0, 90.0, 100.0] {
            let length = square_length(2.5, angle);
            let most = length.most();
            let mut reached = [0.0_f64; 2];
            for turn in 0..36000 {
                let (y, x) = f64::to_radians(f64::from(turn) / 100.0).sin_cos();
                let scale = length.of([x, y]).sqrt();
                reached = [reached[0].max(x / scale), reached[1].max(y / scale)];
            }
            for (reached, most) in reached.into_iter().zip(most) {
                assert!(reached <= most * (1.0 + 1e-12) && reached > most * 0.9999);
            }
        }
    }
}
