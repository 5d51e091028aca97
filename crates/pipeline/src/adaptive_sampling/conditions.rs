//! Conditions on the number of surfaces: the standard error of a mean is small enough, or claims
//! are decided.
//!
//! This crate contains no claims. The session passes in a [`ClaimRule`] that decides them.

use std::collections::{BTreeMap, HashMap};
use std::num::NonZeroU32;

use crate::plan::{Plan, PlannedStage};
use crate::study::{EmptyTables, Growth, KnownMean, Limit, Study};
use asperity_stages::aggregate::{Groups, Statistic, grouped};
use asperity_stages::{Kind, StageError};
use asperity_tables::column::Description;
use asperity_tables::store::{StoreError, TaskTables};
use asperity_tables::table::{Table, TableError};

#[derive(Debug)]
pub enum Condition {
    /// The tables of some tasks are missing or damaged.
    Open {
        /// All tasks that the condition depends on.
        tasks: Vec<usize>,
        /// Tasks with damaged tables, and the error of reading each table.
        damaged: Vec<(usize, StoreError)>,
    },
    Holds(Finding),
    Fails(Finding),
}

/// Result of evaluating a condition.
#[derive(Debug)]
pub enum Finding {
    /// Largest ratio of a standard error to its limit, over the means of the condition. The
    /// condition holds if it is below 1.
    Error(f64),
    /// Largest ratio of the standard error of a multilevel mean to its limit, and the best numbers
    /// of surfaces for all means.
    Levels {
        error: f64,
        /// Best number of surfaces on each mesh, by its number of nodes.
        best: BTreeMap<usize, f64>,
    },
    /// Decided and undecided claims.
    Claims(Decisions),
}

impl Condition {
    /// Creates a condition that can be evaluated when these tasks have tables.
    pub fn open(tasks: Vec<usize>) -> Condition {
        Condition::Open { tasks, damaged: Vec::new() }
    }

    /// Returns whether the condition has been evaluated.
    pub fn is_known(&self) -> bool {
        !matches!(self, Condition::Open { .. })
    }
}

/// Error of evaluating a condition on the number of surfaces.
#[derive(Debug, thiserror::Error)]
pub enum SamplingError {
    /// A table could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The mean or its standard error could not be computed.
    #[error("cannot check the condition `{until}`")]
    Mean { until: String, source: StageError },
    /// The columns of a stage could not be derived from those of its inputs.
    #[error("cannot derive the columns of stage `{stage}` from its inputs")]
    Columns { stage: String, source: StageError },
    /// Claims could not be judged.
    #[error("cannot check whether the claims are decided")]
    Claims(#[from] TableError),
}

/// Rule that decides claims from the tables of a study.
pub trait ClaimRule {
    /// Decides the claims with the given names, or all claims if `names` is empty. This is one of
    /// `looks` interim analyses, which share the 5 % probability of error.
    ///
    /// `tables` has the table of each stage of the plan, or `None` if the stage has no table.
    ///
    /// # Errors
    /// Returns an error if a table lacks a column that its kind of stage writes.
    fn decide(
        &self,
        study: &Study,
        plan: &Plan,
        tables: &[Option<Table>],
        names: &[String],
        looks: NonZeroU32,
    ) -> Result<Decisions, TableError>;
}

/// Claims, divided into decided, undecided and not judged ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decisions {
    pub decided: Vec<String>,
    pub undecided: Vec<Undecided>,
    /// Names of the claims that use a quantity which the study lacks. Each has a description of
    /// what the study would need.
    pub not_judged: Vec<(String, String)>,
}

/// A claim that the present surfaces do not decide.
#[derive(Debug, Clone, PartialEq)]
pub struct Undecided {
    pub name: String,
    /// Numbers of surfaces of each spectrum: the present number, and the number that would decide
    /// the claim at the present scatter. `None` if no number of surfaces would decide the claim.
    pub surfaces: Option<[usize; 2]>,
}

impl Decisions {
    /// Returns the number of surfaces of a stage that would decide all decidable claims; `surfaces`
    /// is the present number. Returns `None` if no undecided claim is decidable.
    pub fn surfaces_needed(&self, surfaces: u32) -> Option<u64> {
        let wanted = self.undecided.iter().filter_map(|claim| {
            let [now, needed] = claim.surfaces?;
            // A spectrum may have fewer surfaces than this stage; both grow in proportion.
            Some((u64::from(surfaces) * needed as u64).div_ceil(now as u64))
        });
        wanted.max()
    }
}

/// Reads the tables of `tasks`, in this order. If some tables are missing or damaged, returns an
/// open condition instead.
///
/// # Errors
/// Returns an error if a table cannot be read and recomputing it would not help.
pub(super) fn read(
    plan: &Plan,
    tasks: &[usize],
    task_tables: &impl TaskTables,
) -> Result<Result<Vec<Table>, Condition>, StoreError> {
    let lines = || tasks.iter().flat_map(|&task| input_chain(plan, task)).collect();
    let references: Vec<_> = tasks.iter().map(|&task| &plan.tasks[task].table).collect();
    if task_tables.have(&references).contains(&false) {
        return Ok(Err(Condition::open(lines())));
    }
    let mut tables = Vec::with_capacity(tasks.len());
    let mut damaged = Vec::new();
    for (&task, reference) in tasks.iter().zip(references) {
        match task_tables.light(reference) {
            Ok(table) => tables.push(plan.labels.added_to(table)),
            Err(error) if error.is_recomputable() => damaged.push((task, error)),
            Err(error) => return Err(error),
        }
    }
    Ok(if damaged.is_empty() {
        Ok(tables)
    } else {
        Err(Condition::Open { tasks: lines(), damaged })
    })
}

/// Returns `task`, its first input, the first input of this input, and so on. The last task in this
/// list generates a surface or reads a spectrum.
pub(super) fn input_chain(plan: &Plan, task: usize) -> Vec<usize> {
    let above = |&task: &usize| plan.tasks[task].inputs.first().copied();
    std::iter::successors(Some(task), above).collect()
}

/// Returns the stage with the mean of a condition.
pub(super) fn stage_of<'a>(plan: &'a Plan, mean: &KnownMean) -> &'a PlannedStage {
    let found = plan.stages.iter().find(|stage| stage.name == mean.stage);
    found.expect("conditions name stages of the study")
}

/// Returns a function that tells whether a task depends on a surface of the stage with the index
/// `surfaces`.
pub(super) fn tasks_of_surfaces(plan: &Plan, surfaces: usize) -> impl Fn(&usize) -> bool {
    let mut is_own = vec![false; plan.tasks.len()];
    plan.stages[surfaces].tasks.iter().for_each(|&task| is_own[task] = true);
    move |&task| input_chain(plan, task).iter().any(|&task| is_own[task])
}

/// Converts the bound of a condition from the unit of output to that of the store.
pub fn in_stored_unit(study: &Study, mean: &KnownMean) -> KnownMean {
    let Limit::Absolute(limit) = mean.limit else { return mean.clone() };
    let of_means = Statistic::Mean.column_of(&mean.column);
    let tables = EmptyTables::new(study);
    let unit = tables.named(study, &mean.stage).ok().and_then(|table| {
        let schema = table.batch().schema();
        let fields = [&mean.column, &of_means].map(|name| schema.field_with_name(name).ok());
        fields.into_iter().flatten().next().map(|field| Description::from(field).unit)
    });
    let to_store = study.conversion(&mean.stage).reversed();
    let limit = to_store.number(limit, &unit.unwrap_or_default(), false);
    KnownMean { limit: Limit::Absolute(limit), ..mean.clone() }
}

/// Evaluates the condition on a mean for a stage that generates surfaces. `surfaces` is the index
/// of this stage.
///
/// # Errors
/// Returns an error if a table cannot be read or lacks the column of the mean.
pub fn evaluate_mean(
    plan: &Plan,
    surfaces: usize,
    mean: &KnownMean,
    task_tables: &impl TaskTables,
) -> Result<Condition, SamplingError> {
    let is_of_surfaces = tasks_of_surfaces(plan, surfaces);
    let tasks = stage_of(plan, mean).tasks.iter().copied().filter(is_of_surfaces);
    let tables = match read(plan, &tasks.collect::<Vec<_>>(), task_tables)? {
        Ok(tables) => tables,
        Err(open) => return Ok(open),
    };
    let error = largest_error(&tables, mean)
        .map_err(|source| SamplingError::Mean { until: mean.to_string(), source })?;
    Ok(if error < 1.0 {
        Condition::Holds(Finding::Error(error))
    } else {
        Condition::Fails(Finding::Error(error))
    })
}

/// Returns the largest ratio of a standard error to its limit, over the means of the condition. The
/// ratio is infinite if there is only one surface. Means without scatter or without values are
/// skipped.
fn largest_error(tables: &[Table], mean: &KnownMean) -> Result<f64, StageError> {
    let groups = Groups {
        group_by: None,
        over: vec![mean.column.clone()],
        statistics: vec![Statistic::Mean, Statistic::Sem],
        models: vec![],
    };
    let reduced = grouped(&Table::stack(tables)?, &groups)?;
    let column = |statistic: Statistic| reduced.reals(&statistic.column_of(&mean.column));
    let errors = column(Statistic::Sem)?.iter().zip(column(Statistic::Mean)?);
    let over_limit = errors.filter_map(|(error, value)| {
        let (error, value) = (error.unwrap_or(f64::INFINITY), value?);
        let limit = match mean.limit {
            Limit::Absolute(limit) => limit,
            Limit::Relative(share) => share * value.abs(),
        };
        (error > 0.0).then_some(error / limit)
    });
    Ok(over_limit.fold(0.0, f64::max))
}

/// Returns the next number of surfaces: `surfaces` × `error`², but more than `surfaces` and at most
/// twice as many. `error` is the ratio of a standard error to its limit. Standard errors are
/// inversely proportional to the square root of the number of surfaces.
pub fn surfaces_for_mean(surfaces: u32, error: f64) -> u32 {
    let now = f64::from(surfaces);
    // Twice the maximum of a million fits into 32 bits.
    (now * error * error).ceil().clamp(now + 1.0, 2.0 * now) as u32
}

/// Evaluates the condition that claims are decided: the claims with the given names, or all claims
/// if `names` is empty.
///
/// Claims compare spectra. The condition therefore depends on all tables of single surfaces that
/// claims use. It does not depend on fits and means, which are never computed for intermediate
/// numbers of surfaces.
///
/// Each step multiplies the number of surfaces by 1.5 to 2, which bounds the number of interim
/// analyses. The interim analyses divide the 5 % probability of error among themselves
/// ([`ClaimRule`]). At the maximum number of surfaces, claims are judged as by `asperity claims`.
///
/// # Errors
/// Returns an error if a table cannot be read or lacks a column.
pub fn evaluate_claims(
    (study, plan): (&Study, &Plan),
    (surfaces, growth): (u32, &Growth),
    (rule, names): (&dyn ClaimRule, &[String]),
    task_tables: &impl TaskTables,
) -> Result<Condition, SamplingError> {
    let tables = match all_tables(study, plan, task_tables)? {
        Ok(tables) => tables,
        Err(open) => return Ok(open),
    };
    let looks = if surfaces >= growth.at_most { NonZeroU32::MIN } else { looks(growth) };
    let decisions = rule.decide(study, plan, &tables, names, looks)?;
    Ok(match decisions.surfaces_needed(surfaces) {
        None => Condition::Holds(Finding::Claims(decisions)),
        Some(_) => Condition::Fails(Finding::Claims(decisions)),
    })
}

/// Returns all tasks that a condition on claims depends on: those of the stages of single surfaces
/// whose tables claims read.
pub fn claim_tasks(study: &Study, plan: &Plan) -> Vec<usize> {
    let tests = || study.claims.iter().filter_map(|claim| claim.test.as_ref());
    let stages = plan.stages.iter().filter(|stage| {
        let is_pooled = matches!(stage.kind, Kind::Fit | Kind::Aggregate);
        !is_pooled && tests().any(|test| test.reads(&stage.name, stage.kind))
    });
    let mut tasks: Vec<usize> = stages.flat_map(|stage| stage.tasks.iter().copied()).collect();
    tasks.sort_unstable();
    tasks.dedup();
    tasks
}

/// Reads the tables that claims use, and stacks the tables of each stage; `None` for a stage
/// without such tables. If some tables are missing or damaged, returns an open condition instead.
fn all_tables(
    study: &Study,
    plan: &Plan,
    task_tables: &impl TaskTables,
) -> Result<Result<Vec<Option<Table>>, Condition>, SamplingError> {
    let tasks = claim_tasks(study, plan);
    let read: HashMap<usize, Table> = match read(plan, &tasks, task_tables)? {
        Ok(tables) => tasks.into_iter().zip(tables).collect(),
        Err(open) => return Ok(Err(open)),
    };
    let empty_tables = EmptyTables::new(study);
    let stages = plan.stages.iter().map(|stage| {
        let own: Vec<Table> =
            stage.tasks.iter().filter_map(|task| read.get(task).cloned()).collect();
        if own.is_empty() {
            return Ok(None);
        }
        // Claims name columns of published tables.
        let unknown = |source| SamplingError::Columns { stage: stage.name.clone(), source };
        let empty = empty_tables.named(study, &stage.name).map_err(unknown)?;
        let (absolute, _) = study.absolute_columns(&empty_tables, &stage.name).map_err(unknown)?;
        let table = absolute.beside(&Table::stack(&own)?);
        // Claims are written in the units of output.
        let conversion = study.conversion(&stage.name);
        Ok(Some(match conversion.is_none() {
            true => table,
            false => conversion.table(&table.described_by(&absolute.beside(empty))),
        }))
    });
    Ok(Ok(stages.collect::<Result<_, SamplingError>>()?))
}

/// Returns the next number of surfaces: the number that would decide the undecided claims, clamped
/// to 1.5 to 2 times the present number and then to at most `at_most`.
pub fn surfaces_for_claims(surfaces: u32, decisions: &Decisions, at_most: u32) -> u32 {
    let [least, most] = [least_step(surfaces), 2 * surfaces];
    let wanted = decisions.surfaces_needed(surfaces).unwrap_or(0);
    let next = u32::try_from(wanted).unwrap_or(most).clamp(least, most);
    next.min(at_most)
}

/// Returns the smallest number of surfaces at the next interim analysis: 1.5 times the present one.
pub fn least_step(surfaces: u32) -> u32 {
    surfaces + surfaces.div_ceil(2)
}

/// Returns the maximum number of interim analyses, from `at_least` surfaces until `at_most`
/// surfaces are reached. The analysis at `at_most` is not counted.
pub fn looks(growth: &Growth) -> NonZeroU32 {
    let steps =
        std::iter::successors(Some(growth.at_least), |&surfaces| Some(least_step(surfaces)));
    let looks = steps.take_while(|&surfaces| surfaces < growth.at_most);
    let looks = u32::try_from(looks.count()).unwrap_or(u32::MAX);
    NonZeroU32::new(looks).unwrap_or(NonZeroU32::MIN)
}

#[cfg(test)]
mod tests {
    use crate::study::Until;

    use super::*;

    fn growth(at_least: u32, at_most: u32) -> Growth {
        Growth { at_least, at_most, until: Until::Claims(Vec::new()) }
    }

    /// Returns a claim with ten surfaces of each spectrum, which `needed` surfaces would decide.
    fn needs(needed: Option<usize>) -> Undecided {
        Undecided {
            name: "area-above-persson".to_owned(),
            surfaces: needed.map(|needed| [10, needed]),
        }
    }

    #[test]
    fn as_many_are_drawn_as_the_most_demanding_claim_needs_within_a_step() {
        let next = |needed: &[Option<usize>]| {
            let undecided = needed.iter().map(|&needed| needs(needed)).collect();
            let decisions = Decisions { undecided, ..Decisions::default() };
            surfaces_for_claims(10, &decisions, 60)
        };
        assert_eq!(next(&[Some(17), Some(13), None]), 17);
        assert_eq!(next(&[Some(11)]), 15);
        assert_eq!(next(&[Some(900_000)]), 20);
        assert_eq!(surfaces_for_claims(40, &Decisions::default(), 60), 60);
    }

    #[test]
    fn no_way_from_the_least_to_the_most_surfaces_has_more_looks_than_are_counted() {
        for (least, most) in [(5, 6), (10, 10), (10, 60), (7, 1000), (13, 999_999)] {
            let mut surfaces = least;
            let mut seen = 0;
            while surfaces < most {
                seen += 1;
                surfaces = surfaces_for_claims(surfaces, &Decisions::default(), most);
            }
            let counted = looks(&growth(least, most)).get();
            assert!(seen <= counted && counted <= seen.max(1), "{least} to {most}");
        }
        assert_eq!(looks(&growth(10, 60)).get(), 5);
    }
}
