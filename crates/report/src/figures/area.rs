//! Area under light load beside the theories, and its secant (fig. 5 of the paper).

use super::theories::{self, AREA, SECANT};
use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::Chart;
use crate::charts::figure::Figure;
use crate::ensembles::Mean;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{
    AREA_LABEL, COUNTED_AREA, FigureData, LIGHT, LOAD_LABEL, series, spaced, spaced_by, up_to,
};

pub const FIGURE: Definition =
    Definition { name: "area-light", title: "Contact area under light load", draw };

/// Lighter loads touch so few nodes that their secants would fill the chart.
const SECANT_FROM: f64 = LIGHT / 100.0;
/// Markers of one curve on the chart of secants are farther apart.
const FACTOR: f64 = 1.25;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let axis = Axis::linear(LOAD_LABEL).within(0.0, 1.05 * LIGHT);
    let mut chart = Chart::new(axis.clone(), Axis::linear(AREA_LABEL));
    let mut secants = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("secant A/(A₀ y)"));
    for ensemble in &data.measured {
        let means = up_to(LIGHT, ensemble.mean(COUNTED_AREA)?);
        let seen = means.iter().filter(|mean| mean.load >= SECANT_FROM);
        let secant: Vec<Mean> = seen.map(Mean::secant).collect();
        let [line, markers] = data.styles.both(&ensemble.point);
        for (chart, means, apart) in [
            (&mut chart, &means, spaced(LIGHT / 20.0, &means)),
            (&mut secants, &secant, spaced_by(FACTOR, &secant)),
        ] {
            chart.series.push(series(means, line).without_bars());
            let points = series(&apart, markers);
            chart.series.push(points.named(data.label(ensemble)));
        }
    }
    if chart.series.iter().all(|series| series.points.len() < 2) {
        return Ok(missing(data));
    }
    let lightest = secants.series.iter().flat_map(|series| &series.points);
    let lightest = lightest.fold(LIGHT, |least, point| least.min(point.x));
    for (chart, quantity, range) in
        [(&mut chart, AREA, [LIGHT * 1e-3, LIGHT]), (&mut secants, SECANT, [lightest, LIGHT])]
    {
        chart.series.push(theories::persson_curve(quantity, range));
        chart.series.push(theories::asymptote(quantity, range));
        chart.series.extend(theories::asperity_curves(quantity, range));
    }
    let caption = format!(
        "Contact area fraction against load and, to the right, its secant under loads from \
         {SECANT_FROM} on, over the logarithm of the load, from {}; area as counted on the mesh. Points are means over the \
         surfaces at some of the loads that the lines join, bars {}. {}{}",
        sample(&data.sample()),
        data.bars,
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::of_two(chart, secants), caption))
}

fn missing(data: &FigureData) -> Drawn {
    let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
    Drawn::missing("measured contacts under at least two loads up to 0.06", lines)
}
