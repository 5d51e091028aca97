//! State of the iterations in single precision on one mesh.
//!
//! The inner solver does not depend on earlier loads or on double precision. A
//! [`Solver`](super::Solver) provides its initial pressures and gaps and evaluates its result.

use super::Hardness;
use super::balance::Candidates;
use super::extension::Extension;
use super::flags::ActiveGroups;
use super::half_space::Stiffness;
use super::line_search::StepLengths;
use super::passes::{ReferencePressure, Sample};
use super::two_level::TwoLevel;
use crate::elasticity;
use crate::elasticity::ElasticOperator;
use crate::fft::{Kernel, Scratch, Transform};
use crate::threads::Threads;

pub struct InnerSolver {
    pub nodes: [usize; 2],
    /// Ratio of the longer side of the cell to the smaller mesh step.
    pub steps_per_side: f64,
    pub heights: Vec<f32>,
    /// Height that is subtracted from heights before they are rounded to single precision.
    pub height_reference: f64,
    pub load: f64,
    /// Upper bound of the pressures; `None` while they are not bounded.
    pub bound: Option<Hardness>,
    pub step_lengths: StepLengths,
    /// Step lengths of iterations that start from a coarser mesh.
    pub nested_step_lengths: StepLengths,

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
    pub two_level: TwoLevel,
    /// True if the present corrections were computed with the two-level preconditioner.
    pub is_by_blocks: bool,
    /// Nodes whose pressure may change, collected if the material yields. `candidate_steps` holds
    /// their last steps.
    pub candidates: Candidates,
    pub candidate_steps: Vec<f32>,

    pub transform: Transform<f32>,
    pub scratch: Scratch<f32>,
    pub displacement: Kernel<f32>,
    pub stiffness: Stiffness,
    pub nodal_stiffness: f64,
    pub nodal_compliance: f64,

    /// Transform pairs used for the present load.
    pub pairs: u32,

    pub threads: Threads,
}

impl InnerSolver {
    /// Prepares iterations on the mesh of a body, with one height for each node.
    pub fn new(threads: &Threads, body: &dyn ElasticOperator, heights: Vec<f32>) -> Self {
        let (nodes, cells) = (body.grid().nodes(), body.grid().count());
        let extension = Extension::new(nodes, body.stiffness_nodes());
        let nodal_stiffness = body.nodal_stiffness(threads);
        let two_level = TwoLevel::new(threads, body, nodal_stiffness, extension.blocks());
        let transform = elasticity::transform(body);
        Self {
            nodes,
            steps_per_side: body.grid().smaller_steps(),
            heights,
            height_reference: 0.0,
            load: 0.0,
            bound: None,
            step_lengths: StepLengths::default(),
            nested_step_lengths: StepLengths::default(),
            gap: vec![0.0; cells],
            reference: 0.0,
            level: 0.0,
            reference_pressure: ReferencePressure::new(nodes),
            pressure_increment: vec![0.0; cells],
            last_step: vec![0.0; cells],
            active: ActiveGroups::new(nodes),
            sample: Sample::new(nodes),
            free_nodes: 0.0,
            extension,
            two_level,
            is_by_blocks: false,
            candidates: Candidates::default(),
            candidate_steps: Vec::new(),
            displacement: elasticity::displacement_on(threads, body),
            scratch: transform.scratch_on(threads.clone()),
            transform,
            stiffness: Stiffness::new(threads, body),
            nodal_stiffness,
            nodal_compliance: body.nodal_compliance(threads),
            pairs: 0,
            threads: threads.clone(),
        }
    }

    pub fn set_threads(&mut self, threads: Threads) {
        self.scratch.set_threads(threads.clone());
        self.stiffness.set_threads(&threads);
        self.two_level.set_threads(&threads);
        self.threads = threads;
    }

    /// Returns the step lengths for iterations that start from a coarser mesh if `is_nested`,
    /// otherwise the step lengths for all other iterations.
    pub fn step_lengths(&self, is_nested: bool) -> &StepLengths {
        if is_nested { &self.nested_step_lengths } else { &self.step_lengths }
    }

    pub fn step_lengths_mut(&mut self, is_nested: bool) -> &mut StepLengths {
        if is_nested { &mut self.nested_step_lengths } else { &mut self.step_lengths }
    }

    pub fn cells(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Returns the upper bound of the pressures, or infinity if there is none.
    pub fn ceiling(&self) -> f64 {
        self.bound.map_or(f64::INFINITY, Hardness::pressure)
    }

    /// Converts an error of the gap to the unit of residuals, the smaller mesh step at unit rms
    /// slope.
    pub fn residual(&self, error: f64) -> f64 {
        self.steps_per_side * error
    }
}
