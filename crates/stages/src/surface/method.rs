//! The methods that make surfaces.

use crate::surface::Origin;
use asperity_mechanics::topography::random::Amplitude;
use asperity_mechanics::topography::shapes::Shape;

/// The value of the key `method`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Random self-affine surfaces, whose modes have random or deterministic amplitudes.
    Random(Amplitude),
    /// Random surfaces with a given power spectral density.
    Spectrum,
    /// Measured surfaces, which are read from files.
    File,
    /// Surfaces that have yielded in a contact.
    Yielded,
    /// A paraboloid, for comparison with Hertz contact.
    Paraboloid,
    /// A wave, or the product or sum of two waves.
    Wave(WaveShape),
    /// A flat circular punch.
    FlatPunch,
}

/// All methods, in the order of the documentation, each with the value of `method` in manifests
/// and the description for editors and the guide. The first one is the default.
pub const METHODS: [(Method, &str, &str); 10] = [
    (
        Method::Random(Amplitude::Gaussian),
        "filter",
        "Random self-affine surfaces with a plateau up to `k_rolloff` and a power law up to \
         `k_upper`. The modes have complex Gaussian amplitudes whose mean power is the spectrum.",
    ),
    (
        Method::Random(Amplitude::Deterministic),
        "random-phase",
        "Random self-affine surfaces with random phases. Each mode has exactly the power of the \
         spectrum.",
    ),
    (
        Method::Spectrum,
        "spectrum",
        "Random surfaces with a given isotropic power spectral density C(q), normalised so that \
         ∫ C d²q/(2π)² is their mean square height.",
    ),
    (
        Method::File,
        "file",
        "A measured surface, read from the file of an instrument. Its keys are applied in this \
         order: channel, unit and side, `crop`, `spikes`, `islands`, `align`, `level` or \
         `level_through`, `fill`, `tip_radius` and `noise_floor`, `high_pass`, `low_pass`, \
         `resample`, `edges`.",
    ),
    (
        Method::Yielded,
        "yielded",
        "Surfaces that keep their plastic depth after a `solve` stage with a `hardness`, which \
         `from` names. They can be measured, and pressed again to study running-in.",
    ),
    (Method::Paraboloid, "paraboloid", "Paraboloid −r²/(2R), for comparison with Hertz contact."),
    (
        Method::Wave(WaveShape::Single),
        "wave",
        "Wave Δ cos(2πnx/L), for comparison with the solution of Westergaard.",
    ),
    (
        Method::Wave(WaveShape::Product),
        "wave-product",
        "Product of waves Δ cos(2πnx/L) cos(2πny/L), for comparison with the solution of Johnson, \
         Greenwood & Higginson.",
    ),
    (
        Method::Wave(WaveShape::Sum),
        "wave-sum",
        "Sum of waves Δ (cos(2πnx/L) + cos(2πny/L)): `\"wave-product\"` turned by 45°.",
    ),
    (Method::FlatPunch, "flat-punch", "Flat circular punch in the middle of the cell."),
];

impl Method {
    /// Returns all methods; the first one is the default.
    pub fn all() -> impl Iterator<Item = Method> {
        METHODS.into_iter().map(|(method, ..)| method)
    }

    fn definition(self) -> (Method, &'static str, &'static str) {
        let definition = METHODS.into_iter().find(|(method, ..)| *method == self);
        definition.expect("all methods are defined")
    }

    /// Returns the value of `method` in manifests.
    pub fn word(self) -> &'static str {
        self.definition().1
    }

    /// Returns the description of the method for editors and the guide.
    pub fn about(self) -> &'static str {
        self.definition().2
    }

    /// Returns whether the surfaces are shapes with closed-form solutions, and not rough.
    pub fn is_shape(self) -> bool {
        matches!(self, Method::Paraboloid | Method::Wave(_) | Method::FlatPunch)
    }

    /// Returns the method that makes surfaces of this origin.
    pub fn from_origin(origin: &Origin) -> Method {
        match origin {
            Origin::Random { surface, .. } => Method::Random(surface.amplitude),
            Origin::Spectrum { .. } => Method::Spectrum,
            Origin::File(_) => Method::File,
            Origin::Pair(pair) => Method::from_origin(&pair.body.origin),
            Origin::Yielded(_) => Method::Yielded,
            Origin::Shape { shape, .. } => match shape {
                Shape::Paraboloid { .. } => Method::Paraboloid,
                Shape::Wave { .. } => Method::Wave(WaveShape::Single),
                Shape::WaveProduct { .. } => Method::Wave(WaveShape::Product),
                Shape::WaveSum { .. } => Method::Wave(WaveShape::Sum),
                Shape::Punch { .. } => Method::FlatPunch,
            },
        }
    }
}

/// The combination of a wave along x with a wave along y.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveShape {
    /// The wave along x alone.
    Single,
    /// The product of both waves.
    Product,
    /// The sum of both waves.
    Sum,
}
