//! Adaptive sampling: how many surfaces a study has, where its manifest says how well a mean must be
//! known.
//!
//! The number follows from tables alone, so that it is the same whoever computes them, in whatever
//! order, stopped or not. A stage begins with the least number. Once all tables are there that its
//! condition looks at, either it holds, or as many surfaces are added as the scatter so far asks
//! for, at most as many as there are. All points of a stage have equally many, for spectra are
//! compared on the same draws.

use std::fmt;
use std::sync::Arc;

use crate::plan::Plan;
use crate::stages::StageError;
use crate::stages::aggregate::{Groups, Statistic, grouped};
use crate::store::table::Table;
use crate::store::{StoreError, TaskTables};
use crate::study::{Growth, Limit, Study, Until, Work};

/// It cannot be told whether a condition holds.
#[derive(Debug, thiserror::Error)]
pub enum SamplingError {
    /// A table cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The mean cannot be taken.
    #[error("cannot tell whether `{until}` holds")]
    Mean {
        /// The condition.
        until: String,
        /// Why.
        source: StageError,
    },
}

/// A study with as many surfaces as the tables of its tasks ask for.
#[derive(Debug)]
pub struct SampledStudy {
    /// The study.
    pub study: Study,
    /// Its tasks.
    pub plan: Plan,
    /// The stages whose number of surfaces is not given.
    pub stages: Vec<AdaptiveStage>,
}

/// A stage that draws surfaces until a condition holds.
#[derive(Debug)]
pub struct AdaptiveStage {
    /// Its name.
    pub name: String,
    /// How many surfaces a point has.
    pub surfaces: u32,
    /// Until when there will be more.
    pub(crate) growth: Arc<Growth>,
    /// Whether there will.
    pub condition: Condition,
    position: usize,
}

/// What is known of a condition.
#[derive(Debug)]
pub enum Condition {
    /// It takes these tasks to tell. Tables of some may be there, but damaged.
    Open {
        /// Every task that the condition depends on.
        tasks: Vec<usize>,
        /// Damaged tables among them.
        damaged: Vec<(usize, StoreError)>,
    },
    /// It holds: the largest standard error, over its limit.
    Holds(f64),
    /// It does not hold: the largest standard error, over its limit.
    Fails(f64),
}

impl SampledStudy {
    /// The study as its tables make it.
    ///
    /// # Errors
    /// When a table cannot be read, or does not have the column of a condition.
    pub fn of(mut study: Study, tables: &impl TaskTables) -> Result<SampledStudy, SamplingError> {
        loop {
            let plan = Plan::of(&study);
            let stages = adaptive_stages(&study, &plan, tables)?;
            let more: Vec<_> = stages.iter().filter_map(AdaptiveStage::more).collect();
            if more.is_empty() {
                return Ok(SampledStudy {
                    study,
                    plan,
                    stages,
                });
            }
            for (stage, surfaces) in more {
                draw(&mut study, stage, surfaces);
            }
        }
    }

    /// The tasks whose tables decide on the number of surfaces; none once it is settled.
    pub fn deciding(&self) -> Vec<usize> {
        let tasks = self
            .stages
            .iter()
            .filter_map(|stage| match &stage.condition {
                Condition::Open { tasks, .. } => Some(tasks.as_slice()),
                Condition::Holds(_) | Condition::Fails(_) => None,
            });
        let mut tasks = tasks.collect::<Vec<_>>().concat();
        tasks.sort_unstable();
        tasks.dedup();
        tasks
    }

    /// Damaged tables in the way of deciding, to be quarantined.
    pub fn take_damaged(&mut self) -> Vec<(usize, StoreError)> {
        let damaged = self
            .stages
            .iter_mut()
            .filter_map(|stage| match &mut stage.condition {
                Condition::Open { damaged, .. } => Some(std::mem::take(damaged)),
                Condition::Holds(_) | Condition::Fails(_) => None,
            });
        damaged.flatten().collect()
    }
}

impl AdaptiveStage {
    /// Whether its condition holds, once that can be told.
    pub fn holds(&self) -> Option<bool> {
        match self.condition {
            Condition::Open { .. } => None,
            Condition::Holds(_) => Some(true),
            Condition::Fails(_) => Some(false),
        }
    }

    /// The stage's position and how many surfaces it needs, if these are not enough.
    fn more(&self) -> Option<(usize, u32)> {
        let Condition::Fails(error) = self.condition else {
            return None;
        };
        if self.surfaces >= self.growth.at_most {
            return None;
        }
        // Standard errors fall as the square root of the number of surfaces.
        let now = f64::from(self.surfaces);
        let needed = (now * error * error).ceil().clamp(now + 1.0, 2.0 * now);
        // Twice a million is a whole number of 32 bits.
        Some((self.position, (needed as u32).min(self.growth.at_most)))
    }
}

impl fmt::Display for AdaptiveStage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let AdaptiveStage {
            name,
            surfaces,
            growth,
            ..
        } = self;
        let Growth { at_most, until } = growth.as_ref();
        write!(formatter, "{name}: {surfaces} surfaces a point")?;
        match self.condition {
            Condition::Open { .. } => {
                write!(formatter, " so far, at most {at_most}, until {until}")
            }
            Condition::Holds(error) => {
                write!(formatter, ", {until} holds at {}", until.limit * error)
            }
            Condition::Fails(error) => write!(
                formatter,
                ", the most, and {until} does not hold: it is {}",
                until.limit * error
            ),
        }
    }
}

fn adaptive_stages(
    study: &Study,
    plan: &Plan,
    tables: &impl TaskTables,
) -> Result<Vec<AdaptiveStage>, SamplingError> {
    let stages = study.stages.iter().enumerate();
    let stages = stages.filter_map(|(position, stage)| match &stage.work {
        Work::Generate(ensembles) => {
            let first = ensembles.first()?;
            Some((
                position,
                &stage.name,
                first.realizations,
                first.growth.clone()?,
            ))
        }
        _ => None,
    });
    let adaptive = stages.map(|(position, name, surfaces, growth)| {
        Ok(AdaptiveStage {
            name: name.clone(),
            surfaces,
            condition: condition(plan, position, &growth.until, tables)?,
            growth,
            position,
        })
    });
    adaptive.collect()
}

/// The plan of a study with as many surfaces as its manifest allows.
pub fn at_most(study: Study) -> Plan {
    Plan::of(&at_its_most(study))
}

/// A study with as many surfaces as its manifest allows.
pub fn at_its_most(mut study: Study) -> Study {
    for stage in &mut study.stages {
        if let Work::Generate(ensembles) = &mut stage.work {
            for ensemble in ensembles {
                let growth = ensemble.growth.as_ref();
                ensemble.realizations =
                    growth.map_or(ensemble.realizations, |growth| growth.at_most);
            }
        }
    }
    study
}

fn draw(study: &mut Study, stage: usize, surfaces: u32) {
    if let Work::Generate(ensembles) = &mut study.stages[stage].work {
        ensembles
            .iter_mut()
            .for_each(|ensemble| ensemble.realizations = surfaces);
    }
}

/// Whether a condition on the surfaces of a stage holds.
fn condition(
    plan: &Plan,
    surfaces: usize,
    until: &Until,
    there: &impl TaskTables,
) -> Result<Condition, SamplingError> {
    let looked_at = plan.stages.iter().find(|stage| stage.name == until.stage);
    let looked_at = looked_at.expect("conditions name stages of the study");
    let mut is_own = vec![false; plan.tasks.len()];
    plan.stages[surfaces]
        .tasks
        .iter()
        .for_each(|&task| is_own[task] = true);
    let lines = looked_at.tasks.iter().map(|&task| line(plan, task));
    let lines: Vec<Vec<usize>> = lines
        .filter(|line| line.iter().any(|&task| is_own[task]))
        .collect();
    let keys: Vec<_> = lines.iter().map(|line| plan.tasks[line[0]].key).collect();
    let is_open = there.have(&keys).contains(&false);
    let mut tables = Vec::new();
    let mut damaged = Vec::new();
    if !is_open {
        for (line, key) in lines.iter().zip(keys) {
            match there.light(key) {
                Ok(table) => tables.push(table),
                Err(error) if error.is_mendable() => damaged.push((line[0], error)),
                Err(error) => return Err(error.into()),
            }
        }
    }
    if is_open || !damaged.is_empty() {
        return Ok(Condition::Open {
            tasks: lines.concat(),
            damaged,
        });
    }
    let error = largest_error(&tables, until);
    let error = error.map_err(|source| SamplingError::Mean {
        until: until.to_string(),
        source,
    })?;
    Ok(match error < 1.0 {
        true => Condition::Holds(error),
        false => Condition::Fails(error),
    })
}

/// A task and those that it depends on, up to its surface and the spectrum of that: each reads one
/// other.
fn line(plan: &Plan, task: usize) -> Vec<usize> {
    let above = |&task: &usize| plan.tasks[task].inputs.first().copied();
    std::iter::successors(Some(task), above).collect()
}

/// The largest standard error of a mean over surfaces, over its limit; means without scatter, or
/// without values, have none.
fn largest_error(tables: &[Table], until: &Until) -> Result<f64, StageError> {
    let groups = Groups {
        group_by: None,
        over: vec![until.column.clone()],
        statistics: vec![Statistic::Mean, Statistic::Sem],
        models: vec![],
    };
    let reduced = grouped(&Table::stack(tables)?, &groups)?;
    let column =
        |statistic: Statistic| reduced.reals(&format!("{}_{}", until.column, statistic.suffix()));
    let errors = column(Statistic::Sem)?.iter().zip(column(Statistic::Mean)?);
    let over_limit = errors.filter_map(|(error, mean)| {
        let (error, mean) = (error?, mean?);
        let limit = match until.limit {
            Limit::Absolute(limit) => limit,
            Limit::Relative(share) => share * mean.abs(),
        };
        (error > 0.0).then_some(error / limit)
    });
    Ok(over_limit.fold(0.0, f64::max))
}
