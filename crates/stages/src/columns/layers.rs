//! Columns of contacts with a layer or a coating.

use super::{codes, columns, parameter, parameter_text, real};
use asperity_tables::column::Column;

columns! {
    /// Parameter columns of contacts with a layer.
    pub const LAYER_PARAMETERS = [
        /// thickness t of the elastic layer. E* of reduced loads is the modulus E/(1 − ν²) of the
        /// layer. Null for a half-space
        pub const LAYER_THICKNESS: Column = parameter("layer_thickness", "length");
        /// Poisson's ratio of the layer; null for a half-space
        pub const LAYER_POISSON_RATIO: Column = parameter("layer_poisson_ratio", "1");
        /// connection of the layer with its rigid base; null for a coating and for a half-space
        pub const LAYER_BASE: Column = parameter_text("layer_base").with_codes(codes![
            /// the layer adheres to the base
            "bonded",
            /// the layer slides on the base
            "frictionless",
        ]);
        /// shear modulus of the coating over that of the half-space below it; null on a rigid base
        /// and for a half-space
        pub const LAYER_MODULUS_RATIO: Column = parameter("layer_modulus_ratio", "1");
        /// Poisson's ratio of the half-space below a coating; null on a rigid base and for a
        /// half-space
        pub const SUBSTRATE_POISSON_RATIO: Column = parameter("substrate_poisson_ratio", "1");
    ];
}

columns! {
    /// Results that only contacts with a layer on a rigid base have.
    pub const LAYER_RESULTS = [
        /// compression p₀ t/M of the layer by the mean pressure, with M/E* = (1 − ν)²/(1 − 2ν). It
        /// does not change the gap. Null for a coating, because the displacement of the half-space
        /// below it is undefined
        pub const UNIFORM_COMPRESSION: Column = real("uniform_compression", "length");
        /// displacement of the rough body towards the rigid base of the layer since the first
        /// touch: uniform_compression + highest height − mean_gap + mean_yielded_depth, with the
        /// height above the mean plane. Null for a coating
        pub const APPROACH: Column = real("approach", "length");
    ];
}
