//! State of a search in single precision on one mesh.
//!
//! A search does not depend on earlier loads or on double precision. A [`Solver`](super::Solver)
//! provides its start and evaluates its result.

use super::Hardness;
use super::balance::Nodes;
use super::extension::Extension;
use super::flags::ActiveGroups;
use super::half_space::Stiffness;
use super::line_search::Steps;
use super::passes::{ReferencePressure, Sample};
use super::two_level::TwoLevel;
use crate::elasticity;
use crate::elasticity::ElasticOperator;
use crate::fft::{Kernel, Scratch, Transform};
use crate::threads::Threads;

pub struct Search {
    pub nodes: [usize; 2],
    /// Number of smaller mesh steps in the longer side.
    pub steps_per_side: f64,
    pub heights: Vec<f32>,
    /// Level that is subtracted from heights.
    pub height_reference: f64,
    pub load: f64,
    /// The hardness, while pressures are kept below it.
    pub bound: Option<Hardness>,
    pub steps: Steps,
    /// Step lengths of iterations that started from a coarser mesh.
    pub nested_steps: Steps,

    pub gap: Vec<f32>,
    /// Level that is subtracted from gaps.
    pub reference: f64,
    /// Level from which the residual is measured, minus `reference`.
    pub level: f64,
    /// Part of the pressure that does not change during the search.
    pub reference_pressure: ReferencePressure,
    /// Difference of pressure and reference pressure.
    pub pressure_increment: Vec<f32>,
    /// Last move of free nodes, with flags in the lowest bits (`flags`).
    pub last_step: Vec<f32>,
    pub active: ActiveGroups,
    pub sample: Sample,
    pub free_nodes: f64,
    pub extension: Extension,
    pub two_level: TwoLevel,
    /// True if the two-level preconditioner computes the present corrections.
    pub is_by_blocks: bool,
    /// Nodes whose pressure may change and their last moves, if the material yields.
    pub candidates: Nodes,
    pub last_moves: Vec<f32>,

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

impl Search {
    /// Prepares a search on the mesh of a body, with one height for each node.
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
            steps: Steps::default(),
            nested_steps: Steps::default(),
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
            candidates: Nodes::default(),
            last_moves: Vec::new(),
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

    /// Returns the step lengths for iterations that started from a coarser mesh, or for all others.
    pub fn steps(&self, is_nested: bool) -> &Steps {
        if is_nested { &self.nested_steps } else { &self.steps }
    }

    pub fn steps_mut(&mut self, is_nested: bool) -> &mut Steps {
        if is_nested { &mut self.nested_steps } else { &mut self.steps }
    }

    pub fn cells(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Returns the highest allowed pressure.
    pub fn ceiling(&self) -> f64 {
        self.bound.map_or(f64::INFINITY, Hardness::pressure)
    }

    /// Converts an error of the gap to mesh steps of a surface of unit rms slope.
    pub fn residual(&self, error: f64) -> f64 {
        self.steps_per_side * error
    }
}
