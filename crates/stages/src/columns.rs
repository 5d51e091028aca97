//! Columns of the tables of all stages: name, role, type, unit, meaning and codes of each.

mod contacts;
mod surfaces;

use asperity_tables::column::ColumnKind::{self, Flag, Integer, Real, Text};
use asperity_tables::column::{Column, Role};

pub use contacts::*;
pub use surfaces::*;

/// Declares columns, or a list of columns. The doc comment of a column is its meaning, which users
/// read.
macro_rules! columns {
    ($($(#[doc = $meaning:literal])+ $vis:vis const $name:ident: $kind:ty = $column:expr;)+) => {
        $(
            $(#[doc = $meaning])+
            $vis const $name: $kind =
                $column.with_meaning(concat!($($meaning),+).trim_ascii_start());
        )+
    };
    ($(#[doc = $content:literal])+ $list_vis:vis const $list:ident = [
        $($(#[doc = $meaning:literal])+ $vis:vis const $name:ident: $kind:ty = $column:expr;)+
    ];) => {
        columns! { $($(#[doc = $meaning])+ $vis const $name: $kind = $column;)+ }

        $(#[doc = $content])+
        $list_vis const $list: [Column; [$(stringify!($name)),+].len()] = [$($name),+];
    };
}
pub(crate) use columns;

/// Lists the codes of a column. The doc comment of a code is its meaning, which users read.
macro_rules! codes {
    ($($(#[doc = $meaning:literal])+ $($word:literal)? $($constant:ident)?,)+) => {
        &[$(asperity_tables::column::Code {
            word: $($word)? $($constant)?,
            meaning: concat!($($meaning),+).trim_ascii_start(),
        }),+]
    };
}
pub(crate) use codes;

pub(crate) const fn parameter_text(name: &'static str) -> Column {
    Column::parameter(name, Text, "", "")
}

pub(crate) const fn parameter_integer(name: &'static str, unit: &'static str) -> Column {
    Column::parameter(name, Integer, unit, "")
}

pub(crate) const fn parameter(name: &'static str, unit: &'static str) -> Column {
    Column::parameter(name, Real, unit, "")
}

pub(crate) const fn real(name: &'static str, unit: &'static str) -> Column {
    Column::result(name, Real, unit, "")
}

pub(crate) const fn integer(name: &'static str, unit: &'static str) -> Column {
    Column::result(name, Integer, unit, "")
}

pub(crate) const fn flag(name: &'static str) -> Column {
    Column::result(name, Flag, "", "")
}

pub(crate) const fn text(name: &'static str) -> Column {
    Column::result(name, Text, "", "")
}

/// Declares a column of large computed values, which stays in the store.
pub(crate) const fn heavy(name: &'static str, kind: ColumnKind, unit: &'static str) -> Column {
    Column::result(name, kind, unit, "").with_role(Role::Heavy)
}

// Coordinates of a row: its parameters, its surface and its load.
columns! {
    /// name of the surface, the same in every stage's table
    pub const SURFACE: Column = parameter_text("surface").with_role(Role::Surface);
    /// method by which the surface was made
    pub const METHOD: Column = parameter_text("method").with_codes(codes![
        /// random self-affine surface whose modes have complex Gaussian amplitudes (filtered white
        /// noise)
        "filter",
        /// random self-affine surface with random phases and deterministic amplitudes
        "random-phase",
        /// random surface with a given power spectrum
        "spectrum",
        /// measured surface
        "file",
        /// surface that has yielded in a contact; its other columns, such as `hurst` or `seed`,
        /// describe the original surface
        "yielded",
        /// paraboloid of revolution
        "paraboloid",
        /// cosine wave along x
        "wave",
        /// product of cosine waves along x and y
        "wave-product",
        /// sum of cosine waves along x and y
        "wave-sum",
        /// flat circular punch
        "flat-punch",
    ]);
    /// number of grid points per side of a square mesh; null for rectangles
    pub const NODES: Column = parameter_integer("nodes", "1");
    /// side of a square cell; null for rectangles
    pub const SIDE: Column = parameter("side", "length");
    /// number of grid points along x; null for square meshes
    pub const NODES_X: Column = parameter_integer("nodes_x", "1");
    /// number of grid points along y; null for square meshes
    pub const NODES_Y: Column = parameter_integer("nodes_y", "1");
    /// side of the cell along x; null for square cells
    pub const SIDE_X: Column = parameter("side_x", "length");
    /// side of the cell along y; null for square cells; wavenumbers count waves along the longer
    /// side
    pub const SIDE_Y: Column = parameter("side_y", "length");
    /// root mean square gradient. It and all other moments are computed from the Fourier modes of a
    /// periodic map, or from differences between neighbouring nodes of any other map
    pub const RMS_SLOPE_OF_DIFFERENCES: Column = parameter("rms_slope", "1");
    /// root mean square gradient; of a random self-affine surface, that of its waves, which are
    /// also between the nodes
    pub const RMS_SLOPE: Column = parameter("rms_slope", "1");
    /// root mean square gradient of this surface; it varies between the surfaces of a spectrum
    pub const RMS_SLOPE_OF_SURFACE: Column = parameter("rms_slope", "1").with_role(Role::Surface);
    /// correlation length along the grain divided by the correlation length across it; null for
    /// isotropic surfaces. Theories of isotropic roughness do not apply to anisotropic surfaces
    pub const ANISOTROPY_RATIO: Column = parameter("anisotropy_ratio", "1");
    /// angle from the x axis to the grain
    pub const ANISOTROPY_ANGLE: Column = parameter("anisotropy_angle", "°");
    /// hash of the file that holds the spectrum of the surface
    pub const CONTENT_OF_SPECTRUM: Column = parameter_text("content");
    /// name of the surface whose measured spectrum is used
    pub const SPECTRUM_OF: Column = parameter_text("spectrum_of");
    /// effective modulus E*
    pub const EFFECTIVE_MODULUS: Column = parameter("effective_modulus", "pressure");
    /// unit of all pressures; the column exists only if the manifest writes a unit
    pub const PRESSURE_UNIT: Column = parameter_text("pressure_unit");
    /// largest accepted gap in contact and penetration outside contact
    pub const TOLERANCE: Column = parameter("tolerance", "rms slope × mesh step");
    /// boundary condition at the edges of the map; null where it is periodic
    pub const BOUNDARY: Column = parameter_text("boundary").with_codes(codes![
        /// an isolated patch: displacements are absolute, `mean_gap` is the mean over the map, the
        /// edges of the map are not edges of contact, and a cluster that reaches from edge to edge
        /// percolates
        "free",
    ]);
    /// mean displacement of the elastic surface over the map, measured from the unloaded state;
    /// defined only where `boundary` is `free`
    pub const MEAN_DISPLACEMENT: Column = real("mean_displacement", "length");
    /// hardness: the largest pressure that the material bears; null for elastic contact. Where the
    /// material yields, the surfaces touch and the gap is zero; `energy` is ½⟨p u⟩ of the elastic
    /// displacement u; `path` computes unloading
    pub const HARDNESS: Column = parameter("hardness", "pressure");
    /// hardness divided by E* × rms slope; every load is smaller
    pub const HARDNESS_REDUCED: Column = parameter("hardness_reduced", "E* × rms slope");
    /// number of nodes where the pressure equals the hardness and the material yields
    pub const SATURATED_NODES: Column = integer("saturated_nodes", "1");
    /// fraction of the nodes where the pressure equals the hardness
    pub const SATURATED_FRACTION: Column = real("saturated_fraction", "1");
    /// mean plastic depth over the map, in addition to the elastic displacement: yielded volume per
    /// nominal area. Multiplied by the hardness it is the plastic work per area.
    /// `mean_displacement` excludes it
    pub const MEAN_YIELDED_DEPTH: Column = real("mean_yielded_depth", "length");
    /// largest permitted number of pairs of Fourier transforms for one load
    pub const MAX_PAIRS: Column = parameter_integer("max_pairs", "1");
    /// reduced load p₀/(E* h′): mean pressure over the nominal area, divided by effective modulus ×
    /// rms slope. Where loads are given as pressures it is derived from `pressure`
    pub const LOAD: Column = parameter("load", "E* × rms slope").with_role(Role::Load);
    /// mean pressure over the nominal area, in units of E* if the manifest gives no modulus; where
    /// loads are reduced it is derived from `load`
    pub const PRESSURE: Column = parameter("pressure", "pressure").with_role(Role::Derived);
}

columns! {
    /// Columns that identify random surfaces: spectrum, seed and realization.
    pub const RANDOM_SURFACE_COORDINATES = [
        /// Hurst exponent
        pub const HURST: Column = parameter("hurst", "1");
        /// lower cutoff wavenumber, inclusive
        pub const K_LOWER: Column = parameter_integer("k_lower", "2π/side");
        /// roll-off wavenumber: the spectrum is constant below it
        pub const K_ROLLOFF: Column = parameter_integer("k_rolloff", "2π/side");
        /// upper cutoff wavenumber, inclusive
        pub const K_UPPER: Column = parameter_integer("k_upper", "2π/side");
        /// seed of the random numbers
        pub const SEED: Column = parameter_integer("seed", "").with_role(Role::Surface);
        /// number of the surface among the surfaces of its parameter point
        pub const REALIZATION: Column =
            parameter_integer("realization", "").with_role(Role::Surface);
    ];
}

columns! {
    /// Parameter columns that only analytic shapes have.
    pub const SHAPE_COORDINATES = [
        /// radius of the shape
        pub const RADIUS: Column = parameter("radius", "length");
        /// amplitude of the wave
        pub const AMPLITUDE: Column = parameter("amplitude", "length");
        /// number of wavelengths per side
        pub const WAVES: Column = parameter_integer("waves", "1");
        /// distance of the surrounding plane below the top of the shape
        pub const DEPTH: Column = parameter("depth", "length");
    ];
}

/// Keys of a `solve` stage, and the columns that its table and those of `measure` stages after it
/// have only with these keys.
const ADDED: [(&str, &[Column]); 7] = [
    ("`stiffness = true`", &CONDUCTANCE),
    ("`flow = true`", &FLOW),
    ("a `hardness`", &[SATURATED_NODES, SATURATED_FRACTION, MEAN_YIELDED_DEPTH]),
    ("`stiffness = true` and a `hardness`", &[UNLOADING_STIFFNESS]),
    ("`stiffness = true` and the `conductivity` of the `bodies` or of a `layer`", &THERMAL),
    ("`stiffness = true` and the `resistivity` of the `bodies` or of a `layer`", &ELECTRICAL),
    ("a `layer` on a rigid base", &LAYER_RESULTS),
];

/// Returns the label of a missing column that a key of a `solve` stage adds. Returns `None` if the
/// column needs no key, or if the study has columns of this key, so that the column is missing for
/// another reason. `is_known` tells which columns the study has.
pub fn needed_key(column: &str, is_known: impl Fn(&str) -> bool) -> Option<String> {
    let is_added = |columns: &[Column]| columns.iter().any(|added| added.name == column);
    let (key, added) = ADDED.iter().find(|(_, columns)| is_added(columns))?;
    // `stiffness` was the name of the finite difference, which is suggested if the study has it.
    let is_old_name = column == FROZEN_STIFFNESS.name && is_known(STIFFNESS.name);
    let is_missing = !is_old_name && !added.iter().any(|column| is_known(column.name));
    is_missing.then(|| format!("needs {key} in the `solve` stage"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::method::Method;
    use asperity_mechanics::topography::fill::Fill;
    use asperity_mechanics::topography::level::Level;
    use asperity_mechanics::topography::periodic::Edges;

    fn words(column: Column) -> Vec<&'static str> {
        column.codes.iter().map(|code| code.word).collect()
    }

    #[test]
    fn every_choice_for_a_surface_has_a_code() {
        assert_eq!(words(METHOD), Method::all().map(Method::word).collect::<Vec<_>>());
        let edges =
            [Edges::Periodic, Edges::Open, Edges::Mirror, Edges::Taper { taper_fraction: 0.1 }];
        assert_eq!(words(EDGES), edges.map(Edges::name));
        let levels = [Level::None, Level::Mean, Level::Plane, Level::Quadric];
        assert_eq!(words(LEVEL), levels.map(Level::name));
        let fills = [Fill::Error, Fill::Harmonic, Fill::Nearest, Fill::Lowest];
        assert_eq!(words(FILL), fills.map(Fill::name));
    }
}

#[cfg(test)]
mod tests_of_needed_keys {
    use super::*;

    #[test]
    fn columns_name_the_key_that_adds_them_unless_the_study_has_the_key() {
        let solved = |known: &'static [&str]| move |column: &str| known.contains(&column);
        let key = needed_key("contact_conductance", solved(&["contact_nodes"]));
        assert_eq!(key.as_deref(), Some("needs `stiffness = true` in the `solve` stage"));
        assert_eq!(needed_key("contact_conductance", solved(&["stiffness"])), None);
        assert_eq!(needed_key("stiffness", solved(&["stiffness_finite_difference"])), None);
        assert_eq!(needed_key("contact_nodes", solved(&[])), None);
        let key = needed_key("thermal_conductance", solved(&["stiffness"])).unwrap();
        assert!(key.contains("`conductivity` of the `bodies`"), "{key}");
    }
}
