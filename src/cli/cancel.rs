//! `asperity cancel`: take a study's jobs out of the queue.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use super::Failure;
use super::terminal::stdout;
use crate::session::DataFolder;
use crate::session::words::listed;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been submitted.
    manifest: PathBuf,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let jobs = session.cancel()?;
    let mut out = stdout();
    match jobs.as_slice() {
        [] => writeln!(out, "no job of the study is in the queue")?,
        jobs => {
            let jobs = listed(jobs.iter().map(String::as_str), "and");
            writeln!(out, "cancelled: {jobs}; finished tasks are kept")?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
