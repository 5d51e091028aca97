//! The rule by which claims are decided, which the session passes in.
//!
//! The engine draws surfaces until claims are decided and knows none of them.

use std::num::NonZeroU32;

use crate::plan::Plan;
use crate::study::Study;
use asperity_tables::table::{Table, TableError};

/// Decides claims from the tables of a study.
pub trait ClaimRule {
    /// Decides the claims of these names, or all without any, at one of `looks` looks.
    ///
    /// `tables` has the table of each stage of the plan, as far as it is there.
    ///
    /// # Errors
    /// When a table lacks a column that its kind of stage writes.
    fn decide(
        &self,
        study: &Study,
        plan: &Plan,
        tables: &[Option<Table>],
        names: &[String],
        looks: NonZeroU32,
    ) -> Result<Decisions, TableError>;
}

/// What is decided of some claims.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decisions {
    /// Claims that are decided.
    pub decided: Vec<&'static str>,
    /// Claims that are not.
    pub undecided: Vec<Undecided>,
    /// Claims without a quantity, and what they need.
    pub not_judged: Vec<(&'static str, String)>,
}

/// A claim that is not decided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Undecided {
    /// Its name.
    pub name: &'static str,
    /// How many surfaces of each spectrum there are, and how many would decide it at the present spread;
    /// `None` if no number would.
    pub surfaces: Option<[usize; 2]>,
}

impl Decisions {
    /// How many surfaces in place of so many would decide all claims that some number decides; `None`
    /// without any.
    pub fn wanted(&self, surfaces: u32) -> Option<u64> {
        let wanted = self.undecided.iter().filter_map(|claim| {
            let [now, needed] = claim.surfaces?;
            // A spectrum with fewer surfaces than this stage draws has its own share of more.
            Some((u64::from(surfaces) * needed as u64).div_ceil(now as u64))
        });
        wanted.max()
    }
}
