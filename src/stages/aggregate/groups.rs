//! Statistics of columns within groups of rows.

use std::collections::HashMap;

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Schema};
use polars::prelude::{
    DataFrame, Expr, IntoLazy, QuantileMethod, SortMultipleOptions, col, len, lit,
};

use super::super::StageError;
use super::super::columns::{
    AREA_CORRECTED, AREA_FRACTION, CONTACT_NODES, ENERGY, LOAD, PRESSURE, STOP, SURFACE,
};
use super::super::fit::row::FITTED;
use super::super::fit::rows::STATUS;
use super::frame::{self, polars_error};
use super::names::{COUNT, LOAD_MIDPOINT, UNCONVERGED, UNFITTED, mean_of, named};
use super::{Groups, Statistic, confidence, regression, theory};
use crate::ensemble;
use crate::stages::solve::GIVEN_UP;
use crate::store::column::{Column, Role};
use crate::store::table::Table;

/// What is said of every group, whatever is reduced.
pub const OWN: [Column; 4] = [COUNT, UNCONVERGED, UNFITTED, LOAD_MIDPOINT];

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
    let reduced = with_meanings(table, columns, reduced.height(), groups);
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

/// Gives each column the unit and meaning that it inherits.
fn with_meanings(
    table: &Table,
    columns: Vec<(String, ArrayRef)>,
    rows: usize,
    groups: &Groups,
) -> Table {
    let schema = table.batch().schema();
    let own: HashMap<&str, Column> = OWN.map(|column| (column.name, column)).into();
    let field = |name: &str, array: &ArrayRef| {
        if let Some(column) = own.get(name) {
            return column.field();
        }
        if let Ok(field) = schema.field_with_name(name) {
            return field.clone();
        }
        let source = schema
            .fields()
            .iter()
            .filter(|f| name.starts_with(&format!("{}_", f.name())));
        let source = source.max_by_key(|field| field.name().len());
        let metadata = source
            .map(|field| inherited(field, name, groups))
            .unwrap_or_default();
        Field::new(name, array.data_type().clone(), true).with_metadata(metadata)
    };
    let fields: Vec<Field> = columns
        .iter()
        .map(|(name, array)| field(name, array))
        .collect();
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    Table::of(rows, Schema::new(fields), arrays)
}

fn inherited(source: &Field, name: &str, groups: &Groups) -> arrow::datatypes::Metadata {
    let of = |entry: &str| source.metadata().get(entry).cloned().unwrap_or_default();
    let statistic = &name[source.name().len() + 1..];
    let of_an_end = |&level: &f64| confidence::meaning(level, statistic);
    let said = groups.levels().iter().find_map(of_an_end);
    let said = said.unwrap_or_else(|| statistic.to_owned());
    let unit = match statistic {
        "slope" | "secant" | "regr_slope" => format!("{} per load", of("unit")),
        _ => of("unit"),
    };
    arrow::datatypes::Metadata::new()
        .with("role", "result")
        .with("unit", unit)
        .with("meaning", format!("{said} of: {}", of("meaning")))
}

#[cfg(test)]
mod tests {
    use arrow::array::Array;

    use super::super::super::columns::REALIZATION;
    use super::*;
    use crate::store::column::ColumnKind;
    use crate::store::column::{integers, optional_reals, reals, texts};

    const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");
    /// Two spectra × two surfaces × two loads; the area is easy to average.
    fn table() -> Table {
        Table::new(
            8,
            vec![
                (HURST, reals([0.8, 0.8, 0.8, 0.8, 0.3, 0.3, 0.3, 0.3])),
                (REALIZATION, integers([0, 0, 1, 1, 0, 0, 1, 1])),
                (LOAD, reals([0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2])),
                (
                    AREA_FRACTION,
                    reals([0.2, 0.3, 0.4, 0.7, 0.1, 0.2, 0.1, 0.2]),
                ),
                (
                    STOP,
                    texts(["converged"; 7].into_iter().chain(["pair-limit"])),
                ),
            ],
        )
    }

    fn groups(statistics: &[Statistic]) -> Groups {
        Groups {
            group_by: None,
            over: vec![AREA_FRACTION.name.to_owned()],
            statistics: statistics.to_vec(),
            models: vec![],
        }
    }

    fn column(reduced: &Table, name: &str) -> Vec<f64> {
        reduced.reals(name).unwrap().values().to_vec()
    }

    #[test]
    fn groups_are_the_points_of_the_study_in_ascending_order() {
        let reduced = reduce(&table(), &groups(&[Statistic::Mean])).unwrap();
        assert_eq!(column(&reduced, "hurst"), [0.3, 0.3, 0.8, 0.8]);
        assert_eq!(column(&reduced, "load"), [0.1, 0.2, 0.1, 0.2]);
        assert_eq!(reduced.integers("count").unwrap().values(), &[2, 2, 2, 2]);
        assert!(!reduced.has("realization"));
    }

    #[test]
    fn statistics_are_those_of_the_rows_of_a_group() {
        let asked = [
            Statistic::Mean,
            Statistic::Sd,
            Statistic::Sem,
            Statistic::Min,
            Statistic::Max,
            Statistic::Quantile(0.25),
        ];
        let reduced = reduce(&table(), &groups(&asked)).unwrap();
        let third = |name: &str| column(&reduced, &format!("area_fraction_{name}"))[2];
        let expected = [
            ("mean", 0.3),
            ("sd", 0.02_f64.sqrt()),
            ("sem", 0.1),
            ("min", 0.2),
            ("max", 0.4),
            ("q25", 0.25),
        ];
        for (name, value) in expected {
            assert!((third(name) - value).abs() < 1e-15, "{name}");
        }
    }

    /// A table of surfaces, each with the same value under one load or different ones under several.
    fn of_surfaces(rows: &[(&str, f64, f64)]) -> Table {
        Table::new(
            rows.len(),
            vec![
                (SURFACE, texts(rows.iter().map(|row| row.0))),
                (
                    REALIZATION,
                    integers(rows.iter().map(|row| i64::from(row.0.as_bytes()[0]))),
                ),
                (LOAD, reals(rows.iter().map(|row| row.1))),
                (AREA_FRACTION, reals(rows.iter().map(|row| row.2))),
            ],
        )
    }

    fn interval(reduced: &Table) -> [f64; 2] {
        ["lower", "upper"].map(|end| column(reduced, &format!("area_fraction_ci95_{end}"))[0])
    }

    #[test]
    fn an_interval_of_the_mean_is_as_wide_as_students_t_says() {
        let values = [1.0, 2.0, 3.0, 4.0, 10.0];
        let rows = ["a", "b", "c", "d", "e"].into_iter().zip(values);
        let table = of_surfaces(
            &rows
                .map(|(name, area)| (name, 0.1, area))
                .collect::<Vec<_>>(),
        );
        let asked = groups(&[Statistic::Confidence(0.95), Statistic::Mean, Statistic::Sem]);
        let reduced = reduce(&table, &asked).unwrap();
        // 4 ± 2.7764 √(50/4/5), with Student's t of four degrees of freedom from tables.
        let [lower, upper] = interval(&reduced);
        assert!((lower - (4.0 - 4.389_938)).abs() < 1e-5, "{lower}");
        assert!((upper - (4.0 + 4.389_938)).abs() < 1e-5, "{upper}");
        let names = reduced.names();
        let place = |name: &str| names.iter().position(|known| *known == name).unwrap();
        assert!(place("area_fraction_ci95_upper") < place("area_fraction_mean"));
        assert_eq!(names.len(), 6, "{names:?}");
    }

    #[test]
    fn an_interval_rests_on_surfaces_and_not_on_rows() {
        // Each surface thrice, under loads that are no group of their own.
        let loads = [0.1, 0.2, 0.3];
        let surfaces = [("a", 1.0), ("b", 2.0), ("c", 6.0)];
        let rows = surfaces
            .iter()
            .flat_map(|&(name, area)| loads.map(|load| (name, load, area)));
        let asked = Groups {
            group_by: Some(vec!["unit".to_owned()]),
            ..groups(&[Statistic::Confidence(0.95)])
        };
        let unit = Column::parameter("unit", ColumnKind::Text, "", "unit");
        let all = of_surfaces(&rows.collect::<Vec<_>>());
        let all = all.with(vec![(unit, texts(["m"; 9]))]);
        let once = all.pick(&[0, 3, 6]);
        let [thrice, once] = [all, once].map(|table| interval(&reduce(&table, &asked).unwrap()));
        for (one, other) in thrice.into_iter().zip(once) {
            assert!((one - other).abs() < 1e-12, "{thrice:?} {once:?}");
        }
    }

    #[test]
    fn a_single_surface_has_no_interval_and_where_none_are_named_rows_count() {
        let asked = groups(&[Statistic::Confidence(0.95)]);
        let reduced = reduce(&of_surfaces(&[("a", 0.1, 0.2)]), &asked).unwrap();
        let lower = reduced.reals("area_fraction_ci95_lower").unwrap();
        assert!(lower.is_null(0));
        let reduced = reduce(&table(), &asked).unwrap();
        // Two rows 0.2 apart: 0.3 ± 12.706 × 0.1.
        let lower = column(&reduced, "area_fraction_ci95_lower")[2];
        assert!((lower - (0.3 - 1.270_620)).abs() < 1e-5, "{lower}");
    }

    #[test]
    fn slopes_are_differences_of_the_mean_curve_from_zero_on() {
        let reduced = reduce(&table(), &groups(&[Statistic::Slope, Statistic::Secant])).unwrap();
        let close = |name: &str, expected: [f64; 4]| {
            let pairs = column(&reduced, name).into_iter().zip(expected);
            assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12), "{name}");
        };
        close("load_midpoint", [0.05, 0.15, 0.05, 0.15]);
        close("area_fraction_slope", [1.0, 1.0, 3.0, 2.0]);
        close("area_fraction_secant", [1.0, 1.0, 3.0, 2.5]);
    }

    #[test]
    fn a_line_through_the_rows_of_a_group_has_their_slope_and_intercept() {
        let of_spectra = |table: &Table| {
            let asked = Groups {
                group_by: Some(vec!["hurst".to_owned()]),
                ..groups(&[Statistic::RegressionSlope, Statistic::RegressionIntercept])
            };
            reduce(table, &asked).unwrap()
        };
        let reduced = of_spectra(&table());
        let close = |name: &str, expected: [f64; 2]| {
            let found = column(&reduced, &format!("area_fraction_regr_{name}"));
            let pairs = found.iter().zip(expected);
            assert!(
                pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12),
                "{name} {found:?}"
            );
        };
        // The means of the wider spectrum are 0.3 and 0.5, those of the other 0.1 and 0.2.
        close("slope", [1.0, 2.0]);
        close("intercept", [0.0, 0.1]);
        let one_load = of_spectra(&table().pick(&[0, 2, 4, 6]));
        for name in ["area_fraction_regr_slope", "area_fraction_regr_intercept"] {
            assert_eq!(one_load.reals(name).unwrap().null_count(), 2, "{name}");
        }
    }

    #[test]
    fn a_row_that_two_blocks_share_counts_once() {
        let named = table().with(vec![(
            SURFACE,
            texts(["a", "a", "b", "b", "c", "c", "d", "d"]),
        )]);
        let twice = Table::stack(&[named.clone(), named.clone()]).unwrap();
        let asked = groups(&[Statistic::Mean, Statistic::Sd]);
        let reduced = |table: &Table| reduce(table, &asked).unwrap();
        assert_eq!(reduced(&twice), reduced(&named));
    }

    #[test]
    fn a_curve_ends_where_its_first_surface_is_in_full_contact() {
        // The second surface of the first spectrum has no second load.
        let shorter = table().pick(&[0, 1, 2, 4, 5, 6, 7]);
        let reduced = reduce(&shorter, &groups(&[Statistic::Mean])).unwrap();
        assert_eq!(column(&reduced, "hurst"), [0.3, 0.3, 0.8]);
        assert_eq!(column(&reduced, "load"), [0.1, 0.2, 0.1]);
    }

    #[test]
    fn rows_that_did_not_converge_are_counted() {
        let reduced = reduce(&table(), &groups(&[Statistic::Mean])).unwrap();
        let unconverged = reduced.integers("unconverged").unwrap();
        assert_eq!(unconverged.values(), &[0, 1, 0, 0]);
    }

    #[test]
    fn fits_that_failed_are_counted_and_enter_no_statistic() {
        let exponent = Column::result("exponent", ColumnKind::Real, "1", "");
        let columns = vec![
            (HURST, reals([0.3, 0.8, 0.8, 0.8])),
            (
                exponent,
                optional_reals([None, Some(-0.7), None, Some(-0.9)]),
            ),
            (STATUS, texts(["too few", FITTED, "not converged", FITTED])),
        ];
        let asked = Groups {
            over: vec!["exponent".to_owned()],
            ..groups(&[Statistic::Mean, Statistic::Sem, Statistic::Min])
        };
        let reduced = reduce(&Table::new(4, columns), &asked).unwrap();
        assert_eq!(reduced.integers("count").unwrap().values(), &[1, 3]);
        assert_eq!(reduced.integers("unfitted").unwrap().values(), &[1, 1]);
        let close = |name: &str, expected: f64| {
            let found = reduced.reals(name).unwrap();
            assert!(found.is_null(0) && (found.value(1) - expected).abs() < 1e-15);
        };
        close("exponent_mean", -0.8);
        close("exponent_sem", 0.1);
        close("exponent_min", -0.9);
    }

    #[test]
    fn a_missing_column_is_named() {
        let mut asked = groups(&[Statistic::Mean]);
        asked.over = vec!["arae".to_owned()];
        let error = reduce(&table(), &asked).unwrap_err();
        assert_eq!(
            error.to_string(),
            "cannot aggregate: the input has no column `arae`"
        );
    }

    #[test]
    fn reduced_columns_say_what_they_mean() {
        let reduced = reduce(&table(), &groups(&[Statistic::Mean])).unwrap();
        let schema = reduced.batch().schema();
        let field = schema.field_with_name("area_fraction_mean").unwrap();
        assert_eq!(
            field.metadata()["meaning"],
            "mean of: share of the nodes in contact"
        );
        let reduced = reduce(&table(), &groups(&[Statistic::Confidence(0.9)])).unwrap();
        let schema = reduced.batch().schema();
        let field = schema.field_with_name("area_fraction_ci90_lower").unwrap();
        assert_eq!(
            field.metadata()["meaning"],
            "lower end of the 90 % confidence interval, by Student's t over surfaces, of the mean \
             of: share of the nodes in contact"
        );
        assert_eq!(field.metadata()["unit"], "1");
    }
}
