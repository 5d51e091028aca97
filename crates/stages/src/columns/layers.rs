//! Columns of contacts with a layer or a coating.

use super::{parameter, parameter_text, real};
use asperity_tables::column::{Code, Column};

pub const LAYER_THICKNESS: Column = parameter(
    "layer_thickness",
    "length",
    "thickness t of the elastic layer. E* of reduced loads is the modulus E/(1 − ν²) of the layer. \
     Null for a half-space",
);
pub const LAYER_POISSON_RATIO: Column =
    parameter("layer_poisson_ratio", "1", "Poisson's ratio of the layer; null for a half-space");
pub const LAYER_BASE: Column = parameter_text(
    "layer_base",
    "connection of the layer with its rigid base; null for a coating and for a half-space",
)
.with_codes(&[
    Code { word: "bonded", meaning: "the layer adheres to the base" },
    Code { word: "frictionless", meaning: "the layer slides on the base" },
]);
pub const LAYER_MODULUS_RATIO: Column = parameter(
    "layer_modulus_ratio",
    "1",
    "shear modulus of the coating over that of the half-space below it; null on a rigid base and \
     for a half-space",
);
pub const SUBSTRATE_POISSON_RATIO: Column = parameter(
    "substrate_poisson_ratio",
    "1",
    "Poisson's ratio of the half-space below a coating; null on a rigid base and for a half-space",
);
pub const UNIFORM_COMPRESSION: Column = real(
    "uniform_compression",
    "length",
    "compression p₀ t/M of the layer by the mean pressure, with M/E* = (1 − ν)²/(1 − 2ν). It does \
     not change the gap. Null for a coating, because the displacement of the half-space below it is \
     undefined",
);
pub const APPROACH: Column = real(
    "approach",
    "length",
    "displacement of the rough body towards the rigid base of the layer since the first touch: \
     uniform_compression + highest height − mean_gap + mean_yielded_depth, with the height above \
     the mean plane. Null for a coating",
);

/// Parameter columns of contacts with a layer.
pub const LAYER_PARAMETERS: [Column; 5] = [
    LAYER_THICKNESS,
    LAYER_POISSON_RATIO,
    LAYER_BASE,
    LAYER_MODULUS_RATIO,
    SUBSTRATE_POISSON_RATIO,
];

/// Results that only contacts with a layer on a rigid base have.
pub const LAYER_RESULTS: [Column; 2] = [UNIFORM_COMPRESSION, APPROACH];
