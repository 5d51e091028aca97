//! Passes that take pressures to double precision, and bring gaps back.

use super::InnerSolver;
use crate::fft::{Band, Rows};
use crate::solver::lanes::{InOrder, Visit, Wide, for_rows, greater, weight};
use crate::solver::marks::{FREE, has, marked_by_pressure};
use crate::solver::passes::{GapOutput, GapStatistics, StepOutput, StepScaling, promote};

impl InnerSolver {
    /// Returns the pass that begins the convolution of `pressure` and sets the flags of nodes with
    /// pressure and of saturated nodes. The last steps are set to zero unless `keeps_steps`.
    pub fn pressure_input(&mut self, pressure: &[f64], keeps_steps: bool) -> impl Rows<f64> {
        let hardness = self.ceiling();
        Visit::rows(Band::new(&mut self.last_step), move |last_step, row, values| {
            values.copy_from_slice(row.of(pressure));
            for (last_step, p) in last_step.row(row).iter_mut().zip(values) {
                let kept = if keeps_steps { *last_step } else { 0.0 };
                *last_step = marked_by_pressure(kept, *p, hardness);
            }
        })
    }

    /// Returns the pass that sets `pressure` to `scale` × the pressures in single precision and
    /// begins its convolution.
    pub fn promoted_input(&self, scale: f64, pressure: &mut [f64]) -> impl Rows<f64> {
        let (reference_pressure, increment) = (&self.reference_pressure, &self.pressure_increment);
        Visit::rows(Band::new(pressure), move |band, row, values| {
            let pressure = band.row(row);
            promote(scale, reference_pressure.row(row), row.of(increment), pressure);
            values.copy_from_slice(pressure);
        })
    }

    /// Returns the pass that takes the gaps from displacements. It adds up all gaps if `sums_gaps`.
    pub fn gap_output<'a, const YIELDS: bool>(
        &'a mut self,
        heights: &'a [f64],
        sums_gaps: bool,
    ) -> Wide<GapOutput<'a, YIELDS>> {
        Wide(GapOutput {
            heights,
            reference: self.reference,
            gap: Band::new(&mut self.gap),
            last_step: &self.last_step,
            sums_gaps,
            statistics: InOrder::new(),
        })
    }

    /// Returns the pass of [`InnerSolver::gap_output`] after a step, which keeps the change of the
    /// gaps of the sample and adds up the curvature of the energy.
    pub fn step_output<'a, const YIELDS: bool>(
        &'a mut self,
        heights: &'a [f64],
        sums_gaps: bool,
        scaling: StepScaling,
    ) -> Wide<StepOutput<'a, YIELDS>> {
        Wide(StepOutput {
            heights,
            reference: self.reference,
            scaling,
            sums_gaps,
            statistics: InOrder::<GapStatistics>::new(),
            curvature: InOrder::new(),
            reference_pressure: &self.reference_pressure,
            pressure_increment: &self.pressure_increment,
            gap: Band::new(&mut self.gap),
            last_step: Band::new(&mut self.last_step),
            sample: self.sample.band(),
            found: vec![0.0; self.mesh.nodes[1]],
        })
    }

    /// Sets `pressure` to `factor` × the pressures in single precision.
    pub fn promote(&self, factor: f64, pressure: &mut [f64]) {
        for_rows(&self.threads, pressure, self.mesh.nodes[1], |row, pressure| {
            let increment = row.of(&self.pressure_increment);
            promote(factor, self.reference_pressure.row(row), increment, pressure);
        });
    }

    /// Undoes the fraction `part` of the last step in `pressure`, within the bounds.
    pub fn take_back(&self, part: f64, pressure: &mut [f64]) {
        let hardness = self.ceiling();
        for_rows(&self.threads, pressure, self.mesh.nodes[1], |row, pressure| {
            for (p, last_step) in pressure.iter_mut().zip(row.of(&self.last_step)) {
                let step = weight::<f64>(has(*last_step, FREE)) * f64::from(*last_step);
                // Rounding must not leave a pressure below zero or above the hardness.
                *p = greater(*p - part * step, 0.0).min(hardness);
            }
        });
    }

    /// Replaces the pressure p of each free node by clamp(p + s, 0, `hardness`), with the shift s
    /// for which the mean over all nodes is the load. Without such a shift, the pressures stay as
    /// they are.
    pub fn shift_free_nodes(&mut self, hardness: f64, pressure: &mut [f64]) {
        let sum: f64 = pressure.iter().sum();
        let missing_load = self.total() - sum;
        self.candidates.clear();
        for (p, last_step) in pressure.iter().zip(&self.last_step) {
            if has(*last_step, FREE) {
                self.candidates.push(*p as f32, 0.0);
            }
        }
        let Some(shift) = self.candidates.shift(missing_load, hardness as f32) else {
            return;
        };
        for (p, last_step) in pressure.iter_mut().zip(&self.last_step) {
            if has(*last_step, FREE) {
                *p = (*p + shift).clamp(0.0, hardness);
            }
        }
    }
}
