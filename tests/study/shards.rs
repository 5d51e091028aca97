//! Shards of a study: together they give the same bytes, even if processes are killed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::bench::{Bench, STUDY, assert_same_files, text};

fn study() -> String {
    STUDY.replace("realizations = 2", "realizations = 4")
}

fn shard(bench: &Bench, manifest: &Path, shard: &str) -> Output {
    let manifest = manifest.to_str().unwrap();
    bench.output(&["run", manifest, "--shard", shard, "--jobs", "1"])
}

/// Reads every file outside `cluster/`.
fn finished(bench: &Bench) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = bench.content();
    files.retain(|path, _| !path.starts_with("cluster"));
    files
}

/// Reads the receipts of the study, sorted by shard and process.
fn receipts(bench: &Bench) -> Vec<Value> {
    let files = bench.files().into_iter();
    let own = files.filter(|(path, _)| path.starts_with("cluster/small/receipts"));
    let whole = own.filter(|(path, _)| path.extension().is_some_and(|end| end == "json"));
    whole.map(|(_, bytes)| serde_json::from_slice(&bytes).unwrap()).collect()
}

#[test]
fn all_shards_and_a_last_run_write_what_one_run_writes() {
    let alone = Bench::new();
    alone.run(&study());
    for count in [1, 3, 20] {
        let bench = Bench::new();
        let manifest = bench.write(&study());
        for number in (1..=count).rev() {
            let output = shard(&bench, &manifest, &format!("{number}/{count}"));
            assert!(output.status.success(), "{}", text(&output.stderr));
            // Some of twenty shards have none of the eight surfaces.
            assert!(!text(&output.stdout).contains("all tables exist"), "no stage has a table yet");
        }
        let counts = bench.run(&study());
        assert!(
            ["surfaces", "light", "area", "corrected"]
                .iter()
                .all(|stage| counts[*stage].computed == 0)
        );
        assert_eq!((counts["law"].computed, counts["curves"].computed), (2, 1));
        assert_same_files(&finished(&bench), &finished(&alone));
    }
}

#[test]
fn a_shard_writes_tables_of_tasks_and_a_receipt_and_nothing_else() {
    let bench = Bench::new();
    let manifest = bench.write(&study());
    assert!(shard(&bench, &manifest, "2/3").status.success());
    let files = bench.files();
    let is_known =
        |path: &PathBuf| path.starts_with("store") || path.starts_with("cluster/small/receipts");
    assert!(files.keys().all(is_known), "{:?}", files.keys());
    let receipts = receipts(&bench);
    let [receipt] = receipts.as_slice() else {
        panic!("one receipt, not {}", receipts.len());
    };
    let tables =
        files.keys().filter(|path| path.starts_with("store") && path.extension().is_some());
    assert_eq!(receipt["computed"].as_u64(), Some(tables.count() as u64));
    assert_eq!(receipt["shard"], "2/3");
    assert!(receipt["ended"].is_u64() && receipt["seconds"].as_f64() > Some(0.0));
    let pace = receipt["pace"].as_array().unwrap();
    assert_eq!(pace.len(), 1, "one mesh: {pace:?}");
    assert!(pace[0]["pairs"].as_f64() > Some(0.0) && pace[0]["seconds"].as_f64() > Some(0.0));
}

#[test]
fn a_shard_that_fails_says_in_its_receipt_what_failed_and_why() {
    let bench = Bench::new();
    let manifest = bench.write(&study());
    assert!(shard(&bench, &manifest, "1/1").status.success());
    // A folder has the path of a surface, and tasks that depend on it are missing.
    let plan = bench.output(&["plan", manifest.to_str().unwrap(), "--tasks"]);
    let first: Value = serde_json::from_str(text(&plan.stdout).lines().next().unwrap()).unwrap();
    let key = first["task"].as_str().unwrap();
    fs::remove_dir_all(bench.data().join("store")).unwrap();
    let blocked = bench.data().join("store").join(&key[..2]).join(format!("{key}.parquet"));
    fs::create_dir_all(&blocked).unwrap();
    let output = shard(&bench, &manifest, "1/1");
    assert_eq!(output.status.code(), Some(1));
    let receipts = receipts(&bench);
    let failed = receipts.iter().find(|receipt| receipt["failed"] != Value::Array(vec![]));
    let failed = failed.unwrap()["failed"].as_array().unwrap().clone();
    assert_eq!((failed.len(), failed[0]["task"].as_str()), (1, Some(key)));
    assert_eq!(failed[0]["stage"], "surfaces");
    assert!(failed[0]["reason"].as_str().unwrap().contains(blocked.to_str().unwrap()));
    assert!(!bench.data().join("results").exists(), "failures are for the last run");
}

#[test]
fn a_shard_out_of_time_says_so_and_goes_on_later() {
    let bench = Bench::new();
    let long = study().replace("nodes = 32", "nodes = 256");
    let manifest = bench.write(&long);
    let arguments =
        ["run", manifest.to_str().unwrap(), "--shard", "1/1", "--jobs", "1", "--job", "12_1"];
    let run =
        bench.asperity(&arguments).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    while receipts(&bench).is_empty() {
        sleep(Duration::from_millis(5));
    }
    sleep(Duration::from_millis(100));
    let killed = Command::new("kill").args(["-TERM", &run.id().to_string()]).status();
    assert!(killed.unwrap().success());
    assert_eq!(run.wait_with_output().unwrap().status.code(), Some(143));
    let receipts = receipts(&bench);
    assert_eq!(
        (&receipts[0]["interrupted"], &receipts[0]["job"]),
        (&Value::Bool(true), &Value::from("12_1"))
    );
    assert!(receipts[0]["ended"].is_u64());
    let alone = Bench::new();
    alone.run(&long);
    bench.run(&long);
    assert_same_files(&finished(&bench), &finished(&alone));
}

#[test]
fn prune_waits_for_elements_that_may_be_at_work_elsewhere() {
    let bench = Bench::new();
    let manifest = bench.write(&study());
    assert!(shard(&bench, &manifest, "1/2").status.success());
    let folder = bench.data().join("cluster/small/receipts");
    let path = fs::read_dir(&folder).unwrap().next().unwrap().unwrap().path();
    let mut receipt: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    receipt["ended"] = Value::Null;
    receipt["machine"] = Value::from("node-08");
    fs::write(&path, receipt.to_string()).unwrap();
    let before = bench.files();
    let other = bench.write(&STUDY.replace("small", "other").replace("seed = 7", "seed = 8"));
    let other = other.to_str().unwrap();
    let refused = bench.output(&["prune", other, "--yes"]);
    assert_eq!(refused.status.code(), Some(1));
    let printed = text(&refused.stderr);
    assert!(
        printed.contains("shard 1/2 of `small` on node-08") && printed.contains("`--force`"),
        "{printed}"
    );
    assert_same_files(&bench.files(), &before);
    assert!(bench.output(&["prune", other, "--yes", "--force"]).status.success());
    assert!(bench.files().keys().all(|path| path.ends_with("lock")));
}

/// Runs on two hosts that share the data, but neither locks nor host names.
struct Hosts<'a> {
    bench: &'a Bench,
    manifest: PathBuf,
}

impl Hosts<'_> {
    /// Starts a run on a host whose lock file is not visible to the other host.
    fn start(&self, host: &str, arguments: &str) -> Child {
        let lock = self.bench.path(&format!("lock-of-{host}"));
        fs::write(&lock, "").unwrap();
        let there = self.bench.data().join("store/lock");
        let script = format!(
            "hostname {host} && mount --bind {} {} && exec {} run {} {arguments}",
            lock.display(),
            there.display(),
            env!("CARGO_BIN_EXE_asperity"),
            self.manifest.display(),
        );
        Command::new("unshare")
            .args(["--mount", "--uts", "sh", "-c", &script])
            .env("ASPERITY_DATA", self.bench.data())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    }
}

/// Returns whether this process can create namespaces for host names and mounts.
fn may_unshare() -> bool {
    let command =
        Command::new("unshare").args(["--mount", "--uts", "hostname", "elsewhere"]).output();
    command.is_ok_and(|output| output.status.success())
}

/// Returns how often the hosts are killed; `ASPERITY_KILLS` overrides the default.
fn kills() -> usize {
    let asked = std::env::var("ASPERITY_KILLS").ok();
    asked.map_or(6, |asked| asked.parse().expect("a number"))
}

#[test]
fn hosts_that_do_not_see_each_others_locks_lose_nothing_and_delete_nothing_of_others() {
    if !may_unshare() {
        eprintln!("NOT TESTED, because this process cannot create namespaces");
        return;
    }
    let alone = Bench::new();
    alone.run(&study());
    let bench = Bench::new();
    let manifest = bench.write(&study());
    // This run creates the store and the lock file.
    assert!(shard(&bench, &manifest, "1/1000000").status.success());
    let foreign = bench.data().join("store/unfinished/.unfinished-1@node-09-aB3dEf");
    fs::create_dir_all(foreign.parent().unwrap()).unwrap();
    fs::write(&foreign, "half a table").unwrap();
    let hosts = Hosts { bench: &bench, manifest };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for kill in 0..kills() {
        if kill % 5 == 4 {
            let _ = fs::remove_dir_all(bench.data().join("results"));
            let tables = bench
                .files()
                .into_keys()
                .filter(|path| path.extension().is_some_and(|end| end == "parquet"));
            tables.for_each(|path| fs::remove_file(bench.data().join(path)).unwrap());
        }
        let mut runs = [hosts.start("node-01", "--shard 1/2"), hosts.start("node-02", "")];
        for run in &mut runs {
            sleep(Duration::from_millis(random.random_range(0..150)));
            run.kill().unwrap();
            run.wait().unwrap();
        }
        assert!(foreign.exists());
    }
    for (host, arguments) in
        [("node-01", "--shard 1/2"), ("node-02", "--shard 2/2"), ("node-01", "")]
    {
        assert!(hosts.start(host, arguments).wait().unwrap().success());
    }
    assert_eq!(fs::read(&foreign).unwrap(), b"half a table");
    let (mut found, expected) = (finished(&bench), finished(&alone));
    // One host must not delete files that another host may be writing.
    found.retain(|path, _| {
        !path.starts_with("store/unfinished")
            && !path.file_name().unwrap().to_string_lossy().starts_with(".unfinished")
    });
    assert_same_files(&found, &expected);
}
