//! Studies of the stiffness and the conductance of contacts.

use asperity::tables::table::Table;

use crate::bench::{Bench, real, study_of_map};
use crate::manifest::{manifest, stages_from};

/// Surface whose stiffness an independent program has computed.
fn reference(name: &str) -> String {
    format!("{}/crates/mechanics/tests/data/conductance/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(tolerance: &str, keys: &str) -> String {
    let stages = stages_from("surface")
        .solve(
            "contact",
            &format!(
                "effective_modulus = 1.0; load_unit = 'absolute'; \
                 loads = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4]; tolerance = {tolerance}; {keys}"
            ),
        )
        .measure("area", "")
        .text();
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
fn contacts_on_a_layer_without_conductivities_have_a_stiffness_and_no_conductance() {
    let bench = Bench::new();
    let keys = "stiffness = true\nlayer = { thickness = 0.05, poisson_ratio = 0.3 }";
    bench.run(&study("1e-6", keys));
    let area = bench.table("conducting", "area");
    let known = |column| area.reals(column).unwrap().iter().flatten().count();
    assert!(known("stiffness") > 0);
    assert_eq!(known("contact_conductance"), 0);
    assert!(!area.has("unloading_stiffness"));
}

/// A study of contacts with coatings, whose `layer`, `substrate` and `counter_body` have further
/// keys.
fn coated(keys: &str, [layer, substrate, counter_body]: [&str; 3]) -> String {
    let counter_body = match counter_body {
        "" => String::new(),
        keys => format!("; counter_body = {{ {keys} }}"),
    };
    manifest("coated", "")
        .generate(
            "surface",
            "nodes = [64, 32]; side = ['200 um', '100 um']; hurst = 0.8; k_lower = 2; k_upper = 8; \
             rms_slope = 0.02",
        )
        .solve(
            "contact",
            &format!(
                "layer = {{ thickness = '5 um', youngs_modulus = '50 GPa', poisson_ratio = 0.36{layer} \
                 }}; substrate = {{ youngs_modulus = '120 GPa', poisson_ratio = 0.34{substrate} \
                 }}{counter_body}; loads = ['10 MPa', '50 MPa']; stiffness = true; {keys}"
            ),
        )
        .measure("resistance", "")
        .text()
}

const RESISTIVITIES: [&str; 3] =
    [", resistivity = '115 nohm m'", ", resistivity = 17e-9", "resistivity = '23 nohm m'"];

#[test]
fn coated_contacts_have_a_conductance_in_units_of_the_si() {
    let bench = Bench::new();
    bench.run(&coated("", RESISTIVITIES));
    let [contact, table] = ["contact", "resistance"].map(|stage| bench.table("coated", stage));
    assert_eq!(reals(&contact, "contact_conductance"), reals(&table, "contact_conductance"));
    // ρ_s = (ρ₁ + ρ₃)/2 of the layer and the rough body.
    let (rho, side, area) = (69e-9, 200e-6, 200e-6 * 100e-6);
    let near = |column: &str, row: usize, expected: f64| {
        let found = real(&table, column, row);
        assert!((found / expected - 1.0).abs() < 1e-11, "{column}: {found}, {expected}");
    };
    for row in 0..2 {
        let conductance = real(&table, "contact_conductance", row);
        // The layer spreads the current less than the force.
        assert!(conductance < 0.95 * real(&table, "stiffness", row));
        near("pair_resistivity", row, rho);
        near("substrate_conductivity_ratio", row, 17.0 / 115.0);
        near("counter_conductivity_ratio", row, 23.0 / 115.0);
        near("specific_resistance", row, rho * side / conductance);
        near("electrical_resistance", row, rho * side / (conductance * area));
        near("layer_electrical_resistance", row, 115e-9 * 5e-6 / area);
    }
    let known = |column| table.reals(column).unwrap().iter().flatten().count();
    assert_eq!(known("greenwood_conductance"), 0);
    assert!(!table.has("thermal_conductance"));
}

#[test]
fn a_layer_of_the_material_of_its_substrate_conducts_as_its_stiffness_has_it() {
    let bench = Bench::new();
    let same = |keys| coated("tolerance = 1e-9", keys).replace("120 GPa", "50 GPa");
    let conductivities =
        [", conductivity = 60", ", conductivity = 60", "conductivity = '4 W/(cm K)'"];
    bench.run(&same(conductivities).replace("0.34", "0.36"));
    let table = bench.table("coated", "resistance");
    let (k, side, area) = (2.0 / (1.0 / 60.0 + 1.0 / 400.0), 200e-6, 200e-6 * 100e-6);
    for row in 0..2 {
        let [stiffness, conductance, pair] =
            ["stiffness", "contact_conductance", "pair_conductivity"]
                .map(|column| real(&table, column, row));
        assert!((conductance / stiffness - 1.0).abs() < 1e-8, "{conductance}, {stiffness}");
        assert!((pair / k - 1.0).abs() < 1e-11, "{pair}");
        let [thermal, uniform] = ["thermal_conductance", "layer_thermal_resistance"]
            .map(|column| real(&table, column, row));
        assert!((thermal / (conductance * k / side) - 1.0).abs() < 1e-11);
        assert!((uniform / (5e-6 / (60.0 * area)) - 1.0).abs() < 1e-11);
    }
}

#[test]
fn conductivities_of_a_layer_are_added_to_stored_pressures() {
    let bench = Bench::new();
    let keys = "pressures = \"all\"";
    bench.run(&coated(keys, [""; 3]));
    let before = bench.files();
    let rows = |bench: &Bench| reals(&bench.table("coated", "resistance"), "electrical_resistance");
    for resistivities in
        [RESISTIVITIES, [", resistivity = 17e-9", ", resistivity = 115e-9", "resistivity = 17e-9"]]
    {
        bench.run(&coated(keys, resistivities));
        let after = bench.files();
        let mut stored = before.keys().filter(|path| path.starts_with("store"));
        assert!(stored.all(|path| after.contains_key(path)));
        let together = Bench::new();
        together.run(&coated("", resistivities));
        assert_eq!(rows(&bench), rows(&together));
    }
    // Without a description, the rough body conducts perfectly.
    bench.run(&coated(keys, [RESISTIVITIES[0], RESISTIVITIES[1], ""]));
    let table = bench.table("coated", "resistance");
    assert_eq!(real(&table, "counter_conductivity_ratio", 0), 0.0);
    assert_eq!(real(&table, "pair_resistivity", 0), 57.5e-9);
}

#[test]
fn yielded_contacts_conduct_as_stiffly_as_they_begin_to_unload() {
    let bench = Bench::new();
    let loads = "loads = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4]";
    let keys = "stiffness = true\nhardness = 0.6\npath = \"as-given\"";
    let path = "loads = [0.02, 0.2, 0.1999, 0.1998, 0.05]";
    bench.run(&study("1e-9", keys).replace(loads, path));
    let [contact, area] = ["contact", "area"].map(|stage| bench.table("conducting", stage));
    let branches = contact.texts("branch").unwrap();
    let row = |load: f64, branch: &str| {
        let is_wanted = |row: &usize| {
            real(&contact, "pressure", *row) == load && branches.value(*row) == branch
        };
        (0..contact.rows()).find(is_wanted).unwrap()
    };
    let largest = row(0.2, "loading");
    assert!(contact.integers("saturated_nodes").unwrap().value(largest) > 100);
    let [stiffness, unloading] =
        ["stiffness", "unloading_stiffness"].map(|column| real(&contact, column, largest));
    assert!(unloading > 1.05 * stiffness, "{unloading}, {stiffness}");
    // The approach on the way back is −mean_gap plus the constant plastic depth.
    let gap = |load, branch| real(&contact, "mean_gap", row(load, branch));
    let slope = 1e-4 / (gap(0.1999, "unloading") - gap(0.2, "loading"));
    assert!((unloading / slope - 1.0).abs() < 2e-3, "{unloading}, {slope}");
    // The unloaded contact is elastic: loading and unloading are equally stiff.
    let unloaded = row(0.05, "unloading");
    let [one, other] =
        ["stiffness", "unloading_stiffness"].map(|column| real(&contact, column, unloaded));
    assert_eq!(one, other);
    assert_eq!(reals(&area, "contact_conductance"), reals(&contact, "unloading_stiffness"));
    let small = row(0.02, "loading");
    assert!(real(&area, "greenwood_conductance", small) > 0.0);
}

/// A study in physical units whose numbers can be computed from its dimensionless columns.
fn copper(keys: &str) -> String {
    let [one, other] = [
        "conductivity = '4 W/(cm K)', resistivity = 17e-9",
        "conductivity = 100, resistivity = '3.3 uohm cm'",
    ]
    .map(|keys| format!("{{ youngs_modulus = '120 GPa', poisson_ratio = 0.34, {keys} }}"));
    manifest("copper", "")
        .generate(
            "surface",
            "nodes = [64, 32]; side = ['200 um', '100 um']; hurst = 0.8; k_lower = 2; k_upper = 8; \
             rms_height = '0.5 um'",
        )
        .solve(
            "contact",
            &format!(
                "bodies = [{one}, {other}]; hardness = '900 MPa'; \
                 loads = ['10 MPa', '50 MPa']; {keys}"
            ),
        )
        .measure("resistance", "")
        .aggregate("mean", "over = ['electrical_resistance']; statistics = ['mean']")
        .text()
}

#[test]
fn conductances_and_resistances_are_in_units_of_the_si() {
    let bench = Bench::new();
    bench.run(&copper("stiffness = true"));
    let table = bench.table("copper", "resistance");
    let (k, rho, side, area) = (160.0, 25e-9, 200e-6, 200e-6 * 100e-6);
    let near = |column: &str, row: usize, expected: f64| {
        let found = real(&table, column, row);
        assert!((found / expected - 1.0).abs() < 1e-12, "{column}: {found}, {expected}");
    };
    for row in 0..2 {
        let force = real(&table, "pressure", row) * 1e6 * area;
        let [conductance, greenwood] =
            ["contact_conductance", "greenwood_conductance"].map(|name| real(&table, name, row));
        near("force", row, force);
        near("pair_conductivity", row, k);
        near("thermal_conductance", row, conductance * k / side);
        near("thermal_resistance", row, side / (conductance * k * area));
        near("pair_resistivity", row, rho);
        near("specific_resistance", row, rho * side / conductance);
        near("electrical_resistance", row, rho * side / (conductance * area));
        near("greenwood_resistance", row, rho * side / (greenwood * area));
        let radius = (force / (std::f64::consts::PI * 900e6)).sqrt();
        near("holm_resistance", row, rho / (2.0 * radius));
    }
    let mean = bench.table("copper", "mean");
    assert_eq!(reals(&mean, "force"), reals(&table, "force"));
}

#[test]
fn conductivities_solve_no_load_again() {
    let bench = Bench::new();
    let keys = "stiffness = true\npressures = \"all\"";
    let conducting = copper(keys);
    let plain = conducting
        .replace(", conductivity = \"4 W/(cm K)\", resistivity = 17e-9", "")
        .replace(", conductivity = 100, resistivity = \"3.3 uohm cm\"", "")
        .replace("electrical_resistance", "contact_conductance");
    bench.run(&plain);
    let counts = bench.run(&conducting);
    assert_eq!((counts["contact"].computed, counts["resistance"].computed), (0, 1));
}
