//! Figures that nobody asked for: results of a stage against a swept parameter, or against the
//! load.

use std::collections::BTreeSet;

use arrow::array::Array;

use asperity_pipeline::study::figures::{FigureSpec, PanelSpec, Quantity, Scales, is_number};
use asperity_pipeline::study::{Stage, Study};
use asperity_stages::Kind;
use asperity_stages::aggregate::Statistic;
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, GREENWOOD_CONDUCTANCE, GREENWOOD_RESISTANCE, HOLM_RESISTANCE,
    HURST, STEP,
};
use asperity_stages::ensemble::load_column;
use asperity_tables::column::{Column, absolute_column};
use asperity_tables::table::Table;

use crate::finished::{FinishedStage, FinishedStages};
use crate::points::{distinct, independent};
use crate::symbols;

/// Number of loads from which on results are drawn against the load.
const MANY_LOADS: usize = 6;
/// Number of loads from which on results of a single parameter point are drawn against the load.
const FEW_LOADS: usize = 3;
/// Smallest ratio of the ends of a logarithmic axis.
const LOGARITHMIC: f64 = 10.0;
/// Largest number of quantities of a figure.
const MOST_QUANTITIES: usize = 4;

/// Returns the figures of stages that no declared figure shows: of statistics and fits and, where
/// no statistics are computed from them, of areas.
pub fn figures(study: &Study, finished: &FinishedStages) -> Vec<FigureSpec> {
    let derived = study.derived_keys();
    let stages = finished.stages.iter();
    let is_shown = |stage: &&FinishedStage| {
        let mut declared = study.figures.iter();
        declared.any(|figure| figure.from == stage.name) || is_reduced(study, &stage.name)
    };
    stages.filter(|stage| !is_shown(stage)).filter_map(|stage| figure(stage, &derived)).collect()
}

/// Returns whether a stage computes statistics of the rows of this stage, or corrects its areas.
fn is_reduced(study: &Study, name: &str) -> bool {
    let is_reduction =
        |stage: &&Stage| matches!(stage.work.kind(), Kind::Aggregate | Kind::Correct);
    let mut reductions = study.stages.iter().filter(is_reduction);
    reductions.any(|stage| stage.inputs.iter().any(|&input| study.stages[input].name == name))
}

fn figure(stage: &FinishedStage, derived: &BTreeSet<String>) -> Option<FigureSpec> {
    let FinishedStage { name, kind, table, .. } = stage;
    // Areas along a path are drawn in the order of its states, by figures of their own.
    if table.has(STEP.name) {
        return None;
    }
    let quantities: Vec<Quantity> = quantities(*kind, table)
        .into_iter()
        .filter(|name| varies(table, name))
        .filter_map(|name| Quantity::find(table, &name, None).ok())
        .collect();
    let quantities = without_repeats(quantities);
    if quantities.is_empty() || table.rows() == 0 {
        return None;
    }
    let swept = independent(table, derived);
    let numeric = swept.iter().filter(|(name, _)| is_number(table, name));
    let most_values = numeric.min_by_key(|(_, values)| std::cmp::Reverse(*values));
    let load = load_column(table);
    let loads = if table.has(load) { distinct(table, load) } else { 0 };
    let (x, colour) = match most_values {
        _ if loads >= MANY_LOADS && !swept.is_empty() => {
            (load.to_owned(), Some(most_values.unwrap_or(&swept[0]).0.clone()))
        }
        Some((name, _)) => (name.clone(), (loads > 1).then(|| load.to_owned())),
        None if swept.is_empty() && loads >= FEW_LOADS => (load.to_owned(), None),
        None => return None,
    };
    let is_wide = |column: &str| {
        column != HURST.name && spans(table, column).is_some_and(|ratio| ratio >= LOGARITHMIC)
    };
    let is_against_load = x == load;
    let scales = match is_wide(&x) {
        true if is_against_load && quantities.iter().all(|one| is_wide(&one.column)) => Scales::Log,
        true => Scales::LogX,
        false => Scales::Linear,
    };
    Some(FigureSpec {
        name: name.clone(),
        from: name.clone(),
        panels: vec![PanelSpec { x, y: quantities, scales, ..PanelSpec::default() }],
        colour,
        ..FigureSpec::default()
    })
}

/// Returns the quantities that a stage is about, in the units of the study where a column has them.
fn quantities(kind: Kind, table: &Table) -> Vec<String> {
    let schema = table.batch().schema();
    let is_shown = |name: &&str| absolute_column(&schema, name) == *name;
    let names = || table.names().into_iter().filter(is_shown);
    match kind {
        Kind::Aggregate => {
            names().filter_map(|name| Statistic::Mean.base_of(name)).map(str::to_owned).collect()
        }
        Kind::Fit => {
            let has_values = |name: &String| {
                let column = table.batch().column_by_name(name);
                column.is_some_and(|column| column.null_count() < column.len())
            };
            let parameters = names().filter_map(|name| Quantity::find(table, name, None).ok());
            // A parameter that is given and not fitted has no interval.
            let fitted = parameters.filter(|parameter| {
                has_values(&parameter.column)
                    && parameter.ends().is_some_and(|ends| ends.iter().all(has_values))
            });
            fitted.map(|parameter| parameter.column).collect()
        }
        Kind::Measure | Kind::Correct => {
            let areas = [AREA_CORRECTED.name, AREA_FRACTION.name].into_iter();
            areas.filter(|name| table.has(name)).take(1).map(str::to_owned).collect()
        }
        Kind::Generate | Kind::Solve => Vec::new(),
    }
}

/// Returns whether a quantity has several values.
fn varies(table: &Table, name: &str) -> bool {
    let mean = Statistic::Mean.column_of(name);
    distinct(table, if table.has(name) { name } else { &mean }) > 1
}

/// Formulas for a quantity that the solver computes.
const FORMULAS: [Column; 3] = [GREENWOOD_CONDUCTANCE, GREENWOOD_RESISTANCE, HOLM_RESISTANCE];

/// Keeps one quantity of each label, the last one: of the counted and the corrected area, the
/// corrected one, but of a solution and a formula, the solution. Omits quantities along x and y
/// beside their mean.
fn without_repeats(mut quantities: Vec<Quantity>) -> Vec<Quantity> {
    let bases: Vec<String> = quantities.iter().map(|one| one.base().to_owned()).collect();
    let is_formula = |one: &Quantity| FORMULAS.iter().any(|formula| formula.name == one.base());
    quantities.sort_by_key(|one| !is_formula(one));
    let mut labels = BTreeSet::new();
    quantities.reverse();
    quantities.retain(|one| {
        let along = ["_x", "_y"].iter().filter_map(|end| one.base().strip_suffix(end));
        let has_mean = along.into_iter().any(|base| bases.iter().any(|known| known == base));
        !has_mean && labels.insert(symbols::name(one.base()))
    });
    quantities.reverse();
    quantities.sort_by_key(|one| bases.iter().position(|base| base == one.base()));
    quantities.truncate(MOST_QUANTITIES);
    quantities
}

/// Returns the ratio of the largest and the smallest number of a column, if all are positive.
fn spans(table: &Table, column: &str) -> Option<f64> {
    let integers =
        table.integers(column).map(|all| all.iter().flatten().map(|n| n as f64).collect());
    let numbers: Vec<f64> = match integers {
        Ok(numbers) => numbers,
        Err(_) => table.reals(column).ok()?.iter().flatten().collect(),
    };
    let least = numbers.iter().copied().reduce(f64::min).filter(|least| *least > 0.0)?;
    Some(numbers.iter().copied().fold(least, f64::max) / least)
}

#[cfg(test)]
mod tests {
    use asperity_stages::columns::{ELECTRICAL_RESISTANCE, SPOTS};
    use asperity_tables::column::{integers, reals};

    use super::*;

    #[test]
    fn a_resistance_that_the_solver_computes_comes_before_those_of_formulas() {
        let columns =
            [SPOTS, ELECTRICAL_RESISTANCE, GREENWOOD_RESISTANCE, HOLM_RESISTANCE, AREA_FRACTION];
        let mut values = columns.map(|column| (column, reals([1.0])));
        values[0].1 = integers([1]);
        let table = Table::new(1, values.to_vec());
        let quantities = |names: &[Column]| {
            let found = names.iter().map(|one| Quantity::find(&table, one.name, None).unwrap());
            let kept = without_repeats(found.collect());
            kept.iter().map(|one| one.base().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(quantities(&columns), ["spots", "electrical_resistance", "area_fraction"]);
        assert_eq!(quantities(&[GREENWOOD_RESISTANCE]), ["greenwood_resistance"]);
    }
}
