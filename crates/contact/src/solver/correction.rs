//! From the gap of free nodes to the pressure that would close it: the preconditioner.
//!
//! The stiffness has the pressure for a displacement of all nodes. `extension` has the displacement
//! for a gap of free nodes, and takes back to them the pressure that belongs on others.

use super::lanes::Wide;
use super::passes::{Extend, TakeOthers};
use super::search::Search;

impl Search {
    /// Makes the rows of the correction, all but what is to be given to them: in one pair, after which they are
    /// kept, or by blocks.
    pub(super) fn correct(&mut self, by_blocks: bool) {
        self.is_by_blocks = by_blocks;
        if by_blocks {
            return self.two_level.correct(&self.threads, &mut self.extension);
        }
        self.begin_correction();
        self.pairs += 1;
        let mut pass = Wide(TakeOthers {
            map: self.nodes,
            carry: &self.carry,
            active: &self.active,
            taken: self.extension.taken_rows(),
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        self.stiffness.finish_and_keep(&mut pass, single, scratch);
        self.extension.collect(&self.threads);
    }

    /// Begins the transform of the gap above its level, on free nodes and continued over the others.
    fn begin_correction(&mut self) {
        self.extension.extend(&self.threads);
        let mut pass = Wide(Extend {
            map: self.nodes,
            level: self.level as f32,
            gap: &self.gap,
            carry: &self.carry,
            active: &self.active,
            continued: self.extension.continued_rows(),
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        self.stiffness.begin(&mut pass, single, scratch);
    }
}
