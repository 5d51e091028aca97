//! `asperity diff`: parameters, rows and means of two studies.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use arrow::array::{Array, ArrayRef, Float64Array};
use asperity::session::Session;
use asperity::session::diff::{Comparison, Difference, Test};
use asperity::statistics::intervals::two_sided_quantile;
use asperity::tables::parquet::{self, Columns};
use serde_json::Value;

use crate::bench::{Bench, STUDY, text};
use crate::manifest::manifest;

/// Study of three random surfaces under two loads.
static SMALL: LazyLock<String> = LazyLock::new(|| {
    manifest("small", "seed = 7")
        .generate("surfaces", "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = 8; realizations = 3")
        .solve("contact", "loads = [0.05, 0.1]")
        .measure("area", "")
        .text()
});

/// Runs a manifest under a file name and returns its path.
fn run(bench: &Bench, file: &str, manifest: &str) -> PathBuf {
    let path = bench.path(file);
    fs::write(&path, manifest).unwrap();
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    path
}

fn compare(bench: &Bench, a: &Path, b: &Path) -> Comparison {
    let [a, b] = [a, b].map(|manifest| Session::new(manifest, bench.data()));
    a.diff(&b).unwrap()
}

/// Runs `asperity diff` with options, and returns its output and exit code.
fn diff(bench: &Bench, a: &Path, b: &Path, options: &[&str]) -> (String, Option<i32>) {
    let mut arguments = vec!["diff", a.to_str().unwrap(), b.to_str().unwrap()];
    arguments.extend(options);
    let output = bench.output(&arguments);
    let printed = if output.stdout.is_empty() { &output.stderr } else { &output.stdout };
    (text(printed), output.status.code())
}

/// Copies a folder with its subfolders.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target)
        } else {
            fs::copy(&path, target).map(drop).unwrap()
        }
    }
}

#[test]
fn a_study_equals_its_copy_its_archive_and_a_study_of_another_name() {
    let bench = Bench::new();
    let first = run(&bench, "first.toml", &STUDY);
    let second = run(&bench, "second.toml", &STUDY.replace("\"small\"", "\"second\""));
    let archive = bench.path("small.zip");
    let shared = bench.output(&["share", first.to_str().unwrap(), "-o", archive.to_str().unwrap()]);
    assert!(shared.status.success(), "{}", text(&shared.stderr));
    copy(&bench.data(), &bench.path("copy"));
    let tables = bench.data().join("results/small");
    let unpacked = bench.path("unpacked");
    copy(&tables, &unpacked.join("data/results/small"));
    for other in [&second, &archive, &unpacked, &tables, &bench.path("copy/results/second")] {
        let (printed, code) = diff(&bench, &first, other, &["--exit-code"]);
        assert_eq!(code, Some(0), "{printed}");
        assert!(printed.ends_with("A and B are equal\n"), "{printed}");
        assert!(printed.contains("parameters: equal"), "{printed}");
        assert!(printed.contains("equal to the last bit: surfaces (4 rows)"), "{printed}");
    }
    let (printed, code) = diff(&bench, &bench.data(), &bench.path("copy"), &["--exit-code"]);
    assert_eq!((printed.matches("A and B are equal").count(), code), (2, Some(0)), "{printed}");
}

#[test]
fn the_interval_of_paired_surfaces_has_its_closed_form() {
    let bench = Bench::new();
    let first = run(&bench, "first.toml", &SMALL);
    let loose = SMALL.replace("\"small\"", "\"loose\"").replace("loads", "tolerance = 0.2\nloads");
    let loose = run(&bench, "loose.toml", &loose);
    let comparison = compare(&bench, &first, &loose);
    assert!(!comparison.equal);
    let study = &comparison.studies[0];
    let changed: Vec<String> =
        study.parameters.iter().flatten().map(|found| found.what.to_string()).collect();
    assert_eq!(changed.len(), 1, "{changed:?}");
    assert!(changed[0].starts_with("tolerance ") && changed[0].ends_with(" → 0.2"), "{changed:?}");

    let stage = study.stages.iter().find(|stage| stage.stage == "contact").unwrap();
    let tables = stage.tables.as_ref().unwrap();
    assert_eq!((tables.rows.common, &tables.rows.across[..]), (6, &["tolerance".to_owned()][..]));
    let column = tables.columns.iter().find(|column| column.column == "mean_gap").unwrap();
    let [a, b] = ["small", "loose"].map(|name| {
        let table = bench.table(name, "contact");
        let loads = table.reals("load").unwrap().clone();
        let gaps = table.reals("mean_gap").unwrap().clone();
        let heavy = (0..table.rows()).filter(|&row| loads.value(row) == 0.1);
        heavy.map(|row| gaps.value(row)).collect::<Vec<_>>()
    });
    let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
    let mean = differences.iter().sum::<f64>() / 3.0;
    let squares: f64 = differences.iter().map(|value| (value - mean).powi(2)).sum();
    let half = two_sided_quantile(0.95, 2) * (squares / 2.0 / 3.0).sqrt();
    let found = column.means.iter().find(|mean| mean.load == Some(0.1)).unwrap();
    assert_eq!((found.test, found.values_a, found.values_b), (Test::Paired, 3, 3));
    assert!(mean != 0.0 && half > 0.0, "the tolerance changes the gap");
    let scale = mean.abs();
    assert!((found.difference - mean).abs() < 1e-12 * scale);
    assert!((found.lower.unwrap() - (mean - half)).abs() < 1e-12 * scale);
    assert!((found.upper.unwrap() - (mean + half)).abs() < 1e-12 * scale);
}

#[test]
fn surfaces_of_other_seeds_are_independent() {
    let bench = Bench::new();
    let first = run(&bench, "first.toml", &SMALL);
    let other = SMALL.replace("\"small\"", "\"other\"").replace("seed = 7", "seed = 8");
    let other = run(&bench, "other.toml", &other);
    let comparison = compare(&bench, &first, &other);
    let study = &comparison.studies[0];
    let parameters = study.parameters.as_ref().unwrap();
    let seed = Difference::Key {
        key: "seed".into(),
        a: vec![7.into()],
        b: vec![8.into()],
        units: [None, None],
    };
    assert_eq!(parameters.iter().map(|found| &found.what).collect::<Vec<_>>(), [&seed]);
    let tables = study.stages[2].tables.as_ref().unwrap();
    assert_eq!(
        (tables.rows.common, tables.rows.only_in_a.rows, tables.rows.only_in_b.rows),
        (0, 6, 6)
    );
    assert_eq!(tables.rows.only_in_a.surfaces.first[0], "seed 7, realization 0");
    let area = tables.columns.iter().find(|column| column.column == "area_fraction").unwrap();
    for mean in &area.means {
        assert_eq!((mean.test, mean.values_a, mean.values_b), (Test::Welch, 3, 3));
        assert!(mean.lower < Some(mean.difference) || mean.is_equal());
    }
}

#[test]
fn loads_of_one_study_only_have_their_unit() {
    let bench = Bench::new();
    let pressed = |load: &str| {
        SMALL
            .replace("loads = [0.05, 0.1]", "effective_modulus = \"2 GPa\"\nloads = [LOADS]")
            .replace("LOADS", &format!("\"1 MPa\", {load:?}"))
    };
    let first = run(&bench, "first.toml", &pressed("2 MPa"));
    let more = run(&bench, "more.toml", &pressed("3 MPa").replace("\"small\"", "\"more\""));
    let (printed, _) = diff(&bench, &first, &more, &[]);
    assert!(printed.contains("only in A, at other loads: pressure 2 MPa"), "{printed}");
    assert!(printed.contains("only in B, at other loads: pressure 3 MPa"), "{printed}");
}

#[test]
fn rows_and_stages_of_one_study_only_are_named() {
    let bench = Bench::new();
    let first = run(&bench, "first.toml", &SMALL);
    let more = SMALL
        .replace("\"small\"", "\"more\"")
        .replace("realizations = 3", "realizations = 4")
        .replace("[0.05, 0.1]", "[0.1, 0.2]")
        + "[stage.heights]\nkind = \"measure\"\nfrom = \"surfaces\"\nwhat = \"heights\"\n";
    let more = run(&bench, "more.toml", &more);
    let (printed, code) = diff(&bench, &first, &more, &["--exit-code"]);
    assert_eq!(code, Some(1));
    for expected in [
        "surfaces: realizations 3 → 4",
        "contact: loads 0.05, 0.1 → 0.1, 0.2",
        "heights: stage (measure) only in B",
        "1 row only in B, of other surfaces: seed 7, realization 3",
        "3 rows only in A, at other loads: load 0.05",
        "5 rows only in B: 2 of other surfaces (seed 7, realization 3), 3 at other loads (load 0.2)",
    ] {
        let printed = printed.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(printed.contains(expected), "`{expected}` is not in\n{printed}");
    }
    assert_eq!(diff(&bench, &first, &more, &[]).1, Some(0));
}

#[test]
fn an_altered_table_of_an_older_data_folder_is_found() {
    let bench = Bench::new();
    let manifest = run(&bench, "study.toml", &STUDY);
    let old = bench.path("old");
    copy(&bench.data(), &old);
    // A table that another version of the program could have written.
    let path = old.join("results/small/area.parquet");
    let (table, metadata) = parquet::decode(fs::File::open(&path).unwrap(), Columns::All).unwrap();
    let areas = table.reals("area_fraction").unwrap();
    let larger: ArrayRef =
        std::sync::Arc::new(Float64Array::from_iter(areas.iter().map(|area| Some(1.01 * area?))));
    assert_eq!(larger.null_count(), 0);
    let altered = table.replacing("area_fraction", larger);
    fs::write(&path, parquet::encode(&altered, &metadata)).unwrap();

    let (json, _) = diff(&bench, &old, &manifest, &["--json"]);
    let json: Value = serde_json::from_str(&json).unwrap();
    let study = &json["studies"][0];
    assert_eq!((&json["equal"], &study["parameters"]), (&false.into(), &Value::Array(vec![])));
    let stages = study["stages"].as_array().unwrap();
    for stage in stages {
        assert_eq!(stage["equal"], stage["stage"] != "area", "{}", stage["stage"]);
    }
    let area = stages.iter().find(|stage| stage["stage"] == "area").unwrap();
    let columns = area["columns"].as_array().unwrap().iter();
    let different: Vec<&Value> = columns.filter(|column| column["differing"] != 0).collect();
    assert_eq!(different.len(), 1);
    for mean in different[0]["means"].as_array().unwrap() {
        let relative = mean["relative"].as_f64().unwrap();
        assert!((relative - (1.0 / 1.01 - 1.0)).abs() < 1e-12, "{relative}");
    }
    let (printed, _) = diff(&bench, &bench.data(), &old, &["--study", "small"]);
    assert!(printed.contains("area_fraction"), "{printed}");
}

#[test]
fn another_version_of_a_stage_is_a_difference_even_if_its_results_are_equal() {
    let bench = Bench::new();
    let manifest = run(&bench, "study.toml", &STUDY);
    let owner = bench.path("data/results/small/owner.json");
    let mut record: Value = serde_json::from_slice(&fs::read(&owner).unwrap()).unwrap();
    let light = &mut record["study"]["stages"][1];
    assert_eq!(light["name"], "light");
    light["version"] = 1.into();
    fs::write(&owner, record.to_string()).unwrap();
    let tables = bench.data().join("results/small");
    let (printed, code) = diff(&bench, &tables, &manifest, &["--exit-code"]);
    assert!(printed.contains("light: `solve` version 1 → "), "{printed}");
    assert!(
        printed.ends_with("A and B have different parameters and equal results\n"),
        "{printed}"
    );
    assert_eq!(code, Some(1));
}

#[test]
fn manifests_without_results_are_compared_by_their_parameters() {
    let bench = Bench::new();
    let [first, second] = ["first.toml", "second.toml"].map(|name| bench.path(name));
    fs::write(&first, SMALL.as_bytes()).unwrap();
    fs::write(&second, SMALL.replace("hurst = 0.8", "hurst = 0.5")).unwrap();
    let (printed, code) = diff(&bench, &first, &second, &[]);
    assert_eq!(code, Some(0), "{printed}");
    assert!(printed.contains("surfaces: hurst 0.8 → 0.5"), "{printed}");
    assert!(
        printed.contains("A has no results of surfaces, contact, area for its parameters"),
        "{printed}"
    );
    let (printed, _) = diff(&bench, &first, &first, &[]);
    assert!(printed.ends_with("A and B are equal manifests\n"), "{printed}");
    assert!(!bench.data().exists());

    let (printed, code) = diff(&bench, &first, &bench.path(""), &[]);
    assert_eq!(code, Some(2));
    assert!(printed.contains("has no tables of a study"), "{printed}");
}

#[test]
fn a_table_of_all_means_is_written_and_other_files_are_kept() {
    let bench = Bench::new();
    let first = run(&bench, "first.toml", &STUDY);
    let other =
        run(&bench, "other.toml", &STUDY.replace("seed = 7", "seed = 8").replace("small", "b"));
    let output = bench.path("means.parquet");
    for _ in 0..2 {
        let (printed, code) = diff(&bench, &first, &other, &["--output", output.to_str().unwrap()]);
        assert_eq!(code, Some(0), "{printed}");
    }
    let file = fs::File::open(&output).unwrap();
    let (table, _) = parquet::decode(file, Columns::All).unwrap();
    let mut names = table.names();
    names.sort_unstable();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    let columns = table.texts("column").unwrap();
    let stages = table.texts("stage").unwrap();
    let is_area =
        |row: &usize| columns.value(*row) == "area_fraction" && stages.value(*row) == "area";
    let of_areas = (0..table.rows()).filter(is_area);
    // Two spectra under four loads.
    assert_eq!(of_areas.count(), 8);
    assert!(table.has("k_upper") && table.has("more_than_noise"));
    let before = fs::read(&first).unwrap();
    let (printed, code) = diff(&bench, &first, &other, &["-o", first.to_str().unwrap()]);
    assert_eq!((fs::read(&first).unwrap(), code), (before, Some(2)), "{printed}");
}

#[test]
fn a_study_is_compared_with_itself_under_a_setting() {
    let bench = Bench::new();
    let path = run(&bench, "study.toml", &STUDY);
    let manifest = path.to_str().unwrap();
    let setting = ["--set", "stage.light.tolerance=0.01"];
    let computed = bench.output(&[&["run", manifest], &setting[..]].concat());
    assert!(computed.status.success(), "{}", text(&computed.stderr));
    let printed = |options: &[&str]| {
        let output = bench.output(&[&["diff", manifest], options].concat());
        (text(&output.stdout), text(&output.stderr))
    };
    let (compared, _) = printed(&setting);
    assert!(compared.contains("light: tolerance 5e-5 → 0.01"), "{compared}");
    assert!(compared.contains("study.toml --set "), "{compared}");
    let reversed = ["--set-a", "stage.light.tolerance=0.01"];
    assert!(printed(&reversed).0.contains("light: tolerance 0.01 → 5e-5"));
    let equal = [&setting[..], &reversed].concat();
    assert!(printed(&equal).0.ends_with("\nA and B are equal\n"));
    assert!(printed(&[]).1.contains("required"), "one study and no setting");
    let of_tables = bench.data().join("results/small");
    let (_, error) = printed(&[of_tables.to_str().unwrap(), setting[0], setting[1]]);
    assert!(error.contains("settings override keys of a manifest"), "{error}");
}

#[test]
fn studies_without_a_common_load_say_so() {
    let bench = Bench::new();
    let a = run(&bench, "a.toml", &STUDY);
    let other = STUDY.replace("\"small\"", "\"other\"");
    let b = run(&bench, "b.toml", &other.replace("{ to = 0.1, steps = 4 }", "[0.03, 0.07]"));
    let (printed, _) = diff(&bench, &a, &b, &[]);
    let hint = "no load is in both: `load` is 0.025 … 0.1 in A and 0.03 … 0.07 in B";
    assert!(printed.contains(hint), "{printed}");
}
