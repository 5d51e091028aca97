//! `asperity report`: what a study has found as a page and as figures.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use super::{Data, Failure, counted};
use crate::growth::Grown;
use crate::report::{self, Report, Subject};
use crate::results;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run, or has begun to.
    manifest: PathBuf,

    /// Print JSON: `{"page", "figures", "drawn": [title, …], "missing": [{"figure", "needs"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let Grown { study, plan, .. } = data.grown(&arguments.manifest)?;
    let store = data.look()?;
    let published = results::publish(&plan, &store, &study.sources, &data.results())?;
    let manifest = std::fs::read_to_string(&arguments.manifest)?;
    let warnings = study.warnings();
    let subject = Subject {
        plan: &plan,
        store: &store,
        sources: &study.sources,
        published: &published,
        manifest: &manifest,
        warnings: &warnings,
    };
    let report = report::write(&subject, &data.results().join(&plan.study))?;
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
