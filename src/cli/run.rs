//! `asperity run`: compute what is missing and write the tables.

use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bytesize::ByteSize;
use serde_json::json;

use super::counts::Counts;
use super::failure_report::FailureReport;
use super::outlook::growing;
use super::progress::Progress;
use super::signals::Stop;
use super::{Data, Failure, Misused, chain, counted, summary, tasks, warn};
use crate::growth::Grown;
use crate::memory::{self, Allowance};
use crate::pace::Pace;
use crate::plan::Plan;
use crate::reasons::record::Record;
use crate::results::{self, ResultsError, StageTable};
use crate::runner::{self, Damage, Means, Outcome};
use crate::store::Store;

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

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let study = super::study(&arguments.manifest)?;
    super::tell(&study.warnings());
    let store = data.open()?;
    let grown = Grown::of(study, &store)?;
    if !arguments.replace {
        data.check_owner(&arguments.manifest, &grown, &store)?;
    }
    let wanted = arguments.wanted(&grown.plan, &store)?;
    let jobs = arguments.jobs.map_or_else(cores, usize::from);
    let memory = Allowance::of(arguments.memory, jobs);
    memory
        .fits(&grown.plan, &wanted)
        .map_err(|refused| Misused(refused.to_string()))?;
    let mut work = Work {
        manifest: &arguments.manifest,
        grown,
        store: &store,
        jobs,
        memory,
        stop: Stop::on_signal()?,
    };
    remember(data, &work);
    let grown = match arguments.only {
        Some(_) => Outcome::default(),
        None => work.grow()?,
    };
    let plan = work.plan();
    let missing = work.missing();
    let wanted = arguments.wanted(plan, &store)?;
    let mut outcome = work.compute(&wanted)?;
    // What was drawn on the way was missing and wanted, too.
    let [missing, wanted] = [missing, wanted].map(|tasks| joined(tasks, &grown.computed));
    outcome.append(grown);
    // Where no task's table can be stored, no stage's table can.
    let tables = match outcome.halted {
        true => Ok(None),
        false => work.publish(&data.results(), &mut outcome).map(Some),
    };
    let report = FailureReport {
        plan,
        manifest: &arguments.manifest,
        data,
    };
    let failed = report.tell(&outcome)?;
    let tables = tables?;
    tell_set_aside(tables.as_deref().unwrap_or_default());
    let failures = match &tables {
        Some(tables) => report.write(failed, &wanted, tables, &store)?,
        None => None,
    };
    report_orphans(plan, data)?;
    if !outcome.halted {
        remember(data, &work);
    }

    let mut out = stdout().lock();
    if arguments.json {
        let mut json = as_json(&work.grown, &missing, &outcome);
        json["failures"] = json!(failures);
        writeln!(out, "{json:#}")?;
    } else {
        if let Some(tables) = tables {
            let only = arguments.only.as_ref().map(|_| wanted.as_slice());
            write!(out, "{}", summary::text(plan, &tables, only)?)?;
        }
        for stage in &work.grown.stages {
            writeln!(out, "{stage}")?;
        }
        if let Some(path) = failures {
            writeln!(out, "failures: {}", path.display())?;
        }
        writeln!(out, "{}", closing(&wanted, &outcome))?;
    }
    Ok(exit_code(&outcome, &work.stop))
}

impl Arguments {
    /// The tasks to be computed, of those that the plan has by now.
    fn wanted(&self, plan: &Plan, store: &Store) -> Result<Vec<usize>, Failure> {
        Ok(match &self.only {
            Some(key) => runner::alone(plan, tasks::planned(key, plan)?, store),
            None => runner::missing(plan, store),
        })
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Tasks of two lists, in order.
fn joined(mut tasks: Vec<usize>, others: &[usize]) -> Vec<usize> {
    tasks.extend(others);
    tasks.sort_unstable();
    tasks.dedup();
    tasks
}

/// What is to be done, and with what.
struct Work<'a> {
    manifest: &'a Path,
    grown: Grown,
    store: &'a Store,
    jobs: usize,
    memory: Allowance,
    stop: Stop,
}

impl Work<'_> {
    fn plan(&self) -> &Plan {
        &self.grown.plan
    }

    fn missing(&self) -> Vec<usize> {
        runner::missing(self.plan(), self.store)
    }

    /// Draws surfaces until their number is settled, and computes what settles it.
    fn grow(&mut self) -> Result<Outcome, Failure> {
        let mut outcome = Outcome::default();
        loop {
            for (task, cause) in self.grown.take_damaged() {
                let damage = Damage::set_aside(self.plan(), task, self.store, cause)?;
                outcome.damaged.extend(damage);
            }
            let mut missing = self.grown.deciding();
            missing.retain(|&task| !self.store.has(self.plan().tasks[task].key));
            let round = self.compute(&missing)?;
            if round.computed.is_empty() {
                return Ok(outcome);
            }
            outcome.append(round);
            // What has failed is tried again, and told of, with all the rest.
            outcome.failed.clear();
            let grown = Grown::of(self.grown.study.clone(), self.store)?;
            outcome = outcome.moved(self.plan(), &grown.plan);
            self.grown = grown;
        }
    }

    fn compute(&self, wanted: &[usize]) -> Result<Outcome, Failure> {
        if wanted.is_empty() {
            return Ok(Outcome::default());
        }
        let means = self.means(wanted);
        let without = joined(self.missing(), wanted).len();
        let cached = self.plan().tasks.len() - without;
        let progress = Progress::new(self.plan(), wanted, cached, &Pace::default());
        let outcome = runner::run(
            self.plan(),
            wanted,
            self.store,
            &self.grown.study.sources,
            means,
            &progress,
            self.stop.asked(),
        );
        progress.end();
        Ok(outcome?)
    }

    /// One surface to a core, as far as memory goes.
    fn means(&self, missing: &[usize]) -> Means {
        let (plan, room) = (self.plan(), self.memory.room());
        let jobs = self.jobs.min(missing.len());
        let largest = memory::of_largest(plan, missing);
        let at_once = (room.0 / largest.0.max(1)).max(1);
        if at_once < jobs as u64 {
            let (largest, memory) = (largest.display().si(), self.memory);
            warn(&format!(
                "note: the largest task takes {largest}: {at_once} at once, not {jobs}, in {memory}"
            ));
        }
        Means {
            threads: memory::threads(plan, missing, room, jobs),
            room,
        }
    }

    /// Writes the stages' tables. Tasks' tables that turn out to be damaged only now, because no
    /// other task has read them, are computed again.
    fn publish(&self, results: &Path, outcome: &mut Outcome) -> Result<Vec<StageTable>, Failure> {
        let publish = || results::publish(&self.grown, self.store, self.manifest, results);
        let tables = match publish() {
            Err(ResultsError::Damaged { tables }) => tables,
            published => return Ok(published?),
        };
        let mut tasks = Vec::new();
        for (task, cause) in tables {
            let damage = Damage::set_aside(self.plan(), task, self.store, cause)?;
            outcome.damaged.extend(damage);
            tasks.push(task);
        }
        tasks.sort_unstable();
        tasks.dedup();
        outcome.append(self.compute(&tasks)?);
        Ok(publish()?)
    }
}

/// Writes down what the study is and how far it came, for the next plan to say what has changed.
/// No result depends on it, so that no run fails for it.
fn remember(data: &Data, work: &Work) {
    let study = &work.grown.study;
    let record = Record::of(study, work.plan(), &work.missing());
    if let Err(error) = record.write(&data.records(), &study.name) {
        eprintln!(
            "warning: {}; `explain` will not know this run",
            chain(&error)
        );
    }
}

fn as_json(grown: &Grown, missing: &[usize], outcome: &Outcome) -> serde_json::Value {
    let plan = &grown.plan;
    let failed: Vec<usize> = outcome.failed.iter().map(|(task, _)| *task).collect();
    let counts = Counts::of(plan, missing);
    let stages = counts.0.iter().map(|count| {
        let among = |tasks: &[usize]| {
            let own = |task: &&usize| tasks.binary_search(task).is_ok();
            count.stage.tasks.iter().filter(own).count()
        };
        let mut json = count.json();
        json["computed"] = json!(among(&outcome.computed));
        json["failed"] = json!(among(&failed));
        json
    });
    let damaged = outcome.damaged.iter().map(|damage| {
        let cause = chain(&damage.cause);
        json!({ "task": plan.tasks[damage.task].key, "cause": cause, "aside": damage.aside })
    });
    json!({
        "stages": stages.collect::<Vec<_>>(),
        "damaged": damaged.collect::<Vec<_>>(),
        "growing": growing(&grown.stages),
        "warnings": grown.study.warnings(),
    })
}

fn closing(missing: &[usize], outcome: &Outcome) -> String {
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

/// Names files in the places of tables that were not as a run had written them.
fn tell_set_aside(tables: &[StageTable]) {
    for table in tables {
        if let Some(aside) = &table.aside {
            let (path, aside) = (table.path.display(), aside.display());
            warn(&format!(
                "warning: `{path}` was not as it had been written; set aside as `{aside}`"
            ));
        }
    }
}

/// Nothing is deleted unasked, but no table of a stage that was removed shall mislead.
fn report_orphans(plan: &Plan, data: &Data) -> Result<(), Failure> {
    for path in results::orphans(plan, &data.results())? {
        let path = path.display();
        warn(&format!(
            "note: `{path}` is of a stage that the study no longer has; you may delete it"
        ));
    }
    Ok(())
}

fn exit_code(outcome: &Outcome, stop: &Stop) -> ExitCode {
    if outcome.interrupted {
        ExitCode::from(stop.exit_code())
    } else if outcome.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}
