//! `asperity schema`, `completions` and `man`: texts generated from the program.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::CommandFactory;
use clap_complete::Shell;

use super::Failure;
use super::terminal::stdout;
use crate::session::{StoreError, make_folder};
use asperity_pipeline::manifest;

pub(crate) fn schema() -> Result<ExitCode, Failure> {
    writeln!(stdout(), "{:#}", manifest::schema())?;
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub(crate) struct CompletionsArguments {
    /// Shell to print completions for.
    shell: Shell,
}

pub(crate) fn completions<C: CommandFactory>(
    arguments: &CompletionsArguments,
) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut C::command(), "asperity", &mut script);
    io::stdout().lock().write_all(&script)?;
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub(crate) struct ManArguments {
    /// Folder for `asperity.1`, `asperity-run.1` …, such as `~/.local/share/man/man1`; created if
    /// it does not exist.
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
}

pub(crate) fn man<C: CommandFactory>(arguments: &ManArguments) -> Result<ExitCode, Failure> {
    let folder = &arguments.output;
    make_folder(folder)?;
    clap_mangen::generate_to(C::command(), folder)
        .map_err(|source| StoreError::writing(folder, source))?;
    writeln!(stdout(), "{}", folder.join("asperity.1").display())?;
    Ok(ExitCode::SUCCESS)
}
