//! Properties of the two bodies of a contact that change no solved load.

use serde::Serialize;

/// Properties of the bodies that change no solved load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bodies {
    /// Number of listed bodies.
    pub count: usize,
    /// Smallest hardness of the bodies, in the unit of their moduli, for a warning about higher
    /// pressures.
    pub softest: Option<f64>,
    /// Dundurs' constant β, which is zero for elastically similar bodies; `None` without bodies.
    pub dundurs: Option<f64>,
    /// Conductivities of the pair, for the conductances of `measure` stages.
    pub conduction: Option<Conduction>,
}

/// Conductivities of a pair of bodies, each of which may be unknown.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conduction {
    /// Conductivity k_s of the pair in W/(m K): 2/k_s = 1/k₁ + 1/k₂.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conductivity: Option<f64>,
    /// Mean resistivity (ρ₁ + ρ₂)/2 in Ω m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resistivity: Option<f64>,
}
