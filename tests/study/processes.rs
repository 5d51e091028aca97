//! Systems with a limit on the number of threads (each counts as a process of its user).

use std::fs::{self, Permissions};
use std::io::{Write, stderr};
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};
use std::thread::available_parallelism;

use crate::bench::{Bench, STUDY, assert_same_files, text};

/// Number of a user without processes, so that only the command counts.
const USER: &str = "54321";

/// Returns a bench that all users can write to, with its manifest.
fn open_bench() -> Bench {
    let bench = Bench::new();
    fs::set_permissions(bench.path(""), Permissions::from_mode(0o777)).unwrap();
    bench.write(&STUDY);
    bench
}

/// Runs a command as a user with this limit of threads. If this process cannot change its user,
/// prints a line and returns `None`.
fn limited(bench: &Bench, threads: u32, arguments: &[&str]) -> Option<Output> {
    let mut command = Command::new("setpriv");
    command
        .args(["--reuid", USER, "--regid", USER, "--clear-groups"])
        .args(["prlimit", &format!("--nproc={threads}")])
        .arg(env!("CARGO_BIN_EXE_asperity"))
        .args(&arguments[..1])
        .arg(bench.path("study.toml"))
        .args(&arguments[1..])
        .env("ASPERITY_DATA", bench.data());
    let output = command.output();
    let is_changed = output.as_ref().is_ok_and(|output| {
        let printed = text(&output.stderr);
        !printed.contains("setpriv: ") && !printed.contains("prlimit: ")
    });
    if is_changed {
        return output.ok();
    }
    // `println` output is hidden for tests that pass.
    let line = b"NOT TESTED, because this process may not change its user\n";
    stderr().write_all(line).expect("standard error is open");
    None
}

#[test]
fn a_run_of_few_threads_computes_the_same_bytes_and_none_panics() {
    let bench = open_bench();
    let Some(alone) = limited(&bench, 1, &["run"]) else {
        return;
    };
    let refused = |output: &Output| {
        let printed = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(1 | 2)), "{printed}");
        assert!(printed.contains("allow more processes (`ulimit -u`)"), "{printed}");
        assert!(!printed.contains("panicked"), "{printed}");
    };
    refused(&alone);
    // Means use polars, which starts two threads per core.
    refused(&limited(&bench, 3, &["run"]).unwrap());
    let query = ["table", "--sql", "select count(*) as n from area"];
    refused(&limited(&bench, 2, &query).unwrap());
    for reader in [&["verify"][..], &["table", "area", "--csv"]] {
        let output = limited(&bench, 1, reader).unwrap();
        assert!(output.status.success(), "{reader:?}: {}", text(&output.stderr));
    }
    let cores = u32::try_from(available_parallelism().unwrap().get()).unwrap();
    // Other threads: helpers, workers, the thread of a query and the signal handler.
    let enough = 4 * cores + 2;
    for command in [&["run"][..], &["report"], &query] {
        let output = limited(&bench, enough, command).unwrap();
        assert!(output.status.success(), "{command:?}: {}", text(&output.stderr));
    }
    let free = Bench::new();
    free.run(&STUDY);
    let tables = |bench: &Bench| {
        let mut files = bench.files();
        let is_table = |ending: &std::ffi::OsStr| ending == "parquet";
        files.retain(|path, _| path.extension().is_some_and(is_table));
        files.retain(|path, _| !path.ends_with("failures.parquet"));
        files
    };
    assert_same_files(&tables(&bench), &tables(&free));
}
