//! `asperity reference`: the pages of the guide that follow from the program itself.
//!
//! They are committed under `docs/reference/`, and CI compares them with what is written anew.

mod columns;
mod commands;
mod keys;

use std::fs;
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
    /// The folder to write `keys.md`, `columns.md` and `commands.md` into.
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
}

pub fn run<C: CommandFactory>(arguments: &Arguments) -> Result<ExitCode, Failure> {
    make_folder(&arguments.output)?;
    let pages = [
        ("keys.md", keys::page()),
        ("columns.md", columns::page()),
        ("commands.md", commands::page(C::command())),
    ];
    for (name, page) in pages {
        let path = arguments.output.join(name);
        fs::write(&path, page)
            .map_err(|source| StoreError::Write { path: path.clone(), source })?;
        writeln!(stdout(), "{}", path.display())?;
    }
    Ok(ExitCode::SUCCESS)
}
