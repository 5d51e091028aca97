//! What the mesh adds to the area: the paper's estimate of the error, and corrected areas (figs. 12
//! and 13).

use super::theories::{self, AREA, SECANT};
use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles::Mean;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{
    AREA_LABEL, COUNTED_AREA, FigureData, LIGHT, LOAD_LABEL, series, spaced, spaced_by, up_to,
};
use asperity_stages::columns::{AREA_CORRECTED, ERROR_RELATIVE};
use asperity_stages::correct::OF_2015;

pub const RELATIVE_ERROR: Definition = Definition {
    name: "relative-error",
    title: "Relative error of the counted area, as the paper estimates it",
    draw: draw_errors,
};

pub const CORRECTED: Definition =
    Definition { name: "area-corrected", title: "Corrected contact area", draw: draw_corrected };

fn draw_errors(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut chart = Chart::new(
        Axis::linear(AREA_LABEL).within(0.0, 1.02),
        Axis::linear("relative error (π/8) S_d Δx/A"),
    );
    let mut by_load = Chart::new(
        Axis::logarithmic(LOAD_LABEL),
        Axis::logarithmic("relative error (π/8) S_d Δx/A"),
    );
    let mut surfaces = Vec::new();
    for ensemble in data.under(OF_2015) {
        let errors = ensemble.mean(ERROR_RELATIVE.name)?;
        let areas = ensemble.mean(COUNTED_AREA)?;
        let against_area: Vec<Mean> = errors
            .iter()
            .zip(&areas)
            .map(|(error, area)| Mean { load: area.mean, ..*error })
            .collect();
        let [line, markers] = data.styles.both(&ensemble.point);
        for (chart, means, apart) in [
            (&mut chart, &against_area, spaced(0.025, &against_area)),
            (&mut by_load, &errors, spaced_by(1.4, &errors)),
        ] {
            chart.series.push(series(means, line).without_bars());
            let points = series(&apart, markers);
            chart.series.push(points.named(data.label(ensemble)));
        }
        surfaces.push(ensemble.surfaces);
    }
    if surfaces.is_empty() {
        let lines = data.lines_of_corrections();
        return Ok(Drawn::missing("areas corrected by π/8", lines));
    }
    let caption = format!(
        "Half the distance of the bounds on the true area over the counted area, (π/8) S_d Δx/A, \
         against the counted area fraction and, to the right, against load; S_d is the Manhattan \
         perimeter, Δx the mesh step. Means over {}; bars are {}.",
        sample(&surfaces),
        data.bars,
    );
    Ok(Drawn::figure(Figure::of_two(chart, by_load), caption))
}

fn draw_corrected(data: &FigureData) -> Result<Drawn, ReportError> {
    let corrections = data.corrections();
    if corrections.is_empty() {
        let lines = data.lines_of_corrections();
        return Ok(Drawn::missing("areas under a correction other than \"none\"", lines));
    }
    let rows =
        corrections.iter().take(2).filter_map(|correction| charts(data, correction).transpose());
    let rows = rows.collect::<Result<Vec<_>, ReportError>>()?;
    if rows.is_empty() {
        let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
        return Ok(Drawn::missing("corrected areas under at least two loads up to 0.06", lines));
    }
    let surfaces: Vec<usize> = data.under(corrections[0]).map(|one| one.surfaces).collect();
    let caption = format!(
        "Corrected contact area (points at some of the loads; bars are {}) beside the \
         counted one (lines of the same colour) and, to the right, the secants of both, from {}; \
         corrections: {}.{}",
        data.bars,
        sample(&surfaces),
        corrections.iter().take(2).copied().collect::<Vec<_>>().join(", "),
        data.caveat,
    );
    Ok(Drawn::figure(Figure::of_charts(rows, [430.0, 320.0]), caption))
}

/// Area and secant under one correction, light loads only; nothing where there is no curve.
fn charts(data: &FigureData, correction: &str) -> Result<Option<Vec<Chart>>, ReportError> {
    let axis = Axis::linear(LOAD_LABEL).within(0.0, 1.05 * LIGHT);
    let title = format!("correction {correction}");
    let mut area = Chart::new(axis.clone(), Axis::linear(AREA_LABEL)).titled(title.clone());
    let mut secant = Chart::new(axis, Axis::linear("secant A/(A₀ y)")).titled(title);
    for ensemble in data.under(correction) {
        let corrected = up_to(LIGHT, ensemble.mean(AREA_CORRECTED.name)?);
        let counted = up_to(LIGHT, ensemble.mean(COUNTED_AREA)?);
        let markers = data.styles.markers(&ensemble.point);
        let line = data.styles.joins(&ensemble.point);
        let label = data.label(ensemble);
        area.series.push(series(&counted, line).without_bars());
        let corrected = spaced(LIGHT / 20.0, &corrected);
        area.series.push(series(&corrected, markers).named(label));
        secant.series.push(series(&secants(&counted), line).without_bars());
        secant.series.push(series(&secants(&corrected), markers));
    }
    if area.series.iter().all(|series| series.points.len() < 2) {
        return Ok(None);
    }
    let range = [LIGHT * 1e-3, LIGHT];
    let counted = Style::line(Colour::Text, Dash::Solid, 1.0);
    area.series.push(Series::new([], counted).named("lines: as counted on the mesh"));
    for (chart, quantity) in [(&mut area, AREA), (&mut secant, SECANT)] {
        chart.series.push(theories::persson_curve(quantity, range));
        chart.series.push(theories::asymptote(quantity, range));
    }
    Ok(Some(vec![area, secant]))
}

fn secants(means: &[Mean]) -> Vec<Mean> {
    means.iter().map(Mean::secant).collect()
}
