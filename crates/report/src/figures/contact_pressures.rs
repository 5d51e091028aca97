//! Distribution of contact pressures beside Persson's; beyond the paper.

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::distributions;
use crate::distributions::Distribution;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::FigureData;
use asperity_stages::columns::{CONTACT_PRESSURE, PRESSURE_DENSITY, PRESSURE_DENSITY_PERSSON};

pub const FIGURE: Definition =
    Definition { name: "contact-pressures", title: "Distribution of contact pressures", draw };

/// What the axis of pressures says.
const LABEL: &str = "pressure p/(E* h′)";
/// The least density on an axis of logarithms, over the largest.
const SHARE: f64 = 1e-4;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let measured = distributions::of(data, [CONTACT_PRESSURE, PRESSURE_DENSITY])?;
    if measured.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let theory = distributions::of(data, [CONTACT_PRESSURE, PRESSURE_DENSITY_PERSSON])?;
    let loads = distributions::shown_loads(&measured);
    let row = |share: f64, densities: fn(f64) -> Axis| -> Vec<Chart> {
        let charts = loads.iter().filter_map(|&load| {
            let [last, highest] = distributions::extent(&measured, load, share)?;
            let empty = Chart::new(Axis::linear(LABEL).within(0.0, last), densities(highest));
            let mut chart = distributions::chart(data, &measured, load, &empty);
            chart.series.extend(persson(theory.first()?, load));
            Some(chart)
        });
        charts.collect()
    };
    let linear = row(0.01, |highest| Axis::linear("density").within(0.0, 1.1 * highest));
    let logarithmic =
        row(SHARE, |highest| Axis::logarithmic("density").within(SHARE * highest, 2.0 * highest));
    let caption = format!(
        "Probability density of the contact pressure over the nominal area, linear and logarithmic, from \
         {}. Markers are means over the surfaces at some of the bins, bars {}; lines join all bins. What is \
         out of contact has no pressure and is not counted, so that a curve holds the area fraction. Nodes at \
         the edges of contact have pressures near zero: there the density depends on the mesh.",
        sample(&distributions::surfaces(&measured)),
        data.bars,
    );
    let figure = Figure::of_charts(vec![linear, logarithmic], [300.0, 240.0]);
    Ok(Drawn::figure(figure, caption))
}

/// Persson's density, averaged over each bin, is the same for all spectra under one reduced load.
fn persson(theory: &Distribution, load: f64) -> Option<Series> {
    let style = Style::line(Colour::Text, Dash::Dashed, 1.6);
    let points = theory.under(load)?;
    let points = points.iter().map(|point| (point.x, point.y));
    Some(Series::new(points, style).named("Persson 2001"))
}
