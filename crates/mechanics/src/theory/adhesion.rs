//! Closed forms of adhesive contact, for short-ranged and long-ranged attraction.
//!
//! - [`spheres`]: a sphere by the theories of Johnson, Kendall & Roberts, of Derjaguin, Müller &
//!   Toporov, and of Maugis;
//! - [`wave`]: a wavy surface by the theory of Johnson.
//!
//! Which limit a contact of radius of curvature R is near depends on the parameter of Tabor. Below
//! about 0.1, attraction outside the contact acts as a load and does not deform the bodies (DMT).
//! Above about 5, it acts at the edge of the contact only (JKR).

pub mod spheres;
pub mod wave;

/// Returns the parameter of Tabor μ = (R w²/E*²)^⅓/ρ (*J. Colloid Interface Sci.* 58, 1977, 2).
///
/// All lengths are in one unit, and the work of adhesion w is in units of the modulus E* times this
/// unit. For a rough surface, 1/√m₄ is a typical radius R of its summits.
///
/// ```
/// use asperity_mechanics::theory::adhesion::tabor;
///
/// assert_eq!(tabor(1.0, 1.0, 0.5), 2.0);
/// ```
pub fn tabor(radius: f64, work: f64, range: f64) -> f64 {
    libm::cbrt(radius * work * work) / range
}
