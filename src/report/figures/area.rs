//! Area under light load beside the theories, and its secant (fig. 5 of the paper).

use super::theories::{self, AREA, SECANT};
use crate::figures::axis::Axis;
use crate::figures::chart::Chart;
use crate::figures::sheet::Sheet;
use crate::report::ReportError;
use crate::report::ensembles::Mean;
use crate::report::evidence::{AREA_LABEL, COUNTED, Evidence, LIGHT, LOAD_LABEL, series, up_to};
use crate::report::figure::{Definition, Drawn, sample};

pub const FIGURE: Definition = Definition {
    name: "area-light",
    title: "Contact area under light load",
    draw,
};

/// Lighter loads touch so few nodes that their secants would fill the chart.
const SECANT_FROM: f64 = LIGHT / 20.0;

fn draw(evidence: &Evidence) -> Result<Drawn, ReportError> {
    let axis = Axis::linear(LOAD_LABEL).within(0.0, 1.05 * LIGHT);
    let mut chart = Chart::new(axis.clone(), Axis::linear(AREA_LABEL));
    let mut secants = Chart::new(axis, Axis::linear("secant A/(A₀ y)"));
    for ensemble in &evidence.measured {
        let means = up_to(LIGHT, ensemble.mean(COUNTED)?);
        let seen = means.iter().filter(|mean| mean.load >= SECANT_FROM);
        let secant: Vec<Mean> = seen.map(Mean::secant).collect();
        let style = evidence.looks.markers(&ensemble.point);
        secants.series.push(series(&secant, style));
        chart.series.push(evidence.points(ensemble, &means));
    }
    if chart.series.iter().all(|series| series.points.len() < 2) {
        return Ok(missing(evidence));
    }
    let range = [LIGHT * 1e-3, LIGHT];
    for (chart, quantity) in [(&mut chart, AREA), (&mut secants, SECANT)] {
        chart.series.push(theories::persson_curve(quantity, range));
        chart.series.push(theories::asymptote(quantity, range));
        chart
            .series
            .extend(theories::asperity_curves(quantity, range));
    }
    let caption = format!(
        "Contact area fraction against load and, to the right, its secant under loads from \
         {SECANT_FROM} on, from {}; area as counted on the mesh. Points are means over the \
         surfaces, bars their standard errors. {}{}",
        sample(&evidence.sample()),
        evidence.share_of_mesh()?,
        evidence.caveat,
    );
    Ok(Drawn::figure(Sheet::of_two(chart, secants), caption))
}

fn missing(evidence: &Evidence) -> Drawn {
    let lines = evidence.lines_of_loads("{ to = 0.06, steps = 50 }");
    Drawn::missing(
        "measured contacts under at least two loads up to 0.06",
        lines,
    )
}
