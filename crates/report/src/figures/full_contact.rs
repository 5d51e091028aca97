//! Area from zero to full contact and its slope (fig. 9), and the approach to full contact (fig.
//! 10).

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::Mean;
use crate::figure_data::{COUNTED_AREA, FigureData, LIGHT, series, spaced};
use crate::figures::area::{AREA, asymptote, persson_curve};
use crate::figures::contact_maps::SHOWN_LOADS;
use crate::figures::{Definition, Drawn, sample};
use crate::loads::LOAD_LABEL;
use crate::symbols::AREA_LABEL;
use asperity_contact::theory::models::full_contact;
use asperity_contact::theory::persson;

pub const ALL_LOADS: Definition =
    Definition { name: "area-full", title: "Contact area under all loads", draw: draw_all_loads };

/// Distance between two letters, as a fraction of the axis length, below which the second letter is
/// placed lower.
const CLOSE: f64 = 0.03;

fn draw_all_loads(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut chart = Chart::new(Axis::linear(LOAD_LABEL), Axis::linear(AREA_LABEL));
    let mut slopes = Chart::new(Axis::linear(LOAD_LABEL), Axis::linear("slope d(A/A₀)/dy"));
    let (mut heaviest, mut largest) = (0.0_f64, 0.0_f64);
    for ensemble in &data.measured {
        let means = ensemble.mean(COUNTED_AREA)?;
        let last = means.last().map_or(0.0, |mean| mean.load);
        heaviest = heaviest.max(last);
        largest = means.iter().fold(largest, |largest, mean| largest.max(mean.mean));
        data.add_curve(&mut chart, ensemble, &means, &spaced(0.04 * last, &means));
        let points = ensemble.slope(COUNTED_AREA)?;
        let style = data.styles.line(&ensemble.point);
        slopes.series.push(Series { points, style, label: None }.without_bars());
    }
    // Another figure shows light loads.
    if heaviest <= LIGHT * (1.0 + 1e-9) {
        let lines =
            data.lines_of_loads("{ from = 0.06, to = 1.7, steps = 40, spacing = \"geometric\" }");
        let needs = format!("measured contacts at loads above {}", data.light());
        return Ok(Drawn::missing(needs, lines));
    }
    let range = [0.0, heaviest];
    chart.x = chart.x.within(0.0, 1.03 * heaviest);
    chart.series.push(persson_curve(AREA, range));
    chart.series.push(asymptote(AREA, [0.0, 0.4_f64.min(heaviest)]));
    let style = Style::line(Colour::Text, Dash::Dashed, 1.8);
    let persson = Series::curve(persson::slope, range, Spacing::Linear, style);
    slopes.series.push(persson);
    let top = 1.04 * (1.2 * largest).min(1.0);
    chart.y = chart.y.within(0.0, top);
    mark_shown_loads(&mut chart, [heaviest, top]);
    let caption = format!(
        "Counted contact area fraction against load (left), and the slope of the mean curves \
         (right), up to the load at which the first surface is in full contact, from {}. The dashed line is Persson's \
         theory, the dotted line the asymptote of the model of Bush, Gibson & Thomas. Letters mark \
         the loads near which contact maps are shown. {}{}",
        sample(&data.sample()),
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::side_by_side(chart, slopes), caption))
}

/// Draws a line and a letter at each load near which contact maps are shown.
fn mark_shown_loads(chart: &mut Chart, [heaviest, top]: [f64; 2]) {
    let (mut before, mut height) = (f64::NEG_INFINITY, 0.0);
    for (letter, load) in ('a'..).zip(SHOWN_LOADS) {
        if load >= heaviest {
            break;
        }
        let line = Style::line(Colour::Muted, Dash::Dotted, 0.8);
        let line = Series::new([(load, 0.0), (load, top)], line);
        chart.series.push(line);
        height = if load - before < CLOSE * heaviest { height - 0.07 * top } else { 0.91 * top };
        // Place the letter next to its line, because the first line is close to the axis.
        let beside = load + 0.014 * heaviest;
        chart.notes.push((beside, height, letter.to_string()));
        before = load;
    }
}

pub const APPROACH: Definition = Definition {
    name: "near-full-contact",
    title: "Approach to full contact",
    draw: draw_approach,
};

/// Smallest load of the charts of area and open area.
const FROM: f64 = 0.5;
/// Smallest load of the chart of the approach F(y).
const APPROACH_FROM: f64 = 0.3;
/// Factors β of the scaled error functions erf(β √2 y) in the paper.
const SCALES: [f64; 2] = [1.09, 1.16];

fn draw_approach(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut chart = Chart::new(Axis::linear(LOAD_LABEL), Axis::linear(AREA_LABEL));
    let mut approach =
        Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::logarithmic("approach F(y)"));
    let mut open = Chart::new(Axis::linear(LOAD_LABEL), Axis::logarithmic("(1 − A/A₀)/erfc(√2 y)"));
    let mut heaviest = 0.0_f64;
    let mut least = 1.0_f64;
    for ensemble in &data.measured {
        let mut means = ensemble.mean(COUNTED_AREA)?;
        means.retain(|mean| mean.load >= APPROACH_FROM);
        let transformed: Vec<Mean> = means.iter().filter_map(transformed).collect();
        means.retain(|mean| mean.load >= FROM);
        heaviest = heaviest.max(means.last().map_or(0.0, |mean| mean.load));
        least = means.iter().fold(least, |least, mean| least.min(mean.mean));
        let style = data.styles.markers(&ensemble.point);
        approach.series.push(series(&transformed, style));
        let known = means.iter().filter(is_known);
        let shares: Vec<Mean> = known.map(open_over_persson).collect();
        let joined = series(&shares, style.joined());
        open.series.push(joined);
        chart.series.push(data.points(ensemble, &means));
    }
    if heaviest < 2.0 * FROM {
        let lines =
            data.lines_of_loads("{ from = 0.06, to = 1.7, steps = 40, spacing = \"geometric\" }");
        let heavy = data.loads.text_of_reduced(2.0 * FROM);
        let needs = format!("measured contacts at loads up to {heavy} or more");
        return Ok(Drawn::missing(needs, lines));
    }
    let range = [FROM, heaviest];
    let curve = |of: fn(f64) -> f64, colour, dash, width| {
        Series::curve(of, range, Spacing::Linear, Style::line(colour, dash, width))
    };
    let whole = |of: fn(f64) -> f64, dash| {
        let range = [APPROACH_FROM, heaviest];
        Series::curve(of, range, Spacing::Logarithmic, Style::line(Colour::Text, dash, 1.8))
    };
    for (scale, dash) in SCALES.into_iter().zip([Dash::Solid, Dash::DashDot]) {
        let scaled = |load: f64| persson::area(scale * load);
        let style = Style::line(Colour::Muted, dash, 2.6);
        let label = format!("erf({scale} √2 y)");
        let scaled = Series::curve(scaled, range, Spacing::Linear, style);
        chart.series.push(scaled.named(label));
    }
    let asymptote =
        |load: f64| 1.0 - (-2.0 * load * load).exp() / (load * std::f64::consts::TAU.sqrt());
    chart.series.extend([
        curve(persson::area, Colour::Text, Dash::Dashed, 1.8).named("Persson 2001"),
        curve(asymptote, Colour::Text, Dash::Dotted, 1.8)
            .named("asymptote of Persson's theory, η = 2"),
        curve(|y| 1.0 - full_contact::noncontact(y), Colour::Text, Dash::Solid, 1.2)
            .named("isolated cracks, 1 − ¾ erfc(√2 y)"),
    ]);
    approach.series.extend([
        whole(persson::approach, Dash::Dashed),
        whole(|load| 2.0 * load * load, Dash::Dotted),
    ]);
    let scales = SCALES.into_iter().zip([Dash::Solid, Dash::DashDot]);
    open.series.extend(scales.map(|(scale, dash)| {
        let ratio = |load: f64| persson::noncontact(scale * load) / persson::noncontact(load);
        let style = Style::line(Colour::Muted, dash, 2.6);
        Series::curve(ratio, range, Spacing::Linear, style)
    }));
    open.series.extend([
        curve(|_| 1.0, Colour::Text, Dash::Dashed, 1.8),
        curve(
            |y| full_contact::noncontact(y) / persson::noncontact(y),
            Colour::Text,
            Dash::Solid,
            1.2,
        ),
    ]);
    for chart in [&mut chart, &mut open] {
        chart.x = chart.x.clone().within(FROM, 1.03 * heaviest);
    }
    chart.y = chart.y.within((least - 0.05).max(0.0), 1.01);
    let caption = format!(
        "Counted contact area near full contact, from {}. Points are means up to the load at \
         which the first surface is in full contact, bars are {}; grey lines are error functions \
         of a scaled load. Right: ratio of the open area to that in Persson's theory, at loads \
         where half the error bar is shorter than a third of the open area. Below: F(y) = −ln[(1 − A/A₀) y √(2π)], which tends to 2 y² in Persson's \
         theory.{}",
        sample(&data.sample()),
        data.bars,
        data.caveat,
    );
    Ok(Drawn::figure(
        Figure::from_charts(vec![vec![chart, open], vec![approach]], [430.0, 340.0]),
        caption,
    ))
}

/// Returns true if half the bar is shorter than a third of the open area.
fn is_known(mean: &&Mean) -> bool {
    let open = 1.0 - mean.mean;
    open > 0.0 && mean.half_bar.is_none_or(|half| half < open / 3.0)
}

fn open_over_persson(mean: &Mean) -> Mean {
    let persson = persson::noncontact(mean.load);
    Mean {
        mean: (1.0 - mean.mean) / persson,
        half_bar: mean.half_bar.map(|half| half / persson),
        ..*mean
    }
}

fn transformed(mean: &Mean) -> Option<Mean> {
    let open = 1.0 - mean.mean;
    Some(Mean {
        mean: persson::approach_to_full_contact(mean.load, open)?,
        half_bar: mean.half_bar.map(|half| half / open),
        ..*mean
    })
}
