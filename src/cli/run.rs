//! `asperity run`: compute what is missing and write the tables.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use bytesize::ByteSize;

use super::console::{Console, Patience, StopSignal};
use super::terminal::stdout;
use super::{Failure, print_json};
use crate::session::results::{PublishedTable, TableSource};
use crate::session::run::{RunOutcome, TaskError};
use crate::session::words::counted;
use crate::session::{
    DataFolder, Plan, PlannedStage, RunOptions, RunReport, Selection, Session, Shard,
};

#[derive(clap::Args)]
pub struct RunArguments {
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

pub fn run(arguments: &RunArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
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
        print_json(&mut out, &report.summary())?;
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
        text += &stage_lines(&report.sampled.plan, tables, only)?;
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

impl RunArguments {
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

/// One line per stage, and where the tables are; stages with one of the tasks `only`, if some are
/// named: all others have tasks that nobody asked for.
fn stage_lines(
    plan: &Plan,
    tables: &[PublishedTable],
    only: Option<&[usize]>,
) -> Result<String, Failure> {
    let width = plan.stages.iter().map(|stage| stage.name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let left = match only {
        Some(_) => "left for later",
        None => "missing",
    };
    let is_asked_for = |stage: &PlannedStage| {
        let is_wanted =
            |only: &[usize]| stage.tasks.iter().any(|task| only.binary_search(task).is_ok());
        only.is_none_or(is_wanted)
    };
    let stages = plan.stages.iter().zip(tables);
    for (stage, table) in stages.filter(|(stage, _)| is_asked_for(stage)) {
        let line = match table.finished {
            0 => "nothing finished".to_owned(),
            _ => line(stage, &table.open()?)?,
        };
        let missing = stage.tasks.len() - table.finished;
        let missing = match missing {
            0 => String::new(),
            _ => format!(" · {} {left}", counted(missing, "task")),
        };
        text += &format!("{:width$}  {line}{missing}\n", stage.name);
    }
    if let Some(folder) = tables.first().and_then(|table| table.path.parent()) {
        text += &format!("tables: {}\n", folder.join("*.parquet").display());
    }
    Ok(text)
}

fn line(stage: &PlannedStage, table: &TableSource) -> Result<String, Failure> {
    Ok((stage.kind.definition().summary)(table)?.join(" · "))
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;
    use crate::tables::store::StoreError;

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
