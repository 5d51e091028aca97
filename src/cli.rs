//! The command line: one file for each group of subcommands. They talk to the [session](crate::session)
//! and to nothing below it.
//!
//! Exit codes: 0 done, 1 a task or a file failed, 2 the manifest or the command line is wrong,
//! 130 stopped by the user, 143 by `kill`, 129 with its terminal.

mod claims;
mod cluster;
mod console;
mod maintenance;
mod pictures;
mod plan;
mod reference;
mod report;
mod run;
mod tables;
pub mod terminal;

use std::env;
use std::error::Error;
use std::ffi::OsString;
use std::io::{IsTerminal, Write, stderr};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use serde::Serialize;

use crate::session::words::chain;
use crate::session::{
    DataFolder, Event, Instructions, Session, SessionError, UnknownName, Warning,
};

pub use crate::session::silence_panics;

/// Statistical studies of rough contact.
///
/// A manifest says which surfaces to generate, how to press them, and what to measure, correct,
/// fit and aggregate. Every stage becomes one Parquet table; what is computed once is kept, and
/// editing the manifest computes only what is new.
#[derive(Parser)]
#[command(version, about, long_about, propagate_version = true)]
struct Arguments {
    /// Folder of finished work: `store/`, `results/STUDY/STAGE.parquet` and `plans/`.
    #[arg(long, global = true, value_name = "DIR", env = "ASPERITY_DATA", default_value = "data")]
    data: PathBuf,

    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write a manifest to start from.
    Init(plan::InitArguments),
    /// Say whether a manifest makes sense, and what it amounts to.
    Check(plan::CheckArguments),
    /// List what a study has and what it would compute.
    Plan(plan::PlanArguments),
    /// Say why tasks would run, what they are expected to cost, and what is reused.
    Explain(plan::ExplainArguments),
    /// Compute what is missing and write the tables.
    Run(run::RunArguments),
    /// Share a study out among the nodes of a Slurm cluster.
    Submit(cluster::SubmitArguments),
    /// Say how far a study is, wherever it is computed.
    Status(cluster::StatusArguments),
    /// Take a study's jobs out of the queue of Slurm; what is finished is kept.
    Cancel(cluster::CancelArguments),
    /// What the last job of `submit` runs: compute what is little, submit again what is much, write
    /// the tables.
    Finish(cluster::FinishArguments),
    /// Say claim by claim what the 2015 paper says, what the study found, and whether it holds.
    Claims(claims::ClaimsArguments),
    /// Say what one more octave towards each limit would cost, and how much it would narrow the limit.
    Advise(claims::AdviseArguments),
    /// Write a page of figures and tables, and each figure as SVG and PNG.
    Report(report::ReportArguments),
    /// Print a stage's table, or ask all tables of a study in SQL.
    Table(tables::TableArguments),
    /// Say what the columns of the tables mean, and in which units they are.
    Columns(tables::ColumnsArguments),
    /// Show how a table was made, and its first rows.
    Show(tables::ShowArguments),
    /// Put a study into one archive: manifest, input files, tables, plan, checksums.
    Share(report::ShareArguments),
    /// Draw the surface, the contact map or the pressures of one task.
    View(pictures::ViewArguments),
    /// Say what a file of surface topography holds, and draw it.
    Surface(pictures::SurfaceArguments),
    /// Look whether every table, page and figure is as it was written; set damaged tables aside.
    Verify(maintenance::VerifyArguments),
    /// Delete what no named manifest needs.
    Prune(maintenance::PruneArguments),
    /// Print the JSON Schema of manifests, for editors.
    Schema(reference::SchemaArguments),
    /// Print completions for a shell.
    Completions(reference::CompletionsArguments),
    /// Write manual pages, one for each command.
    Man(reference::ManArguments),
    /// Write the pages of the guide that follow from the program.
    #[command(hide = true)]
    Reference(reference::ReferenceArguments),
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    run(env::args_os(), None)
}

/// Runs a command line, whose first word is what the program is called. `program` is what starts it
/// again, where that is not the file of this process: an interpreter may have called.
///
/// The process is the command's: its signals are heard, and what is misspelt ends it.
pub fn run(line: impl IntoIterator<Item = OsString>, program: Option<&Path>) -> ExitCode {
    silence_panics();
    let arguments = Arguments::parse_from(line);
    let data = DataFolder::new(arguments.data);
    if let Err(error) = console::survive_large_files() {
        return report(&error);
    }
    if let Err(error) = choose_instructions() {
        return report(error.as_ref());
    }
    let result = match arguments.command {
        Command::Init(arguments) => plan::init(&arguments),
        Command::Check(arguments) => plan::check(&arguments, &data),
        Command::Plan(arguments) => plan::plan(&arguments, &data),
        Command::Explain(arguments) => plan::explain(&arguments, &data),
        Command::Run(arguments) => run::run(&arguments, &data),
        Command::Submit(arguments) => cluster::submit(&arguments, &data, program),
        Command::Status(arguments) => cluster::status(&arguments, &data),
        Command::Cancel(arguments) => cluster::cancel(&arguments, &data),
        Command::Finish(arguments) => cluster::finish(&arguments, &data),
        Command::Claims(arguments) => claims::claims(&arguments, &data),
        Command::Advise(arguments) => claims::advise(&arguments, &data),
        Command::Report(arguments) => report::report(&arguments, &data),
        Command::Table(arguments) => tables::table(&arguments, &data),
        Command::Columns(arguments) => tables::columns(&arguments, &data),
        Command::Show(arguments) => tables::show(&arguments, &data),
        Command::Share(arguments) => report::share(&arguments, &data),
        Command::View(arguments) => pictures::view(&arguments, &data),
        Command::Surface(arguments) => pictures::surface(&arguments),
        Command::Verify(arguments) => maintenance::verify(&arguments, &data),
        Command::Prune(arguments) => maintenance::prune(&arguments, &data),
        Command::Schema(arguments) => reference::schema(&arguments),
        Command::Completions(arguments) => reference::completions::<Arguments>(&arguments),
        Command::Man(arguments) => reference::man::<Arguments>(&arguments),
        Command::Reference(arguments) => reference::reference::<Arguments>(&arguments),
    };
    result.unwrap_or_else(|failure| report(failure.as_ref()))
}

/// Those that `ASPERITY_SIMD` names, instead of the widest: every set computes the same bytes, and
/// this is how to see it.
fn choose_instructions() -> Result<(), Failure> {
    match env::var("ASPERITY_SIMD") {
        Ok(name) => Instructions::choose(&name)
            .map_err(|error| Misused(format!("ASPERITY_SIMD: {error}")).into()),
        Err(_) => Ok(()),
    }
}

/// Anything that ends a command early.
type Failure = Box<dyn Error + Send + Sync>;

/// The command line asks for what is not there, or not possible.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Misused(String);

/// Prints an error and its causes, once, and says how the process ends.
fn report(failure: &(dyn Error + Send + Sync + 'static)) -> ExitCode {
    let of_session = failure.downcast_ref::<SessionError>();
    if let Some(SessionError::Manifest(errors)) = of_session {
        let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        let _ = write!(stderr(), "{}", errors.render(colours));
        return ExitCode::from(2);
    }
    if is_closed_pipe(failure) {
        return ExitCode::SUCCESS;
    }
    warn(&format!("error: {}", chain(failure)));
    match failure.is::<Misused>() || of_session.is_some_and(SessionError::is_misuse) {
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

/// A manifest and the folder of finished work; what should be known is told on standard error.
fn session(manifest: &Path, data: &DataFolder) -> Session<'static> {
    Session::new(manifest, data.path()).observed_by(&tell_notice)
}

/// Says what should be known, and nothing else that happens.
fn tell_notice(event: Event<'_>) {
    if let Event::Notice(notice) = event {
        warn(&format!("{}: {notice}", notice.severity()));
    }
}

/// Prints what programs read: objects have their names in the order of the alphabet.
fn print_json(out: &mut impl Write, told: &impl Serialize) -> Result<(), Failure> {
    Ok(writeln!(out, "{:#}", serde_json::to_value(told)?)?)
}

/// Prints what programs read, or a text for people.
fn print_answer(
    is_json: bool,
    told: &impl Serialize,
    text: impl FnOnce() -> String,
) -> Result<ExitCode, Failure> {
    let mut out = terminal::stdout();
    if is_json {
        print_json(&mut out, told)?;
    } else {
        write!(out, "{}", text())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A name that is not there, what was meant, and what there is.
fn unknown(message: String, name: &str, known: &[&str]) -> Failure {
    SessionError::from(UnknownName::new(message, name, known)).into()
}

/// Prints a line on standard error, with control characters escaped.
pub fn warn(line: &str) {
    // Nobody is left to tell if standard error is closed.
    let _ = writeln!(stderr(), "{}", terminal::escaped(line));
}

/// Says what should be known of a study; nothing ends for it.
fn tell(warnings: &[Warning]) {
    for warning in warnings {
        warn(&format!("warning: {warning}"));
    }
}
