//! Theory: the area of contact against the load, as it has been predicted without solving for it.
//!
//! - [`persson`]: the pressure diffuses with the magnification, a = erf(√2 y);
//! - [`models`]: asperity models, in which summits are pressed one by one, and the isolated cracks
//!   that are left near full contact;
//! - [`law`]: the contact evolution law of Yastrebov, Anciaux & Molinari (2015), fitted to data.
//!
//! Loads y are in units of E* × rms slope, areas a are fractions of the nominal one.

pub mod law;
pub mod models;
pub mod persson;
