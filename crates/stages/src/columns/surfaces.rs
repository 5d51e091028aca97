//! Columns of measured surfaces, and of the moments, descriptors and statistics of all surfaces.

use crate::columns::{
    codes, columns, heavy, integer, parameter, parameter_integer, parameter_text, real, text,
};
use asperity_tables::column::ColumnKind::Reals;
use asperity_tables::column::{Column, Role};

/// Columns of the coordinates x, y of the three positions of `level_through`.
pub const LEVEL_THROUGH: [Column; 6] =
    [LEVEL_A_X, LEVEL_A_Y, LEVEL_B_X, LEVEL_B_Y, LEVEL_C_X, LEVEL_C_Y];

columns! {
    /// Parameter columns that only measured surfaces have. A table contains those that the manifest
    /// uses.
    pub const MEASURED_SURFACE_COORDINATES = [
        /// hash of the file of the measured surface
        pub const CONTENT: Column = parameter_text("content");
        /// unit of length of the surface
        pub const UNIT: Column = parameter_text("unit");
        /// factor that converts the heights in the file to lengths
        pub const HEIGHT_SCALE: Column = parameter("height_scale", "1");
        /// treatment of the edges of the measured map
        pub const EDGES: Column = parameter_text("edges").with_codes(codes![
            /// the map is periodic and stays unchanged
            "periodic",
            /// the map is not periodic and stays unchanged
            "open",
            /// continued by mirror images after the mean plane was subtracted
            "mirror",
            /// tapered to zero at the edges after the mean plane was subtracted
            "taper",
        ]);
        /// fraction of the side over which heights are tapered to zero at each edge
        pub const TAPER_FRACTION: Column = parameter("taper_fraction", "1");
        /// requested map of the file: its name, or its number counted from 1
        pub const CHANNEL: Column = parameter_text("channel");
        /// number in the file that marks points without a height
        pub const MISSING: Column = parameter("missing", "1");
        /// use of the mask in the file
        pub const MASK: Column = parameter_text("mask").with_codes(codes![
            /// points under the mask keep their heights
            "ignored",
        ]);
        /// number of the line of the map that is read as a profile, counted from 1 at y = 0
        pub const LINE: Column = parameter_integer("line", "1");
        /// position along x at which the cropped part of the map begins; `side` is the side of this
        /// part
        pub const CROP_FROM_X: Column = parameter("crop_from_x", "length");
        /// position along y at which the cropped part of the map begins
        pub const CROP_FROM_Y: Column = parameter("crop_from_y", "length");
        /// requested side of the cropped part along x, before it was rounded to nodes
        pub const CROP_SIZE_X: Column = parameter("crop_size_x", "length");
        /// requested side of the cropped part along y, before it was rounded to nodes
        pub const CROP_SIZE_Y: Column = parameter("crop_size_y", "length");
        /// threshold above which points were removed as spikes, in standard deviations of the
        /// distance of a point from the median of its neighbours
        pub const SPIKES: Column = parameter("spikes", "1");
        /// number of points along each side of the window of neighbours for `spikes`
        pub const SPIKE_WINDOW: Column = parameter_integer("spike_window", "1");
        /// maximum number of points of the groups, surrounded by missing points, that were removed
        pub const ISLANDS: Column = parameter_integer("islands", "1");
        /// function that was subtracted from each scan line
        pub const ALIGN: Column = parameter_text("align").with_codes(codes![
            /// median of the line
            "median",
            /// sum of the medians of the differences of neighbouring lines
            "differences",
            /// least-squares polynomial of the line
            "polynomial",
        ]);
        /// direction of the aligned scan lines
        pub const ALIGN_ALONG: Column = parameter_text("align_along").with_codes(codes![
            /// along x
            "x",
            /// along y
            "y",
        ]);
        /// degree of the polynomial that was subtracted from each scan line
        pub const ALIGN_DEGREE: Column = parameter_integer("align_degree", "1");
        /// form that was subtracted from the heights
        pub const LEVEL: Column = parameter_text("level").with_codes(codes![
            /// no form
            "none",
            /// mean height of the measured points
            "mean",
            /// least-squares plane of the measured points
            "plane",
            /// least-squares quadric of the measured points
            "quadric",
        ]);
        /// position along x of the first of three points through which a plane was subtracted, in
        /// the map before `crop`
        pub const LEVEL_A_X: Column = parameter("level_a_x", "length");
        /// position of the first point along y, see `level_a_x`
        pub const LEVEL_A_Y: Column = parameter("level_a_y", "length");
        /// position of the second point along x, see `level_a_x`
        pub const LEVEL_B_X: Column = parameter("level_b_x", "length");
        /// position of the second point along y, see `level_a_x`
        pub const LEVEL_B_Y: Column = parameter("level_b_y", "length");
        /// position of the third point along x, see `level_a_x`
        pub const LEVEL_C_X: Column = parameter("level_c_x", "length");
        /// position of the third point along y, see `level_a_x`
        pub const LEVEL_C_Y: Column = parameter("level_c_y", "length");
        /// method by which missing points received heights
        pub const FILL: Column = parameter_text("fill").with_codes(codes![
            /// none: maps with missing points are refused
            "error",
            /// solution of Laplace's equation in each hole
            "harmonic",
            /// height of the nearest measured point
            "nearest",
            /// lowest height of the map
            "lowest",
        ]);
        /// cutoff wavelength above which waves were removed by the areal Gaussian filter of ISO
        /// 16610-61
        pub const HIGH_PASS: Column = parameter("high_pass", "length");
        /// cutoff wavelength below which waves were removed by the areal Gaussian filter of ISO
        /// 16610-61
        pub const LOW_PASS: Column = parameter("low_pass", "length");
        /// rule that determined the cutoff wavelength of the low-pass filter; null if `low_pass`
        /// gives the cutoff
        pub const LOW_PASS_AT: Column = parameter_text("low_pass_at").with_codes(codes![
            /// `reliable_wavelength`, by the areal Gaussian filter of ISO 16610-61
            "reliable",
        ]);
        /// number of nodes along x to which the map was interpolated by its Fourier modes
        pub const RESAMPLED_X: Column = parameter_integer("resampled_x", "1");
        /// number of nodes along y to which the map was interpolated by its Fourier modes
        pub const RESAMPLED_Y: Column = parameter_integer("resampled_y", "1");
        /// radius of the tip of the scanning probe
        pub const TIP_RADIUS: Column = parameter("tip_radius", "length");
    ];
}

columns! {
    /// Columns that describe the file of a measured surface.
    pub const FILE_COLUMNS = [
        /// format of the file of the measured surface
        pub const FORMAT: Column = text("format");
        /// name of the map that was read from the file
        pub const CHANNEL_READ: Column = text("channel_read");
        /// number of maps in the file
        pub const CHANNELS: Column = integer("channels", "1");
        /// number of measured points that `spikes` removed
        pub const REMOVED_SPIKES: Column = integer("removed_spikes", "1");
        /// number of measured points that `islands` removed
        pub const REMOVED_ISLANDS: Column = integer("removed_islands", "1");
        /// number of missing points that received heights by `fill`
        pub const FILLED_NODES: Column = integer("filled_nodes", "1");
    ];
}

columns! {
    /// Columns of the wavelengths that the instrument of a measured surface resolved.
    pub const RELIABILITY = [
        /// wavelength below which the sharpest peak of the map has more than half the curvature of
        /// the tip; null if no peak is that sharp
        pub const TIP_WAVELENGTH: Column = real("tip_wavelength", "length");
        /// wavelength below which noise has more power than the surface; null if the spectrum has
        /// no plateau
        pub const NOISE_WAVELENGTH: Column = real("noise_wavelength", "length");
        /// root mean square height of the noise; null if the spectrum has no plateau
        pub const NOISE_RMS_HEIGHT: Column = real("noise_rms_height", "length");
        /// shortest wavelength that the instrument resolved: the largest of `tip_wavelength`,
        /// `noise_wavelength` and two mesh steps of the map
        pub const RELIABLE_WAVELENGTH: Column = real("reliable_wavelength", "length");
        /// root mean square slope of the waves that are not shorter than `reliable_wavelength`,
        /// before the filters
        pub const RMS_SLOPE_RELIABLE: Column = real("rms_slope_reliable", "1");
        /// share of the mean square slope that comes from waves shorter than `reliable_wavelength`,
        /// before filters
        pub const UNRELIABLE_SHARE: Column = real("unreliable_share", "1");
    ];
}

columns! {
    /// Parameter columns that only random surfaces with a prescribed height distribution have.
    pub const HEIGHT_DISTRIBUTION_COORDINATES = [
        /// skewness that the heights should have; that of the surface is `skewness`
        pub const TARGET_SKEWNESS: Column = parameter("target_skewness", "1");
        /// kurtosis that the heights should have, 3 for a Gaussian surface; that of the surface is
        /// `excess_kurtosis` + 3
        pub const TARGET_KURTOSIS: Column = parameter("target_kurtosis", "1");
        /// first digits of the name of the surface whose height distribution the heights should
        /// have
        pub const HEIGHTS_OF: Column = parameter_text("heights_of");
    ];
}

columns! {
    /// root mean square difference between the sorted heights and the quantiles of the prescribed
    /// height distribution; the spectrum is exact, so the heights deviate
    pub const HEIGHT_DEVIATION: Column = real("height_deviation", "rms height");
}

// Moments and descriptors of surfaces.

pub const RMS_HEIGHT_GIVEN: Column = RMS_HEIGHT.with_role(Role::Parameter);

columns! {
    /// spectral moment m₀₀: mean square height
    pub const M00: Column = real("m00", "length²");
    /// spectral moment m₂₀: mean square slope along x
    pub const M20: Column = real("m20", "1");
    /// spectral moment m₀₂: mean square slope along y
    pub const M02: Column = real("m02", "1");
    /// spectral moment m₂₂
    pub const M22: Column = real("m22", "1/length²");
    /// spectral moment m₄₀: mean square curvature along x
    pub const M40: Column = real("m40", "1/length²");
    /// spectral moment m₀₄: mean square curvature along y
    pub const M04: Column = real("m04", "1/length²");
    /// Nayak's parameter α = m₀ m₄/m₂²
    pub const NAYAK: Column = real("nayak", "1");
    /// Nayak's density of summits D = (√3/18π) m₄/m₂
    pub const SUMMIT_DENSITY: Column = real("summit_density", "1/length²");
    /// Nayak's density of summits in integer wavenumbers, as the 2015 paper tabulates it
    pub const SUMMIT_DENSITY_INTEGER: Column = real("summit_density_integer", "(side/2π)⁻²");
    /// root mean square height; this and all spectral moments of a random self-affine surface
    /// are those of its waves, also between the nodes
    pub const RMS_HEIGHT: Column = real("rms_height", "length");
    /// skewness of the heights: third standardised moment, Ssk
    pub const SKEWNESS: Column = real("skewness", "1");
    /// kurtosis of the heights minus 3: fourth standardised moment minus 3, Sku − 3; the key
    /// `kurtosis` and the column `target_kurtosis` are 3 for a Gaussian surface, and this is 0
    pub const EXCESS_KURTOSIS: Column = real("excess_kurtosis", "1");
    /// effective number of modes, 1/Σ P², where P is the fraction of the mean square height in
    /// a pair of modes ±k
    pub const EFFECTIVE_MODES: Column = real("effective_modes", "1");
    /// smallest mean pressure at which every node of a periodic half-space without adhesion is
    /// in contact
    pub const FULL_CONTACT_LOAD: Column = real("full_contact_load", "E* × rms slope");
}

columns! {
    /// Nayak's parameter α of the spectrum, by integrals over continuous wavenumbers
    pub const NAYAK_CONTINUUM: Column = real("nayak_continuum", "1");
    /// Nayak's density of summits of the spectrum, by integrals over continuous wavenumbers
    pub const SUMMIT_DENSITY_CONTINUUM: Column =
        real("summit_density_continuum", "(side/2π)⁻²");
    /// Nayak's parameter α of the spectrum, by sums over the modes of the cell
    pub const NAYAK_LATTICE: Column = real("nayak_lattice", "1");
    /// Nayak's density of summits of the spectrum, by sums over the modes of the cell
    pub const SUMMIT_DENSITY_LATTICE: Column = real("summit_density_lattice", "(side/2π)⁻²");
    /// effective number of modes of the spectrum, by sums over the modes of the cell
    pub const EFFECTIVE_MODES_LATTICE: Column = real("effective_modes_lattice", "1");
}

columns! {
    /// heights of the nodes, row-major, positive towards the elastic body
    pub const HEIGHTS: Column = heavy("heights", Reals, "length");

    // Statistics of surfaces.
    /// number of surfaces of the parameter point
    pub const SURFACES: Column = integer("surfaces", "1");
    /// mean over the surfaces of the probability density of the height in the bin
    pub const DENSITY_MEAN: Column = real("density_mean", "1/rms height");
    /// standard deviation of the density between surfaces
    pub const DENSITY_SD: Column = real("density_sd", "1/rms height");
    /// normal probability density of the height, averaged over the bin
    pub const DENSITY_NORMAL: Column = real("density_normal", "1/rms height");
}

columns! {
    /// Columns of the height distribution of one surface.
    pub const HEIGHT_MEASURES = [
        /// centre of the bin of heights
        pub const BIN: Column = parameter("bin", "rms height");
        /// number of nodes whose height lies in the bin
        pub const COUNT: Column = integer("nodes_in_bin", "1");
        /// probability density of the height in the bin
        pub const DENSITY: Column = real("density", "1/rms height");
    ];
}

/// Columns of the height distribution of all surfaces of a parameter point.
pub const POOLED_HEIGHTS: [Column; 5] = [BIN, SURFACES, DENSITY_MEAN, DENSITY_SD, DENSITY_NORMAL];

columns! {
    /// direction of the statistic
    pub const ALONG: Column = parameter_text("along").with_codes(codes![
        /// along x
        "x",
        /// along y
        "y",
        /// mean over all directions
        "radial",
    ]);
    /// angular wavenumber q = 2π/λ; for a ring of wavevectors, which has the width 2π/(longer
    /// side), the wavenumber at its centre
    pub const WAVENUMBER: Column = parameter("wavenumber", "1/length");
    /// number of lattice modes in the ring, q and −q both counted; beyond the Nyquist wavenumber,
    /// rings have no modes along the axes
    pub const MODES: Column = integer("modes", "1");
    /// number of independent real amplitudes in the ring: one per mode, 4/9 per mode under a Hann
    /// window, 1/4 per mode for mirrored maps. On a Gaussian surface, the density has the relative
    /// scatter √(2/degrees_of_freedom)
    pub const DEGREES_OF_FREEDOM: Column = real("degrees_of_freedom", "1");
    /// power spectral density C(q), mean over the ring, with ∫ C d²q/(2π)² = h_rms²; the sum of
    /// spectral_density × modes, divided by the area of the cell, is h_rms², too. A map that is not
    /// periodic is multiplied by a Hann window, and C divided by the mean square of the window
    pub const SPECTRAL_DENSITY: Column = real("spectral_density", "length⁴");
    /// number of scans that contribute to the spectrum at this wavenumber
    pub const SCANS: Column = integer("scans", "1");
    /// spectral density of the smallest scan divided by that of the largest one at this wavenumber;
    /// null where only one scan is trusted
    pub const OVERLAP_RATIO: Column = real("overlap_ratio", "1");
    /// relative standard deviation of `overlap_ratio` for Gaussian surfaces
    pub const OVERLAP_SCATTER: Column = real("overlap_scatter", "1");
    /// one-dimensional power spectral density C₁(q) of profiles about their means, mean over all
    /// profiles, with ∫ C₁ dq/π over q > 0 equal to h_rms² of the profiles. Profiles that are not
    /// periodic are multiplied by a Hann window, and C₁ divided by the mean square of the window
    pub const PROFILE_DENSITY: Column = real("profile_density", "length³");
    /// maximum number of lines of each map that are used as profiles
    pub const LINES: Column = parameter_integer("lines", "1");
    /// number of profiles from which the spectrum of the surface was computed
    pub const PROFILES: Column = integer("profiles", "1");
    /// lower end of the 95 % interval of the density, from the scatter between profiles; null for a
    /// single profile
    pub const SPECTRAL_DENSITY_LOWER: Column = real("spectral_density_lower", "length⁴");
    /// upper end of the 95 % interval of the density, from the scatter between profiles; null for a
    /// single profile
    pub const SPECTRAL_DENSITY_UPPER: Column = real("spectral_density_upper", "length⁴");
    /// rms slope of the profiles, from their waves in the band of the spectrum
    pub const PROFILE_SLOPE: Column = real("profile_slope", "1");
    /// rms slope √⟨|∇h|²⟩ of the isotropic surface with this spectrum: √2 times that of its
    /// profiles
    pub const SURFACE_SLOPE: Column = real("surface_slope", "1");
    /// lower end of the 95 % interval of `surface_slope`, from the scatter between profiles; null
    /// for a single profile
    pub const SURFACE_SLOPE_LOWER: Column = real("surface_slope_lower", "1");
    /// upper end of the 95 % interval of `surface_slope`, from the scatter between profiles; null
    /// for a single profile
    pub const SURFACE_SLOPE_UPPER: Column = real("surface_slope_upper", "1");
    /// distance of the two points; for radial statistics rounded to the larger mesh step. Distances
    /// below half of this step round to none
    pub const LAG: Column = parameter("lag", "length");
    /// mean product of the heights, measured from their mean, of two points at the distance `lag`;
    /// h_rms² at lag 0. For a map that is not periodic, the mean over the pairs inside it
    pub const AUTOCORRELATION: Column = real("autocorrelation", "length²");
    /// scale ℓ: distance of the points whose heights are compared
    pub const DISTANCE: Column = parameter("distance", "length");
    /// scale-dependent slope √⟨((h(x + ℓ) − h(x))/ℓ)²⟩
    pub const SLOPE_AT_SCALE: Column = real("slope_at_scale", "1");
    /// scale-dependent curvature √⟨((h(x + ℓ) − 2 h(x) + h(x − ℓ))/ℓ²)²⟩
    pub const CURVATURE_AT_SCALE: Column = real("curvature_at_scale", "1/length");
    /// height of a horizontal plane above the mean of the surface
    pub const BEARING_LEVEL: Column = parameter("bearing_level", "rms height");
    /// height of the plane above the mean of the surface
    pub const HEIGHT: Column = real("height", "length");
    /// fraction of the nodes at or above the plane: areal material ratio Smr, ISO 25178-2
    pub const BEARING_SHARE: Column = real("bearing_share", "1");
}

/// Columns of `what = "roughness"` without the key `parameters`.
pub const ROUGHNESS: [Column; 6] = [SQ, SA, SZ, SSK, SKU, SDQ];

columns! {
    /// Columns of all parameters of ISO 25178-2 that the key `parameters` selects, in its order.
    pub const AREAL = [
        /// root mean square height of the nodes about their mean, ISO 25178-2
        const SQ: Column = real("Sq", "length");
        /// skewness of the heights, ISO 25178-2
        const SSK: Column = real("Ssk", "1");
        /// kurtosis of the heights, 3 for a Gaussian surface, ISO 25178-2
        const SKU: Column = real("Sku", "1");
        /// height of the highest node above the mean, ISO 25178-2
        pub const SP: Column = real("Sp", "length");
        /// depth of the lowest node below the mean, ISO 25178-2
        pub const SV: Column = real("Sv", "length");
        /// height difference of the highest and the lowest node, ISO 25178-2
        const SZ: Column = real("Sz", "length");
        /// mean absolute height about the mean, ISO 25178-2
        const SA: Column = real("Sa", "length");
        /// root mean square gradient, ISO 25178-2: from the Fourier modes of a periodic map, or
        /// from differences between neighbouring nodes of any other map. It equals `rms_slope`,
        /// except for a random surface whose shortest waves have two nodes
        const SDQ: Column = real("Sdq", "1");
        /// developed interfacial area ratio, ISO 25178-2: area of the surface over that of its
        /// projection, minus 1. For a periodic map from the gradients of its Fourier modes, for any
        /// other map from triangles between nodes
        pub const SDR: Column = real("Sdr", "1");
        /// autocorrelation length, ISO 25178-2: shortest distance over which the autocorrelation
        /// function falls to `correlation_threshold` (0.2 without that column); null if it falls in
        /// no direction within half of the map
        pub const SAL: Column = real("Sal", "length");
        /// texture aspect ratio, ISO 25178-2: shortest over longest distance over which the
        /// autocorrelation function falls to the threshold; null if it does not fall in some
        /// direction within half of the map
        pub const STR: Column = real("Str", "1");
        /// texture direction, ISO 25178-2: angle from the y axis to the lay, equally from the x
        /// axis to the wavevector with the largest angular amplitude density; meaningless if Str is
        /// near 1
        pub const STD: Column = real("Std", "°");
        /// core height, ISO 25178-2
        pub const SK: Column = real("Sk", "length");
        /// reduced height of the peaks above the core, ISO 25178-2
        pub const SPK: Column = real("Spk", "length");
        /// reduced depth of the dales below the core, ISO 25178-2
        pub const SVK: Column = real("Svk", "length");
        /// fraction of the nodes above the core, ISO 25178-2 (2021: Smrk1)
        pub const SMR1: Column = real("Smr1", "1");
        /// fraction of the nodes in or above the core, ISO 25178-2 (2021: Smrk2)
        pub const SMR2: Column = real("Smr2", "1");
        /// peak material volume per area, ISO 25178-2: above the height that the fraction p of the
        /// surface reaches, with p from `peak_ratio` (0.1 without that column)
        pub const VMP: Column = real("Vmp", "length");
        /// core material volume per area, ISO 25178-2: between the material ratios p and q, with q
        /// from `dale_ratio` (0.8 without that column)
        pub const VMC: Column = real("Vmc", "length");
        /// core void volume per area, ISO 25178-2: between the material ratios p and q
        pub const VVC: Column = real("Vvc", "length");
        /// dale void volume per area, ISO 25178-2: below the height that the fraction q of the
        /// surface reaches
        pub const VVV: Column = real("Vvv", "length");
        /// density of peaks, ISO 25178-2: number per area of hills that rise above their highest
        /// saddle by at least `pruning` × Sz (0.05 × Sz without that column)
        pub const SPD: Column = real("Spd", "1/length²");
        /// arithmetic mean peak curvature, ISO 25178-2: mean of −(h_xx + h_yy)/2 over these peaks;
        /// null if all are at the edges of a map that is not periodic
        pub const SPC: Column = real("Spc", "1/length");
    ];
}

columns! {
    /// height c of the areal material ratio, above the mean
    pub const SMR_HEIGHT: Column = parameter("smr_height", "length");
    /// material ratio mr of the inverse areal material ratio
    pub const SMC_RATIO: Column = parameter("smc_ratio", "1");
    /// material ratio p of the volumes
    pub const PEAK_RATIO: Column = parameter("peak_ratio", "1");
    /// material ratio q of the volumes
    pub const DALE_RATIO: Column = parameter("dale_ratio", "1");
    /// fraction s of its value at lag zero to which the autocorrelation function falls over `Sal`
    pub const CORRELATION_THRESHOLD: Column = parameter("correlation_threshold", "1");
    /// height of the lowest hills that count as peaks, as a fraction of Sz
    pub const PRUNING: Column = parameter("pruning", "1");
    /// areal material ratio Smr(c), ISO 25178-2: fraction of the nodes at or above `smr_height`
    pub const SMR: Column = real("Smr", "1");
    /// inverse areal material ratio Smc(mr), ISO 25178-2: height above the mean that the fraction
    /// `smc_ratio` of the surface reaches or exceeds
    pub const SMC: Column = real("Smc", "length");
}

columns! {
    /// Columns of `what = "roughness"` of profiles.
    pub const PROFILE_ROUGHNESS = [
        /// number of whole sections of the profile on which it is evaluated
        const SECTIONS: Column = integer("sections", "1");
        /// section length of ISO 21920-2, sampling length of ISO 4287, in whole steps
        const SECTION_LENGTH: Column = real("section_length", "length");
        /// arithmetic mean height over the evaluation length, ISO 21920-2; the mean over the
        /// sampling lengths, ISO 4287, is the same
        const RA: Column = real("Ra", "length");
        /// root mean square height over the evaluation length, ISO 21920-2
        const RQ: Column = real("Rq", "length");
        /// skewness over the evaluation length, ISO 21920-2; null for a flat profile
        const RSK: Column = real("Rsk", "1");
        /// kurtosis over the evaluation length, 3 for Gaussian heights, ISO 21920-2; null for a
        /// flat profile
        const RKU: Column = real("Rku", "1");
        /// height of the highest point above the mean line, mean over the sections, ISO 21920-2
        const RP: Column = real("Rp", "length");
        /// depth of the lowest point below the mean line, mean over the sections, ISO 21920-2
        const RV: Column = real("Rv", "length");
        /// maximum height Rp + Rv, mean over the sections, ISO 21920-2; not the ten-point height of
        /// ISO 4287:1984
        const RZ: Column = real("Rz", "length");
        /// height between the lowest and the highest point of the evaluation length, ISO 21920-2
        /// and ISO 4287
        const RT: Column = real("Rt", "length");
        /// mean spacing of profile elements, whose hills and dales reach a tenth of Rp and Rv; null
        /// without a whole element
        const RSM: Column = real("RSm", "length");
        /// root mean square slope RΔq, from seven points each, ISO 21920-2 and ISO 4287
        const RDQ: Column = real("Rdq", "1");
        /// mean over the sections of their root mean square heights: Rq of ISO 4287 and 4288
        const RQ_OF_SECTIONS: Column = real("Rq_4287", "length");
        /// core height, ISO 21920-2 and ISO 13565-2
        const RK: Column = real("Rk", "length");
        /// reduced hill height, ISO 21920-2 and ISO 13565-2
        const RPK: Column = real("Rpk", "length");
        /// reduced dale depth, ISO 21920-2 and ISO 13565-2
        const RVK: Column = real("Rvk", "length");
        /// fraction of the profile above the core, Rmrk1 of ISO 21920-2, Mr1 of ISO 13565-2
        const RMRK1: Column = real("Rmrk1", "1");
        /// fraction of the profile in or above the core, Rmrk2 of ISO 21920-2, Mr2 of ISO 13565-2
        const RMRK2: Column = real("Rmrk2", "1");
    ];
}

columns! {
    /// requested section length
    pub const SECTION_LENGTH_GIVEN: Column = parameter("section_length_given", "length");
    /// material ratio Rmr(c), ISO 21920-2: fraction of the profile at or above `smr_height`
    pub const RMR: Column = real("Rmr", "1");
    /// height Rmc(mr) above the mean line that the fraction `smc_ratio` of the profile reaches
    pub const RMC: Column = real("Rmc", "length");
}

columns! {
    /// Columns that only pairs of surfaces and their contacts have.
    pub const PAIR_COORDINATES = [
        /// root mean square gradient to which the surface of the stage in `from` is scaled, before
        /// another surface is added or the surface yields; `rms_slope` is that of the result
        pub const FROM_RMS_SLOPE: Column = parameter("from_rms_slope", "1");
        /// root mean square height to which the surface of the stage in `from` is scaled, before
        /// another surface is added or the surface yields; `rms_height` is that of the result
        pub const FROM_RMS_HEIGHT: Column =
            Column { name: "from_rms_height", ..RMS_HEIGHT.with_role(Role::Parameter) };
        /// name of the surface of the stage in `from` in the table of this stage; `surface` names
        /// the pair
        pub const FROM_SURFACE: Column = parameter_text("from_surface").with_role(Role::Surface);
        /// first digits of the name of the first surface of the stage in `against`; the slope,
        /// height, Nayak's parameter, summit density and load of full contact of the row are those
        /// of the sum of both surfaces, and `seed` and `realization` identify the pair
        pub const AGAINST: Column = parameter_text("against");
        /// name of the surface of the stage in `against` in the table of this stage
        pub const AGAINST_SURFACE: Column =
            parameter_text("against_surface").with_role(Role::Surface);
        /// lateral shift of the surface of `against` along x, as a fraction of the side
        pub const SHIFT_X: Column = parameter("shift_x", "1");
        /// lateral shift of the surface of `against` along y, as a fraction of the side
        pub const SHIFT_Y: Column = parameter("shift_y", "1");
        /// axis along which the map of `against` is reversed; null where both maps have common axes
        pub const MIRROR: Column = parameter_text("mirror").with_codes(codes![
            /// turned over about the y axis
            "x",
            /// turned over about the x axis
            "y",
        ]);
    ];
}

columns! {
    /// Columns that only surfaces that have yielded and their contacts have.
    pub const YIELDED_COORDINATES = [
        /// name of the original surface in the tables of its stage; `surface` names the surface
        /// that has yielded
        pub const ORIGINAL_SURFACE: Column =
            parameter_text("original_surface").with_role(Role::Surface);
        /// largest load of the contact in which the surface yielded, in units of E* × rms slope of
        /// the original surface
        pub const YIELDED_LOAD: Column = parameter("yielded_load", "E* × rms slope");
        /// largest mean pressure of the contact in which the surface yielded
        pub const YIELDED_PRESSURE: Column =
            Column { name: "yielded_pressure", unit: "pressure", ..YIELDED_LOAD };
        /// hardness of the material in the contact in which the surface yielded
        pub const YIELDED_HARDNESS: Column = parameter("yielded_hardness", "pressure");
        /// hardness of the material in the contact in which the surface yielded
        pub const YIELDED_HARDNESS_REDUCED: Column =
            Column { name: "yielded_hardness_reduced", unit: "E* × rms slope", ..YIELDED_HARDNESS };
    ];
}

/// Names of the columns that are set only where the surface of a row does not have the spectrum
/// that the other columns describe.
pub const ALTERATIONS: [&str; 3] = [AGAINST.name, YIELDED_LOAD.name, YIELDED_PRESSURE.name];
