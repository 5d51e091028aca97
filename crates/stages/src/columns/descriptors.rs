//! Columns that describe a surface.

use super::real;
use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::Reals;

pub const RMS_HEIGHT: Column = real("rms_height", "length", "root mean square height");

/// What describes a surface.
pub const DESCRIPTORS: [Column; 14] = [
    real("m00", "length²", "spectral moment m₀₀: mean square height"),
    real("m20", "1", "spectral moment m₂₀: mean square slope along x"),
    real("m02", "1", "spectral moment m₀₂: mean square slope along y"),
    real("m22", "1/length²", "spectral moment m₂₂"),
    real("m40", "1/length²", "spectral moment m₄₀: mean square curvature along x"),
    real("m04", "1/length²", "spectral moment m₀₄: mean square curvature along y"),
    real("nayak", "1", "Nayak's parameter α = m₀ m₄/m₂²"),
    real("summit_density", "1/length²", "Nayak's density of summits D = (√3/18π) m₄/m₂"),
    real(
        "summit_density_integer",
        "(side/2π)⁻²",
        "the same in integer wavenumbers, as the 2015 paper tabulates it",
    ),
    RMS_HEIGHT,
    real("skewness", "1", "third standardised moment of the heights"),
    real("excess_kurtosis", "1", "fourth standardised moment of the heights, less 3"),
    real("effective_modes", "1", "inverse participation ratio of the modes' powers"),
    real(
        "full_contact_load",
        "E* × rms slope",
        "smallest mean pressure at which every node touches",
    ),
];

/// What the spectrum alone says of a random surface.
pub const REFERENCES: [Column; 5] = [
    real("nayak_continuum", "1", "α of the spectrum over continuous wavenumbers"),
    real(
        "summit_density_continuum",
        "(side/2π)⁻²",
        "D of the spectrum over continuous wavenumbers",
    ),
    real("nayak_lattice", "1", "α of the spectrum over the modes of the cell"),
    real("summit_density_lattice", "(side/2π)⁻²", "D of the spectrum over the modes of the cell"),
    real("effective_modes_lattice", "1", "effective modes of the spectrum in the cell"),
];

pub const HEIGHTS: Column = Column::heavy(
    "heights",
    Reals,
    "length",
    "heights of the nodes, row-major, towards the elastic body",
);
