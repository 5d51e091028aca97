//! Two rough surfaces that are pressed against each other.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use asperity::tables::table::Table;
use serde_json::Value;

use crate::bench::{Bench, assert_same_files, text};
use crate::manifest::manifest;
use crate::reference::assert_near;

/// Two bodies and the contact of their sum, which an independent solver has computed to 1e-12.
fn reference(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/reference/two-bodies").join(name)
}

/// Rows of `sums.csv`: kind of pair, shift, five descriptors, then three areas and three mean gaps.
fn sums() -> Vec<Vec<f64>> {
    let text = fs::read_to_string(reference("sums.csv")).unwrap();
    let rows = text.lines().skip(1);
    rows.map(|row| row.split(',').map(|number| number.parse().unwrap()).collect()).collect()
}

/// Number of bytes before the heights of the two maps.
const HEADER: usize = 128;
const NODES: usize = 96;

/// Returns the bytes of a map whose rows, or the bytes of whose heights, are changed.
fn changed(name: &str, change: impl FnOnce(&mut [u8])) -> Vec<u8> {
    let mut bytes = fs::read(reference(name)).unwrap();
    change(&mut bytes[HEADER..]);
    bytes
}

fn measured(lower: &Path, keys: &str) -> String {
    let file = |path: &Path| {
        format!("method = 'file'; path = '{}'; side = 1.0; periodic = true", path.display())
    };
    manifest("pair", "")
        .generate("upper", &file(&reference("body1.npy")))
        .generate("lower", &file(lower))
        .solve(
            "contact",
            &format!(
                "from = 'upper'; against = 'lower'; loads = [0.02, 0.06, 0.2]; tolerance = 1e-9; \
                 {keys}"
            ),
        )
        .measure("area", "")
        .text()
}

static RANDOM: LazyLock<String> = LazyLock::new(|| {
    manifest("pair", "")
        .generate(
            "upper",
            "nodes = 48; hurst = 0.8; k_lower = 2; k_upper = [4, 8]; rms_slope = 0.1; seed = 1; \
             realizations = 2",
        )
        .generate(
            "lower",
            "nodes = 48; hurst = 0.5; k_lower = 2; k_upper = 6; rms_slope = 0.05; seed = 2; \
             realizations = 2",
        )
        .solve(
            "contact",
            "from = 'upper'; against = 'lower'; shift = [[0, 0], [0.25, 0.1]]; \
             loads = [0.02, 0.1]",
        )
        .measure("area", "")
        .text()
});

fn reals(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().iter().map(Option::unwrap).collect()
}

fn texts(table: &Table, name: &str) -> Vec<String> {
    table.texts(name).unwrap().iter().map(|text| text.unwrap().to_owned()).collect()
}

fn integers(table: &Table, name: &str) -> Vec<i64> {
    table.integers(name).unwrap().iter().map(Option::unwrap).collect()
}

#[test]
fn shifted_bodies_have_the_contacts_that_an_independent_solver_finds() {
    let bench = Bench::new();
    let replica = bench.path("replica.npy");
    // The sign is the highest bit of the last byte of a height.
    let negative = |heights: &mut [u8]| heights.chunks_mut(8).for_each(|height| height[7] ^= 0x80);
    fs::write(&replica, changed("body1.npy", negative)).unwrap();
    for (kind, lower) in [(0.0, reference("body2.npy")), (1.0, replica)] {
        let rows: Vec<_> = sums().into_iter().filter(|row| row[0] == kind).collect();
        let shifts: Vec<String> =
            rows.iter().map(|row| format!("[{}, {}]", row[1], row[2])).collect();
        bench.run(&measured(&lower, &format!("shift = [{}]", shifts.join(", "))));
        let pairs = bench.table("pair", "contact_pairs");
        let contact = bench.table("pair", "contact");
        assert_eq!([pairs.rows(), contact.rows()], [rows.len(), 3 * rows.len()]);
        let descriptors =
            ["rms_height", "rms_slope", "nayak", "summit_density", "full_contact_load"];
        for (index, row) in rows.iter().enumerate() {
            for (name, expected) in descriptors.iter().zip(&row[3..8]) {
                assert_near(&[reals(&pairs, name)[index]], &[*expected], 1e-7);
                assert_near(&reals(&contact, name)[3 * index..][..3], &[*expected; 3], 1e-7);
            }
            let loads = 3 * index..3 * index + 3;
            let nodes: Vec<i64> =
                row[8..11].iter().map(|a| (a * (NODES * NODES) as f64).round() as i64).collect();
            assert_eq!(integers(&contact, "contact_nodes")[loads.clone()], nodes);
            assert_near(&reals(&contact, "mean_gap")[loads], &row[11..14], 1e-7);
        }
    }
}

#[test]
fn a_mirrored_body_is_one_whose_map_is_reversed() {
    let bench = Bench::new();
    let reversed = bench.path("reversed.npy");
    let reverse = |heights: &mut [u8]| {
        let rows: Vec<u8> =
            heights.chunks(8 * NODES).rev().flat_map(<[u8]>::iter).copied().collect();
        heights.copy_from_slice(&rows);
    };
    fs::write(&reversed, changed("body2.npy", reverse)).unwrap();
    let run = |lower: &Path, keys: &str| {
        bench.run(&measured(lower, &format!("shift = [0.07, 0.23]\n{keys}")));
        let area = bench.table("pair", "area");
        let names = ["rms_slope", "mean_gap", "contact_nodes", "switches"];
        (area.only(&names), area)
    };
    let (mirrored, table) = run(&reference("body2.npy"), "mirror = \"x\"");
    assert_eq!(texts(&table, "mirror"), ["x"; 3]);
    assert_eq!(run(&reversed, "").0, mirrored);
    assert_ne!(run(&reference("body2.npy"), "").0, mirrored);
    assert_ne!(run(&reference("body2.npy"), "mirror = \"y\"").0, mirrored);
}

#[test]
fn two_waves_with_a_shift_are_one_wave_of_another_amplitude() {
    let bench = Bench::new();
    let wave = |name: &str, amplitude: f64| {
        format!(
            "[stage.{name}]\nkind = \"generate\"\nmethod = \"wave\"\nnodes = 64\nwaves = 2\n\
             amplitude = {amplitude}\n"
        )
    };
    // cos qx + cos q(x − s) = 2 cos(qs/2) cos q(x − s/2), with qs = 4π/8: the load of full contact
    // is 1/√2 in units of E* × rms slope, and a shift by half a wave gives a replica, h₂ = −h₁.
    let factor = 2.0 * (std::f64::consts::PI / 4.0).cos();
    let loads = "loads = [0.1, 0.4, 0.6]\ntolerance = 1e-9\n";
    bench.run(&format!(
        "[study]\nname = \"waves\"\n{}{}{}\
         [stage.pressed]\nkind = \"solve\"\nfrom = \"one\"\nagainst = \"other\"\n\
         shift = [0.125, 0]\n{loads}\
         [stage.alone]\nkind = \"solve\"\nfrom = \"sum\"\n{loads}",
        wave("one", 0.01),
        wave("other", 0.01),
        wave("sum", 0.01 * factor),
    ));
    let [pressed, alone] = ["pressed", "alone"].map(|stage| bench.table("waves", stage));
    for name in ["rms_slope", "mean_gap", "energy", "peak_pressure"] {
        assert_near(&reals(&pressed, name), &reals(&alone, name), 1e-9);
    }
    assert_eq!(integers(&pressed, "contact_nodes"), integers(&alone, "contact_nodes"));
    assert_near(&reals(&pressed, "full_contact_load"), &[0.5_f64.sqrt(); 3], 1e-9);
    assert_near(&reals(&pressed, "rms_height"), &[0.01 * factor / 2.0_f64.sqrt(); 3], 1e-12);
}

#[test]
fn each_surface_is_pressed_against_the_one_with_the_same_number() {
    let bench = Bench::new();
    let counts = bench.run(&RANDOM);
    assert_eq!(counts["contact"].computed, 8);
    let names = |stage: &str| {
        let table = bench.table("pair", stage);
        let numbers = integers(&table, "realization");
        numbers.into_iter().zip(texts(&table, "surface")).collect::<BTreeSet<_>>()
    };
    let pairs = bench.table("pair", "contact_pairs");
    let numbers = integers(&pairs, "realization");
    for (column, stage) in [("from_surface", "upper"), ("against_surface", "lower")] {
        let found = numbers.iter().copied().zip(texts(&pairs, column));
        assert_eq!(found.collect::<BTreeSet<_>>(), names(stage), "{stage}");
    }
    assert_eq!(integers(&pairs, "seed"), [1; 8]);
    let contact = bench.table("pair", "contact");
    assert_eq!(reals(&contact, "from_rms_slope"), [0.1; 16]);
    let slope = (0.1_f64.powi(2) + 0.05_f64.powi(2)).sqrt();
    // Slopes of independent surfaces add up as their squares, up to the correlation of the draws.
    assert!(reals(&pairs, "rms_slope").iter().all(|found| (found / slope - 1.0).abs() < 0.1));
}

#[test]
fn a_single_surface_is_pressed_against_all_surfaces_of_the_other_stage() {
    for single in ["lower", "upper"] {
        let bench = Bench::new();
        let (before, stage) = RANDOM.split_once(&format!("[stage.{single}]")).unwrap();
        let alone = stage.replacen("realizations = 2", "realizations = 1", 1);
        bench.run(&format!("{before}[stage.{single}]{alone}"));
        let pairs = bench.table("pair", "contact_pairs");
        assert_eq!(integers(&pairs, "realization"), [0, 1, 0, 1, 0, 1, 0, 1]);
        assert_eq!(texts(&pairs, "surface").into_iter().collect::<BTreeSet<_>>().len(), 8);
        let column = if single == "lower" { "against_surface" } else { "from_surface" };
        let of_single = texts(&pairs, column).into_iter().collect::<BTreeSet<_>>();
        assert_eq!(of_single.len(), if single == "lower" { 1 } else { 2 });
    }
}

#[test]
fn more_pairs_and_shifts_keep_the_bytes_of_the_others() {
    let grown = Bench::new();
    grown.run(&RANDOM);
    let more = RANDOM.replace("realizations = 2", "realizations = 3");
    let more = more.replace("[0.25, 0.1]]", "[0.25, 0.1], [0.5, 0.5]]");
    let counts = grown.run(&more);
    assert_eq!([counts["contact"].cached, counts["contact"].computed], [8, 10]);
    let fresh = Bench::new();
    fresh.run_with(&more, &["--jobs", "1"]);
    assert_same_files(&grown.published("pair"), &fresh.published("pair"));
}

#[test]
fn a_path_with_adhesion_presses_both_surfaces() {
    let bench = Bench::new();
    let keys = "adhesion = { work = 0.001, range = 0.05 }\ncontrol = \"gap\"\ngaps = [0.1, 0.05]";
    bench.run(&RANDOM.replace("loads = [0.02, 0.1]", keys));
    let contact = bench.table("pair", "contact");
    assert_eq!(contact.rows(), 16);
    assert!(contact.has("against") && contact.has("nayak"));
}

#[test]
fn maps_of_a_pair_are_drawn_again() {
    let bench = Bench::new();
    bench.run(&RANDOM);
    let key = texts(&bench.table("pair", "contact"), "task").swap_remove(0);
    let path = bench.path("maps.npz");
    let arguments = ["export", &key, "--output", path.to_str().unwrap()];
    let output = bench.output(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(path.exists());
}

#[test]
fn a_study_without_a_second_body_names_the_key_for_it() {
    let bench = Bench::new();
    let warnings = |manifest: &str| {
        let path = bench.write(manifest);
        let output = bench.output(&["plan", path.to_str().unwrap(), "--json"]);
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        let warnings = said["warnings"].as_array().unwrap();
        let messages = warnings.iter().map(|warning| warning["message"].to_string());
        messages.filter(|message| message.contains("against")).collect::<Vec<_>>()
    };
    let bodies = "bodies = [{ youngs_modulus = 2.0, poisson_ratio = 0.3 }, \
                  { youngs_modulus = 1.0, poisson_ratio = 0.3 }]";
    let both = RANDOM.replace("against = \"lower\"\n", &format!("{bodies}\n"));
    let both = both.replace("from = \"upper\"", "from = [\"upper\", \"lower\"]");
    let alone = both.replace("shift = [[0, 0], [0.25, 0.1]]\n", "");
    assert!(warnings(&alone)[0].contains("name one of them in `against`"));
    assert!(warnings(&RANDOM).is_empty());
    let itself =
        RANDOM.replace("[4, 8]", "8").replace("against = \"lower\"", "against = \"upper\"");
    assert!(warnings(&itself)[0].contains("both bodies of a pair are the same surface"));
}

#[test]
fn theories_of_one_spectrum_are_left_out_for_pairs() {
    let bench = Bench::new();
    let mean = "\n[stage.mean]\nkind = \"aggregate\"\nfrom = \"area\"\nover = \"area_fraction\"\n";
    bench.run(&format!("{}{mean}models = \"persson\"\n", *RANDOM));
    assert!(bench.table("pair", "mean").has("area_persson"));
    let path = bench.write(&format!("{}{mean}models = \"bush-gibson-thomas\"\n", *RANDOM));
    let output = bench.output(&["check", path.to_str().unwrap()]);
    assert!(text(&output.stderr).contains("pairs of surfaces"), "{}", text(&output.stderr));
}
