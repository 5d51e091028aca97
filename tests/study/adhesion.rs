//! Studies of contacts with adhesion.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::LazyLock;
use std::thread::sleep;
use std::time::Duration;

use arrow::array::Array;
use asperity::tables::table::Table;

use crate::bench::{Bench, assert_same_files, real, study_of_map, text};
use crate::manifest::{manifest, stages_from};

/// Surface whose contact independent solvers have computed, with its states at prescribed gaps.
fn reference(name: &str) -> String {
    format!("{}/crates/mechanics/tests/data/adhesion/{name}", env!("CARGO_MANIFEST_DIR"))
}

pub fn study(path: &str) -> String {
    let stages = stages_from("surface")
        .solve(
            "contact",
            &format!(
                "effective_modulus = 1.0; adhesion = {{ work = 0.006, range = 0.02 }}; \
                 control = 'gap'; gaps = {path}; tolerance = 1e-9"
            ),
        )
        .measure("area", "")
        .measure("repulsive", "from = 'contact'; set = 'repulsive'")
        .text();
    study_of_map("sticky", &reference("rough64_a.npy"), &stages)
}

fn rows_of(file: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(reference(file)).unwrap();
    let lines = text.lines().filter(|line| line.starts_with(|first: char| first.is_numeric()));
    lines.map(|line| line.split(',').map(|number| number.parse().unwrap()).collect()).collect()
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

/// Study in micrometres and megapascals, with placeholders for the adhesion and the mean gaps.
static WITH_UNITS: LazyLock<String> = LazyLock::new(|| {
    manifest("units", "")
        .generate(
            "surface",
            "nodes = 32; side = '2 um'; hurst = 0.8; k_lower = 2; k_upper = 8; rms_slope = 0.1",
        )
        .solve(
            "contact",
            "effective_modulus = '10 MPa'; adhesion = ADHESION; control = 'gap'; gaps = GAPS",
        )
        .text()
});

fn with_units(adhesion: &str, gaps: &str) -> String {
    WITH_UNITS.replace("ADHESION", adhesion).replace("GAPS", gaps)
}

#[test]
fn works_ranges_and_gaps_with_units_are_converted_to_the_units_of_the_surface() {
    let bench = Bench::new();
    let plain = with_units("{ work = 0.002, range = 0.02 }", "[0.05, 0.04]");
    let files = |manifest: &str| {
        bench.run(manifest);
        bench.published("units")
    };
    let expected = files(&plain);
    for (adhesion, gaps) in [
        ("{ work = \"2 mJ/m^2\", range = \"20 nm\" }", "[\"50 nm\", \"0.04 um\"]"),
        ("{ work = \"0.002 J/m²\", range = \"0.02 µm\" }", "[\"50 nm\", \"40 nm\"]"),
        (
            "{ work = \"2 mN/m\", range = \"200 Å\" }",
            "{ from = \"50 nm\", to = \"40 nm\", steps = 2 }",
        ),
    ] {
        let manifest = with_units(adhesion, gaps);
        let output = bench.output(&["check", bench.write(&manifest).to_str().unwrap()]);
        let told = text(&output.stdout);
        assert!(told.contains("work of adhesion 0.002 J/m², range 0.02 µm"), "{told}");
        assert!(told.contains("mean gap 0.05 µm … 0.04 µm"), "{told}");
        assert_same_files(&files(&manifest), &expected);
    }
    let path = bench.path("study.toml");
    let table = bench.output(&["table", path.to_str().unwrap(), "contact"]);
    let told = text(&table.stdout);
    assert!(told.contains("J/m²"), "{told}");
}

#[test]
fn units_that_cannot_be_converted_are_refused() {
    let bench = Bench::new();
    let refused = |manifest: &str, part: &str| {
        let output = bench.output(&["check", bench.write(manifest).to_str().unwrap()]);
        let told = text(&output.stderr);
        assert!(!output.status.success() && told.contains(part), "{told}");
    };
    let both = "{ work = \"2 mJ/m^2\", range = \"20 nm\" }";
    let gaps = "[\"50 nm\"]";
    let valid = with_units(both, gaps);
    let part = "the lengths of the surfaces have none";
    refused(&valid.replace("\"2 um\"", "2"), part);
    refused(&valid.replace("side = \"2 um\"", "side = 2\nunit = \"px\""), "unknown unit `px`");
    refused(&valid.replace("\"10 MPa\"", "10"), "the modulus of the stage has none");
    refused(&with_units(both, "[0.05]"), "`gaps` has no unit, but `adhesion.range` has one");
    let part = "`adhesion.work` has a unit, but `adhesion.range` has none";
    refused(&with_units("{ work = \"2 mJ/m^2\", range = 0.02 }", "[0.05]"), part);
    let part = "`adhesion.range` has a unit, but `adhesion.work` has none";
    refused(&with_units("{ work = 0.002, range = \"20 nm\" }", gaps), part);
    let part = "`adhesion.work` is a work per area, but `nm` is a unit of length";
    refused(&with_units("{ work = \"2 nm\", range = \"20 nm\" }", gaps), part);
}

#[test]
fn paths_that_cannot_be_are_refused_with_the_reason() {
    let bench = Bench::new();
    let refused = |keys: &str, part: &str| {
        let manifest = study("[0.1]").replace("control = \"gap\"\ngaps = [0.1]", keys);
        let output = bench.output(&["check", bench.write(&manifest).to_str().unwrap()]);
        let told = text(&output.stderr);
        assert!(!output.status.success() && told.contains(part), "{told}");
    };
    refused("loads = [0.1, 0.1]", "holds the same state twice in a row");
    refused("loads = [0.1]\ngaps = [0.1]", "with `control = \"load\"` the states are `loads`");
    refused("control = \"gap\"\ngaps = [0.1, 0.0]", "must be above 0");
    refused("loads = []", "loads");
    let negative = study("[0.1]").replace("work = 0.006", "work = -0.006");
    let output = bench.output(&["check", bench.write(&negative).to_str().unwrap()]);
    assert!(text(&output.stderr).contains("`adhesion.work` is -0.006"));
}

/// Path that takes longer than a test needs to stop it.
fn long_path() -> String {
    let states = "{ from = 0.14, to = 0.02, steps = 40 }";
    study(states).replace("periodic = true", "periodic = true\nresample = 256")
}

#[test]
fn a_path_that_is_stopped_or_killed_continues_with_the_same_bytes() {
    let anew = Bench::new();
    anew.run_with(&long_path(), &["--jobs", "1"]);
    for signal in ["-INT", "-KILL"] {
        let bench = Bench::new();
        let path = bench.write(&long_path());
        let arguments = ["run", path.to_str().unwrap(), "--checkpoint-every", "0"];
        let mut run = bench.asperity(&arguments).stderr(Stdio::null()).spawn().unwrap();
        // The surface and the first states.
        let is_table = |path: &&PathBuf| {
            path.starts_with("store") && path.extension().is_some_and(|of| of == "parquet")
        };
        let stored = || bench.files().keys().filter(is_table).count();
        while stored() < 2 && run.try_wait().unwrap().is_none() {
            sleep(Duration::from_millis(5));
        }
        let id = run.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        assert!(!run.wait().unwrap().success(), "the path was stopped");
        let plan = bench.output(&["plan", path.to_str().unwrap()]);
        assert!(text(&plan.stdout).contains("states to solve after"), "{}", text(&plan.stdout));
        bench.run_with(&long_path(), &["--jobs", "2"]);
        assert_same_files(&bench.published("sticky"), &anew.published("sticky"));
    }
}

#[test]
fn a_plan_says_from_how_many_stored_states_a_path_continues() {
    let bench = Bench::new();
    bench.run(&study("[0.14, 0.12, 0.10]"));
    let longer = bench.write(&study("[0.14, 0.12, 0.10, 0.08, 0.06]"));
    let plan = bench.output(&["plan", longer.to_str().unwrap()]);
    let told = text(&plan.stdout);
    assert!(told.contains("2 states to solve after 3 stored"), "{told}");
}

#[test]
fn distributions_include_the_attractive_part() {
    let bench = Bench::new();
    let bins = "tolerance = 1e-9\npressure_bins = { count = 50, to = 5.0 }\n\
                gap_bins = { count = 20, to = 4.0 }";
    let measured = "\n[stage.pressures]\nkind = \"measure\"\nfrom = \"contact\"\nwhat = \"pressures\"\n\
                    [stage.gaps]\nkind = \"measure\"\nfrom = \"contact\"\nwhat = \"gaps\"\n";
    bench.run(&(study("[0.14, 0.06]").replace("tolerance = 1e-9", bins) + measured));
    let [contact, pressures, gaps] =
        ["contact", "pressures", "gaps"].map(|stage| bench.table("sticky", stage));
    let per_state = pressures.rows() / 2;
    for state in 0..2 {
        let rows = state * per_state..(state + 1) * per_state;
        let density = |row| 0.1 * real(&pressures, "pressure_density", row);
        let center = |row| real(&pressures, "contact_pressure", row);
        let whole: f64 = rows.clone().map(density).sum();
        assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        let mean: f64 = rows.clone().map(|row| density(row) * center(row)).sum();
        // The tolerance covers the positions of the pressures within their bins of width 0.1.
        assert!((mean - real(&contact, "load", state)).abs() < 0.05);
        let repulsive: f64 = rows.filter(|row| center(*row) > 0.0).map(density).sum();
        let nodes = contact.integers("repulsive_nodes").unwrap().value(state) as f64;
        assert!((repulsive - nodes / 4096.0).abs() < 1e-12);
        let open: f64 =
            (20 * state..20 * state + 20).map(|row| 0.2 * real(&gaps, "gap_density", row)).sum();
        let beyond = gaps.integers("gap_nodes_beyond").unwrap().value(20 * state) as f64 / 4096.0;
        let contact_nodes = contact.integers("contact_nodes").unwrap().value(state) as f64;
        assert!((open + beyond - (1.0 - contact_nodes / 4096.0)).abs() < 1e-12, "{open}");
    }
    assert_eq!(pressures.reals("pressure_density_persson").unwrap().null_count(), pressures.rows());
}

#[test]
fn statistics_and_laws_of_areas_that_vanish_with_the_load_are_refused() {
    let bench = Bench::new();
    let refused = |stage: &str, part: &str| {
        let manifest = study("[0.1]") + stage;
        let output = bench.output(&["check", bench.write(&manifest).to_str().unwrap()]);
        let told = text(&output.stderr);
        assert!(!output.status.success() && told.contains(part), "{told}");
    };
    for statistic in ["slope", "secant", "approach"] {
        let keys = format!(
            "[stage.curve]\nkind = \"aggregate\"\nfrom = \"area\"\nover = [\"area_fraction\"]\n\
             group_by = [\"load\"]\nstatistics = [\"mean\", \"{statistic}\"]\n"
        );
        let part = format!("\"{statistic}\" is for contacts whose area vanishes with the load");
        refused(&keys, &part);
    }
    for law in ["contact-evolution", "mean-pressure", "scaled-erf", "load-separation"] {
        let keys = format!("[stage.law]\nkind = \"fit\"\nfrom = \"area\"\nlaw = \"{law}\"\n");
        refused(&keys, "is for contacts without adhesion");
    }
}

#[test]
fn contacts_at_prescribed_gaps_have_their_loads_and_can_be_fitted() {
    let bench = Bench::new();
    let fits = &stages_from("area")
        .fit("threshold", "law = 'gap-percolation'")
        .correct("counted", "from = 'area'; correction = 'none'")
        .fit("meshes", "law = 'mesh-convergence'")
        .text();
    bench.run(&(study("[0.14, 0.08, 0.04, 0.02, 0.01, 0.005]") + fits));
    let [contact, area, counted, threshold] =
        ["contact", "area", "counted", "threshold"].map(|stage| bench.table("sticky", stage));
    for table in [&area, &counted] {
        for column in ["load", "pressure"] {
            assert_eq!(table.reals(column).unwrap(), contact.reals(column).unwrap());
        }
    }
    // The pull is strongest shortly before contact: the loads do not fall with the gaps everywhere.
    let open = area.flags("gap_percolates_x").unwrap();
    let sealed =
        (0..area.rows()).filter(|row| !open.value(*row)).map(|row| real(&area, "load", row));
    let sealed = sealed.fold(f64::INFINITY, f64::min);
    let lighter =
        (0..area.rows()).map(|row| real(&area, "load", row)).filter(|load| *load < sealed);
    let heaviest = lighter.fold(f64::NEG_INFINITY, f64::max);
    let found = real(&threshold, "percolation_load_x", 0);
    assert!((found - 0.5 * (sealed + heaviest)).abs() < 1e-15, "{found} {sealed} {heaviest}");
    assert!(threshold.reals("percolation_area_x").unwrap().is_valid(0));
    assert!(threshold.reals("percolation_area_corrected_x").unwrap().is_null(0));
}
