//! `asperity schema`: the JSON Schema of manifests.

use std::io::Write;
use std::process::ExitCode;

use super::Failure;
use super::terminal::stdout;

#[derive(clap::Args)]
pub struct Arguments {}

pub fn run(_: &Arguments) -> Result<ExitCode, Failure> {
    let schema = serde_json::to_string_pretty(&asperity_pipeline::manifest::schema())?;
    writeln!(stdout(), "{schema}")?;
    Ok(ExitCode::SUCCESS)
}
