//! Adhesive contact of a sphere with a half-space.
//!
//! Lengths are in units of the radius R, pressures in units of E* and forces in units of E* R²; the
//! work of adhesion w is in units of E* R. Forces that pull are negative, and the approach of
//! undeformed spheres in touch is zero.

use std::f64::consts::PI;

/// Force and approach of a sphere with a given radius of the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereState {
    /// Force on the sphere.
    pub force: f64,
    /// Approach of points far from the contact.
    pub approach: f64,
}

/// Force of pull-off −(3/2) π w R under a load, by the theory of Johnson, Kendall & Roberts.
pub fn jkr_pull_off(work: f64) -> f64 {
    -1.5 * PI * work
}

/// Force of pull-off −2 π w R by the theory of Derjaguin, Müller & Toporov.
pub fn dmt_pull_off(work: f64) -> f64 {
    -2.0 * PI * work
}

/// Returns the state with contact radius a by the theory of Johnson, Kendall & Roberts (*Proc. R.
/// Soc. A* 324, 1971, 301): F = 4a³/3 − √(8π w a³), δ = a² − √(2π w a).
///
/// ```
/// use asperity_mechanics::theory::adhesion::spheres::{jkr, jkr_pull_off};
///
/// // Under a load, the sphere pulls off at a³ = 9π w/8.
/// let radius = (9.0 * std::f64::consts::PI / 8.0).cbrt();
/// assert!((jkr(radius, 1.0).force - jkr_pull_off(1.0)).abs() < 1e-14);
/// ```
pub fn jkr(radius: f64, work: f64) -> SphereState {
    let cube = radius * radius * radius;
    SphereState {
        force: 4.0 / 3.0 * cube - (8.0 * PI * work * cube).sqrt(),
        approach: radius * radius - (2.0 * PI * work * radius).sqrt(),
    }
}

/// Returns the state with contact radius a by the theory of Derjaguin, Müller & Toporov (*J.
/// Colloid Interface Sci.* 53, 1975, 314) in the form of Maugis: F = 4a³/3 − 2π w, δ = a².
pub fn dmt(radius: f64, work: f64) -> SphereState {
    SphereState {
        force: 4.0 / 3.0 * radius * radius * radius + dmt_pull_off(work),
        approach: radius * radius,
    }
}

/// Attraction of constant pressure σ up to the gap w/σ, by the theory of Maugis (*J. Colloid
/// Interface Sci.* 150, 1992, 243).
///
/// With K = 4E*/3, his parameter is λ = 2σ (R/(π w K²))^⅓. Contact radii are in units of (π w
/// R²/K)^⅓, forces in units of π w R and approaches in units of (π² w² R/K²)^⅓.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Maugis {
    parameter: f64,
}

/// Number of halvings of an interval, after which it is as short as rounding allows.
const HALVINGS: u32 = 200;

/// Number of contact radii among which the lowest force is looked for before the search is
/// refined.
const TRIALS: u32 = 400;

impl Maugis {
    /// Creates the theory for a positive parameter λ.
    ///
    /// # Panics
    ///
    /// Panics if λ is not positive and finite.
    pub fn new(parameter: f64) -> Self {
        assert!(parameter > 0.0 && parameter.is_finite(), "the parameter must be positive");
        Self { parameter }
    }

    /// Returns the state with a contact radius, in the units of the theory.
    pub fn state(&self, radius: f64) -> SphereState {
        let ratio = self.reach(radius);
        let (root, angle) = Self::root_and_angle(ratio);
        let lambda = self.parameter;
        SphereState {
            force: radius.powi(3) - lambda * radius * radius * (root + ratio * ratio * angle),
            approach: radius * radius - 4.0 / 3.0 * lambda * radius * root,
        }
    }

    /// Returns the lowest force, at which the sphere pulls off under a load, and the contact radius
    /// there.
    pub fn pull_off(&self) -> (f64, f64) {
        let force = |radius: f64| self.state(radius).force;
        // Contact radii at pull-off are below that of the theory of Johnson, Kendall & Roberts,
        // 1.5^⅓ of the unit.
        let step = 1.5 / f64::from(TRIALS);
        let radii = (1..=TRIALS).map(|trial| f64::from(trial) * step);
        let lowest =
            radii.min_by(|a, b| force(*a).total_cmp(&force(*b))).expect("there are trials");
        // Golden-section search.
        let part = 0.5 * (5_f64.sqrt() - 1.0);
        let (mut low, mut high) = ((lowest - step).max(1e-9), lowest + step);
        for _ in 0..60 {
            let (left, right) = (high - part * (high - low), low + part * (high - low));
            if force(left) < force(right) {
                high = right;
            } else {
                low = left;
            }
        }
        let radius = 0.5 * (low + high);
        (force(radius), radius)
    }

    /// Returns the radius up to which the surfaces attract each other, divided by that of the
    /// contact.
    fn reach(&self, radius: f64) -> f64 {
        let lambda = self.parameter;
        // The gap at the edge of the attraction, less w/σ, rises with the ratio.
        let excess = |ratio: f64| {
            let (root, angle) = Self::root_and_angle(ratio);
            0.5 * lambda * radius * radius * (root + (ratio * ratio - 2.0) * angle)
                + 4.0 / 3.0 * lambda * lambda * radius * (root * angle - ratio + 1.0)
                - 1.0
        };
        let (mut low, mut high) = (1.0, 2.0);
        while excess(high) < 0.0 && high < 1e300 {
            high *= 2.0;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    fn root_and_angle(ratio: f64) -> (f64, f64) {
        let root = (ratio * ratio - 1.0).sqrt();
        (root, libm::atan(root))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_of_johnson_kendall_and_roberts_has_known_states() {
        // Values with twelve digits from reference/adhesion of the project, for R = E* = w = 1.
        for (radius, force, approach) in [
            (2.417_987_931_0, 0.0, 1.948_888_544_5),
            (1.523_236_946_3, -4.712_388_980_4, -0.773_416_931_6),
            (0.732_295_943_8, -2.617_993_878_0, -1.608_772_047_8),
        ] {
            let state = jkr(radius, 1.0);
            assert!((state.force - force).abs() < 1e-8, "{state:?}");
            assert!((state.approach - approach).abs() < 1e-9, "{state:?}");
        }
        // Under a prescribed approach, the sphere pulls off where the approach is least, at 5/9 of
        // the force of pull-off under a load.
        let least = (PI / 8.0).cbrt();
        assert!((jkr(least, 1.0).force / jkr_pull_off(1.0) - 5.0 / 9.0).abs() < 1e-14);
    }

    #[test]
    fn forces_of_derjaguin_muller_and_toporov_are_those_of_hertz_and_a_constant() {
        let state = dmt(2.0, 1.0);
        assert!((state.force - 4.383_481_359).abs() < 1e-9);
        assert_eq!(state.approach, 4.0);
        assert_eq!(dmt(0.0, 0.3).force, dmt_pull_off(0.3));
    }

    #[test]
    fn maugis_pulls_off_between_the_two_limits() {
        // reference/adhesion/maugis_pulloff.csv, computed by Adhesion.ReferenceSolutions as well.
        for (parameter, force, radius) in [
            (0.1, -1.950_594_89, 0.199_192_595),
            (0.5, -1.718_245_27, 0.678_877_699),
            (2.0, -1.534_603_24, 1.051_376_95),
        ] {
            let (found, at) = Maugis::new(parameter).pull_off();
            assert!((found - force).abs() < 2e-8, "{parameter}: {found}");
            // At a minimum, the radius has half the digits of the force.
            assert!((at - radius).abs() < 1e-5, "{parameter}: {at}");
        }
        assert!((Maugis::new(50.0).pull_off().0 + 1.5).abs() < 1e-3);
        assert!((Maugis::new(1e-3).pull_off().0 + 2.0).abs() < 1e-3);
    }
}
