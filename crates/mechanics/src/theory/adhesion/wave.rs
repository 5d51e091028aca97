//! Adhesive contact of a wavy surface h = D cos(2πx/λ) with a half-space (Johnson, *Int. J. Solids
//! Struct.* 32, 1995, 423).
//!
//! The attraction has a short range: it acts at the edges of the strips of contact only. The strips
//! have the half width b, with ψ = πb/λ. The mean pressure p, in units of the load p* = π E* D/λ of
//! full contact without adhesion, is
//!
//! p/p* = sin² ψ − α √(tan ψ), α² = 2 w λ/(π² E* D²).
//!
//! From pull-off on, where p is lowest, the strips grow with the load up to the largest p, and then
//! jump to full contact. Above α = 0.569877, this happens without any load. Above α = 1.065206, no
//! strip is stable.

use std::f64::consts::PI;

/// Ratio α of the work of adhesion to the elastic energy of flattening the wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JohnsonWave {
    alpha: f64,
}

/// Mean pressure in units of p*, and half width of the contact in units of the wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveState {
    /// Mean pressure in units of p*.
    pub pressure: f64,
    /// Half width of the strip of contact in units of the wavelength.
    pub half_width: f64,
}

const HALVINGS: u32 = 100;

/// Number of intervals of ψ in which a change of the slope is looked for.
const INTERVALS: u32 = 20_000;

impl JohnsonWave {
    /// Creates the wave of amplitude D and wavelength λ from its work of adhesion, in units of E*
    /// times the unit of the lengths.
    pub fn new(amplitude: f64, wavelength: f64, work: f64) -> Self {
        Self::from_alpha((2.0 * work * wavelength).sqrt() / (PI * amplitude))
    }

    /// Creates the wave from α.
    ///
    /// # Panics
    ///
    /// Panics if α is negative or not finite.
    pub fn from_alpha(alpha: f64) -> Self {
        assert!(alpha >= 0.0 && alpha.is_finite(), "α must not be negative");
        Self { alpha }
    }

    /// Returns α.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Returns the mean pressure, in units of p*, at a half width between 0 and ½ wavelength.
    ///
    /// ```
    /// use asperity_mechanics::theory::adhesion::wave::JohnsonWave;
    ///
    /// // At α = ½ and no load, half of the surface is in contact.
    /// let wave = JohnsonWave::from_alpha(0.5);
    /// assert!(wave.pressure(0.25).abs() < 1e-15);
    /// ```
    pub fn pressure(&self, half_width: f64) -> f64 {
        let angle = PI * half_width;
        libm::sin(angle).powi(2) - self.alpha * libm::tan(angle).sqrt()
    }

    /// Returns the state of pull-off under a load, or `None` if no strip is stable.
    pub fn pull_off(&self) -> Option<WaveState> {
        self.extremes().map(|[lowest, _]| lowest)
    }

    /// Returns the state from which the contact jumps to full contact, or `None` if no strip is
    /// stable.
    pub fn jump_to_full_contact(&self) -> Option<WaveState> {
        self.extremes().map(|[_, highest]| highest)
    }

    /// Returns the half width of the stable strip under a mean pressure in units of p*, or `None`
    /// if the bodies are apart or in full contact under it.
    pub fn half_width(&self, pressure: f64) -> Option<f64> {
        let [lowest, highest] = self.extremes()?;
        if !(lowest.pressure..=highest.pressure).contains(&pressure) {
            return None;
        }
        let is_wider = |half_width| self.pressure(half_width) > pressure;
        Some(bisect(lowest.half_width, highest.half_width, is_wider))
    }

    fn extremes(&self) -> Option<[WaveState; 2]> {
        if self.alpha == 0.0 {
            let state = |half_width, pressure| WaveState { pressure, half_width };
            return Some([state(0.0, 0.0), state(0.5, 1.0)]);
        }
        // The pressure rises with ψ where 4 sin^(3/2) ψ cos^(5/2) ψ > α, between two zeros.
        let rises = |half_width: f64| {
            let (sine, cosine) = libm::sincos(PI * half_width);
            4.0 * libm::pow(sine, 1.5) * libm::pow(cosine, 2.5) > self.alpha
        };
        let at = |interval: u32| 0.5 * f64::from(interval) / f64::from(INTERVALS);
        let rising = (1..INTERVALS).map(at).find(|half_width| rises(*half_width))?;
        let state = |half_width| WaveState { pressure: self.pressure(half_width), half_width };
        Some([
            state(bisect(0.0, rising, rises)),
            state(bisect(rising, 0.5, |half_width| !rises(half_width))),
        ])
    }
}

/// Returns the number between `low` and `high` from which on `is_above` is true.
fn bisect(mut low: f64, mut high: f64, is_above: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_above(middle) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wave_of_johnson_pulls_off_and_jumps_where_the_pressure_is_extreme() {
        // reference/adhesion/johnson_1995.csv of the project.
        for [alpha, pull_off, width, jump, width_there, at_no_load] in [
            [0.05, -0.00871143581, 0.0171940464, 0.850777957, 0.444037253, 0.0434712243],
            [0.2, -0.0556107121, 0.0440390122, 0.553651755, 0.39931481, 0.113649332],
            [0.4, -0.141592004, 0.0722289763, 0.235628669, 0.361234858, 0.197552594],
            [0.6, -0.246526707, 0.0991576921, -0.0392990716, 0.32847365, f64::NAN],
        ] {
            let wave = JohnsonWave::from_alpha(alpha);
            // At an extreme, the half width has half the digits of the pressure.
            let close = |found: f64, expected: f64| {
                assert!((found - expected).abs() < 1e-6, "{alpha}: {found} {expected}");
            };
            let (lowest, highest) =
                (wave.pull_off().unwrap(), wave.jump_to_full_contact().unwrap());
            close(lowest.pressure, pull_off);
            close(lowest.half_width, width);
            close(highest.pressure, jump);
            close(highest.half_width, width_there);
            match wave.half_width(0.0) {
                Some(found) => close(found, at_no_load),
                None => assert!(at_no_load.is_nan()),
            }
        }
    }

    #[test]
    fn without_adhesion_the_wave_is_that_of_westergaard() {
        let wave = JohnsonWave::new(0.3, 2.0, 0.0);
        let half_width = wave.half_width(0.5).unwrap();
        assert!((half_width - 0.25).abs() < 1e-14);
    }

    #[test]
    fn beyond_a_certain_work_of_adhesion_no_strip_is_stable() {
        assert!(JohnsonWave::from_alpha(1.0652).pull_off().is_some());
        assert!(JohnsonWave::from_alpha(1.0653).pull_off().is_none());
    }
}
