//! Distribution of the heights of measured surfaces, as they are pressed, in their unit of length, each
//! beside a Gaussian of the same rms height.

use std::f64::consts::TAU;

use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::colour::Colour;
use crate::charts::style::{Dash, Style};
use crate::figure_data::FigureData;
use crate::measured::{MeasuredMap, RANGE};
use crate::units::{LengthUnit, digits};

/// Probability densities of the surfaces that are shown, linear and logarithmic, and what is to be
/// seen; nothing where no surface is measured.
pub fn charts(data: &FigureData) -> Option<(Vec<Chart>, String)> {
    let maps = data.maps.there();
    let shared = LengthUnit::common(maps.iter().map(|map| map.unit.as_deref()));
    let rms = |map: &MeasuredMap| shared.factor(map.unit.as_deref()) * map.histogram.rms_height;
    let largest = maps.iter().map(rms).reduce(f64::max)?;
    let scaled = shared.scaled(largest);
    let (largest, unit) = (scaled.factor * largest, &scaled.unit);
    let mut series = Vec::new();
    let mut told = Vec::new();
    for map in maps {
        let rms = scaled.factor * rms(map);
        let (label, [line, dashes]) = look(data, map, maps.len());
        let bins = map.histogram.bins.iter();
        let points = bins.map(|bin| (rms * bin.center, bin.density / rms));
        series.push(Series::new(points.collect::<Vec<_>>(), line).named(label.clone()));
        let gaussian = |height: f64| (-(height / rms).powi(2) / 2.0).exp() / (rms * TAU.sqrt());
        let ends = [-RANGE * rms, RANGE * rms];
        let curve = Series::curve(gaussian, ends, Spacing::Linear, dashes);
        series.push(curve.named("Gaussian of the same rms height"));
        told.push(format!("{label} {} {unit}", digits(rms, 3)));
    }
    let densities = || series.iter().flat_map(|series| &series.points);
    let highest = densities().fold(0.0_f64, |most, point| most.max(point.y));
    let label = format!("density, 1/{unit}");
    let axes = [
        Axis::linear(label.clone()).within(0.0, 1.05 * highest),
        // A Gaussian falls to 4e-6 of its peak at five rms heights.
        Axis::logarithmic(label).within(2e-6 * highest, 2.0 * highest),
    ];
    let x = Axis::linear(format!("height, {unit}")).within(-RANGE * largest, RANGE * largest);
    let chart = |y| Chart { series: series.clone(), ..Chart::new(x.clone(), y) };
    let caption = format!(
        "Probability density of the heights of measured surfaces, as they are pressed, about their \
         mean, linear and logarithmic; dashed the Gaussian of the same rms height: {}.",
        told.join("; "),
    );
    Some((axes.map(chart).into(), caption))
}

/// What a surface is called, and the lines of its heights and of their Gaussian: where it is the only
/// one, no colour stands for anything.
fn look(data: &FigureData, map: &MeasuredMap, surfaces: usize) -> (String, [Style; 2]) {
    let label = data.styles.label(&map.point);
    let label = label.unwrap_or_else(|| "the surface".to_owned());
    let colours = match surfaces {
        1 => [Colour::Text, Colour::Series(1)],
        _ => [data.styles.colour(&map.point); 2],
    };
    let [solid, dashed] = colours;
    let lines = [Style::line(solid, Dash::Solid, 1.5), Style::line(dashed, Dash::Dashed, 1.2)];
    (label, lines)
}
