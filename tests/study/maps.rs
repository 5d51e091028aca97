//! Maps of tasks in the library: heights, contact, pressures, gaps and displacements.

use std::f64::consts::PI;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use asperity::session::{Coordinate, Map, MapKind, Session, SessionError};

use crate::bench::{Bench, STUDY};
use crate::manifest::manifest;

/// Sinusoidal surface with two waves along y. The last load is 1.1 times the load of full contact,
/// p* = π E* Δ/λ with λ = 3/2.
static WAVE: LazyLock<String> = LazyLock::new(|| {
    manifest("wave", "")
        .generate("surface", "method = 'wave'; nodes = 64; side = 3.0; amplitude = 0.01; waves = 2")
        .solve(
            "contact",
            "effective_modulus = 5.0; load_unit = 'absolute'; \
             loads = [0.02, 0.05, 0.11519173063162576]",
        )
        .text()
});

fn map(bench: &Bench, stage: &str, kind: MapKind, load: Option<f64>) -> Map {
    found(bench, stage, &[], kind, load).unwrap()
}

fn found(
    bench: &Bench,
    stage: &str,
    coordinates: &[&str],
    kind: MapKind,
    load: Option<f64>,
) -> Result<Map, SessionError> {
    let session = Session::new(bench.path("study.toml"), bench.data());
    let coordinates: Vec<Coordinate> =
        coordinates.iter().map(|word| word.parse().unwrap()).collect();
    session.map(stage, &coordinates, kind, load.map(Into::into), &AtomicBool::new(false))
}

#[test]
fn a_wave_in_full_contact_has_the_pressures_and_displacements_of_its_closed_form() {
    let bench = Bench::new();
    bench.run(&WAVE);
    let [heights, pressures, gap, displacement, contact] = [
        MapKind::Heights,
        MapKind::Pressures,
        MapKind::Gap,
        MapKind::Displacement,
        MapKind::Contact,
    ]
    .map(|kind| map(&bench, "contact", kind, None).values);
    let (mean, full) = (0.11519173063162576, PI * 5.0 * 0.01 / 1.5);
    for node in 0..heights.len() {
        let expected = mean + full * heights[node] / 0.01;
        assert!((pressures[node] - expected).abs() < 1e-10);
        assert!((displacement[node] - heights[node]).abs() < 1e-12);
        assert_eq!((gap[node], contact[node]), (0.0, 1.0));
    }
}

#[test]
fn the_gap_of_a_partly_flattened_wave_is_a_constant_plus_displacement_minus_height() {
    let bench = Bench::new();
    bench.run(&WAVE);
    let at = |kind| map(&bench, "contact", kind, Some(0.05)).values;
    let heights = map(&bench, "contact", MapKind::Heights, None).values;
    let (pressures, gap) = (at(MapKind::Pressures), at(MapKind::Gap));
    let (displacement, contact) = (at(MapKind::Displacement), at(MapKind::Contact));
    let rigid = |node: usize| gap[node] - displacement[node] + heights[node];
    let apart: Vec<usize> = (0..gap.len()).filter(|node| pressures[*node] == 0.0).collect();
    assert!(!apart.is_empty() && apart.len() < gap.len());
    assert!(apart.iter().all(|node| (rigid(*node) - rigid(apart[0])).abs() < 1e-12));
    for node in 0..gap.len() {
        assert!(pressures[node] >= 0.0 && gap[node] >= -1e-7 && pressures[node] * gap[node] == 0.0);
        assert_eq!(contact[node] == 1.0, pressures[node] > 0.0);
    }
    let mean = pressures.iter().sum::<f64>() / pressures.len() as f64;
    assert!((mean - 0.05).abs() < 1e-12);
}

#[test]
fn pressures_are_the_same_whether_they_are_stored_or_computed_again() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let pressures = || {
        let coordinates = ["k_upper=8", "realization=1"];
        found(&bench, "light", &coordinates, MapKind::Pressures, Some(0.05)).unwrap()
    };
    let computed = pressures();
    bench.run(&STUDY.replace("[stage.area]", "pressures = \"all\"\n\n[stage.area]"));
    assert_eq!(pressures(), computed);
    assert_eq!((computed.load, computed.load_column), (Some(0.05), Some("load")));
    assert_eq!(computed.grid.nodes(), [32, 32]);
}

#[test]
fn loads_of_other_studies_in_the_store_are_not_among_those_of_this_study() {
    let bench = Bench::new();
    bench.run(&STUDY);
    bench.run(&STUDY.replace("loads = { to = 0.1, steps = 4 }", "loads = [0.025, 0.05]"));
    let at = |load| found(&bench, "light", &["k_upper=8", "realization=1"], MapKind::Contact, load);
    assert_eq!(at(None).unwrap().load, Some(0.05));
    let refused = at(Some(0.1)).unwrap_err().to_string();
    assert!(refused.contains("the nearest is 0.05"), "{refused}");
}

#[test]
fn a_map_of_a_surface_has_no_load_and_an_unknown_load_is_refused_with_the_nearest() {
    let bench = Bench::new();
    bench.run(&WAVE);
    let heights = map(&bench, "surface", MapKind::Heights, None);
    assert_eq!((heights.load, heights.length_unit), (None, None));
    let refused = |stage, kind, load| found(&bench, stage, &[], kind, load).unwrap_err();
    let unknown = refused("contact", MapKind::Gap, Some(0.07)).to_string();
    assert!(unknown.contains("the nearest are 0.05 and 0.115192"), "{unknown}");
    let no_contact = refused("surface", MapKind::Gap, None).to_string();
    assert!(no_contact.contains("generates a surface and has no gap"), "{no_contact}");
}

#[test]
fn an_asperity_model_has_pressures_but_no_gap() {
    let bench = Bench::new();
    let asperities = "method = \"asperities\"\n\n[stage.area]";
    bench.run(&STUDY.replace("[stage.area]", asperities));
    let at = |kind| found(&bench, "light", &["k_upper=8", "realization=1"], kind, Some(0.05));
    let (pressures, contact) = (at(MapKind::Pressures).unwrap(), at(MapKind::Contact).unwrap());
    let pairs = pressures.values.iter().zip(&contact.values);
    assert!(pairs.into_iter().all(|(pressure, touches)| (*pressure > 0.0) == (*touches == 1.0)));
    let refused = at(MapKind::Gap).unwrap_err().to_string();
    assert!(refused.contains("an asperity model has no map of the gap"), "{refused}");
}
