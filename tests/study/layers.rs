//! Studies of contacts with a layer on a rigid base, and with a coating.

use asperity::tables::table::Table;

use crate::bench::{Bench, real, study_of_map, text};
use crate::manifest::{manifest, stages_from};

/// Surface whose contact with layers an independent solver has computed.
fn reference(name: &str) -> String {
    format!("{}/crates/mechanics/tests/data/layer/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Returns a study of the reference surface with further keys of its `solve` stage.
fn study(keys: &str) -> String {
    let stages = stages_from("surface")
        .solve(
            "contact",
            &format!(
                "effective_modulus = 1.0; load_unit = 'absolute'; loads = [0.02, 0.06, 0.2, 0.5]; \
                 tolerance = 1e-9; {keys}"
            ),
        )
        .measure("area", "")
        .text();
    study_of_map("layered", &reference("rough96_a.npy"), &stages)
}

/// Compares the rows of a table with rows of the reference, in the same order.
fn assert_reference(bench: &Bench, name: &str, keys: &str) {
    bench.run(&study(keys));
    let [contact, area] = ["contact", "area"].map(|stage| bench.table("layered", stage));
    let csv = std::fs::read_to_string(reference("rough_layer.csv")).unwrap();
    let rows = csv.lines().filter(|row| row.starts_with(name)).map(|row| {
        let numbers = row.split(',').skip(3);
        numbers.map(|number| number.parse().unwrap()).collect::<Vec<f64>>()
    });
    let rows: Vec<Vec<f64>> = rows.collect();
    assert_eq!(contact.rows(), rows.len());
    let mut pairs = 0;
    for (index, row) in rows.iter().enumerate() {
        let [load, fraction, switches, gap, compression, peak, energy, _] = row[..] else {
            panic!("{row:?}")
        };
        let is_close = |column: &str, expected: f64| {
            let found = real(&contact, column, index);
            assert!((found / expected - 1.0).abs() < 1e-7, "{column}: {found}, {row:?}");
        };
        assert_eq!(real(&contact, "pressure", index), load);
        let nodes = |table: &Table, column| table.integers(column).unwrap().value(index) as f64;
        assert_eq!(nodes(&contact, "contact_nodes"), (fraction * 9216.0).round());
        assert_eq!(nodes(&area, "switches"), switches);
        is_close("mean_gap", gap);
        is_close("peak_pressure", peak);
        is_close("energy", energy);
        if compression > 0.0 {
            is_close("uniform_compression", compression);
        }
        pairs += contact.integers("pairs").unwrap().value(index);
    }
    // A half-space takes 24 to 30 pairs at this tolerance.
    assert!(pairs / rows.len() as i64 <= 60, "{pairs}");
}

#[test]
fn rough_layers_and_coatings_touch_as_independent_code_has_it() {
    let bench = Bench::new();
    for (name, keys) in [
        ("bonded,0.05", "layer = { thickness = 0.05, poisson_ratio = 0.3, base = \"bonded\" }"),
        ("bonded,0.02", "layer = { thickness = 0.02, poisson_ratio = 0.5 }"),
        ("smooth", "layer = { thickness = 0.05, poisson_ratio = 0.3, base = \"frictionless\" }"),
        (
            "coating",
            "substrate = { poisson_ratio = 0.3 }\nlayer = [\
             { thickness = 0.03, poisson_ratio = 0.3, modulus_ratio = 4.0 }, \
             { thickness = 0.03, poisson_ratio = 0.3, modulus_ratio = 0.25 }]",
        ),
    ] {
        assert_reference(&bench, name, keys);
    }
}

#[test]
fn a_thickness_with_a_unit_is_converted_to_the_unit_of_the_surfaces() {
    let bench = Bench::new();
    let manifest = |thickness: &str| {
        manifest("seal", "")
            .generate(
                "surface",
                "nodes = 32; side = '4 mm'; hurst = 0.8; k_lower = 2; k_upper = 8; rms_slope = 0.1",
            )
            .solve(
                "contact",
                &format!(
                    "bodies = [{{ youngs_modulus = '6 MPa', poisson_ratio = 0.49 }}]; \
                     layer = {{ thickness = {thickness}, poisson_ratio = 0.49 }}; \
                     loads = ['0.1 MPa', '0.3 MPa']"
                ),
            )
            .text()
    };
    let check = |thickness: &str| {
        let path = bench.write(&manifest(thickness));
        bench.output(&["check", path.to_str().unwrap()])
    };
    let checked = check("\"200 um\"");
    let told = "E* is that of a layer of thickness 0.2 mm with ν = 0.49, bonded to a rigid base";
    assert!(text(&checked.stdout).contains(told), "{}", text(&checked.stdout));
    bench.run(&manifest("'200 um'"));
    let contact = bench.table("seal", "contact");
    assert_eq!(real(&contact, "layer_thickness", 0), 0.2);
    // The compression is p t/M, and it is part of the approach.
    let modulus = 0.51 / (1.49 * 0.02) * 6.0;
    let compression = real(&contact, "uniform_compression", 1);
    assert!((compression / (0.3 * 0.2 / modulus) - 1.0).abs() < 1e-9);
    assert!(real(&contact, "approach", 1) > real(&contact, "approach", 0));
    let refused = check("\"200 MPa\"");
    assert!(text(&refused.stderr).contains("`layer.thickness` is a length"));
}

#[test]
fn the_pressure_of_full_contact_is_told_for_half_spaces_only() {
    let bench = Bench::new();
    let surfaces = |name: &str, seed: u32| {
        format!(
            "[stage.{name}]\nkind = \"generate\"\nnodes = 32\nhurst = 0.8\nk_lower = 2\n\
             k_upper = 8\nseed = {seed}\n"
        )
    };
    let told = |from: &str, keys: &str| {
        let (one, other) = (surfaces("one", 1), surfaces("other", 2));
        let manifest = format!(
            "[study]\nname = \"full\"\n{one}{other}[stage.contact]\nkind = \"solve\"\n{from}\n\
             loads = [0.02]\n{keys}\n"
        );
        let path = bench.write(&manifest);
        let output = bench.output(&["run", path.to_str().unwrap(), "--replace"]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let printed = text(&output.stdout);
        let is_told = |stage: &str| {
            let mut lines = printed.lines().filter(|line| line.split(' ').next() == Some(stage));
            lines.next().unwrap().contains("full contact at")
        };
        [is_told("one"), is_told("other")]
    };
    let layer = "layer = { thickness = 0.1, poisson_ratio = 0.3 }";
    assert_eq!(told("from = \"one\"", ""), [true, true]);
    assert_eq!(told("from = \"one\"", layer), [false, true]);
    assert_eq!(told("from = \"one\"", "boundary = \"free\""), [false, true]);
    assert_eq!(told("from = \"one\"", "adhesion = { work = 0.001, range = 0.02 }"), [false, true]);
    assert_eq!(told("from = \"one\"\nagainst = \"other\"", layer), [false, false]);
    assert_eq!(told("from = \"one\"\nagainst = \"other\"", ""), [true, true]);
}

#[test]
fn youngs_moduli_of_a_coating_give_the_ratio_of_the_shear_moduli() {
    let bench = Bench::new();
    let coating = |keys: &str| {
        manifest("coated", "")
            .generate(
                "surface",
                "nodes = 32; side = '4 mm'; hurst = 0.8; k_lower = 2; k_upper = 8; rms_slope = 0.1",
            )
            .solve("contact", &format!("{keys}; loads = ['1 MPa']"))
            .text()
    };
    let counts = bench.run(&coating(
        "layer = { thickness = '1 mm', youngs_modulus = '3 GPa', poisson_ratio = 0.4 }; \
         substrate = { youngs_modulus = '210000 MPa', poisson_ratio = 0.3 }",
    ));
    assert_eq!(counts["contact"].computed, 1);
    let table = bench.table("coated", "contact");
    // G = E/(2 (1 + ν)).
    let ratio = 3.0 / 1.4 / (210.0 / 1.3);
    assert!((real(&table, "layer_modulus_ratio", 0) / ratio - 1.0).abs() < 1e-11);
    let modulus = real(&table, "effective_modulus", 0);
    assert!((modulus / (3000.0 / (1.0 - 0.16)) - 1.0).abs() < 1e-12, "{modulus}");
    // The same coating, given by its body and the ratio, has the same results.
    bench.run(&coating(&format!(
        "bodies = [{{ youngs_modulus = '3 GPa', poisson_ratio = 0.4 }}]; load_unit = 'MPa'; \
         layer = {{ thickness = '1 mm', poisson_ratio = 0.4, modulus_ratio = {ratio} }}; \
         substrate = {{ poisson_ratio = 0.3 }}"
    )));
    let other = bench.table("coated", "contact");
    for name in ["layer_modulus_ratio", "effective_modulus", "load", "mean_gap"] {
        assert_eq!(real(&table, name, 0), real(&other, name, 0), "{name}");
    }
    for (keys, message) in [
        (
            "layer = { thickness = '1 mm', youngs_modulus = '3 GPa', poisson_ratio = 0.4 }; \
             substrate = { poisson_ratio = 0.3 }",
            "`layer` lacks the ratio of its shear modulus",
        ),
        (
            "layer = { thickness = '1 mm', youngs_modulus = '3 GPa', poisson_ratio = 0.4, \
             modulus_ratio = 2 }; substrate = { youngs_modulus = '2 GPa', poisson_ratio = 0.3 }",
            "`modulus_ratio` and `substrate.youngs_modulus` exclude each other",
        ),
        (
            "effective_modulus = '4 GPa'; \
             layer = { thickness = '1 mm', youngs_modulus = '3 GPa', poisson_ratio = 0.4 }",
            "`effective_modulus` and `layer.youngs_modulus` exclude each other",
        ),
        (
            "bodies = [{ youngs_modulus = '4 GPa', poisson_ratio = 0.4 }]; \
             layer = { thickness = '1 mm', youngs_modulus = '3 GPa', poisson_ratio = 0.4 }",
            "Young's modulus of the body in `bodies` differs from that of `layer`",
        ),
    ] {
        let path = bench.write(&coating(keys));
        let output = bench.output(&["check", path.to_str().unwrap()]);
        assert!(text(&output.stderr).contains(message), "{}", text(&output.stderr));
    }
}
