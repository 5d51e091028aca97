//! Random, simple and measured topographies of rough surfaces, and their statistics.
//!
//! | surfaces | contents |
//! |---|---|
//! | [`surface`] | heights on the nodes of a grid, and measured maps with missing points |
//! | [`spectrum`] | power spectral density of a self-affine surface, isotropic or anisotropic |
//! | [`random`] | random surfaces, drawn mode by mode from such a spectrum |
//! | [`spectral_density`] | tabulated power spectral density, and surfaces drawn from it |
//! | [`prescribed_heights`], [`johnson`] | random surfaces whose heights are not Gaussian |
//! | [`shapes`] | punches and waves whose contact has a closed form |
//!
//! | measured maps | contents |
//! |---|---|
//! | [`preparation`] | steps from a measured map to a surface that the solver accepts |
//! | [`outliers`], [`alignment`] | removal of spikes and isolated points, alignment of lines |
//! | [`level`], [`fill`], [`gaussian`] | removal of form, filling of holes, Gaussian filters |
//! | [`periodic`] | periodic continuation of a map, and resampling |
//! | [`reliability`] | wavelengths that an instrument resolved: radius of its tip, and noise |
//! | [`translation`] | lateral shift of a map, and the sum of two maps |
//!
//! | statistics | contents |
//! |---|---|
//! | [`moments`], [`differences`] | spectral moments of periodic and of other maps |
//! | [`descriptors`] | height parameters of ISO 25178-2, and the assumptions of contact theories |
//! | [`areal`], [`material_ratio`], [`peaks`] | other areal parameters of ISO 25178-2 |
//! | [`height_distribution`] | histograms of heights, and the bearing area curve |
//! | [`power_spectrum`], [`autocorrelation`] | radial averages of power and of height differences |
//! | [`profile_parameters`] | parameters of profiles, ISO 21920-2 and ISO 4287 |
//! | [`from_profiles`] | spectrum of an isotropic surface from those of its profiles |
//! | [`stitched`] | one spectrum from several scans of a surface |
//!
//! Heights are positive towards the elastic body.

pub mod alignment;
pub mod areal;
pub mod autocorrelation;
mod cholesky;
pub mod descriptors;
pub mod differences;
pub(crate) mod draws;
pub mod fill;
pub mod from_profiles;
pub mod gaussian;
pub mod height_distribution;
pub mod johnson;
pub mod level;
pub mod material_ratio;
pub mod moments;
pub mod outliers;
pub mod peaks;
pub mod periodic;
pub mod power_spectrum;
pub mod preparation;
pub mod prescribed_heights;
pub mod profile_parameters;
pub mod random;
pub mod reliability;
pub mod shapes;
pub mod spectral_density;
pub mod spectrum;
pub mod stitched;
pub mod surface;
pub mod translation;
