//! A search in single precision on one mesh: gap, pressure and all that iterations last_step along.
//!
//! It knows nothing of the loads before, nor of double precision: a [`Solver`](super::Solver) tells
//! it where to begin, and evaluates where it led.

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

/// Everything that an iteration reads and writes.
pub struct Search {
    pub nodes: [usize; 2],
    /// Mesh steps, the smaller ones, in the longer side.
    pub steps_per_side: f64,
    /// Heights less their reference.
    pub heights: Vec<f32>,
    pub height_reference: f64,
    /// Mean pressure that is searched for.
    pub load: f64,
    /// The hardness, for as long as pressures are kept below it.
    pub bound: Option<Hardness>,
    pub steps: Steps,
    /// Those of iterations that began where a coarser mesh led.
    pub nested_steps: Steps,

    /// Gap less the gap reference.
    pub gap: Vec<f32>,
    pub reference: f64,
    /// From which gaps ask for a correction, less the reference.
    pub level: f64,
    /// Pressures are counted from here,
    pub reference_pressure: ReferencePressure,
    /// and are higher by this.
    pub pressure_increment: Vec<f32>,
    /// The last move of free nodes. Marked, see `flags`.
    pub last_step: Vec<f32>,
    pub active: ActiveGroups,
    pub sample: Sample,
    pub free_nodes: f64,
    pub extension: Extension,
    pub two_level: TwoLevel,
    /// Whether it makes the corrections of the present iteration.
    pub is_by_blocks: bool,
    /// Nodes that ask for a change, and their last moves, where the material yields.
    pub candidates: Nodes,
    pub last_moves: Vec<f32>,

    pub transform: Transform<f32>,
    pub scratch: Scratch<f32>,
    pub displacement: Kernel<f32>,
    pub stiffness: Stiffness,
    pub nodal_stiffness: f64,
    pub nodal_compliance: f64,

    /// Transform pairs spent on the present load.
    pub pairs: u32,

    pub threads: Threads,
}

impl Search {
    /// Gets ready to search on the mesh of a body, given heights, one for each node.
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

    /// Lets these threads share the work from now on.
    pub fn set_threads(&mut self, threads: Threads) {
        self.scratch.set_threads(threads.clone());
        self.stiffness.set_threads(&threads);
        self.two_level.set_threads(&threads);
        self.threads = threads;
    }

    /// The steps of iterations that began where a coarser mesh led, or anywhere else.
    pub fn steps(&self, is_nested: bool) -> &Steps {
        if is_nested { &self.nested_steps } else { &self.steps }
    }

    pub fn steps_mut(&mut self, is_nested: bool) -> &mut Steps {
        if is_nested { &mut self.nested_steps } else { &mut self.steps }
    }

    pub fn cells(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// The highest pressure that may be used.
    pub fn ceiling(&self) -> f64 {
        self.bound.map_or(f64::INFINITY, Hardness::pressure)
    }

    /// An error of the gap in mesh steps of a surface of unit rms slope.
    pub fn residual(&self, error: f64) -> f64 {
        self.steps_per_side * error
    }
}
