//! Columns of how pressures, gaps and clusters are distributed under a load.

use super::{integer, parameter, real};
use asperity_tables::column::Column;

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
