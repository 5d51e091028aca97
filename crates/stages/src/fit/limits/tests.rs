//! Fits of synthetic tables whose limits are known.

use std::sync::Arc;

use arrow::array::Array;

use super::*;
use crate::columns::{
    AREA_FRACTION, HURST, K_UPPER, LOAD, MEAN_GAP, NODES, REALIZATION, STOP, SURFACE,
};
use crate::fit::laws::Law;
use crate::fit::{Params, fitted};
use asperity_tables::column::{Column, ColumnKind, integers, optional_reals, reals, texts};

const LOADS: [f64; 3] = [0.01, 0.02, 0.05];

/// Row of a table of contacts.
struct FittedPoint {
    hurst: f64,
    k_lower: i64,
    k_upper: i64,
    realization: i64,
    load: f64,
}

/// Returns κ = 2 + H + 0.5/k_lower − 0.8 √(k_lower/k_upper) plus the deviation of the surface.
fn kappa(row: &FittedPoint) -> f64 {
    let (lower, upper) = (row.k_lower as f64, row.k_upper as f64);
    let own = 0.02 * (row.realization as f64 - 1.5) / lower;
    2.0 + row.hurst + 0.5 / lower - 0.8 * (lower / upper).sqrt() + own
}

fn table() -> Table {
    let mut rows = Vec::new();
    for hurst in [0.5, 0.8] {
        for k_lower in [1, 2, 4] {
            for ratio in [4, 8, 16] {
                for realization in 0..4 {
                    rows.extend(LOADS.map(|load| FittedPoint {
                        hurst,
                        k_lower,
                        k_upper: ratio * k_lower,
                        realization,
                        load,
                    }));
                }
            }
        }
    }
    let whole = |value: fn(&FittedPoint) -> i64| integers(rows.iter().map(value));
    let real =
        |value: &dyn Fn(&FittedPoint) -> f64| reals(rows.iter().map(value).collect::<Vec<_>>());
    Table::new(
        rows.len(),
        vec![
            (SURFACE, texts(vec!["one"; rows.len()])),
            (HURST, real(&|row| row.hurst)),
            (K_LOWER, whole(|row| row.k_lower)),
            (K_ROLLOFF, whole(|row| row.k_lower)),
            (K_UPPER, whole(|row| row.k_upper)),
            (NODES, whole(|row| 8 * row.k_upper)),
            (REALIZATION, whole(|row| row.realization)),
            (LOAD, real(&|row| row.load)),
            (AREA_FRACTION, real(&|row| kappa(row) * row.load)),
            (MEAN_GAP, real(&|row| 1.0 - kappa(row) * row.load)),
            (STOP, texts(vec!["converged"; rows.len()])),
        ],
    )
}

fn choices(of: &str) -> LimitChoices {
    let term = |of: &str, forms: &[FormChoice]| Term {
        of: Expression::parse(of).unwrap(),
        forms: forms.to_vec(),
    };
    LimitChoices {
        of: Expression::parse(of).unwrap(),
        loads: Vec::new(),
        terms: vec![
            term("1 / k_lower", &[FormChoice::Power(1.0)]),
            term("k_lower / k_upper", &[FormChoice::Power(0.5), FormChoice::Logarithm]),
        ],
        over: ["k_lower", "k_upper", "nodes"].map(str::to_owned).into(),
        error: None,
    }
}

fn params(choices: LimitChoices) -> Params {
    Params {
        law: Law::Limits(Arc::new(choices)),
        window: WINDOW,
        bootstrap: 40,
        level: 0.9,
        seed: 1,
    }
}

#[test]
fn a_recipe_is_serialised_in_a_fixed_format() {
    let written = serde_json::to_string(&params(choices("area_fraction/load"))).unwrap();
    let expected = r#"{"law":"limits","of":"area_fraction / load","terms":[{"of":"1 / k_lower","forms":[{"power":1.0}]},{"of":"k_lower / k_upper","forms":[{"power":0.5},"logarithm"]}],"over":["k_lower","k_upper","nodes"],"window":[0.0,10.0],"bootstrap":40,"level":0.9,"seed":1}"#;
    assert_eq!(written, expected);
}

#[test]
fn every_group_is_fitted_under_every_load_with_every_combination_of_forms() {
    let fitted = fitted(&params(choices("area_fraction / load")), &table()).unwrap();
    assert_eq!(fitted.rows(), 2 * 3 * 2);
    assert!(!fitted.has("k_lower") && !fitted.has("nodes") && !fitted.has("k_rolloff"));
    assert_eq!(fitted.reals("rolloff_ratio").unwrap().value(0), 1.0);
    let forms = fitted.texts("form_2").unwrap();
    let (hurst, limits) = (fitted.reals("hurst").unwrap(), fitted.reals("limit").unwrap());
    let coefficients = fitted.reals("coefficient_2").unwrap();
    let exact = (0..fitted.rows()).filter(|&row| forms.value(row) == "power 0.5");
    for row in exact {
        assert!((limits.value(row) - 2.0 - hurst.value(row)).abs() < 1e-9);
        assert!((coefficients.value(row) + 0.8).abs() < 1e-9);
        let lower = fitted.reals("limit_lower").unwrap().value(row);
        let upper = fitted.reals("limit_upper").unwrap().value(row);
        assert!(lower < limits.value(row) && limits.value(row) < upper);
        assert_eq!(fitted.integers("data").unwrap().value(row), 9);
        assert_eq!(fitted.integers("surfaces").unwrap().value(row), 4);
        assert!(fitted.reals("akaike_weight").unwrap().value(row) > 0.5);
        assert!(fitted.reals("exponent_2_lower").unwrap().is_null(row));
    }
}

#[test]
fn surfaces_with_the_same_deviation_at_all_points_have_it_in_the_limit() {
    // The deviation of each surface is a multiple of 0.02 at all points, and also in the limit.
    let table = table();
    let own = table.integers("realization").unwrap();
    let areas = table.reals("area_fraction").unwrap();
    let loads = table.reals("load").unwrap();
    let (lower, scatter) = (table.integers("k_lower").unwrap(), 0.02);
    let shifted = (0..table.rows()).map(|row| {
        let realization = own.value(row) as f64 - 1.5;
        let without =
            areas.value(row) / loads.value(row) - 0.02 * realization / lower.value(row) as f64;
        (without + scatter * realization) * loads.value(row)
    });
    let shifted = table.replacing("area_fraction", reals(shifted.collect::<Vec<_>>()));
    let mut params = params(choices("area_fraction / load"));
    params.bootstrap = 4000;
    let fitted = fitted(&params, &shifted).unwrap();
    let error = fitted.reals("limit_standard_error").unwrap().value(0);
    // Standard deviation of −1.5, −0.5, 0.5, 1.5, divided by √4.
    let known = scatter * (5.0_f64 / 3.0).sqrt() / 2.0;
    assert!((error / known - 1.0).abs() < 0.05, "{error} {known}");
    assert!(fitted.reals("coefficient_1_standard_error").unwrap().value(0) < 1e-9);
}

#[test]
fn stiffness_comes_from_neighbouring_loads() {
    let fitted = fitted(&params(choices("-slope(mean_gap)")), &table()).unwrap();
    let limits = fitted.reals("limit").unwrap();
    assert!((limits.value(0) - 2.5).abs() < 1e-8, "{}", limits.value(0));
}

#[test]
fn a_point_without_the_load_is_left_out_and_too_few_points_are_reported() {
    let table = table();
    let loads = table.reals("load").unwrap();
    let uppers = table.integers("k_upper").unwrap();
    let keep = (0..table.rows()).filter(|&row| loads.value(row) < 0.03 || uppers.value(row) != 16);
    let table = table.pick(&keep.collect::<Vec<_>>());
    let mut choices = choices("area_fraction / load");
    choices.loads = vec![0.02, 0.05, 0.3];
    let fitted = fitted(&params(choices), &table).unwrap();
    let data = fitted.integers("data").unwrap();
    assert_eq!([0, 2, 4].map(|row| data.value(row)), [9, 6, 0]);
    let status = fitted.texts("status").unwrap();
    assert_eq!(status.value(0), "fitted");
    assert_eq!(status.value(4), "too-few-points");
}

#[test]
fn a_fitted_parameter_is_weighted_by_its_standard_error() {
    const KAPPA: Column = Column::result("kappa", ColumnKind::Real, "1", "κ");
    const ERROR: Column = Column::result("kappa_standard_error", ColumnKind::Real, "1", "error");
    const SURFACES: Column = Column::result("surfaces", ColumnKind::Integer, "1", "surfaces");
    const LAW: Column = Column::parameter("law", ColumnKind::Text, "", "the law");
    let lower = [1, 2, 4, 8, 16];
    let fits = Table::new(
        5,
        vec![
            (K_LOWER, integers(lower)),
            (LAW, texts(vec!["contact-evolution"; 5])),
            (KAPPA, optional_reals(lower.map(|k| (k < 16).then_some(2.0 + 1.0 / k as f64)))),
            (ERROR, reals(vec![0.1; 5])),
            (SURFACES, integers(vec![20; 5])),
        ],
    );
    let choices = LimitChoices {
        terms: choices("kappa").terms[..1].to_vec(),
        over: ["k_lower".to_owned()].into(),
        error: Some("kappa_standard_error".to_owned()),
        ..choices("kappa")
    };
    let fitted = fitted(&params(choices), &fits).unwrap();
    // A failed fit is not a point.
    assert_eq!(fitted.integers("data").unwrap().value(0), 4);
    assert!((fitted.reals("limit").unwrap().value(0) - 2.0).abs() < 1e-12);
    assert_eq!(fitted.texts("law").unwrap().value(0), "limits");
}
