//! Theories of the contact area against the load.
//!
//! - [`persson`]: Persson's theory, a = erf(√2 y);
//! - [`models`]: asperity models, in which summits are independent Hertzian contacts, and the model
//!   of isolated non-contact regions near full contact;
//! - [`law`]: the contact evolution law of Yastrebov, Anciaux & Molinari (2015), fitted to data.
//!
//! Loads y are in units of E* h′, where h′ is the rms slope. Areas a are fractions of the nominal
//! area.

pub mod law;
pub mod models;
pub mod persson;
