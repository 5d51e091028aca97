//! `asperity report`: what a study has found as a page and as figures.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use super::terminal::stdout;
use super::{Failure, counted};
use crate::session::{Bars, Report, ReportOptions};
use asperity_pipeline::data_folder::DataFolder;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run, or has begun to.
    manifest: PathBuf,

    /// The folder to write `report.html` and `figures/` into; that of the study's tables when left
    /// out.
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Replace a page that shows more than the new one, a page of another study or manifest, and
    /// reports or figures that were changed since they were written. A page that no report wrote is
    /// not replaced.
    #[arg(long)]
    replace: bool,

    /// What error bars are: standard errors of the mean, or standard deviations over the surfaces.
    #[arg(long, value_name = "KIND", default_value = "sem")]
    bars: BarKind,

    /// Print JSON: `{"page", "figures", "drawn": [title, …], "missing": [{"figure", "needs"}, …]}`.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum BarKind {
    /// Standard errors of the mean: how well it is known.
    Sem,
    /// Standard deviations over the surfaces, as in the paper: how they scatter.
    Sd,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let report = session.report(&ReportOptions {
        output: arguments.output.clone(),
        replace: arguments.replace,
        bars: match arguments.bars {
            BarKind::Sem => Bars::Sem,
            BarKind::Sd => Bars::Sd,
        },
    })?;
    let mut out = stdout();
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
