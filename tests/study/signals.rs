//! Runs that a signal stops.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::bench::{Bench, STUDY, text};

/// Study that runs longer than the test needs to stop it.
fn long() -> String {
    STUDY.replace("nodes = 32", "nodes = 512").replace("realizations = 2", "realizations = 4")
}

/// Starts a run from a shell that executes `before` first, and waits until tasks are running.
fn start(bench: &Bench, manifest: &str, before: &str) -> Child {
    let path = bench.write(manifest);
    let mut run = Command::new("sh")
        .args(["-c", &format!("{before} exec \"$0\" run \"$1\"")])
        .args([env!("CARGO_BIN_EXE_asperity"), path.to_str().unwrap()])
        .env("ASPERITY_DATA", bench.data())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut printed = String::new();
    let mut lines = BufReader::with_capacity(1, run.stderr.as_mut().unwrap());
    lines.read_line(&mut printed).unwrap();
    assert!(printed.contains("to run"), "{printed}");
    run
}

fn send(run: &Child, signal: &str) {
    let mut kill = Command::new("kill");
    let status = kill.args([signal, &run.id().to_string()]).status();
    assert!(status.unwrap().success());
}

#[test]
fn a_stopped_run_ends_as_shells_expect_of_the_signal() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let bench = Bench::new();
        let run = start(&bench, &long(), "");
        send(&run, signal);
        let output = run.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{signal}");
        assert!(text(&output.stderr).contains("stopping"), "{signal}");
    }
}

/// Shell command that ignores SIGHUP, like `nohup`.
#[test]
fn a_run_that_ignores_the_end_of_its_terminal_outlives_it() {
    let bench = Bench::new();
    let manifest = STUDY.replace("nodes = 32", "nodes = 128");
    let run = start(&bench, &manifest, "trap '' HUP;");
    send(&run, "-HUP");
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}
