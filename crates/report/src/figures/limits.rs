//! Quantities in the limits of large cells and fine meshes, which the paper does not show.

use std::collections::BTreeSet;

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{self, Colour, Dash, Style};
use crate::charts::{Figure, in_pairs};
use crate::figure_data::{FigureData, interval};
use crate::figures::{Definition, Drawn};
use crate::loads::LOAD_LABEL;
use asperity_contact::theory::law::KAPPA_BGT;
use asperity_contact::theory::persson;
use asperity_stages::columns::{CORRECTION, LOAD};
use asperity_stages::fit::FITTED;
use asperity_tables::table::{Table, TableError};

pub const LIMITS: Definition = Definition {
    name: "limits",
    title: "Limits of large cells, fine roughness and fine meshes",
    draw: draw_limits,
};

/// Quantities that are secants of the area, for which theories are drawn.
const SECANTS: [&str; 2] = ["area_corrected / load", "area_fraction / load"];
/// Largest number of charts of the figure.
const MOST: usize = 8;

/// A fitted limit at one load.
struct Limit {
    /// Fitted quantity, followed by the correction of the area.
    of: String,
    is_secant: bool,
    /// Functional forms of the terms of the fit, such as `1 / k_lower: power 2`. Only terms whose
    /// form differs between rows are listed.
    forms: String,
    point: DataPoint,
}

fn draw_limits(data: &FigureData) -> Result<Drawn, ReportError> {
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
        "Fitted limits at each load, with one marker for each combination of the forms of the \
         terms. Bars are intervals from resampling whole surfaces; markers of the same load are \
         shifted sideways. A logarithmic term has no limit, so the marker shows the value at which \
         this term vanishes. The column akaike_weight shows which forms the data prefer.{left_out}",
    );
    let figure = Figure::from_charts(in_pairs(charts), [430.0, 310.0]);
    Ok(Drawn::figure(figure, caption))
}

/// Returns the limits of a table for which the fit succeeded.
fn fitted(table: &Table) -> Result<Vec<Limit>, TableError> {
    let column = |name: &str| table.reals(name);
    let (loads, value) = (column(LOAD.name)?, column("limit")?);
    let (lower, upper) = (column("limit_lower")?, column("limit_upper")?);
    let quantity = table.texts("quantity")?;
    let has_corrections = table.has(CORRECTION.name);
    let corrections = has_corrections.then(|| table.texts(CORRECTION.name)).transpose()?;
    let forms = forms(table)?;
    let status = table.texts("status")?;
    let is_fitted = |&row: &usize| {
        value.is_valid(row) && loads.is_valid(row) && status.value(row) == FITTED.word
    };
    let limits = (0..table.rows()).filter(is_fitted).map(|row| {
        let correction = corrections.filter(|all| all.is_valid(row));
        let correction = correction.map(|all| format!(" · correction {}", all.value(row)));
        Limit {
            of: quantity.value(row).to_owned() + &correction.unwrap_or_default(),
            is_secant: SECANTS.contains(&quantity.value(row)),
            forms: forms[row].clone(),
            point: DataPoint {
                x: loads.value(row),
                y: value.value(row),
                bar: interval(lower, upper, row),
            },
        }
    });
    Ok(limits.collect())
}

/// Returns the text of [`Limit::forms`] for each row of a table of fits.
fn forms(table: &Table) -> Result<Vec<String>, TableError> {
    let mut texts = vec![Vec::new(); table.rows()];
    for term in (1..).take_while(|term| table.has(&format!("term_{term}"))) {
        let name = |of: &str| format!("{of}_{term}");
        let (numbers, forms) = (table.texts(&name("term"))?, table.texts(&name("form"))?);
        let word = |row: usize| {
            if forms.is_valid(row) { forms.value(row).to_owned() } else { String::new() }
        };
        let words: Vec<String> = (0..table.rows()).map(word).collect();
        if words.iter().any(|word| *word != words[0]) {
            for (row, word) in words.iter().enumerate() {
                texts[row].push(format!("{}: {word}", numbers.value(row)));
            }
        }
    }
    Ok(texts.into_iter().map(|parts| parts.join(" · ")).collect())
}

/// Returns the chart of the limit of the quantity `of` against the load, with one marker for each
/// combination of forms of the terms.
fn chart(of: &str, limits: &[Limit], forms: &[&str]) -> Chart {
    let own: Vec<&Limit> = limits.iter().filter(|limit| limit.of == of).collect();
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("limit")).titled(of);
    if own.iter().any(|limit| limit.is_secant) {
        let loads = || own.iter().map(|limit| limit.point.x);
        let least = loads().fold(f64::INFINITY, f64::min);
        let range = [0.8 * least, 1.25 * loads().fold(0.0, f64::max)];
        let curve = |of: fn(f64) -> f64, dash| {
            Series::curve(of, range, Spacing::Logarithmic, Style::line(Colour::Text, dash, 1.8))
        };
        let persson = curve(|load| persson::area(load) / load, Dash::Dashed);
        chart.series.push(persson.named("Persson 2001"));
        let asymptote = curve(|_| KAPPA_BGT, Dash::Dotted);
        chart.series.push(asymptote.named("asymptote √(2π) y of BGT"));
    }
    let has = |forms: &&str| own.iter().any(|limit| limit.forms == **forms);
    let shown = forms.iter().enumerate().filter(|(_, forms)| has(forms));
    let shown: Vec<(usize, &&str)> = shown.collect();
    for (beside, (index, forms)) in shown.iter().enumerate() {
        let of_forms = own.iter().filter(|limit| limit.forms == ***forms);
        // Shift markers sideways, so bars do not overlap.
        let aside = 1.04_f64.powf(beside as f64 - (shown.len() - 1) as f64 / 2.0);
        let points = of_forms.map(|limit| DataPoint { x: aside * limit.point.x, ..limit.point });
        chart.series.push(Series {
            points: points.collect(),
            style: Style::marker(Colour::Series(*index), style::marker(*index)),
            label: (!forms.is_empty()).then(|| (**forms).to_owned()),
        });
    }
    chart
}
