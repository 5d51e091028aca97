//! Starts of the iterations in single precision.

use super::InnerSolver;
use super::conjugate_gradients::{Balance, State};
use crate::fft::{Band, Row};
use crate::solver::lanes::{
    InOrder, LANES, Totals, Visit, for_rows_with, greater, over_rows, sum_by, sum_rows, total,
};
use crate::solver::marks::{PRESSED, SATURATED};
use crate::solver::passes::{Convergence, GapUpdate, InitialResidual, PendingUpdate};
use crate::solver::prolongation::{AppliedUpdate, CoarseMap, Prolonged, StartPressure};

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
        let reference = self.reference + self.mesh.highest;
        let hardness = self.ceiling();
        let ceiling = hardness as f32;
        let saturated = if self.bound.is_some() { SATURATED } else { 0 };
        let heights = &self.mesh.heights;
        let maps = [&mut self.gap, &mut self.pressure_increment, &mut self.last_step];
        let (bands, active) = (maps.map(|map| Band::new(map)), self.active.band());
        let state = ((start, active), (bands, InOrder::new()));
        // Writes the pressures as input of the convolution. Displacements are added to the gaps
        // after the convolution. The last steps are zero, with flags that follow from the pressure.
        let mut pass = Visit::rows(state, |state, row: Row, pressure: &mut [f32]| {
            let ((start, active), (bands, sums)) = state;
            let [gap, increment, last_step] = bands.each_mut().map(|band| band.row(row));
            start.set_row(row, pressure, increment, last_step);
            let heights = row.of(heights);
            for (gap, height) in gap.iter_mut().zip(heights) {
                *gap = -(height + reference as f32);
            }
            let mut saturated_nodes = 0;
            for (last_step, p) in last_step.iter_mut().zip(&*pressure) {
                let bears = u32::from(*p >= ceiling);
                let pressed = PRESSED * u32::from(*p > 0.0);
                *last_step = f32::from_bits(pressed | (saturated * bears));
                saturated_nodes += bears;
            }
            increment.copy_from_slice(pressure);
            let always = active.always;
            let groups = active.row(row);
            groups.free.fill(false);
            let increments = increment.as_chunks_mut::<LANES>().0;
            for (active, increments) in groups.active.iter_mut().zip(increments) {
                *active = always || increments.iter().any(|increment| *increment > 0.0);
                if !*active {
                    // Clipping leaves −0, too.
                    increments.fill(-0.0);
                }
            }
            let on_height = sum_by(pressure, heights, |p, height| p * height);
            let row_sums = [total(pressure), on_height, f64::from(saturated_nodes)];
            sums.push(Totals { sums: row_sums, highest: [] });
        });
        self.mesh.transform.begin(&mut pass, &mut self.scratch);
        let (_, (_, sums)) = pass.0.state;
        let [pressure, pressure_on_height, saturated_nodes] = sums.total().sums;
        let work = self.mesh.transform.multiply(&self.mesh.displacement, &mut self.scratch);
        self.pairs += 1;
        let (convergence, free_offset) = match self.bound {
            Some(_) => {
                let near = Convergence { offset: 0.0, error: NEAR / self.mesh.steps_per_side };
                let offset = self.peek_offset(1.0, near, false);
                self.finish_gap::<true>(PendingUpdate::NONE, offset)
            }
            None => {
                let offset = (work - pressure_on_height) / pressure - reference;
                self.finish_gap::<false>(PendingUpdate::NONE, offset)
            }
        };
        let balance = self.bound.map(|_| Balance {
            sum: pressure + saturated_nodes * (hardness - f64::from(ceiling)),
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
        let prolonged = Prolonged::new(coarse, per_pressure, ceiling);
        let state = ((prolonged, vec![0.0; row_nodes]), InOrder::new());
        // Any map of the size drives the pass.
        let (threads, rows) = (&self.threads, &mut self.gap[..self.mesh.cells()]);
        let (_, sums) = for_rows_with(threads, rows, row_nodes, state, |state, row, _| {
            let ((prolonged, pressure), sum) = state;
            prolonged.set_row(row, pressure);
            sum.push(total(pressure));
        });
        let sum = sums.total();
        let scale = match self.bound {
            None => self.load * self.mesh.cells() as f64 / sum,
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
        let update = AppliedUpdate::new(pending, self.ceiling());
        let (compliance, offset) = (compliance as f32, offset as f32);
        let peak = sum_rows(&self.threads, map, self.mesh.nodes[1], |row, values| {
            let pressed = row.of(&self.pressure_increment).iter().zip(row.of(&self.last_step));
            let mut peak = 0.0_f32;
            for (value, (pressed, gap)) in values.iter_mut().zip(pressed.zip(row.of(&self.gap))) {
                let p = update.pressure(*pressed.0, *pressed.1);
                *value = compliance * p - (gap - offset);
                peak = greater(peak, p);
            }
            Totals { sums: [], highest: [f64::from(peak)] }
        });
        peak.highest[0]
    }
}
