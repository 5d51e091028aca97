//! The command `asperity run`, which computes the missing tasks and writes the tables.

use std::io::Write;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::time::Duration;

use bytesize::ByteSize;

use super::console::{Console, INTERACTIVE, SCHEDULED, StopSignal};
use super::terminal::stdout;
use super::{Failure, StudyArguments, print_json};
use crate::session::formatting::counted;
use crate::session::results::PublishedTable;
use crate::session::run::RunOutcome;
use crate::session::status::TasksFromStore;
use crate::session::{
    DataFolder, PlannedStage, RunOptions, RunReport, SampledStudy, Selection, Shard,
};

/// Options that `run` and `finish` share.
#[derive(clap::Args)]
pub(crate) struct ResourceArguments {
    /// Number of cores to use (default: all).
    ///
    /// Each core works on its own surface, which needs memory for a few maps. If fewer surfaces
    /// than cores remain, several cores share one large surface.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    /// Memory limit, such as `16GB` or `512MiB` (default: 7/8 of the available memory).
    ///
    /// The run computes fewer surfaces in parallel to stay below the limit. It does not start if a
    /// single task needs more. The available memory is the memory of the machine or, if
    /// smaller, the memory limit of the process.
    #[arg(long, value_name = "SIZE")]
    memory: Option<ByteSize>,

    /// Overwrite the results of another manifest with the same study name.
    #[arg(long)]
    replace: bool,
}

impl ResourceArguments {
    pub(crate) fn options(&self) -> RunOptions {
        RunOptions {
            jobs: self.jobs.map(usize::from).and_then(NonZeroUsize::new),
            memory: self.memory,
            replace: self.replace,
            ..RunOptions::default()
        }
    }
}

#[derive(clap::Args)]
pub(crate) struct RunArguments {
    #[command(flatten)]
    study: StudyArguments,

    #[command(flatten)]
    resources: ResourceArguments,

    /// Recompute one task and its missing inputs.
    ///
    /// KEY is the key of the task, or at least its first 4 digits, as in the table of failures.
    #[arg(long, value_name = "KEY")]
    only: Option<String>,

    /// Compute only the I-th of N parts of the surfaces, such as `3/16`.
    ///
    /// A part includes all tasks that depend on a single one of its surfaces. The key of a surface
    /// and N determine its part. The command writes a receipt into `cluster/STUDY/receipts`, but no
    /// tables of stages; a final run without `--shard` computes the remaining tasks and writes the
    /// tables.
    #[arg(long, value_name = "I/N", conflicts_with = "only")]
    shard: Option<Shard>,

    /// Name of the scheduler job, recorded in the receipt of a shard.
    #[arg(long, value_name = "NAME", requires = "shard")]
    job: Option<String>,

    /// Interval at which finished loads of a surface are stored, in seconds (default: 60).
    ///
    /// If the process ends early, the next run solves only the loads that are not stored. The bytes
    /// of the tables do not depend on this interval.
    #[arg(long, value_name = "SECONDS")]
    checkpoint_every: Option<u32>,

    /// Print the result as JSON.
    ///
    /// Form: as `plan --json`, with `computed` and `failed` for each stage, `"damaged": [{"task",
    /// "cause", "aside"}, …]`, and the path of the table of `failures` or null. If tables were read
    /// from read-only stores, it has `"stores": [{"store", "tasks"}, …]`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &RunArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let console = Console::default();
    let session = arguments.study.session(data).observed_by(&console);
    let run = session.prepare(&arguments.options())?;
    let patience = if arguments.shard.is_some() { SCHEDULED } else { INTERACTIVE };
    let stop = StopSignal::on_signal(patience)?;
    let report = run.execute(stop.requested())?;
    let mut out = stdout();
    if arguments.json {
        print_json(&mut out, &report.summary()?)?;
    } else {
        write!(out, "{}", run_text(&report, arguments.only.as_deref())?)?;
    }
    Ok(exit_code(&report.outcome, &stop))
}

/// Summarizes a run in a few lines; lists only the stages of the requested task if `only` is given.
pub(crate) fn run_text(report: &RunReport, only: Option<&str>) -> Result<String, Failure> {
    let mut text = String::new();
    if let Some(tables) = &report.tables {
        text += &stage_lines(&report.sampled, tables, only.map(|_| report.wanted.as_slice()))?;
    }
    for TasksFromStore { store, tasks } in &report.stores {
        text += &format!("read from `{}`: {}\n", store.display(), counted(*tasks, "task"));
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
    // A process of a shard has a receipt.
    let nothing_to_do = match report.receipt {
        Some(_) => "nothing to do: no missing task belongs to this shard",
        None => "nothing to do: all tables exist",
    };
    Ok(text + &closing(&report.wanted, &report.outcome, nothing_to_do) + "\n")
}

impl RunArguments {
    fn options(&self) -> RunOptions {
        let only = self.only.clone().map(Selection::Task);
        let selection = only.or(self.shard.map(Selection::Shard));
        RunOptions {
            selection: selection.unwrap_or_default(),
            job: self.job.clone(),
            checkpoint_every: self.checkpoint_every.map(u64::from).map(Duration::from_secs),
            ..self.resources.options()
        }
    }
}

fn closing(missing: &[usize], outcome: &RunOutcome, nothing_to_do: &str) -> String {
    let computed = outcome.computed.len();
    if outcome.interrupted || outcome.halted {
        let all = counted(missing.len(), "task");
        let halted = "cannot store more tables; free disk space or allow writing, and ";
        let cause = if outcome.halted { halted } else { "" };
        return format!("stopped after {computed} of {all}; {cause}run again to continue");
    }
    match computed {
        0 if outcome.failed.is_empty() => nothing_to_do.to_owned(),
        _ => format!("{} computed", counted(computed, "task")),
    }
}

pub(crate) fn exit_code(outcome: &RunOutcome, stop: &StopSignal) -> ExitCode {
    if outcome.interrupted {
        ExitCode::from(stop.exit_code())
    } else if outcome.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}

/// Returns one line per stage and the folder of the tables. If `only` lists tasks, stages without
/// any of them are omitted.
fn stage_lines(
    sampled: &SampledStudy,
    tables: &[PublishedTable],
    only: Option<&[usize]>,
) -> Result<String, Failure> {
    let SampledStudy { study, plan, .. } = sampled;
    let width = plan.stages.iter().map(|stage| stage.name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let left = if only.is_some() { "left for later" } else { "missing" };
    let is_requested = |stage: &PlannedStage| {
        only.is_none_or(|only| stage.tasks.iter().any(|task| only.binary_search(task).is_ok()))
    };
    let stages = plan.stages.iter().zip(tables).enumerate();
    for (index, (stage, table)) in stages.filter(|(_, (stage, _))| is_requested(stage)) {
        let line = match table.finished {
            0 => "no finished tasks".to_owned(),
            _ => {
                let summary = stage.kind.definition().summary;
                summary(&table.open()?, &study.contact_loads(index))?.join(" · ")
            }
        };
        let missing = match stage.tasks.len() - table.finished {
            0 => String::new(),
            missing => format!(" · {} {left}", counted(missing, "task")),
        };
        text += &format!("{:width$}  {line}{missing}\n", stage.name);
    }
    if let Some(folder) = tables.first().and_then(|table| table.path.parent()) {
        text += &format!("tables: {}\n", folder.join("*.parquet").display());
    }
    Ok(text)
}
