//! Area from zero to full contact, and its slope (fig. 9).

use super::contact_maps::SHOWN_LOADS;
use super::theories::{self, AREA};
use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{AREA_LABEL, COUNTED_AREA, FigureData, LIGHT, LOAD_LABEL, series, spaced};
use asperity_contact::theory::persson;

pub const FIGURE: Definition =
    Definition { name: "area-full", title: "Contact area under all loads", draw };

/// Letters nearer to each other than this share of the axis stand one below the other.
const CLOSE: f64 = 0.03;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut chart = Chart::new(Axis::linear(LOAD_LABEL), Axis::linear(AREA_LABEL));
    let mut slopes = Chart::new(Axis::linear(LOAD_LABEL), Axis::linear("slope d(A/A₀)/dy"));
    let (mut heaviest, mut largest) = (0.0_f64, 0.0_f64);
    for ensemble in &data.measured {
        let means = ensemble.mean(COUNTED_AREA)?;
        let last = means.last().map_or(0.0, |mean| mean.load);
        heaviest = heaviest.max(last);
        largest = means.iter().fold(largest, |largest, mean| largest.max(mean.mean));
        let markers = spaced(0.04 * last, &means);
        let line = data.styles.joins(&ensemble.point);
        chart.series.push(series(&means, line).without_bars());
        chart.series.push(data.points(ensemble, &markers));
        let points = ensemble.slope(COUNTED_AREA)?;
        let points =
            points.iter().map(|slope| DataPoint { x: slope.load, y: slope.slope, bar: None });
        slopes.series.push(Series {
            points: points.collect(),
            style: data.styles.line(&ensemble.point),
            label: None,
        });
    }
    // Lighter loads have a figure of their own.
    if heaviest <= LIGHT * (1.0 + 1e-9) {
        let lines =
            data.lines_of_loads("{ from = 0.06, to = 1.7, steps = 40, spacing = \"geometric\" }");
        return Ok(Drawn::missing("measured contacts under loads beyond 0.06", lines));
    }
    let range = [0.0, heaviest];
    chart.x = chart.x.within(0.0, 1.03 * heaviest);
    chart.series.push(theories::persson_curve(AREA, range));
    chart.series.push(theories::asymptote(AREA, [0.0, 0.4_f64.min(heaviest)]));
    let style = Style::line(Colour::Text, Dash::Dashed, 1.8);
    let persson = Series::curve(persson::slope, range, Spacing::Linear, style);
    slopes.series.push(persson);
    let top = 1.04 * (1.2 * largest).min(1.0);
    chart.y = chart.y.within(0.0, top);
    mark_shown_loads(&mut chart, [heaviest, top]);
    let caption = format!(
        "Contact area fraction against load up to the first surface in full contact, from {}; \
         area as counted on the mesh. To the right the slope of the mean curves. The dashed line is \
         Persson's theory, the dotted one the asymptote of the model of Bush, Gibson & Thomas; \
         letters mark the loads near which contact maps are shown. {}{}",
        sample(&data.sample()),
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::of_two(chart, slopes), caption))
}

/// A line and a letter at each load near which contact maps are shown.
fn mark_shown_loads(chart: &mut Chart, [heaviest, top]: [f64; 2]) {
    let (mut before, mut height) = (f64::NEG_INFINITY, 0.0);
    for (letter, load) in ('a'..).zip(SHOWN_LOADS) {
        if load >= heaviest {
            break;
        }
        let line = Style::line(Colour::Muted, Dash::Dotted, 0.8);
        let line = Series::new([(load, 0.0), (load, top)], line);
        chart.series.push(line);
        height = match load - before < CLOSE * heaviest {
            true => height - 0.07 * top,
            false => 0.91 * top,
        };
        // Beside its line: the first one stands at the axis.
        let beside = load + 0.014 * heaviest;
        chart.notes.push((beside, height, letter.to_string()));
        before = load;
    }
}
