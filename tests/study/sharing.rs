//! Archives of studies: unpacked archives are complete, pass their checksums, and can run.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use zip::ZipArchive;

use crate::bench::{Bench, STUDY, is_idle, text};
use crate::disk::Disk;
use crate::manifest::manifest;

const DAY: &str = "2026-11-22";

/// Packs the study in `study.toml` into `NAME.zip` with these options.
fn share(bench: &Bench, name: &str, options: &[&str]) -> PathBuf {
    let archive = bench.path(&format!("{name}.zip"));
    let [manifest, output] = [bench.path("study.toml"), archive.clone()];
    let mut arguments = vec!["share", manifest.to_str().unwrap(), "--date", DAY];
    arguments.extend(["--output", output.to_str().unwrap()]);
    arguments.extend(options);
    let shared = bench.output(&arguments);
    assert!(shared.status.success(), "{}", text(&shared.stderr));
    archive
}

fn unpack(archive: &Path) -> Bench {
    let bench = Bench::new();
    let mut archive = ZipArchive::new(File::open(archive).unwrap()).unwrap();
    archive.extract(bench.path("")).unwrap();
    bench
}

#[test]
fn an_archive_with_its_store_has_nothing_left_to_compute() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let unpacked = unpack(&share(&bench, "whole", &["--store"]));
    let before = unpacked.files();
    assert!(unpacked.run(&STUDY).values().all(is_idle));
    let mut after = unpacked.files();
    after.retain(|path, _| !path.ends_with("lock"));
    crate::bench::assert_same_files(&after, &before);
}

#[test]
fn an_archive_without_its_store_can_be_read_and_computes_the_same_bytes() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let unpacked = unpack(&share(&bench, "light", &[]));
    assert!(!unpacked.data().join("store").exists());
    let manifest = unpacked.path("study.toml");
    let read = ["table", manifest.to_str().unwrap(), "area", "--csv"];
    let (there, here) = (
        unpacked.output(&read),
        bench.output(&["table", bench.path("study.toml").to_str().unwrap(), "area", "--csv"]),
    );
    assert!(there.status.success(), "{}", text(&there.stderr));
    assert_eq!(there.stdout, here.stdout);
    let counts = unpacked.run(&STUDY);
    assert_eq!(counts["light"].computed, 4);
    let tables = |bench: &Bench| {
        let mut files = bench.files();
        files.retain(|path, _| {
            path.starts_with("results")
                && path.extension().is_some_and(|ending| ending == "parquet")
        });
        files
    };
    crate::bench::assert_same_files(&tables(&unpacked), &tables(&bench));
}

#[test]
fn sha256sum_finds_every_file_as_it_was() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let unpacked = unpack(&share(&bench, "checked", &["--store"]));
    let check = |arguments: &[&str]| {
        let mut command = Command::new("sha256sum");
        command.args(arguments).current_dir(unpacked.path("")).output().unwrap()
    };
    let listed = fs::read_to_string(unpacked.path("SHA256SUMS")).unwrap();
    let files = walk(&unpacked.path("")).len();
    assert_eq!(listed.lines().count(), files - 1, "all but the list itself");
    assert!(check(&["--check", "--strict", "SHA256SUMS"]).status.success());
    fs::write(unpacked.path("study.toml"), STUDY.replace("0.8", "0.7")).unwrap();
    assert!(!check(&["--check", "--strict", "SHA256SUMS"]).status.success());
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn the_same_study_and_day_make_the_same_bytes() {
    let [first, second] = [Bench::new(), Bench::new()];
    let archives = [&first, &second].map(|bench| {
        bench.run(&STUDY);
        fs::read(share(bench, "again", &["--store", "--license", "CC-BY-4.0"])).unwrap()
    });
    assert!(archives[0] == archives[1]);
}

#[test]
fn the_description_names_every_file_and_the_day() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let unpacked = unpack(&share(&bench, "described", &[]));
    let description = fs::read(unpacked.path("ro-crate-metadata.json")).unwrap();
    let description: Value = serde_json::from_slice(&description).unwrap();
    let graph = description["@graph"].as_array().unwrap();
    let root = graph.iter().find(|entity| entity["@id"] == "./").unwrap();
    assert_eq!(root["datePublished"], DAY);
    let parts: Vec<&str> = root["hasPart"]
        .as_array()
        .unwrap()
        .iter()
        .map(|part| part["@id"].as_str().unwrap())
        .collect();
    let own = ["ro-crate-metadata.json", "SHA256SUMS"];
    for path in walk(&unpacked.path("")) {
        let path = path.strip_prefix(unpacked.path("")).unwrap().to_str().unwrap().to_owned();
        assert!(own.contains(&&*path) || parts.contains(&&*path), "{path}");
    }
    assert_eq!(parts.len(), walk(&unpacked.path("")).len() - own.len());
}

#[test]
fn input_files_lie_where_the_manifest_finds_them() {
    let bench = Bench::new();
    let [maps, manifests] = ["maps", "manifests"].map(|folder| bench.path(folder));
    fs::create_dir_all(&maps).unwrap();
    fs::create_dir_all(&manifests).unwrap();
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/topography/pyramid.x3p");
    fs::copy(scan, maps.join("scan.x3p")).unwrap();
    let path = manifests.join("scan.toml");
    fs::write(
        &path,
        manifest("scan", "")
            .generate(
                "scan",
                "method = 'file'; path = '../maps/scan.x3p'; periodic = false; fill = 'nearest'",
            )
            .text(),
    )
    .unwrap();
    let manifest = path.to_str().unwrap();
    let run = bench.output(&["run", manifest]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let archive = bench.path("scan.zip");
    let shared =
        bench.output(&["share", manifest, "--store", "--output", archive.to_str().unwrap()]);
    assert!(shared.status.success(), "{}", text(&shared.stderr));
    let unpacked = unpack(&archive);
    let moved = unpacked.path("manifests/scan.toml");
    assert!(unpacked.path("maps/scan.x3p").is_file());
    let again = unpacked.output(&["run", moved.to_str().unwrap()]);
    assert!(text(&again.stdout).contains("nothing to do"), "{}", text(&again.stdout));
}

#[test]
fn what_is_not_the_study_as_it_is_now_is_not_shared() {
    let bench = Bench::new();
    let share = |bench: &Bench| {
        let output = bench.path("s.zip");
        let manifest = bench.path("study.toml");
        let output = bench.output(&[
            "share",
            manifest.to_str().unwrap(),
            "--output",
            output.to_str().unwrap(),
        ]);
        (output.status.code(), text(&output.stderr))
    };
    bench.write(&STUDY);
    let (code, printed) = share(&bench);
    assert!(
        code == Some(2) && printed.contains("`small` has no tables for the current manifest"),
        "{printed}"
    );
    bench.run(&STUDY);
    assert_eq!(share(&bench).0, Some(0));
    let (code, printed) = share(&bench);
    assert!(code == Some(2) && printed.contains("s.zip` already exists"), "{printed}");
    fs::remove_file(bench.path("s.zip")).unwrap();
    fs::remove_file(bench.data().join("results/small/area.parquet")).unwrap();
    let (code, printed) = share(&bench);
    let why = "the table of `area` is out of date";
    assert!(code == Some(2) && printed.contains(why), "{printed}");
}

#[test]
fn a_full_disk_is_reported_once() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let Some(disk) = Disk::mount(&bench.path("disk")) else {
        return;
    };
    disk.resize(2);
    let [manifest, output] = [bench.path("study.toml"), bench.path("disk/s.zip")];
    let [manifest, output] = [&manifest, &output].map(|path| path.to_str().unwrap());
    let shared = bench.output(&["share", manifest, "--output", output]);
    assert_eq!(shared.status.code(), Some(1));
    let printed = text(&shared.stderr);
    assert!(printed.contains("No space left on device"), "{printed}");
    assert_eq!(printed.lines().count(), 1, "{printed}");
}

#[test]
fn names_with_line_breaks_pass_their_checksums_and_hints_are_commands() {
    let bench = Bench::new();
    let manifest = bench.path("two\nlines and 'quotes'.toml");
    fs::write(&manifest, STUDY.as_bytes()).unwrap();
    let manifest = manifest.to_str().unwrap();
    let early = bench.output(&["share", manifest]);
    let printed = text(&early.stderr);
    assert!(printed.contains("first"), "{printed}");
    // The terminal shows the line break escaped; everything else is one word of the shell.
    let hint = printed.split('`').find(|text| text.starts_with("asperity run ")).unwrap();
    assert_eq!(shlex::split(hint).unwrap().len(), 3, "{hint}");
    assert!(bench.output(&["run", manifest]).status.success());
    let output = bench.path("s.zip");
    assert!(
        bench.output(&["share", manifest, "--output", output.to_str().unwrap()]).status.success()
    );
    let unpacked = unpack(&output);
    let mut checked = Command::new("sha256sum");
    checked.args(["--check", "--strict", "--quiet", "SHA256SUMS"]).current_dir(unpacked.path(""));
    let checked = checked.output().unwrap();
    assert!(checked.status.success(), "{}", text(&checked.stderr));
}

#[test]
fn an_archive_replaces_an_archive_and_nothing_else() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let archive = share(&bench, "s", &[]);
    let first = fs::read(&archive).unwrap();
    share(&bench, "s", &["--replace", "--store"]);
    assert_ne!(fs::read(&archive).unwrap(), first);
    let table = bench.data().join("results/small/area.parquet");
    let notes = bench.path("notes.txt");
    fs::write(&notes, "notes").unwrap();
    let manifest = bench.path("study.toml");
    for (path, why) in [
        (&manifest, "is a file of the study"),
        (&table, "is a file of the study"),
        (&notes, "was not written by `asperity share`"),
    ] {
        let before = fs::read(path).unwrap();
        let [manifest, path] = [&manifest, path].map(|path| path.to_str().unwrap());
        let shared = bench.output(&["share", manifest, "--output", path, "--replace"]);
        assert_eq!(shared.status.code(), Some(2));
        let printed = text(&shared.stderr);
        assert!(printed.contains(why), "{printed}");
        assert!(fs::read(path).unwrap() == before, "{path}");
    }
}

#[test]
fn incomplete_stages_are_reported_and_the_rest_is_shared() {
    let bench = Bench::new();
    bench.run(&STUDY);
    // With more bootstrap samples, the fit is a different task that has not run.
    bench.write(&STUDY.replace("bootstrap = 20", "bootstrap = 21"));
    let manifest = bench.path("study.toml");
    let output = bench.path("s.zip");
    let shared =
        bench.output(&["share", manifest.to_str().unwrap(), "--output", output.to_str().unwrap()]);
    let printed = text(&shared.stderr);
    assert!(shared.status.success(), "{printed}");
    assert!(printed.contains("`law` is incomplete"), "{printed}");
    let unpacked = unpack(&output);
    assert!(unpacked.data().join("results/small/area.parquet").is_file());
    assert!(!unpacked.data().join("results/small/law.parquet").exists());
}

#[test]
fn a_damaged_table_of_the_store_is_named_with_the_commands_that_replace_it() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let surfaces = bench.table("small", "surfaces");
    let key = surfaces.texts("task").unwrap().value(0).to_owned();
    let file = bench.file_of(&key);
    let whole = fs::read(&file).unwrap();
    let mut bytes = whole.clone();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&file, bytes).unwrap();
    let manifest = bench.path("study.toml");
    let [manifest, output, picture] =
        [manifest, bench.path("s.zip"), bench.path("s.png")].map(|path| path.display().to_string());
    let commands = [
        vec!["share", &manifest, "--store", "--output", &output],
        vec!["view", &key, "--output", &picture],
    ];
    for command in &commands {
        let printed = text(&bench.output(command).stderr);
        let advice =
            "set it aside with `asperity verify`, and compute it again with `asperity run`";
        assert!(printed.contains(advice), "{command:?}: {printed}");
    }
    assert_eq!(bench.output(&["verify"]).status.code(), Some(1));
    bench.run(&STUDY);
    assert!(fs::read(&file).unwrap() == whole);
    for command in &commands {
        let done = bench.output(command);
        assert!(done.status.success(), "{command:?}: {}", text(&done.stderr));
    }
}

#[test]
fn a_damaged_table_is_not_shared() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let table = bench.data().join("results/small/area.parquet");
    let mut bytes = fs::read(&table).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&table, bytes).unwrap();
    let manifest = bench.path("study.toml");
    let output = bench.path("s.zip");
    let shared =
        bench.output(&["share", manifest.to_str().unwrap(), "--output", output.to_str().unwrap()]);
    assert!(!shared.status.success());
    assert!(text(&shared.stderr).contains("area"), "{}", text(&shared.stderr));
    assert!(!output.exists());
}
