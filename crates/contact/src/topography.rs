//! Topography: the heights of a rough surface, where they come from and what is known of them
//! before anything is pressed.
//!
//! | surfaces | |
//! |---|---|
//! | [`surface`] | heights on the nodes of a grid, and scans with missing points |
//! | [`spectrum`] | the spectral density of a self-affine surface, with or without a grain |
//! | [`random`] | surfaces that are drawn mode by mode from such a spectrum |
//! | [`spectral_density`] | a spectral density given by numbers, and surfaces drawn from it |
//! | [`shapes`] | punches and waves whose contact has a closed form |
//!
//! | measured maps | |
//! |---|---|
//! | [`preparation`] | what is done to a map before it is pressed, in order |
//! | [`level`], [`fill`], [`gaussian`] | its form taken away, its holes filled, Gaussian filters |
//! | [`periodic`] | edges that meet, and a periodic map on other nodes |
//!
//! | statistics | |
//! |---|---|
//! | [`moments`], [`differences`] | spectral moments of periodic maps, and of others |
//! | [`descriptors`] | descriptors, ISO 25178, and the assumptions of theories |
//! | [`height_distribution`] | histograms of heights, pooled over surfaces, and the bearing curve |
//! | [`power_spectrum`], [`autocorrelation`] | means over rings of wavevectors, and of distances |
//!
//! Heights are positive towards the elastic body.

pub mod autocorrelation;
pub mod descriptors;
pub mod differences;
pub(crate) mod draws;
pub mod fill;
pub mod gaussian;
pub mod height_distribution;
pub mod level;
pub mod moments;
pub mod periodic;
pub mod power_spectrum;
pub mod preparation;
pub mod random;
pub mod shapes;
pub mod spectral_density;
pub mod spectrum;
pub mod surface;
