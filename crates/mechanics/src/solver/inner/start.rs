//! Starts of the iterations in single precision.

use super::InnerSolver;
use super::conjugate_gradients::{Balance, State};
use crate::fft::Band;
use crate::solver::lanes::{InOrder, Wide, over_rows};
use crate::solver::passes::{Convergence, GapUpdate, InitialResidual, PendingUpdate};
use crate::solver::prolongation::{
    AppliedUpdate, BeginPressed, CoarseMap, PressureLessGap, Prolonged, StartPressure, SumProlonged,
};

/// Ratio of the factor s in the map s p − g to the displacement of one node of the finer mesh under
/// unit pressure on itself. Ratios of 1 and 2 take as many pairs.
const COMPLIANCES: f64 = 1.5;

/// Assumed error of the gaps under interpolated pressures, in mesh steps at unit rms slope. If the
/// material yields, open and saturated nodes within this error take part in the estimate of the
/// first offset.
const NEAR: f64 = 1.0;

impl InnerSolver {
    /// Begins iterations from `pressure` and the present gaps, and computes their first residual.
    /// `convergence` describes these gaps.
    pub fn begin(&mut self, pressure: &mut [f64], convergence: Convergence) -> State {
        match self.bound {
            None => self.begin_as::<false>(pressure, convergence.offset),
            Some(hardness) => {
                let offset = self.balanced_offset(pressure, hardness, convergence);
                self.begin_as::<true>(pressure, offset)
            }
        }
    }

    /// Begins iterations from `pressure`. The first residual is the gap minus `offset`.
    fn begin_as<const YIELDS: bool>(&mut self, pressure: &mut [f64], offset: f64) -> State {
        let row_nodes = self.mesh.nodes[1];
        let mut pass = InitialResidual::<YIELDS> {
            response: GapUpdate::without_step(offset),
            gap: &self.gap,
            hardness: self.bound.map_or(f64::INFINITY, |bound| bound.pressure()),
            last_step: Band::new(&mut self.last_step),
            active: self.active.band(),
            residual: self.preconditioner.residual_rows(),
            row: vec![0.0; row_nodes],
            reference_pressure: self.reference_pressure.band(),
            pressure_increment: Band::new(&mut self.pressure_increment),
            seen: InOrder::new(),
            reference_sum: InOrder::new(),
            bounded_sum: InOrder::new(),
        };
        over_rows(&self.threads, pressure, row_nodes, &mut pass);
        let (seen, reference_sum) = (pass.seen.total(), pass.reference_sum.total());
        let sum = pass.bounded_sum.total();
        self.free_nodes = seen.free_nodes;
        self.level = offset;
        State {
            convergence: seen.extremes.convergence(offset),
            reference_sum,
            balance: YIELDS.then(|| Balance::seen(&seen, sum, offset)),
        }
    }

    /// Returns the factor s of the map s p − g with which iterations on this mesh begin, where p
    /// and g are the pressure and the gap on the next coarser mesh.
    pub fn compliance(&self) -> f64 {
        COMPLIANCES * self.mesh.nodal_compliance
    }

    /// Begins iterations in single precision with pressures interpolated from a coarser mesh; takes
    /// one transform pair. Returns `None` if no interpolated pressure is positive.
    pub fn begin_from(&mut self, coarse: CoarseMap, reference: f64) -> Option<State> {
        let prolonged = self.prolonged(coarse)?;
        self.reference_pressure.clear();
        self.reference = reference;
        Some(self.begin_pressed(StartPressure::FromCoarserMesh(prolonged)))
    }

    /// Begins new iterations from the present pressures after the update `pending`; takes one
    /// transform pair. Adds `offset`, approximately the mean gap in contact, to the reference of
    /// the gaps.
    pub fn begin_again(&mut self, pending: PendingUpdate, offset: f64) -> State {
        self.reference += offset;
        let update = AppliedUpdate::new(pending, self.ceiling());
        self.begin_pressed(StartPressure::FromLastIteration(update))
    }

    fn begin_pressed(&mut self, start: StartPressure) -> State {
        match self.bound {
            None => self.begin_pressed_as::<false>(start),
            Some(_) => self.begin_pressed_as::<true>(start),
        }
    }

    fn begin_pressed_as<const YIELDS: bool>(&mut self, start: StartPressure) -> State {
        let reference = self.reference + self.mesh.highest;
        let hardness = self.ceiling();
        let mut pass = Wide(BeginPressed::<YIELDS> {
            start,
            ceiling: hardness as f32,
            heights: &self.mesh.heights,
            reference: reference as f32,
            gap: Band::new(&mut self.gap),
            pressure_increment: Band::new(&mut self.pressure_increment),
            last_step: Band::new(&mut self.last_step),
            active: self.active.band(),
            sums: InOrder::new(),
        });
        self.mesh.transform.begin(&mut pass, &mut self.scratch);
        let sums = pass.0.sums.total();
        let work = self.mesh.transform.multiply(&self.mesh.displacement, &mut self.scratch);
        self.pairs += 1;
        let offset = if YIELDS {
            let near = Convergence { offset: 0.0, error: NEAR / self.mesh.steps_per_side };
            self.peek_offset(1.0, near, false)
        } else {
            (work - sums.pressure_on_height) / sums.pressure - reference
        };
        let (convergence, free_offset) = self.finish_gap::<YIELDS>(PendingUpdate::NONE, offset);
        let balance = YIELDS.then(|| Balance {
            sum: sums.pressure + sums.saturated_nodes * (hardness - f64::from(hardness as f32)),
            free_offset,
        });
        State { convergence, reference_sum: 0.0, balance }
    }

    /// Returns the pressures interpolated from a coarser mesh, or `None` if none of them is
    /// positive.
    ///
    /// Without an upper bound, they are scaled so that their mean is the load.
    pub fn prolonged<'a>(&mut self, coarse: CoarseMap<'a>) -> Option<Prolonged<'a>> {
        let ceiling = self.ceiling();
        let per_pressure = 1.0 / self.compliance();
        let row_nodes = self.mesh.nodes[1];
        let mut pass = SumProlonged {
            prolonged: Prolonged::new(coarse, per_pressure, ceiling),
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
        is_some.then(|| Prolonged::new(coarse, scale * per_pressure, ceiling))
    }

    /// Sets `map` to s p − g after the update `pending`, with s = `compliance`, and returns the
    /// largest pressure. Gaps are measured from `offset`, approximately the mean gap in contact.
    pub fn pressure_less_gap(
        &self,
        pending: PendingUpdate,
        offset: f64,
        compliance: f64,
        map: &mut [f32],
    ) -> f64 {
        let mut pass = PressureLessGap {
            compliance: compliance as f32,
            offset: offset as f32,
            update: AppliedUpdate::new(pending, self.ceiling()),
            pressure_increment: &self.pressure_increment,
            last_step: &self.last_step,
            gap: &self.gap,
            peak_pressure: 0.0,
        };
        over_rows(&self.threads, map, self.mesh.nodes[1], &mut pass);
        f64::from(pass.peak_pressure)
    }
}
