//! Initial guess of the pressures: from coarser meshes (`nested`), or on one mesh.
//!
//! On small meshes, and under light loads, the guess is made on one mesh:
//!
//! - Under a light load the displacements are smaller than the differences in height of the nodes,
//!   so the guess is made from the heights. Any other guess would put pressure on too many nodes.
//!   Removing this pressure takes steps so much larger than the final pressure that single
//!   precision would lose it.
//! - Otherwise the guess is the pressure of full contact, shifted and clipped.

use super::line_search::StepControl;
use super::problem::range;
use super::refinement::Evaluation;
use super::{Settings, Solver, Watch};
use crate::elasticity::{self, Factor};
use crate::fft::Transform;

/// Upper limit of load × nodes for a light load, in E* × rms slope. This product is the pressure of
/// a single node that bears the whole load.
const LIGHT: f64 = 1.0;

impl Solver {
    /// Finds initial pressures for the present load and bound: on coarser meshes, or on this mesh
    /// if there are none or if the load is light. Returns their evaluation.
    pub(super) fn initial_guess(
        &mut self,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> (StepControl, Evaluation) {
        if let Some(guess) = self.guess_from_coarser(settings, watch) {
            return guess;
        }
        self.inner.reference = 0.0;
        if self.is_light() {
            self.guess_from_heights(self.inner.load);
        } else {
            self.guess_from_full_contact(self.inner.load);
        }
        self.impose_load();
        (self.inner.step_control(false), self.evaluate_guess(settings))
    }

    pub(super) fn is_light(&self) -> bool {
        self.inner.load * (self.pressure.len() as f64) < LIGHT
    }

    /// Sets the pressures to the full-contact pressures under the load.
    ///
    /// These are the solution if none of them is negative.
    pub(super) fn set_full_contact(&mut self) {
        let load = self.inner.load;
        self.fill_with_full_contact();
        for p in &mut self.pressure {
            *p += load;
        }
    }
}

/// Number of bisections with which [`Solver::raise_to`] determines the shift to the last bit.
const BISECTIONS: u32 = 60;

/// Ratio of all nodes to nodes with positive pressure above which [`Solver::raise_to`] visits only
/// a list of the nodes with positive pressure.
const COPY_RATIO: usize = 4;

impl Solver {
    /// Sets the pressures to clamp(p + s, 0, hardness), with the pressure p of full contact with
    /// zero mean and the shift s for which their mean is `load`.
    fn guess_from_full_contact(&mut self, load: f64) {
        self.fill_with_full_contact();
        let [lowest, highest] =
            range(&self.inner.threads, &mut self.pressure, self.inner.mesh.nodes[1]);
        let most = match self.inner.bound {
            Some(hardness) => hardness.pressure() - lowest,
            // With this shift, the mean is the load of full contact, which exceeds `load`.
            None => self.problem.full_contact.map_or(load - lowest, |full| full.load),
        };
        self.raise_to(load, (-highest, most));
    }

    /// Sets the pressures to clamp((h − h_max)/c + s, 0, hardness), as if nodes did not displace
    /// each other.
    ///
    /// h is the height of a node, c the nodal compliance, and s the shift for which the mean
    /// pressure is `load`. The guess is exact if one node bears all the load or if displacements
    /// are negligible.
    pub(super) fn guess_from_heights(&mut self, load: f64) {
        for (p, height) in self.pressure.iter_mut().zip(&self.problem.heights) {
            *p = (height - self.problem.highest) / self.inner.mesh.nodal_compliance;
        }
        let most = match self.inner.bound {
            None => load * self.pressure.len() as f64,
            Some(hardness) => {
                hardness.pressure()
                    + (self.problem.highest - self.problem.lowest)
                        / self.inner.mesh.nodal_compliance
            }
        };
        let highest = self.raise_to(load, (0.0, most));
        self.inner.reference = highest * self.inner.mesh.nodal_compliance - self.problem.highest;
    }

    /// Replaces each pressure p by clamp(p + s, 0, ceiling), with the shift s between `low` and
    /// `high` for which their mean is `load`, and returns s.
    pub(super) fn raise_to(&mut self, load: f64, (mut low, mut high): (f64, f64)) -> f64 {
        let (cells, most) = (self.pressure.len() as f64, self.inner.ceiling());
        // The pressures that may become positive, in order; the others add nothing to the sum.
        let mut few: Option<Vec<f64>> = None;
        for _ in 0..BISECTIONS {
            let shift = 0.5 * (low + high);
            let all = few.as_deref().unwrap_or(&self.pressure);
            let (mut sum, mut raised) = (0.0, 0);
            for p in all {
                sum += (p + shift).max(0.0).min(most);
                raised += usize::from(p + shift > 0.0);
            }
            if sum > load * cells {
                high = shift;
                if raised < all.len() / COPY_RATIO {
                    let above = all.iter().filter(|p| **p + high > 0.0);
                    few = Some(above.copied().collect());
                }
            } else {
                low = shift;
            }
        }
        // At the upper end of the interval the sum is certainly positive.
        for p in &mut self.pressure {
            *p = (*p + high).max(0.0).min(most);
        }
        high
    }

    /// Sets the pressures to the convolution of the heights with the stiffness; takes one transform
    /// pair.
    ///
    /// If the stiffness is exact, this is the pressure of zero mean that flattens the surface.
    pub(super) fn fill_with_full_contact(&mut self) {
        let stiffness =
            elasticity::kernel(&self.inner.threads, &*self.problem.body, Factor::Stiffness);
        let transform =
            Transform::padded(self.inner.mesh.nodes, self.problem.body.stiffness_nodes());
        let mut scratch = transform.scratch_on(self.inner.threads.clone());
        scratch.take_over(&mut self.inner.scratch);
        scratch.take_over(&mut self.double_scratch);
        transform.convolve(&stiffness, &self.problem.heights, &mut self.pressure, &mut scratch);
        self.double_scratch.take_over(&mut scratch);
        self.inner.pairs += 1;
    }
}
