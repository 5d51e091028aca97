//! Stiffness of a solved contact: the derivative of the mean pressure with respect to the approach.
//!
//! To first order, a small approach dδ changes no node from contact to gap or back. It displaces
//! all nodes in elastic contact by dδ. Their pressures change by v dδ, where A v = 1 on these nodes
//! and v = 0 elsewhere; saturated nodes keep their pressure. The stiffness is the mean of v.
//!
//! When the bodies separate after that, saturated nodes unload elastically, too. The stiffness of
//! unloading is therefore that of all nodes in contact.
//!
//! Equivalently, the compliance 1/⟨v⟩ is the least energy ⟨w, A w⟩ of all pressures w on these
//! nodes with mean 1. It is found by conjugate gradients in double precision. They start from the
//! pressures of the contact, and use the preconditioner Eᵀ K E of the solver, in single precision.
//! The error of the compliance is of second order in the error of w. Therefore few iterations
//! suffice.

use super::{Settings, Solver, Stop, Watch};

/// Stiffness of a contact whose nodes in contact do not change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactStiffness {
    /// Derivative of the mean pressure with respect to the approach of the bodies, in units of E*
    /// over the longer side. It is infinite in full contact with a periodic body, and zero if no
    /// node moves elastically.
    ///
    /// The approach excludes the uniform compression of a layer.
    pub stiffness: f64,
    /// Number of pairs of transforms, in both precisions.
    pub pairs: u32,
    /// Reason why the iteration stopped.
    pub stop: Stop,
}

/// Largest relative change of the stiffness in the last iteration, as a fraction of the tolerance
/// of the contact. The error is a tenth of this change, or less.
const ACCURACY: f64 = 1e-2;

/// Least relative change of the stiffness by an iteration that is not rounding.
const ROUNDING: f64 = 1e-14;

impl Solver {
    /// Returns the stiffness of the contact under a pressure that solves it, with one pressure per
    /// node in units of E* × rms slope. Saturated nodes keep their pressure.
    ///
    /// It takes 7 to 12 pairs of transforms at the default tolerance.
    ///
    /// # Panics
    /// Panics if the number of pressures differs from the number of nodes.
    ///
    /// ```
    /// use asperity_mechanics::elasticity::FreeHalfSpace;
    /// use asperity_mechanics::grid::Grid;
    /// use asperity_mechanics::reduced::ReducedHeights;
    /// use asperity_mechanics::solver::{Settings, Solver};
    ///
    /// // A flat circular punch of radius a has dF/dδ = 2 E* a.
    /// let grid = Grid::square(64, 1.0)?;
    /// let from_centre = |index: usize| (index as f64 + 0.5) / 64.0 - 0.5;
    /// let radius = 0.25;
    /// let is_inside = |node: usize| {
    ///     let [x, y] = grid.indices(node).map(from_centre);
    ///     x.hypot(y) < radius
    /// };
    /// let pressure = |node| if is_inside(node) { 1.0 } else { 0.0 };
    /// let pressure: Vec<f64> = (0..grid.count()).map(pressure).collect();
    /// let flat = ReducedHeights::reduced(grid, vec![0.0; grid.count()])?;
    /// let mut solver = Solver::new(FreeHalfSpace::new(grid), &flat);
    /// let found = solver.contact_stiffness(&pressure, &Settings::default(), &|| false);
    /// assert!((found.stiffness / (2.0 * radius) - 1.0).abs() < 0.02);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn contact_stiffness(
        &mut self,
        pressure: &[f64],
        settings: &Settings,
        watch: &dyn Watch,
    ) -> ContactStiffness {
        let hardness = self.problem.hardness.map_or(f64::INFINITY, |bound| bound.pressure());
        self.frozen_stiffness(pressure, hardness, settings, watch)
    }

    /// Returns the stiffness of the contact at the beginning of an elastic unloading, from a
    /// pressure as in [`Solver::contact_stiffness`]. All nodes in contact are displaced together,
    /// also the saturated ones. It equals the stiffness of loading if no node is saturated.
    ///
    /// # Panics
    /// Panics if the number of pressures differs from the number of nodes.
    pub fn unloading_stiffness(
        &mut self,
        pressure: &[f64],
        settings: &Settings,
        watch: &dyn Watch,
    ) -> ContactStiffness {
        self.frozen_stiffness(pressure, f64::INFINITY, settings, watch)
    }

    /// Returns the stiffness of the nodes in contact whose pressure is below `bound`.
    fn frozen_stiffness(
        &mut self,
        pressure: &[f64],
        bound: f64,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> ContactStiffness {
        assert_eq!(pressure.len(), self.pressure.len(), "one pressure per node");
        let is_elastic = |pressure: f64| pressure > 0.0 && pressure < bound;
        let elastic = pressure.iter().enumerate().filter(|(_, pressure)| is_elastic(**pressure));
        let (nodes, start): (Vec<usize>, Vec<f64>) = elastic.unzip();
        let known = |stiffness, stop| ContactStiffness { stiffness, pairs: 0, stop };
        if nodes.is_empty() {
            return known(0.0, Stop::Converged);
        }
        if nodes.len() == pressure.len() && self.problem.body.is_periodic() {
            return known(f64::INFINITY, Stop::FullContact);
        }
        self.inner.mark_free(&nodes);
        FrozenContact { solver: self, nodes, pairs: 0 }.stiffness(start, settings, watch)
    }
}

/// Contact whose nodes do not change: the nodes that move elastically are free, and the pressures
/// of all others are constant.
///
/// Vectors have one value for each elastic node.
struct FrozenContact<'a> {
    solver: &'a mut Solver,
    nodes: Vec<usize>,
    pairs: u32,
}

impl FrozenContact<'_> {
    /// Minimises the energy ⟨w, A w⟩ over pressures w with mean 1 over the map, from `w` times a
    /// number.
    fn stiffness(
        mut self,
        mut w: Vec<f64>,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> ContactStiffness {
        let cells = self.solver.pressure.len() as f64;
        let scale = cells / w.iter().sum::<f64>();
        w.iter_mut().for_each(|w| *w *= scale);
        let accuracy = (ACCURACY * settings.tolerance).max(ROUNDING);
        let mut sunk = self.displacement(&w);
        let mut residual = without_mean(&sunk);
        let mut direction = vec![0.0; w.len()];
        // The product ⟨r, z⟩ of the iteration before, with its residual.
        let mut before: Option<(f64, Vec<f64>)> = None;
        let stop = loop {
            if self.pairs >= settings.pair_limit {
                break Stop::PairLimit;
            }
            if watch.is_interrupted() {
                break Stop::Interrupted;
            }
            let z = without_mean(&self.correction(&residual));
            let product = dot(&residual, &z);
            // The correction is computed in single precision, so that directions are conjugate only
            // with this form of β.
            let beta = before.map_or(0.0, |(product_before, residual_before)| {
                ((product - dot(&residual_before, &z)) / product_before).max(0.0)
            });
            for (direction, z) in direction.iter_mut().zip(&z) {
                *direction = beta * *direction - z;
            }
            let image = self.displacement(&direction);
            let (slope, curvature) = (dot(&direction, &residual), dot(&direction, &image));
            if !(slope < 0.0 && curvature > 0.0) {
                break Stop::Converged;
            }
            let step = -slope / curvature;
            add(&mut w, step, &direction);
            add(&mut sunk, step, &image);
            let decrease = slope * slope / curvature;
            before = Some((product, residual));
            residual = without_mean(&sunk);
            if decrease <= accuracy * dot(&w, &sunk) {
                break Stop::Converged;
            }
        };
        ContactStiffness { stiffness: cells / dot(&w, &sunk), pairs: self.pairs, stop }
    }

    /// Returns the displacement A w of the elastic nodes, in double precision.
    fn displacement(&mut self, w: &[f64]) -> Vec<f64> {
        let Self { solver, nodes, pairs } = self;
        let mut map = vec![0.0; solver.pressure.len()];
        for (node, w) in nodes.iter().zip(w) {
            map[*node] = *w;
        }
        solver.double_scratch.take_over(&mut solver.inner.scratch);
        let sunk = solver.displacement_under(&map);
        *pairs += 1;
        nodes.iter().map(|node| sunk[*node]).collect()
    }

    /// Returns the corrections z = Eᵀ K E r of the elastic nodes, in single precision.
    fn correction(&mut self, residual: &[f64]) -> Vec<f64> {
        self.solver.inner.scratch.take_over(&mut self.solver.double_scratch);
        let (corrections, pairs) = self.solver.inner.corrections_of(&self.nodes, residual);
        self.pairs += pairs;
        corrections
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds `factor` × `b` to `a`.
fn add(a: &mut [f64], factor: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}

fn without_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}
