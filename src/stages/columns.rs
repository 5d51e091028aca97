//! Every column of every stage: its name, unit and meaning, said once.

use crate::store::column::ColumnKind::{Bytes, Flag, Integer, Real, Reals, Text};
use crate::store::column::{Column, Role};

mod measured;

pub use measured::*;

const fn parameter_text(name: &'static str, meaning: &'static str) -> Column {
    Column::parameter(name, Text, "", meaning)
}

const fn parameter_integer(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Column {
    Column::parameter(name, Integer, unit, meaning)
}

const fn parameter(name: &'static str, unit: &'static str, meaning: &'static str) -> Column {
    Column::parameter(name, Real, unit, meaning)
}

const fn real(name: &'static str, unit: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Real, unit, meaning)
}

const fn integer(name: &'static str, unit: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Integer, unit, meaning)
}

const fn flag(name: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Flag, "", meaning)
}

const fn text(name: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Text, "", meaning)
}

// Where a row belongs.
pub const SURFACE: Column = parameter_text(
    "surface",
    "name of the surface, the same in every stage's table",
)
.with_role(Role::Surface);
pub const METHOD: Column = parameter_text("method", "how the surface was made");
pub const NODES: Column = parameter_integer("nodes", "1", "nodes per side of the mesh");
pub const SIDE: Column = parameter("side", "length", "side of the periodic cell");
pub const NODES_X: Column = parameter_integer(
    "nodes_x",
    "1",
    "nodes of the mesh along x, of a rectangle; a square has `nodes`, as it had before there were any",
);
pub const NODES_Y: Column = parameter_integer(
    "nodes_y",
    "1",
    "nodes of the mesh along y, of a rectangle; a square has `nodes`",
);
pub const SIDE_X: Column = parameter(
    "side_x",
    "length",
    "side of the cell along x, of a rectangle; a square has `side`",
);
pub const SIDE_Y: Column = parameter(
    "side_y",
    "length",
    "side of the cell along y, of a rectangle; a square has `side`; wavenumbers count waves along \
     the longer of the two",
);
pub const RMS_SLOPE_OF_DIFFERENCES: Column = parameter(
    "rms_slope",
    "1",
    "root mean square of the gradient, of differences between neighbours inside the map, which is \
     not periodic, as all moments beside it; of periodic surfaces that of their Fourier modes",
);
pub const RMS_SLOPE: Column = parameter("rms_slope", "1", "root mean square of the gradient");
pub const RMS_SLOPE_OF_SURFACE: Column = parameter(
    "rms_slope",
    "1",
    "root mean square of the gradient of this very surface, which scatters about that of its spectrum",
)
.with_role(Role::Surface);
pub const HURST: Column = parameter("hurst", "1", "Hurst exponent");
pub const K_LOWER: Column =
    parameter_integer("k_lower", "2π/side", "lower cutoff wavenumber, inclusive");
pub const K_ROLLOFF: Column = parameter_integer(
    "k_rolloff",
    "2π/side",
    "wavenumber at which the plateau ends",
);
pub const K_UPPER: Column =
    parameter_integer("k_upper", "2π/side", "upper cutoff wavenumber, inclusive");
pub const ANISOTROPY_RATIO: Column = parameter(
    "anisotropy_ratio",
    "1",
    "correlation length along the grain over that across; null without grain; theories of isotropic \
     roughness are not about such surfaces",
);
pub const ANISOTROPY_ANGLE: Column = parameter(
    "anisotropy_angle",
    "°",
    "direction of the grain from the x axis",
);
pub const SEED: Column =
    parameter_integer("seed", "", "seed of the draws").with_role(Role::Surface);
pub const REALIZATION: Column = parameter_integer(
    "realization",
    "",
    "number of the surface among those of one spectrum",
)
.with_role(Role::Surface);
pub const CONTENT_OF_SPECTRUM: Column =
    parameter_text("content", "hash of the file with the surface's spectrum");
pub const SPECTRUM_OF: Column = parameter_text(
    "spectrum_of",
    "name of the surface whose measured spectrum it has",
);
pub const RADIUS: Column = parameter("radius", "length", "radius of the shape");
pub const AMPLITUDE: Column = parameter("amplitude", "length", "amplitude of the wave");
pub const WAVES: Column = parameter_integer("waves", "1", "wavelengths per side");
pub const DEPTH: Column = parameter("depth", "length", "depth of the shape's foot");
pub const EFFECTIVE_MODULUS: Column =
    parameter("effective_modulus", "pressure", "effective modulus E*");
pub const TOLERANCE: Column = parameter(
    "tolerance",
    "rms slope × mesh step",
    "largest gap in contact and penetration outside it that is accepted",
);
pub const BOUNDARY: Column = parameter_text(
    "boundary",
    "what lies beyond the edges of the map: nothing, where it is `free`; then displacements are \
     absolute, `mean_gap` is that over the map alone, the edges of the map are no edges of contact, \
     clusters end there, and one that reaches from edge to edge percolates; null where the map \
     repeats itself",
);
pub const MEAN_DISPLACEMENT: Column = real(
    "mean_displacement",
    "length",
    "how far the elastic body's surface has sunk from where it lies unloaded, mean over the map; \
     only where `boundary` is `free`, for a body without edges has no such place",
);
pub const HARDNESS: Column = parameter(
    "hardness",
    "pressure",
    "highest pressure that the material bears; where it yields, the surfaces touch, and `mean_gap` \
     counts no distance; `energy` is ½⟨p u⟩ of the elastic displacement u alone; of loading, for \
     unloading is not modelled; null where nothing yields under any pressure",
);
pub const HARDNESS_REDUCED: Column = parameter(
    "hardness_reduced",
    "E* × rms slope",
    "the hardness, reduced as `load` is, which is always below it",
);
pub const SATURATED_NODES: Column = integer(
    "saturated_nodes",
    "1",
    "nodes whose pressure is the hardness: the material yields there",
);
pub const SATURATED_FRACTION: Column = real(
    "saturated_fraction",
    "1",
    "share of the nodes whose pressure is the hardness",
);
pub const MEAN_YIELDED_DEPTH: Column = real(
    "mean_yielded_depth",
    "length",
    "depth to which the material has yielded, beyond the elastic displacement, mean over the whole \
     map: the yielded volume per nominal area; times the hardness, the work that yielding takes; \
     `mean_displacement` is without it",
);
pub const MAX_PAIRS: Column = parameter_integer(
    "max_pairs",
    "1",
    "pairs of transforms after which a load is given up",
);
pub const LOAD: Column =
    parameter("load", "E* × rms slope", "mean pressure, reduced").with_role(Role::Load);
pub const PRESSURE: Column =
    parameter("pressure", "pressure", "mean pressure").with_role(Role::Load);

/// What describes a surface.
pub const DESCRIPTORS: [Column; 14] = [
    real("m00", "length²", "spectral moment m₀₀: mean square height"),
    real("m20", "1", "spectral moment m₂₀: mean square slope along x"),
    real("m02", "1", "spectral moment m₀₂: mean square slope along y"),
    real("m22", "1/length²", "spectral moment m₂₂"),
    real(
        "m40",
        "1/length²",
        "spectral moment m₄₀: mean square curvature along x",
    ),
    real(
        "m04",
        "1/length²",
        "spectral moment m₀₄: mean square curvature along y",
    ),
    real("nayak", "1", "Nayak's parameter α = m₀ m₄/m₂²"),
    real(
        "summit_density",
        "1/length²",
        "Nayak's density of summits D = (√3/18π) m₄/m₂",
    ),
    real(
        "summit_density_integer",
        "(side/2π)⁻²",
        "the same in integer wavenumbers, as the 2015 paper tabulates it",
    ),
    real("rms_height", "length", "root mean square height"),
    real("skewness", "1", "third standardised moment of the heights"),
    real(
        "excess_kurtosis",
        "1",
        "fourth standardised moment of the heights, less 3",
    ),
    real(
        "effective_modes",
        "1",
        "inverse participation ratio of the modes' powers",
    ),
    real(
        "full_contact_load",
        "E* × rms slope",
        "smallest mean pressure at which every node touches",
    ),
];

/// What the spectrum alone says of a random surface.
pub const REFERENCES: [Column; 5] = [
    real(
        "nayak_continuum",
        "1",
        "α of the spectrum over continuous wavenumbers",
    ),
    real(
        "summit_density_continuum",
        "(side/2π)⁻²",
        "D of the spectrum over continuous wavenumbers",
    ),
    real(
        "nayak_lattice",
        "1",
        "α of the spectrum over the modes of the cell",
    ),
    real(
        "summit_density_lattice",
        "(side/2π)⁻²",
        "D of the spectrum over the modes of the cell",
    ),
    real(
        "effective_modes_lattice",
        "1",
        "effective modes of the spectrum in the cell",
    ),
];

pub const HEIGHTS: Column = Column::heavy(
    "heights",
    Reals,
    "length",
    "heights of the nodes, row-major, towards the elastic body",
);

// What a load does.
pub const CONTACT_NODES: Column = integer("contact_nodes", "1", "nodes with positive pressure");
pub const MEAN_GAP: Column = real("mean_gap", "length", "mean distance of the surfaces");
pub const ENERGY: Column = real(
    "energy",
    "pressure × length",
    "elastic energy per unit of nominal area",
);
pub const PEAK_PRESSURE: Column = real("peak_pressure", "pressure", "largest pressure");
pub const PAIRS: Column = integer(
    "pairs",
    "1",
    "forward and inverse transforms that the load took",
);
pub const RESIDUAL: Column = real(
    "residual",
    "rms slope × mesh step",
    "largest gap in contact or penetration outside it",
);
pub const STOP: Column = text(
    "stop",
    "how the load ended: converged, full-contact or pair-limit",
);
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
pub const SWITCHES: Column = integer(
    "switches",
    "1",
    "changes between contact and gap along all rows and columns",
);
pub const PERIMETER_MANHATTAN: Column = real(
    "perimeter_manhattan",
    "length",
    "S_d: switches × mesh step, of a rectangle Δy × switches_x + Δx × switches_y; without the edges of \
     a map that nothing surrounds",
);
pub const PERIMETER_EUCLIDEAN: Column = real(
    "perimeter_euclidean",
    "length",
    "π/4 of the Manhattan perimeter",
);
pub const EDGE_NODES_4: Column = integer(
    "edge_nodes_4",
    "1",
    "contact nodes with a gap among their 4 neighbours",
);
pub const EDGE_NODES_8: Column = integer(
    "edge_nodes_8",
    "1",
    "contact nodes with a gap among their 8 neighbours",
);
pub const INTERIOR_NODES: Column = integer(
    "interior_nodes",
    "1",
    "contact nodes whose 8 neighbours all touch",
);
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
pub const MEAN_CONTACT_PRESSURE: Column = real(
    "mean_contact_pressure",
    "pressure",
    "mean pressure over the contact nodes",
);
pub const SECANT: Column = real("secant", "1", "area fraction over load, κ of the secant");

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

// What is counted in heights.
pub const BIN: Column = parameter("bin", "rms height", "centre of the bin");
pub const COUNT: Column = integer("nodes_in_bin", "1", "nodes whose height lies in the bin");
pub const DENSITY: Column = real(
    "density",
    "1/rms height",
    "probability density of the height in the bin",
);
pub const SURFACES: Column = integer("surfaces", "1", "surfaces of the parameter point");
pub const DENSITY_MEAN: Column = real(
    "density_mean",
    "1/rms height",
    "mean over the surfaces of the probability density of the height in the bin",
);
pub const DENSITY_SD: Column = real(
    "density_sd",
    "1/rms height",
    "standard deviation of that density between surfaces",
);
pub const DENSITY_NORMAL: Column = real(
    "density_normal",
    "1/rms height",
    "probability density of a normal height, averaged over the bin",
);

// What a correction does.
pub const CORRECTION: Column =
    parameter_text("correction", "name of the estimator of the true area");
pub const COEFFICIENT: Column = parameter(
    "coefficient",
    "1",
    "share of the Manhattan perimeter × mesh step taken off",
);
pub const AREA_CORRECTED: Column = real(
    "area_corrected",
    "1",
    "estimate of the true share of the area",
);
pub const AREA_LOWER: Column = real(
    "area_lower",
    "1",
    "lower bound on the true share of the area, A − π/4 S_d Δx or 0; for pi/8",
);
pub const AREA_UPPER: Column = real(
    "area_upper",
    "1",
    "upper bound on the true share of the area, as counted; for pi/8",
);
pub const ERROR_ABSOLUTE: Column = real(
    "error_absolute",
    "1",
    "what the correction takes away, π/8 S_d Δx, a share of the cell: half the distance of the \
     bounds where the lower one is above 0; for pi/8",
);
pub const ERROR_RELATIVE: Column = real(
    "error_relative",
    "1",
    "what the correction takes away over the counted area; for pi/8",
);

/// What places a random surface among others.
pub const OF_RANDOM_SURFACES: [Column; 6] = [HURST, K_LOWER, K_ROLLOFF, K_UPPER, SEED, REALIZATION];

/// What places a shape among others.
pub const OF_SHAPES: [Column; 4] = [RADIUS, AMPLITUDE, WAVES, DEPTH];

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

/// What is counted in the heights of one surface.
pub const HEIGHT_MEASURES: [Column; 3] = [BIN, COUNT, DENSITY];

/// What is counted in the heights of all surfaces of a parameter point.
pub const POOLED_HEIGHTS: [Column; 5] = [BIN, SURFACES, DENSITY_MEAN, DENSITY_SD, DENSITY_NORMAL];

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
