//! Data of one mesh that no load changes.

use super::blocks::{Extension, TwoLevel};
use crate::elasticity::{self, ElasticOperator, Factor};
use crate::fft::{Kernel, Transform};
use crate::threads::Threads;

/// Data of one mesh that no load changes; solvers of the same surface share them.
pub struct Mesh {
    pub nodes: [usize; 2],
    /// Ratio of the longer side of the cell to the smaller mesh step.
    pub steps_per_side: f64,
    /// Heights minus the highest, [`Mesh::highest`]. Rounding errors are smallest in contact.
    pub heights: Vec<f32>,
    pub highest: f64,
    pub transform: Transform<f32>,
    pub displacement: Kernel<f32>,
    pub stiffness: Stiffness,
    pub two_level: TwoLevel,
    /// Displacements of waves relative to a half-space, at wavelengths of twice the sides of the
    /// blocks of the extension.
    pub relative_displacements: Vec<f64>,
    pub nodal_stiffness: f64,
    pub nodal_compliance: f64,
}

impl Mesh {
    /// Returns whether displacements are convolved on a larger mesh, as with free boundaries.
    pub fn has_margin(&self) -> bool {
        self.stiffness.larger.is_some()
    }

    pub fn cells(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Prepares the mesh of a body, with one height for each node.
    pub fn from_heights(threads: &Threads, body: &dyn ElasticOperator, heights: &[f64]) -> Self {
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let single = heights.iter().map(|height| (height - highest) as f32);
        Self::new(threads, body, single.collect(), highest)
    }

    /// Prepares the mesh of a body. `heights` has one height for each node, from which the highest
    /// height, `highest`, is already subtracted.
    pub fn new(
        threads: &Threads,
        body: &dyn ElasticOperator,
        heights: Vec<f32>,
        highest: f64,
    ) -> Self {
        let nodes = body.grid().nodes();
        let blocks = Extension::blocks_of(body.stiffness_nodes());
        let nodal_stiffness = body.nodal(Factor::Stiffness, threads);
        Self {
            nodes,
            steps_per_side: body.grid().smaller_steps(),
            heights,
            highest,
            transform: elasticity::transform(body),
            displacement: elasticity::kernel(threads, body, Factor::Displacement),
            stiffness: Stiffness::new(threads, body),
            two_level: TwoLevel::new(threads, body, nodal_stiffness, blocks),
            relative_displacements: Extension::relative_displacements(body),
            nodal_stiffness,
            nodal_compliance: body.nodal(Factor::Displacement, threads),
        }
    }
}

/// Kernel of the stiffness K, which turns displacements into pressures.
pub struct Stiffness {
    pub kernel: Kernel<f32>,
    /// Transform of a mesh that is larger than the map. Without it, displacements are convolved on
    /// the mesh of the pressures.
    pub larger: Option<Transform<f32>>,
}

impl Stiffness {
    pub fn new(threads: &Threads, body: &dyn ElasticOperator) -> Self {
        let nodes = body.stiffness_nodes();
        let is_larger = nodes != body.grid().nodes();
        Self {
            kernel: elasticity::kernel(threads, body, Factor::Preconditioner),
            larger: is_larger.then(|| Transform::new(nodes)),
        }
    }
}
