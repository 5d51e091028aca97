//! The command line: one file per subcommand.
//!
//! Exit codes: 0 done, 1 a task or a file failed, 2 the manifest or the command line is wrong,
//! 130 stopped by the user, 143 by `kill`, 129 with its terminal.

mod check;
mod claims;
mod columns;
mod completions;
mod counts;
mod explain;
mod failure_report;
mod grid;
mod outlook;
mod plan;
mod progress;
mod prune;
mod report;
mod run;
mod schema;
mod show;
mod signals;
mod summary;
mod table;
mod tables;
mod tasks;
mod verify;
mod view;

use std::error::Error;
use std::io::{IsTerminal, Write, stderr};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{panic, thread};

use clap::{Parser, Subcommand};
use outlook::Outlook;

use crate::diagnostics::{ManifestErrors, chain, counted, did_you_mean, listed, wrapped};
use crate::growth::Grown;
use crate::prune::Folders;
use crate::reasons::record::Record;
use crate::results::archive::Archive;
use crate::results::owner;
use crate::results::reading::{self, Reading};
use crate::stages::aggregate::sql;
use crate::store::writer::Moment;
use crate::store::{Store, StoreError};
use crate::study::{Study, Warning};

/// Statistical studies of rough contact.
///
/// A manifest says which surfaces to generate, how to press them, and what to measure, correct,
/// fit and aggregate. Every stage becomes one Parquet table; what is computed once is kept, and
/// editing the manifest computes only what is new.
#[derive(Parser)]
#[command(version, about, long_about, propagate_version = true)]
struct Arguments {
    /// Folder of finished work: `store/`, `results/STUDY/STAGE.parquet` and `plans/`.
    #[arg(
        long,
        global = true,
        value_name = "DIR",
        env = "ASPERITY_DATA",
        default_value = "data"
    )]
    data: PathBuf,

    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Say whether a manifest makes sense, and what it amounts to.
    Check(check::Arguments),
    /// List what a study has and what it would compute.
    Plan(plan::Arguments),
    /// Say why tasks would run, what they are expected to cost, and what is reused.
    Explain(explain::Arguments),
    /// Compute what is missing and write the tables.
    Run(run::Arguments),
    /// Say claim by claim what the 2015 paper says, what the study found, and whether it holds.
    Claims(claims::Arguments),
    /// Write a page of figures and tables, and each figure as SVG and PNG.
    Report(report::Arguments),
    /// Print a stage's table, or ask all tables of a study in SQL.
    Table(table::Arguments),
    /// Say what the columns of the tables mean, and in which units they are.
    Columns(columns::Arguments),
    /// Show how a table was made, and its first rows.
    Show(show::Arguments),
    /// Draw the surface, the contact map or the pressures of one task.
    View(view::Arguments),
    /// Look whether every table, page and figure is as it was written; set damaged tables aside.
    Verify(verify::Arguments),
    /// Delete what no named manifest needs.
    Prune(prune::Arguments),
    /// Print the JSON Schema of manifests, for editors.
    Schema(schema::Arguments),
    /// Print completions for a shell.
    Completions(completions::Arguments),
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    leave_panics_of_queries_to_their_errors();
    let arguments = Arguments::parse();
    let data = Data(arguments.data);
    if let Err(error) = signals::survive_large_files() {
        return report(&error);
    }
    let result = match arguments.command {
        Command::Check(arguments) => check::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments, &data),
        Command::Explain(arguments) => explain::run(&arguments, &data),
        Command::Run(arguments) => run::run(&arguments, &data),
        Command::Claims(arguments) => claims::run(&arguments, &data),
        Command::Report(arguments) => report::run(&arguments, &data),
        Command::Table(arguments) => table::run(&arguments, &data),
        Command::Columns(arguments) => columns::run(&arguments, &data),
        Command::Show(arguments) => show::run(&arguments, &data),
        Command::View(arguments) => view::run(&arguments, &data),
        Command::Verify(arguments) => verify::run(&arguments, &data),
        Command::Prune(arguments) => prune::run(&arguments, &data),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Completions(arguments) => completions::run::<Arguments>(&arguments),
    };
    result.unwrap_or_else(|failure| report(failure.as_ref()))
}

/// Polars panics at some queries; an error says so, and the trace of a panic would say no more.
fn leave_panics_of_queries_to_their_errors() {
    let tell = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        if thread::current().name() != Some(sql::THREAD) {
            tell(panic);
        }
    }));
}

/// Anything that ends a command early.
type Failure = Box<dyn Error + Send + Sync>;

/// The command line asks for what is not there, or not possible.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Misused(String);

fn misused(error: impl Error) -> Misused {
    Misused(error.to_string())
}

/// Prints an error and its causes, once, and says how the process ends.
fn report(failure: &(dyn Error + Send + Sync + 'static)) -> ExitCode {
    if let Some(errors) = failure.downcast_ref::<ManifestErrors>() {
        let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        let _ = write!(stderr(), "{}", errors.render(colours));
        return ExitCode::from(2);
    }
    if is_closed_pipe(failure) {
        return ExitCode::SUCCESS;
    }
    // Nobody is left to tell if standard error is closed.
    let _ = writeln!(stderr(), "error: {}", chain(failure));
    match failure.is::<Misused>() {
        true => ExitCode::from(2),
        false => ExitCode::from(1),
    }
}

/// Whether output went to a reader that has seen enough, such as `head`.
fn is_closed_pipe(failure: &(dyn Error + 'static)) -> bool {
    failure
        .downcast_ref::<std::io::Error>()
        .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}

/// The folder of finished work.
struct Data(PathBuf);

impl Data {
    fn store(&self) -> PathBuf {
        self.0.join("store")
    }

    fn results(&self) -> PathBuf {
        self.0.join("results")
    }

    /// What studies were when they last ran.
    fn records(&self) -> PathBuf {
        self.0.join("plans")
    }

    /// A manifest's study, with as many surfaces as the tables in the store ask for.
    fn grown(&self, manifest: &Path) -> Result<Grown, Failure> {
        Ok(Grown::of(study(manifest)?, &self.look()?)?)
    }

    /// What has been computed of a manifest's study, to be looked at; what of it is gone is told.
    fn reading(&self, manifest: &Path) -> Result<Reading, Failure> {
        let (store, results) = (self.look()?, self.results());
        let study = reading::study(manifest, &store, &results)?;
        for file in study.sources.recalled() {
            warn(&format!(
                "note: surface file `{}` cannot be read; its tables are those of it as it was",
                file.display()
            ));
        }
        Ok(Reading::of(study, store, &results)?)
    }

    /// What a manifest's study has and what it would compute.
    fn outlook(&self, manifest: &Path) -> Result<Outlook, Failure> {
        let grown = self.grown(manifest)?;
        let record = Record::read(&self.records(), &grown.study.name);
        Ok(Outlook::of(grown, &self.look()?, record.as_ref()))
    }

    fn with_folders<T>(&self, act: impl FnOnce(&Folders) -> T) -> T {
        act(&Folders {
            store: &self.store(),
            results: &self.results(),
            records: &self.records(),
        })
    }

    /// Refuses to take tables away from another manifest whose study has the same name.
    fn check_owner(&self, manifest: &Path, grown: &Grown, store: &Store) -> Result<(), Failure> {
        let Grown { study, plan, .. } = grown;
        let archive = Archive::of(store.clone(), &self.results().join(&plan.study));
        Ok(owner::check(manifest, study, plan, &archive).map_err(misused)?)
    }

    fn open(&self) -> Result<Store, StoreError> {
        // What cannot be swept does no harm.
        let _ = self.with_folders(|folders| crate::prune::sweep(folders, &Moment::here()));
        Store::open(&self.store())
    }

    fn look(&self) -> Result<Store, StoreError> {
        Store::look(&self.store())
    }
}

/// A name that is not there, what was meant, and what there is.
fn unknown(message: &str, name: &str, known: &[&str]) -> Failure {
    let meant = did_you_mean(name, known.iter().copied());
    let meant = meant.map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"));
    let known = wrapped(&listed(known.iter().copied(), "and"));
    Misused(format!("{message}{meant}\nthere is {known}")).into()
}

/// A stage's place among the stages of a study, by its name.
fn place_of(stages: &[&str], name: &str) -> Result<usize, Failure> {
    let place = stages.iter().position(|stage| *stage == name);
    place.ok_or_else(|| unknown(&format!("the study has no stage `{name}`"), name, stages))
}

fn study(manifest: &Path) -> Result<Study, Failure> {
    Ok(Study::read(manifest)?)
}

/// Nobody is left to tell if standard error is closed.
pub fn warn(line: &str) {
    let _ = writeln!(stderr(), "{line}");
}

/// Says what should be known of a study; nothing ends for it.
fn tell(warnings: &[Warning]) {
    for warning in warnings {
        warn(&format!("warning: {warning}"));
    }
}
