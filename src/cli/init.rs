//! `asperity init`: a manifest to start from.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::terminal::stdout;
use super::{Failure, Misused};
use asperity_manifest::names;
use asperity_pipeline::manifest::{SCHEMA, schema, template};
use asperity_tables::store::StoreError;

#[derive(clap::Args)]
pub struct Arguments {
    /// The name of the study. The manifest is `NAME.toml` in this folder, and beside it lies
    /// `asperity.schema.json`, by which editors complete and check it; files that are there stay.
    #[arg(default_value = "study")]
    name: String,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let name = &arguments.name;
    if !names::is_plain(name) || name.len() > names::LONGEST {
        let message = format!(
            "`{name}` cannot name a study: a letter or `_`, then letters, digits, `_` and `-`, \
             {} at most",
            names::LONGEST
        );
        return Err(Misused(message).into());
    }
    let manifest = PathBuf::from(format!("{name}.toml"));
    if !write_new(&manifest, &template(name))? {
        let message =
            format!("`{}` is there already; give the study another name", manifest.display());
        return Err(Misused(message).into());
    }
    let schema = format!("{:#}\n", schema());
    let is_new = write_new(Path::new(SCHEMA), &schema)?;
    let mut out = stdout();
    writeln!(out, "manifest  {}", manifest.display())?;
    writeln!(out, "schema    {SCHEMA}{}", if is_new { "" } else { ", as it was" })?;
    writeln!(out, "next      asperity run {}", manifest.display())?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a file; false if there is one already, which stays as it is.
fn write_new(path: &Path, text: &str) -> Result<bool, StoreError> {
    let created = fs::File::create_new(path);
    match created.and_then(|mut file| file.write_all(text.as_bytes())) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(source) => Err(StoreError::Write { path: path.to_owned(), source }),
    }
}
