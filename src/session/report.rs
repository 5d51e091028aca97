//! The page of what a study has found.

use std::fs;
use std::path::PathBuf;

use super::Session;
use super::error::SessionError;
use asperity_pipeline::results::exceeded_hardness;
use asperity_pipeline::results::owner;
use asperity_report::{Subject, place};
use asperity_tables::store::files::Existing;

pub use asperity_report::Report;
pub use asperity_report::bars::Bars;

/// What page shall be written, and where.
#[derive(Debug, Clone, Default)]
pub struct ReportOptions {
    /// The folder to write into; that of the study's tables when left out.
    pub output: Option<PathBuf>,
    /// Whether to replace a page that shows more, or files of another manifest or of other
    /// programs.
    pub replace: bool,
    /// What error bars are.
    pub bars: Bars,
}

/// Writes the page and the figures beside it.
pub fn write(session: &Session, options: &ReportOptions) -> Result<Report, SessionError> {
    let reading = session.reading()?;
    if !options.replace && options.output.is_none() {
        let (study, plan) = (&reading.study, &reading.plan);
        owner::check(session.manifest(), study, plan, &reading.archive)?;
    }
    let existing = match options.replace {
        true => Existing::Replace,
        false => Existing::Keep,
    };
    if let Some(folder) = &options.output {
        place::check(folder, &reading.plan.study, existing)?;
    }
    let manifest = fs::read_to_string(session.manifest()).map_err(SessionError::Text)?;
    let rows = reading.all()?;
    let mut warnings = reading.study.warnings();
    warnings.extend(exceeded_hardness::warnings(&reading.study, &reading.plan, |stage| {
        Ok::<_, SessionError>(rows[stage].table.clone())
    })?);
    let subject = Subject {
        plan: &reading.plan,
        rows: &rows,
        archive: &reading.archive,
        sources: &reading.study.sources,
        manifest: &manifest,
        warnings: &warnings,
    };
    let beside = || session.data().results_of(&reading.plan.study);
    let folder = options.output.clone().unwrap_or_else(beside);
    Ok(asperity_report::write(&subject, options.bars, &folder, existing)?)
}
