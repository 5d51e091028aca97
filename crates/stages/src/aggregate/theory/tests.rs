//! Tests of the columns of theories and of the approach to full contact.

use super::*;
use crate::aggregate::grouped as reduce;
use crate::columns::{AREA_FRACTION, LOAD};
use asperity_mechanics::grid::Cell;
use asperity_tables::column::{ColumnKind, integers, reals, texts};

/// Returns a table of two surfaces of one spectrum that follow Persson's theory. The second surface
/// has no row under the last load, as if it were already in full contact.
fn table() -> Table {
    let loads = [0.06, 1.0, 1.5, 2.0, 0.06, 1.0, 1.5];
    let areas = loads.iter().map(|&load| persson::area(load));
    let rows = loads.len();
    Table::new(
        rows,
        vec![
            (HURST, reals(vec![0.8; rows])),
            (K_LOWER, integers(vec![4; rows])),
            (K_ROLLOFF, integers(vec![4; rows])),
            (K_UPPER, integers(vec![32; rows])),
            (LOAD, reals(loads)),
            (AREA_FRACTION, reals(areas)),
        ],
    )
}

fn groups(statistics: &[Statistic], models: &[Model]) -> Groups {
    Groups {
        group_by: None,
        over: vec![AREA_FRACTION.name.to_owned()],
        statistics: statistics.to_vec(),
        models: models.to_vec(),
    }
}

fn column(reduced: &Table, name: &str) -> Vec<Option<f64>> {
    reduced.reals(name).unwrap().iter().collect()
}

#[test]
fn every_model_has_a_column_with_its_area_under_the_load_of_the_row() {
    let models = [
        Model::Persson,
        Model::BushGibsonThomas,
        Model::Greenwood2006,
        Model::MeanCurvature,
        Model::GreenwoodMccool,
        Model::BgtAsymptote,
        Model::PennyCrack,
    ];
    let reduced = reduce(&table(), &groups(&[Statistic::Mean], &models)).unwrap();
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 32, anisotropy: None };
    let nayak = spectrum.moments(Cell::square(1.0).unwrap()).nayak().unwrap();
    for model in models {
        let found = column(&reduced, model.columns()[0].name)[0].unwrap();
        let exact = match model.asperities() {
            Some(model) => {
                let contact = Asperities::new(model, nayak).unwrap().at_load(0.06);
                contact.unwrap().area
            }
            None if model == Model::BgtAsymptote => 0.06 * (2.0 * std::f64::consts::PI).sqrt(),
            None if model == Model::PennyCrack => {
                1.0 - 0.75 * libm::erfc(0.06 * std::f64::consts::SQRT_2)
            }
            None => libm::erf(0.06 * std::f64::consts::SQRT_2),
        };
        assert!((found - exact).abs() < 1e-12, "{model:?}: {found} {exact}");
    }
    assert!(!reduced.has("area_persson_slope"));
}

#[test]
fn slopes_belong_to_midpoints_and_secants_to_loads() {
    let asked = [Statistic::Slope, Statistic::Secant];
    let reduced = reduce(&table(), &groups(&asked, &[Model::Persson])).unwrap();
    let close = |name: &str, exact: f64| {
        let found = column(&reduced, name)[0].unwrap();
        assert!((found / exact - 1.0).abs() < 1e-14, "{name}");
    };
    close("area_persson_slope", persson::slope(0.03));
    close("area_persson_secant", persson::area(0.06) / 0.06);
}

#[test]
fn the_approach_of_data_and_models_is_exact() {
    let asked = groups(&[Statistic::Approach], &[Model::Persson, Model::PennyCrack]);
    let reduced = reduce(&table(), &asked).unwrap();
    let data = column(&reduced, "area_fraction_approach");
    let model = column(&reduced, "area_persson_approach");
    let cracks = column(&reduced, "area_penny_crack_approach");
    for row in 0..3 {
        // Stored areas are rounded relative to 1, but 1 − a is only 0.0027 at the heaviest load.
        assert!((data[row].unwrap() - model[row].unwrap()).abs() < 1e-12);
        let rest = cracks[row].unwrap() - model[row].unwrap();
        assert!((rest - (4.0_f64 / 3.0).ln()).abs() < 1e-13);
    }
}

#[test]
fn the_approach_is_null_at_full_contact() {
    let asked = groups(&[Statistic::Approach], &[Model::BgtAsymptote]);
    let reduced = reduce(&table(), &asked).unwrap();
    // √(2π) y exceeds 1 for y > 0.4. The last load is missing for one surface.
    assert_eq!(column(&reduced, "area_bgt_asymptote_approach")[1..], [None; 2]);
    let full = Table::new(1, vec![(LOAD, reals([2.0])), (AREA_FRACTION, reals([1.0]))]);
    let reduced = reduce(&full, &groups(&[Statistic::Approach], &[])).unwrap();
    assert_eq!(column(&reduced, "area_fraction_approach"), [None]);
    assert!(!reduced.has("area_fraction mean"));
}

#[test]
fn asperity_models_use_the_nayak_parameter_of_the_modes_of_the_cell() {
    // α is 43.91 for the modes, and 28.33 for continuous wavenumbers, for which the area is 0.0790.
    let table = Table::new(
        1,
        vec![
            (HURST, reals([0.8])),
            (K_LOWER, integers([1])),
            (K_ROLLOFF, integers([1])),
            (K_UPPER, integers([32])),
            (LOAD, reals([0.06])),
            (AREA_FRACTION, reals([0.12])),
        ],
    );
    let asked = groups(&[Statistic::Mean], &[Model::BushGibsonThomas]);
    let found = column(&reduce(&table, &asked).unwrap(), "area_bush_gibson_thomas")[0].unwrap();
    assert!((found - 0.0733).abs() < 0.00005, "{found}");
}

#[test]
fn a_strip_has_other_modes_than_a_square() {
    let table = Table::new(
        2,
        vec![
            (HURST, reals([0.8; 2])),
            (K_LOWER, integers([1; 2])),
            (K_ROLLOFF, integers([1; 2])),
            (K_UPPER, integers([32; 2])),
            (SIDE_X, optional_reals([None, Some(0.25)])),
            (SIDE_Y, optional_reals([None, Some(1.0)])),
            (LOAD, reals([0.06; 2])),
            (AREA_FRACTION, reals([0.12; 2])),
        ],
    );
    let asked = groups(&[Statistic::Mean], &[Model::BushGibsonThomas]);
    let found = column(&reduce(&table, &asked).unwrap(), "area_bush_gibson_thomas");
    assert!(found[0].unwrap() != found[1].unwrap(), "{found:?}");
}

#[test]
fn rows_without_a_spectrum_have_no_asperity_model() {
    const CONTENT: Column = Column::parameter("content", ColumnKind::Text, "", "a file");
    let file = Table::new(
        1,
        vec![(CONTENT, texts(["map"])), (LOAD, reals([0.1])), (AREA_FRACTION, reals([0.2]))],
    );
    let asked = groups(&[Statistic::Mean], &[Model::BushGibsonThomas]);
    let both = Table::stack(&[table(), file.clone()]).unwrap();
    let reduced = reduce(&both, &asked).unwrap();
    assert_eq!(reduced.reals("area_bush_gibson_thomas").unwrap().null_count(), 1);
    let error = reduce(&file, &asked).unwrap_err();
    assert!(std::error::Error::source(&error).unwrap().to_string().contains("hurst"));
}
