//! Distribution of gaps out of contact; beyond the paper.

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::Chart;
use crate::charts::figure::Figure;
use crate::distributions;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::FigureData;
use asperity_stages::columns::{GAP, GAP_DENSITY};

pub const FIGURE: Definition =
    Definition { name: "gap-distribution", title: "Distribution of gaps", draw };

/// What the axis of gaps says.
const LABEL: &str = "gap over the rms height";
/// The least density that is seen, over the largest.
const SHARE: f64 = 1e-4;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let measured = distributions::of(data, [GAP, GAP_DENSITY])?;
    if measured.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let loads = distributions::shown_loads(&measured);
    let charts = loads.iter().filter_map(|&load| {
        let [last, highest] = distributions::extent(&measured, load, SHARE)?;
        let x = Axis::linear(LABEL).within(0.0, 1.02 * last);
        let y = Axis::logarithmic("density").within(SHARE * highest, 2.0 * highest);
        let empty = Chart::new(x, y);
        Some(distributions::chart(data, &measured, load, &empty))
    });
    let charts: Vec<Chart> = charts.collect();
    let caption = format!(
        "Probability density of the gap over the nominal area, from {}. Markers are means over the surfaces \
         at some of the bins, bars {}; lines join all bins. What is in contact has no gap and is not counted, \
         so that a curve holds the share out of contact.",
        sample(&distributions::surfaces(&measured)),
        data.bars,
    );
    let figure = Figure::of_charts(vec![charts], [300.0, 260.0]);
    Ok(Drawn::figure(figure, caption))
}
