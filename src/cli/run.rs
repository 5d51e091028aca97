//! `asperity run`: compute what is missing and write the tables.

use std::io::{Write, stdout};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

use bytesize::ByteSize;
use serde_json::json;

use super::progress::Console;
use super::signals::StopSignal;
use super::{Failure, chain, counted, json, summary};
use crate::data_folder::DataFolder;
use crate::runner::RunOutcome;
use crate::session::status::StageCount;
use crate::session::{RunOptions, RunReport, Selection, Session};

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// Surfaces to work on at once; one core and a few maps of memory each.
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
    let stop = StopSignal::on_signal()?;
    let report = run.execute(stop.asked())?;
    let mut out = stdout().lock();
    if arguments.json {
        let mut json = as_json(&report);
        json["failures"] = json!(report.failures);
        writeln!(out, "{json:#}")?;
    } else {
        if let Some(tables) = &report.tables {
            let only = arguments.only.as_ref().map(|_| report.wanted.as_slice());
            write!(
                out,
                "{}",
                summary::text(&report.sampled.plan, tables, only)?
            )?;
        }
        for stage in &report.sampled.stages {
            writeln!(out, "{stage}")?;
        }
        if let Some(path) = &report.failures {
            writeln!(out, "failures: {}", path.display())?;
        }
        writeln!(out, "{}", closing(&report.wanted, &report.outcome))?;
    }
    Ok(exit_code(&report.outcome, &stop))
}

impl Arguments {
    fn options(&self) -> RunOptions {
        let selection = self.only.clone().map(Selection::Task);
        RunOptions {
            jobs: self.jobs.map(usize::from).and_then(NonZeroUsize::new),
            memory: self.memory,
            selection: selection.unwrap_or_default(),
            replace: self.replace,
        }
    }
}

fn as_json(report: &RunReport) -> serde_json::Value {
    let RunReport {
        sampled, outcome, ..
    } = report;
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
        return format!("stopped after {computed} of {all}; run again to go on");
    }
    match computed {
        0 if outcome.failed.is_empty() => "nothing to do: every table was there".to_owned(),
        _ => format!("{} computed", counted(computed, "task")),
    }
}

fn exit_code(outcome: &RunOutcome, stop: &StopSignal) -> ExitCode {
    if outcome.interrupted {
        ExitCode::from(stop.exit_code())
    } else if outcome.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}
