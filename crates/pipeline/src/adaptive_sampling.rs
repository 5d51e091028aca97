//! Adaptive sampling, which adds surfaces to a study until its means are precise or its claims are
//! decided.
//!
//! Only tables decide the number of surfaces. It does not depend on the machines, on the order of
//! tasks or on interruptions.
//!
//! A stage starts with `at_least` surfaces, a key of the manifest. Its condition is evaluated when
//! all tables that the condition depends on exist. If the condition does not hold, the stage gets
//! as many surfaces as the scatter so far requires, but at most twice the present number. All
//! parameter points of a stage have the same number of surfaces, so that spectra are compared on
//! the same random draws.
//!
//! If the condition is on a multilevel mean, each mesh of the stage has its own number: the one
//! that gives all means their precision with the least computing, from the variances of the present
//! surfaces and from the counted nodes × pairs of transforms (`levels`).
//!
//! Claims depend on several stages. They are evaluated only after all conditions on means have been
//! settled, and then for all stages with such conditions together.

mod conditions;
mod levels;

use std::fmt;
use std::sync::Arc;

use crate::plan::Plan;
use crate::study::{Growth, Study, Until, Work, multilevel};
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_tables::store::{StoreError, TaskTables};

pub use conditions::{
    ClaimRule, Condition, Decisions, Finding, SamplingError, Undecided, least_step, looks,
};

/// A study with the number of surfaces that the existing tables require.
#[derive(Debug)]
pub struct SampledStudy {
    pub study: Study,
    pub plan: Plan,
    /// Stages with adaptive sampling, in the order of the plan.
    pub stages: Vec<AdaptiveStage>,
}

/// A stage that adds surfaces until a condition holds.
#[derive(Debug)]
pub struct AdaptiveStage {
    pub name: String,
    /// Number of surfaces at each parameter point; if meshes have different numbers, the largest.
    pub surfaces: u32,
    /// Number of surfaces on each mesh, from the coarsest, if the condition is on a multilevel
    /// mean; otherwise empty.
    pub meshes: Vec<MeshSurfaces>,
    /// Bounds on the number of surfaces, and the condition that must hold.
    pub growth: Arc<Growth>,
    /// Result of evaluating the condition of `growth` at the present number of surfaces.
    pub condition: Condition,
    position: usize,
}

/// Number of surfaces of a stage on one mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSurfaces {
    /// Numbers of nodes along x and y.
    pub nodes: [usize; 2],
    /// Number of surfaces at each parameter point with this mesh.
    pub surfaces: u32,
}

impl SampledStudy {
    /// Adds surfaces to a study until all conditions are settled or tables are missing.
    ///
    /// # Errors
    /// Returns an error if a table cannot be read or lacks the column that a condition uses.
    pub fn from_tables(
        mut study: Study,
        tables: &impl TaskTables,
        rule: &dyn ClaimRule,
    ) -> Result<SampledStudy, SamplingError> {
        loop {
            let plan = Plan::new(&study);
            let stages = evaluate_stages(&study, &plan, tables, rule)?;
            let more: Vec<_> = stages.iter().filter_map(AdaptiveStage::next_size).collect();
            if more.is_empty() {
                return Ok(SampledStudy { study, plan, stages });
            }
            for (stage, next) in more {
                next.set(&mut study.stages[stage].work);
            }
        }
    }

    /// Returns the tasks whose tables are needed to evaluate open conditions, in ascending order.
    /// The list is empty when all conditions have been evaluated.
    pub fn deciding_tasks(&self) -> Vec<usize> {
        let open = self.stages.iter().filter_map(|stage| match &stage.condition {
            Condition::Open { tasks, .. } => Some(tasks.as_slice()),
            Condition::Holds(_) | Condition::Fails(_) => None,
        });
        let mut tasks = open.collect::<Vec<_>>().concat();
        tasks.sort_unstable();
        tasks.dedup();
        tasks
    }

    /// Takes the read errors of damaged tables out of the open conditions. Returns each error with
    /// the index of its task.
    pub fn take_damaged(&mut self) -> Vec<(usize, StoreError)> {
        let damaged = self.stages.iter_mut().filter_map(|stage| match &mut stage.condition {
            Condition::Open { damaged, .. } => Some(std::mem::take(damaged)),
            Condition::Holds(_) | Condition::Fails(_) => None,
        });
        damaged.flatten().collect()
    }
}

impl AdaptiveStage {
    /// Returns whether the condition holds, or `None` while tables are missing.
    pub fn holds(&self) -> Option<bool> {
        match self.condition {
            Condition::Open { .. } => None,
            Condition::Holds(_) => Some(true),
            Condition::Fails(_) => Some(false),
        }
    }

    /// Returns the names of the claims that are not decided yet. Returns `None` while tables are
    /// missing. Also returns `None` if the condition is about a mean.
    pub fn undecided(&self) -> Option<Vec<&str>> {
        match &self.condition {
            Condition::Holds(Finding::Claims(found)) | Condition::Fails(Finding::Claims(found)) => {
                Some(found.undecided.iter().map(|claim| claim.name.as_str()).collect())
            }
            _ => None,
        }
    }

    /// Returns the index of the stage in the study and its next number of surfaces. Returns `None`
    /// if the stage needs no more surfaces, or while tables are missing.
    fn next_size(&self) -> Option<(usize, NextSize)> {
        let Condition::Fails(finding) = &self.condition else {
            return None;
        };
        let Growth { at_most, .. } = *self.growth;
        let next = match finding {
            Finding::Levels { best, .. } => {
                let next = levels::next_numbers(&self.meshes, best, at_most);
                (next != self.meshes).then_some(NextSize::OnMeshes(next))
            }
            _ if self.surfaces >= at_most => None,
            Finding::Claims(found) => Some(NextSize::OnAll(conditions::surfaces_for_claims(
                self.surfaces,
                found,
                at_most,
            ))),
            Finding::Error(error) => {
                let wanted = conditions::surfaces_for_mean(self.surfaces, *error);
                Some(NextSize::OnAll(wanted.min(at_most)))
            }
        };
        Some((self.position, next?))
    }

    /// Returns whether the condition has been evaluated and the stage needs no more surfaces.
    fn is_settled(&self) -> bool {
        self.condition.is_known() && self.next_size().is_none()
    }
}

/// The next number of surfaces of a stage.
enum NextSize {
    /// The same number on all meshes.
    OnAll(u32),
    OnMeshes(Vec<MeshSurfaces>),
}

impl NextSize {
    /// Sets the number of surfaces at all parameter points of a `generate` stage.
    fn set(&self, work: &mut Work) {
        let Work::Generate(ensembles) = work else { return };
        for ensemble in ensembles {
            let nodes = ensemble.params.nodes();
            let next = match self {
                NextSize::OnAll(surfaces) => Some(*surfaces),
                NextSize::OnMeshes(meshes) => {
                    meshes.iter().find(|mesh| mesh.nodes == nodes).map(|mesh| mesh.surfaces)
                }
            };
            if let Some(surfaces) = next {
                *ensemble = ensemble.with_surfaces(surfaces);
            }
        }
    }
}

impl fmt::Display for AdaptiveStage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let AdaptiveStage { name, surfaces, growth, meshes, .. } = self;
        let Growth { at_most, until, .. } = growth.as_ref();
        if meshes.is_empty() {
            write!(formatter, "{name}: {surfaces} surfaces per point")?;
        } else {
            let number =
                |mesh: &MeshSurfaces| format!("{} on {}", mesh.surfaces, named(mesh.nodes));
            let numbers: Vec<String> = meshes.iter().map(number).collect();
            write!(formatter, "{name}: surfaces per point {}", numbers.join(", "))?;
        }
        let (finding, maximum) = match &self.condition {
            Condition::Open { .. } => {
                return write!(formatter, " so far, at most {at_most}, until {until}");
            }
            Condition::Holds(finding) => (finding, ""),
            Condition::Fails(finding) => (finding, " (the maximum)"),
        };
        match (finding, until) {
            (Finding::Error(error) | Finding::Levels { error, .. }, Until::Mean(mean)) => {
                let bound = mean.limit * *error;
                if maximum.is_empty() {
                    write!(formatter, ", {until} holds at {bound}")
                } else if error.is_infinite() {
                    let reason = "cannot be checked: a mean is of a single surface";
                    write!(formatter, "{maximum}; {until} {reason}")
                } else {
                    write!(formatter, "{maximum}; {until} does not hold: it is {bound}")
                }
            }
            _ => write!(formatter, "{maximum}: {}", ClaimSummary(finding)),
        }
    }
}

/// Formats the numbers of nodes of a mesh.
fn named([x, y]: [usize; 2]) -> String {
    if x == y { format!("{x}²") } else { format!("{x} × {y}") }
}

/// Maximum number of claims that are listed by name if the study lacks a quantity that they use.
const MAX_LISTED: usize = 3;

/// Display of [`Finding::Claims`]: one line that counts the decided claims and names the others.
struct ClaimSummary<'a>(&'a Finding);

impl fmt::Display for ClaimSummary<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Finding::Claims(Decisions { decided, undecided, not_judged }) = self.0 else {
            return Ok(());
        };
        match decided.len() + undecided.len() {
            0 => formatter.write_str("no claim to decide")?,
            judged => write!(formatter, "{} of {judged} claims decided", decided.len())?,
        }
        let (decidable, undecidable): (Vec<&Undecided>, Vec<&Undecided>) =
            undecided.iter().partition(|claim| claim.surfaces.is_some());
        let names = |claims: &[&Undecided]| {
            let names = claims.iter().map(|claim| format!("`{}`", claim.name));
            names.collect::<Vec<_>>().join(", ")
        };
        if !decidable.is_empty() {
            write!(formatter, "; more surfaces would decide {}", names(&decidable))?;
        }
        if !undecidable.is_empty() {
            write!(formatter, "; no number of surfaces would decide {}", names(&undecidable))?;
        }
        if not_judged.len() > MAX_LISTED {
            return write!(
                formatter,
                "; {} claims cannot be evaluated in this study",
                not_judged.len()
            );
        }
        let mut others = not_judged.iter();
        others.try_for_each(|(name, needs)| write!(formatter, "; `{name}` needs {needs}"))
    }
}

fn evaluate_stages(
    study: &Study,
    plan: &Plan,
    tables: &impl TaskTables,
    rule: &dyn ClaimRule,
) -> Result<Vec<AdaptiveStage>, SamplingError> {
    let mut stages = Vec::new();
    for (position, stage) in study.stages.iter().enumerate() {
        let ensembles = stage.work.surfaces();
        let Some(growth) = ensembles.first().and_then(|first| first.growth.clone()) else {
            continue;
        };
        let observed = match &growth.until {
            Until::Mean(mean) => study.stages.iter().find(|stage| stage.name == mean.stage),
            Until::Claims(_) => None,
        };
        let is_multilevel = observed.is_some_and(|stage| multilevel::is_multilevel(&stage.work));
        stages.push(AdaptiveStage {
            name: stage.name.clone(),
            surfaces: ensembles.iter().map(PlannedSurfaces::surfaces).max().unwrap_or(0),
            meshes: if is_multilevel { levels::meshes(ensembles) } else { Vec::new() },
            condition: match &growth.until {
                Until::Mean(mean) => {
                    let stored = conditions::in_stored_unit(study, mean);
                    match is_multilevel {
                        true => levels::evaluate(plan, position, &stored, tables)?,
                        false => conditions::evaluate_mean(plan, position, &stored, tables)?,
                    }
                }
                Until::Claims(_) => Condition::open(conditions::claim_tasks(study, plan)),
            },
            growth,
            position,
        });
    }
    // If claims were evaluated while another stage grows, the result would depend on the order of
    // tasks.
    let is_of_claims = |stage: &AdaptiveStage| matches!(stage.growth.until, Until::Claims(_));
    let means = stages.iter().filter(|stage| !is_of_claims(stage));
    if !means.into_iter().all(AdaptiveStage::is_settled) {
        return Ok(stages);
    }
    for stage in stages.iter_mut().filter(|stage| is_of_claims(stage)) {
        if let Until::Claims(names) = &stage.growth.until {
            let sampled = (stage.surfaces, stage.growth.as_ref());
            stage.condition =
                conditions::evaluate_claims((study, plan), sampled, (rule, names), tables)?;
        }
    }
    Ok(stages)
}

/// Plans a study with the maximum number of surfaces that its manifest allows.
pub fn maximum_plan(mut study: Study) -> Plan {
    for stage in &mut study.stages {
        if let Work::Generate(ensembles) = &mut stage.work {
            ensembles.iter_mut().for_each(|one| one.realizations = one.at_most());
        }
    }
    Plan::new(&study)
}
