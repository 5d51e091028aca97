//! Asperity models, in which rough contact is the sum of independent Hertz contacts.
//!
//! Separations s are in units of the rms height √m0. Loads are y = p₀/(E* h′), with the rms slope
//! h′ = √(2 m2). In these units, the contact depends on Nayak's parameter α alone. All summits of
//! the same mean curvature form a class. Their heights are Gaussian, so that each class is a
//! Greenwood-Williamson contact. The models differ in the shape of the summits. [`Asperities`] sums
//! over the classes and finds the separation for a load or an area.

use std::f64::consts::{PI, SQRT_2};
use std::sync::LazyLock;

pub mod full_contact;
pub mod hertz;
mod quadrature;
pub mod summits;

use hertz::{Ellipse, EllipticityMeans};
use quadrature::GaussLegendre;
use summits::{GaussianHeights, Summits};

/// Asperity model, which is defined by the assumed shape of the summits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AsperityModel {
    /// Elliptic Hertz contacts (Bush, Gibson & Thomas 1975).
    BushGibsonThomas,
    /// Spheres with the geometric mean of the principal curvatures (Greenwood 2006).
    SimplifiedElliptic,
    /// Spheres with the arithmetic mean of the principal curvatures (Nayak-Thomas model).
    MeanCurvature,
    /// Spheres of one radius, R = (3/8)√(π/m4) (Greenwood & Williamson 1966), with the parameters
    /// of McCool 1986.
    GreenwoodWilliamson,
}

impl AsperityModel {
    fn ellipticity(self) -> Option<&'static EllipticityMeans> {
        static ELLIPSES: LazyLock<EllipticityMeans> = LazyLock::new(|| {
            EllipticityMeans::new(|ratio| {
                let ellipse = Ellipse::from_curvature_ratio(ratio);
                (ellipse.area_factor, ellipse.load_factor)
            })
        });
        static GEOMETRIC: LazyLock<EllipticityMeans> = LazyLock::new(|| {
            EllipticityMeans::new(|ratio| {
                let arithmetic_over_geometric = 0.5 * (1.0 + ratio) / ratio.sqrt();
                (arithmetic_over_geometric, arithmetic_over_geometric.sqrt())
            })
        });
        static ARITHMETIC: LazyLock<EllipticityMeans> =
            LazyLock::new(|| EllipticityMeans::new(|_| (1.0, 1.0)));
        match self {
            Self::BushGibsonThomas => Some(&ELLIPSES),
            Self::SimplifiedElliptic => Some(&GEOMETRIC),
            Self::MeanCurvature => Some(&ARITHMETIC),
            Self::GreenwoodWilliamson => None,
        }
    }
}

/// Maximum separation, in units of the rms height. Areas and loads are about 1e-300 there.
const FARTHEST: f64 = 37.0;

/// Number of standard deviations beyond which a normal density is negligible.
const REACH: f64 = 9.5;

/// Number of quadrature nodes in each panel of [`Asperities::for_each_curvature`].
///
/// Twice as many nodes change results by at most 2e-12.
const NODES: u32 = 64;

/// Maximum number of steps of [`Asperities::find`], sufficient even if all are bisections.
const NEWTON_STEPS: usize = 200;

/// Relative step of the separation after which [`Asperities::find`] ends, because only rounding
/// errors remain.
const LAST_STEP: f64 = 1e-9;

static PANEL: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(NODES));

/// Asperity model of isotropic Gaussian roughness with a given Nayak parameter.
///
/// ```
/// use std::f64::consts::TAU;
///
/// use asperity_mechanics::theory::models::AsperityModel;
/// use asperity_mechanics::theory::models::{Asperities, NotIsotropic};
///
/// let model = Asperities::new(AsperityModel::BushGibsonThomas, 5.0)?;
/// // The secant κ = a/y is √(2π) at vanishing load and decreases with the load.
/// let [far, near] = [30.0, 2.0].map(|separation| model.at_separation(separation).secant());
/// assert!((far / TAU.sqrt() - 1.0).abs() < 2e-3);
/// assert!(near < far);
/// let light = model.at_load(0.01).unwrap();
/// assert!((light.load / 0.01 - 1.0).abs() < 1e-9);
/// // Nayak's parameter of an isotropic surface is at least 3/2.
/// assert!(Asperities::new(AsperityModel::BushGibsonThomas, 1.4).is_err());
/// # Ok::<(), NotIsotropic>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asperities {
    model: AsperityModel,
    summits: Summits,
}

/// Load, contact area and their derivatives at one separation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Separation s between the flat and the mean plane of the roughness, in units of the rms
    /// height.
    pub separation: f64,
    /// Load y, in units of E* h′.
    pub load: f64,
    /// Contact area a divided by the nominal area. It can exceed one at heavy load.
    pub area: f64,
    /// Slope da/dy of the area.
    pub slope: f64,
    /// Normal stiffness −dy/ds, in units of E* h′/rms height.
    pub stiffness: f64,
}

impl Contact {
    /// Returns the secant κ = a/y.
    pub fn secant(&self) -> f64 {
        self.area / self.load
    }

    /// Returns the mean contact pressure p̄ = y/a, in units of E* h′.
    pub fn mean_pressure(&self) -> f64 {
        self.load / self.area
    }
}

/// Error for a Nayak parameter α that is below 3/2 or not finite. No isotropic surface has such an
/// α.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "Nayak's parameter is {nayak}; for an isotropic surface it must be finite and at least 3/2"
)]
pub struct NotIsotropic {
    /// Rejected value of Nayak's parameter.
    pub nayak: f64,
}

impl Asperities {
    /// Creates the model for Nayak's parameter α.
    ///
    /// # Errors
    /// Fails if α is below 3/2 or not finite.
    pub fn new(model: AsperityModel, nayak: f64) -> Result<Self, NotIsotropic> {
        if !(nayak >= 1.5 && nayak.is_finite()) {
            return Err(NotIsotropic { nayak });
        }
        let summits = Summits::reduced(nayak);
        Ok(Self { model, summits })
    }

    /// Returns the contact at a separation s, in units of the rms height.
    ///
    /// At separations of 37 or more, area and load underflow.
    pub fn at_separation(&self, separation: f64) -> Contact {
        let (mut area, mut area_rate, mut load, mut load_rate) = (0.0, 0.0, 0.0, 0.0);
        self.for_each_class(separation, |class| {
            let excess = class.heights.excess(separation);
            area += class.area * excess.first;
            area_rate += class.area * excess.fraction;
            load += class.load * excess.three_halves;
            load_rate += class.load * 1.5 * excess.half;
        });
        Contact { separation, load, area, slope: area_rate / load_rate, stiffness: load_rate }
    }

    /// Returns the contact under a load y, or `None` if y is not positive or below the load at the
    /// maximum separation of 37.
    pub fn at_load(&self, load: f64) -> Option<Contact> {
        self.find(load, |contact| (contact.load, contact.stiffness / contact.load))
    }

    /// Returns the contact with the area fraction `area`, or `None` if it is not positive or below
    /// the area at the maximum separation of 37.
    pub fn at_area(&self, area: f64) -> Option<Contact> {
        self.find(area, |contact| {
            let decay = contact.slope * contact.stiffness;
            (contact.area, decay / contact.area)
        })
    }

    /// Finds the separation s at which a quantity f of the contact has the value `target`. Returns
    /// `None` if the target is not positive or f exceeds it even at the maximum separation.
    ///
    /// `quantity` returns f and −d ln f/ds. Since ln f is concave in s, Newton's method converges
    /// from one side. A step out of the bracket is replaced by bisection.
    fn find(&self, target: f64, quantity: impl Fn(&Contact) -> (f64, f64)) -> Option<Contact> {
        let newton_step = |contact: &Contact| {
            let (value, decay) = quantity(contact);
            libm::log(value / target) / decay
        };
        let is_beyond = |separation| quantity(&self.at_separation(separation)).0 < target;
        if !(target > 0.0 && target.is_finite() && is_beyond(FARTHEST)) {
            return None;
        }
        let (mut low, mut high) = (-1.0, FARTHEST);
        while is_beyond(low) {
            (low, high) = (2.0 * low, low);
        }
        // The start is beyond the solution: the area is about half of the tail of the Gaussian.
        let start = (-2.0 * libm::log(4.0 * target)).max(0.0).sqrt();
        let mut contact = self.at_separation(start.clamp(low, high));
        for _ in 0..NEWTON_STEPS {
            let step = newton_step(&contact);
            let here = contact.separation;
            if step > 0.0 {
                low = here;
            } else {
                high = here;
            }
            let next = here + step;
            let is_inside = low <= next && next <= high;
            contact = self.at_separation(if is_inside { next } else { 0.5 * (low + high) });
            if (contact.separation - here).abs() <= LAST_STEP * here.abs().max(1.0) {
                break;
            }
        }
        Some(contact)
    }

    /// Calls `visit` for each [`Class`] of summits that contributes to the contact at a separation.
    fn for_each_class(&self, separation: f64, mut visit: impl FnMut(Class)) {
        let Some(ellipticity) = self.model.ellipticity() else {
            visit(self.only_class());
            return;
        };
        self.for_each_curvature(separation, |mean_curvature, width| {
            visit(self.class(ellipticity, mean_curvature, width));
        });
    }

    /// Calls `visit(H, weight)` for the nodes and weights of a quadrature over the mean curvature H
    /// of the summits that contribute at a separation.
    ///
    /// The range of H is divided into panels on which the integrand is smooth.
    fn for_each_curvature(&self, separation: f64, mut visit: impl FnMut(f64, f64)) {
        let spread = self.summits.curvature_variance_at_a_height().sqrt();
        let lowest = separation.max(0.0);
        let start = (lowest - REACH * spread).max(0.0);
        let end = libm::hypot(lowest, REACH) + REACH * spread;
        // At the mean curvature `passing`, the mean height of a class equals the separation. If the
        // heights deviate little, the integrand changes abruptly there.
        let heights = self.summits.heights(1.0);
        let passing = separation / heights.mean;
        let transition = REACH * heights.deviation / heights.mean;
        let passed = (passing + transition).clamp(start, end);
        let ends =
            [start, (passing - transition).clamp(start, end), passing.clamp(start, end), passed];
        for panel in ends.windows(2).filter(|panel| panel[0] < panel[1]) {
            for (mean_curvature, width) in PANEL.over(panel[0], panel[1]) {
                visit(mean_curvature, width);
            }
        }
        if passed < end {
            // The integrand contains the powers 1/2 and 3/2 of the distance from `passing`. The
            // square root of the distance, minus its first value, is therefore the variable.
            let first = (passed - passing).sqrt();
            let length = (end - passed) / ((end - passing).sqrt() + first);
            for (step, width) in PANEL.over(0.0, length) {
                let mean_curvature = passed + step * (step + 2.0 * first);
                visit(mean_curvature, 2.0 * (first + step) * width);
            }
        }
    }

    /// Returns the class of the summits with mean curvatures in an interval of length `width` at
    /// `mean_curvature`.
    fn class(&self, ellipticity: &EllipticityMeans, mean_curvature: f64, width: f64) -> Class {
        let x = 1.5 * mean_curvature * mean_curvature / self.summits.m4;
        let (area, load) = ellipticity.at(x);
        // The density of H over all points is exp(−x/2)/√(2π ⟨H²⟩).
        let points =
            width * libm::exp(-0.5 * x) / (2.0 * PI * self.summits.curvature_variance()).sqrt();
        let summits = points * mean_curvature * mean_curvature / (2.0 * PI);
        Class {
            area: summits * area * sphere_area(mean_curvature),
            load: summits * load * sphere_load(mean_curvature),
            heights: self.summits.heights(mean_curvature),
        }
    }

    /// Returns the single class of the Greenwood-Williamson model (McCool 1986).
    ///
    /// All summits are spheres of one radius, and their heights do not depend on the curvature.
    fn only_class(&self) -> Class {
        /// Published constant of the variance of the summit heights, 1 − 3√3 + 16/π.
        const VARIANCE: f64 = 0.8968;
        let curvature = self.summits.mean_curvature();
        let summits = self.summits.per_area();
        Class {
            area: summits * sphere_area(curvature),
            load: summits * sphere_load(curvature),
            heights: GaussianHeights {
                mean: self.summits.mean_height(),
                deviation: (1.0 - VARIANCE / self.summits.nayak()).sqrt(),
            },
        }
    }
}

/// Class of summits with the same mean curvature, and with normally distributed heights z.
struct Class {
    /// Factor A of the area fraction A ⟨(z − s)₊⟩ of the class at the separation s.
    area: f64,
    /// Factor B of the load B ⟨(z − s)₊^(3/2)⟩ of the class at the separation s.
    load: f64,
    heights: GaussianHeights,
}

/// Returns the contact area of a sphere divided by its indentation, π/`curvature`.
fn sphere_area(curvature: f64) -> f64 {
    PI / curvature
}

/// Returns the load of a sphere divided by its indentation^(3/2), in units of E* h′ with m2 = 1.
fn sphere_load(curvature: f64) -> f64 {
    4.0 / (3.0 * curvature.sqrt() * SQRT_2)
}

#[cfg(test)]
mod tests;
