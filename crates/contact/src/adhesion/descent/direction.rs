//! Computes the direction of the next step and predicts its length.

use super::{Balance, Control, Descent, Fields};
use crate::adhesion::passes::visit;

/// Longest step of nodes within [`NEAR`] of the wall, in units of the range. Longer steps may leave
/// the state that a path follows.
const LONGEST_STEP: f64 = 2.0;

/// Gap, in units of the range, beyond which the attraction is too small to limit steps.
const NEAR: f64 = 6.0;

/// Smallest stiffness to a uniform displacement, in units of E* over the longer side.
const LEAST_UNIFORM_STIFFNESS: f64 = 0.5;

impl Descent<'_> {
    /// Returns the compliance of the free nodes to a uniform displacement.
    pub(super) fn uniform_compliance(&mut self, mean_pressure: f64) -> f64 {
        let Fields { gap, pressure, pull, step_pressure, direction, .. } = &mut *self.fields;
        let (threads, domain) = (self.threads, self.body.domain);
        let maps = [&gap[..], &pressure[..], &pull[..]];
        visit(threads, domain, maps, [&mut direction[..]], |site, [gap, pressure, pull], [_]| {
            ([site.free(gap, pressure + pull + mean_pressure)], [0.0; 0], [0.0; 0])
        });
        self.body.stiffness(direction, step_pressure, self.scratch);
        self.pairs += 1;
        let maps = [&direction[..], &step_pressure[..]];
        let found = visit(threads, domain, maps, [], |_, [free, pressure], []| {
            ([], [free * pressure], [0.0; 0])
        });
        let stiffness = found.sums[0] / domain.mesh_nodes() as f64;
        1.0 / stiffness.max(LEAST_UNIFORM_STIFFNESS)
    }

    /// Computes z = A r on all nodes, or z proportional to r. The latter is a direction of descent
    /// even where many nodes are about to close or open, also after clipping.
    pub(super) fn precondition(&mut self, with_compliance: bool) {
        let Fields { residual, direction, .. } = &mut *self.fields;
        if with_compliance {
            self.body.compliance(residual, direction, self.scratch);
            self.pairs += 1;
            return;
        }
        let (compliance, residual) = (self.body.least_compliance, &residual[..]);
        visit(self.threads, self.body.domain, [residual], [direction], |_, [residual], [_]| {
            ([compliance * residual], [0.0; 0], [0.0; 0])
        });
    }

    /// Turns z into the direction t.
    pub(super) fn find_direction(&mut self, has_step: bool, balance: &Balance, uniform: f64) {
        let Fields { gap, pressure, pull, residual, last_residual, direction, step, .. } =
            &mut *self.fields;
        let (threads, domain) = (self.threads, self.body.domain);
        let mean_pressure = balance.mean_pressure;
        let shift = uniform * balance.residual;
        let [gap, pressure, pull] = [&gap[..], &pressure[..], &pull[..]];
        let inputs = [gap, pressure, pull, &residual[..], &step[..]];
        let outputs = [&mut direction[..], &mut last_residual[..]];
        let found = visit(threads, domain, inputs, outputs, |site, x, [z, last]| {
            let [gap, pressure, pull, residual, step] = x;
            let free = site.free(gap, pressure + pull + mean_pressure);
            let (z, step) = (free * (z + shift), free * step);
            let change = free * (residual - last);
            let sums = [z, z * residual, z * change, step, step * residual, step * change, change];
            ([z, residual], sums, [0.0; 0])
        });
        let [z, z_residual, z_change, step_sum, step_residual, step_change, change] = found.sums;
        // The mean over the free nodes is subtracted from z and d if the mean gap is prescribed.
        let [z_mean, step_mean] = match self.control {
            Control::MeanGap => [z / balance.free, step_sum / balance.free],
            Control::Load(_) => [0.0; 2],
        };
        let step_change = step_change - step_mean * change;
        let mut beta = 0.0;
        if has_step && step_change > 0.0 {
            beta = ((z_change - z_mean * change) / step_change).max(0.0);
            if beta * step_residual >= z_residual {
                beta = 0.0;
            }
        }
        // Nodes of the wall that the direction would push into it stay where they are.
        let inputs = [gap, pressure, pull, &step[..]];
        let found = visit(threads, domain, inputs, [&mut direction[..]], |site, x, [z]| {
            let [gap, pressure, pull, step] = x;
            let free = site.free(gap, pressure + pull + mean_pressure);
            let moved = free * (z_mean - z + beta * (step - step_mean));
            let is_blocked = gap <= site.floor && moved <= 0.0;
            let moving = if is_blocked { 0.0 } else { free };
            let moved = if is_blocked { 0.0 } else { moved };
            ([moved], [moved, moving], [0.0; 0])
        });
        if self.control != Control::MeanGap {
            return;
        }
        let [sum, moving] = found.sums;
        let mean = sum / moving;
        visit(threads, domain, [gap], [&mut direction[..]], |site, [gap], [moved]| {
            let is_fixed = gap <= site.floor && moved == 0.0;
            ([if is_fixed { 0.0 } else { moved - mean }], [0.0; 0], [0.0; 0])
        });
    }

    /// Returns the predicted length τ, or a shorter one that limits the steps of nodes near the
    /// wall.
    pub(super) fn limited(&self, length: f64) -> f64 {
        if self.adhesion.work() == 0.0 {
            return length;
        }
        let Fields { gap, direction, .. } = &*self.fields;
        let near = NEAR * self.adhesion.range();
        let found = visit(
            self.threads,
            self.body.domain,
            [&gap[..], &direction[..]],
            [],
            |site, [gap, direction], []| {
                let is_near = gap < near || gap + length * direction < near;
                let counts = f64::from(u8::from(is_near)) * site.weight;
                ([], [0.0; 0], [counts * direction.abs()])
            },
        );
        let [largest] = found.highest;
        let longest = LONGEST_STEP * self.adhesion.range();
        if length * largest > longest { longest / largest } else { length }
    }
}
