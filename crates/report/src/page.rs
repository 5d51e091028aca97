//! The page in one self-contained file: summary, figures, tables, missing figures and provenance.

mod summary;

use std::path::Path;

use arrow::datatypes::Field;
use base64::prelude::{BASE64_STANDARD, Engine};
use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use serde::Serialize;

use crate::charts::svg::escaped;
use crate::charts::text::with_html_subscripts;
use crate::charts::{self, style};
use crate::figure_data::FigureData;
use crate::figures::{DrawnFigure, Group};
use crate::finished::FinishedStage;
use crate::integrity::Basis;
use crate::page::summary::summary;
use crate::{MissingFigure, Subject};
use asperity_pipeline::forecast;
use asperity_stages::Recipe;
use asperity_stages::units::TableUnits;
use asperity_tables::cells::cells;
use asperity_tables::column::Description;
use asperity_tables::store::files::from_folder;

/// Parts of the page in their order: the answer first.
const TEMPLATE: &str = concat!(
    include_str!("page/head.html"),
    include_str!("page/summary.html"),
    include_str!("page/figures.html"),
    include_str!("page/tables.html"),
    include_str!("page/provenance.html"),
);
pub const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = include_str!("page/script.js");

/// Note on the figures of the paper.
const NOTATION: &str = "p₀ is the mean pressure, h′ the rms slope, E* the effective modulus. \
                        Dimensionless results for elastic contact depend only on the load y = \
                        p₀/(E* h′).";
/// Largest number of rows of a table on the page.
const ROWS: usize = 100;

#[derive(Debug, Clone, Serialize)]
struct ShownColumn {
    name: String,
    /// Meaning of the values, with their unit.
    meaning: String,
    numeric: bool,
}

impl ShownColumn {
    fn new(field: &Field, units: &TableUnits) -> ShownColumn {
        let description = Description::in_units(field);
        let in_brackets = |unit: String| format!(" [{unit}]");
        let unit = match description.unit.as_str() {
            "" | "1" => String::new(),
            unit => in_brackets(units.name(unit)),
        };
        let shown = units.shown_of(field).map(in_brackets).unwrap_or_default();
        ShownColumn {
            name: format!("{}{shown}", description.name),
            meaning: format!("{}{unit}", description.explained()),
            numeric: matches!(description.kind, "real" | "integer"),
        }
    }
}

/// Returns the page as HTML, with links relative to `folder`.
pub fn html(
    subject: &Subject,
    data: &FigureData,
    figures: &[DrawnFigure],
    missing: &[MissingFigure],
    basis: &Basis,
    folder: &Path,
) -> String {
    let plan = subject.plan;
    let all = &subject.study.stages;
    let planned = plan.stages.iter().zip(subject.rows);
    let stages = all.iter().zip(planned).map(|(stage, (planned, rows))| {
        let inputs = stage.inputs.iter().map(|&input| all[input].name.clone());
        context! {
            name => stage.name.as_str(),
            kind => planned.kind.name(),
            version => planned.kind.version(),
            inputs => inputs.collect::<Vec<_>>(),
            finished => rows.tasks.len(),
            planned => planned.tasks.len(),
            rows => rows.table.as_ref().map_or(0, |table| table.rows()),
            digest => if rows.table.is_some() { &rows.digest } else { "–" },
        }
    });
    let tables = data.finished.stages.iter().map(|stage| shown(stage, subject, folder));
    let warnings = subject.warnings.iter().map(ToString::to_string);
    let [light, dark] = style::declarations();
    let contents = context! {
        study => plan.study.as_str(),
        description => subject.study.manifest.description.clone(),
        version => env!("CARGO_PKG_VERSION"),
        machine => machine(),
        summary => summary(subject, data),
        warnings => warnings.collect::<Vec<_>>(),
        sections => sections(figures),
        stages => stages.collect::<Vec<_>>(),
        manifest => subject.study.manifest.text.as_str(),
        missing => Serde(missing),
        // Figures of the paper leave out contacts with adhesion.
        has_adhesion => plan.tasks.iter().any(|task| matches!(task.recipe, Recipe::Adhesion(_))),
        tables => tables.collect::<Vec<_>>(),
        basis => basis.json(),
        style => STYLE,
        script => SCRIPT,
        light,
        dark,
        font => BASE64_STANDARD.encode(charts::FONT),
    };
    let page = environment().render_named_str("page.html", TEMPLATE, contents);
    page.expect("the template only uses these contents")
}

/// Returns the environment of templates, with filters for texts that mark code by backticks: `code`
/// writes it as HTML, `plain` removes the backticks. `symbols` writes subscripts.
pub fn environment() -> Environment<'static> {
    let mut environment = Environment::new();
    environment.add_filter("code", |text: &str| Value::from_safe_string(with_code(text)));
    environment.add_filter("symbols", |text: &str| {
        Value::from_safe_string(with_html_subscripts(&escaped(text)))
    });
    environment.add_filter("plain", |text: &str| text.replace('`', ""));
    environment
}

/// Escapes a text for HTML, marks its parts in backticks as code, and writes subscripts elsewhere.
fn with_code(text: &str) -> String {
    let mut written = String::new();
    for (index, part) in escaped(text).split('`').enumerate() {
        let is_code = index % 2 == 1;
        written += &match is_code {
            true => format!("<code>{part}</code>"),
            false => with_html_subscripts(part),
        };
    }
    written
}

/// Sorts the figures into sections, in the order of the page.
fn sections(figures: &[DrawnFigure]) -> Vec<Value> {
    let all = [
        (Group::Declared, "declared", "Figures of the manifest", None),
        (Group::Automatic, "results", "Results against the varied parameters", None),
        (Group::Paper, "paper", "Comparison with theories", Some(NOTATION)),
        (Group::Maps, "maps", "Maps", None),
    ];
    let sections = all.into_iter().filter_map(|(group, id, title, note)| {
        let own: Vec<_> = figures.iter().filter(|figure| figure.group == group).collect();
        (!own.is_empty()).then(|| context! { id, title, note, figures => Serde(own) })
    });
    sections.collect()
}

/// Returns a table as the page shows it.
fn shown(stage: &FinishedStage, subject: &Subject, folder: &Path) -> Value {
    let FinishedStage { name, kind, units, path, .. } = stage;
    // The rows as they are published, not in the units that figures share.
    let published = subject.rows.iter().find(|rows| rows.stage == *name);
    let table = published.and_then(|rows| rows.table.as_ref()).unwrap_or(&stage.table);
    let units = TableUnits::from_table(table).or(units);
    let shown = table.rows().min(ROWS);
    let fields = table.batch().schema_ref().fields();
    let columns = fields.iter().map(|field| ShownColumn::new(field, &units));
    let by_column: Vec<Vec<String>> =
        table.batch().columns().iter().map(|column| cells(column.as_ref(), shown)).collect();
    let row = |row: usize| by_column.iter().map(|column| column[row].clone()).collect();
    let file = path.as_ref().map(|path| {
        context! {
            name => format!("{name}.parquet"),
            path => path.display().to_string(),
            // Relative to the page.
            link => from_folder(path, folder).display().to_string(),
        }
    });
    context! {
        stage => name.as_str(),
        kind => kind.name(),
        rows => table.rows(),
        shown,
        file,
        columns => Serde(columns.collect::<Vec<_>>()),
        cells => (0..shown).map(row).collect::<Vec<Vec<String>>>(),
    }
}

/// Returns the processor, the number of cores and the operating system.
fn machine() -> String {
    let model = forecast::processor();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let plural = if cores == 1 { "" } else { "s" };
    format!("{model}, {cores} core{plural}, {}", std::env::consts::OS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_is_marked_and_everything_is_escaped() {
        assert_eq!(
            with_code("set `a < 1`, or \"b\""),
            "set <code>a &lt; 1</code>, or &quot;b&quot;"
        );
        assert_eq!(with_code("a & b"), "a &amp; b");
        assert_eq!(with_code("h_c of `h_c`"), "h<sub>c</sub> of <code>h_c</code>");
    }
}
