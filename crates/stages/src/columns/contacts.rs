//! Columns of solved loads, contact maps, asperity models, flow, corrected areas and distributions.

use crate::columns::{
    TOLERANCE, codes, columns, flag, heavy, integer, parameter, parameter_text, real, text,
};
use asperity_tables::column::ColumnKind::{Bytes, Reals};
use asperity_tables::column::{Column, Role};

// Results of a load.
columns! {
    /// number of nodes with positive pressure
    pub const CONTACT_NODES: Column = integer("contact_nodes", "1");
    /// mean gap between the surfaces
    pub const MEAN_GAP: Column = real("mean_gap", "length");
    /// elastic energy per unit of nominal area
    pub const ENERGY: Column = real("energy", "pressure × length");
    /// largest pressure of a node
    pub const PEAK_PRESSURE: Column = real("peak_pressure", "pressure");
    /// pairs of forward and inverse Fourier transforms for the load; a pair on a coarser mesh
    /// counts in proportion to its nodes
    pub const PAIRS: Column = integer("pairs", "1");
    /// largest gap in contact or penetration outside contact
    pub const RESIDUAL: Column = real("residual", "rms slope × mesh step");
    /// how the solution for the load ended
    pub const STOP: Column = text("stop").with_codes(codes![
        /// the residual is within the tolerance
        "converged",
        /// every node touches and none yields, so that the solution is exact
        "full-contact",
        /// `max_pairs` pairs of transforms were not enough: the residual exceeds the tolerance
        "pair-limit",
        /// the surfaces do not touch at the prescribed mean gap, and the load is zero
        "no-contact",
        /// no load gives the prescribed mean gap or displacement; the row is that of the nearest
        /// load. A half-space in full contact does not come nearer
        "not-reached",
    ]);
    /// contact map: one bit per node, row-major, least significant bit first
    pub const CONTACT: Column = heavy("contact", Bytes, "");
    /// pressures of the nodes, row-major; null outside contact
    pub const PRESSURES: Column = heavy("pressures", Reals, "pressure");
    /// number of contact nodes in each bin of `pressure_bins`; the last entry counts the nodes
    /// above all bins
    pub const PRESSURE_COUNTS: Column = heavy("pressure_counts", Reals, "1");
    /// number of nodes outside contact in each bin of `gap_bins`; the last entry counts the nodes
    /// above all bins
    pub const GAP_COUNTS: Column = heavy("gap_counts", Reals, "1");

    // Measures of a contact map.
    /// fraction of the nodes in contact
    pub const AREA_FRACTION: Column = real("area_fraction", "1");
    /// number of changes between contact and gap along all rows, including those across the edge of
    /// a periodic cell
    pub const SWITCHES_ALONG_ROWS: Column = integer("switches_along_rows", "1");
    /// number of changes between contact and gap along all columns, including those across the edge
    /// of a periodic cell
    pub const SWITCHES_ALONG_COLUMNS: Column = integer("switches_along_columns", "1");
    /// number of changes between contact and gap along all rows and columns
    pub const SWITCHES: Column = integer("switches", "1");
    /// perimeter S_d of the contact along the edges of the cells: switches × mesh step, or Δy ×
    /// switches_x + Δx × switches_y for rectangular cells; the edges of a free map do not count
    pub const PERIMETER_MANHATTAN: Column = real("perimeter_manhattan", "length");
    /// estimate of the perimeter: π/4 × the Manhattan perimeter
    pub const PERIMETER_EUCLIDEAN: Column = real("perimeter_euclidean", "length");
    /// number of contact nodes that have a node out of contact among their 4 neighbours
    pub const EDGE_NODES_4: Column = integer("edge_nodes_4", "1");
    /// number of contact nodes that have a node out of contact among their 8 neighbours
    pub const EDGE_NODES_8: Column = integer("edge_nodes_8", "1");
    /// number of contact nodes whose 8 neighbours are all in contact
    pub const INTERIOR_NODES: Column = integer("interior_nodes", "1");
    /// number of 4-connected clusters of contact nodes; clusters connect across the edge of a
    /// periodic cell
    pub const CLUSTERS: Column = integer("clusters", "1");
    /// number of nodes of the largest cluster
    pub const LARGEST_CLUSTER: Column = integer("largest_cluster", "1");
    /// whether a contact cluster percolates along x: it winds around a periodic cell, or reaches
    /// from edge to edge of a free map
    pub const PERCOLATES_X: Column = flag("percolates_x");
    /// whether a contact cluster percolates along y: it winds around a periodic cell, or reaches
    /// from edge to edge of a free map
    pub const PERCOLATES_Y: Column = flag("percolates_y");
    /// whether a 4-connected channel of the gap percolates along x: it winds around a periodic
    /// cell, or reaches from edge to edge of a free map
    pub const GAP_PERCOLATES_X: Column = flag("gap_percolates_x");
    /// whether a 4-connected channel of the gap percolates along y: it winds around a periodic
    /// cell, or reaches from edge to edge of a free map
    pub const GAP_PERCOLATES_Y: Column = flag("gap_percolates_y");
    /// mean pressure over the nodes of the area
    pub const MEAN_CONTACT_PRESSURE: Column = real("mean_contact_pressure", "pressure");
    /// area fraction divided by the load; it tends to κ under small loads. Null with adhesion,
    /// where the area does not vanish with the load
    pub const SECANT: Column = real("secant", "1");
    /// fraction of the contact area on filled nodes, whose heights were not measured but chosen by
    /// `fill`. After `resample`, a node counts as filled if the nearest node of the map was filled;
    /// for two bodies, if it is filled on one of them. Null without contact, and for surfaces
    /// without filled nodes
    pub const FILLED_AREA_SHARE: Column = real("filled_area_share", "1");
    /// incremental stiffness of the interface, (side/E*) dp₀/dδ, as a finite difference over the
    /// neighbouring loads of the stage. The approach δ is mean_displacement + mean_yielded_depth −
    /// mean_gap; the side of a rectangle is its longer side. Null at the first and the last load,
    /// where a neighbouring load differs by more than a tenth, where a path with adhesion turns, in
    /// full contact, and where one of the three loads did not converge
    pub const STIFFNESS: Column = real("stiffness_finite_difference", "E*/side");
}

columns! {
    /// number of changes between contact and gap along x, each a cell edge of length Δy: S_d =
    /// Δy × switches_x + Δx × switches_y. Null for square meshes, see `switches_along_columns`
    pub const SWITCHES_X: Column = integer("switches_x", "1");
    /// number of changes between contact and gap along y, each a cell edge of length Δx. Null
    /// for square meshes, see `switches_along_rows`
    pub const SWITCHES_Y: Column = integer("switches_y", "1");
}

// Asperity models.

columns! {
    /// elastic interaction of the asperities, if Hertzian contacts of the summits model the
    /// contact. `contact_nodes` and contact maps then count the nodes inside the contact ellipses,
    /// and `residual` is the largest change of a displacement in one more iteration. Null if the
    /// contact is solved at every node
    pub const INTERACTION: Column = parameter_text("interaction").with_codes(codes![
        /// asperities do not interact
        "none",
        /// each asperity is displaced by the mean pressure on all of them
        "mean-field",
        /// each asperity is displaced by the forces on all others
        "explicit",
    ]);
}

columns! {
    /// number of summits in contact
    pub const CONTACTS: Column = integer("contacts", "1");
    /// number of summits whose contact ellipse overlaps another one
    pub const OVERLAPPING_CONTACTS: Column = integer("overlapping_contacts", "1");
    /// total area of the contact ellipses divided by the nominal area; an overlap counts in
    /// each of its ellipses
    pub const ASPERITY_AREA_FRACTION: Column = real("asperity_area_fraction", "1");
    /// fraction of the total area of the contact ellipses that overlapping ellipses have; the
    /// model assumes separate contacts
    pub const OVERLAPPING_SHARE: Column = real("overlapping_share", "1");
    /// mean displacement of a uniformly loaded square with the area of the cell, under the mean
    /// pressure. The reference plane approaches the unloaded body by this distance. Zero
    /// without interaction
    pub const NOMINAL_DISPLACEMENT: Column = real("nominal_displacement", "length");
}

// Flow through the gap.

columns! {
    /// Columns of the flow through the gap at a load.
    pub const FLOW = [
        /// flow through the gap along x divided by the flow between smooth walls at the mean gap;
        /// zero where no channel of the gap percolates along x, null where the computation did not
        /// converge
        pub const FLOW_FACTOR_X: Column = real("flow_factor_x", "1");
        /// flow factor along y, see `flow_factor_x`
        pub const FLOW_FACTOR_Y: Column = real("flow_factor_y", "1");
        /// effective conductivity K of the gap along x: the volume flow per unit width of a film of
        /// viscosity μ is K/(12 μ) × the pressure gradient
        pub const FLOW_CONDUCTIVITY_X: Column = real("flow_conductivity_x", "length³");
        /// effective conductivity along y, see `flow_conductivity_x`
        pub const FLOW_CONDUCTIVITY_Y: Column = real("flow_conductivity_y", "length³");
        /// upper bound of the relative error of the flow on the mesh: the difference between its
        /// upper and its lower bound (principles of Dirichlet and Thomson), at most 1e-6; the
        /// larger value of the flows along x and y
        pub const FLOW_RESIDUAL: Column = real("flow_residual", "1");
        /// how the computation of the flow along x and y ended
        pub const FLOW_STOP: Column = text("flow_stop").with_codes(codes![
            /// both flows are within the tolerance
            "converged",
            /// the gap percolates in neither direction: nothing flows
            "no-channel",
            /// a flow was not found within the limit of iterations; its columns are null
            "iteration-limit",
        ]);
    ];
}

// Areas corrected for the mesh.
columns! {
    /// name of the estimator of the true area
    pub const CORRECTION: Column = parameter_text("correction");
    /// coefficient c of the correction: corrected area = area − c × Manhattan perimeter × mesh step
    pub const COEFFICIENT: Column = parameter("coefficient", "1");
    /// estimate of the true contact area divided by the nominal area
    pub const AREA_CORRECTED: Column = real("area_corrected", "1");
    /// lower bound of the true area fraction, max(A − π/4 S_d Δx, 0); null unless `correction` is
    /// pi/8
    pub const AREA_LOWER: Column = real("area_lower", "1");
    /// upper bound of the true area fraction: the counted one; null unless `correction` is pi/8
    pub const AREA_UPPER: Column = real("area_upper", "1");
    /// absolute error of the area fraction, π/8 S_d Δx: half the distance between the bounds if the
    /// lower one is positive; null unless `correction` is pi/8
    pub const ERROR_ABSOLUTE: Column = real("error_absolute", "1");
    /// absolute error divided by the counted area fraction; null unless `correction` is pi/8
    pub const ERROR_RELATIVE: Column = real("error_relative", "1");
}

// Distributions of pressures, gaps and clusters.

columns! {
    /// Columns of a distribution of pressures.
    pub const PRESSURE_DISTRIBUTION = [
        /// centre of the bin of contact pressures; bins have equal width and begin at zero
        pub const CONTACT_PRESSURE: Column = parameter("contact_pressure", "E* × rms slope");
        /// width of the bin of pressures
        pub const PRESSURE_BIN_WIDTH: Column = real("pressure_bin_width", "E* × rms slope");
        /// number of contact nodes whose pressure lies in the bin; a bin includes its lower end
        pub const PRESSURE_NODES: Column = integer("pressure_nodes", "1");
        /// probability density of the contact pressure over the nominal area: its integral is the
        /// area fraction, its first moment the load; nodes outside contact do not count
        pub const PRESSURE_DENSITY: Column = real("pressure_density", "1/(E* × rms slope)");
        /// density of the contact pressure in Persson's theory (2001), averaged over the bin
        pub const PRESSURE_DENSITY_PERSSON: Column =
            real("pressure_density_persson", "1/(E* × rms slope)");
        /// number of contact nodes whose pressure lies above all bins, equal in all rows of a load
        pub const PRESSURE_NODES_BEYOND: Column = integer("pressure_nodes_beyond", "1");
    ];
}

columns! {
    /// Columns of a distribution of gaps.
    pub const GAP_DISTRIBUTION = [
        /// centre of the bin of gaps outside contact; bins have equal width and begin at zero. The
        /// unit is the rms height of the nodes before they yielded
        pub const GAP: Column = parameter("gap", "rms height");
        /// width of the bin of gaps
        pub const GAP_BIN_WIDTH: Column = real("gap_bin_width", "rms height");
        /// number of nodes outside contact whose gap lies in the bin; a bin includes its lower end.
        /// A gap that is negative within the tolerance counts as zero
        pub const GAP_NODES: Column = integer("gap_nodes", "1");
        /// probability density of the gap over the nominal area: its integral is the area fraction
        /// outside contact, its first moment the mean gap
        pub const GAP_DENSITY: Column = real("gap_density", "1/rms height");
        /// number of nodes outside contact whose gap lies above all bins, equal in all rows of a
        /// load
        pub const GAP_NODES_BEYOND: Column = integer("gap_nodes_beyond", "1");
    ];
}

columns! {
    /// Columns of a distribution of clusters.
    pub const CLUSTER_DISTRIBUTION = [
        /// geometric mean of the ends of the bin of cluster areas, divided by the nominal area;
        /// bins have equal width in the logarithm. A bin includes its lower end, the last one also
        /// its upper end 1
        pub const CLUSTER_AREA: Column = parameter("cluster_area", "1");
        /// number of 4-connected contact clusters whose area lies in the bin
        pub const CLUSTER_NUMBER: Column = integer("cluster_number", "1");
        /// number of clusters in the bin divided by the width of the bin in ln(area)
        pub const CLUSTER_DENSITY: Column = real("cluster_density", "1");
        /// total area of the clusters in the bin divided by the nominal area
        pub const CLUSTER_AREA_SHARE: Column = real("cluster_area_share", "1");
        /// mean Euclidean perimeter of the clusters in the bin, π/4 × the Manhattan perimeter,
        /// including the edges of holes; null if there are no clusters
        pub const CLUSTER_PERIMETER: Column = real("cluster_perimeter", "length");
        /// mean of 4π area / perimeter² of the clusters in the bin: 1 for a large disc, 4/π for a
        /// square along the axes, because its perimeter is counted as π/4 × its length; null if no
        /// cluster has an edge
        pub const CLUSTER_COMPACTNESS: Column = real("cluster_compactness", "1");
    ];
}

// Settings.
columns! {
    /// work of adhesion w: energy per area that separates two flat surfaces in contact
    pub const WORK_OF_ADHESION: Column = parameter("work_of_adhesion", "pressure × length");
    /// range ρ of the attraction: the energy per area at the gap g is −w exp(−g/ρ)
    pub const INTERACTION_RANGE: Column = parameter("interaction_range", "length");
    /// quantity that the contact prescribes; without adhesion the column exists only if this is not
    /// the load
    pub const CONTROL: Column = parameter_text("control").with_codes(codes![
        /// the mean pressure is prescribed
        "load",
        /// the mean gap is prescribed
        "gap",
        /// the rigid approach of the bodies since first touch is prescribed
        "displacement",
    ]);
    /// direction of the path at the state: `approach` while the load grows or the mean gap falls,
    /// `separation` otherwise. Later branches in the same direction are numbered: `approach-2`
    pub const BRANCH: Column = parameter_text("branch");
    /// largest accepted error of the pressures
    pub const ADHESIVE_TOLERANCE: Column = Column { unit: "E* × rms slope", ..TOLERANCE };

    // Results of a state.
    /// mean gap that `control = "gap"` prescribes; `mean_gap` is that of the contact, and differs
    /// by more than the tolerance only where `stop` says so. With adhesion, only for free
    /// boundaries
    pub const PRESCRIBED_GAP: Column = real("prescribed_gap", "length");
    /// rigid approach of the bodies since first touch that `control = "displacement"` prescribes:
    /// highest height − mean_gap + mean_yielded_depth + mean displacement of the elastic surface,
    /// with the height above the mean plane; on a layer also uniform_compression. The mean
    /// displacement is zero on a periodic half-space
    pub const PRESCRIBED_DISPLACEMENT: Column = real("prescribed_displacement", "length");
    /// number of the state along the path; the first state is 1
    pub const STEP: Column = integer("step", "1");
    /// number of nodes in contact, whose gap is zero
    pub const ADHESIVE_CONTACT_NODES: Column = CONTACT_NODES;
    /// fraction of the nodes in contact, whose gap is zero
    pub const CONTACT_FRACTION: Column = real("contact_fraction", "1");
    /// number of nodes with positive pressure
    pub const REPULSIVE_NODES: Column = integer("repulsive_nodes", "1");
    /// fraction of the nodes with positive pressure
    pub const REPULSIVE_FRACTION: Column = real("repulsive_fraction", "1");
    /// mean over the nominal area of the negative pressures, as a positive number; `pressure` is
    /// the mean of the positive pressures minus this
    pub const ATTRACTIVE_PRESSURE: Column = real("attractive_pressure", "pressure");
    /// mean over the nominal area of the positive pressures
    pub const REPULSIVE_PRESSURE: Column = real("repulsive_pressure", "pressure");
    /// mean over the nominal area of the pressures of the nodes in contact, negative ones included
    pub const PRESSURE_IN_CONTACT: Column = real("pressure_in_contact", "pressure");
    /// elastic energy per unit of nominal area
    pub const ELASTIC_ENERGY: Column = real("elastic_energy", "pressure × length");
    /// mean interaction energy per unit of nominal area, −w⟨exp(−g/ρ)⟩
    pub const ADHESION_ENERGY: Column = real("adhesion_energy", "pressure × length");
    /// energy per unit of nominal area that was lost along the path up to this state: the work of
    /// the mean pressure on the approach, minus the change of elastic and adhesion energy. The work
    /// is a sum of trapezoids, whose error falls with the square of the steps of the path. It is
    /// zero in the first state, and again in the first state after the surfaces have been apart,
    /// because the work of a tension on surfaces that part has no limit
    pub const DISSIPATED_ENERGY: Column = real("dissipated_energy", "pressure × length");
    /// largest tension that the contact bears, as a negative load. It is given in the row of the
    /// first load below it; null in all other rows
    pub const PULL_OFF_LOAD: Column = real("pull_off_load", "E* × rms slope");
    /// pull-off load as a mean pressure over the nominal area, in the unit of `pressure`
    pub const PULL_OFF_PRESSURE: Column = real("pull_off_pressure", "pressure");
    /// Tabor parameter (R w²/E*²)^(1/3)/ρ of the surface with the radius of curvature R = 1/√m₄,
    /// where m₄ is computed from finite differences under a free boundary; null for flat surfaces.
    /// Small values are near the limit of Derjaguin, Muller & Toporov, large ones near that of
    /// Johnson, Kendall & Roberts
    pub const TABOR: Column = real("tabor", "1");
    /// 2w/(E* ρ h′) (κ ρ/h′²)^(2/3), the reciprocal of criterion 10 of Pastewka & Robbins (PNAS
    /// 111, 2014, 3298) with the rms slope h′ and half the rms Laplacian κ. Above 1, randomly rough
    /// surfaces are expected to stick, if ρ is short beside h′²/κ; null for flat surfaces
    pub const STICKINESS: Column = real("stickiness", "1");
    /// largest error of a pressure: outside contact the difference between elastic and attractive
    /// pressure, in contact a missing repulsion
    pub const ADHESIVE_RESIDUAL: Column = Column { unit: "E* × rms slope", ..RESIDUAL };
}
pub const ADHESIVE_STOP: Column = STOP.with_codes(codes![
    /// the residual is within the tolerance
    "converged",
    /// no state bears the tension: the surfaces are apart, and most results are null
    "pulled-off",
    /// `max_pairs` pairs of transforms were not enough: the residual exceeds the tolerance, or
    /// the search for `pull_off_load` did not end and most results are null
    "pair-limit",
    /// the state no longer moves, although its residual exceeds the tolerance
    "stalled",
    /// the state is in balance, but its mean gap is not `prescribed_gap`: the contact of an
    /// isolated patch jumps past it
    "gap-not-reached",
]);

columns! {
    /// map of the nodes with positive pressure, in the format of `contact`
    pub const REPULSIVE: Column = heavy("repulsive", Bytes, "");
    /// gaps of the nodes, row-major, at the last state of the path, from which a longer path
    /// continues, or at all states with `pressures = "all"`; null in all other rows, and if the
    /// surfaces are apart
    pub const GAPS: Column = heavy("gaps", Reals, "longer side × rms slope");
}

columns! {
    /// Columns of a distribution of pressures with adhesion, which have the names of those without.
    pub const ADHESIVE_PRESSURE_DISTRIBUTION = [
        /// centre of the bin of pressures; bins have equal width, and zero is an end of a bin.
        /// Negative pressures are attractive
        const ADHESIVE_CONTACT_PRESSURE: Column = CONTACT_PRESSURE;
        /// width of the bin of pressures
        const ADHESIVE_PRESSURE_BIN_WIDTH: Column = PRESSURE_BIN_WIDTH;
        /// number of nodes, in contact or not, whose pressure lies in the bin; a bin includes its
        /// end next to zero
        const ADHESIVE_PRESSURE_NODES: Column = PRESSURE_NODES;
        /// probability density of the pressure over the nominal area. All nodes count, so that its
        /// integral is 1 and its first moment the load, except for the nodes above all bins
        const ADHESIVE_PRESSURE_DENSITY: Column = PRESSURE_DENSITY;
        /// null, because the theory has no adhesion
        const ADHESIVE_PRESSURE_DENSITY_PERSSON: Column = PRESSURE_DENSITY_PERSSON;
        /// number of nodes whose pressure lies above all bins, equal in all rows of a load
        const ADHESIVE_PRESSURE_NODES_BEYOND: Column = PRESSURE_NODES_BEYOND;
    ];
}

columns! {
    /// nodes whose area, edges and clusters are measured; only for contacts with adhesion
    pub const NODE_SET: Column = parameter_text("node_set").with_codes(codes![
        /// nodes whose gap is zero
        "contact",
        /// nodes with positive pressure
        "repulsive",
    ]);
}

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

columns! {
    /// coefficient f of Coulomb friction
    pub const FRICTION_COEFFICIENT: Column = parameter("friction_coefficient", "1");
    /// Poisson's ratio ν of both bodies, on which the tangential compliance depends
    pub const POISSON_RATIO: Column = parameter("poisson_ratio", "1");
    /// tangential load Q/(f N) with the friction f N of the load N; the whole contact slips at 1
    pub const TANGENTIAL_LOAD: Column = parameter("tangential_load", "f × load");
    /// direction of the path of tangential loads at the state: `loading` while the tangential load
    /// grows, `unloading` otherwise. Later branches in the same direction are numbered: `loading-2`
    pub const TANGENTIAL_BRANCH: Column = parameter_text("tangential_branch");
    /// fraction of all nodes that are in contact and have not slipped since the path turned last:
    /// the contact area under the load N − Q/f, or N − |Q − Q*|/(2f) after a turn at Q*
    pub const STICK_FRACTION: Column = real("stick_fraction", "1");
    /// fraction of all nodes that are in contact and do not stick
    pub const SLIP_FRACTION: Column = real("slip_fraction", "1");
    /// tangential load per nominal area, Q/A₀
    pub const TANGENTIAL_TRACTION: Column = real("tangential_traction", "pressure");
    /// tangential displacement of the bodies since the path started, for elastically similar bodies
    /// and without the coupling through ν (Ciavarella 1998, Jäger 1998)
    pub const TANGENTIAL_DISPLACEMENT: Column = real("tangential_displacement", "length");
    /// incremental tangential stiffness (side/E*) dQ/(A₀ du) along the branch: the `stiffness`
    /// under the load of the stick area, divided by (2 − ν)/(2(1 − ν)); null unless the `solve`
    /// stage has `stiffness = true`
    pub const TANGENTIAL_STIFFNESS: Column = real("tangential_stiffness", "E*/side");
    /// energy per nominal area that friction has dissipated since the path started. It follows from
    /// approaches and elastic energies of the loads, without an integral over the path
    pub const FRICTIONAL_DISSIPATION: Column = real("frictional_dissipation", "pressure × length");
}

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

columns! {
    /// part of the path to which the load belongs; null if the stage has no `path`
    pub const LOADING_BRANCH: Column = BRANCH.with_codes(codes![
        /// no load before it was larger
        "loading",
        /// a load before it was larger, `maximum_load`; loading again up to this maximum returns
        /// through the same states
        "unloading",
    ]);
    /// largest load before this one, under which the material yielded; null while loading
    pub const MAXIMUM_LOAD: Column = parameter("maximum_load", "E* × rms slope");
    /// largest mean pressure before this one, under which the material yielded; null while loading
    pub const MAXIMUM_PRESSURE: Column = Column { unit: "pressure", ..MAXIMUM_LOAD };
    /// mean plastic depth of the surface, which remains without a load
    pub const RESIDUAL_DEPTH: Column = real("residual_depth", "length");
    /// plastic work per nominal area up to the largest load so far: hardness × residual depth
    pub const PLASTIC_WORK: Column = real("plastic_work", "pressure × length");
}
