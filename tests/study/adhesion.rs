//! Studies of contacts with adhesion.

use asperity::tables::table::Table;

use crate::bench::{Bench, assert_same_files, text};

/// Surface whose contact independent solvers have computed, with its states at prescribed gaps.
fn reference(name: &str) -> String {
    format!("{}/crates/contact/tests/data/adhesion/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(path: &str) -> String {
    format!(
        r#"
[study]
name = "sticky"

[stage.surface]
kind = "generate"
method = "file"
path = "{}"
side = 1.0
level = "none"
periodic = true

[stage.contact]
kind = "solve"
from = "surface"
effective_modulus = 1.0
adhesion = {{ work = 0.006, range = 0.02 }}
control = "gap"
gaps = {path}
tolerance = 1e-9

[stage.area]
kind = "measure"
from = "contact"

[stage.repulsive]
kind = "measure"
from = "contact"
set = "repulsive"
"#,
        reference("rough64_a.npy")
    )
}

fn rows_of(file: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(reference(file)).unwrap();
    let lines = text.lines().filter(|line| line.starts_with(|first: char| first.is_numeric()));
    lines.map(|line| line.split(',').map(|number| number.parse().unwrap()).collect()).collect()
}

fn real(table: &Table, column: &str, row: usize) -> f64 {
    table.reals(column).unwrap().value(row)
}

#[test]
fn states_at_prescribed_gaps_are_those_of_independent_solvers() {
    let rows = rows_of("rough64_a_sticky.csv");
    let gaps: Vec<String> = rows.iter().map(|row| row[0].to_string()).collect();
    let bench = Bench::new();
    bench.run(&study(&format!("[{}]", gaps.join(", "))));
    let contact = bench.table("sticky", "contact");
    let [area, repulsive] = ["area", "repulsive"].map(|stage| bench.table("sticky", stage));
    assert_eq!(contact.rows(), rows.len());
    for (index, row) in rows.iter().enumerate() {
        assert!((real(&contact, "pressure", index) - row[1]).abs() < 1e-7);
        let nodes = |table: &Table, column| table.integers(column).unwrap().value(index) as f64;
        assert_eq!(nodes(&contact, "contact_nodes"), row[2] * 4096.0);
        assert_eq!(nodes(&contact, "repulsive_nodes"), row[3] * 4096.0);
        assert_eq!(nodes(&area, "contact_nodes"), row[2] * 4096.0);
        assert_eq!(nodes(&repulsive, "contact_nodes"), row[3] * 4096.0);
        assert!((real(&contact, "elastic_energy", index) - row[4]).abs() < 1e-9);
        assert!((real(&contact, "adhesion_energy", index) - row[5]).abs() < 1e-9);
    }
}

#[test]
fn a_longer_path_has_the_tables_of_a_path_from_nothing() {
    let [short, long] = ["[0.14, 0.12, 0.10]", "[0.14, 0.12, 0.10, 0.08, 0.10]"].map(study);
    let extended = Bench::new();
    extended.run(&short);
    extended.run(&long);
    let anew = Bench::new();
    anew.run(&long);
    assert_same_files(&extended.published("sticky"), &anew.published("sticky"));
}

#[test]
fn keys_that_adhesion_excludes_are_refused_at_their_place() {
    let bench = Bench::new();
    let refused = |lines: &str| {
        let path = bench.write(&study("[0.1]").replace("tolerance = 1e-9", lines));
        let output = bench.output(&["check", path.to_str().unwrap()]);
        assert!(!output.status.success(), "{lines}");
        text(&output.stderr)
    };
    assert!(refused("hardness = 1.0").contains("not combined with `adhesion`"));
    assert!(refused("flow = true").contains("together with `adhesion`"));
    assert!(refused("loads = [0.1]").contains("the states are `gaps`"));
    let coarse = study("[0.1]").replace("range = 0.02", "range = 0.002");
    let check = |manifest: &str| {
        let path = bench.write(manifest);
        let output = bench.output(&["check", path.to_str().unwrap()]);
        (output.status.success(), text(&output.stderr))
    };
    let (is_valid, told) = check(&coarse);
    assert!(!is_valid && told.contains("too coarse for the adhesion"), "{told}");
    let (is_valid, told) =
        check(&coarse.replace("range = 0.002", "range = 0.002, override = true"));
    assert!(is_valid, "{told}");
    let plain = study("[0.1]").replace("adhesion =", "# adhesion =");
    assert!(check(&plain).1.contains("needs the key `adhesion`"));
}

#[test]
fn corrections_for_contacts_without_adhesion_are_refused() {
    let bench = Bench::new();
    let corrected =
        format!("{}[stage.corrected]\nkind = \"correct\"\nfrom = \"area\"\n", study("[0.1]"));
    let path = bench.write(&corrected);
    let output = bench.output(&["check", path.to_str().unwrap()]);
    assert!(text(&output.stderr).contains("is for contacts without adhesion"));
}
