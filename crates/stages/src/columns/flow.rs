//! Columns of what flows through the gap.

use super::{real, text};
use asperity_tables::column::Column;

pub const FLOW_FACTOR_X: Column = real(
    "flow_factor_x",
    "1",
    "flow through the gap along x, over that between smooth walls at the mean gap: zero where no channel \
     of the gap goes around the cell that way, null where the flow was not found",
);
pub const FLOW_FACTOR_Y: Column = real("flow_factor_y", "1", "the same along y");
pub const FLOW_CONDUCTIVITY_X: Column = real(
    "flow_conductivity_x",
    "length³",
    "effective conductivity K of the gap along x: a film of viscosity μ carries K/(12 μ) × the gradient of \
     its pressure for each unit of width",
);
pub const FLOW_CONDUCTIVITY_Y: Column = real("flow_conductivity_y", "length³", "the same along y");
pub const FLOW_RESIDUAL: Column = real(
    "flow_residual",
    "1",
    "the most that a flow may be too large by, over itself: the distance of its bounds by the principles \
     of Dirichlet and Thomson, the larger one of x and y",
);
pub const FLOW_STOP: Column = text(
    "flow_stop",
    "how the search for the flow ended: converged, no-channel, or iteration-limit where one of the two \
     was not found",
);

/// What is known of the flow under a load.
pub const FLOW: [Column; 6] = [
    FLOW_FACTOR_X,
    FLOW_FACTOR_Y,
    FLOW_CONDUCTIVITY_X,
    FLOW_CONDUCTIVITY_Y,
    FLOW_RESIDUAL,
    FLOW_STOP,
];
