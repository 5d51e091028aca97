//! Expected costs of surfaces with all that a study computes from them.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::TASK;
use asperity_stages::Kind;
use asperity_stages::ensemble::Ensemble;
use asperity_tables::table::{Table, TableError};

/// Tasks that make the surfaces of an ensemble.
pub(crate) type Surfaces = BTreeSet<usize>;

/// Tasks of a plan, grouped by the surface that they depend on.
pub(crate) struct Costs<'a> {
    plan: &'a Plan,
    model: CostModel,
    by_surface: BTreeMap<usize, Vec<usize>>,
    /// Surface on which the task with a key in published tables depends.
    surfaces: HashMap<String, usize>,
}

impl<'a> Costs<'a> {
    pub(crate) fn new(plan: &'a Plan) -> Costs<'a> {
        let mut surface_of: Vec<Option<usize>> = Vec::with_capacity(plan.tasks.len());
        let mut by_surface: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut surfaces = HashMap::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            let surface = match task.recipe.kind() {
                Kind::Generate => Some(index),
                Kind::Solve | Kind::Measure | Kind::Correct if task.inputs.len() == 1 => {
                    surface_of[task.inputs[0]]
                }
                _ => None,
            };
            if let Some(surface) = surface {
                by_surface.entry(surface).or_default().push(index);
                surfaces.insert(task.table.key.to_string(), surface);
            }
            surface_of.push(surface);
        }
        Costs { plan, model: CostModel::default(), by_surface, surfaces }
    }

    /// Returns the surfaces of an ensemble of rows of a published table.
    pub(crate) fn surfaces_of(
        &self,
        table: &Table,
        ensemble: &Ensemble,
    ) -> Result<Surfaces, TableError> {
        let keys = table.texts(TASK.name)?;
        let known = ensemble.states().filter_map(|(_, _, row)| self.surfaces.get(keys.value(row)));
        Ok(known.copied().collect())
    }

    /// Returns the mean of the expected core-seconds of surfaces with `factor` times the nodes per
    /// side.
    pub(crate) fn per_surface(&self, surfaces: &Surfaces, factor: f64) -> f64 {
        let tasks = surfaces.iter().flat_map(|surface| &self.by_surface[surface]);
        let seconds = tasks.map(|&task| {
            let task = &self.plan.tasks[task];
            self.model.seconds_on(task, task.nodes.map(|nodes| (nodes as f64 * factor) as usize))
        });
        seconds.sum::<f64>() / surfaces.len().max(1) as f64
    }
}
