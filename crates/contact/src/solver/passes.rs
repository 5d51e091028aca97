//! Passes over the rows of the mesh between two transforms.

mod begin;
mod evaluate;
mod extend;
mod peek;
mod update_gap;
mod update_pressure;

pub use begin::{
    AppliedUpdate, BeginPressed, InitialResidual, PressureLessGap, ReferencePressure, StartPressure,
};
pub use evaluate::{
    GapOutput, PressureInput, Promote, PromotedInput, StepOutput, StepScaling, TakeBack, promote,
};
pub use extend::{CollectFixed, Extend, Nodal};
pub use peek::{GatherCandidates, MIN_SAMPLE_NODES, Means, Peek, PeekGap, Sample};
pub use update_gap::{GapSums, GapUpdate, UpdateGap};
pub use update_pressure::{Ceiling, Direction, PendingUpdate, Sums, UpdatePressure};
