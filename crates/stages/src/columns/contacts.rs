//! Columns of what a load does, and of what is counted in its contact map.

use super::{EFFECTIVE_MODULUS, LOAD, MAX_PAIRS, PRESSURE, TOLERANCE, flag, integer, real, text};
use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::{Bytes, Reals};

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
pub const STOP: Column = text("stop", "how the load ended: converged, full-contact or pair-limit");
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
