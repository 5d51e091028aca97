//! From a map of the contact on a coarser mesh to the start of a search.

use super::balance::Balance;
use super::coarse_contact::CoarseContact;
use super::in_order::InOrder;
use super::lanes::{Wide, over_rows};
use super::passes::{BeginProlonged, PendingUpdate, Prolonged, SumProlonged};
use super::search::Search;
use super::start::Start;
use super::survey::Standing;
use crate::contact::fft::Band;

/// How far gaps of nodes that may change are expected from those in contact, in mesh steps.
const NEAR: f64 = 1.0;

impl Search {
    /// Begins where a coarser mesh has led: one pair, in single precision. None if there is no pressure.
    pub fn begin_from(&mut self, coarse: &CoarseContact) -> Option<Start> {
        match self.bound {
            None => self.begin_from_as::<false>(coarse),
            Some(_) => self.begin_from_as::<true>(coarse),
        }
    }

    fn begin_from_as<const YIELDS: bool>(&mut self, coarse: &CoarseContact) -> Option<Start> {
        let prolonged = self.prolonged::<YIELDS>(coarse)?;
        self.base.clear();
        self.reference = coarse.reference;
        let reference = self.reference + self.height_reference;
        let mut pass = Wide(BeginProlonged::<YIELDS> {
            prolonged,
            heights: &self.heights,
            reference: reference as f32,
            gap: Band::of(&mut self.gap),
            increment: Band::of(&mut self.increment),
            carry: Band::of(&mut self.carry),
            active: self.active.band(),
            sums: InOrder::new(),
        });
        self.transform.begin(&mut pass, &mut self.scratch);
        let sums = pass.0.sums.total();
        let work = self
            .transform
            .multiply(&self.displacement, &mut self.scratch);
        self.pairs += 1;
        let offset = if YIELDS {
            let near = Standing {
                offset: 0.0,
                error: NEAR / self.steps_per_side,
            };
            self.peek_offset(1.0, near, false)
        } else {
            (work - sums.pressure_on_height) / sums.pressure - reference
        };
        let (standing, free_offset) = self.update_gap::<YIELDS>(PendingUpdate::NOTHING, offset);
        let hardness = self.ceiling();
        let balance = YIELDS.then(|| Balance {
            sum: sums.pressure + sums.saturated_nodes * (hardness - f64::from(hardness as f32)),
            free_offset,
        });
        Some(Start {
            standing,
            base_sum: 0.0,
            balance,
        })
    }

    /// Pressures of the mean that is searched for, or of what the bounds leave of that.
    fn prolonged<'a, const YIELDS: bool>(
        &mut self,
        coarse: &'a CoarseContact,
    ) -> Option<Prolonged<'a>> {
        let ceiling = self.ceiling();
        let per_pressure = 1.0 / self.compliance();
        let row_nodes = self.nodes[1];
        let mut pass = SumProlonged {
            prolonged: Prolonged::new(coarse.map(), per_pressure, ceiling),
            row: vec![0.0; row_nodes],
            sum: InOrder::new(),
        };
        let cells = self.cells();
        let rows = &mut self.gap[..cells];
        over_rows(&self.threads, rows, row_nodes, &mut pass);
        let sum = pass.sum.total();
        let scale = if YIELDS {
            1.0
        } else {
            self.load * self.cells() as f64 / sum
        };
        let is_some = sum > 0.0 && scale.is_finite();
        is_some.then(|| Prolonged::new(coarse.map(), scale * per_pressure, ceiling))
    }
}
