//! Command line of the program, with one file for each group of subcommands.
//!
//! The subcommands use only the [session](crate::session).
//!
//! Exit codes: 0 success, 1 a task or a file failed, 2 error in the manifest or the command line,
//! 130 stopped by Ctrl-C, 143 stopped by `kill`, 129 terminal closed.

mod claims;
mod cluster;
mod console;
pub(crate) mod diff;
mod errors;
mod maintenance;
mod pictures;
mod plan;
mod reference;
mod report;
mod run;
mod tables;
pub(crate) mod terminal;

use std::env;
use std::error::Error;
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write, stderr};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Parser, Subcommand};
use serde::Serialize;
use signal_hook::consts::SIGXFSZ;

use asperity_queries::silence_panics;

use crate::session::formatting::chain;
use crate::session::{
    DataFolder, Event, Instructions, SETTINGS_FILE, Session, SessionError, Setting, UnknownName,
};

/// Run statistical studies of the contact of rough surfaces.
///
/// A manifest (a TOML file) defines which surfaces to generate, how to press them, and what to
/// measure, correct, fit and aggregate. Every stage becomes one Parquet table. Finished results are
/// reused: after a change of the manifest, only the new parts are computed.
#[derive(Parser)]
#[command(version, about, long_about, propagate_version = true)]
struct Arguments {
    /// Data folder, which holds `store/`, `results/STUDY/STAGE.parquet` and `plans/`.
    #[arg(long, global = true, value_name = "DIR", env = "ASPERITY_DATA", default_value = "data")]
    data: PathBuf,

    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write a template manifest for a new study.
    Init(plan::InitArguments),
    /// Validate a manifest and print a summary.
    Check(StudyArguments),
    /// List the finished and the missing tasks of each stage.
    Plan(plan::PlanArguments),
    /// Explain why tasks will run, what they cost and what is reused.
    Explain(plan::ExplainArguments),
    /// Compute the missing tasks and write the tables.
    Run(run::RunArguments),
    /// Distribute a study over the nodes of a Slurm cluster.
    Submit(cluster::SubmitArguments),
    /// Show the progress of a study, on this machine or on a cluster.
    Status(cluster::StatusArguments),
    /// Cancel the Slurm jobs of a study and keep its finished tasks.
    Cancel(StudyArguments),
    /// Complete a submitted study: run small remainders locally, resubmit large ones, write the
    /// tables.
    ///
    /// The last job of `submit` runs this command.
    Finish(cluster::FinishArguments),
    /// Test claims, of the 2015 paper or of the study itself, with the results of a study.
    Claims(claims::ClaimsArguments),
    /// Estimate how wrong means and fitted limits are, and what halving an error costs.
    ///
    /// For each mean over surfaces, print the errors of sampling, mesh, cell and solver with their
    /// intervals, and the lines of the manifest that add missing surfaces. For each fitted limit,
    /// print the cost of halving each small parameter once more, and how much this would reduce the
    /// standard error.
    #[command(alias = "advise")]
    Errors(errors::ErrorsArguments),
    /// Write an HTML page of figures and tables, and each figure as SVG, PNG and PDF.
    Report(report::ReportArguments),
    /// Print the table of a stage, or the result of an SQL query.
    Table(tables::TableArguments),
    /// List the columns of the tables with their units and meanings.
    Columns(tables::ColumnsArguments),
    /// Print the provenance and the first rows of a table.
    Show(tables::ShowArguments),
    /// Compare two studies: parameters, rows, and means of all columns.
    Diff(diff::DiffArguments),
    /// Pack a study into one archive: manifest, input files, tables, plan and checksums.
    Share(report::ShareArguments),
    /// Draw a map of one task: heights, contact, pressures, gaps or displacements.
    View(pictures::ViewArguments),
    /// Export the maps of one task to ParaView (VTK), NumPy or Gwyddion.
    Export(pictures::ExportArguments),
    /// Describe the channels of a topography file and draw one of them.
    Surface(pictures::SurfaceArguments),
    /// Check all tables, pages and figures for damage and set damaged tables aside.
    Verify(maintenance::VerifyArguments),
    /// Delete files that none of the given manifests needs.
    Prune(maintenance::PruneArguments),
    /// Print the JSON Schema of manifests, for editors.
    Schema,
    /// Print completions for a shell.
    Completions(reference::CompletionsArguments),
    /// Write manual pages, one for each command.
    Man(reference::ManArguments),
}

/// Runs a command line whose first word is the name of the program.
///
/// Cluster jobs run the executable `program`. Its default is the executable of this process, which
/// is wrong if the caller is an interpreter. The function handles signals, and it ends the process
/// if the command line is invalid.
pub fn run(line: impl IntoIterator<Item = OsString>, program: Option<&Path>) -> ExitCode {
    silence_panics();
    let arguments = Arguments::parse_from(line);
    let data = DataFolder::new(arguments.data).with_settings(user_settings());
    let result = perform(arguments.command, &data, program);
    result.unwrap_or_else(|failure| report(failure.as_ref(), &data))
}

fn perform(
    command: Command,
    data: &DataFolder,
    program: Option<&Path>,
) -> Result<ExitCode, Failure> {
    // A file that exceeds `ulimit -f` becomes a write error. Otherwise the signal would end the
    // process without a message.
    signal_hook::flag::register(SIGXFSZ, Arc::default())?;
    // Tests check that all instruction sets give the same bytes.
    if let Ok(name) = env::var("ASPERITY_SIMD") {
        Instructions::choose(&name).map_err(|error| misused(format!("ASPERITY_SIMD: {error}")))?;
    }
    match command {
        Command::Init(arguments) => plan::init(&arguments),
        Command::Check(arguments) => plan::check(&arguments, data),
        Command::Plan(arguments) => plan::plan(&arguments, data),
        Command::Explain(arguments) => plan::explain(&arguments, data),
        Command::Run(arguments) => run::run(&arguments, data),
        Command::Submit(arguments) => cluster::submit(&arguments, data, program),
        Command::Status(arguments) => cluster::status(&arguments, data),
        Command::Cancel(arguments) => cluster::cancel(&arguments, data),
        Command::Finish(arguments) => cluster::finish(&arguments, data),
        Command::Claims(arguments) => claims::claims(&arguments, data),
        Command::Errors(arguments) => errors::errors(&arguments, data),
        Command::Report(arguments) => report::report(&arguments, data),
        Command::Table(arguments) => tables::table(&arguments, data),
        Command::Columns(arguments) => tables::columns(&arguments, data),
        Command::Show(arguments) => tables::show(&arguments, data),
        Command::Diff(arguments) => diff::diff(&arguments, data),
        Command::Share(arguments) => report::share(&arguments, data),
        Command::View(arguments) => pictures::view(&arguments, data),
        Command::Export(arguments) => pictures::export(&arguments, data),
        Command::Surface(arguments) => pictures::surface(&arguments),
        Command::Verify(arguments) => maintenance::verify(&arguments, data),
        Command::Prune(arguments) => maintenance::prune(&arguments, data),
        Command::Schema => reference::schema(),
        Command::Completions(arguments) => reference::completions::<Arguments>(&arguments),
        Command::Man(arguments) => reference::man::<Arguments>(&arguments),
    }
}

/// Error that ends a command.
type Failure = Box<dyn Error + Send + Sync>;

/// Error in the arguments of the command line.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Misused(String);

fn misused(message: impl Into<String>) -> Failure {
    Misused(message.into()).into()
}

/// Prints an error with its causes and returns the exit code.
fn report(failure: &(dyn Error + Send + Sync + 'static), data: &DataFolder) -> ExitCode {
    let of_session = failure.downcast_ref::<SessionError>();
    if let Some(SessionError::Manifest(errors)) = of_session {
        let colours = stderr().is_terminal() && env::var_os("NO_COLOR").is_none();
        let _ = write!(stderr(), "{}", errors.render(colours));
        return ExitCode::from(2);
    }
    // The reader of the output, such as `head`, has closed the pipe.
    let of_output = failure.downcast_ref::<io::Error>().map(io::Error::kind);
    if of_output == Some(io::ErrorKind::BrokenPipe) {
        return ExitCode::SUCCESS;
    }
    let mut text = format!("error: {}", chain(failure));
    let damaged = of_session.and_then(SessionError::damaged_path);
    if damaged.is_some_and(|path| path.starts_with(data.path())) {
        text += "; set it aside with `asperity verify`, and compute it again with `asperity run`";
    }
    if let Some(key) = of_session.and_then(SessionError::lost_in_layer) {
        text += &format!("; compute it into your store with `asperity run MANIFEST --only {key}`");
    }
    warn(&text);
    let is_misuse = failure.is::<Misused>() || of_session.is_some_and(SessionError::is_misuse);
    ExitCode::from(if is_misuse { 2 } else { 1 })
}

/// Options that override keys of the manifest.
#[derive(clap::Args)]
struct SetArguments {
    /// Override a key of the manifest, such as `stage.surfaces.realizations=20`. Can be repeated.
    ///
    /// The value is in TOML; a word needs no quotes. A setting has the same effect as an edit of
    /// the manifest.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<Setting>,
}

impl SetArguments {
    /// Refuses settings of a command that was called without a manifest.
    fn refuse(&self) -> Result<(), Failure> {
        if self.settings.is_empty() { Ok(()) } else { Err(misused("`--set` needs a manifest")) }
    }
}

/// Manifest of a study, with options that override its keys.
#[derive(clap::Args)]
struct StudyArguments {
    /// Path of the manifest of the study.
    manifest: PathBuf,

    #[command(flatten)]
    set: SetArguments,
}

impl StudyArguments {
    /// Opens a session that prints its notices on standard error.
    fn session(&self, data: &DataFolder) -> Session<'static> {
        session(&self.manifest, &self.set, data)
    }
}

/// Opens a session with settings that prints its notices on standard error.
fn session(manifest: &Path, set: &SetArguments, data: &DataFolder) -> Session<'static> {
    let session =
        Session::with_data(manifest, data.clone()).with_settings(set.settings.iter().cloned());
    session.observed_by(&print_notice)
}

/// Returns the path of the user's settings, following the XDG Base Directory Specification.
///
/// Returns `None` if access is denied: after `su`, the folder can belong to another user.
pub fn user_settings() -> Option<PathBuf> {
    let named = env::var_os("XDG_CONFIG_HOME").filter(|folder| Path::new(folder).is_absolute());
    let folder = named.map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".config")));
    let path = folder?.join("asperity").join(SETTINGS_FILE);
    let is_denied = |error: &io::Error| error.kind() == io::ErrorKind::PermissionDenied;
    (!path.metadata().is_err_and(|error| is_denied(&error))).then_some(path)
}

/// Prints an event if it is a notice.
fn print_notice(event: Event<'_>) {
    if let Event::Notice(notice) = event {
        warn(&format!("{}: {notice}", notice.severity()));
    }
}

/// Prints a value as JSON with sorted keys.
fn print_json(out: &mut impl Write, value: &impl Serialize) -> Result<(), Failure> {
    Ok(writeln!(out, "{:#}", serde_json::to_value(value)?)?)
}

/// Prints a value as JSON or as text.
fn print_answer(
    is_json: bool,
    value: &impl Serialize,
    text: impl FnOnce() -> String,
) -> Result<ExitCode, Failure> {
    let mut out = terminal::stdout();
    if is_json {
        print_json(&mut out, value)?;
    } else {
        write!(out, "{}", text())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Creates the error for an unknown name, with a suggestion and the known names.
fn unknown(message: String, name: &str, known: &[&str]) -> Failure {
    SessionError::from(UnknownName::new(message, name, known)).into()
}

/// Prints a line on standard error and escapes control characters.
pub(crate) fn warn(line: &str) {
    // Ignore write errors: stderr may be closed.
    let _ = writeln!(stderr(), "{}", terminal::escaped(line));
}

/// Prints warnings about a study or a file.
fn print_warnings(warnings: &[impl std::fmt::Display]) {
    for warning in warnings {
        warn(&format!("warning: {warning}"));
    }
}
