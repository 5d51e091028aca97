//! Balance of the mean pressure while pressures are clipped at both bounds.
//!
//! If the material yields, pressures cannot be scaled back to their mean after a step, because
//! saturated pressures would leave their bound. Instead, a constant is added to the direction
//! before the step. It compensates for the expected clipping, which is estimated from the free
//! nodes in a sample of rows. Similarly, the offset of the residual is chosen such that a step
//! along the negative residual would change the pressures within their bounds but not their sum.
//! This matters if few or no nodes are elastic: their mean gap then says nothing, and nodes jump
//! between both bounds. [`Candidates::shift`] computes both constants.

use super::InnerSolver;
use crate::fft::{Row, Stored};
use crate::solver::Hardness;
use crate::solver::candidates::Candidates;
use crate::solver::lanes::Visit;
use crate::solver::marks::{FREE, PRESSED, SATURATED, has};
use crate::solver::passes::{Convergence, MIN_SAMPLE_NODES};

/// Ratio of the residual to reach to the present residual above which steps are balanced with all
/// free nodes instead of a sample.
const BALANCED_REDUCTION: f64 = 1e-3;

impl InnerSolver {
    /// Returns whether all rows, instead of a sample, must be used to balance a step. `reduction`
    /// is the ratio of the residual to reach to the present residual.
    ///
    /// With a sample, a part of the load is missing after the step and is restored by scaling
    /// elastic pressures. If only a few strips of nodes are elastic, this opens their gaps by more
    /// than the tolerance, which matters in the last iterations.
    pub(super) fn must_balance(&self, reduction: f64) -> bool {
        self.bound.is_some() && reduction > BALANCED_REDUCTION
    }

    /// Returns the number m for which the clipped step τ (−z + β s − m) adds `missing_load` to the
    /// sum of pressures.
    ///
    /// z and s are the correction and the last step of each node, τ is `step_length` and β is
    /// `beta`. m is estimated from the free nodes collected from `rows` rows. Returns `None` if the
    /// pressures have no upper bound or no m satisfies this.
    pub(super) fn balanced_mean(
        &mut self,
        [step_length, beta]: [f64; 2],
        missing_load: f64,
        rows: usize,
    ) -> Option<f64> {
        let hardness = self.bound?;
        self.candidates.follow(step_length as f32, beta as f32);
        let part = rows as f64 / self.mesh.nodes[0] as f64;
        let shift = self.candidates.shift(part * missing_load, hardness.pressure() as f32)?;
        Some(-shift / step_length)
    }

    /// Returns the offset of gaps for which Σ clamp(p − k (g − offset), 0, hardness) = Σ p after
    /// the fraction `part` of a step.
    ///
    /// p and g are the pressure and the gap of each node that may change, and k is the nodal
    /// stiffness. `convergence` describes the gaps before the step. The sums are over a sample of
    /// rows, or over all rows if `sees_all_rows` or if the sample is too small. Close to a
    /// solution, the result is the mean gap of elastic nodes.
    pub(super) fn peek_offset(
        &mut self,
        part: f64,
        convergence: Convergence,
        sees_all_rows: bool,
    ) -> f64 {
        let hardness = self.ceiling();
        let Convergence { offset, error } = convergence;
        let [part, level, highest, lowest] =
            [part, offset, offset + error, offset - error].map(|number| number as f32);
        let (stiffness, taken) = (self.mesh.nodal_stiffness as f32, 1.0 - part);
        let (gap, last_step) = (&self.gap, &self.last_step);
        let (reference_pressure, increment) = (&self.reference_pressure, &self.pressure_increment);
        let mut peek = Visit::rows(Candidates::default(), |nodes, row: Row, values: &mut [f32]| {
            let pressure = reference_pressure.row(row).iter().zip(row.of(increment));
            let gaps = values.iter().zip(row.of(gap)).zip(row.of(last_step));
            for (((value, gap), last_step), (reference_pressure, increment)) in gaps.zip(pressure) {
                let gap = gap + part * *value;
                let is_free = has(*last_step, FREE);
                let may_change = if is_free && taken > 0.0 {
                    true
                } else if has(*last_step, SATURATED) {
                    gap > lowest
                } else {
                    has(*last_step, PRESSED) || gap < highest
                };
                if may_change {
                    let back = if is_free { taken * last_step } else { 0.0 };
                    nodes.push(reference_pressure + (increment - back), stiffness * (level - gap));
                }
            }
        });
        let (single, scratch) = (&self.mesh.transform, &mut self.scratch);
        single.peek(Stored::Spectra, &self.sample.pairs(), &mut peek, scratch);
        if sees_all_rows || (peek.0.state.len() as f64) < MIN_SAMPLE_NODES {
            single.peek(Stored::Spectra, &self.sample.other_pairs(), &mut peek, scratch);
        }
        let shift = peek.0.state.shift(0.0, hardness as f32).unwrap_or(0.0);
        offset + shift / self.mesh.nodal_stiffness
    }

    /// Returns the offset of gaps for which Σ clamp(p − k (g − offset), 0, `hardness`) = Σ p.
    ///
    /// p and g are the `pressure` and the gap of each node that may change, and k is the nodal
    /// stiffness. The result replaces `convergence.offset`, the mean gap of elastic nodes, which
    /// may be the gap of only one or two nodes.
    pub fn balanced_offset(
        &mut self,
        pressure: &[f64],
        hardness: Hardness,
        convergence: Convergence,
    ) -> f64 {
        self.candidates.clear();
        self.gather(self.sample.pairs(), pressure, hardness, convergence);
        if (self.candidates.len() as f64) < MIN_SAMPLE_NODES {
            self.gather(self.sample.other_pairs(), pressure, hardness, convergence);
        }
        let shift = self.candidates.shift(0.0, hardness.pressure() as f32);
        convergence.offset + shift.unwrap_or(0.0) / self.mesh.nodal_stiffness
    }

    /// Appends to `candidates` the nodes whose pressure may change, from rows 2i and 2i + 1 for
    /// each i in `pairs`. The proposed change of each is −k (g − offset), with the gap g and the
    /// nodal stiffness k.
    ///
    /// Let e be `convergence.error`. Elastic nodes may change, nodes without pressure if g − offset
    /// < e, and saturated nodes if g − offset > −e.
    fn gather(
        &mut self,
        pairs: Vec<usize>,
        pressure: &[f64],
        hardness: Hardness,
        convergence: Convergence,
    ) {
        let Convergence { offset, error } = convergence;
        for pair in pairs {
            let first = 2 * pair * self.mesh.nodes[1];
            let last = pressure.len().min(first + 2 * self.mesh.nodes[1]);
            for (p, gap) in pressure[first..last].iter().zip(&self.gap[first..last]) {
                let above = f64::from(*gap) - offset;
                let may_change = match *p {
                    0.0 => above < error,
                    p if p >= hardness.pressure() => above > -error,
                    _ => true,
                };
                if may_change {
                    let change = -self.mesh.nodal_stiffness * above;
                    self.candidates.push(*p as f32, change as f32);
                }
            }
        }
    }
}
