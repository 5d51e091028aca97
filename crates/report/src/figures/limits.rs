//! What quantities tend to where the numbers that a mesh and a cell bring with them vanish; beyond the
//! paper.

use std::collections::BTreeSet;

use arrow::array::Array;

use super::theories;
use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::{Figure, in_pairs};
use crate::charts::style::{Marker, Style};
use crate::figure::{Definition, Drawn};
use crate::figure_data::{FigureData, LOAD_LABEL};
use asperity_stages::columns::{CORRECTION, LOAD};
use asperity_stages::fit::FITTED;
use asperity_tables::table::{Table, TableError};

pub const FIGURE: Definition = Definition {
    name: "limits",
    title: "Limits of large cells, fine roughness and fine meshes",
    draw,
};

/// Secants of the area, beside which theories have something to say.
const SECANTS: [&str; 2] = ["area_corrected / load", "area_fraction / load"];
/// Charts of a figure.
const MOST: usize = 8;

/// A fitted limit under one load.
struct Limit {
    /// The quantity, and under which correction.
    of: String,
    is_secant: bool,
    /// The forms that were fitted.
    forms: String,
    point: DataPoint,
}

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut limits = Vec::new();
    for stage in data.finished.with(&["quantity", "limit", "term_1", LOAD.name]) {
        limits.extend(fitted(&stage.table)?);
    }
    if limits.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let mut quantities: Vec<&str> = limits.iter().map(|limit| limit.of.as_str()).collect();
    let mut seen = BTreeSet::new();
    quantities.retain(|of| seen.insert(*of));
    let forms: BTreeSet<&str> = limits.iter().map(|limit| limit.forms.as_str()).collect();
    let forms: Vec<&str> = forms.into_iter().collect();
    let charts = quantities.iter().take(MOST);
    let charts = charts.map(|of| chart(of, &limits, &forms));
    let charts: Vec<Chart> = charts.collect();
    let left_out = match quantities.len().saturating_sub(MOST) {
        0 => String::new(),
        count => format!(" {count} more quantities are in the table."),
    };
    let caption = format!(
        "Fitted limits under each load, one marker for each combination of forms; bars are intervals by \
         resampling of whole surfaces, and markers of one load stand beside each other. Where a term is a \
         logarithm there is no limit: the value is that at which the term vanishes. Which form the data \
         prefer is in the column akaike_weight.{left_out}",
    );
    let figure = Figure::of_charts(in_pairs(charts), [430.0, 310.0]);
    Ok(Drawn::figure(figure, caption))
}

/// The limits of a table that have been fitted.
fn fitted(table: &Table) -> Result<Vec<Limit>, TableError> {
    let column = |name: &str| table.reals(name);
    let (loads, value) = (column(LOAD.name)?, column("limit")?);
    let (lower, upper) = (column("limit_lower")?, column("limit_upper")?);
    let quantity = table.texts("quantity")?;
    let corrections = table.has(CORRECTION.name);
    let corrections = corrections.then(|| table.texts(CORRECTION.name)).transpose()?;
    let forms = forms(table)?;
    let status = table.texts("status")?;
    let is_fitted =
        |&row: &usize| value.is_valid(row) && loads.is_valid(row) && status.value(row) == FITTED;
    let limits = (0..table.rows()).filter(is_fitted).map(|row| {
        let correction = corrections.filter(|all| all.is_valid(row));
        let correction = correction.map(|all| format!(" · correction {}", all.value(row)));
        let has_interval = lower.is_valid(row) && upper.is_valid(row);
        Limit {
            of: quantity.value(row).to_owned() + &correction.unwrap_or_default(),
            is_secant: SECANTS.contains(&quantity.value(row)),
            forms: forms[row].clone(),
            point: DataPoint {
                x: loads.value(row),
                y: value.value(row),
                bar: has_interval.then(|| [lower.value(row), upper.value(row)]),
            },
        }
    });
    Ok(limits.collect())
}

/// What tells the forms of a row from those of the others: `1 / k_lower: power 2`.
fn forms(table: &Table) -> Result<Vec<String>, TableError> {
    let mut told = vec![Vec::new(); table.rows()];
    for term in (1..).take_while(|term| table.has(&format!("term_{term}"))) {
        let name = |of: &str| format!("{of}_{term}");
        let (numbers, forms) = (table.texts(&name("term"))?, table.texts(&name("form"))?);
        let word = |row: usize| match forms.is_valid(row) {
            true => forms.value(row).to_owned(),
            false => String::new(),
        };
        let words: Vec<String> = (0..table.rows()).map(word).collect();
        if words.iter().any(|word| *word != words[0]) {
            for (row, word) in words.iter().enumerate() {
                told[row].push(format!("{}: {word}", numbers.value(row)));
            }
        }
    }
    Ok(told.into_iter().map(|parts| parts.join(" · ")).collect())
}

/// The limits of one quantity against the load; of all forms of the figure, each has its marker.
fn chart(of: &str, limits: &[Limit], forms: &[&str]) -> Chart {
    let own: Vec<&Limit> = limits.iter().filter(|limit| limit.of == of).collect();
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("limit")).titled(of);
    if own.iter().any(|limit| limit.is_secant) {
        let loads = || own.iter().map(|limit| limit.point.x);
        let least = loads().fold(f64::INFINITY, f64::min);
        let range = [0.8 * least, 1.25 * loads().fold(0.0, f64::max)];
        let theories = [
            theories::persson_curve(theories::SECANT, range),
            theories::asymptote(theories::SECANT, range),
        ];
        chart.series.extend(theories);
    }
    let has = |forms: &&str| own.iter().any(|limit| limit.forms == **forms);
    let shown = forms.iter().enumerate().filter(|(_, forms)| has(forms));
    let shown: Vec<(usize, &&str)> = shown.collect();
    for (beside, (place, forms)) in shown.iter().enumerate() {
        let of_forms = own.iter().filter(|limit| limit.forms == ***forms);
        // Beside each other, or bars would lie on bars.
        let aside = 1.04_f64.powf(beside as f64 - (shown.len() - 1) as f64 / 2.0);
        let points = of_forms.map(|limit| DataPoint { x: aside * limit.point.x, ..limit.point });
        chart.series.push(Series {
            points: points.collect(),
            style: Style::marker(Colour::Series(*place), Marker::of(*place)),
            label: (!forms.is_empty()).then(|| (**forms).to_owned()),
        });
    }
    chart
}
