//! Maps of contacts with adhesion.

use std::sync::atomic::AtomicBool;

use arrow::array::Array;
use asperity::session::{Coordinate, Map, MapKind, Session, SessionError};

use crate::adhesion::study;
use crate::bench::{Bench, real, text};
use crate::manifest::manifest;

/// Returns a map of the states that `words` select, such as `branch=separation`.
fn map(
    bench: &Bench,
    words: &[&str],
    kind: MapKind,
    gap: Option<f64>,
) -> Result<Map, SessionError> {
    let session = Session::new(bench.path("study.toml"), bench.data());
    let coordinates: Vec<Coordinate> = words.iter().map(|word| word.parse().unwrap()).collect();
    session.map("contact", &coordinates, kind, gap.map(Into::into), &AtomicBool::new(false))
}

fn mean(map: &Map) -> f64 {
    map.values.iter().sum::<f64>() / map.values.len() as f64
}

#[test]
fn maps_of_every_state_have_the_means_of_its_row() {
    let bench = Bench::new();
    bench.run(&study("[0.14, 0.10, 0.06, 0.10]"));
    let contact = bench.table("sticky", "contact");
    for row in 0..contact.rows() {
        let step = format!("step={}", row + 1);
        let of = |kind| map(&bench, &[&step], kind, None).unwrap();
        let [pressures, gap] = [MapKind::Pressures, MapKind::Gap].map(of);
        assert!((mean(&pressures) - real(&contact, "pressure", row)).abs() < 1e-12);
        assert!((mean(&gap) - real(&contact, "mean_gap", row)).abs() < 1e-12);
        let [touching, pushed] = [MapKind::Contact, MapKind::Repulsive].map(of);
        for node in 0..gap.values.len() {
            assert_eq!(touching.values[node] == 1.0, gap.values[node] == 0.0);
            assert_eq!(pushed.values[node] == 1.0, pressures.values[node] > 0.0);
            // Outside contact, the pressure is the attraction at the gap.
            let attraction = -0.3 * (-gap.values[node] / 0.02).exp();
            let is_attraction = (pressures.values[node] - attraction).abs() < 1e-15;
            assert!(touching.values[node] == 1.0 || is_attraction);
        }
        assert!(mean(&of(MapKind::Displacement)).abs() < 1e-15);
        assert_eq!(gap.state.unwrap().step, row as i64 + 1);
    }
}

#[test]
fn a_mean_gap_on_two_branches_needs_the_branch() {
    let bench = Bench::new();
    bench.run(&study("[0.14, 0.10, 0.06, 0.10]"));
    let refused = map(&bench, &[], MapKind::Pressures, Some(0.10)).unwrap_err().to_string();
    assert!(refused.contains("2 states of the path match"), "{refused}");
    assert!(refused.contains("approach step=2\n  separation step=4"), "{refused}");
    let of = |branch| map(&bench, &[branch], MapKind::Pressures, Some(0.10)).unwrap();
    let approach = of("branch=approach");
    assert_eq!(approach.state.unwrap().step, 2);
    assert_eq!(of("branch=separation").state.unwrap().step, 4);
    // Without a choice, the state with the smallest mean gap is shown.
    let nearest = map(&bench, &[], MapKind::Pressures, None).unwrap();
    assert_eq!((nearest.load, nearest.load_column), (Some(0.06), Some("mean_gap")));
    let manifest = bench.path("study.toml");
    let picture = bench.path("map.png");
    let view = |options: &[&str]| {
        let start = ["view", manifest.to_str().unwrap(), "contact", "--replace"];
        let output = ["-o", picture.to_str().unwrap()];
        let output = bench.output(&[&start, options, &output[..]].concat());
        (output.status.success(), text(&output.stdout) + &text(&output.stderr))
    };
    let (is_drawn, told) = view(&["branch=separation", "--gap", "0.1", "--map", "pressures"]);
    assert!(is_drawn && told.contains("at mean gap 0.1 on the separation"), "{told}");
    let (is_drawn, told) = view(&["--load", "0.1"]);
    assert!(!is_drawn && told.contains("use `--gap`"), "{told}");
    let (is_drawn, told) = view(&["--animate", "--map", "pressures"]);
    assert!(is_drawn && told.contains("pressures at 4 states"), "{told}");
}

#[test]
fn surfaces_that_have_pulled_off_have_no_gap_to_draw() {
    let bench = Bench::new();
    let pulled = study("[]").replace("control = \"gap\"", "control = \"load\"");
    bench.run(&pulled.replace("gaps = []", "loads = [0.02, -0.5]"));
    let session = Session::new(bench.path("study.toml"), bench.data());
    let stop = AtomicBool::new(false);
    let of = |kind| session.map("contact", &[], kind, Some((-0.5).into()), &stop).unwrap().values;
    assert!(of(MapKind::Gap).iter().all(|gap| *gap == f64::INFINITY));
    assert!(of(MapKind::Pressures).iter().all(|pressure| *pressure == 0.0));
    let options = ["contact", "--load", "-0.5", "--map", "gap"];
    let manifest = bench.path("study.toml");
    let output = bench.output(&[&["view", manifest.to_str().unwrap()], &options[..]].concat());
    assert!(text(&output.stderr).contains("have pulled off"));
}

#[test]
fn a_free_patch_has_the_mean_gap_of_its_map() {
    let bench = Bench::new();
    let manifest = study("[0.2, 0.12, 0.05, 0.01]")
        .replace("tolerance = 1e-9", "boundary = \"free\"\ntolerance = 5e-5")
        .replace("work = 0.006, range = 0.02", "work = 0.04, range = 0.055")
        .replace("periodic = true", "periodic = false");
    bench.run(&manifest);
    let contact = bench.table("sticky", "contact");
    for (row, prescribed) in [0.2, 0.12, 0.05, 0.01].into_iter().enumerate() {
        let gap = map(&bench, &[&format!("step={}", row + 1)], MapKind::Gap, None).unwrap();
        assert!((real(&contact, "mean_gap", row) / mean(&gap) - 1.0).abs() < 1e-9, "{row}");
        assert_eq!(real(&contact, "prescribed_gap", row), prescribed);
    }
}

#[test]
fn mean_contact_pressures_are_means_of_the_pressures_over_the_nodes() {
    // reference/faults/F7-mean-contact-pressure.
    let bench = Bench::new();
    bench.run(
        &manifest("sticky", "")
            .generate("surface", "method = 'wave-product'; nodes = 32; amplitude = 0.05")
            .solve(
                "contact",
                "loads = [0.0, 0.02, 0.1]; adhesion = { work = 0.002, range = 0.03 }; \
                 tolerance = 1e-8",
            )
            .measure("area", "")
            .measure("repulsive", "from = 'contact'; set = 'repulsive'")
            .text(),
    );
    for row in 0..3 {
        let of = |kind| map(&bench, &[&format!("step={}", row + 1)], kind, None).unwrap();
        let pressures = of(MapKind::Pressures);
        for (stage, nodes) in [("area", MapKind::Contact), ("repulsive", MapKind::Repulsive)] {
            let nodes = of(nodes);
            let both = || nodes.values.iter().zip(&pressures.values);
            let expected = both().map(|(node, pressure)| node * pressure).sum::<f64>()
                / nodes.values.iter().sum::<f64>();
            let table = bench.table("sticky", stage);
            let found = real(&table, "mean_contact_pressure", row);
            assert!((found / expected - 1.0).abs() < 1e-12, "{stage}: {found} for {expected}");
            assert!(table.reals("secant").unwrap().is_null(row));
        }
    }
}
