//! Descriptions of columns in tables, in the metadata of files, and in `asperity columns`.

use std::collections::HashSet;
use std::fs::File;
use std::path::Path;

use asperity::plan::Kind;
use asperity::session::{DescribedColumns, Session};
use asperity::tables::parquet;
use serde_json::{Value, json};

use crate::bench::{Bench, STUDY, assert_same_files, is_idle, text};
use crate::manifest::stages_from;
use crate::shipped;

/// Returns the columns of each stage that `asperity columns` lists for a manifest.
fn promised(manifest: &Path) -> Vec<DescribedColumns> {
    let session = Session::new(manifest, manifest.with_file_name("nothing-computed"));
    session.columns(None).unwrap()
}

fn name(described: &DescribedColumns) -> &str {
    described.stage.as_deref().expect("a stage of a study")
}

/// Checks that the tables of a study have exactly the listed columns, in the same order and with
/// the same descriptions. The list names the units that the columns `unit` and `pressure_unit` of
/// a table hold.
pub fn assert_kept(bench: &Bench, study: &str, manifest: &Path) {
    for described in promised(manifest) {
        let stage = name(&described);
        let table = bench.table(study, stage);
        assert_eq!(table.descriptions_in_units(), described.columns, "{stage} of {study}");
    }
}

#[test]
fn every_column_of_every_shipped_manifest_has_a_meaning_and_every_number_a_unit() {
    let manifests = shipped::all();
    assert!(manifests.len() >= 10, "the manifests are gone");
    for manifest in manifests {
        for described in promised(&manifest) {
            let position = format!("{} · {}", manifest.display(), name(&described));
            assert!(described.columns.len() > 1, "{position}");
            for column in described.columns {
                let silent =
                    column.meaning.is_empty() || column.meaning == "value computed by the query";
                assert!(!silent, "{position}: {column:?}");
                let lacks_unit = column.kind == "real" && column.unit.is_empty();
                assert!(!lacks_unit, "{position}: {column:?}");
                let roles = ["parameter", "surface", "load", "derived", "result"];
                assert!(roles.contains(&column.role.as_str()), "{column:?}");
            }
        }
    }
}

#[test]
fn tables_have_the_columns_that_the_manifest_promises() {
    let bench = Bench::new();
    bench.run(&STUDY);
    assert_kept(&bench, "small", &bench.path("study.toml"));
}

#[test]
fn a_file_describes_its_columns_in_plain_json_too() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let file = bench.data().join("results/small/curves.parquet");
    let metadata = parquet::verify(File::open(file).unwrap()).unwrap();
    let printed: Value = serde_json::from_str(metadata.get("columns").unwrap()).unwrap();
    let columns = bench.table("small", "curves").descriptions();
    assert_eq!(printed, json!(columns));
    let mean =
        printed.as_array().unwrap().iter().find(|column| column["name"] == "area_corrected_mean");
    let expected = "mean of: estimate of the true contact area divided by the nominal area";
    assert_eq!(mean.unwrap()["meaning"], expected);
}

#[test]
fn a_query_says_what_its_columns_mean_and_inherits_what_it_only_passes_on() {
    let bench = Bench::new();
    let query = &stages_from("area")
        .aggregate(
            "doubled",
            "sql = 'select load, 2 * area_fraction as twice, 3 * area_fraction as thrice \
             from area'; columns = { twice = { unit = '1/2', meaning = 'double the area' } }",
        )
        .text();
    bench.run(&format!("{}{query}", *STUDY));
    let columns = bench.table("small", "doubled").descriptions();
    let said: Vec<[&str; 3]> =
        columns.iter().map(|column| [&*column.role, &*column.unit, &*column.meaning]).collect();
    assert_eq!(
        said[..3],
        [
            [
                "load",
                "E* × rms slope",
                "reduced load p₀/(E* h′): mean pressure over the nominal area, divided by effective \
                 modulus × rms slope. Where loads are given as pressures it is derived from \
                 `pressure`"
            ],
            ["result", "1/2", "double the area"],
            ["result", "", "value computed by the query"],
        ]
    );
    assert_kept(&bench, "small", &bench.path("study.toml"));
}

/// Checks that no key and no stored table depends on the wording of a description.
#[test]
fn another_meaning_computes_nothing_and_stands_in_the_published_table() {
    let bench = Bench::new();
    let query = &stages_from("area")
        .aggregate(
            "doubled",
            "sql = 'select load, 2 * area_fraction as twice from area'; \
             columns = { twice = { unit = '1', meaning = 'double the area' } }",
        )
        .text();
    let manifest = format!("{}{query}", *STUDY);
    bench.run(&manifest);
    let store = || {
        let mut files = bench.files();
        files.retain(|path, _| path.to_string_lossy().contains("store"));
        files
    };
    let before = store();
    let counts = bench.run(&manifest.replace("double the area", "twice the contact area"));
    assert!(counts.values().all(is_idle), "{counts:?}");
    let twice = bench.table("small", "doubled").descriptions().swap_remove(1);
    assert_eq!(twice.meaning, "twice the contact area");
    assert_same_files(&store(), &before);
}

#[test]
fn stored_tables_hold_no_meaning() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let holds =
        |bytes: &[u8], text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
    let meaning = "fraction of the nodes in contact";
    let mut stored = 0;
    for (path, bytes) in bench.files() {
        if path.to_string_lossy().contains("store") {
            assert!(!holds(&bytes, meaning), "{}", path.display());
            stored += 1;
        }
    }
    assert!(stored > 10);
    let published = std::fs::read(bench.data().join("results/small/area.parquet")).unwrap();
    assert!(holds(&published, meaning));
}

#[test]
fn columns_of_codes_list_and_explain_them() {
    let bench = Bench::new();
    let all: Value =
        serde_json::from_str(&text(&bench.output(&["columns", "--json"]).stdout)).unwrap();
    let kinds = all.as_array().unwrap().iter();
    let columns: Vec<&Value> = kinds.flat_map(|kind| kind["columns"].as_array().unwrap()).collect();
    for (name, code) in [("stop", "pair-limit"), ("status", "too-few-points")] {
        let column = columns.iter().find(|column| column["name"] == name).unwrap();
        let codes = column["codes"].as_array().unwrap();
        assert!(codes.iter().any(|entry| entry["code"] == code), "{column}");
        assert!(codes.iter().all(|entry| !entry["meaning"].as_str().unwrap().is_empty()));
    }
}

#[test]
fn columns_are_listed_for_a_stage_a_study_and_any_study() {
    let bench = Bench::new();
    let path = bench.write(&STUDY);
    let path = path.to_str().unwrap();
    let printed = |arguments: &[&str]| text(&bench.output(arguments).stdout);
    let stage = printed(&["columns", path, "law"]);
    assert!(stage.contains("kappa_standard_error"), "{stage}");
    assert!(!stage.contains("largest_cluster"), "{stage}");
    let study: Value = serde_json::from_str(&printed(&["columns", path, "--json"])).unwrap();
    let names: Vec<&str> =
        study.as_array().unwrap().iter().map(|s| s["stage"].as_str().unwrap()).collect();
    assert_eq!(names, ["surfaces", "light", "area", "corrected", "law", "curves"]);
    let any = printed(&["columns"]);
    for name in
        ["heights", "full_contact_load", "pressures", "density_sd", "erf_scale", "area_persson"]
    {
        assert!(any.contains(name), "{name} in\n{any}");
    }
    let wrong = bench.output(&["columns", path, "corected"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("did you mean `corrected`?"));
    assert!(!bench.data().exists());
}

#[test]
fn what_any_study_may_have_holds_all_that_the_shipped_ones_have() {
    // The published table has more columns: the task of a row, the file of its surface, and columns
    // that repeat others in the units of the study, such as "`stiffness` × E*/side".
    let known: HashSet<String> = DescribedColumns::for_all_kinds()
        .into_iter()
        .flat_map(|kind| kind.columns)
        .map(|column| column.name)
        .chain(["task", "path"].map(str::to_owned))
        .collect();
    for manifest in shipped::all() {
        // Statistics are named after the columns that they reduce; queries choose their own names.
        let mut stages = promised(&manifest);
        stages.retain(|described| described.kind != Kind::Aggregate);
        for described in stages {
            for column in &described.columns {
                // The manifest names labels.
                if column.meaning == "label of the surface" {
                    continue;
                }
                let stage = name(&described);
                let repeated =
                    column.meaning.strip_prefix('`').and_then(|text| text.split_once('`'));
                let named = repeated.map_or(&*column.name, |(reduced, _)| reduced);
                assert!(known.contains(named), "{} of {stage}", column.name);
            }
        }
    }
}
