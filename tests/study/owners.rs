//! Two manifests with the same study name.

use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::bench::{Bench, STUDY, assert_same_files, counts, text};

/// Writes another manifest next to that of the bench.
fn write(bench: &Bench, name: &str, manifest: &str) -> PathBuf {
    let path = bench.path(name);
    fs::write(&path, manifest).unwrap();
    path
}

fn run(bench: &Bench, manifest: &Path, options: &[&str]) -> Output {
    let arguments = ["run", manifest.to_str().unwrap(), "--json"];
    bench.output(&[&arguments, options].concat())
}

/// Checks that another manifest is refused and that the tables of the bench are unchanged.
fn is_refused(bench: &Bench, other: &str) -> String {
    let before = bench.files();
    let manifest = write(bench, "other.toml", other);
    let output = run(bench, &manifest, &[]);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{other}\n{printed}");
    assert!(bench.files() == before, "{printed}");
    printed
}

#[test]
fn another_manifest_of_the_same_name_needs_replace() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let others = STUDY.replace("seed = 7", "seed = 8");
    let printed = is_refused(&bench, &others);
    for part in ["results/small`", "study.toml`", "--replace"] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
    // Reading commands use the results of their own manifest and change nothing.
    let other = bench.path("other.toml");
    for command in [
        &["table", other.to_str().unwrap(), "area"] as &[&str],
        &["report", other.to_str().unwrap()],
    ] {
        assert!(!bench.output(command).status.success());
        assert_same_files(&bench.files(), &before);
    }

    let output = run(&bench, &other, &["--replace"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(counts(&output.stdout)["surfaces"].computed, 4);
    assert!(run(&bench, &other, &[]).status.success(), "it is the owner now");
    let first = bench.path("study.toml");
    assert_eq!(run(&bench, &first, &[]).status.code(), Some(2));
    assert!(run(&bench, &first, &["--replace"]).status.success());
    for (path, bytes) in before {
        assert!(bench.files()[&path] == bytes, "{}", path.display());
    }
}

#[test]
fn a_manifest_may_be_edited_as_one_likes() {
    let bench = Bench::new();
    bench.run(&STUDY);
    bench.run(&STUDY.replace("seed = 7", "seed = 8"));
    bench.run(&STUDY.replace("realizations = 2", "realizations = 1"));
    bench.run(STUDY.split("[stage.light]").next().unwrap());
}

#[test]
fn a_copy_of_the_same_study_shares_its_results_and_another_study_is_refused() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let copy = write(&bench, "copy.toml", &STUDY);
    let output = run(&bench, &copy, &[]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_same_files(&bench.files(), &before);
    for other in [
        STUDY.split("[stage.curves]").next().unwrap(),
        &STUDY.replace("realizations = 2", "realizations = 3"),
        &STUDY.replace("steps = 4", "steps = 5"),
        &STUDY.replace("stage.curves", "stage.means"),
    ] {
        is_refused(&bench, other);
    }
}

#[test]
fn a_growing_study_in_another_file_is_the_same_study() {
    let bench = Bench::new();
    let until = "{ at_least = 2, at_most = 50, until = \"sem(area.area_fraction) < 5 %\" }";
    let growing = STUDY.replace("realizations = 2", &format!("realizations = {until}"));
    bench.run(&growing);
    let copy = write(&bench, "copy.toml", &growing);
    let output = run(&bench, &copy, &[]);
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn manifest_and_data_may_move_together() {
    let bench = Bench::new();
    let [old, new] = ["old", "new"].map(|name| bench.path(name));
    fs::create_dir(&old).unwrap();
    let manifest = write(&bench, "old/study.toml", &STUDY);
    let data = |folder: &Path| folder.join("data").display().to_string();
    let output = run(&bench, &manifest, &["--data", &data(&old)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::rename(&old, &new).unwrap();
    let edited = STUDY.replace("seed = 7", "seed = 8");
    let manifest = write(&bench, "new/study.toml", &edited);
    let output = run(&bench, &manifest, &["--data", &data(&new)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn a_manifest_may_have_any_name() {
    let bench = Bench::new();
    let name = std::ffi::OsStr::from_bytes(b"\xff.toml");
    let path = bench.path("").join(name);
    fs::write(&path, STUDY.as_bytes()).unwrap();
    for _ in 0..2 {
        let mut command = bench.asperity(&["run"]);
        let output = command.arg(&path).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}

#[test]
fn tables_of_unknown_owners_are_not_overwritten() {
    let bench = Bench::new();
    bench.run(&STUDY);
    fs::remove_file(bench.data().join("results/small/owner.json")).unwrap();
    let printed = is_refused(&bench, &STUDY.replace("seed = 7", "seed = 8"));
    assert!(printed.contains("an unknown manifest"), "{printed}");
    assert!(run(&bench, &bench.path("study.toml"), &["--replace"]).status.success());
    bench.run(&STUDY.replace("seed = 7", "seed = 8"));
}

#[test]
fn an_empty_folder_is_anybodys() {
    let bench = Bench::new();
    bench.run(&STUDY);
    for stage in ["surfaces", "light", "area", "corrected", "law", "curves"] {
        let table = bench.data().join(format!("results/small/{stage}.parquet"));
        fs::remove_file(table).unwrap();
    }
    let other = write(&bench, "other.toml", &STUDY.replace("seed = 7", "seed = 8"));
    assert!(run(&bench, &other, &[]).status.success());
}

#[test]
fn a_renamed_manifest_keeps_its_results_and_says_so() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let renamed = bench.path("renamed.toml");
    fs::rename(bench.path("study.toml"), &renamed).unwrap();
    let output = run(&bench, &renamed, &[]);
    assert!(output.status.success());
    let printed = text(&output.stderr);
    assert!(printed.contains("study.toml`, which no longer exists"), "{printed}");
    for (path, bytes) in bench.files() {
        assert!(path.ends_with("owner.json") || before[&path] == bytes, "{}", path.display());
    }
    // The results belong to the new file, which may change as it likes.
    assert!(!text(&run(&bench, &renamed, &[]).stderr).contains("study.toml"));
    write(&bench, "renamed.toml", &STUDY.replace("seed = 7", "seed = 8"));
    assert!(run(&bench, &renamed, &[]).status.success());
}

#[test]
fn a_copy_never_becomes_the_owner_while_the_original_exists() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let copy = write(&bench, "copy.toml", &STUDY);
    assert!(run(&bench, &copy, &[]).status.success());
    // The copy was run last, and still must not remove rows of the original.
    write(&bench, "copy.toml", &STUDY.replace("seed = 7", "seed = 8"));
    let output = run(&bench, &copy, &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("study.toml"), "{}", text(&output.stderr));
    bench.run(&STUDY.replace("seed = 7", "seed = 9"));
    write(&bench, "copy.toml", &STUDY.replace("\"small\"", "\"other\""));
    assert!(run(&bench, &copy, &[]).status.success());
}
