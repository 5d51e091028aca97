//! Columns of solved loads, contact maps, asperity models, flow, corrected areas and distributions.

use super::{codes, columns, flag, heavy, integer, parameter, parameter_text, real, text};
use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::{Bytes, Reals};

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
