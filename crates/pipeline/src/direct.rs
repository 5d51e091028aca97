//! Surfaces and contacts without a study: what `generate` and `solve` stages compute, of values in
//! memory and into memory, with the same bytes.
//!
//! What is asked for are the keys of such a stage, as a manifest has them, and they are checked as
//! those of a manifest are: [`draw`] makes one surface, a [`Pressing`] presses one, load after load.
//! Nothing is stored.
//!
//! ```
//! use asperity_pipeline::direct::{Map, Pressing, draw};
//!
//! let surface = "nodes = 64\nhurst = 0.8\nk_lower = 2\nk_upper = 16\nseed = 1".parse()?;
//! let drawn = draw(&surface, 0)?;
//! assert_eq!(drawn.rms_slope, 1.0);
//! let (slope, is_periodic) = (Some(drawn.rms_slope), drawn.is_periodic);
//! let map = Map { surface: drawn.surface, rms_slope: slope, is_periodic };
//! let mut pressing = Pressing::new(map, &"loads = [0.01, 0.1]".parse()?)?;
//! while pressing.press(&|| false)?.is_some() {}
//! let table = pressing.table();
//! let nodes = table.integers("contact_nodes")?;
//! assert!(nodes.value(0) < nodes.value(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod drawing;
mod keys;
mod pressing;

use asperity_contact::topography::surface::SurfaceError;
use asperity_stages::StageError;

pub use drawing::{Drawn, draw};
pub use keys::KeyErrors;
pub use pressing::{Map, Pressing};

/// Why there is no surface, or no contact.
#[derive(Debug, thiserror::Error)]
pub enum DirectError {
    /// The keys make no sense.
    #[error(transparent)]
    Keys(#[from] KeyErrors),
    /// Heights are no surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A map that is not periodic was to be pressed as if it repeated itself.
    #[error(
        "the map is not periodic, and would be pressed as if it repeated itself: `boundary = \
         \"free\"` presses it as it is, with nothing beyond its edges; a map whose opposite edges \
         meet has to be said to be periodic"
    )]
    Open,
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
}
