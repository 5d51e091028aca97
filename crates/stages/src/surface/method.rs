//! The methods that make surfaces.

use super::Origin;
use asperity_contact::topography::random::Amplitude;
use asperity_contact::topography::shapes::Shape;

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

impl Method {
    /// All methods, in the order of the documentation; the first one is the default.
    pub const ALL: [Method; 10] = [
        Method::Random(Amplitude::Gaussian),
        Method::Random(Amplitude::Deterministic),
        Method::Spectrum,
        Method::File,
        Method::Yielded,
        Method::Paraboloid,
        Method::Wave(WaveShape::Single),
        Method::Wave(WaveShape::Product),
        Method::Wave(WaveShape::Sum),
        Method::FlatPunch,
    ];

    /// Returns the value of `method` in manifests.
    pub fn word(self) -> &'static str {
        match self {
            Method::Random(Amplitude::Gaussian) => "filter",
            Method::Random(Amplitude::Deterministic) => "random-phase",
            Method::Spectrum => "spectrum",
            Method::File => "file",
            Method::Yielded => "yielded",
            Method::Paraboloid => "paraboloid",
            Method::Wave(WaveShape::Single) => "wave",
            Method::Wave(WaveShape::Product) => "wave-product",
            Method::Wave(WaveShape::Sum) => "wave-sum",
            Method::FlatPunch => "flat-punch",
        }
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

    /// Returns the description of the method for editors and the guide.
    pub fn about(self) -> &'static str {
        match self {
            Method::Random(Amplitude::Gaussian) => {
                "Random self-affine surfaces with a plateau up to `k_rolloff` and a power law up to \
                 `k_upper`. The modes have complex Gaussian amplitudes whose mean power is the \
                 spectrum."
            }
            Method::Random(Amplitude::Deterministic) => {
                "Random self-affine surfaces with random phases. Each mode has exactly the power of the \
                 spectrum."
            }
            Method::Spectrum => {
                "Gaussian random surfaces with a given isotropic power spectral density C(q), \
                 normalised so that ∫ C d²q/(2π)² is their mean square height."
            }
            Method::File => {
                "A measured surface, read from the file of an instrument. Its keys are applied in this \
                 order: channel, unit and side, `crop`, `spikes`, `islands`, `align`, `level` or \
                 `level_through`, `fill`, `tip_radius` and `noise_floor`, `high_pass`, `low_pass`, \
                 `resample`, `edges`."
            }
            Method::Yielded => {
                "Surfaces that keep their plastic depth after a `solve` stage with a `hardness`, \
                 which `from` names. They can be measured, and pressed again to study running-in."
            }
            Method::Paraboloid => "Paraboloid −r²/(2R), for comparison with Hertz contact.",
            Method::Wave(WaveShape::Single) => {
                "Wave Δ cos(2πnx/L), for comparison with the solution of Westergaard."
            }
            Method::Wave(WaveShape::Product) => {
                "Product of waves Δ cos(2πnx/L) cos(2πny/L), for comparison with the solution of \
                 Johnson, Greenwood & Higginson."
            }
            Method::Wave(WaveShape::Sum) => {
                "Sum of waves Δ (cos(2πnx/L) + cos(2πny/L)): `\"wave-product\"` turned by 45°."
            }
            Method::FlatPunch => "Flat circular punch in the middle of the cell.",
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
