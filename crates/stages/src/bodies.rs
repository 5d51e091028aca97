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

/// Conductivities of a pair of bodies, each of which may be unknown. Of a layered body, k₁ and ρ₁
/// are those of the layer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Conduction {
    /// Conductivity k_s of the pair in W/(m K): 2/k_s = 1/k₁ + 1/k₂.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conductivity: Option<f64>,
    /// Mean resistivity (ρ₁ + ρ₂)/2 in Ω m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resistivity: Option<f64>,
    /// Conduction through a layer. Omitted from the recipe of half-spaces, so that existing keys
    /// stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerConduction>,
}

/// Conductivity of a layer relative to the bodies that it touches, of heat or of a current.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LayerConduction {
    /// Conductivity of the layer over that of the substrate; 0 if the substrate conducts perfectly.
    pub to_substrate: f64,
    /// Conductivity of the layer over that of the rough body; 0 if that body conducts perfectly.
    pub to_counter_body: f64,
}
