//! Errors of the mean contact areas: sampling, mesh and cell, each with its interval.

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style, marker};
use crate::charts::{Figure, Panel, in_rows};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn};
use crate::finished::FinishedStage;
use crate::loads::LOAD_LABEL;
use crate::points::as_named;
use asperity_stages::Kind;
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, COEFFICIENT, K_LOWER, K_UPPER, LOAD, NODES,
};
use asperity_stages::error_budget::{ErrorBudget, Term, budgets, number};

pub const ERRORS: Definition =
    Definition { name: "errors", title: "Errors of the mean contact area", draw };

/// Largest number of panels.
const MOST: usize = 9;
/// Terms with the distance of their bars from the load, as a factor, so that bars do not overlap.
const TERMS: [(Term, f64); 3] =
    [(Term::Sampling, 1.0), (Term::Mesh, 1.06), (Term::Cell, 1.0 / 1.06)];

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let areas = |kind: Kind, column: &'static str| {
        let has_areas = |stage: &&FinishedStage| {
            stage.kind == kind && stage.table.has(LOAD.name) && stage.table.has(column)
        };
        let stage = data.finished.stages.iter().rfind(has_areas);
        stage.map(|stage| (stage, column))
    };
    let corrected = areas(Kind::Correct, AREA_CORRECTED.name);
    let Some((stage, column)) = corrected.or_else(|| areas(Kind::Measure, AREA_FRACTION.name))
    else {
        return Ok(Drawn::NotAsked);
    };
    let is_multilevel = data.finished.plan.tasks.iter().any(|task| task.recipe.is_multilevel());
    let mut found = budgets(&stage.table, column, is_multilevel)?;
    let is_corrected = |budget: &ErrorBudget| number(&budget.point, COEFFICIENT.name) != Some(0.0);
    if found.iter().any(is_corrected) {
        found.retain(is_corrected);
    }
    found.retain(|budget| {
        let known = |term| budget.loads.iter().any(|load| load.error(term).is_some());
        known(Term::Mesh) || known(Term::Cell)
    });
    if found.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let all = found.len();
    found.truncate(MOST);
    let panels = found.iter().map(|budget| Panel::Chart(Box::new(chart(data, budget))));
    let rows = in_rows(found.len().min(3), panels.collect());
    let size = if found.len() == 1 { [600.0, 410.0] } else { [330.0, 280.0] };
    let omitted = if all > MOST {
        format!(" {} further parameter points are not shown.", all - MOST)
    } else {
        String::new()
    };
    let caption = format!(
        "Errors of the mean of `{column}` of stage `{}` in per cent of the mean, with 95 % \
         intervals. Sampling scatters around zero; above zero, mesh and cell make the mean too \
         large. Bars are shifted along the loads. `asperity errors` prints the numbers and what \
         halving them costs.{omitted}",
        stage.name,
    );
    Ok(Drawn::figure(Figure::from_panels(rows, size), caption))
}

fn chart(data: &FigureData, budget: &ErrorBudget) -> Chart {
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("error of the mean, %"));
    let whole = |name: &str| number(&budget.point, name).map(|own| format!("{name} {own}"));
    let names = [K_LOWER.name, K_UPPER.name, NODES.name].into_iter().filter_map(whole);
    chart.title = match data.styles.label(&as_named(&budget.point)) {
        Some(label) => label,
        None => names.collect::<Vec<_>>().join(", "),
    };
    for (index, (term, shift)) in TERMS.into_iter().enumerate() {
        let points = budget.loads.iter().filter_map(|load| {
            let (value, interval) = load.error(term)?;
            let percent = |error: f64| 100.0 * error / load.mean.value.abs();
            Some(DataPoint {
                x: shift * load.load.reduced,
                y: percent(value),
                bar: Some(interval.map(percent)),
            })
        });
        let style = Style::marker(Colour::Series(index), marker(index));
        let series = Series { points: points.collect(), ..Series::new([], style) };
        if !series.points.is_empty() {
            chart.series.push(series.named(term.name()));
        }
    }
    let loads = budget.loads.iter().map(|load| (load.load.reduced, 0.0));
    chart.series.push(Series::new(loads, Style::line(Colour::Muted, Dash::Dotted, 1.0)));
    chart
}
