//! State of the iterations in single precision on one mesh.
//!
//! The inner solver does not depend on earlier loads or on double precision. A
//! [`Solver`](super::Solver) provides its initial pressures and gaps and evaluates its result.

use std::sync::Arc;

use super::Hardness;
use super::balance::Candidates;
use super::extension::Extension;
use super::flags::ActiveGroups;
use super::half_space::{Buffers, Stiffness};
use super::passes::{ReferencePressure, Sample};
use super::two_level::{BlockBuffers, TwoLevel};
use crate::elasticity;
use crate::elasticity::ElasticOperator;
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
    /// Numbers of nodes of the mesh of the stiffness, of which the map is a corner.
    pub stiffness_nodes: [usize; 2],
    pub two_level: TwoLevel,
    pub nodal_stiffness: f64,
    pub nodal_compliance: f64,
}

pub struct InnerSolver {
    pub mesh: Arc<Mesh>,
    pub load: f64,
    /// Upper bound of the pressures; `None` while they are not bounded.
    pub bound: Option<Hardness>,

    pub gap: Vec<f32>,
    /// Number that is subtracted from gaps before they are rounded to single precision.
    pub reference: f64,
    /// Offset from which the present residual is measured: residual = `gap` − `level`.
    pub level: f64,
    /// Part of the pressure that does not change during the iterations.
    pub reference_pressure: ReferencePressure,
    /// Difference of pressure and reference pressure.
    pub pressure_increment: Vec<f32>,
    /// Last step of the pressure of each node, zero at nodes that are not free. Its lowest bits
    /// hold the flags of the node (`flags`).
    pub last_step: Vec<f32>,
    pub active: ActiveGroups,
    pub sample: Sample,
    pub free_nodes: f64,
    pub extension: Extension,
    /// True if the present corrections were computed with the two-level preconditioner.
    pub is_by_blocks: bool,
    /// Nodes whose pressure may change, collected if the material yields. `candidate_steps` holds
    /// their last steps.
    pub candidates: Candidates,
    pub candidate_steps: Vec<f32>,

    pub buffers: Buffers,
    pub block_buffers: BlockBuffers,

    /// Transform pairs used for the present load.
    pub pairs: u32,

    pub threads: Threads,
}

impl Mesh {
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
        let nodal_stiffness = body.nodal_stiffness(threads);
        Self {
            nodes,
            steps_per_side: body.grid().smaller_steps(),
            heights,
            highest,
            transform: elasticity::transform(body),
            displacement: elasticity::displacement_on(threads, body),
            stiffness: Stiffness::new(threads, body),
            stiffness_nodes: body.stiffness_nodes(),
            two_level: TwoLevel::new(threads, body, nodal_stiffness, blocks),
            nodal_stiffness,
            nodal_compliance: body.nodal_compliance(threads),
        }
    }
}

impl InnerSolver {
    pub fn new(threads: &Threads, mesh: Arc<Mesh>) -> Self {
        let (nodes, cells) = (mesh.nodes, mesh.nodes[0] * mesh.nodes[1]);
        Self {
            load: 0.0,
            bound: None,
            gap: vec![0.0; cells],
            reference: 0.0,
            level: 0.0,
            reference_pressure: ReferencePressure::new(nodes),
            pressure_increment: vec![0.0; cells],
            last_step: vec![0.0; cells],
            active: ActiveGroups::new(nodes),
            sample: Sample::new(nodes),
            free_nodes: 0.0,
            extension: Extension::new(nodes, mesh.stiffness_nodes),
            is_by_blocks: false,
            candidates: Candidates::default(),
            candidate_steps: Vec::new(),
            buffers: mesh.stiffness.buffers(threads, &mesh.transform),
            block_buffers: mesh.two_level.buffers(threads),
            pairs: 0,
            threads: threads.clone(),
            mesh,
        }
    }

    pub fn set_threads(&mut self, threads: Threads) {
        self.buffers.set_threads(&threads);
        self.block_buffers.set_threads(&threads);
        self.threads = threads;
    }

    pub fn cells(&self) -> usize {
        self.mesh.nodes[0] * self.mesh.nodes[1]
    }

    /// Returns the upper bound of the pressures, or infinity if there is none.
    pub fn ceiling(&self) -> f64 {
        self.bound.map_or(f64::INFINITY, Hardness::pressure)
    }

    /// Converts an error of the gap to the unit of residuals, the smaller mesh step at unit rms
    /// slope.
    pub fn residual(&self, error: f64) -> f64 {
        self.mesh.steps_per_side * error
    }
}
