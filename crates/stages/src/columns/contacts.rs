//! Columns of what a load does: its contact, what is counted in the contact map, what asperity
//! models and the flow through the gap add, areas corrected for the mesh, and distributions.

use super::{
    EFFECTIVE_MODULUS, LOAD, MAX_PAIRS, PRESSURE, TOLERANCE, flag, integer, parameter,
    parameter_text, real, text,
};
use asperity_tables::column::ColumnKind::{Bytes, Reals};
use asperity_tables::column::{Code, Column};

// What a load does.
pub const CONTACT_NODES: Column = integer("contact_nodes", "1", "nodes with positive pressure");
pub const MEAN_GAP: Column = real("mean_gap", "length", "mean distance of the surfaces");
pub const ENERGY: Column =
    real("energy", "pressure × length", "elastic energy per unit of nominal area");
pub const PEAK_PRESSURE: Column = real("peak_pressure", "pressure", "largest pressure");
pub const PAIRS: Column = integer(
    "pairs",
    "1",
    "forward and inverse transforms that the load took, those on coarser meshes by their nodes",
);
pub const RESIDUAL: Column =
    real("residual", "rms slope × mesh step", "largest gap in contact or penetration outside it");
pub const STOP: Column = text("stop", "how the solution of the load ended").with_codes(&[
    Code { word: "converged", meaning: "the residual is within the tolerance" },
    Code {
        word: "full-contact",
        meaning: "every node touches and none yields, so that the solution is exact",
    },
    Code {
        word: "pair-limit",
        meaning: "`max_pairs` pairs of transforms were not enough: the residual exceeds the tolerance",
    },
]);
pub const CONTACT: Column = Column::heavy(
    "contact",
    Bytes,
    "",
    "contact map, one bit a node, row-major, least significant bit first",
);
pub const PRESSURES: Column = Column::heavy(
    "pressures",
    Reals,
    "pressure",
    "pressures of the nodes, row-major; null where there is no contact",
);

pub const PRESSURE_COUNTS: Column = Column::heavy(
    "pressure_counts",
    Reals,
    "1",
    "nodes in contact by their pressure, in the bins of `pressure_bins`, and last those beyond",
);
pub const GAP_COUNTS: Column = Column::heavy(
    "gap_counts",
    Reals,
    "1",
    "nodes out of contact by their gap, in the bins of `gap_bins`, and last those beyond",
);

// What is counted in a contact map.
pub const AREA_FRACTION: Column = real("area_fraction", "1", "share of the nodes in contact");
pub const SWITCHES_ALONG_ROWS: Column = integer(
    "switches_along_rows",
    "1",
    "changes between contact and gap along all rows; around the cell where it is periodic",
);
pub const SWITCHES_ALONG_COLUMNS: Column = integer(
    "switches_along_columns",
    "1",
    "changes between contact and gap along all columns; around the cell where it is periodic",
);
pub const SWITCHES_X: Column = integer(
    "switches_x",
    "1",
    "changes between contact and gap from node to node along x, edges of length Δy, so that S_d = Δy \
     × switches_x + Δx × switches_y; of a rectangle; a square has them as `switches_along_columns`",
);
pub const SWITCHES_Y: Column = integer(
    "switches_y",
    "1",
    "changes between contact and gap from node to node along y, edges of length Δx; of a rectangle; \
     a square has them as `switches_along_rows`",
);
pub const SWITCHES: Column =
    integer("switches", "1", "changes between contact and gap along all rows and columns");
pub const PERIMETER_MANHATTAN: Column = real(
    "perimeter_manhattan",
    "length",
    "S_d: switches × mesh step, of a rectangle Δy × switches_x + Δx × switches_y; without the edges of \
     a map that nothing surrounds",
);
pub const PERIMETER_EUCLIDEAN: Column =
    real("perimeter_euclidean", "length", "π/4 of the Manhattan perimeter");
pub const EDGE_NODES_4: Column =
    integer("edge_nodes_4", "1", "contact nodes with a gap among their 4 neighbours");
pub const EDGE_NODES_8: Column =
    integer("edge_nodes_8", "1", "contact nodes with a gap among their 8 neighbours");
pub const INTERIOR_NODES: Column =
    integer("interior_nodes", "1", "contact nodes whose 8 neighbours all touch");
pub const CLUSTERS: Column = integer(
    "clusters",
    "1",
    "4-connected clusters of contact nodes; around the cell where it is periodic",
);
pub const LARGEST_CLUSTER: Column = integer("largest_cluster", "1", "nodes of the largest cluster");
pub const PERCOLATES_X: Column = flag(
    "percolates_x",
    "some contact cluster winds around the cell along x, or reaches from edge to edge where it is not \
     periodic",
);
pub const PERCOLATES_Y: Column = flag(
    "percolates_y",
    "some contact cluster winds around the cell along y, or reaches from edge to edge where it is not \
     periodic",
);
pub const GAP_PERCOLATES_X: Column = flag(
    "gap_percolates_x",
    "some 4-connected channel of gap winds around the cell along x, or reaches from edge to edge where \
     it is not periodic",
);
pub const GAP_PERCOLATES_Y: Column = flag(
    "gap_percolates_y",
    "some 4-connected channel of gap winds around the cell along y, or reaches from edge to edge where \
     it is not periodic",
);
pub const MEAN_CONTACT_PRESSURE: Column =
    real("mean_contact_pressure", "pressure", "mean pressure over the contact nodes");
pub const SECANT: Column = real("secant", "1", "area fraction over load, κ of the secant");

pub const STIFFNESS: Column = real(
    "stiffness_finite_difference",
    "E*/side",
    "incremental stiffness of the interface, (side/E*) dp₀/dδ, as a finite difference between this load \
     and both loads beside it in its block; the approach δ is mean_displacement + mean_yielded_depth − \
     mean_gap, the side the longer one of a rectangle; null at the first load and the last, where a load \
     beside differs by more than a tenth, in full contact, and where one of the three loads was given up",
);

/// What is measured of a contact map that is a rectangle, besides.
pub const SWITCHES_ALONG_AXES: [Column; 2] = [SWITCHES_X, SWITCHES_Y];

/// What is measured of a contact map.
pub const CONTACT_MEASURES: [Column; 21] = [
    AREA_FRACTION,
    CONTACT_NODES,
    SWITCHES_ALONG_ROWS,
    SWITCHES_ALONG_COLUMNS,
    SWITCHES,
    PERIMETER_MANHATTAN,
    PERIMETER_EUCLIDEAN,
    EDGE_NODES_4,
    EDGE_NODES_8,
    INTERIOR_NODES,
    CLUSTERS,
    LARGEST_CLUSTER,
    PERCOLATES_X,
    PERCOLATES_Y,
    GAP_PERCOLATES_X,
    GAP_PERCOLATES_Y,
    MEAN_CONTACT_PRESSURE,
    SECANT,
    MEAN_GAP,
    ENERGY,
    STOP,
];

/// What is solved for under a load.
pub const SOLVED: [Column; 12] = [
    EFFECTIVE_MODULUS,
    TOLERANCE,
    MAX_PAIRS,
    LOAD,
    PRESSURE,
    CONTACT_NODES,
    MEAN_GAP,
    ENERGY,
    PEAK_PRESSURE,
    PAIRS,
    RESIDUAL,
    STOP,
];

// Asperity models on the surfaces that are solved.

pub const INTERACTION: Column = parameter_text(
    "interaction",
    "elastic interaction of the asperities where Hertzian contacts of the summits replace the solved \
     contact; then `contact_nodes` and maps hold the nodes inside their ellipses, and `residual` is the \
     largest change of a displacement by one more iteration; null where the contact of every node is \
     solved",
)
.with_codes(&[
    Code { word: "none", meaning: "asperities do not interact" },
    Code {
        word: "mean-field",
        meaning: "each asperity is displaced by the mean pressure on all of them",
    },
    Code { word: "explicit", meaning: "each asperity is displaced by the forces on all others" },
]);
pub const CONTACTS: Column = integer("contacts", "1", "summits that touch");
pub const OVERLAPPING_CONTACTS: Column =
    integer("overlapping_contacts", "1", "summits that touch on an ellipse that overlaps another");
pub const ASPERITY_AREA_FRACTION: Column = real(
    "asperity_area_fraction",
    "1",
    "sum of the areas of the ellipses over the nominal area; what overlaps counts twice",
);
pub const OVERLAPPING_SHARE: Column = real(
    "overlapping_share",
    "1",
    "share of the ellipses' area in ellipses that overlap another: the model is of contacts that stay \
     apart",
);
pub const NOMINAL_DISPLACEMENT: Column = real(
    "nominal_displacement",
    "length",
    "mean displacement of a square of the cell's area under the mean pressure, by which the reference \
     plane is nearer to the unloaded body; zero without interaction",
);

/// What is known of a load on asperities beyond what solvers tell.
pub const OF_ASPERITIES: [Column; 5] = [
    CONTACTS,
    OVERLAPPING_CONTACTS,
    ASPERITY_AREA_FRACTION,
    OVERLAPPING_SHARE,
    NOMINAL_DISPLACEMENT,
];

// The flow through the gap.

pub const FLOW_FACTOR_X: Column = real(
    "flow_factor_x",
    "1",
    "flow through the gap along x, over that between smooth walls at the mean gap: zero where no channel \
     of the gap goes around the cell that way, null where the flow was not found",
);
pub const FLOW_FACTOR_Y: Column = real("flow_factor_y", "1", "the same along y");
pub const FLOW_CONDUCTIVITY_X: Column = real(
    "flow_conductivity_x",
    "length³",
    "effective conductivity K of the gap along x: a film of viscosity μ carries K/(12 μ) × the gradient of \
     its pressure for each unit of width",
);
pub const FLOW_CONDUCTIVITY_Y: Column = real("flow_conductivity_y", "length³", "the same along y");
pub const FLOW_RESIDUAL: Column = real(
    "flow_residual",
    "1",
    "the most that a flow may be too large by, over itself: the distance of its bounds by the principles \
     of Dirichlet and Thomson, the larger one of x and y",
);
pub const FLOW_STOP: Column =
    text("flow_stop", "how the computation of the flow along x and y ended").with_codes(&[
        Code { word: "converged", meaning: "both flows are within the tolerance" },
        Code {
            word: "no-channel",
            meaning: "the gap percolates in neither direction: nothing flows",
        },
        Code {
            word: "iteration-limit",
            meaning: "a flow was not found within the limit of iterations; its columns are null",
        },
    ]);

/// What is known of the flow under a load.
pub const FLOW: [Column; 6] = [
    FLOW_FACTOR_X,
    FLOW_FACTOR_Y,
    FLOW_CONDUCTIVITY_X,
    FLOW_CONDUCTIVITY_Y,
    FLOW_RESIDUAL,
    FLOW_STOP,
];

// Areas corrected for the mesh.

// What a correction does.
pub const CORRECTION: Column =
    parameter_text("correction", "name of the estimator of the true area");
pub const COEFFICIENT: Column =
    parameter("coefficient", "1", "share of the Manhattan perimeter × mesh step taken off");
pub const AREA_CORRECTED: Column =
    real("area_corrected", "1", "estimate of the true share of the area");
pub const AREA_LOWER: Column = real(
    "area_lower",
    "1",
    "lower bound on the true share of the area, A − π/4 S_d Δx or 0; for pi/8",
);
pub const AREA_UPPER: Column =
    real("area_upper", "1", "upper bound on the true share of the area, as counted; for pi/8");
pub const ERROR_ABSOLUTE: Column = real(
    "error_absolute",
    "1",
    "what the correction takes away, π/8 S_d Δx, a share of the cell: half the distance of the \
     bounds where the lower one is above 0; for pi/8",
);
pub const ERROR_RELATIVE: Column =
    real("error_relative", "1", "what the correction takes away over the counted area; for pi/8");

/// What is corrected, and what it is corrected from.
pub const CORRECTED: [Column; 11] = [
    CORRECTION,
    COEFFICIENT,
    AREA_CORRECTED,
    AREA_LOWER,
    AREA_UPPER,
    ERROR_ABSOLUTE,
    ERROR_RELATIVE,
    AREA_FRACTION,
    CONTACT_NODES,
    SWITCHES,
    STOP,
];

// Distributions of pressures, gaps and clusters.

pub const CONTACT_PRESSURE: Column = parameter(
    "contact_pressure",
    "E* × rms slope",
    "middle of the bin of pressures in contact; bins are equal and begin at zero",
);
pub const PRESSURE_BIN_WIDTH: Column =
    real("pressure_bin_width", "E* × rms slope", "width of the bin");
pub const PRESSURE_NODES: Column = integer(
    "pressure_nodes",
    "1",
    "nodes in contact whose pressure lies in the bin, its lower end included",
);
pub const PRESSURE_DENSITY: Column = real(
    "pressure_density",
    "1/(E* × rms slope)",
    "probability density of the pressure over the nominal area: its integral is the area fraction, \
     its first moment the load; out of contact the pressure is zero, and not counted",
);
pub const PRESSURE_DENSITY_PERSSON: Column = real(
    "pressure_density_persson",
    "1/(E* × rms slope)",
    "the same in Persson's theory (2001), averaged over the bin",
);
pub const PRESSURE_NODES_BEYOND: Column = integer(
    "pressure_nodes_beyond",
    "1",
    "nodes in contact whose pressure lies above all bins, the same in each row of a load",
);
pub const GAP: Column = parameter(
    "gap",
    "rms height",
    "middle of the bin of gaps out of contact; bins are equal and begin at zero",
);
pub const GAP_BIN_WIDTH: Column = real("gap_bin_width", "rms height", "width of the bin");
pub const GAP_NODES: Column = integer(
    "gap_nodes",
    "1",
    "nodes out of contact whose gap lies in the bin, its lower end included; one that rounding or the \
     tolerance made negative counts as zero",
);
pub const GAP_DENSITY: Column = real(
    "gap_density",
    "1/rms height",
    "probability density of the gap over the nominal area: its integral is the share out of contact, \
     its first moment the mean gap",
);
pub const GAP_NODES_BEYOND: Column = integer(
    "gap_nodes_beyond",
    "1",
    "nodes out of contact whose gap lies above all bins, the same in each row of a load",
);
pub const CLUSTER_AREA: Column = parameter(
    "cluster_area",
    "1",
    "geometric middle of the bin of areas of clusters, over the nominal area; bins are equal in the \
     logarithm and end at 1, which the last one includes, as all include their lower end",
);
pub const CLUSTER_NUMBER: Column = integer(
    "cluster_number",
    "1",
    "4-connected clusters of contact nodes whose area lies in the bin",
);
pub const CLUSTER_DENSITY: Column = real(
    "cluster_density",
    "1",
    "clusters in the bin over the width of the bin in the natural logarithm of the area",
);
pub const CLUSTER_AREA_SHARE: Column = real(
    "cluster_area_share",
    "1",
    "share of the nominal area that the clusters of the bin cover together",
);
pub const CLUSTER_PERIMETER: Column = real(
    "cluster_perimeter",
    "length",
    "mean Euclidean perimeter of the clusters in the bin, π/4 of that in the metric of the mesh, edges \
     of their own holes included; null where there are none",
);
pub const CLUSTER_COMPACTNESS: Column = real(
    "cluster_compactness",
    "1",
    "mean of 4π area / perimeter² of the clusters in the bin: 1 of a large disc, and 4/π of a square \
     along the axes of the mesh, whose edges count π/4 of their length; null where none has an edge",
);

/// Columns of a distribution of pressures.
pub const PRESSURE_DISTRIBUTION: [Column; 6] = [
    CONTACT_PRESSURE,
    PRESSURE_BIN_WIDTH,
    PRESSURE_NODES,
    PRESSURE_DENSITY,
    PRESSURE_DENSITY_PERSSON,
    PRESSURE_NODES_BEYOND,
];

/// Columns of a distribution of gaps.
pub const GAP_DISTRIBUTION: [Column; 5] =
    [GAP, GAP_BIN_WIDTH, GAP_NODES, GAP_DENSITY, GAP_NODES_BEYOND];

/// Columns of a distribution of clusters.
pub const CLUSTER_DISTRIBUTION: [Column; 6] = [
    CLUSTER_AREA,
    CLUSTER_NUMBER,
    CLUSTER_DENSITY,
    CLUSTER_AREA_SHARE,
    CLUSTER_PERIMETER,
    CLUSTER_COMPACTNESS,
];
