//! Every column of every stage: its name, unit and meaning, said once.

use asperity_tables::column::ColumnKind::{Flag, Integer, Real, Text};
use asperity_tables::column::{Code, Column, Role};

mod contacts;
mod surfaces;

pub use contacts::*;
pub use surfaces::*;

pub(crate) const fn parameter_text(name: &'static str, meaning: &'static str) -> Column {
    Column::parameter(name, Text, "", meaning)
}

pub(crate) const fn parameter_integer(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Column {
    Column::parameter(name, Integer, unit, meaning)
}

pub(crate) const fn parameter(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Column {
    Column::parameter(name, Real, unit, meaning)
}

pub(crate) const fn real(name: &'static str, unit: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Real, unit, meaning)
}

pub(crate) const fn integer(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Column {
    Column::result(name, Integer, unit, meaning)
}

pub(crate) const fn flag(name: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Flag, "", meaning)
}

pub(crate) const fn text(name: &'static str, meaning: &'static str) -> Column {
    Column::result(name, Text, "", meaning)
}

// Where a row belongs.
pub const SURFACE: Column =
    parameter_text("surface", "name of the surface, the same in every stage's table")
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
pub const SIDE_X: Column =
    parameter("side_x", "length", "side of the cell along x, of a rectangle; a square has `side`");
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
pub const K_ROLLOFF: Column =
    parameter_integer("k_rolloff", "2π/side", "wavenumber at which the plateau ends");
pub const K_UPPER: Column =
    parameter_integer("k_upper", "2π/side", "upper cutoff wavenumber, inclusive");
pub const ANISOTROPY_RATIO: Column = parameter(
    "anisotropy_ratio",
    "1",
    "correlation length along the grain over that across; null without grain; theories of isotropic \
     roughness are not about such surfaces",
);
pub const ANISOTROPY_ANGLE: Column =
    parameter("anisotropy_angle", "°", "direction of the grain from the x axis");
pub const SEED: Column =
    parameter_integer("seed", "", "seed of the draws").with_role(Role::Surface);
pub const REALIZATION: Column =
    parameter_integer("realization", "", "number of the surface among those of one spectrum")
        .with_role(Role::Surface);
pub const CONTENT_OF_SPECTRUM: Column =
    parameter_text("content", "hash of the file with the surface's spectrum");
pub const SPECTRUM_OF: Column =
    parameter_text("spectrum_of", "name of the surface whose measured spectrum it has");
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
    "boundary condition at the edges of the map; null where it is periodic",
)
.with_codes(&[Code {
    word: "free",
    meaning: "an isolated patch: displacements are absolute, `mean_gap` is the mean over the map, the \
              edges of the map are not edges of contact, and a cluster that reaches from edge to edge \
              percolates",
}]);
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
    "hardness over E* × rms slope, as `load` is reduced; every load is below it",
);
pub const SATURATED_NODES: Column = integer(
    "saturated_nodes",
    "1",
    "nodes whose pressure is the hardness: the material yields there",
);
pub const SATURATED_FRACTION: Column =
    real("saturated_fraction", "1", "share of the nodes whose pressure is the hardness");
pub const MEAN_YIELDED_DEPTH: Column = real(
    "mean_yielded_depth",
    "length",
    "depth to which the material has yielded, beyond the elastic displacement, mean over the whole \
     map: the yielded volume per nominal area; times the hardness, the work that yielding takes; \
     `mean_displacement` is without it",
);
pub const MAX_PAIRS: Column =
    parameter_integer("max_pairs", "1", "pairs of transforms after which a load is given up");
pub const LOAD: Column = parameter(
    "load",
    "E* × rms slope",
    "reduced pressure p₀/(E* h′): mean pressure over the nominal area, over effective modulus × rms \
     slope of the surface; where loads are given in pascals it follows from `pressure`",
)
.with_role(Role::Load);
pub const PRESSURE: Column = parameter(
    "pressure",
    "pressure",
    "mean pressure over the nominal area; where loads are given reduced it follows from `load`",
)
.with_role(Role::Derived);

/// What places a random surface among others.
pub const OF_RANDOM_SURFACES: [Column; 6] = [HURST, K_LOWER, K_ROLLOFF, K_UPPER, SEED, REALIZATION];

/// What places a shape among others.
pub const OF_SHAPES: [Column; 4] = [RADIUS, AMPLITUDE, WAVES, DEPTH];
