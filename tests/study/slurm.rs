//! Submission to Slurm with fake Slurm commands; `tests/cluster.py` uses real ones.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::bench::{Bench, STUDY, assert_same_files, text, with_claims};

/// Folder with fake Slurm commands.
struct Slurm {
    bench: Bench,
    manifest: PathBuf,
}

impl Slurm {
    /// Creates the folder with these commands, each a shell script.
    fn with(commands: &[(&str, &str)]) -> Slurm {
        let bench = Bench::new();
        let manifest = bench.write(&STUDY);
        fs::create_dir(bench.path("bin")).unwrap();
        for (name, script) in commands {
            let path = bench.path("bin").join(name);
            fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        }
        Slurm { bench, manifest }
    }

    /// Creates a fake Slurm that accepts every script, numbers jobs from 11 and logs its calls.
    fn willing() -> Slurm {
        Slurm::with(&[
            ("sbatch", "echo \"$@\" >> \"$LOG\"; echo $((10 + $(/usr/bin/wc -l < \"$LOG\")))"),
            ("squeue", "exit 0"),
            ("scancel", "echo cancel \"$@\" >> \"$LOG\""),
            ("scontrol", "echo 'MaxArraySize            = 4'"),
        ])
    }

    fn output(&self, command: &str, options: &[&str]) -> Output {
        self.command(command, options).output().unwrap()
    }

    fn command(&self, command: &str, options: &[&str]) -> Command {
        let manifest = self.manifest.to_str().unwrap();
        let mut asperity = self.bench.asperity(&[&[command, manifest], options].concat());
        asperity
            // `PATH` contains only the fakes and basic commands, because this machine may have
            // Slurm.
            .env("PATH", self.bench.path("bin"))
            .env("XDG_CONFIG_HOME", self.bench.path("config"))
            .env("LOG", self.bench.path("log"));
        asperity
    }

    /// Returns the error message of a failing command, without the names of temporary folders.
    fn refused(&self, command: &str, options: &[&str]) -> String {
        let output = self.output(command, options);
        assert!(!output.status.success(), "{}", text(&output.stdout));
        self.plain(&output.stderr)
    }

    fn plain(&self, bytes: &[u8]) -> String {
        let folder = self.bench.path("");
        let folder = folder.to_str().unwrap().trim_end_matches('/');
        text(bytes)
            .replace(folder, "FOLDER")
            .replace(env!("CARGO_BIN_EXE_asperity"), "ASPERITY")
            .replace(
                &text(&Command::new("hostname").output().unwrap().stdout).trim().to_owned(),
                "HOST",
            )
    }

    fn log(&self) -> String {
        self.plain(&fs::read(self.bench.path("log")).unwrap_or_default())
    }
}

const SHORT: [&str; 2] = ["--per-element", "0.0000001"];

#[test]
fn an_array_is_submitted_and_a_job_after_it_however_it_ends() {
    let slurm = Slurm::willing();
    let output = slurm.output("submit", &SHORT);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let log = slurm.log();
    let lines: Vec<&str> = log.lines().collect();
    assert_eq!(lines.len(), 2, "{log}");
    let options = " --signal=B:TERM@60 --open-mode=append ";
    assert!(lines[0].starts_with("--parsable --job-name=small --array="), "{log}");
    assert!(lines[0].contains(options), "{log}");
    assert!(lines[0].ends_with("FOLDER/data/cluster/small/element.sh"), "{log}");
    assert!(lines[1].starts_with("--parsable --job-name=small-finish --output="), "{log}");
    assert!(lines[1].contains(options) && !lines[1].contains("--array"), "{log}");
    let last = " --dependency=afterany:11 FOLDER/data/cluster/small/finish.sh 0";
    assert!(lines[1].ends_with(last), "{log}");
    let printed = slurm.plain(&output.stdout);
    assert!(printed.contains("job 11 computes the tasks, job 12 completes the study"), "{printed}");
    let element = fs::read_to_string(slurm.bench.data().join("cluster/small/element.sh")).unwrap();
    // `MaxArraySize` is the largest index plus one.
    assert!(element.contains("$SLURM_ARRAY_TASK_ID/3\""), "{element}");
}

#[test]
fn variables_of_the_user_change_no_command_of_slurm() {
    let slurm = Slurm::with(&[
        ("sbatch", "/usr/bin/env >> \"$LOG\"; echo 11"),
        ("squeue", "/usr/bin/env >> \"$LOG\"; echo '12|11|1|PENDING|BeginTime'"),
        ("scancel", "/usr/bin/env >> \"$LOG\""),
    ]);
    let variables = [
        ("SQUEUE_STATES", "COMPLETED"),
        ("SCANCEL_STATE", "SUSPENDED"),
        ("SBATCH_TIMELIMIT", "3"),
        ("SBATCH_ARRAY_INX", "1-3"),
        ("SBATCH_PARTITION", "short"),
        ("SLURM_CONF", "/etc/slurm.conf"),
    ];
    let output = |command: &str| {
        let output = slurm.command(command, &[]).envs(variables).output().unwrap();
        (output.status.success(), text(&output.stdout) + &text(&output.stderr))
    };
    assert!(!output("submit").0, "a job is in the queue");
    assert!(slurm.output("finish", &[]).status.code() == Some(2), "nothing was submitted");
    let folder = slurm.bench.data().join("cluster/small");
    fs::create_dir_all(&folder).unwrap();
    let submission = r#"{ "elements": 1, "cores": 1, "rounds": 1, "per_element": 1.0,
        "core_hours": 1.0, "submitted": [{ "array": 11, "elements": [1], "finish": 13 }] }"#;
    fs::write(folder.join("submission.json"), submission).unwrap();
    let (_, status) = output("status");
    assert!(status.contains("1 waiting (BeginTime: Slurm restarts a job"), "{status}");
    let (is_cancelled, cancelled) = output("cancel");
    assert!(is_cancelled && cancelled.contains("cancelled: `11`"), "{cancelled}");
    let log = slurm.log();
    assert!(log.contains("SBATCH_PARTITION=short") && log.contains("SLURM_CONF="), "{log}");
    for (variable, _) in &variables[..4] {
        assert!(!log.contains(variable), "{variable}");
    }
}

#[test]
fn what_a_settings_file_adds_to_the_scripts_is_said() {
    let slurm = Slurm::willing();
    let settings = "[cluster]\nbefore = [\"module load gcc\", \"ulimit -c 0\"]";
    fs::write(slurm.bench.path("asperity.toml"), settings).unwrap();
    for options in [&["--dry-run"][..], &SHORT] {
        let output = slurm.output("submit", options);
        let printed = slurm.plain(&output.stdout);
        let told = "settings from `FOLDER/asperity.toml`\neach job first runs: module load gcc\n\
                    each job first runs: ulimit -c 0\n";
        assert!(printed.contains(told), "{printed}");
    }
}

#[test]
fn a_dry_run_prints_the_scripts_and_writes_nothing() {
    let slurm = Slurm::with(&[]);
    let output = slurm.output("submit", &["--dry-run", "--partition", "short", "--report"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    assert!(
        printed.contains("#SBATCH --partition=short") && printed.contains(" --report"),
        "{printed}"
    );
    assert!(printed.contains("core-hours expected"), "{printed}");
    assert!(slurm.bench.files().is_empty());
}

#[test]
fn a_folder_whose_name_has_two_lines_reaches_no_script() {
    let slurm = Slurm::willing();
    let data = slurm.bench.path("data\n#SBATCH --comment=injected\ntouch injected");
    for options in [&SHORT[..], &["--dry-run"]] {
        let options = [options, &["--data", data.to_str().unwrap()]].concat();
        let output = slurm.output("submit", &options);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output.stdout));
        let printed = text(&output.stderr);
        assert!(printed.contains("the path of the data folder is"), "{printed}");
        assert!(printed.contains("a control character"), "{printed}");
    }
    assert_eq!(slurm.log(), "");
    assert!(!data.exists());
}

#[test]
fn what_is_said_on_the_command_line_counts_before_the_manifests_folder_and_that_before_the_users() {
    let slurm = Slurm::with(&[]);
    fs::create_dir_all(slurm.bench.path("config/asperity")).unwrap();
    let user = "[cluster]\npartition = \"far\"\naccount = \"far\"\nqos = \"far\"";
    fs::write(slurm.bench.path("config/asperity/asperity.toml"), user).unwrap();
    let near = "[cluster]\npartition = \"near\"\naccount = \"near\"";
    fs::write(slurm.bench.path("asperity.toml"), near).unwrap();
    let output = slurm.output("submit", &["--dry-run", "--partition", "nearest"]);
    let printed = text(&output.stdout);
    for line in ["--partition=nearest", "--account=near", "--qos=far"] {
        assert!(printed.contains(&format!("#SBATCH {line}\n")), "{printed}");
    }
    fs::write(slurm.bench.path("asperity.toml"), "[cluster]\ncores = 0").unwrap();
    insta::assert_snapshot!("configuration", slurm.refused("submit", &["--dry-run"]));
}

#[test]
fn the_last_job_computes_what_is_little_and_submits_again_what_is_much() {
    let slurm = Slurm::willing();
    assert!(slurm.output("submit", &[&SHORT[..], &["--rounds", "1"]].concat()).status.success());
    let output = slurm.output("finish", &["--jobs", "1"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("left no receipt"), "{}", text(&output.stderr));
    assert!(
        slurm.log().ends_with(" --dependency=afterany:13 FOLDER/data/cluster/small/finish.sh 1\n")
    );
    assert!(!slurm.bench.data().join("results").exists());
    // No round remains: the last job computes missing tasks, and the tables equal those of a plain
    // run.
    let output = slurm.output("finish", &["--jobs", "1", "--round", "1"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(slurm.log().lines().count(), 4);
    slurm.compare(&STUDY);
}

#[test]
fn status_counts_what_is_there_without_slurm_too() {
    let slurm = Slurm::with(&[]);
    let status = || -> Value {
        let output = slurm.output("status", &["--json"]);
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let counts = |status: &Value| {
        let stage = &status["stages"][1];
        ["done", "running", "waiting", "failed"].map(|name| stage[name].as_u64().unwrap())
    };
    assert_eq!(counts(&status()), [0, 0, 4, 0]);
    slurm.output("run", &["--shard", "1/1"]);
    let after = status();
    assert_eq!(counts(&after), [4, 0, 0, 0]);
    assert_eq!(after["queue"], Value::Null);
    assert!(after["core_hours_spent"].as_f64() > Some(0.0));
    let printed = slurm.plain(&slurm.output("status", &[]).stdout);
    assert!(printed.contains("light") && printed.contains("core-hours spent"), "{printed}");
}

#[test]
fn errors_that_users_meet_first_name_the_cure() {
    let nowhere = Slurm::with(&[]);
    insta::assert_snapshot!("no-slurm", nowhere.refused("submit", &[]));
    insta::assert_snapshot!("not-submitted", nowhere.refused("finish", &[]));

    let refusing = |words: &str| {
        Slurm::with(&[
            ("sbatch", &format!("echo 'sbatch: error: {words}' >&2; exit 1")),
            ("squeue", "exit 0"),
            ("sinfo", "printf 'short\\nlong\\n'"),
        ])
    };
    let partition = refusing("Batch job submission failed: Invalid partition name specified");
    insta::assert_snapshot!("partition", partition.refused("submit", &["--partition", "shrot"]));
    let account =
        "Batch job submission failed: Invalid account or account/partition combination specified";
    insta::assert_snapshot!("account", refusing(account).refused("submit", &[]));
    let quota = "Batch job submission failed: Job violates accounting/QOS policy (job submit limit, user's size and/or time limits)".replace('\'', "");
    insta::assert_snapshot!("limit", refusing(&quota).refused("submit", &[]));

    let queued = Slurm::with(&[("squeue", "echo '15|12|3|RUNNING|None'")]);
    insta::assert_snapshot!("in-queue", queued.refused("submit", &[]));
}

#[test]
fn a_node_without_the_program_or_the_data_says_so() {
    let slurm = Slurm::willing();
    let options = [&SHORT[..], &["--program", "/opt/asperity/bin/asperity"]].concat();
    assert!(slurm.output("submit", &options).status.success());
    let script = slurm.bench.data().join("cluster/small/element.sh");
    insta::assert_snapshot!("no-program", slurm.printed_by(&script));

    let slurm = Slurm::willing();
    assert!(slurm.output("submit", &SHORT).status.success());
    let script = slurm.bench.path("element.sh");
    fs::copy(slurm.bench.data().join("cluster/small/element.sh"), &script).unwrap();
    fs::rename(slurm.bench.data(), slurm.bench.path("elsewhere")).unwrap();
    insta::assert_snapshot!("no-data", slurm.printed_by(&script));
}

impl Slurm {
    /// Returns the output of a failing script that runs as an array element.
    fn printed_by(&self, script: &Path) -> String {
        let mut bash = Command::new("bash");
        bash.arg(script).env("SLURM_ARRAY_TASK_ID", "1").env("SLURM_ARRAY_JOB_ID", "11");
        let output = bash.output().unwrap();
        assert!(!output.status.success());
        self.plain(&output.stderr)
    }
}

impl Slurm {
    /// Runs the script of each array element, like a scheduler.
    fn compute_elements(&self) {
        let script = self.bench.data().join("cluster/small/element.sh");
        for element in ["1", "2", "3"] {
            let mut bash = Command::new("bash");
            bash.arg(&script).env("SLURM_ARRAY_TASK_ID", element).env("SLURM_ARRAY_JOB_ID", "11");
            assert!(bash.output().unwrap().status.success());
        }
    }

    /// Asserts that the tables equal those of a plain run of the manifest.
    #[track_caller]
    fn compare(&self, manifest: &str) {
        let alone = Bench::new();
        alone.run(manifest);
        let results = |bench: &Bench| {
            let mut files = bench.files();
            files.retain(|path, _| path.starts_with("results"));
            files
        };
        assert_same_files(&results(&self.bench), &results(&alone));
    }
}

#[test]
fn scripts_compute_the_study_under_any_scheduler_that_counts() {
    let slurm = Slurm::willing();
    assert!(slurm.output("submit", &SHORT).status.success());
    slurm.compute_elements();
    let output = slurm.output("finish", &[]);
    assert!(output.status.success() && !text(&output.stderr).contains("no receipt"));
    slurm.compare(&STUDY);
}

/// Submits a small adaptive study and completes it in rounds.
fn in_rounds(until: &str) {
    let realizations = format!("realizations = {until}");
    let growing = with_claims(&STUDY.replace("realizations = 2", &realizations));
    let slurm = Slurm::willing();
    slurm.bench.write(&growing);
    assert!(slurm.output("submit", &SHORT).status.success());
    let mut rounds = 0;
    while !slurm.bench.data().join("results/small/area.parquet").exists() {
        slurm.compute_elements();
        let output = slurm.output("finish", &["--jobs", "1", "--round", &rounds.to_string()]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        rounds += 1;
    }
    assert!(rounds > 1, "at least one more array");
    slurm.compare(&growing);
}

#[test]
fn surfaces_are_drawn_until_a_mean_is_known_in_rounds_of_the_last_job() {
    in_rounds("{ at_least = 3, at_most = 200, until = \"sem(area.area_fraction) < 4 %\" }");
}

#[test]
fn surfaces_are_drawn_until_claims_are_decided_in_rounds_of_the_last_job() {
    in_rounds("{ at_least = 5, at_most = 40, until = \"decided(full-contact-at-1.7)\" }");
}
