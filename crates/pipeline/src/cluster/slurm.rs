//! Wrappers of the Slurm commands `sbatch`, `squeue`, `scancel` and `scontrol`.

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;
use std::{env, fmt, fs, io};

use serde::{Deserialize, Serialize};

/// Maximum number of array elements if `MaxArraySize` is unknown: its default value minus one.
const DEFAULT_MAX_ARRAY: u32 = 1000;

/// Number that Slurm has assigned to a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Job(pub u64);

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// A job or an array element in the queue of Slurm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Queued {
    pub job: Job,
    /// Job number of the array; equals `job` for a single job.
    pub array: Job,
    /// Index of the array element; `None` for a single job.
    pub element: Option<u32>,
    /// State as Slurm names it: `PENDING`, `RUNNING` …
    pub state: String,
    /// Reason why the job waits, as Slurm names it.
    pub reason: String,
}

impl Queued {
    /// Returns whether the job has started and has not ended.
    pub fn is_running(&self) -> bool {
        matches!(self.state.as_str(), "RUNNING" | "COMPLETING" | "CONFIGURING" | "SUSPENDED")
    }
}

#[derive(Debug, thiserror::Error)]
pub enum SlurmError {
    #[error(
        "cannot find `{command}` on this machine: submit from a node of a Slurm cluster, such as \
         its login node; with another scheduler, or without one, compute a part of the surfaces \
         with `asperity run MANIFEST --shard I/N` (docs/cluster.md)"
    )]
    NotInstalled { command: &'static str },
    #[error("cannot run `{command}`")]
    CannotRun { command: &'static str, source: io::Error },
    #[error("`{command}` failed: {output}{suggestion}")]
    Failed {
        command: &'static str,
        output: String,
        /// Suggestion to the user, on a line after the message.
        suggestion: String,
    },
    #[error("cannot read the batch script")]
    Script { source: io::Error },
    #[error("`{command}` printed `{output}` instead of a job number")]
    UnexpectedOutput { command: &'static str, output: String },
}

/// Submits a script, as a job array if `array` lists array elements. The job starts after the job
/// `after` has ended with all its array elements, successfully or not.
///
/// The options in the script are also given on the command line, where variables of the user's
/// environment such as `SBATCH_TIMELIMIT` do not override them.
pub fn submit(
    script: &Path,
    array: Option<&str>,
    after: Option<Job>,
    arguments: &[String],
) -> Result<Job, SlurmError> {
    let mut words = vec!["--parsable".to_owned()];
    let text = fs::read_to_string(script);
    words.extend(options(&text.map_err(|source| SlurmError::Script { source })?));
    words.extend(array.map(|array| format!("--array={array}")));
    words.extend(after.map(|job| format!("--dependency=afterany:{job}")));
    words.push(script.to_string_lossy().into_owned());
    words.extend(arguments.iter().cloned());
    let output = run("sbatch", &words)?;
    // `sbatch` prints `12`, or `12;cluster` if there are several clusters.
    let number = output.trim().split(';').next().and_then(|word| word.parse().ok());
    number.map(Job).ok_or(SlurmError::UnexpectedOutput { command: "sbatch", output })
}

/// Returns the options of `sbatch` in a script.
fn options(script: &str) -> Vec<String> {
    let lines = script.lines().filter_map(|line| line.strip_prefix("#SBATCH "));
    lines.flat_map(|line| shlex::split(line).unwrap_or_default()).collect()
}

/// Returns the user's jobs in the queue whose name is in `names`.
pub fn queue(names: &[&str]) -> Result<Vec<Queued>, SlurmError> {
    let names = format!("--name={}", names.join(","));
    let output =
        run("squeue", &["--noheader", "--me", "--array", &names, "--format=%A|%F|%K|%T|%r"])?;
    Ok(output.lines().filter_map(queued).collect())
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

/// Cancels waiting and running jobs.
pub fn cancel(jobs: &[Job]) -> Result<(), SlurmError> {
    let words: Vec<String> = jobs.iter().map(Job::to_string).collect();
    run("scancel", &words).map(drop)
}

/// Returns the maximum number of array elements on this cluster. `MaxArraySize` is one more than
/// the largest index, and our indices start at 1.
pub fn largest_array() -> u32 {
    let output = run("scontrol", &["show", "config"]).unwrap_or_default();
    let mut sizes = output.lines().filter_map(|line| {
        let (name, size) = line.split_once('=')?;
        (name.trim() == "MaxArraySize").then(|| size.trim().parse::<u32>().ok())?
    });
    sizes.next_back().map_or(DEFAULT_MAX_ARRAY, |size| size.saturating_sub(1).max(1))
}

/// Variables of the environment that `sbatch` may read: they say where jobs run and who is charged.
/// Settings of asperity override them.
const OF_SBATCH: [&str; 8] = [
    "SBATCH_ACCOUNT",
    "SBATCH_CONSTRAINT",
    "SBATCH_EXPORT",
    "SBATCH_GET_USER_ENV",
    "SBATCH_PARTITION",
    "SBATCH_QOS",
    "SBATCH_RESERVATION",
    "SBATCH_WCKEY",
];

/// Returns a command of Slurm without the variables of the user's environment that would change its
/// options, such as `SQUEUE_STATES`, which hides jobs.
fn command(name: &str) -> Command {
    let is_option = |variable: &str| {
        let prefixes = ["SBATCH_", "SCANCEL_", "SCONTROL_", "SINFO_", "SQUEUE_"];
        prefixes.iter().any(|prefix| variable.starts_with(prefix)) && !OF_SBATCH.contains(&variable)
    };
    let variables = env::vars_os().filter_map(|(variable, _)| variable.into_string().ok());
    let mut command = Command::new(name);
    variables.filter(|variable| is_option(variable)).for_each(|variable| {
        command.env_remove(variable);
    });
    command
}

fn run(name: &'static str, words: &[impl AsRef<OsStr>]) -> Result<String, SlurmError> {
    let output = match command(name).args(words).output() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(SlurmError::NotInstalled { command: name });
        }
        output => output.map_err(|source| SlurmError::CannotRun { command: name, source })?,
    };
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let output = String::from_utf8_lossy(&output.stderr);
    let lines = output.lines().map(|line| {
        let message = line.strip_prefix(&format!("{name}: ")).unwrap_or(line);
        message.strip_prefix("error: ").unwrap_or(message).trim()
    });
    let output = lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ");
    let suggestion = suggestion(&output);
    Err(SlurmError::Failed { command: name, output, suggestion })
}

/// What to do about error messages of Slurm that contain one of the words.
const ADVICE: [(&[&str], &str); 8] = [
    (&["invalid partition"], "set another `partition` in `asperity.toml` or with `--partition`"),
    (
        &["invalid account", "account/partition"],
        "set your `account` in `asperity.toml` or with `--account`",
    ),
    (&["invalid qos"], "set another `qos` in `asperity.toml` or with `--qos`"),
    (&["job submit limit", "policy", "array size"], "submit fewer array elements with `--at-most`"),
    (
        &["memory specification"],
        "no node has so much memory: request less with `--memory`, or fewer `--cores`",
    ),
    (
        &["time limit"],
        "request less with `--time-limit`, and shorten the array elements with `--per-element`",
    ),
    (
        &["node configuration", "cpu count", "more processors"],
        "no node has so many cores: request fewer with `--cores`",
    ),
    (
        &["unable to contact", "connection refused"],
        "the controller of the cluster does not answer; try again later",
    ),
];

/// Returns what to do about an error message of Slurm, or an empty text if it is unknown.
fn suggestion(output: &str) -> String {
    let lowercase = output.to_lowercase();
    let mut advice = ADVICE.iter();
    let known = advice.find(|(words, _)| words.iter().any(|words| lowercase.contains(words)));
    known.map_or_else(String::new, |(_, advice)| format!("\n{advice}"))
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
    fn options_of_a_script_are_words_of_the_command_line() {
        let script = "#!/bin/bash\n# Notes\n#SBATCH --time=0:10:00\n#SBATCH -C avx2\n\
                      #SBATCH --output='/a b/logs'/%A.txt\n#SBATCH --comment \"two words\"\necho\n";
        let expected =
            ["--time=0:10:00", "-C", "avx2", "--output=/a b/logs/%A.txt", "--comment", "two words"];
        assert_eq!(options(script), expected);
    }

    #[test]
    fn what_slurm_refuses_has_a_cure() {
        assert!(suggestion("Batch job submission failed: Invalid account").contains("`--account`"));
        assert!(suggestion("Requested node configuration is not available").contains("`--cores`"));
        assert_eq!(suggestion("something else"), "");
    }
}
