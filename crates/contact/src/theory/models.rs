//! Asperity models: rough contact as the sum of the Hertz contacts of summits that ignore each
//! other.
//!
//! All of them see the roughness through Nayak's parameter α alone, once separations s are in units
//! of the rms height √m0 and loads y = p₀/(E* h′) in those of the rms slope h′ = √(2 m2). Summits
//! of one mean curvature have Gaussian heights; a model is a set of such classes, each a
//! Greenwood-Williamson contact of its own, and what it takes for the shape of a summit.
//! [`Asperities`] is the sum over these classes, at the separation at which it meets a load or an
//! area.

use std::f64::consts::{PI, SQRT_2};
use std::sync::LazyLock;

use super::law::KAPPA_BGT;

pub mod full_contact;
pub mod hertz;
mod quadrature;
pub mod summits;

use hertz::{Ellipse, EllipticityMeans};
use quadrature::GaussLegendre;
use summits::{GaussianHeights, Summits};

/// What a model takes for the summits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AsperityModel {
    /// Elliptic Hertz contacts of all summits (Bush, Gibson & Thomas 1975).
    BushGibsonThomas,
    /// Spheres of the geometric mean of the principal curvatures (Greenwood 2006).
    SimplifiedElliptic,
    /// Spheres of the arithmetic mean of the principal curvatures, the Nayak-Thomas model.
    MeanCurvature,
    /// Spheres of one radius, R = (3/8)√(π/m4) (Greenwood & Williamson 1966), with the parameters
    /// of McCool 1986.
    GreenwoodWilliamson,
}

impl AsperityModel {
    /// The c of κ = √(2π) (1 − c α/s² + O(s⁻⁴)), the secant at large separation.
    ///
    /// `None` for spheres of one radius, whose area is never proportional to the load.
    pub fn curvature_coefficient(self) -> Option<f64> {
        match self {
            Self::BushGibsonThomas => Some(19.0 / 108.0),
            Self::SimplifiedElliptic => Some(1.0 / 12.0),
            Self::MeanCurvature => Some(1.0 / 4.0),
            Self::GreenwoodWilliamson => None,
        }
    }

    fn ellipticity(self) -> Option<&'static EllipticityMeans> {
        static ELLIPSES: LazyLock<EllipticityMeans> = LazyLock::new(|| {
            EllipticityMeans::new(|ratio| {
                let ellipse = Ellipse::of_curvature_ratio(ratio);
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

/// Largest separation: areas and loads are numbers up to there, of 1e-300.
const FARTHEST: f64 = 37.0;

/// Standard deviations beyond which a normal density is below the rounding of what is within.
const REACH: f64 = 9.5;

/// Nodes of each panel of mean curvatures: twice as many change areas and loads by 2e-12 at most.
const NODES: u32 = 64;

/// Far more than Newton's method takes, enough for bisection alone.
const NEWTON_STEPS: usize = 200;

/// Newton's steps are quadratic: after one of this size nothing but rounding is left.
const SETTLED: f64 = 1e-9;

static PANEL: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(NODES));

/// A model of the contact of one roughness.
///
/// ```
/// use std::f64::consts::TAU;
///
/// use asperity_contact::theory::models::AsperityModel;
/// use asperity_contact::theory::models::{Asperities, NotIsotropic};
///
/// let model = Asperities::new(AsperityModel::BushGibsonThomas, 5.0)?;
/// // κ = a/y is √(2π) at vanishing load, less the more summits touch.
/// let [far, near] = [30.0, 2.0].map(|separation| model.at_separation(separation).secant());
/// assert!((far / TAU.sqrt() - 1.0).abs() < 2e-3);
/// assert!(near < far);
/// let light = model.at_load(0.01).unwrap();
/// assert!((light.load / 0.01 - 1.0).abs() < 1e-9);
/// // No isotropic surface has a Nayak parameter below 3/2.
/// assert!(Asperities::new(AsperityModel::BushGibsonThomas, 1.4).is_err());
/// # Ok::<(), NotIsotropic>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asperities {
    model: AsperityModel,
    summits: Summits,
}

/// A state of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Height of the flat above the mean plane of the roughness, in units of its rms height.
    pub separation: f64,
    /// Load y, in units of E* × rms slope.
    pub load: f64,
    /// Contact area over the apparent area; asperity models let it exceed one at heavy load.
    pub area: f64,
    /// da/dy.
    pub slope: f64,
    /// −dy/ds, the normal stiffness in units of E* × rms slope / rms height.
    pub stiffness: f64,
}

impl Contact {
    /// κ = a/y, the secant of the area.
    pub fn secant(&self) -> f64 {
        self.area / self.load
    }

    /// p̄ = y/a, in units of E* × rms slope.
    pub fn mean_pressure(&self) -> f64 {
        self.load / self.area
    }
}

/// The surface is not one that an asperity model can describe.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("Nayak's parameter is {nayak}, of an isotropic surface it is at least 3/2 and finite")]
pub struct NotIsotropic {
    /// What was given for it.
    pub nayak: f64,
}

impl Asperities {
    /// The model for isotropic Gaussian roughness of Nayak's parameter α.
    pub fn new(model: AsperityModel, nayak: f64) -> Result<Self, NotIsotropic> {
        if !(nayak >= 1.5 && nayak.is_finite()) {
            return Err(NotIsotropic { nayak });
        }
        let summits = Summits::reduced(nayak);
        Ok(Self { model, summits })
    }

    /// The contact with a flat at this separation from the mean plane, in units of the rms height.
    ///
    /// From 37 on there is none but for underflow.
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

    /// The contact under a load > 0; `None` where numbers do not reach.
    pub fn at_load(&self, load: f64) -> Option<Contact> {
        self.find(load, |contact| (contact.load, contact.stiffness / contact.load))
    }

    /// The contact of an area fraction > 0; `None` where numbers do not reach.
    pub fn at_area(&self, area: f64) -> Option<Contact> {
        self.find(area, |contact| {
            let decay = contact.slope * contact.stiffness;
            (contact.area, decay / contact.area)
        })
    }

    /// The secant κ by its expansion at large separation, up to the square of its inverse.
    pub fn secant_at_large_separation(&self, separation: f64) -> Option<f64> {
        let coefficient = self.model.curvature_coefficient()?;
        Some(KAPPA_BGT * (1.0 - coefficient * self.summits.nayak() / separation.powi(2)))
    }

    /// Solves for the separation at which a quantity meets the target.
    ///
    /// The closure gives the quantity and −d ln quantity/ds. The logarithm falls ever faster with
    /// s, so that Newton's steps close in from one side; bisection catches what leaves the bracket.
    fn find(&self, target: f64, quantity: impl Fn(&Contact) -> (f64, f64)) -> Option<Contact> {
        let newton_step = |contact: &Contact| {
            let (value, decay) = quantity(contact);
            (value / target).ln() / decay
        };
        let is_beyond = |separation| quantity(&self.at_separation(separation)).0 < target;
        if !(target > 0.0 && target.is_finite() && is_beyond(FARTHEST)) {
            return None;
        }
        let (mut low, mut high) = (-1.0, FARTHEST);
        while is_beyond(low) {
            (low, high) = (2.0 * low, low);
        }
        // A start beyond the solution: the area is about half of the tail of the Gaussian.
        let start = (-2.0 * (4.0 * target).ln()).max(0.0).sqrt();
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
            if (contact.separation - here).abs() <= SETTLED * here.abs().max(1.0) {
                break;
            }
        }
        Some(contact)
    }

    /// Visits the classes of summits that touch at this separation, to rounding.
    fn for_each_class(&self, separation: f64, mut visit: impl FnMut(Class)) {
        let Some(ellipticity) = self.model.ellipticity() else {
            visit(self.only_class());
            return;
        };
        self.for_each_curvature(separation, |mean_curvature, width| {
            visit(self.class(ellipticity, mean_curvature, width));
        });
    }

    /// Nodes and weights in the mean curvature, on panels in which the classes change smoothly.
    fn for_each_curvature(&self, separation: f64, mut visit: impl FnMut(f64, f64)) {
        let spread = self.summits.curvature_variance_at_a_height().sqrt();
        let lowest = separation.max(0.0);
        let start = (lowest - REACH * spread).max(0.0);
        let end = lowest.hypot(REACH) + REACH * spread;
        // Here the mean height of a class passes the plane, abruptly if the heights spread little.
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
            // The excess grows as powers 1/2 and 3/2 of the distance from `passing`: integrate in
            // the root of the distance, counted from its first value.
            let first = (passed - passing).sqrt();
            let length = (end - passed) / ((end - passing).sqrt() + first);
            for (step, width) in PANEL.over(0.0, length) {
                let mean_curvature = passed + step * (step + 2.0 * first);
                visit(mean_curvature, 2.0 * (first + step) * width);
            }
        }
    }

    /// All summits whose mean curvature is within an interval.
    fn class(&self, ellipticity: &EllipticityMeans, mean_curvature: f64, width: f64) -> Class {
        let x = 1.5 * mean_curvature * mean_curvature / self.summits.m4;
        let (area, load) = ellipticity.at(x);
        // The density of H over all points is exp(−x/2)/√(2π ⟨H²⟩).
        let points =
            width * (-0.5 * x).exp() / (2.0 * PI * self.summits.curvature_variance()).sqrt();
        let summits = points * mean_curvature * mean_curvature / (2.0 * PI);
        Class {
            area: summits * area * sphere_area(mean_curvature),
            load: summits * load * sphere_load(mean_curvature),
            heights: self.summits.heights(mean_curvature),
        }
    }

    /// Spheres of one radius whose heights do not depend on the curvature (McCool 1986).
    fn only_class(&self) -> Class {
        /// As published; [`Summits::height_variance`] has more digits.
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

/// Summits of one curvature.
struct Class {
    /// Area fraction per mean excess of the heights.
    area: f64,
    /// Load per mean excess of the heights to the power 3/2.
    load: f64,
    heights: GaussianHeights,
}

/// Contact area of a sphere per indentation.
fn sphere_area(curvature: f64) -> f64 {
    PI / curvature
}

/// Load of a sphere per indentation to the power 3/2, in units of E* × rms slope with m2 = 1.
fn sphere_load(curvature: f64) -> f64 {
    4.0 / (3.0 * curvature.sqrt() * SQRT_2)
}

#[cfg(test)]
mod tests;
