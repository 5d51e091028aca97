#![doc = include_str!("../README.md")]
//!
//! # Types
//!
//! | | |
//! |---|---|
//! | surfaces | [`Grid`], [`Surface`], [`Spectrum`], [`RandomSurface`], [`MeasuredMap`] |
//! | bodies | [`Material`], [`Layer`], [`Adhesion`] |
//! | contacts | [`Contact`], [`AdhesiveContact`] |
//! | results | [`Pressed`], [`Spot`], [`Flow`], [`AdhesiveState`] |
//! | quantities | [`Length`], [`Pressure`], [`Force`], [`EnergyPerArea`], [`ReducedPressure`] |

#![warn(missing_docs)]
// Tests compare with tolerances.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod adhesion;
mod contact;
mod grid;
mod material;
mod pressed;
mod quantities;
mod random;
mod scale;
mod surface;

pub use adhesion::{Adhesion, AdhesionError, AdhesiveContact, AdhesiveState};
pub use contact::{Contact, ContactError, PressError, ToleranceError};
pub use grid::{Grid, GridError};
pub use material::{Layer, Material, MaterialError};
pub use pressed::{Flow, FlowError, Pressed, Spot};
pub use quantities::{EnergyPerArea, Force, Length, Pressure, ReducedPressure};
pub use random::{DrawError, RandomSurface, Spectrum, SpectrumError};
pub use scale::{ContactPressure, LoadOf};
pub use surface::{Edges, Fill, Form, MeasuredMap, Surface, SurfaceError};
