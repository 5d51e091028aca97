//! Computes the direction of the next step and predicts its length.

use super::{Control, Fields};
use crate::adhesion::AdhesivePath;
use crate::adhesion::passes::visit;

/// Longest step of nodes within [`NEAR`] of the wall, in units of the range. Longer steps may leave
/// the state that a path follows.
const LONGEST_STEP: f64 = 2.0;

/// Gap, in units of the range, beyond which the attraction is too small to limit steps.
const NEAR: f64 = 6.0;

/// Smallest shape s of a free node, which is larger than the rounding of the preconditioner.
const LEAST_SHAPE: f64 = 1e-3;

/// Smallest stiffness to a uniform displacement, in units of E* over the longer side.
const LEAST_UNIFORM_STIFFNESS: f64 = 0.5;

impl AdhesivePath {
    /// Computes z = M r with the preconditioner M, or z proportional to r. The latter is a
    /// direction of descent even where many nodes are about to close or open, also after clipping.
    /// Returns the mean of s r over the mesh, with the shape s.
    ///
    /// The shape is s = 1 − X 1, which rises from zero at the closed nodes, or 1 at all free nodes.
    /// If the mean gap is prescribed, the multiple of 1 is subtracted from r for which s r vanishes
    /// in the mean.
    pub(super) fn precondition(&mut self, with_compliance: bool) -> f64 {
        let Fields { residual, direction, shape, step_pressure, continuation, .. } =
            &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        if with_compliance {
            // s ← 1 − X 1 on F
            direction.fill(1.0);
            continuation.subtract(threads, shape, direction);
            visit(threads, domain, [&direction[..]], [&mut shape[..]], |_, [rest], [free]| {
                let shape = if rest > LEAST_SHAPE { rest } else { LEAST_SHAPE };
                ([free * shape], [0.0; 0], [0.0; 0])
            });
        }
        // Σ s r, Σ s
        let inputs = [&residual[..], &shape[..]];
        let found = visit(threads, domain, inputs, [], |_, [residual, shape], []| {
            ([], [shape * residual, shape], [0.0; 0])
        });
        let [force, weight] = found.sums;
        let level = if self.control == Control::MeanGap { force / weight } else { 0.0 };
        // x ← r − Σ s r / Σ s on F
        let factor = if with_compliance { 1.0 } else { self.body.least_compliance };
        let forces = if with_compliance { &mut *step_pressure } else { &mut *direction };
        visit(threads, domain, inputs, [&mut forces[..]], |_, [residual, shape], [_]| {
            let force = if shape > 0.0 { factor * (residual - level) } else { 0.0 };
            ([force], [0.0; 0], [0.0; 0])
        });
        if with_compliance {
            // x ← −Xᵀ x on C; z ← (1 − X) A x on F
            continuation.hold(threads, shape, step_pressure);
            self.body.compliance(step_pressure, direction, &mut self.scratch);
            self.pairs += 1;
            continuation.subtract(threads, shape, direction);
        }
        force / domain.mesh_nodes() as f64
    }

    /// Returns the compliance of the mesh to displacements of the shape s.
    pub(super) fn uniform_compliance(&mut self) -> f64 {
        let Fields { shape, step_pressure, .. } = &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        self.body.stiffness(shape, step_pressure, &mut self.scratch);
        self.pairs += 1;
        let maps = [&shape[..], &step_pressure[..]];
        let found = visit(threads, domain, maps, [], |_, [shape, pressure], []| {
            ([], [shape * pressure], [0.0; 0])
        });
        let stiffness = found.sums[0] / domain.mesh_nodes() as f64;
        1.0 / stiffness.max(LEAST_UNIFORM_STIFFNESS)
    }

    /// Turns z + c s, with c = `shift`, into the direction t.
    pub(super) fn find_direction(&mut self, has_step: bool, shift: f64) {
        let Fields { gap, residual, last_residual, direction, step, shape, .. } = &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        let [gap, shape] = [&gap[..], &shape[..]];
        let inputs = [shape, &residual[..], &step[..]];
        let outputs = [&mut direction[..], &mut last_residual[..]];
        // z ← z + c s; sums of z, d and s, alone, times r and times the change y of r
        let found = visit(threads, domain, inputs, outputs, |_, x, [z, last]| {
            let [shape, residual, step] = x;
            let free = f64::from(u8::from(shape > 0.0));
            let (z, step, change) = (z + shift * shape, free * step, free * (residual - last));
            let sums = [
                z,
                z * residual,
                z * change,
                step,
                step * residual,
                step * change,
                shape,
                shape * residual,
                shape * change,
            ];
            ([z, residual], sums, [0.0; 0])
        });
        let [z, z_residual, z_change, step_sum, step_residual, step_change, weight, force, change] =
            found.sums;
        // A multiple of the shape is subtracted from z and d if the mean gap is prescribed.
        let [z_mean, step_mean] = match self.control {
            Control::MeanGap => [z / weight, step_sum / weight],
            Control::Load(_) => [0.0; 2],
        };
        let step_change = step_change - step_mean * change;
        let mut beta = 0.0;
        if has_step && step_change > 0.0 {
            beta = ((z_change - z_mean * change) / step_change).max(0.0);
            if beta * (step_residual - step_mean * force) >= z_residual - z_mean * force {
                beta = 0.0;
            }
        }
        // t ← z̄ s − z + β (d − d̄ s), or 0 for nodes of the wall that t would push into it
        let inputs = [gap, shape, &step[..]];
        let found = visit(threads, domain, inputs, [&mut direction[..]], |site, x, [z]| {
            let [gap, shape, step] = x;
            let step = if shape > 0.0 { step } else { 0.0 };
            let moved = z_mean * shape - z + beta * (step - step_mean * shape);
            let is_blocked = gap <= site.floor && moved <= 0.0;
            let [moved, moving] = if is_blocked { [0.0; 2] } else { [moved, shape] };
            ([moved], [moved, moving], [0.0; 0])
        });
        if self.control != Control::MeanGap {
            return;
        }
        let [sum, moving] = found.sums;
        // t ← t − s Σ t / Σ s over the moving nodes
        let mean = sum / moving;
        visit(threads, domain, [gap, shape], [&mut direction[..]], |site, x, [moved]| {
            let [gap, shape] = x;
            let is_fixed = gap <= site.floor && moved == 0.0;
            ([if is_fixed { 0.0 } else { moved - mean * shape }], [0.0; 0], [0.0; 0])
        });
    }

    /// Returns the predicted length τ, or a shorter one that limits the steps of nodes near the
    /// wall.
    pub(super) fn limited(&self, length: f64) -> f64 {
        if self.adhesion.work == 0.0 {
            return length;
        }
        let Fields { gap, direction, .. } = &self.fields;
        let near = NEAR * self.adhesion.range;
        let found = visit(
            &self.threads,
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
        let longest = LONGEST_STEP * self.adhesion.range;
        if length * largest > longest { longest / largest } else { length }
    }
}
