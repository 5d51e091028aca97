//! What is known of a condition on the number of surfaces.

use super::rule::Decisions;
use asperity_tables::store::StoreError;

/// What is known of a condition.
#[derive(Debug)]
pub enum Condition {
    /// It takes these tasks to tell. Tables of some may be there, but damaged.
    Open {
        /// Every task that the condition depends on.
        tasks: Vec<usize>,
        /// Damaged tables among them.
        damaged: Vec<(usize, StoreError)>,
    },
    /// It holds.
    Holds(Finding),
    /// It does not hold.
    Fails(Finding),
}

/// What a condition rests on.
#[derive(Debug)]
pub enum Finding {
    /// The largest standard error of a mean, over its limit.
    Error(f64),
    /// What is decided of the claims.
    Claims(Decisions),
}

impl Condition {
    /// Nothing is known as long as these tasks have no tables.
    pub fn open(tasks: Vec<usize>) -> Condition {
        Condition::Open { tasks, damaged: Vec::new() }
    }

    /// Whether it can be told, and there is nothing more to compute for it.
    pub fn is_known(&self) -> bool {
        !matches!(self, Condition::Open { .. })
    }
}
