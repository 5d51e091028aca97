//! Statistics of small tables whose results are known.

use arrow::array::Array;

use super::*;
use crate::columns::{LOAD, PRESSURE, REALIZATION, SEED, SURFACE};
use asperity_statistics::random::normal;
use asperity_tables::column::ColumnKind;
use asperity_tables::column::{integers, optional_reals, reals, texts};

const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");
/// Returns a table of two spectra with two surfaces each under two loads, with round areas.
fn table() -> Table {
    Table::new(
        8,
        vec![
            (HURST, reals([0.8, 0.8, 0.8, 0.8, 0.3, 0.3, 0.3, 0.3])),
            (REALIZATION, integers([0, 0, 1, 1, 0, 0, 1, 1])),
            (LOAD, reals([0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2])),
            (AREA_FRACTION, reals([0.2, 0.3, 0.4, 0.7, 0.1, 0.2, 0.1, 0.2])),
            (STOP, texts(["converged"; 7].into_iter().chain(["pair-limit"]))),
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
fn statistics_of_the_rows_of_a_group_are_exact() {
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

/// Returns a table of surfaces from their names, loads and area fractions.
fn of_surfaces(rows: &[(&str, f64, f64)]) -> Table {
    Table::new(
        rows.len(),
        vec![
            (SURFACE, texts(rows.iter().map(|row| row.0))),
            (REALIZATION, integers(rows.iter().map(|row| i64::from(row.0.as_bytes()[0])))),
            (LOAD, reals(rows.iter().map(|row| row.1))),
            (AREA_FRACTION, reals(rows.iter().map(|row| row.2))),
        ],
    )
}

fn interval(reduced: &Table) -> [f64; 2] {
    ["lower", "upper"].map(|end| column(reduced, &format!("area_fraction_ci95_{end}"))[0])
}

#[test]
fn the_interval_of_the_mean_is_that_of_students_t() {
    let values = [1.0, 2.0, 3.0, 4.0, 10.0];
    let rows = ["a", "b", "c", "d", "e"].into_iter().zip(values);
    let table = of_surfaces(&rows.map(|(name, area)| (name, 0.1, area)).collect::<Vec<_>>());
    let asked = groups(&[Statistic::Confidence(0.95), Statistic::Mean, Statistic::Sem]);
    let reduced = reduce(&table, &asked).unwrap();
    // 4 ± 2.7764 √(50/4/5), with tabulated Student's t for four degrees of freedom.
    let [lower, upper] = interval(&reduced);
    assert!((lower - (4.0 - 4.389_938)).abs() < 1e-5, "{lower}");
    assert!((upper - (4.0 + 4.389_938)).abs() < 1e-5, "{upper}");
    let names = reduced.names();
    let index = |name: &str| names.iter().position(|known| *known == name).unwrap();
    assert!(index("area_fraction_ci95_upper") < index("area_fraction_mean"));
    assert_eq!(names.len(), 7, "{names:?}");
}

#[test]
fn an_interval_rests_on_surfaces_and_not_on_rows() {
    // Three rows per surface, under three loads that belong to one group.
    let loads = [0.1, 0.2, 0.3];
    let surfaces = [("a", 1.0), ("b", 2.0), ("c", 6.0)];
    let rows = surfaces.iter().flat_map(|&(name, area)| loads.map(|load| (name, load, area)));
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

/// Returns a table of three surfaces of unequal rms slope under two pressures in pascals.
fn in_pascals() -> Table {
    let pressure = PRESSURE.with_role(Role::Load);
    let load = LOAD.with_role(Role::Derived);
    let reduced = [0.11, 0.22, 0.1, 0.2, 0.09, 0.18];
    Table::new(
        6,
        vec![
            (SURFACE, texts(["a", "a", "b", "b", "c", "c"])),
            (REALIZATION, integers([0, 0, 1, 1, 2, 2])),
            (load, reals(reduced)),
            (pressure, reals([1e8, 2e8, 1e8, 2e8, 1e8, 2e8])),
            (AREA_FRACTION, reals(reduced.map(|load| 2.0 * load))),
        ],
    )
}

#[test]
fn loads_in_pascals_define_groups_of_surfaces_with_unequal_slopes() {
    let asked = [Statistic::Mean, Statistic::Slope, Statistic::Secant];
    for named in [None, Some(vec!["pressure".to_owned()])] {
        let asked = Groups { group_by: named, ..groups(&asked) };
        let reduced = reduce(&in_pascals(), &asked).unwrap();
        assert_eq!(column(&reduced, "pressure"), [1e8, 2e8]);
        assert_eq!(reduced.integers("surfaces").unwrap().values(), &[3, 3]);
        // Slopes and secants are against the mean reduced load.
        for name in ["area_fraction_slope", "area_fraction_secant"] {
            let found = column(&reduced, name);
            assert!(found.iter().all(|one| (one - 2.0).abs() < 1e-12), "{found:?}");
        }
    }
    let reduced = reduce(&in_pascals(), &groups(&[Statistic::Mean])).unwrap();
    let loads = column(&reduced, "load");
    assert!((loads[0] - 0.1).abs() < 1e-15 && (loads[1] - 0.2).abs() < 1e-15);
}

#[test]
fn derived_reduced_loads_define_groups_only_if_all_surfaces_agree() {
    let asked = Groups { group_by: Some(vec!["load".to_owned()]), ..groups(&[Statistic::Mean]) };
    let error = reduce(&in_pascals(), &asked).unwrap_err().to_string();
    assert!(error.contains("group by `pressure`"), "{error}");
    let alike = reals([0.1, 0.2, 0.1 * (1.0 + 1e-12), 0.2, 0.1, 0.2]);
    let reduced = reduce(&in_pascals().replacing("load", alike), &asked).unwrap();
    assert_eq!(column(&reduced, "load"), [0.1, 0.2]);
}

/// Returns one sweep over several points for each experiment, with a seed for each experiment. The
/// deviation of an area is the sum of a deviation of its surface, equal at all points, and a
/// deviation of its row.
fn sweeps(experiments: usize, points: usize, surfaces: usize) -> Table {
    let mut cells = Vec::new();
    for experiment in 0..experiments {
        let shared = normal(experiment as u64, surfaces * (points + 1));
        for point in 0..points {
            for surface in 0..surfaces {
                let own = shared[surfaces * (point + 1) + surface];
                let area = shared[surface] + 0.5 * own;
                cells.push((experiment, point, surface, area));
            }
        }
    }
    let experiment = Column::parameter("experiment", ColumnKind::Integer, "", "experiment");
    let whole = |value: fn(&(usize, usize, usize, f64)) -> usize| {
        integers(cells.iter().map(|cell| value(cell) as i64).collect::<Vec<_>>())
    };
    let name = |(experiment, point, surface, _): &_| format!("{experiment} {point} {surface}");
    Table::new(
        cells.len(),
        vec![
            (SURFACE, texts(cells.iter().map(name))),
            (experiment, whole(|cell| cell.0)),
            (HURST, reals(cells.iter().map(|cell| cell.1 as f64))),
            (SEED, whole(|cell| cell.0)),
            (REALIZATION, whole(|cell| cell.2)),
            (AREA_FRACTION, reals(cells.iter().map(|cell| cell.3))),
        ],
    )
}

fn over_points(statistics: &[Statistic]) -> Groups {
    Groups { group_by: Some(vec!["experiment".to_owned()]), ..groups(statistics) }
}

#[test]
fn errors_over_a_sweep_are_those_of_the_means_of_its_surfaces() {
    let table = sweeps(1, 8, 20);
    let reduced = reduce(&table, &over_points(&[Statistic::Sem])).unwrap();
    let values = table.reals("area_fraction").unwrap().values();
    let mean = |surface: usize| (0..8).map(|point| values[20 * point + surface]).sum::<f64>() / 8.0;
    let means: Vec<f64> = (0..20).map(mean).collect();
    let of_all = means.iter().sum::<f64>() / 20.0;
    let squares: f64 = means.iter().map(|mean| (mean - of_all).powi(2)).sum();
    let expected = (squares / 19.0 / 20.0).sqrt();
    let found = column(&reduced, "area_fraction_sem")[0];
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    assert_eq!(reduced.integers("count").unwrap().values(), &[160]);
    assert_eq!(reduced.integers("surfaces").unwrap().values(), &[20]);
}

#[test]
fn intervals_over_a_sweep_cover_its_mean_at_the_nominal_rate() {
    let experiments = 2000;
    let asked = over_points(&[Statistic::Confidence(0.95)]);
    let reduced = reduce(&sweeps(experiments, 8, 20), &asked).unwrap();
    let [lower, upper] =
        ["lower", "upper"].map(|end| column(&reduced, &format!("area_fraction_ci95_{end}")));
    let ends = lower.iter().zip(&upper);
    let covered = ends.filter(|(lower, upper)| **lower <= 0.0 && 0.0 <= **upper);
    // Binomial: 0.005 over 2000 experiments. Counting rows as independent covers 0.55.
    let rate = covered.count() as f64 / experiments as f64;
    assert!((0.93..=0.97).contains(&rate), "{rate}");
}

#[test]
fn a_single_surface_has_no_interval_and_rows_without_surfaces_count_singly() {
    let asked = groups(&[Statistic::Confidence(0.95)]);
    let reduced = reduce(&of_surfaces(&[("a", 0.1, 0.2)]), &asked).unwrap();
    let lower = reduced.reals("area_fraction_ci95_lower").unwrap();
    assert!(lower.is_null(0));
    let reduced = reduce(&table(), &asked).unwrap();
    // Two rows that differ by 0.2: 0.3 ± 12.706 × 0.1.
    let lower = column(&reduced, "area_fraction_ci95_lower")[2];
    assert!((lower - (0.3 - 1.270_620)).abs() < 1e-5, "{lower}");
}

#[test]
fn slopes_are_differences_of_the_mean_curve_starting_at_the_origin() {
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
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12), "{name} {found:?}");
    };
    // The means are 0.1 and 0.2 for H = 0.3, and 0.3 and 0.5 for H = 0.8.
    close("slope", [1.0, 2.0]);
    close("intercept", [0.0, 0.1]);
    let one_load = of_spectra(&table().pick(&[0, 2, 4, 6]));
    for name in ["area_fraction_regr_slope", "area_fraction_regr_intercept"] {
        assert_eq!(one_load.reals(name).unwrap().null_count(), 2, "{name}");
    }
}

#[test]
fn a_row_in_two_stages_counts_once() {
    let named = table().with(vec![(SURFACE, texts(["a", "a", "b", "b", "c", "c", "d", "d"]))]);
    let twice = Table::stack(&[named.clone(), named.clone()]).unwrap();
    let asked = groups(&[Statistic::Mean, Statistic::Sd]);
    let reduced = |table: &Table| reduce(table, &asked).unwrap();
    assert_eq!(reduced(&twice), reduced(&named));
}

#[test]
fn a_curve_leaves_out_loads_at_which_a_surface_has_no_row() {
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
        (exponent, optional_reals([None, Some(-0.7), None, Some(-0.9)])),
        (STATUS, texts(["too-few-data", FITTED.word, "not-converged", FITTED.word])),
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
    assert_eq!(error.to_string(), "cannot aggregate: the input has no column `arae`");
}

#[test]
fn reduced_columns_describe_themselves() {
    let reduced = reduce(&table(), &groups(&[Statistic::Mean])).unwrap();
    let schema = reduced.batch().schema();
    let field = schema.field_with_name("area_fraction_mean").unwrap();
    assert_eq!(field.metadata()["meaning"], "mean of: fraction of the nodes in contact");
    let reduced = reduce(&table(), &groups(&[Statistic::Confidence(0.9)])).unwrap();
    let schema = reduced.batch().schema();
    let field = schema.field_with_name("area_fraction_ci90_lower").unwrap();
    assert_eq!(
        field.metadata()["meaning"],
        "lower end of the 90 % confidence interval, by Student's t over surfaces, of the mean \
         of: fraction of the nodes in contact"
    );
    assert_eq!(field.metadata()["unit"], "1");
}
