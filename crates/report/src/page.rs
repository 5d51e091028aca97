//! The page in one self-contained file: figures, missing figures, tables and provenance.

use std::collections::BTreeSet;
use std::path::Path;

use arrow::datatypes::DataType;
use base64::prelude::{BASE64_STANDARD, Engine};
use minijinja::Environment;
use minijinja::value::Serde;
use serde::Serialize;

use crate::Subject;
use crate::charts::{style, svg};
use crate::earlier::Basis;
use crate::figure_data::{FinishedStage, FinishedStages};
use crate::figures::{DrawnFigure, MissingFigure};
use asperity_pipeline::forecast;
use asperity_stages::columns::STOP;
use asperity_stages::solve::PAIR_LIMIT;
use asperity_tables::cells::cells;
use asperity_tables::column::Description;
use asperity_tables::store::files::from_folder;

const TEMPLATE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");

/// Largest number of rows of a table on the page.
const ROWS: usize = 100;

/// Values that the template inserts.
#[derive(Serialize)]
struct Contents<'a> {
    study: &'a str,
    version: &'static str,
    machine: String,
    completeness: String,
    /// Number of loads that were solved.
    loads: usize,
    /// Number of solved loads that did not converge.
    unconverged: usize,
    warnings: Vec<String>,
    stages: Vec<StageOrigin<'a>>,
    manifest: &'a str,
    figures: &'a [DrawnFigure],
    missing: &'a [MissingFigure],
    tables: Vec<ShownTable<'a>>,
    basis: String,
    style: &'static str,
    script: &'static str,
    light: String,
    dark: String,
    font: String,
}

/// Row of the provenance table: a stage, with the numbers of tasks.
#[derive(Serialize)]
struct StageOrigin<'a> {
    name: &'a str,
    kind: &'static str,
    version: u32,
    finished: usize,
    planned: usize,
    digest: &'a str,
}

#[derive(Serialize)]
struct ShownTable<'a> {
    stage: &'a str,
    kind: &'static str,
    rows: usize,
    shown: usize,
    file: Option<ShownFile>,
    columns: Vec<ShownColumn>,
    cells: Vec<Vec<String>>,
}

#[derive(Serialize)]
struct ShownFile {
    name: String,
    path: String,
    /// Path relative to the page.
    link: String,
}

#[derive(Serialize)]
struct ShownColumn {
    name: String,
    meaning: String,
    numeric: bool,
}

/// Returns the page as HTML, with links relative to `folder`.
pub fn html(
    subject: &Subject,
    finished: &FinishedStages,
    figures: &[DrawnFigure],
    missing: &[MissingFigure],
    basis: &Basis,
    folder: &Path,
) -> String {
    let plan = subject.plan;
    let stages = plan.stages.iter().zip(subject.rows).map(|(stage, rows)| StageOrigin {
        name: &stage.name,
        kind: stage.kind.name(),
        version: stage.kind.version(),
        finished: rows.tasks.len(),
        planned: stage.tasks.len(),
        digest: if rows.table.is_some() { &rows.digest } else { "–" },
    });
    let (loads, unconverged) = converged(finished);
    let [light, dark] = style::declarations();
    let contents = Contents {
        study: &plan.study,
        version: env!("CARGO_PKG_VERSION"),
        machine: machine(),
        completeness: completeness(subject),
        loads,
        unconverged,
        warnings: subject.warnings.iter().map(ToString::to_string).collect(),
        stages: stages.collect(),
        manifest: subject.manifest,
        figures,
        missing,
        tables: finished.stages.iter().map(|stage| shown(stage, folder)).collect(),
        basis: basis.json(),
        style: STYLE,
        script: SCRIPT,
        light,
        dark,
        font: BASE64_STANDARD.encode(svg::FONT),
    };
    let page = Environment::new().render_named_str("page.html", TEMPLATE, Serde(&contents));
    page.expect("the template only uses these contents")
}

fn shown<'a>(stage: &'a FinishedStage, folder: &Path) -> ShownTable<'a> {
    let FinishedStage { name, kind, table, path, .. } = stage;
    let shown = table.rows().min(ROWS);
    let fields = table.batch().schema_ref().fields();
    let columns = fields.iter().map(|field| {
        let description = Description::from(field.as_ref());
        let unit = match description.unit.as_str() {
            "" | "1" => String::new(),
            unit => format!(" [{unit}]"),
        };
        ShownColumn {
            name: field.name().clone(),
            meaning: format!("{}{unit}", description.explained()),
            numeric: matches!(field.data_type(), DataType::Float64 | DataType::Int64),
        }
    });
    let by_column: Vec<Vec<String>> =
        table.batch().columns().iter().map(|column| cells(column.as_ref(), shown)).collect();
    let row = |row: usize| by_column.iter().map(|column| column[row].clone()).collect();
    ShownTable {
        stage: name,
        kind: kind.name(),
        rows: table.rows(),
        shown,
        file: path.as_ref().map(|path| ShownFile {
            name: format!("{name}.parquet"),
            path: path.display().to_string(),
            link: from_folder(path, folder).display().to_string(),
        }),
        columns: columns.collect(),
        cells: (0..shown).map(row).collect(),
    }
}

fn completeness(subject: &Subject) -> String {
    let planned = subject.plan.tasks.len();
    let done: BTreeSet<usize> = subject.rows.iter().flat_map(|rows| rows.tasks.clone()).collect();
    let done = done.len();
    if done == planned {
        format!("complete: all {planned} tasks are done")
    } else {
        format!("unfinished: {done} of {planned} tasks are done; the figures show their results")
    }
}

/// Returns (number of solved loads, number of these that did not converge).
fn converged(finished: &FinishedStages) -> (usize, usize) {
    let solved = finished.with(&["pairs", STOP.name]);
    let stops = solved.filter_map(|stage| stage.table.texts(STOP.name).ok());
    stops.fold((0, 0), |(loads, unconverged), stops| {
        let given_up = stops.iter().filter(|stop| *stop == Some(PAIR_LIMIT)).count();
        (loads + stops.iter().len(), unconverged + given_up)
    })
}

/// Returns the processor, the number of cores and the operating system.
fn machine() -> String {
    let model = forecast::processor();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let plural = if cores == 1 { "" } else { "s" };
    format!("{model}, {cores} core{plural}, {}", std::env::consts::OS)
}
