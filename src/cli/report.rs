//! Commands that write a page with figures (`report`) and pack a study into an archive (`share`).

use std::path::PathBuf;
use std::process::ExitCode;

use super::{Failure, SetArguments, StudyArguments, print_answer};
use crate::session::formatting::counted;
use crate::session::results::{NotDrawn, Reason};
use crate::session::{
    Bars, DataFolder, Report, ReportOptions, ShareOptions, SharedStudy, StudyIndex,
};

#[derive(clap::Args)]
pub(crate) struct ReportArguments {
    /// Path of the manifest of the study.
    #[arg(required_unless_present = "index")]
    manifest: Option<PathBuf>,

    /// Write one page that lists all studies of the data folder, `results/index.html`.
    ///
    /// The page has the name of each study, the comment at the beginning of its manifest, the time
    /// of its last run, the numbers of surfaces and of finished tasks, and the main figure of its
    /// report with a link. It lists what is damaged. Without a report, a study has no figure.
    #[arg(long, conflicts_with_all = ["manifest", "output", "bars"])]
    index: bool,

    #[command(flatten)]
    set: SetArguments,

    /// Folder for `report.html` and `figures/` (default: the folder of the study's tables).
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Overwrite a page that belongs to another study or was edited.
    ///
    /// In the study's own folder, `report.html` and `figures/` are always rewritten, edited or not,
    /// unless they belong to another manifest. In a folder given with `--output`, the command
    /// refuses to overwrite a page of another study, edited pages and figures, and figures without
    /// a page, unless this option is given. A page there that `asperity report` did not write is
    /// never overwritten.
    #[arg(long)]
    replace: bool,

    /// Meaning of the error bars: standard errors of the mean, or standard deviations over the
    /// surfaces.
    #[arg(long, value_name = "KIND", default_value = "sem")]
    bars: BarKind,

    /// Print the result as JSON.
    ///
    /// Form: `{"page", "figures", "drawn": [title, …], "missing": [{"figure", "name", "reason",
    /// "needs"}, …]}`; the reason is `declared`, `lost` or, for figures of the paper that do not
    /// apply to the study, `does-not-apply`. With `--index`: `{"page", "studies": [{"name",
    /// "description", "manifest", "written", "surfaces", "stages": [{"name", "kind", "finished",
    /// "tasks"}, …], "state", "problems", "page", "picture"}, …]}`.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum BarKind {
    /// Standard errors of the mean.
    Sem,
    /// Standard deviations over the surfaces, as in the paper.
    Sd,
}

pub(crate) fn report(arguments: &ReportArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let Some(manifest) = &arguments.manifest else {
        arguments.set.refuse()?;
        let index = StudyIndex::write(data, arguments.replace)?;
        return print_answer(arguments.json, &index, || index_text(&index));
    };
    let session = super::session(manifest, &arguments.set, data);
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
        "page     {} · {:.1} MB\nfigures  {} · {} as SVG, PNG and PDF\n",
        report.page.display(),
        report.size as f64 / 1e6,
        report.figures.display(),
        counted(report.drawn.len(), "figure"),
    );
    for NotDrawn { figure, name, reason, needs } in &report.missing {
        text += &match reason {
            Reason::Declared => format!("missing  [figure.{name}] needs {needs}\n"),
            Reason::Lost => format!("missing  {figure}: needs {needs}\n"),
            Reason::DoesNotApply => continue,
        };
    }
    let others = report.missing.iter().filter(|figure| figure.reason == Reason::DoesNotApply);
    text += &match others.count() {
        0 => String::new(),
        count => format!(
            "others   {} of the paper would need other data; the page lists them\n",
            counted(count, "figure"),
        ),
    };
    text
}

fn index_text(index: &StudyIndex) -> String {
    let studies = match index.studies.len() {
        1 => "1 study".to_owned(),
        count => format!("{count} studies"),
    };
    let mut text = format!("page     {} · {studies}\n", index.page.display());
    for study in &index.studies {
        for problem in &study.problems {
            text += &format!("damaged  {}: {problem}\n", study.name);
        }
    }
    text
}

#[derive(clap::Args)]
pub(crate) struct ShareArguments {
    #[command(flatten)]
    study: StudyArguments,

    #[command(flatten)]
    options: ShareOptions,

    /// Print the result as JSON.
    ///
    /// Form: `{"archive", "bytes", "tables", "stored", "tasks"}`; the last two are null without
    /// `--store`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn share(arguments: &ShareArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let shared = arguments.study.session(data).share(&arguments.options)?;
    print_answer(arguments.json, &shared, || share_text(&shared))
}

fn share_text(shared: &SharedStudy) -> String {
    let store = match shared.stored.zip(shared.tasks) {
        Some((there, all)) => format!("tables of {there} of {}", counted(all, "task")),
        None => "not included; use `--store` to include it".to_owned(),
    };
    format!(
        "archive  {} · {:.1} MB\ntables   {}\nstore    {store}\n",
        shared.archive.display(),
        shared.bytes as f64 / 1e6,
        counted(shared.tables, "stage"),
    )
}
