//! Topography: the heights of a rough surface, where they come from and what is known of them before
//! anything is pressed.
//!
//! - [`spectrum`] has the power spectral density of a self-affine surface and the modes that it
//!   occupies, [`anisotropy`] stretches it along a grain; `draw` the random numbers of each mode, the
//!   same on every mesh; [`random`] the surface that follows from both, and [`surface`] its heights on
//!   a mesh; [`given_spectrum`] draws surfaces whose [`spectral_density`] is given by numbers.
//! - [`measured`] reads a height map from a NumPy file; [`scan`] is a map as an instrument has measured
//!   it, with holes, and [`preparation`] what is done to it before it is pressed: [`crop`], [`level`],
//!   [`fill`], [`gaussian`] filters, [`resample`], and [`periodic`] edges. [`shapes`] are punches and
//!   waves whose contact has a closed form.
//! - [`moments`] are the spectral moments, slopes and curvatures of a surface, [`differences`] those
//!   of a map that is not periodic, [`descriptors`] all
//!   that a table says of it, [`histogram`] how its heights are distributed, [`nayak`] the closed
//!   forms of α and the density of summits; [`assumptions`] judge whether it is the isotropic
//!   Gaussian roughness that theories speak of.
//! - [`power_spectrum`], [`autocorrelation`], [`scales`] (slopes and curvatures by the distance over
//!   which they are taken), [`bearing`] and [`roughness`] (the parameters of ISO 25178) are what
//!   surveys of measured surfaces report, of periodic maps and of others, [`lines`] by lines.
//!
//! Heights are positive towards the elastic body.

pub mod anisotropy;
pub mod assumptions;
pub mod autocorrelation;
pub mod bearing;
pub mod crop;
pub mod descriptors;
pub mod differences;
pub(crate) mod draw;
pub mod fill;
pub mod gaussian;
pub mod given_spectrum;
pub mod histogram;
pub mod level;
pub mod lines;
pub mod moments;
pub mod nayak;
pub mod periodic;
pub mod power_spectrum;
pub mod preparation;
pub mod random;
pub mod resample;
pub mod roughness;
pub mod scales;
pub mod scan;
pub mod shapes;
pub mod spectral_density;
pub mod spectrum;
pub mod surface;
mod waves;
