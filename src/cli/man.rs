//! `asperity man`: a manual page for the command, and one for each subcommand.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::CommandFactory;

use super::Failure;
use super::terminal::stdout;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::make_folder;

#[derive(clap::Args)]
pub struct Arguments {
    /// The folder to write `asperity.1`, `asperity-run.1` … into, such as
    /// `~/.local/share/man/man1`; made if it is not there.
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
}

pub fn run<C: CommandFactory>(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let folder = &arguments.output;
    make_folder(folder)?;
    clap_mangen::generate_to(C::command(), folder)
        .map_err(|source| StoreError::Write { path: folder.clone(), source })?;
    writeln!(stdout(), "{}", folder.join("asperity.1").display())?;
    Ok(ExitCode::SUCCESS)
}
