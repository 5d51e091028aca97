//! Statistics of columns within groups of rows.

use polars::prelude::{
    DataFrame, Expr, IntoLazy, NamedFrom, QuantileMethod, Series, SortMultipleOptions, col, len,
    lit,
};

use super::super::StageError;
use super::super::columns::{AREA_CORRECTED, AREA_FRACTION, CONTACT_NODES, ENERGY, STOP};
use super::super::fit::common_columns::STATUS;
use super::super::fit::row::FITTED;
use super::confidence::SAMPLING_UNIT;
use super::frame::{self, polars_error};
use super::group_names::GroupNames;
use super::names::{
    COUNT, LOAD_MIDPOINT, LOAD_OF_GROUP, SURFACES, UNCONVERGED, UNFITTED, mean_of, named,
};
use super::sql::engine;
use super::{Groups, Statistic, confidence, meanings, regression, theory};
use crate::ensemble;
use crate::solve::GIVEN_UP;
use asperity_tables::column::{Column, Role};
use asperity_tables::table::Table;

/// Quantities that vanish at zero load, so that their first slope starts there.
const FROM_ZERO: [Column; 4] = [AREA_FRACTION, AREA_CORRECTED, CONTACT_NODES, ENERGY];

/// One row per group, in ascending order of the columns that name it.
///
/// # Errors
/// When a column is missing or holds no numbers, or when groups are named by a column that differs
/// within them.
pub fn reduce(table: &Table, groups: &Groups) -> Result<Table, StageError> {
    let names = GroupNames::of(table, groups);
    let table = &ensemble::each_once(table)?;
    let mut frame = frame::of(table)?;
    for name in names.shown.iter().chain(&groups.over) {
        require(&frame, name)?;
    }
    let units = ensemble::sampling_units(table)?;
    let units = Series::new(SAMPLING_UNIT.into(), units).into();
    frame.with_column(units).map_err(polars_error)?;
    let keys: Vec<Expr> = names.keys.iter().map(|name| col(name.as_str())).collect();
    let mut rows = frame.lazy();
    if groups.asks_for_errors() {
        rows = confidence::with_sums(rows, &keys, &groups.over)?;
    }
    let mut reduced = rows
        .group_by_stable(keys.clone())
        .agg(aggregations(table, &names, groups))
        .sort_by_exprs(keys, SortMultipleOptions::default().with_maintain_order(true));
    if names.load.is_some() {
        reduced = reduced.filter(is_complete(&names)?);
    }
    if groups.statistics.iter().any(|s| matches!(s, Statistic::Slope | Statistic::Secant)) {
        reduced = reduced.with_columns(against_load(&names, groups)?);
    }
    for level in groups.levels() {
        let ends = groups.over.iter();
        let ends = ends.flat_map(|name| confidence::ends(name, level));
        reduced = reduced.with_columns(ends.collect::<Vec<_>>());
    }
    let reduced = engine::apart(|| reduced.collect().map_err(polars_error))?;
    names.check_stand_ins(&reduced)?;
    let chosen = output(table, &names, groups);
    let reduced = reduced.select(chosen).map_err(polars_error)?;
    let columns = frame::columns(&reduced)?;
    let reduced = meanings::with_meanings(table, columns, reduced.height(), groups);
    theory::complete(&reduced, &names.curve(), groups)
}

/// Whether as many rows are in a group as in the fullest of its curve.
///
/// A surface has no rows beyond its first load in full contact. Averages over those that are left
/// would fall with the load, so a curve ends where its first surface does.
fn is_complete(names: &GroupNames) -> Result<Expr, StageError> {
    let count = || col(COUNT.name);
    let curve = names.keys_of_a_curve();
    let fullest = match curve.is_empty() {
        true => count().max(),
        false => count().max().over(curve).map_err(polars_error)?,
    };
    Ok(count().eq(fullest))
}

fn require(frame: &DataFrame, name: &str) -> Result<(), StageError> {
    frame
        .column(name)
        .map(drop)
        .map_err(|_| StageError::Aggregate { reason: format!("the input has no column `{name}`") })
}

fn aggregations(table: &Table, names: &GroupNames, groups: &Groups) -> Vec<Expr> {
    let mut expressions = names.within_groups();
    expressions.push(len().alias(COUNT.name));
    if is_of_surfaces(table) {
        expressions.push(col(SAMPLING_UNIT).n_unique().alias(SURFACES.name));
    }
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
        if groups.asks_for_errors() {
            expressions.extend(confidence::of_group(name));
            let error = confidence::standard_error(name);
            expressions.push(error.alias(named(name, Statistic::Sem)));
        }
    }
    expressions
}

/// Returns whether the rows of a table tell surfaces apart.
fn is_of_surfaces(table: &Table) -> bool {
    !table.in_role(Role::Surface).names().is_empty()
}

/// Whether its rows are fits; those that failed hold nulls.
fn is_of_fits(table: &Table) -> bool {
    table.texts(STATUS.name).is_ok()
}

fn within_group(values: Expr, statistic: Statistic) -> Option<Expr> {
    Some(match statistic {
        Statistic::Mean => values.mean(),
        Statistic::Sd => values.std(1),
        Statistic::Min => values.min(),
        Statistic::Max => values.max(),
        Statistic::Quantile(share) => values.quantile(lit(share), QuantileMethod::Linear),
        Statistic::RegressionSlope => regression::slope(&values),
        Statistic::RegressionIntercept => regression::intercept(&values),
        Statistic::Sem | Statistic::Confidence(_) => return None,
        Statistic::Slope | Statistic::Secant | Statistic::Approach => return None,
    })
}

/// Slopes by differences of the mean curve, and secants. Rows ascend in load within a curve.
fn against_load(names: &GroupNames, groups: &Groups) -> Result<Vec<Expr>, StageError> {
    let curve = names.keys_of_a_curve();
    let before = |values: Expr| match curve.is_empty() {
        true => Ok(values.shift(lit(1))),
        false => values.shift(lit(1)).over(curve.clone()).map_err(polars_error),
    };
    let load = || col(LOAD_OF_GROUP);
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

/// The columns of the reduced table, in order, and those that theories need besides.
fn output(table: &Table, names: &GroupNames, groups: &Groups) -> Vec<String> {
    let mut output = names.shown.clone();
    output.push(COUNT.name.to_owned());
    if is_of_surfaces(table) {
        output.push(SURFACES.name.to_owned());
    }
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
    output.extend(names.load.iter().map(|_| LOAD_OF_GROUP.to_owned()));
    output.extend(groups.over.iter().map(|name| mean_of(name)));
    output
}

#[cfg(test)]
mod tests;
