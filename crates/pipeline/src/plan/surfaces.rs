//! Which tasks hang on one surface alone.

use super::{Kind, Plan, Task};
use asperity_tables::store::key::TaskKey;

impl Plan {
    /// For every task, the surface that everything it reads is of, by the identity of the task that
    /// draws it: the same whether its heights are kept or drawn again. None for tasks about several
    /// surfaces, and for fits and aggregates, which may read more of them tomorrow.
    pub fn surfaces(&self) -> Vec<Option<TaskKey>> {
        let mut surfaces: Vec<Option<TaskKey>> = Vec::with_capacity(self.tasks.len());
        // Inputs come before the tasks that read them.
        for task in &self.tasks {
            let surface = match task.recipe.kind() {
                Kind::Generate => Some(task.identity),
                Kind::Fit | Kind::Aggregate => None,
                Kind::Solve | Kind::Measure | Kind::Correct => common(task, &surfaces),
            };
            surfaces.push(surface);
        }
        surfaces
    }
}

fn common(task: &Task, surfaces: &[Option<TaskKey>]) -> Option<TaskKey> {
    let mut read = task.inputs.iter().map(|&input| surfaces[input]);
    let first = read.next()??;
    read.all(|surface| surface == Some(first)).then_some(first)
}
