//! Memory use of runs compared with its estimate.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::time::Duration;

use asperity::session::Session;
use asperity::tables::parquet::TableFile;
use bytesize::ByteSize;

use crate::bench::{Bench, STUDY, text};
use crate::manifest::manifest;

/// Returns the peak memory of a process in bytes, as Linux reports it.
fn peak(mut process: Child) -> u64 {
    let status = format!("/proc/{}/status", process.id());
    let mut peak = 0;
    while process.try_wait().unwrap().is_none() {
        let printed = fs::read_to_string(&status).unwrap_or_default();
        let line = printed.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kibibytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
        let kibibytes: Option<u64> = kibibytes.and_then(|number| number.parse().ok());
        peak = kibibytes.unwrap_or(0).max(peak);
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(process.wait().unwrap().success());
    peak << 10
}

/// Returns the estimated minimum memory of a run.
fn least(bench: &Bench, manifest: &Path) -> ByteSize {
    let status = Session::new(manifest, bench.data()).status().unwrap();
    status.least_memory()
}

#[cfg(target_os = "linux")]
#[test]
fn a_worker_takes_no_more_memory_than_is_reckoned_with() {
    let bench = Bench::new();
    // The mesh is so large that its maps need more memory than the program.
    let manifest = STUDY.replace("nodes = 32", "nodes = 1024");
    let manifest = manifest.replace("k_upper = [4, 8]\nrealizations = 2", "k_upper = 8");
    let manifest = manifest.replace(
        "loads = { to = 0.1, steps = 4 }",
        "loads = [0.3, 0.6]\npressures = \"all\"\ntolerance = 0.1",
    );
    let path = bench.write(&manifest);
    let reckoned = least(&bench, &path);
    let mut run = bench.asperity(&["run", path.to_str().unwrap(), "--jobs", "1"]);
    let taken = peak(run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    assert!(taken <= reckoned.0, "{taken} bytes of {}", reckoned.0);
    assert!(2 * taken > reckoned.0, "{taken} bytes of {}", reckoned.0);
}

#[test]
fn a_run_works_on_fewer_surfaces_where_memory_is_scarce_and_says_so() {
    let [scarce, ample] = [Bench::new(), Bench::new()];
    let run = |bench: &Bench, memory: &str| {
        let path = bench.write(&STUDY);
        let arguments = ["run", path.to_str().unwrap(), "--jobs", "2", "--memory", memory];
        let output = bench.output(&arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let one = least(&scarce, &scarce.write(&STUDY));
    let printed = run(&scarce, &one.0.to_string());
    assert!(printed.contains("1 of 2 tasks of"), "{printed}");
    let printed = run(&ample, "1GiB");
    assert!(!printed.contains("in parallel"), "{printed}");
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
    let path = bench.write(&STUDY);
    let output = bench.output(&["run", path.to_str().unwrap(), "--memory", "lots"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("lots"));
}

/// Returns a study that would need much memory and a very long time.
fn huge() -> String {
    STUDY.replace("nodes = 32", "nodes = 8192").replace("k_upper = [4, 8]", "k_upper = 8")
}

#[test]
fn what_does_not_fit_is_refused_before_anything_starts() {
    let bench = Bench::new();
    let path = bench.write(&huge());
    let run = |memory: &str| {
        let output = bench.output(&["run", path.to_str().unwrap(), "--memory", memory]);
        assert_eq!(output.status.code(), Some(2));
        text(&output.stderr)
    };
    let printed = run("1GB");
    let expected = "error: a task of stage `light` needs 4.4GB of memory on its mesh of 8192 × 8192 \
                    nodes, more than the 1.0 GB of `--memory`: increase it, or reduce the mesh to";
    assert!(printed.starts_with(expected), "{printed}");
    let printed = run("1MB");
    assert!(printed.ends_with("`--memory`: increase it\n"), "{printed}");
    let tables = bench.files().into_keys();
    let tables: Vec<_> = tables.filter(|path| path.extension().is_some()).collect();
    assert!(tables.is_empty(), "{tables:?}");
}

/// Runs a study in a process with this address space in KiB.
#[cfg(target_os = "linux")]
fn limited(bench: &Bench, manifest: &Path, kibibytes: u64) -> Output {
    let run = bench.asperity(&["run", manifest.to_str().unwrap(), "--jobs", "2"]);
    let mut shell = Command::new("sh");
    let script = format!("ulimit -v {kibibytes} && exec \"$0\" \"$@\"");
    shell.args(["-c", &script]).arg(run.get_program());
    shell.args(run.get_args()).env("RUST_BACKTRACE", "1");
    let variables = run.get_envs();
    shell.envs(variables.filter_map(|(name, value)| Some((name, value?))));
    shell.output().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn few_addresses_refuse_a_task_and_break_none() {
    let bench = Bench::new();
    let path = bench.write(&huge());
    let output = limited(&bench, &path, 3_000_000);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    assert!(
        printed.contains("of address space that `ulimit -v` leaves: raise that limit"),
        "{printed}"
    );

    let manifest = STUDY.replace("nodes = 32", "nodes = 512");
    let megabytes = [200, 300, 400, 500, 600, 700, 800, 1000, 1500, 64_000];
    let ends = megabytes.map(|megabytes| {
        let bench = Bench::new();
        let path = bench.write(&manifest);
        let output = limited(&bench, &path, 1000 * megabytes);
        let printed = text(&output.stderr);
        assert!(!printed.contains("backtrace"), "{megabytes} MB: {printed}");
        output.status.code().expect("no signal")
    });
    assert!(ends.is_sorted_by(|before, after| before >= after), "{ends:?}");
    assert_eq!([ends[0], ends[9]], [2, 0], "{ends:?}");
}

/// Returns a study with a table of two million rows.
static LARGE: LazyLock<String> = LazyLock::new(|| {
    manifest("large", "")
        .generate(
            "surfaces",
            "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = 8; realizations = 100",
        )
        .measure("heights", "bins = 20000")
        .text()
});

#[cfg(target_os = "linux")]
#[test]
fn a_table_larger_than_the_memory_of_a_run_is_written_row_group_by_row_group() {
    let bench = Bench::new();
    let path = bench.write(&LARGE);
    let allowed = ByteSize::mb(250);
    let memory = allowed.0.to_string();
    let arguments = ["run", path.to_str().unwrap(), "--jobs", "1", "--memory", &memory];
    let mut run = bench.asperity(&arguments);
    let taken = peak(run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    assert!(taken <= allowed.0, "{taken} bytes of {}", allowed.0);
    let table = bench.data().join("results/large/heights.parquet");
    let table = TableFile::open(File::open(table).unwrap()).unwrap();
    assert_eq!(table.rows(), 2_000_000);
}

#[test]
fn an_aggregate_whose_tables_do_not_fit_says_what_they_take() {
    let bench = Bench::new();
    let aggregate =
        "[stage.mean]\nkind = \"aggregate\"\nfrom = \"heights\"\nover = [\"density\"]\n";
    let path = bench.write(&format!("{}\n{aggregate}", *LARGE));
    let arguments = ["run", path.to_str().unwrap(), "--memory", "250MB"];
    let output = bench.output(&arguments);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert!(printed.contains("stage `mean`"), "{printed}");
    assert!(printed.contains("for the tables that it reads, more than the"), "{printed}");
}
