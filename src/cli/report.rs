//! `asperity report`: what a study has found as a page and as figures.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use super::{Data, Failure, counted, misused};
use crate::report::bars::Bars;
use crate::report::{self, Report, ReportError, Subject};
use crate::results::owner;
use crate::results::reading::Reading;
use crate::store::files::Existing;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run, or has begun to.
    manifest: PathBuf,

    /// The folder to write `report.html` and `figures/` into; that of the study's tables when left
    /// out.
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Write the page even in the place of one that shows more, as of a study that is half done or
    /// has lost its maps, or of another manifest whose study has the same name.
    #[arg(long)]
    replace: bool,

    /// What error bars are: standard errors of the mean, or standard deviations over the surfaces.
    #[arg(long, value_name = "KIND", default_value = "sem")]
    bars: Bars,

    /// Print JSON: `{"page", "figures", "drawn": [title, …], "missing": [{"figure", "needs"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let reading = data.reading(&arguments.manifest)?;
    if !arguments.replace && arguments.output.is_none() {
        let Reading {
            study,
            plan,
            archive,
            ..
        } = &reading;
        owner::check(&arguments.manifest, study, plan, archive).map_err(misused)?;
    }
    let manifest = std::fs::read_to_string(&arguments.manifest)?;
    let warnings = reading.study.warnings();
    let subject = Subject {
        plan: &reading.plan,
        rows: &reading.all()?,
        archive: &reading.archive,
        sources: &reading.study.sources,
        manifest: &manifest,
        warnings: &warnings,
    };
    let beside = || data.results().join(&reading.plan.study);
    let folder = arguments.output.clone().unwrap_or_else(beside);
    let existing = match arguments.replace {
        true => Existing::Replace,
        false => Existing::Keep,
    };
    let report =
        report::write(&subject, arguments.bars, &folder, existing).map_err(
            |error| match error {
                ReportError::ShowsLess { .. } => Failure::from(misused(error)),
                other => other.into(),
            },
        )?;
    let mut out = stdout().lock();
    match arguments.json {
        true => writeln!(out, "{:#}", as_json(&report))?,
        false => write!(out, "{}", text(&report))?,
    }
    Ok(ExitCode::SUCCESS)
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "page     {} · {:.1} MB\nfigures  {} · {} as SVG and PNG\n",
        report.page.display(),
        report.size as f64 / 1e6,
        report.figures.display(),
        counted(report.drawn.len(), "figure"),
    );
    for (title, needs) in &report.missing {
        text += &format!("missing  {title}: needs {needs}\n");
    }
    text
}

fn as_json(report: &Report) -> serde_json::Value {
    let missing = report.missing.iter();
    let missing =
        missing.map(|(title, needs)| serde_json::json!({"figure": title, "needs": needs}));
    serde_json::json!({
        "page": report.page,
        "figures": report.figures,
        "drawn": report.drawn,
        "missing": missing.collect::<Vec<_>>(),
    })
}
