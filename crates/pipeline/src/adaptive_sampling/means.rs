//! Whether a mean is known well enough.

use super::condition::{Condition, Finding};
use super::error::SamplingError;
use super::tables::{line, read};
use crate::plan::Plan;
use crate::study::{KnownMean, Limit};
use asperity_stages::StageError;
use asperity_stages::aggregate::{Groups, Statistic, grouped};
use asperity_tables::store::TaskTables;
use asperity_tables::table::Table;

/// Whether a condition on the surfaces of a stage holds.
///
/// # Errors
/// When a table cannot be read, or does not have the column.
pub fn condition(
    plan: &Plan,
    surfaces: usize,
    mean: &KnownMean,
    there: &impl TaskTables,
) -> Result<Condition, SamplingError> {
    let looked_at = plan.stages.iter().find(|stage| stage.name == mean.stage);
    let looked_at = looked_at.expect("conditions name stages of the study");
    let mut is_own = vec![false; plan.tasks.len()];
    let own = &plan.stages[surfaces].tasks;
    own.iter().for_each(|&task| is_own[task] = true);
    let tasks = looked_at.tasks.iter().copied();
    let tasks = tasks.filter(|&task| line(plan, task).iter().any(|&task| is_own[task]));
    let tables = match read(plan, &tasks.collect::<Vec<_>>(), there)? {
        Ok(tables) => tables,
        Err(open) => return Ok(open),
    };
    let error = largest_error(&tables, mean)
        .map_err(|source| SamplingError::Mean { until: mean.to_string(), source })?;
    Ok(match error < 1.0 {
        true => Condition::Holds(Finding::Error(error)),
        false => Condition::Fails(Finding::Error(error)),
    })
}

/// Returns the largest ratio of the standard error of a mean to its limit. The ratio is infinite
/// where a mean is that of a single surface. Means without scatter or without values are left out.
fn largest_error(tables: &[Table], mean: &KnownMean) -> Result<f64, StageError> {
    let groups = Groups {
        group_by: None,
        over: vec![mean.column.clone()],
        statistics: vec![Statistic::Mean, Statistic::Sem],
        models: vec![],
    };
    let reduced = grouped(&Table::stack(tables)?, &groups)?;
    let column =
        |statistic: Statistic| reduced.reals(&format!("{}_{}", mean.column, statistic.suffix()));
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

/// So many surfaces as the largest error, over its limit, asks for: standard errors fall as the square
/// root of their number. At most as many again.
pub fn wanted(surfaces: u32, error: f64) -> u32 {
    let now = f64::from(surfaces);
    // Twice a million is a whole number of 32 bits.
    (now * error * error).ceil().clamp(now + 1.0, 2.0 * now) as u32
}
