//! Maps of heights (fig. 4), and distributions of the heights of measured surfaces in their unit of
//! length.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::map_panel::{BarNumbers, ColourBar, MapPanel};
use crate::charts::raster::{HeightMap, Raster};
use crate::charts::style::{Colour, Dash, Style};
use crate::charts::{Figure, Panel, in_rows, panel_of_map};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn};
use crate::samples::{self, FILE_IS_GONE, MeasuredMap, RANGE, Sample};
use crate::units::{Unit, digits, scale_bar};
use asperity_stages::surface::Heights;

pub const MAPS: Definition =
    Definition { name: "surfaces", title: "Maps of heights", draw: draw_maps };

/// Pixels per side of a map.
const PIXELS: usize = 512;
/// Widths of a panel in pixels: in a figure of many panels, and in one of at most two measured
/// maps.
const WIDTHS: [f64; 2] = [230.0, 380.0];

fn draw_maps(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut samples = samples::first_surfaces(data.finished)?;
    samples.retain(|sample| sample.params.heights != Heights::None);
    if samples.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let Some(measured) = &data.maps else {
        return Ok(Drawn::gone(FILE_IS_GONE));
    };
    let mut panels: Vec<Panel> = Vec::new();
    for map in measured {
        panels.extend(of_measured(data, map));
    }
    let measured_panels = panels.len();
    for sample in samples.iter().filter(|sample| sample.file().is_none()) {
        panels.push(Panel::Map(of_sample(data, sample)?));
    }
    let has_holes = measured.iter().any(|map| {
        let seen = map.as_measured.as_ref();
        seen.is_some_and(|seen| seen.missing > 0.0)
    });
    let columns = match measured_panels {
        0 => columns(&samples),
        _ => panels.len().min(3),
    };
    let few = measured_panels > 0 && panels.len() <= 2;
    let panel = panel_of_map(panels.iter(), WIDTHS[usize::from(few)]);
    let rows = in_rows(columns, panels);
    let are_all_measured = samples.iter().all(|sample| sample.file().is_some());
    let caption = caption_of_maps(measured_panels > 0, are_all_measured, has_holes);
    Ok(Drawn::figure(Figure::from_panels(rows, panel), caption))
}

fn caption_of_maps(is_any_measured: bool, are_all_measured: bool, has_holes: bool) -> String {
    let measured = if is_any_measured {
        "Heights of the measured surfaces: as measured, without the form that the manifest \
         removes, and, if different, as pressed.  "
    } else {
        ""
    };
    let others = match (is_any_measured, are_all_measured) {
        (true, true) => "D",
        (true, false) => "The first surface of each other parameter point: d",
        (false, _) => "The first surface of each parameter point: d",
    };
    let holes = if has_holes { "  Points without a measurement are red." } else { "" };
    format!(
        "{measured}{others}ark blue valleys and yellow peaks; each map has its own range of \
         heights.{holes}"
    )
}

/// Returns maps of a measured surface before and after its preparation.
fn of_measured(data: &FigureData, map: &MeasuredMap) -> Vec<Panel> {
    let name = data.styles.label(&map.point).unwrap_or_default();
    let title =
        |what: &str| if name.is_empty() { what.to_owned() } else { format!("{name} · {what}") };
    let unit = map.unit.as_deref();
    let seen = map.as_measured.as_ref().map(|seen| {
        let missing = if seen.missing > 0.0 {
            format!(" · {} % missing", digits(100.0 * seen.missing, 2))
        } else {
            String::new()
        };
        let title = title("as measured") + &missing;
        Panel::Map(panel(title, &seen.map, unit))
    });
    let pressed = match seen {
        Some(_) => title("as pressed"),
        None => name.clone(),
    };
    let pressed = Panel::Map(panel(pressed, &map.pressed, unit));
    seen.into_iter().chain([pressed]).collect()
}

/// Returns a map of the first surface of a parameter point that was not measured.
fn of_sample(data: &FigureData, sample: &Sample) -> Result<MapPanel, ReportError> {
    let surface = sample.draw(data.finished).map_err(ReportError::Surface)?;
    let (grid, heights) = (surface.grid(), surface.heights());
    let title = data.styles.label(&sample.point).unwrap_or_default();
    let size = grid.cell().size();
    Ok(match data.units.at(&sample.point) {
        // Without a unit of length there are no bars.
        None => {
            let raster = Raster::from_heights(grid.nodes(), heights).at_most(PIXELS);
            MapPanel::new(title, raster, size)
        }
        Some(unit) => {
            let map = HeightMap::new(grid.nodes(), size, heights, PIXELS);
            panel(title, &map, Some(unit))
        }
    })
}

/// Returns a map with its scale bar and colour bar.
fn panel(title: String, map: &HeightMap, unit: Option<&str>) -> MapPanel {
    MapPanel {
        scale_bar: scale_bar(map.size[0], unit),
        colour_bar: map.range.map(|range| Box::new(colour_bar(map, range, unit))),
        ..MapPanel::new(title, map.raster.clone(), map.size)
    }
}

fn colour_bar(heights: &HeightMap, range: [f64; 2], unit: Option<&str>) -> ColourBar {
    let shared = Unit::of_lengths([unit]);
    let range = range.map(|height| shared.factor(unit) * height);
    let scaled = shared.scaled(range[0].abs().max(range[1].abs()));
    let unit = shared.name().map_or_else(String::new, |_| format!(" {}", scaled.unit));
    let text = |height: f64| digits(scaled.factor * height, 3) + &unit;
    ColourBar { colours: heights.colours.clone(), numbers: BarNumbers::Ends(range.map(text)) }
}

/// Returns the number of columns: one for each upper cutoff if all pairs of cutoffs exist,
/// otherwise three.
fn columns(samples: &[Sample]) -> usize {
    let cutoffs = samples.iter().filter_map(|sample| {
        let spectrum = sample.random()?.spectrum;
        Some((spectrum.k_lower, spectrum.k_upper))
    });
    let cutoffs: BTreeSet<(u32, u32)> = cutoffs.collect();
    let lower: BTreeSet<u32> = cutoffs.iter().map(|cutoffs| cutoffs.0).collect();
    let upper: BTreeSet<u32> = cutoffs.iter().map(|cutoffs| cutoffs.1).collect();
    if upper.len() * lower.len() == samples.len() && upper.len() <= 4 {
        upper.len()
    } else {
        samples.len().min(3)
    }
}

pub const HEIGHTS: Definition =
    Definition { name: "heights", title: "Distribution of heights", draw: draw_densities };

fn draw_densities(data: &FigureData) -> Result<Drawn, ReportError> {
    let Some((charts, caption)) = measured_charts(data) else {
        return Ok(Drawn::missing_surfaces(data));
    };
    Ok(Drawn::figure(Figure::from_charts(vec![charts], [430.0, 340.0]), caption))
}

/// Returns linear and logarithmic charts of the densities of measured surfaces, and their caption,
/// or `None` without measured surfaces.
fn measured_charts(data: &FigureData) -> Option<(Vec<Chart>, String)> {
    let maps = data.maps.as_deref().unwrap_or_default();
    let shared = Unit::of_lengths(maps.iter().map(|map| map.unit.as_deref()));
    let rms = |map: &MeasuredMap| shared.factor(map.unit.as_deref()) * map.histogram.rms_height;
    let largest = maps.iter().map(rms).reduce(f64::max)?;
    let scaled = shared.scaled(largest);
    let (largest, unit) = (scaled.factor * largest, &scaled.unit);
    let mut series = Vec::new();
    let mut descriptions = Vec::new();
    for map in maps {
        let rms = scaled.factor * rms(map);
        let (label, [line, dashes]) = label_and_lines(data, map, maps.len());
        let bins = map.histogram.bins.iter();
        let points = bins.map(|bin| (rms * bin.center, bin.density / rms));
        series.push(Series::new(points.collect::<Vec<_>>(), line).named(label.clone()));
        let gaussian = |height: f64| (-(height / rms).powi(2) / 2.0).exp() / (rms * TAU.sqrt());
        let ends = [-RANGE * rms, RANGE * rms];
        let curve = Series::curve(gaussian, ends, Spacing::Linear, dashes);
        series.push(curve.named("Gaussian of the same rms height"));
        descriptions.push(format!("{label} {} {unit}", digits(rms, 3)));
    }
    let densities = || series.iter().flat_map(|series| &series.points);
    let highest = densities().fold(0.0_f64, |most, point| most.max(point.y));
    let label = format!("density, 1/{unit}");
    let axes = [
        Axis::linear(label.clone()).within(0.0, 1.05 * highest),
        // A Gaussian falls to 4e-6 of its maximum at five rms heights.
        Axis::logarithmic(label).within(2e-6 * highest, 2.0 * highest),
    ];
    let x = Axis::linear(format!("height, {unit}")).within(-RANGE * largest, RANGE * largest);
    let chart = |y| Chart { series: series.clone(), ..Chart::new(x.clone(), y) };
    let caption = format!(
        "Probability density of the heights of measured surfaces as pressed, relative to their \
         mean, linear and logarithmic. Dashed: Gaussian of the same rms height: {}.",
        descriptions.join("; "),
    );
    Some((axes.map(chart).into(), caption))
}

/// Returns the label of a surface, and the lines of its density and of the Gaussian. A single
/// surface does not use the colours of parameter points.
fn label_and_lines(data: &FigureData, map: &MeasuredMap, surfaces: usize) -> (String, [Style; 2]) {
    let label = data.styles.name(&map.point, "the surface");
    let colours = match surfaces {
        1 => [Colour::Text, Colour::Series(1)],
        _ => [data.styles.colour(&map.point); 2],
    };
    let [solid, dashed] = colours;
    let lines = [Style::line(solid, Dash::Solid, 1.5), Style::line(dashed, Dash::Dashed, 1.2)];
    (label, lines)
}
