//! Columns of the tables of all stages: name, role, type, unit, meaning and codes of each.

use asperity_tables::column::ColumnKind::{Flag, Integer, Real, Text};
use asperity_tables::column::{Code, Column, Role};

mod adhesion;
mod conduction;
mod contacts;
mod friction;
mod layers;
mod needed_keys;
mod pairs;
mod surfaces;
mod unloading;

pub use adhesion::*;
pub use conduction::*;
pub use contacts::*;
pub use friction::*;
pub use layers::*;
pub use needed_keys::needed_key;
pub use pairs::*;
pub use surfaces::*;
pub use unloading::*;

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

// Coordinates of a row: its parameters, its surface and its load.
pub const SURFACE: Column =
    parameter_text("surface", "name of the surface, the same in every stage's table")
        .with_role(Role::Surface);
pub const METHOD: Column = parameter_text("method", "method by which the surface was made")
    .with_codes(&[
        Code {
            word: "filter",
            meaning: "random self-affine surface whose modes have complex Gaussian amplitudes \
                      (filtered white noise)",
        },
        Code {
            word: "random-phase",
            meaning: "random self-affine surface with random phases and deterministic amplitudes",
        },
        Code { word: "spectrum", meaning: "random surface with a given power spectrum" },
        Code { word: "file", meaning: "measured surface" },
        Code {
            word: "yielded",
            meaning: "surface that has yielded in a contact; its other columns, such as `hurst` \
                      or `seed`, describe the original surface",
        },
        Code { word: "paraboloid", meaning: "paraboloid of revolution" },
        Code { word: "wave", meaning: "cosine wave along x" },
        Code { word: "wave-product", meaning: "product of cosine waves along x and y" },
        Code { word: "wave-sum", meaning: "sum of cosine waves along x and y" },
        Code { word: "flat-punch", meaning: "flat circular punch" },
    ]);
pub const NODES: Column = parameter_integer(
    "nodes",
    "1",
    "number of grid points per side of a square mesh; null for rectangles",
);
pub const SIDE: Column = parameter("side", "length", "side of a square cell; null for rectangles");
pub const NODES_X: Column =
    parameter_integer("nodes_x", "1", "number of grid points along x; null for square meshes");
pub const NODES_Y: Column =
    parameter_integer("nodes_y", "1", "number of grid points along y; null for square meshes");
pub const SIDE_X: Column =
    parameter("side_x", "length", "side of the cell along x; null for square cells");
pub const SIDE_Y: Column = parameter(
    "side_y",
    "length",
    "side of the cell along y; null for square cells; wavenumbers count waves along the longer \
     side",
);
pub const RMS_SLOPE_OF_DIFFERENCES: Column = parameter(
    "rms_slope",
    "1",
    "root mean square gradient. It and all other moments are computed from the Fourier modes of a \
     periodic map, or from differences between neighbouring nodes of any other map",
);
pub const RMS_SLOPE: Column = parameter(
    "rms_slope",
    "1",
    "root mean square gradient; of a random self-affine surface, that of its waves, which are also \
     between the nodes",
);
pub const RMS_SLOPE_OF_SURFACE: Column = parameter(
    "rms_slope",
    "1",
    "root mean square gradient of this surface; it varies between the surfaces of a spectrum",
)
.with_role(Role::Surface);
pub const HURST: Column = parameter("hurst", "1", "Hurst exponent");
pub const K_LOWER: Column =
    parameter_integer("k_lower", "2π/side", "lower cutoff wavenumber, inclusive");
pub const K_ROLLOFF: Column = parameter_integer(
    "k_rolloff",
    "2π/side",
    "roll-off wavenumber: the spectrum is constant below it",
);
pub const K_UPPER: Column =
    parameter_integer("k_upper", "2π/side", "upper cutoff wavenumber, inclusive");
pub const ANISOTROPY_RATIO: Column = parameter(
    "anisotropy_ratio",
    "1",
    "correlation length along the grain divided by the correlation length across it; null for \
     isotropic surfaces. Theories of isotropic roughness do not apply to anisotropic surfaces",
);
pub const ANISOTROPY_ANGLE: Column =
    parameter("anisotropy_angle", "°", "angle from the x axis to the grain");
pub const SEED: Column =
    parameter_integer("seed", "", "seed of the random numbers").with_role(Role::Surface);
pub const REALIZATION: Column = parameter_integer(
    "realization",
    "",
    "number of the surface among the surfaces of its parameter point",
)
.with_role(Role::Surface);
pub const CONTENT_OF_SPECTRUM: Column =
    parameter_text("content", "hash of the file that holds the spectrum of the surface");
pub const SPECTRUM_OF: Column =
    parameter_text("spectrum_of", "name of the surface whose measured spectrum is used");
pub const RADIUS: Column = parameter("radius", "length", "radius of the shape");
pub const AMPLITUDE: Column = parameter("amplitude", "length", "amplitude of the wave");
pub const WAVES: Column = parameter_integer("waves", "1", "number of wavelengths per side");
pub const DEPTH: Column =
    parameter("depth", "length", "distance of the surrounding plane below the top of the shape");
pub const EFFECTIVE_MODULUS: Column =
    parameter("effective_modulus", "pressure", "effective modulus E*");
pub const PRESSURE_UNIT: Column = parameter_text(
    "pressure_unit",
    "unit of all pressures; the column exists only if the manifest writes a unit",
);
pub const TOLERANCE: Column = parameter(
    "tolerance",
    "rms slope × mesh step",
    "largest accepted gap in contact and penetration outside contact",
);
pub const BOUNDARY: Column = parameter_text(
    "boundary",
    "boundary condition at the edges of the map; null where it is periodic",
)
.with_codes(&[Code {
    word: "free",
    meaning:
        "an isolated patch: displacements are absolute, `mean_gap` is the mean over the map, the \
         edges of the map are not edges of contact, and a cluster that reaches from edge to edge \
         percolates",
}]);
pub const MEAN_DISPLACEMENT: Column = real(
    "mean_displacement",
    "length",
    "mean displacement of the elastic surface over the map, measured from the unloaded state; \
     defined only where `boundary` is `free`",
);
pub const HARDNESS: Column = parameter(
    "hardness",
    "pressure",
    "hardness: the largest pressure that the material bears; null for elastic contact. Where the \
     material yields, the surfaces touch and the gap is zero; `energy` is ½⟨p u⟩ of the elastic \
     displacement u; `path` computes unloading",
);
pub const HARDNESS_REDUCED: Column = parameter(
    "hardness_reduced",
    "E* × rms slope",
    "hardness divided by E* × rms slope; every load is smaller",
);
pub const SATURATED_NODES: Column = integer(
    "saturated_nodes",
    "1",
    "number of nodes where the pressure equals the hardness and the material yields",
);
pub const SATURATED_FRACTION: Column =
    real("saturated_fraction", "1", "fraction of the nodes where the pressure equals the hardness");
pub const MEAN_YIELDED_DEPTH: Column = real(
    "mean_yielded_depth",
    "length",
    "mean plastic depth over the map, in addition to the elastic displacement: yielded volume per \
     nominal area. Multiplied by the hardness it is the plastic work per area. `mean_displacement` \
     excludes it",
);
pub const MAX_PAIRS: Column = parameter_integer(
    "max_pairs",
    "1",
    "largest permitted number of pairs of Fourier transforms for one load",
);
pub const LOAD: Column = parameter(
    "load",
    "E* × rms slope",
    "reduced load p₀/(E* h′): mean pressure over the nominal area, divided by effective modulus × \
     rms slope. Where loads are given as pressures it is derived from `pressure`",
)
.with_role(Role::Load);
pub const PRESSURE: Column = parameter(
    "pressure",
    "pressure",
    "mean pressure over the nominal area, in units of E* if the manifest gives no modulus; where \
     loads are reduced it is derived from `load`",
)
.with_role(Role::Derived);

/// Columns that identify random surfaces: spectrum, seed and realization.
pub const RANDOM_SURFACE_COORDINATES: [Column; 6] =
    [HURST, K_LOWER, K_ROLLOFF, K_UPPER, SEED, REALIZATION];

/// Parameter columns that only analytic shapes have.
pub const SHAPE_COORDINATES: [Column; 4] = [RADIUS, AMPLITUDE, WAVES, DEPTH];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::method::Method;
    use asperity_contact::topography::fill::Fill;
    use asperity_contact::topography::level::Level;
    use asperity_contact::topography::periodic::Edges;

    fn words(column: Column) -> Vec<&'static str> {
        column.codes.iter().map(|code| code.word).collect()
    }

    #[test]
    fn every_choice_for_a_surface_has_a_code() {
        assert_eq!(words(METHOD), Method::ALL.map(Method::word));
        let edges =
            [Edges::Periodic, Edges::Open, Edges::Mirror, Edges::Taper { taper_fraction: 0.1 }];
        assert_eq!(words(EDGES), edges.map(Edges::name));
        let levels = [Level::None, Level::Mean, Level::Plane, Level::Quadric];
        assert_eq!(words(LEVEL), levels.map(Level::name));
        let fills = [Fill::Error, Fill::Harmonic, Fill::Nearest, Fill::Lowest];
        assert_eq!(words(FILL), fills.map(Fill::name));
    }
}
