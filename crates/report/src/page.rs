//! The page: figures, what is missing, tables, provenance, in one file that needs no other.

use std::path::Path;

use arrow::datatypes::DataType;
use base64::prelude::{BASE64_STANDARD, Engine};
use minijinja::Environment;
use minijinja::value::Serde;
use serde::Serialize;

use super::basis::Basis;
use super::figure::{DrawnFigure, MissingFigure};
use super::provenance::PageProvenance;
use super::tables::{FinishedStage, FinishedStages};
use crate::charts::{colour, pixels};
use asperity_tables::cells::cells;
use asperity_tables::store::files::from_folder;

const TEMPLATE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");

/// Rows of a table that the page holds; its file holds all.
const ROWS: usize = 100;

/// What the template asks for.
#[derive(Serialize)]
struct Contents<'a> {
    figures: &'a [DrawnFigure],
    missing: &'a [MissingFigure],
    tables: Vec<ShownTable<'a>>,
    basis: String,
    #[serde(flatten)]
    provenance: &'a PageProvenance,
    style: &'static str,
    script: &'static str,
    light: String,
    dark: String,
    font: String,
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
    /// Where it is for somebody on the page.
    link: String,
}

#[derive(Serialize)]
struct ShownColumn {
    name: String,
    meaning: String,
    numeric: bool,
}

/// The page as HTML, for a folder.
pub fn html(
    figures: &[DrawnFigure],
    missing: &[MissingFigure],
    finished: &FinishedStages,
    basis: &Basis,
    provenance: &PageProvenance,
    folder: &Path,
) -> String {
    let mut environment = Environment::new();
    environment.add_template("page.html", TEMPLATE).expect("the template is part of the program");
    let page = environment.get_template("page.html");
    let page = page.expect("it has just been added");
    let contents = Contents {
        figures,
        missing,
        tables: finished.stages.iter().map(|stage| shown(stage, folder)).collect(),
        basis: basis.json(),
        provenance,
        style: STYLE,
        script: SCRIPT,
        light: colour::light(),
        dark: colour::dark(),
        font: BASE64_STANDARD.encode(pixels::FONT),
    };
    page.render(Serde(&contents)).expect("the template asks for nothing else")
}

fn shown<'a>(stage: &'a FinishedStage, folder: &Path) -> ShownTable<'a> {
    let FinishedStage { name, kind, table, path, .. } = stage;
    let shown = table.rows().min(ROWS);
    let fields = table.batch().schema_ref().fields();
    let columns = fields.iter().map(|field| {
        let about = |entry: &str| field.metadata().get(entry).map_or("", String::as_str);
        let unit = match about("unit") {
            "" | "1" => String::new(),
            unit => format!(" [{unit}]"),
        };
        ShownColumn {
            name: field.name().clone(),
            meaning: format!("{}{unit}", about("meaning")),
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
