//! `asperity run`: compute what is missing and write the tables.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use bytesize::ByteSize;
use serde_json::json;

use super::progress::Console;
use super::signals::{Patience, StopSignal};
use super::terminal::stdout;
use super::{Failure, chain, counted, json, summary};
use crate::session::status::StageCount;
use crate::session::{RunOptions, RunReport, Selection, Session, Shard};
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::runner::{RunOutcome, TaskError};

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// Cores to work on: a surface and a few maps of memory each, or several to a large surface where
    /// fewer are left. As many as there are when left out.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    /// Memory to keep to, as in `16GB` or `512MiB`, by working on fewer surfaces at once; seven
    /// eighths of what the machine has, or of what this process may use of it, when left out. A
    /// task that takes more is refused before anything starts.
    #[arg(long, value_name = "SIZE")]
    memory: Option<ByteSize>,

    /// Compute one task alone, with what it lacks, even if its table is there: its key or the
    /// first digits of it, as in the table of failures.
    #[arg(long, value_name = "KEY")]
    only: Option<String>,

    /// Compute one part of the surfaces alone: the I-th of N, as in `3/16`, with everything that hangs
    /// on each of them by itself. Which part a surface is in follows from its key and N. No table of
    /// a stage is written, but a receipt in `cluster/STUDY/receipts`; a last run without `--shard`
    /// computes the rest and writes the tables.
    #[arg(long, value_name = "I/N", conflicts_with = "only")]
    shard: Option<Shard>,

    /// The job of a scheduler that a shard belongs to, as its receipt names it.
    #[arg(long, value_name = "NAME", requires = "shard")]
    job: Option<String>,

    /// Seconds after which a block of loads keeps how far it has come, again and again, to go on from
    /// there when the process has ended; 600 when left out. The tables' bytes do not depend on it.
    #[arg(long, value_name = "SECONDS")]
    checkpoint_every: Option<u32>,

    /// Take the place of another manifest whose study has the same name, even if tables of it are
    /// lost.
    #[arg(long)]
    replace: bool,

    /// Print JSON, as `plan --json` does, with `computed` and `failed` for each stage,
    /// `"damaged": [{"task", "cause", "aside"}, …]`, `growing` as `plan` has it, and the path of the table of `failures`, if
    /// there is one.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let console = Console::default();
    let session = Session::new(&arguments.manifest, data.path()).observed_by(&console);
    let run = session.prepare(&arguments.options())?;
    let patience = match arguments.shard {
        Some(_) => Patience::OfANode,
        None => Patience::OfAPerson,
    };
    let stop = StopSignal::on_signal(patience)?;
    let report = run.execute(stop.asked())?;
    let mut out = stdout();
    if arguments.json {
        let mut json = as_json(&report);
        json["failures"] = json!(report.failures);
        if let Some(receipt) = &report.receipt {
            json["receipt"] = json!(receipt);
        }
        writeln!(out, "{json:#}")?;
    } else {
        write!(out, "{}", told(&report, arguments.only.as_deref())?)?;
    }
    Ok(exit_code(&report.outcome, &stop))
}

/// What came of a run, in a few lines; of one task if `only` one was asked for.
pub fn told(report: &RunReport, only: Option<&str>) -> Result<String, Failure> {
    let mut text = String::new();
    if let Some(tables) = &report.tables {
        let only = only.map(|_| report.wanted.as_slice());
        text += &summary::text(&report.sampled.plan, tables, only)?;
    }
    for stage in &report.sampled.stages {
        text += &format!("{stage}\n");
    }
    if let Some(path) = &report.failures {
        text += &format!("failures: {}\n", path.display());
    }
    if let Some(path) = &report.receipt {
        text += &format!("receipt: {}\n", path.display());
    }
    Ok(text + &closing(&report.wanted, &report.outcome) + "\n")
}

impl Arguments {
    fn options(&self) -> RunOptions {
        let only = self.only.clone().map(Selection::Task);
        let selection = only.or(self.shard.map(Selection::Shard));
        RunOptions {
            jobs: self.jobs.map(usize::from).and_then(NonZeroUsize::new),
            memory: self.memory,
            selection: selection.unwrap_or_default(),
            replace: self.replace,
            job: self.job.clone(),
            checkpoint_every: self.checkpoint_every.map(u64::from).map(Duration::from_secs),
        }
    }
}

fn as_json(report: &RunReport) -> serde_json::Value {
    let RunReport { sampled, outcome, .. } = report;
    let plan = &sampled.plan;
    let failed: Vec<usize> = outcome.failed.iter().map(|(task, _)| *task).collect();
    let counts = StageCount::all(plan, &report.missing);
    let stages = counts.iter().map(|count| {
        let among = |tasks: &[usize]| {
            let own = |task: &&usize| tasks.binary_search(task).is_ok();
            count.stage.tasks.iter().filter(own).count()
        };
        let mut json = json::count(count);
        json["computed"] = json!(among(&outcome.computed));
        json["failed"] = json!(among(&failed));
        json
    });
    let damaged = outcome.damaged.iter().map(|damage| {
        let cause = chain(&damage.cause);
        json!({ "task": plan.tasks[damage.task].key, "cause": cause, "aside": damage.quarantined })
    });
    json!({
        "stages": stages.collect::<Vec<_>>(),
        "damaged": damaged.collect::<Vec<_>>(),
        "growing": json::adaptive(&sampled.stages),
        "warnings": report.warnings,
    })
}

fn closing(missing: &[usize], outcome: &RunOutcome) -> String {
    let computed = outcome.computed.len();
    if outcome.interrupted || outcome.halted {
        let all = counted(missing.len(), "task");
        let is_denied = |(_, error): &(usize, TaskError)| match error {
            TaskError::Store(error) => error.is_denied(),
            _ => false,
        };
        let cure = match outcome.halted {
            true if outcome.failed.iter().any(is_denied) => {
                "nothing more can be stored: the folder of data cannot be written; change its \
                 permissions, or name another one by `--data FOLDER`, and "
            }
            true => {
                "nothing more can be stored: make room or ask for a larger quota, `asperity prune` \
                 shows what nobody needs, and "
            }
            false => "",
        };
        return format!("stopped after {computed} of {all}; {cure}run again to go on");
    }
    match computed {
        0 if outcome.failed.is_empty() => "nothing to do: every table was there".to_owned(),
        _ => format!("{} computed", counted(computed, "task")),
    }
}

pub fn exit_code(outcome: &RunOutcome, stop: &StopSignal) -> ExitCode {
    if outcome.interrupted {
        ExitCode::from(stop.exit_code())
    } else if outcome.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;
    use asperity_tables::store::StoreError;

    #[test]
    fn what_to_do_depends_on_why_nothing_can_be_stored() {
        let advice = |kind: io::ErrorKind| {
            let error =
                StoreError::Write { path: PathBuf::from("data/store"), source: kind.into() };
            let outcome = RunOutcome {
                failed: vec![(0, error.into())],
                halted: true,
                ..RunOutcome::default()
            };
            closing(&[0], &outcome)
        };
        use io::ErrorKind::{PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
        for kind in [PermissionDenied, ReadOnlyFilesystem] {
            let told = advice(kind);
            assert!(told.contains("permissions"), "{told}");
            assert!(!told.contains("quota"), "{told}");
        }
        for kind in [QuotaExceeded, StorageFull] {
            assert!(advice(kind).contains("larger quota"));
        }
    }
}
