//! Statistics of columns within groups of rows.

use polars::prelude::{
    DataFrame, Expr, IntoLazy, QuantileMethod, SortMultipleOptions, col, len, lit,
};

use super::super::StageError;
use super::super::columns::{
    AREA_CORRECTED, AREA_FRACTION, CONTACT_NODES, ENERGY, LOAD, PRESSURE, STOP, SURFACE,
};
use super::super::fit::common_columns::STATUS;
use super::super::fit::row::FITTED;
use super::frame::{self, polars_error};
use super::names::{COUNT, LOAD_MIDPOINT, UNCONVERGED, UNFITTED, mean_of, named};
use super::{Groups, Statistic, confidence, meanings, regression, theory};
use crate::ensemble;
use crate::stages::solve::GIVEN_UP;
use crate::store::column::{Column, Role};
use crate::store::table::Table;

/// Quantities that vanish at zero load, so that their first slope starts there.
const FROM_ZERO: [Column; 4] = [AREA_FRACTION, AREA_CORRECTED, CONTACT_NODES, ENERGY];

/// One row per group, in ascending order of the columns that name it.
///
/// # Errors
/// When a column is missing or holds no numbers.
pub fn reduce(table: &Table, groups: &Groups) -> Result<Table, StageError> {
    let names = group_names(table, groups);
    let table = &ensemble::each_once(table)?;
    let frame = frame::of(table)?;
    for name in names.iter().chain(&groups.over) {
        require(&frame, name)?;
    }
    let keys: Vec<Expr> = names.iter().map(|name| col(name.as_str())).collect();
    let mut rows = frame.lazy();
    if !groups.levels().is_empty() {
        rows = confidence::with_sums(rows, &keys, &groups.over, table.has(SURFACE.name))?;
    }
    let mut reduced = rows
        .group_by_stable(keys.clone())
        .agg(aggregations(table, groups))
        .sort_by_exprs(
            keys,
            SortMultipleOptions::default().with_maintain_order(true),
        );
    if names.iter().any(|name| name == LOAD.name) {
        reduced = reduced.filter(is_complete(&names)?);
    }
    if groups
        .statistics
        .iter()
        .any(|s| matches!(s, Statistic::Slope | Statistic::Secant))
    {
        reduced = reduced.with_columns(against_load(&names, groups)?);
    }
    for level in groups.levels() {
        let ends = groups.over.iter();
        let ends = ends.flat_map(|name| confidence::ends(name, level));
        reduced = reduced.with_columns(ends.collect::<Vec<_>>());
    }
    let mut chosen = output(table, &names, groups);
    chosen.extend(groups.over.iter().map(|name| mean_of(name)));
    let chosen: Vec<Expr> = chosen.iter().map(|name| col(name.as_str())).collect();
    let reduced = reduced.select(chosen).collect().map_err(polars_error)?;
    let columns = frame::columns(&reduced)?;
    let reduced = meanings::with_meanings(table, columns, reduced.height(), groups);
    theory::complete(&reduced, &names, groups)
}

/// Whether as many rows are in a group as in the fullest of its curve.
///
/// A surface has no rows beyond its first load in full contact. Averages over those that are left
/// would fall with the load, so a curve ends where its first surface does.
fn is_complete(names: &[String]) -> Result<Expr, StageError> {
    let count = || col(COUNT.name);
    let curve = of_a_curve(names);
    let fullest = match curve.is_empty() {
        true => count().max(),
        false => count().max().over(curve).map_err(polars_error)?,
    };
    Ok(count().eq(fullest))
}

/// The columns that tell curves apart, and not the points of one.
fn of_a_curve(names: &[String]) -> Vec<Expr> {
    let is_load = |name: &&String| [LOAD.name, PRESSURE.name].contains(&name.as_str());
    let names = names.iter().filter(|name| !is_load(name));
    names.map(|name| col(name.as_str())).collect()
}

/// The columns that name a group.
fn group_names(table: &Table, groups: &Groups) -> Vec<String> {
    let of_all_surfaces = table.coordinates().not_in_role(Role::Surface);
    let default = || {
        of_all_surfaces
            .names()
            .into_iter()
            .map(str::to_owned)
            .collect()
    };
    groups.group_by.clone().unwrap_or_else(default)
}

fn require(frame: &DataFrame, name: &str) -> Result<(), StageError> {
    frame
        .column(name)
        .map(drop)
        .map_err(|_| StageError::Aggregate {
            reason: format!("the input has no column `{name}`"),
        })
}

fn aggregations(table: &Table, groups: &Groups) -> Vec<Expr> {
    let mut expressions = vec![len().alias(COUNT.name)];
    if table.has(STOP.name) {
        let given_up = col(STOP.name).eq(lit(GIVEN_UP));
        expressions.push(given_up.sum().alias(UNCONVERGED.name));
    }
    if is_of_fits(table) {
        let failed = col(STATUS.name).neq(lit(FITTED));
        expressions.push(failed.sum().alias(UNFITTED.name));
    }
    for name in &groups.over {
        // Slopes and secants need the mean, whether or not it is asked for.
        expressions.push(col(name.as_str()).mean().alias(mean_of(name)));
        for &statistic in &groups.statistics {
            if let Some(expression) = within_group(col(name.as_str()), statistic) {
                expressions.push(expression.alias(named(name, statistic)));
            }
        }
        if !groups.levels().is_empty() {
            expressions.extend(confidence::of_group(name, table.has(SURFACE.name)));
        }
    }
    expressions
}

/// Whether its rows are fits; those that failed hold nulls.
fn is_of_fits(table: &Table) -> bool {
    table.texts(STATUS.name).is_ok()
}

fn within_group(values: Expr, statistic: Statistic) -> Option<Expr> {
    Some(match statistic {
        Statistic::Mean => values.mean(),
        Statistic::Sd => values.std(1),
        Statistic::Sem => values.clone().std(1) / values.count().sqrt(),
        Statistic::Min => values.min(),
        Statistic::Max => values.max(),
        Statistic::Quantile(share) => values.quantile(lit(share), QuantileMethod::Linear),
        Statistic::RegressionSlope => regression::slope(&values),
        Statistic::RegressionIntercept => regression::intercept(&values),
        Statistic::Confidence(_) => return None,
        Statistic::Slope | Statistic::Secant | Statistic::Approach => return None,
    })
}

/// Slopes by differences of the mean curve, and secants. Rows ascend in load within a curve.
fn against_load(names: &[String], groups: &Groups) -> Result<Vec<Expr>, StageError> {
    let curve = of_a_curve(names);
    let before = |values: Expr| match curve.is_empty() {
        true => Ok(values.shift(lit(1))),
        false => values
            .shift(lit(1))
            .over(curve.clone())
            .map_err(polars_error),
    };
    let load = || col(LOAD.name);
    let load_before = before(load())?.fill_null(lit(0.0));
    let midpoint = (load() + load_before.clone()) / lit(2.0);
    let mut expressions = vec![midpoint.alias(LOAD_MIDPOINT.name)];
    for name in &groups.over {
        let mean = || col(mean_of(name));
        let starts_at_zero = FROM_ZERO.iter().any(|column| column.name == name);
        let mean_before = match starts_at_zero {
            true => before(mean())?.fill_null(lit(0.0)),
            false => before(mean())?,
        };
        for &statistic in &groups.statistics {
            let expression = match statistic {
                Statistic::Slope => (mean() - mean_before.clone()) / (load() - load_before.clone()),
                Statistic::Secant => mean() / load(),
                _ => continue,
            };
            expressions.push(expression.alias(named(name, statistic)));
        }
    }
    Ok(expressions)
}

/// The columns of the reduced table, in order.
fn output(table: &Table, names: &[String], groups: &Groups) -> Vec<String> {
    let mut output = names.to_vec();
    output.push(COUNT.name.to_owned());
    if table.has(STOP.name) {
        output.push(UNCONVERGED.name.to_owned());
    }
    if is_of_fits(table) {
        output.push(UNFITTED.name.to_owned());
    }
    if groups.statistics.contains(&Statistic::Slope) {
        output.push(LOAD_MIDPOINT.name.to_owned());
    }
    for name in &groups.over {
        let within = groups.statistics.iter();
        let within = within.filter(|&&statistic| statistic != Statistic::Approach);
        let ends = within.flat_map(|statistic| statistic.suffixes());
        output.extend(ends.map(|end| format!("{name}_{end}")));
    }
    output
}

#[cfg(test)]
mod tests;
