//! Columns of the stiffness and of the conductance of contacts.

use super::{columns, integer, parameter, real};
use asperity_tables::column::{Column, Role};

columns! {
    /// incremental stiffness (side/E*) dp₀/dδ at the beginning of an unloading from this load, as
    /// `stiffness` but with all nodes in contact, because saturated nodes unload elastically. It
    /// equals `stiffness` where nothing yields. Null for elastic material
    pub const UNLOADING_STIFFNESS: Column = real("unloading_stiffness", "E*/side");
}

columns! {
    /// Columns that measured contacts have if their stiffness is computed, besides the stiffness of
    /// unloading.
    pub const CONDUCTANCE = [
        /// incremental stiffness of the interface, (side/E*) dp₀/dδ, exact on the mesh: nodes in
        /// contact stay in contact, and saturated nodes keep their pressure. The approach δ is
        /// mean_displacement + mean_yielded_depth − mean_gap and excludes the uniform compression
        /// of a layer; the side of a rectangle is its longer side. Null in full contact with a
        /// periodic body, which is rigid, and if `max_pairs` pairs of transforms were not enough
        pub const FROZEN_STIFFNESS: Column = real("stiffness", "E*/side");
        /// conductance of the contact per nominal area, h_c side/k_s, with the conductivity 2/k_s =
        /// 1/k₁ + 1/k₂ of the bodies. It equals the stiffness of all nodes in contact (Barber
        /// 2003): `stiffness`, or `unloading_stiffness` with a hardness. With a layer, k₁ is its
        /// conductivity, and the conduction through the layer is solved; the resistance of the
        /// layer to a uniform flux is excluded. Films and the gas in the gap are excluded, too.
        /// Null in full contact with a periodic body, and with a layer without conductivities
        pub const CONTACT_CONDUCTANCE: Column = real("contact_conductance", "k_s/side");
        /// number of contact spots: 4-connected clusters of contact nodes
        pub const SPOTS: Column = integer("spots", "1");
        /// mean radius √(A/π) of circles with the areas A of the contact spots
        pub const MEAN_SPOT_RADIUS: Column = real("mean_spot_radius", "length");
        /// conductance per nominal area by the formula of Greenwood (1966) for separate circular
        /// spots, with the periodic images of the spots. Null with a layer, if the spots are so
        /// close that the formula gives no positive number, and for more than 20,000 spots of an
        /// isolated map
        pub const GREENWOOD_CONDUCTANCE: Column = real("greenwood_conductance", "k_s/side");
    ];
}

columns! {
    /// normal force on the cell: mean pressure × nominal area. The column exists if the manifest
    /// gives loads as forces, or if the bodies have conductivities and the pressures a unit
    pub const FORCE: Column = parameter("force", "N").with_role(Role::Derived);
    /// electrical resistance of one circular spot that bears the force F under the hardness H
    /// (Holm): ρ_s/2 √(π H/F). Null with a layer
    pub const HOLM_RESISTANCE: Column = real("holm_resistance", "Ω");
}

columns! {
    /// conductivity of the layer over that of its substrate, k₁/k₂ = ρ₂/ρ₁; 0 if the substrate
    /// conducts perfectly, as a rigid base does. The column exists for layers with conductivities
    pub const SUBSTRATE_CONDUCTIVITY_RATIO: Column =
        parameter("substrate_conductivity_ratio", "1");
    /// conductivity of the layer over that of the rough body; 0 if that body conducts perfectly.
    /// The column exists for layers with conductivities
    pub const COUNTER_CONDUCTIVITY_RATIO: Column = parameter("counter_conductivity_ratio", "1");
    /// thermal resistance of the layer to a uniform flux, t/(k₁ × nominal area), which is in series
    /// with `thermal_resistance`. The column exists for layers with a conductivity
    pub const LAYER_THERMAL_RESISTANCE: Column = real("layer_thermal_resistance", "K/W");
    /// electrical resistance of the layer to a uniform current, ρ₁ t/nominal area, which is in
    /// series with `electrical_resistance`. The column exists for layers with a resistivity
    pub const LAYER_ELECTRICAL_RESISTANCE: Column = real("layer_electrical_resistance", "Ω");
}

columns! {
    /// Columns of measured contacts of bodies with a thermal conductivity.
    pub const THERMAL = [
        /// thermal conductivity k_s of the pair of bodies, 2/k_s = 1/k₁ + 1/k₂; 2k₁ if the other
        /// body conducts perfectly, as a rigid one that is not listed does. With a layer, k₁ is its
        /// conductivity
        pub const PAIR_CONDUCTIVITY: Column = parameter("pair_conductivity", "W/(m K)");
        /// thermal conductance h_c of the contact per nominal area, contact_conductance × k_s/side:
        /// heat flux per difference of temperature. Null where `contact_conductance` is
        pub const THERMAL_CONDUCTANCE: Column = real("thermal_conductance", "W/(m² K)");
        /// thermal constriction resistance of the whole cell, 1/(h_c × nominal area)
        pub const THERMAL_RESISTANCE: Column = real("thermal_resistance", "K/W");
    ];
}
columns! {
    /// Columns of measured contacts of bodies with an electrical resistivity.
    pub const ELECTRICAL = [
        /// mean electrical resistivity ρ_s = (ρ₁ + ρ₂)/2 of the bodies; ρ₁/2 if the other body
        /// conducts perfectly, as a rigid one that is not listed does. With a layer, ρ₁ is its
        /// resistivity
        pub const PAIR_RESISTIVITY: Column = parameter("pair_resistivity", "Ω m");
        /// specific electrical resistance of the contact, ρ_s × side/contact_conductance: voltage
        /// per current density. Null where `contact_conductance` is
        pub const SPECIFIC_RESISTANCE: Column = real("specific_resistance", "Ω m²");
        /// electrical constriction resistance of the whole cell: specific resistance/nominal area
        pub const ELECTRICAL_RESISTANCE: Column = real("electrical_resistance", "Ω");
        /// electrical resistance of the whole cell by Greenwood's formula for separate circular
        /// spots, from `greenwood_conductance`
        pub const GREENWOOD_RESISTANCE: Column = real("greenwood_resistance", "Ω");
    ];
}
