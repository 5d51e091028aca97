//! The commands of Slurm: `sbatch`, `squeue`, `scancel`, `scontrol`.

use std::ffi::OsStr;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use asperity_manifest::diagnostics::listed;

/// Elements of an array, where Slurm does not say how many it allows: one less than its default.
const USUAL_ARRAY: u32 = 1000;

/// A job, by the number that Slurm gave it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Job(pub u64);

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// A job or an element of an array that Slurm has not done with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Queued {
    pub job: Job,
    /// The number of its array; its own of a single job.
    pub array: Job,
    /// Which element of the array it is.
    pub element: Option<u32>,
    /// `PENDING`, `RUNNING` …
    pub state: String,
    /// Why it waits, in a word of Slurm's.
    pub reason: String,
}

impl Queued {
    /// Whether it has begun and not ended.
    pub fn is_running(&self) -> bool {
        matches!(self.state.as_str(), "RUNNING" | "COMPLETING" | "CONFIGURING" | "SUSPENDED")
    }
}

/// Slurm cannot do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum SlurmError {
    /// There is no such command here.
    #[error(
        "there is no `{command}` here: submit on a machine of a Slurm cluster, such as its login \
         node; under another scheduler, or none, `asperity run MANIFEST --shard I/N` computes a \
         part of the surfaces (docs/cluster.md)"
    )]
    NotHere { command: &'static str },
    /// The command cannot be run.
    #[error("cannot run `{command}`")]
    Unusable { command: &'static str, source: io::Error },
    /// The command has failed.
    #[error("`{command}` failed: {told}{cure}")]
    Refused {
        command: &'static str,
        told: String,
        /// What may be done about it.
        cure: String,
    },
    /// The command has printed what nobody expected.
    #[error("`{command}` printed `{told}`, where the number of a job was expected")]
    Unreadable { command: &'static str, told: String },
}

/// Submits a script: an array of these elements if there are any, after all of another job has ended
/// in whatever way.
pub fn submit(
    script: &Path,
    array: Option<&str>,
    after: Option<Job>,
    arguments: &[String],
) -> Result<Job, SlurmError> {
    let mut words = vec!["--parsable".to_owned()];
    words.extend(array.map(|array| format!("--array={array}")));
    words.extend(after.map(|job| format!("--dependency=afterany:{job}")));
    words.push(script.to_string_lossy().into_owned());
    words.extend(arguments.iter().cloned());
    let told = run("sbatch", &words)?;
    // `12`, or `12;cluster` where there are several clusters.
    let number = told.trim().split(';').next().and_then(|word| word.parse().ok());
    number.map(Job).ok_or(SlurmError::Unreadable { command: "sbatch", told })
}

/// What is in the queue under these names.
pub fn queue(names: &[&str]) -> Result<Vec<Queued>, SlurmError> {
    let names = format!("--name={}", names.join(","));
    let told =
        run("squeue", &["--noheader", "--me", "--array", &names, "--format=%A|%F|%K|%T|%r"])?;
    Ok(told.lines().filter_map(queued).collect())
}

fn queued(line: &str) -> Option<Queued> {
    let mut words = line.trim().split('|');
    let mut number = || words.next()?.parse().ok().map(Job);
    let (job, array) = (number()?, number()?);
    let element = words.next()?.parse().ok();
    Some(Queued {
        job,
        array,
        element,
        state: words.next()?.to_owned(),
        reason: words.next().unwrap_or_default().to_owned(),
    })
}

/// Takes jobs out of the queue, and ends those that run.
pub fn cancel(jobs: &[Job]) -> Result<(), SlurmError> {
    let jobs: Vec<String> = jobs.iter().map(Job::to_string).collect();
    run("scancel", &jobs).map(drop)
}

/// The most elements that an array may have here; `MaxArraySize` is one more than the last number
/// of an element, and ours begin with one.
pub fn largest_array() -> u32 {
    let told = run("scontrol", &["show", "config"]).unwrap_or_default();
    let mut sizes = told.lines().filter_map(|line| {
        let (name, size) = line.split_once('=')?;
        (name.trim() == "MaxArraySize").then(|| size.trim().parse::<u32>().ok())?
    });
    sizes.next_back().map_or(USUAL_ARRAY, |size| size.saturating_sub(1).max(1))
}

fn run(command: &'static str, words: &[impl AsRef<OsStr>]) -> Result<String, SlurmError> {
    let output = match Command::new(command).args(words).output() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(SlurmError::NotHere { command });
        }
        output => output.map_err(|source| SlurmError::Unusable { command, source })?,
    };
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let told = String::from_utf8_lossy(&output.stderr);
    let lines = told.lines().map(|line| {
        let line = line.strip_prefix(&format!("{command}: ")).unwrap_or(line);
        line.strip_prefix("error: ").unwrap_or(line).trim()
    });
    let told = lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ");
    let cure = cure(&told);
    Err(SlurmError::Refused { command, told, cure })
}

/// What may be done about what Slurm says.
fn cure(told: &str) -> String {
    let says = |words: &str| told.to_lowercase().contains(words);
    let cure = if says("invalid partition") {
        let there_is = partitions().map_or_else(String::new, |there| format!(", of {there}"));
        format!("name another{there_is} as `partition` in `asperity.toml` or with `--partition`")
    } else if says("invalid account") || says("account/partition") {
        "say who pays as `account` in `asperity.toml` or with `--account`".to_owned()
    } else if says("invalid qos") {
        "name another `qos` in `asperity.toml` or with `--qos`".to_owned()
    } else if says("job submit limit") || says("policy") || says("array size") {
        "submit fewer elements with `--at-most`".to_owned()
    } else if says("memory specification") {
        "no node has so much: ask for less with `--memory`, or for fewer `--cores`".to_owned()
    } else if says("time limit") {
        "ask for less with `--time-limit`, and for shorter elements with `--per-element`".to_owned()
    } else if says("node configuration") || says("cpu count") || says("more processors") {
        "no node has so many cores: ask for fewer with `--cores`".to_owned()
    } else if says("unable to contact") || says("connection refused") {
        "the controller of the cluster does not answer; try later".to_owned()
    } else {
        return String::new();
    };
    format!("\n{cure}")
}

/// The partitions that there are, if Slurm tells.
fn partitions() -> Option<String> {
    let told = run_quietly("sinfo", &["--noheader", "--format=%R"])?;
    let names: Vec<String> = told.lines().map(|name| name.trim().to_owned()).collect();
    (!names.is_empty()).then(|| listed(names.iter().map(String::as_str), "and"))
}

fn run_quietly(command: &str, words: &[&str]) -> Option<String> {
    let output = Command::new(command).args(words).output().ok()?;
    let is_told = output.status.success();
    is_told.then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_queue_are_jobs_and_elements() {
        let element = queued("15|12|3|RUNNING|None").unwrap();
        assert_eq!((element.job, element.array, element.element), (Job(15), Job(12), Some(3)));
        assert!(element.is_running());
        let last = queued(" 16|16|N/A|PENDING|Dependency ").unwrap();
        assert_eq!((last.element, last.reason.as_str()), (None, "Dependency"));
        assert!(!last.is_running());
        assert_eq!(queued("slurm_load_jobs error"), None);
    }

    #[test]
    fn what_slurm_refuses_has_a_cure() {
        assert!(cure("Batch job submission failed: Invalid account").contains("`--account`"));
        assert!(cure("Requested node configuration is not available").contains("`--cores`"));
        assert_eq!(cure("something else"), "");
    }
}
