//! From the gap of free nodes to the pressure that would close it: the preconditioner.
//!
//! The stiffness has the pressure for a displacement of all nodes. `extension` has the displacement
//! for a gap of free nodes, and takes back to them the pressure that belongs on others.

use super::Solver;
use super::lanes::Wide;
use super::passes::{Extend, TakeOthers};

impl Solver {
    /// Begins the transform of the gap less `offset`, on free nodes and continued over the others.
    pub(super) fn begin_correction(&mut self, offset: f64) {
        self.extension.extend(&self.threads);
        let mut pass = Wide(Extend {
            map: self.nodes,
            offset: offset as f32,
            gap: &self.gap,
            carry: &self.carry,
            active: &self.active,
            continued: self.extension.continued_rows(),
        });
        let (single, scratch) = (&self.single, &mut self.single_scratch);
        self.stiffness.begin(&mut pass, single, scratch);
    }

    /// Goes on as far as to the rows of the correction, all but what is to be given to them, and keeps
    /// them: one pair.
    pub(super) fn correct(&mut self) {
        self.pairs += 1;
        let mut pass = Wide(TakeOthers {
            map: self.nodes,
            carry: &self.carry,
            active: &self.active,
            taken: self.extension.taken_rows(),
        });
        let (single, scratch) = (&self.single, &mut self.single_scratch);
        self.stiffness.finish_and_keep(&mut pass, single, scratch);
        self.extension.collect(&self.threads);
    }
}
