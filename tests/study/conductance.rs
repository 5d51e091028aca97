//! Studies of the stiffness and the conductance of contacts.

use asperity::tables::table::Table;

use crate::bench::{Bench, study_of_map};

/// Surface whose stiffness an independent program has computed.
fn reference(name: &str) -> String {
    format!("{}/crates/contact/tests/data/conductance/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(tolerance: &str, keys: &str) -> String {
    let stages = format!(
        r#"
[stage.contact]
kind = "solve"
from = "surface"
effective_modulus = 1.0
load_unit = "absolute"
loads = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4]
tolerance = {tolerance}
{keys}

[stage.area]
kind = "measure"
from = "contact"
"#
    );
    study_of_map("conducting", &reference("rough128_a.npy"), &stages)
}

fn reals(table: &Table, column: &str) -> Vec<f64> {
    table.reals(column).unwrap().iter().map(Option::unwrap).collect()
}

#[test]
fn a_rough_contact_conducts_as_an_independent_program_has_it() {
    let bench = Bench::new();
    bench.run(&study("1e-9", "stiffness = true"));
    let [contact, area] = ["contact", "area"].map(|stage| bench.table("conducting", stage));
    let csv = std::fs::read_to_string(reference("rough128_a_conductance.csv")).unwrap();
    let rows = csv.lines().skip(1).map(|row| {
        let numbers = row.split(',').map(|number| number.parse().unwrap());
        numbers.collect::<Vec<f64>>()
    });
    let (stiffness, conductance) =
        (reals(&contact, "stiffness"), reals(&area, "contact_conductance"));
    assert_eq!(stiffness, conductance);
    let nodes = area.integers("contact_nodes").unwrap();
    let switches = area.integers("switches").unwrap();
    for (index, row) in rows.enumerate() {
        assert_eq!(nodes.value(index) as f64, (row[1] * 16384.0).round());
        assert_eq!(switches.value(index) as f64, row[2]);
        assert!((conductance[index] / row[4] - 1.0).abs() < 1e-7, "{row:?}");
    }
    // Separate spots conduct nearly as much as their contact as long as they are few.
    let greenwood = area.reals("greenwood_conductance").unwrap();
    let ratio = greenwood.value(0) / conductance[0];
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    assert_eq!(area.integers("spots").unwrap(), area.integers("clusters").unwrap());
}

#[test]
fn a_stiffness_that_is_added_to_stored_pressures_solves_no_load_again() {
    let bench = Bench::new();
    bench.run(&study("5e-5", "pressures = \"all\""));
    let before = bench.files();
    let counts = bench.run(&study("5e-5", "pressures = \"all\"\nstiffness = true"));
    assert_eq!(counts["surface"].computed, 0);
    let added = bench.table("conducting", "contact");
    // All rows that were stored before are still there.
    let after = bench.files();
    let kept = before.keys().filter(|path| path.starts_with("store"));
    assert!(kept.clone().count() > 0 && kept.into_iter().all(|path| after.contains_key(path)));

    let other = Bench::new();
    other.run(&study("5e-5", "stiffness = true"));
    let together = other.table("conducting", "contact");
    assert_eq!(reals(&added, "stiffness"), reals(&together, "stiffness"));
}

#[test]
fn contacts_that_yield_or_lie_on_a_layer_have_a_stiffness_and_no_conductance() {
    for keys in ["hardness = 0.6", "layer = { thickness = 0.05, poisson_ratio = 0.3 }"] {
        let bench = Bench::new();
        bench.run(&study("1e-6", &format!("stiffness = true\n{keys}")));
        let area = bench.table("conducting", "area");
        let known = |column| area.reals(column).unwrap().iter().flatten().count();
        assert!(known("stiffness") > 0, "{keys}");
        assert_eq!(known("contact_conductance"), 0, "{keys}");
    }
}
