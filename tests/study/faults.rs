//! Damaged files and folders are reported by name, recomputed if possible, and never used.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::bench::{Bench, STUDY, assert_same_files, is_idle};
use crate::disk::Disk;

const ROUNDS: usize = 40;
const FAULTS: usize = 25;

fn study() -> String {
    STUDY.replace("realizations = 2", "realizations = 3")
}

fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "parquet")
}

/// Flips one bit or cuts off the end of a file.
fn damage(whole: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let index = random.random_range(0..bytes.len());
    match random.random() {
        true => bytes[index] ^= 1 << random.random_range(0..8),
        false => bytes.truncate(index),
    }
    bytes
}

/// Damages `FAULTS` of these files and returns their paths.
fn strike<'a>(
    bench: &Bench,
    files: &'a BTreeMap<PathBuf, Vec<u8>>,
    within: &str,
    random: &mut ChaCha8Rng,
) -> Vec<&'a PathBuf> {
    let tables = files.keys().filter(|path| is_table(path) && path.starts_with(within));
    let tables: Vec<_> = tables.collect();
    let victims: Vec<_> = tables.sample(random, FAULTS).copied().collect();
    assert_eq!(victims.len(), FAULTS);
    for &victim in &victims {
        fs::write(bench.data().join(victim), damage(&files[victim], random)).unwrap();
    }
    victims
}

/// Removes the quarantined files and returns whether the other files equal `before`.
fn is_restored(bench: &Bench, before: &BTreeMap<PathBuf, Vec<u8>>) -> bool {
    let mut files = bench.files();
    files.retain(|path, _| {
        let is_aside = path.to_string_lossy().contains(".damaged");
        if is_aside {
            fs::remove_file(bench.data().join(path)).unwrap();
        }
        !is_aside
    });
    files == *before
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr[..]].concat()).into_owned()
}

/// Checks `verify` with 500 faults in the store and the results.
#[test]
fn verify_finds_every_flipped_bit_and_every_truncation() {
    let bench = Bench::new();
    bench.run(&study());
    let files = bench.files();
    let mut random = ChaCha8Rng::seed_from_u64(6);
    for _ in 0..ROUNDS / 2 {
        let victims = strike(&bench, &files, "", &mut random);
        let output = bench.output(&["verify"]);
        let printed = printed(&output);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert!(printed.contains(&format!("{FAULTS} damaged")), "{printed}");
        for victim in victims {
            assert!(printed.contains(victim.to_str().unwrap()), "{printed}");
        }
        bench.run(&study());
        assert!(is_restored(&bench, &files));
        assert!(bench.output(&["verify"]).status.success());
    }
}

/// Checks runs with 500 faults that `verify` has not found before.
#[test]
fn no_flipped_bit_and_no_truncation_reaches_a_result() {
    let bench = Bench::new();
    bench.run(&study());
    let files = bench.files();
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..ROUNDS / 2 {
        let victims = strike(&bench, &files, "store", &mut random);
        // If there are no results, every table of the store is read.
        fs::remove_dir_all(bench.data().join("results")).unwrap();
        let manifest = bench.write(&study());
        let output = bench.output(&["run", manifest.to_str().unwrap()]);
        let printed = printed(&output);
        assert!(output.status.success(), "{printed}");
        for victim in victims {
            assert!(printed.contains(victim.to_str().unwrap()), "{printed}");
        }
        assert!(is_restored(&bench, &files));
    }
}

#[test]
fn a_table_that_somebody_has_edited_is_kept_aside_by_the_next_run() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let table = bench.data().join("results/small/area.parquet");
    fs::write(&table, "edited").unwrap();
    let manifest = bench.write(&STUDY);
    let output = bench.output(&["run", manifest.to_str().unwrap()]);
    let printed = printed(&output);
    assert!(output.status.success(), "{printed}");
    assert!(printed.contains("was edited after `asperity run` wrote it"), "{printed}");
    let aside = bench.data().join("results/small/area.parquet.damaged");
    assert_eq!(fs::read(&aside).unwrap(), b"edited");
    assert!(is_restored(&bench, &before));
}

#[test]
fn verify_tells_scripts_what_it_found() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let manifest = bench.path("study.toml");
    let verify = || {
        let output = bench.output(&["verify", manifest.to_str().unwrap(), "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (output.status.code(), json)
    };
    let (code, sound) = verify();
    assert_eq!(code, Some(0));
    // 19 tasks and 6 stages.
    assert_eq!(sound, serde_json::json!({ "checked": 25, "damaged": [] }));
    let victim = bench.data().join("results/small/area.parquet");
    fs::copy(bench.data().join("results/small/law.parquet"), &victim).unwrap();
    let (code, damaged) = verify();
    assert_eq!(code, Some(1));
    let aside = format!("{}.damaged", victim.display());
    assert_eq!(damaged["damaged"][0]["aside"], aside);
    let cause = damaged["damaged"][0]["cause"].as_str().unwrap();
    assert!(cause.contains("expected stage `area` of study `small`"), "{cause}");
}

/// Returns the command for a user without the permissions of root.
fn by_anybody(bench: &Bench, arguments: &[&str]) -> Output {
    let program = bench.path("asperity");
    if !program.exists() {
        // Copied by a process of its own: a child that another test starts meanwhile would inherit
        // the file as open for writing, and a file that is written cannot be started.
        let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_asperity")).arg(&program).status();
        assert!(copied.unwrap().success());
        let folder = program.parent().unwrap();
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
    }
    let mut command = Command::new(program);
    let is_root =
        fs::metadata("/proc/self").is_ok_and(|me| std::os::unix::fs::MetadataExt::uid(&me) == 0);
    if is_root {
        command.uid(65534);
    }
    let command = command.args(arguments).env("ASPERITY_DATA", bench.data());
    command.output().expect("the command starts")
}

#[test]
fn a_folder_that_may_not_be_written_is_named_and_what_is_there_is_read() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let manifest = bench.write(&STUDY);
    let run = ["run", manifest.to_str().unwrap()];
    let all = |mode: u32| {
        let folders = bench.files().into_keys().map(|path| bench.data().join(path));
        let folders = folders.map(|path| path.parent().unwrap().to_owned());
        for folder in folders.chain([bench.data(), bench.data().join("store")]) {
            fs::set_permissions(folder, fs::Permissions::from_mode(mode)).unwrap();
        }
    };
    all(0o555);
    let output = by_anybody(&bench, &run);
    assert!(output.status.success(), "{}", printed(&output));
    bench.write(&study());
    let output = by_anybody(&bench, &run);
    let message = printed(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains(bench.data().join("store").to_str().unwrap()), "{message}");
    assert!(message.contains("Permission denied"), "{message}");
    assert!(message.contains("stopped after 0 of"), "{message}");
    let files = bench.files().into_keys();
    let victim = files.map(|path| bench.data().join(path)).find(|path| is_table(path));
    let victim = victim.unwrap();
    fs::write(&victim, "damaged").unwrap();
    let output = by_anybody(&bench, &["verify"]);
    let message = printed(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains(victim.to_str().unwrap()), "{message}");
    assert!(message.contains("left in place"), "{message}");
    all(0o755);
}

#[test]
fn a_file_that_may_not_be_read_is_not_called_damaged() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let files = bench.files().into_keys();
    let victim = files.map(|path| bench.data().join(path)).find(|path| is_table(path)).unwrap();
    fs::set_permissions(&victim, fs::Permissions::from_mode(0o000)).unwrap();
    let message = printed(&by_anybody(&bench, &["verify"]));
    assert!(message.contains("Permission denied"), "{message}");
    assert!(message.contains("checked, none damaged"), "{message}");
    assert!(message.contains("files that cannot be read: 1"), "{message}");
}

#[test]
fn a_read_only_disk_is_read_and_named_when_it_should_be_written() {
    let bench = Bench::new();
    let Some(disk) = Disk::mount(&bench.data()) else {
        return;
    };
    bench.run(&STUDY);
    let files = bench.files();
    disk.protect();
    assert!(bench.run(&STUDY).values().all(is_idle));
    assert!(bench.output(&["verify"]).status.success());
    let manifest = bench.write(&study());
    let output = bench.output(&["run", manifest.to_str().unwrap()]);
    let message = printed(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("Read-only file system"), "{message}");
    assert_same_files(&bench.files(), &files);
}

#[test]
fn a_store_needs_no_temporary_folder_elsewhere() {
    let bench = Bench::new();
    let manifest = bench.write(&STUDY);
    let mut command = bench.asperity(&["run", manifest.to_str().unwrap()]);
    let output = command.env("TMPDIR", "/nowhere").output().unwrap();
    assert!(output.status.success(), "{}", printed(&output));
}

#[test]
fn a_clock_that_jumps_changes_nothing() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let far = Duration::from_secs(50 * 365 * 86400);
    let times = [SystemTime::UNIX_EPOCH, SystemTime::now() + far];
    for (number, path) in before.keys().enumerate() {
        let file = File::open(bench.data().join(path)).unwrap();
        file.set_modified(times[number % 2]).unwrap();
    }
    assert!(bench.run(&STUDY).values().all(is_idle));
    assert!(bench.output(&["verify"]).status.success());
    assert_same_files(&bench.files(), &before);
}
