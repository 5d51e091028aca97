//! Columns of surfaces: what places a measured one, what describes any, what is measured of them.

use super::{integer, parameter, parameter_integer, parameter_text, real, text};
use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::Reals;

pub const CONTENT: Column = parameter_text("content", "hash of the measured surface's file");
pub const UNIT: Column = parameter_text("unit", "unit of length of the measured surface");
pub const EDGES: Column = parameter_text("edges", "how the map's edges are made to meet");
pub const HEIGHT_SCALE: Column =
    parameter("height_scale", "1", "factor from the file's heights to lengths");
pub const TAPER_FRACTION: Column =
    parameter("taper_fraction", "1", "share of the side over which heights fade at each edge");
pub const CHANNEL: Column = parameter_text(
    "channel",
    "which map of the file was asked for, by its name, or by its number from 1 on",
);
pub const CROP_FROM_X: Column = parameter(
    "crop_from_x",
    "length",
    "where the part of the map that was cut out begins along x; `side` is its side, and its nodes lie \
     where they lay",
);
pub const CROP_FROM_Y: Column =
    parameter("crop_from_y", "length", "where the part of the map that was cut out begins along y");
pub const CROP_SIZE_X: Column = parameter(
    "crop_size_x",
    "length",
    "side along x that the part was asked to have, before it was rounded to nodes",
);
pub const CROP_SIZE_Y: Column =
    parameter("crop_size_y", "length", "side along y that the part was asked to have");
pub const LEVEL: Column = parameter_text(
    "level",
    "which form was taken away: the mean, plane or quadric that fits the measured points best, or none",
);
pub const FILL: Column = parameter_text("fill", "how points that were not measured got heights");
pub const HIGH_PASS: Column = parameter(
    "high_pass",
    "length",
    "cutoff above which waves were removed, by the areal Gaussian filter of ISO 16610-61",
);
pub const LOW_PASS: Column = parameter(
    "low_pass",
    "length",
    "cutoff below which waves were removed, by the areal Gaussian filter of ISO 16610-61",
);
pub const RESAMPLED_X: Column = parameter_integer(
    "resampled_x",
    "1",
    "nodes along x that the map was interpolated on, by its Fourier modes",
);
pub const RESAMPLED_Y: Column =
    parameter_integer("resampled_y", "1", "nodes along y that the map was interpolated on");
pub const FORMAT: Column = text("format", "format of the measured surface's file");
pub const CHANNEL_READ: Column = text("channel_read", "name of the map of the file that was read");
pub const CHANNELS: Column = integer("channels", "1", "maps that the file holds");
pub const FILLED_NODES: Column = integer(
    "filled_nodes",
    "1",
    "nodes that were not measured and have the heights that `fill` says",
);

/// What places a measured surface among others, as far as the manifest asks for it.
pub const OF_MEASURED_SURFACES: [Column; 16] = [
    CONTENT,
    UNIT,
    HEIGHT_SCALE,
    EDGES,
    TAPER_FRACTION,
    CHANNEL,
    CROP_FROM_X,
    CROP_FROM_Y,
    CROP_SIZE_X,
    CROP_SIZE_Y,
    LEVEL,
    FILL,
    HIGH_PASS,
    LOW_PASS,
    RESAMPLED_X,
    RESAMPLED_Y,
];

/// What was found in a measured surface's file.
pub const FOUND_IN_FILES: [Column; 4] = [FORMAT, CHANNEL_READ, CHANNELS, FILLED_NODES];

// What describes a surface by its moments.

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

// What is measured of surfaces.

pub const BIN: Column = parameter("bin", "rms height", "centre of the bin");
pub const COUNT: Column = integer("nodes_in_bin", "1", "nodes whose height lies in the bin");
pub const DENSITY: Column =
    real("density", "1/rms height", "probability density of the height in the bin");
pub const SURFACES: Column = integer("surfaces", "1", "surfaces of the parameter point");
pub const DENSITY_MEAN: Column = real(
    "density_mean",
    "1/rms height",
    "mean over the surfaces of the probability density of the height in the bin",
);
pub const DENSITY_SD: Column =
    real("density_sd", "1/rms height", "standard deviation of that density between surfaces");
pub const DENSITY_NORMAL: Column = real(
    "density_normal",
    "1/rms height",
    "probability density of a normal height, averaged over the bin",
);

/// What is counted in the heights of one surface.
pub const HEIGHT_MEASURES: [Column; 3] = [BIN, COUNT, DENSITY];

/// What is counted in the heights of all surfaces of a parameter point.
pub const POOLED_HEIGHTS: [Column; 5] = [BIN, SURFACES, DENSITY_MEAN, DENSITY_SD, DENSITY_NORMAL];

pub const ALONG: Column = parameter_text(
    "along",
    "direction of the lines: x, y, or radial for the mean over all directions",
);
pub const WAVENUMBER: Column = parameter(
    "wavenumber",
    "1/length",
    "angular wavenumber q = 2π/λ; of rings, whose width is 2π over the longer side, that in their \
     middle",
);
pub const MODES: Column = integer(
    "modes",
    "1",
    "modes of the lattice in the ring, q and −q both counted; beyond the Nyquist wavenumber rings \
     lack those along the axes",
);
pub const DEGREES_OF_FREEDOM: Column = real(
    "degrees_of_freedom",
    "1",
    "independent real amplitudes in the density, which scatters by √(2/degrees_of_freedom) of \
     itself on a Gaussian surface: one a mode, 4/9 under Hann's window, 1/4 of mirrored maps",
);
pub const SPECTRAL_DENSITY: Column = real(
    "spectral_density",
    "length⁴",
    "power spectral density C(q), mean over the ring, with ∫ C d²q/(2π)² = h_rms²: the sum of \
     spectral_density × modes over the area of the cell; of a map that is not periodic under Hann's \
     window, over the mean square of the window",
);
pub const PROFILE_DENSITY: Column = real(
    "profile_density",
    "length³",
    "one-dimensional power spectral density C₁(q) of profiles about their own means, mean over all \
     lines, with ∫ C₁ dq/π over q > 0 = h_rms² of the profiles; of a map that is not periodic under \
     Hann's window, over the mean square of the window",
);
pub const LAG: Column = parameter(
    "lag",
    "length",
    "distance of the points whose heights are multiplied; radial: rounded to steps of the mesh",
);
pub const AUTOCORRELATION: Column = real(
    "autocorrelation",
    "length²",
    "mean product of the heights about their mean at two points that far apart: h_rms² at lag 0; of a \
     map that is not periodic over the pairs inside it",
);
pub const DISTANCE: Column = parameter(
    "distance",
    "length",
    "distance ℓ of the points whose heights are compared, the scale",
);
pub const SLOPE_AT_SCALE: Column =
    real("slope_at_scale", "1", "scale-dependent slope √⟨((h(x + ℓ) − h(x))/ℓ)²⟩");
pub const CURVATURE_AT_SCALE: Column = real(
    "curvature_at_scale",
    "1/length",
    "scale-dependent curvature √⟨((h(x + ℓ) − 2 h(x) + h(x − ℓ))/ℓ²)²⟩",
);
pub const BEARING_LEVEL: Column =
    parameter("bearing_level", "rms height", "height of a plane above the mean of the surface");
pub const HEIGHT: Column =
    real("height", "length", "height of the plane above the mean of the surface");
pub const BEARING_SHARE: Column = real(
    "bearing_share",
    "1",
    "share of the nodes at or above the plane: areal material ratio Smr, ISO 25178-2",
);
pub const ROUGHNESS: [Column; 6] = [
    real("Sq", "length", "root mean square height about the mean, ISO 25178-2"),
    real("Sa", "length", "mean absolute height about the mean, ISO 25178-2"),
    real("Sz", "length", "distance of the highest and the lowest node, ISO 25178-2"),
    real("Ssk", "1", "skewness of the heights, ISO 25178-2"),
    real("Sku", "1", "kurtosis of the heights, 3 for a Gaussian, ISO 25178-2"),
    real(
        "Sdq",
        "1",
        "root mean square gradient, ISO 25178-2: of the Fourier modes of a periodic map, of \
         differences between neighbours of any other, as `rms_slope`",
    ),
];
