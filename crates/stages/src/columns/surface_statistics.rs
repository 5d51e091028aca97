//! Columns of what is measured of surfaces.

use super::{integer, parameter, real};
use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::Text;

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

pub const ALONG: Column = Column::parameter(
    "along",
    Text,
    "",
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
