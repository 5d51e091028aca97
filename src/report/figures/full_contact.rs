//! Area from zero to full contact, and its slope (fig. 9).

use super::contact_maps::SHOWN_LOADS;
use super::theories::{self, AREA};
use crate::contact::persson;
use crate::figures::axis::{Axis, Spacing};
use crate::figures::chart::{Chart, Point, Series};
use crate::figures::ink::Ink;
use crate::figures::sheet::Sheet;
use crate::figures::style::{Dash, Style};
use crate::report::ReportError;
use crate::report::evidence::{AREA_LABEL, COUNTED, Evidence, LIGHT, LOAD_LABEL, series, spaced};
use crate::report::figure::{Definition, Drawn, sample};

pub const FIGURE: Definition = Definition {
    name: "area-full",
    title: "Contact area from first touch to full contact",
    draw,
};

/// Curves that end before this load leave no room for an inset below them.
const INSET_FROM: f64 = 1.0;

fn draw(evidence: &Evidence) -> Result<Drawn, ReportError> {
    let mut chart = Chart::new(
        Axis::linear(LOAD_LABEL),
        Axis::linear(AREA_LABEL).within(0.0, 1.04),
    );
    let mut slopes = Chart::new(Axis::linear("load"), Axis::linear("slope d(A/A₀)/dy"));
    let mut heaviest = 0.0_f64;
    for ensemble in &evidence.measured {
        let means = ensemble.mean(COUNTED)?;
        let last = means.last().map_or(0.0, |mean| mean.load);
        heaviest = heaviest.max(last);
        let markers = spaced(0.04 * last, &means);
        let line = evidence.looks.joins(&ensemble.point);
        chart.series.push(series(&means, line).without_bars());
        chart.series.push(evidence.points(ensemble, &markers));
        let points = ensemble.slope(COUNTED)?;
        let points = points.iter().map(|slope| Point {
            x: slope.load,
            y: slope.slope,
            bar: None,
        });
        slopes.series.push(Series {
            points: points.collect(),
            style: evidence.looks.line(&ensemble.point),
            label: None,
        });
    }
    if heaviest < 5.0 * LIGHT {
        let lines = evidence
            .lines_of_loads("{ from = 0.06, to = 1.7, steps = 40, spacing = \"geometric\" }");
        return Ok(Drawn::missing(
            "measured contacts under loads towards full contact",
            lines,
        ));
    }
    let range = [0.0, heaviest];
    chart.x = chart.x.within(0.0, 1.03 * heaviest);
    chart.series.push(theories::persson_curve(AREA, range));
    chart
        .series
        .push(theories::asymptote(AREA, [0.0, 0.4_f64.min(heaviest)]));
    let style = Style::line(Ink::Text, Dash::Dashed, 1.8);
    let persson = Series::curve(persson::slope, range, Spacing::Linear, style);
    slopes.series.push(persson);
    for (letter, load) in ('a'..).zip(SHOWN_LOADS) {
        if load < heaviest {
            let line = Style::line(Ink::Soft, Dash::Dotted, 0.8);
            chart
                .series
                .push(Series::new([(load, 0.0), (load, 1.04)], line));
            // Beside its line: the first one stands at the axis.
            let beside = load + 0.012 * heaviest;
            chart.notes.push((beside, 0.95, letter.to_string()));
        }
    }
    let (sheet, place) = match heaviest < INSET_FROM {
        true => {
            let charts = vec![vec![chart, slopes]];
            (Sheet::of_charts(charts, [430.0, 320.0]), "To the right")
        }
        false => {
            let chart = chart.with_inset(slopes, [0.46, 0.40, 0.51, 0.44]);
            (Sheet::of(chart), "In the inset")
        }
    };
    let caption = format!(
        "Contact area fraction against load up to the first surface in full contact, from {}; \
         area as counted on the mesh. {place} the slope of the mean curves. The dashed line is \
         Persson's theory, the dotted one the asymptote of the model of Bush, Gibson & Thomas; \
         letters mark the loads near which contact maps are shown.",
        sample(&evidence.sample()),
    );
    Ok(Drawn::figure(sheet, caption))
}
