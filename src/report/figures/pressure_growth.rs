//! Growth of the mean contact pressure with the load (fig. C.1).

use crate::figures::axis::{Axis, Spacing};
use crate::figures::chart::{Chart, Series};
use crate::figures::ink::Ink;
use crate::figures::sheet::Sheet;
use crate::figures::style::{Dash, Style};
use crate::report::ReportError;
use crate::report::evidence::{AREA_LABEL, COUNTED, Evidence};
use crate::report::figure::{Definition, Drawn, sample};

pub const FIGURE: Definition = Definition {
    name: "pressure-growth",
    title: "Growth of the mean contact pressure",
    draw,
};

/// The exponents that the paper draws.
const GUIDES: [(f64, Ink, Dash); 2] = [
    (-0.7, Ink::Text, Dash::Dashed),
    (-0.9, Ink::Soft, Dash::DashDot),
];

fn draw(evidence: &Evidence) -> Result<Drawn, ReportError> {
    let mut chart = Chart::new(
        Axis::logarithmic(AREA_LABEL),
        Axis::logarithmic("dp̄/dp₀, with p̄ = p₀ A₀/A"),
    );
    for ensemble in &evidence.measured {
        let style = evidence.looks.markers(&ensemble.point);
        let label = evidence.label(ensemble);
        let growth = ensemble.pressure_growth(COUNTED)?;
        chart.series.push(Series::new(growth, style).named(label));
    }
    let points = || chart.series.iter().flat_map(|series| &series.points);
    let shown = || points().filter(|point| point.x < 0.5 && point.y > 0.0);
    if shown().count() < 3 {
        let lines = evidence.lines_of_loads("{ to = 0.06, steps = 50 }");
        return Ok(Drawn::missing(
            "measured contacts under several light loads",
            lines,
        ));
    }
    // Guides pass above the data: through the largest growth at the geometric middle of the areas.
    let bounds =
        |of: fn(f64, f64) -> f64, start| shown().fold(start, |end, point| of(end, point.x));
    let (least, most) = (bounds(f64::min, f64::INFINITY), bounds(f64::max, 0.0));
    let middle = (least * most).sqrt();
    let near = |x: f64| (x / middle).ln().abs() < 0.4;
    let top = shown()
        .filter(|point| near(point.x))
        .fold(0.0, |top: f64, point| top.max(point.y));
    let top = 1.8 * if top > 0.0 { top } else { 1.0 };
    for (exponent, ink, dash) in GUIDES {
        let guide = |area: f64| top * (area / middle).powf(exponent);
        let range = [middle / 4.0, 4.0 * middle];
        let guide = Series::curve(
            guide,
            range,
            Spacing::Logarithmic,
            Style::line(ink, dash, 1.8),
        );
        chart
            .series
            .push(guide.named(format!("exponent {exponent}").replace('-', "−")));
    }
    let caption = format!(
        "Derivative of the mean contact pressure p̄ with respect to the mean pressure p₀, by \
         differences of the mean curves, against the area fraction; from {}, area as counted on \
         the mesh. Straight lines are guides. A decrease of p̄ between two loads has no logarithm \
         and is left out.",
        sample(&evidence.sample()),
    );
    Ok(Drawn::figure(Sheet::of(chart), caption))
}
