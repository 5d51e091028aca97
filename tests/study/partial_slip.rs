//! Studies of contacts in partial slip.

use crate::bench::{Bench, real, study_of_map, text};
use crate::manifest::stages_from;

/// Data of an independent solver that minimises the tangential energy under |t| ≤ f p.
fn reference(name: &str) -> String {
    format!("{}/crates/mechanics/tests/data/tangential/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(loads: &str, friction: &str) -> String {
    let stages = stages_from("surface")
        .solve(
            "contact",
            &format!("loads = {loads}; load_unit = 'absolute'; tolerance = 1e-9; stiffness = true"),
        )
        .measure("slip", &format!("friction = {friction}"))
        .text();
    study_of_map("slip", &reference("rough64_a.npy"), &stages)
}

#[test]
fn stick_areas_and_displacements_are_those_of_an_independent_solver() {
    let bench = Bench::new();
    bench.run(&study(
        "[0.005, 0.0125, 0.02, 0.025, 0.0375, 0.05, 0.1, 0.15, 0.2]",
        "{ coefficient = 0.3, loads = [0.25, 0.5, 0.75, 0.9], poisson_ratio = 0.0 }",
    ));
    let [solved, slip] = ["contact", "slip"].map(|stage| bench.table("slip", stage));
    let file = std::fs::read_to_string(reference("rough64_a_partial_slip.csv")).unwrap();
    let rows: Vec<Vec<f64>> = file
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|number| number.parse().unwrap()).collect())
        .collect();
    assert_eq!((rows.len(), slip.rows()), (8, 8));
    for (index, row) in rows.iter().enumerate() {
        let [load, tangential, traction, stick, contact, displacement] = row[..6] else {
            panic!("six columns")
        };
        assert_eq!(real(&slip, "pressure", index), load);
        assert_eq!(real(&slip, "tangential_load", index), tangential);
        assert!((real(&slip, "tangential_traction", index) - traction).abs() < 1e-15);
        let nodes = |column| real(&slip, column, index) * 4096.0;
        assert_eq!(nodes("stick_fraction"), (stick * 4096.0).round());
        assert_eq!(nodes("contact_fraction"), (contact * 4096.0).round());
        assert_eq!(nodes("stick_fraction") + nodes("slip_fraction"), nodes("contact_fraction"));
        // The stiffness is that of the normal contact under the load of the stick area.
        let loads = solved.reals("pressure").unwrap();
        let stick_load = load * (1.0 - tangential);
        let found = loads.values().iter().position(|load| (load - stick_load).abs() < 1e-12);
        let normal = real(&solved, "stiffness", found.unwrap());
        assert_eq!(real(&slip, "tangential_stiffness", index), normal);
        let own = real(&slip, "tangential_displacement", index);
        assert!((own - displacement).abs() < 1e-7 * displacement, "{own} {displacement}");
    }
}

#[test]
fn the_dissipated_energy_is_the_area_of_the_hysteresis_loop() {
    let steps = 50;
    let amplitude = 0.8;
    let at = |step: i32| amplitude * (1.0 - 2.0 * f64::from(step) / f64::from(steps));
    let written = |load: f64| format!("{load:.6}");
    let down = (0..=steps).map(|step| written(at(step)));
    let up = (0..steps).rev().map(|step| written(at(step)));
    let path: Vec<String> = down.chain(up).collect();
    let shares = (0..=steps).map(|step| 1.0 - amplitude * f64::from(step) / f64::from(steps));
    let loads: Vec<String> = shares.map(|share| written(0.1 * share)).collect();
    let bench = Bench::new();
    let friction =
        format!("{{ coefficient = 0.3, loads = [{}], poisson_ratio = 0.3 }}", path.join(", "));
    bench.run(&study(&format!("[{}]", loads.join(", ")), &friction));
    let slip = bench.table("slip", "slip");
    let rows: Vec<usize> =
        (0..slip.rows()).filter(|&row| real(&slip, "pressure", row) == 0.1).collect();
    assert_eq!(rows.len(), path.len());
    let of = |column| rows.iter().map(|&row| real(&slip, column, row)).collect::<Vec<f64>>();
    let (tractions, displacements) = (of("tangential_traction"), of("tangential_displacement"));
    let area: f64 = (1..rows.len())
        .map(|to| {
            let run = displacements[to] - displacements[to - 1];
            0.5 * (tractions[to] + tractions[to - 1]) * run
        })
        .sum();
    let dissipated = of("frictional_dissipation");
    let cycle = dissipated.last().unwrap() - dissipated[0];
    assert!((area - cycle).abs() < 2e-3 * cycle, "{area} {cycle}");
    // On the first loading, points slip half as far as on each half of the cycle.
    assert!((4.0 * dissipated[0] - cycle).abs() < 1e-9 * cycle, "{} {cycle}", dissipated[0]);
    assert!(dissipated.windows(2).all(|pair| pair[1] >= pair[0]));
    let branches = slip.texts("tangential_branch").unwrap();
    assert_eq!(branches.value(rows[0]), "loading");
    assert_eq!(branches.value(rows[1]), "unloading");
    assert_eq!(branches.value(*rows.last().unwrap()), "loading-2");
}

#[test]
fn what_partial_slip_needs_is_said_at_its_place() {
    let bench = Bench::new();
    let refused = |manifest: &str| {
        let path = bench.write(manifest);
        let output = bench.output(&["check", path.to_str().unwrap()]);
        assert!(!output.status.success(), "{manifest}");
        text(&output.stderr)
    };
    let friction = "{ coefficient = 0.3, loads = [0.2, 0.5] }";
    let lacking = refused(&study("[0.1, 0.05]", friction));
    assert!(lacking.contains("help: add `0.08` to"), "{lacking}");
    let slipping = refused(&study("[0.1, 0.05]", "{ coefficient = 0.3, loads = [1.0] }"));
    assert!(slipping.contains("must be above -1 and below 1"), "{slipping}");
    let yielding =
        study("[0.1, 0.08, 0.05]", friction).replace("tolerance = 1e-9", "hardness = 5.0");
    assert!(refused(&yielding).contains("stage `contact` has a `hardness`"));
}
