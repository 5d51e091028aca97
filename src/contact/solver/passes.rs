//! What happens to the rows of the mesh between two transforms.

mod ask;
mod base;
mod evaluate;
mod respond;
mod sample;
mod steer;

pub use ask::{Ask, Onwards};
pub use base::Base;
pub use evaluate::{Arrive, Depart, Join, Land, Landing, Settle, Withdraw};
pub use respond::{Respond, Response, Seen};
pub use sample::{Means, Peek, Sample};
pub use steer::{Course, Fold, Steer, Sums};
