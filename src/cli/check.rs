//! `asperity check`: whether a manifest makes sense, and what it amounts to.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use super::terminal::stdout;
use super::{Failure, counted};
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::plan::Plan;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let study = super::session(&arguments.manifest, data).study()?;
    let plan = Plan::of(&study);
    super::tell(&study.warnings());
    let mut out = stdout();
    let at_least = if study.grows() { " at least" } else { "" };
    writeln!(
        out,
        "`{}` is sound: study `{}`, {}, {}{at_least}",
        arguments.manifest.display(),
        plan.study,
        counted(plan.stages.len(), "stage"),
        counted(plan.tasks.len(), "task"),
    )?;
    Ok(ExitCode::SUCCESS)
}
