//! How much memory a run takes.

use std::fs;
use std::process::{Child, Stdio};
use std::time::Duration;

use asperity::memory::{PROGRAM, of_largest};
use asperity::plan::Plan;
use asperity::study::Study;

use crate::bench::{Bench, STUDY, text};

/// The most bytes that a process has held until it ended, as Linux counts them.
fn peak(mut process: Child) -> u64 {
    let status = format!("/proc/{}/status", process.id());
    let mut peak = 0;
    while process.try_wait().unwrap().is_none() {
        let told = fs::read_to_string(&status).unwrap_or_default();
        let line = told.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kibibytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
        let kibibytes: Option<u64> = kibibytes.and_then(|number| number.parse().ok());
        peak = kibibytes.unwrap_or(0).max(peak);
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(process.wait().unwrap().success());
    peak << 10
}

#[cfg(target_os = "linux")]
#[test]
fn a_worker_takes_no_more_memory_than_is_reckoned_with() {
    let bench = Bench::new();
    // On a mesh so large that its maps outweigh the program.
    let manifest = STUDY.replace("nodes = 32", "nodes = 1024");
    let manifest = manifest.replace("k_upper = [4, 8]\nrealizations = 2", "k_upper = 8");
    let manifest = manifest.replace(
        "loads = { to = 0.1, steps = 4 }",
        "loads = [0.3, 0.6]\npressures = \"all\"\ntolerance = 0.1",
    );
    let path = bench.write(&manifest);
    let plan = Plan::of(&Study::read(&path).unwrap());
    let tasks: Vec<usize> = (0..plan.tasks.len()).collect();
    let reckoned = PROGRAM + of_largest(&plan, &tasks);
    let mut run = bench.asperity(&["run", path.to_str().unwrap(), "--jobs", "1"]);
    let taken = peak(
        run.stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap(),
    );
    assert!(taken <= reckoned.0, "{taken} bytes of {}", reckoned.0);
    assert!(2 * taken > reckoned.0, "{taken} bytes of {}", reckoned.0);
}

#[test]
fn a_run_works_on_fewer_surfaces_where_memory_is_scarce_and_says_so() {
    let [scarce, ample] = [Bench::new(), Bench::new()];
    let run = |bench: &Bench, memory: &str| {
        let path = bench.write(STUDY);
        let arguments = [
            "run",
            path.to_str().unwrap(),
            "--jobs",
            "2",
            "--memory",
            memory,
        ];
        let output = bench.output(&arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let told = run(&scarce, "1 MB");
    assert!(told.contains("for 1 task at once, not 2"), "{told}");
    let told = run(&ample, "1GiB");
    assert!(!told.contains("at once"), "{told}");
    let tables = |bench: &Bench| {
        let mut files = bench.files();
        files.retain(|path, _| path.extension().is_some_and(|end| end == "parquet"));
        files
    };
    assert_eq!(tables(&scarce), tables(&ample));
}

#[test]
fn a_size_that_is_none_is_refused() {
    let bench = Bench::new();
    let path = bench.write(STUDY);
    let output = bench.output(&["run", path.to_str().unwrap(), "--memory", "lots"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("lots"));
}
