//! Passes over the rows of the mesh between two transforms.

mod begin;
mod evaluate;
mod extend;
mod peek;
mod update_gap;
mod update_pressure;

pub use begin::{
    BeginPressed, Extrapolation, InitialResidual, LastMoveDone, PressureLessGap, ReferencePressure,
    SavePressure, StartPressure,
};
pub use evaluate::{
    GapOutput, MoveOutput, MoveScaling, PressureInput, Promote, PromotedInput, TakeBack, promote,
};
pub use extend::{Extend, Nodal, TakeOthers};
pub use peek::{GatherCandidates, MIN_SAMPLE_NODES, Means, Peek, PeekGap, Sample};
pub use update_gap::{GapSums, GapUpdate, UpdateGap};
pub use update_pressure::{Ceiling, Direction, PendingUpdate, Sums, UpdatePressure};
