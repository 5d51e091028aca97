//! What happens to the rows of the mesh between two transforms.

mod ask;
mod base;
mod begin_pressed;
mod bounded;
mod evaluate;
mod expected;
mod extend;
mod heights;
mod nearing;
mod nodal;
mod peek;
mod peek_gap;
mod prolong;
mod sample;
mod update_gap;
mod update_pressure;

pub use ask::{Ask, Onwards, Remember};
pub use base::Base;
pub use begin_pressed::{BeginPressed, LastMoveDone, PressureLessGap, StartPressure};
pub use bounded::{PromoteYielding, Tally};
pub use evaluate::{
    GapOutput, MoveOutput, MoveScaling, PressureInput, Promote, PromotedInput, TakeBack,
};
pub use expected::{Expected, ShownGap};
pub use extend::{Extend, TakeOthers};
pub use heights::{CountHeights, CountedFrom, Highest, PressAbove, Untouched};
pub use nearing::{CountNearing, Nearing, SumInContact};
pub use nodal::Nodal;
pub use peek::{Asking, FEWEST_NODES, Means, Peek};
pub use peek_gap::PeekGap;
pub use prolong::{CoarseMap, Prolonged, SetProlonged, SumProlonged};
pub use sample::Sample;
pub use update_gap::{GapUpdate, Seen, UpdateGap};
pub use update_pressure::{Ceiling, Direction, PendingUpdate, Sums, UpdatePressure};
