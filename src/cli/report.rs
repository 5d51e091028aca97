//! `asperity report` and `share`: what a study has found as a page and as figures, and one archive of
//! the study.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::SystemTime;

use super::{Failure, print_answer};
use crate::session::results::NotDrawn;
use crate::session::words::counted;
use crate::session::{Bars, DataFolder, Day, Report, ReportOptions, ShareOptions, SharedStudy};

#[derive(clap::Args)]
pub struct ReportArguments {
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

pub fn report(arguments: &ReportArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let report = session.report(&ReportOptions {
        output: arguments.output.clone(),
        replace: arguments.replace,
        bars: match arguments.bars {
            BarKind::Sem => Bars::Sem,
            BarKind::Sd => Bars::Sd,
        },
    })?;
    print_answer(arguments.json, &report, || report_text(&report))
}

fn report_text(report: &Report) -> String {
    let mut text = format!(
        "page     {} · {:.1} MB\nfigures  {} · {} as SVG and PNG\n",
        report.page.display(),
        report.size as f64 / 1e6,
        report.figures.display(),
        counted(report.drawn.len(), "figure"),
    );
    for NotDrawn { figure, needs } in &report.missing {
        text += &format!("missing  {figure}: needs {needs}\n");
    }
    text
}

#[derive(clap::Args)]
pub struct ShareArguments {
    /// The manifest of a study that has been run.
    manifest: PathBuf,

    /// The archive; `STUDY.zip` in this folder when left out.
    #[arg(long, short, value_name = "FILE.zip")]
    output: Option<PathBuf>,

    /// Take the tables of the store along, with all maps: a run of what is unpacked has nothing to
    /// do. Without them it computes all of it anew, and reading the tables works all the same.
    #[arg(long)]
    store: bool,

    /// Replace an existing archive. Files of another kind are never replaced.
    #[arg(long)]
    replace: bool,

    /// The license that the archive's description gives: an identifier of SPDX, such as CC-BY-4.0,
    /// or an address.
    #[arg(long)]
    license: Option<String>,

    /// An author whom the archive's description gives; once for each.
    #[arg(long = "author", value_name = "NAME")]
    authors: Vec<String>,

    /// The day that the archive's description gives; today, in universal time, when left out. The
    /// same study and day make the same bytes.
    #[arg(long, value_name = "YYYY-MM-DD")]
    date: Option<Day>,

    /// Print JSON: `{"archive", "bytes", "tables", "stored", "tasks"}`, the last two null without
    /// the store.
    #[arg(long)]
    json: bool,
}

pub fn share(arguments: &ShareArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let shared = session.share(&ShareOptions {
        output: arguments.output.clone(),
        store: arguments.store,
        replace: arguments.replace,
        day: arguments.date.unwrap_or_else(|| Day::of(SystemTime::now())),
        license: arguments.license.clone(),
        authors: arguments.authors.clone(),
    })?;
    print_answer(arguments.json, &shared, || share_text(&shared))
}

fn share_text(shared: &SharedStudy) -> String {
    let store = match shared.stored.zip(shared.tasks) {
        Some((there, all)) => format!("tables of {there} of {}", counted(all, "task")),
        None => "left out; `--store` takes it along".to_owned(),
    };
    format!(
        "archive  {} · {:.1} MB\ntables   {}\nstore    {store}\n",
        shared.archive.display(),
        shared.bytes as f64 / 1e6,
        counted(shared.tables, "stage"),
    )
}
