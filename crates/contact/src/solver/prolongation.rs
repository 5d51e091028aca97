//! From a map of the contact on a coarser mesh to the start of a search.

use super::balance::Balance;
use super::coarse_contact::CoarseContact;
use super::evaluation::Evaluation;
use super::in_order::InOrder;
use super::lanes::{Wide, over_rows};
use super::passes::{
    BeginPressed, LastMoveDone, PendingUpdate, Prolonged, SetProlonged, StartPressure, SumProlonged,
};
use super::search::Search;
use super::start::Start;
use super::survey::Standing;
use super::{Settings, Solver};
use crate::fft::Band;

/// How far gaps of nodes that may change are expected from those in contact, in mesh steps.
const NEAR: f64 = 1.0;

impl Solver {
    /// Evaluates the pressures to which a coarser mesh has led; none if there is no pressure.
    pub(super) fn evaluate_prolonged(
        &mut self,
        coarse: &CoarseContact,
        settings: &Settings,
    ) -> Option<Evaluation> {
        let prolonged = self.search.prolonged(coarse)?;
        let row_nodes = self.search.nodes[1];
        let mut pass =
            SetProlonged { prolonged, hardness: self.search.ceiling(), row: vec![0.0; row_nodes] };
        let pressure = &mut self.pressure;
        over_rows(&self.search.threads, pressure, row_nodes, &mut pass);
        self.impose_load();
        self.search.reference = coarse.reference;
        Some(self.evaluate_guess(settings))
    }
}

impl Search {
    /// Begins where a coarser mesh has led: one pair, in single precision. None if there is no pressure.
    pub fn begin_from(&mut self, coarse: &CoarseContact) -> Option<Start> {
        let prolonged = self.prolonged(coarse)?;
        self.base.clear();
        self.reference = coarse.reference;
        Some(self.begin_pressed(StartPressure::OfCoarserMesh(prolonged)))
    }

    /// Begins once more where it has ended, gaps in contact about as high as the offset: one pair.
    pub fn begin_again(&mut self, pending: PendingUpdate, offset: f64) -> Start {
        self.reference += offset;
        let done = LastMoveDone::new(pending, self.ceiling());
        self.begin_pressed(StartPressure::OfLastMove(done))
    }

    fn begin_pressed(&mut self, start: StartPressure) -> Start {
        match self.bound {
            None => self.begin_pressed_as::<false>(start),
            Some(_) => self.begin_pressed_as::<true>(start),
        }
    }

    fn begin_pressed_as<const YIELDS: bool>(&mut self, start: StartPressure) -> Start {
        let reference = self.reference + self.height_reference;
        let hardness = self.ceiling();
        let mut pass = Wide(BeginPressed::<YIELDS> {
            start,
            ceiling: hardness as f32,
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
        let work = self.transform.multiply(&self.displacement, &mut self.scratch);
        self.pairs += 1;
        let offset = if YIELDS {
            let near = Standing { offset: 0.0, error: NEAR / self.steps_per_side };
            self.peek_offset(1.0, near, false)
        } else {
            (work - sums.pressure_on_height) / sums.pressure - reference
        };
        let (standing, free_offset) = self.update_gap::<YIELDS>(PendingUpdate::NOTHING, offset);
        let balance = YIELDS.then(|| Balance {
            sum: sums.pressure + sums.saturated_nodes * (hardness - f64::from(hardness as f32)),
            free_offset,
        });
        Start { standing, base_sum: 0.0, balance }
    }

    /// Pressures of the mean that is searched for, or of what the bounds leave of that; none if there are none.
    fn prolonged<'a>(&mut self, coarse: &'a CoarseContact) -> Option<Prolonged<'a>> {
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
        let scale = match self.bound {
            None => self.load * self.cells() as f64 / sum,
            Some(_) => 1.0,
        };
        let is_some = sum > 0.0 && scale.is_finite();
        is_some.then(|| Prolonged::new(coarse.map(), scale * per_pressure, ceiling))
    }
}
