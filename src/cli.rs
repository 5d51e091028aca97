//! The command line: one file per subcommand.
//!
//! Exit codes: 0 done, 1 a task or a file failed, 2 the manifest or the command line is wrong,
//! 130 stopped by the user, 143 by `kill`, 129 with its terminal.

mod advise;
mod cancel;
mod check;
mod claims;
mod columns;
mod completions;
mod explain;
mod failure_report;
mod finish;
mod forecast;
mod grid;
mod init;
mod json;
mod man;
mod picture_file;
mod plan;
mod progress;
mod prune;
mod reference;
mod report;
mod run;
mod schema;
mod share;
mod show;
mod signals;
mod status;
mod submit;
mod summary;
mod surface;
mod table;
pub mod terminal;
mod verify;
mod view;

use std::env;
use std::error::Error;
use std::ffi::OsString;
use std::io::{IsTerminal, Write, stderr};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::session::{Event, Session, SessionError, UnknownName};
use asperity_contact::instructions::Instructions;
use asperity_manifest::diagnostics::{chain, counted};
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::study::Warning;

pub use asperity_stages::aggregate::sql::silence_panics;

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
    Init(init::Arguments),
    /// Say whether a manifest makes sense, and what it amounts to.
    Check(check::Arguments),
    /// List what a study has and what it would compute.
    Plan(plan::Arguments),
    /// Say why tasks would run, what they are expected to cost, and what is reused.
    Explain(explain::Arguments),
    /// Compute what is missing and write the tables.
    Run(run::Arguments),
    /// Share a study out among the nodes of a Slurm cluster.
    Submit(submit::Arguments),
    /// Say how far a study is, wherever it is computed.
    Status(status::Arguments),
    /// Take a study's jobs out of the queue of Slurm; what is finished is kept.
    Cancel(cancel::Arguments),
    /// What the last job of `submit` runs: compute what is little, submit again what is much, write
    /// the tables.
    Finish(finish::Arguments),
    /// Say claim by claim what the 2015 paper says, what the study found, and whether it holds.
    Claims(claims::Arguments),
    /// Say what one more octave towards each limit would cost, and how much it would narrow the limit.
    Advise(advise::Arguments),
    /// Write a page of figures and tables, and each figure as SVG and PNG.
    Report(report::Arguments),
    /// Print a stage's table, or ask all tables of a study in SQL.
    Table(table::Arguments),
    /// Say what the columns of the tables mean, and in which units they are.
    Columns(columns::Arguments),
    /// Show how a table was made, and its first rows.
    Show(show::Arguments),
    /// Put a study into one archive: manifest, input files, tables, plan, checksums.
    Share(share::Arguments),
    /// Draw the surface, the contact map or the pressures of one task.
    View(view::Arguments),
    /// Say what a file of surface topography holds, and draw it.
    Surface(surface::Arguments),
    /// Look whether every table, page and figure is as it was written; set damaged tables aside.
    Verify(verify::Arguments),
    /// Delete what no named manifest needs.
    Prune(prune::Arguments),
    /// Print the JSON Schema of manifests, for editors.
    Schema(schema::Arguments),
    /// Print completions for a shell.
    Completions(completions::Arguments),
    /// Write manual pages, one for each command.
    Man(man::Arguments),
    /// Write the pages of the guide that follow from the program.
    #[command(hide = true)]
    Reference(reference::Arguments),
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
    if let Err(error) = signals::survive_large_files() {
        return report(&error);
    }
    if let Err(error) = choose_instructions() {
        return report(error.as_ref());
    }
    let result = match arguments.command {
        Command::Init(arguments) => init::run(&arguments),
        Command::Check(arguments) => check::run(&arguments, &data),
        Command::Plan(arguments) => plan::run(&arguments, &data),
        Command::Explain(arguments) => explain::run(&arguments, &data),
        Command::Run(arguments) => run::run(&arguments, &data),
        Command::Submit(arguments) => submit::run(&arguments, &data, program),
        Command::Status(arguments) => status::run(&arguments, &data),
        Command::Cancel(arguments) => cancel::run(&arguments, &data),
        Command::Finish(arguments) => finish::run(&arguments, &data),
        Command::Claims(arguments) => claims::run(&arguments, &data),
        Command::Advise(arguments) => advise::run(&arguments, &data),
        Command::Report(arguments) => report::run(&arguments, &data),
        Command::Table(arguments) => table::run(&arguments, &data),
        Command::Columns(arguments) => columns::run(&arguments, &data),
        Command::Show(arguments) => show::run(&arguments, &data),
        Command::Share(arguments) => share::run(&arguments, &data),
        Command::View(arguments) => view::run(&arguments, &data),
        Command::Surface(arguments) => surface::run(&arguments),
        Command::Verify(arguments) => verify::run(&arguments, &data),
        Command::Prune(arguments) => prune::run(&arguments, &data),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Completions(arguments) => completions::run::<Arguments>(&arguments),
        Command::Man(arguments) => man::run::<Arguments>(&arguments),
        Command::Reference(arguments) => reference::run::<Arguments>(&arguments),
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
