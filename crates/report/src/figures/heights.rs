//! Maps of heights (fig. 4) and distributions of heights (figs. 3 and B.1): relative to the rms
//! height for random surfaces, in the unit of length for measured ones.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::map_panel::{BarNumbers, ColourBar, MapPanel};
use crate::charts::raster::{HeightMap, Raster};
use crate::charts::style::{Colour, Dash, Style};
use crate::charts::{Figure, Panel, in_rows, panel_of_map};
use crate::ensembles::{self, Point};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn, sample};
use crate::samples::{
    self, FILE_IS_GONE, MOST, MeasuredMap, MeasuredMaps, RANGE, Sample, ShownMap,
};
use crate::surface_curves::runs;
use crate::units::{LengthUnit, digits, scale_bar};
use asperity_stages::columns::{BIN, DENSITY, DENSITY_MEAN, DENSITY_NORMAL, DENSITY_SD, SURFACES};
use asperity_stages::surface::Heights;
use asperity_tables::table::{Table, TableError};

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
        let lines = data.lines_of_surfaces();
        return Ok(Drawn::missing("surfaces with heights", lines));
    }
    let MeasuredMaps::There(measured) = &data.maps else {
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
            let heights = HeightMap::new(grid.nodes(), heights, PIXELS);
            panel(title, &ShownMap { heights, size }, Some(unit))
        }
    })
}

/// Returns a map with its scale bar and colour bar.
fn panel(title: String, map: &ShownMap, unit: Option<&str>) -> MapPanel {
    let ShownMap { heights, size } = map;
    MapPanel {
        scale_bar: scale_bar(size[0], unit),
        colour_bar: heights.range.map(|range| Box::new(colour_bar(heights, range, unit))),
        ..MapPanel::new(title, heights.raster.clone(), *size)
    }
}

fn colour_bar(heights: &HeightMap, range: [f64; 2], unit: Option<&str>) -> ColourBar {
    let shared = LengthUnit::common([unit]);
    let range = range.map(|height| shared.factor(unit) * height);
    let scaled = shared.scaled(range[0].abs().max(range[1].abs()));
    let text = |height: f64| {
        let number = digits(scaled.factor * height, 3);
        match shared {
            LengthUnit::Unknown => number,
            LengthUnit::Metre | LengthUnit::Named(_) => format!("{number} {}", scaled.unit),
        }
    };
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

/// Number of single surfaces that are drawn in addition to the mean.
const SINGLE: usize = 3;
/// Largest number of points of a curve. Finer bins are averaged.
const POINTS: usize = 200;

/// Densities of heights of one parameter point, as points (height, density).
#[derive(Default)]
struct Densities {
    point: Point,
    surfaces: usize,
    mean: Vec<(f64, f64)>,
    deviation: Vec<(f64, f64)>,
    normal: Vec<(f64, f64)>,
    single: Vec<Vec<(f64, f64)>>,
}

fn draw_densities(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut all: Vec<Densities> = Vec::new();
    for stage in data.finished.with(&[BIN.name, DENSITY_MEAN.name]) {
        pooled(&stage.table, &mut all)?;
    }
    for stage in data.finished.with(&[BIN.name, DENSITY.name]) {
        single(&stage.table, &mut all)?;
    }
    let measured = measured_charts(data);
    if all.is_empty() && measured.is_none() {
        let needs = "a stage of kind `measure` that reads the surfaces, with `bins`";
        return Ok(Drawn::missing_surfaces(data, needs, data.lines_of_heights()));
    }
    let (mut rows, mut captions): (Vec<_>, Vec<_>) = measured.into_iter().unzip();
    let size = if all.is_empty() { [430.0, 340.0] } else { [300.0, 225.0] };
    if !all.is_empty() {
        let shown = &all[..all.len().min(MOST)];
        rows.extend(shown.iter().map(|densities| density_charts(data, densities)));
        captions.push(caption_of_densities(shown));
    }
    let figure = Figure::from_charts(rows, size);
    Ok(Drawn::figure(figure, captions.join(" ")))
}

/// Returns the caption of densities relative to the rms height.
fn caption_of_densities(shown: &[Densities]) -> String {
    let surfaces: Vec<usize> = shown.iter().map(|densities| densities.surfaces).collect();
    format!(
        "Probability density of heights divided by their rms height: linear, the upper tail, and \
         logarithmic. Black: mean over {}; dashed: ± one standard deviation between surfaces; \
         vermilion: normal density; other colours: three single surfaces. Bins are averaged \
         to {POINTS} points.",
        sample(&surfaces),
    )
}

fn density_charts(data: &FigureData, densities: &Densities) -> Vec<Chart> {
    let x = Axis::linear("height/rms height");
    let y = Axis::linear("density");
    let label = data.styles.label(&densities.point).unwrap_or_default();
    let series = densities.series();
    let highest = |from: f64, to: f64| {
        let points = series.iter().flat_map(|series| &series.points);
        let densities = points.filter(|point| (from..=to).contains(&point.x)).map(|point| point.y);
        densities.fold(0.0, f64::max)
    };
    let [all, tail] = [highest(-5.0, 5.0), highest(2.0, 4.0)];
    let axes = [
        (x.clone().within(-5.0, 5.0), y.clone().within(0.0, 1.1 * all)),
        (x.clone().within(2.0, 4.0), y.within(0.0, 1.1 * tail)),
        (x.within(-5.0, 5.0), Axis::logarithmic("density").within(1e-6, 2.0 * all)),
    ];
    let chart = |(x, y)| Chart { series: series.clone(), ..Chart::new(x, y).titled(label.clone()) };
    axes.map(chart).into()
}

impl Densities {
    /// Computes the mean and the standard deviation of the densities of the single surfaces.
    fn averaged(self) -> Densities {
        let bins = self.single.iter().map(Vec::len).min().unwrap_or(0);
        let surfaces = self.single.len() as f64;
        let of_bin = |bin: usize| self.single.iter().map(move |curve| curve[bin].1);
        let mean = |bin: usize| of_bin(bin).sum::<f64>() / surfaces;
        let deviation = |bin: usize| {
            let mean = mean(bin);
            let square = of_bin(bin).map(|density| (density - mean).powi(2)).sum::<f64>();
            (square / (surfaces - 1.0)).sqrt()
        };
        let curve = |value: &dyn Fn(usize) -> f64| {
            let points = (0..bins).map(|bin| (self.single[0][bin].0, value(bin)));
            points.collect::<Vec<_>>()
        };
        let normal = |bin: usize| (-self.single[0][bin].0.powi(2) / 2.0).exp() / TAU.sqrt();
        Densities {
            surfaces: self.single.len(),
            mean: curve(&mean),
            deviation: if surfaces > 1.0 { curve(&deviation) } else { Vec::new() },
            normal: curve(&normal),
            ..self
        }
    }

    fn series(&self) -> Vec<Series> {
        let mut series: Vec<Series> = Vec::new();
        let singles = self.single.iter().filter(|_| self.surfaces > 1);
        for (index, single) in singles.enumerate() {
            let style = Style::line(Colour::Series([0, 2, 4][index % 3]), Dash::Solid, 0.8);
            let label = format!("surface {}", index + 1);
            series.push(thinned(single, style).named(label));
        }
        let bound = |sign: f64| {
            let both = self.mean.iter().zip(&self.deviation);
            let points: Vec<(f64, f64)> = both
                .map(|(mean, deviation)| (mean.0, (mean.1 + sign * deviation.1).max(0.0)))
                .collect();
            thinned(&points, Style::line(Colour::Text, Dash::Dashed, 1.0))
        };
        if !self.deviation.is_empty() {
            series.push(bound(1.0).named("± standard deviation"));
            series.push(bound(-1.0));
        }
        let mean = Style::line(Colour::Text, Dash::Solid, 1.5);
        let label = match self.surfaces {
            1 => "the surface",
            _ => "mean of the surfaces",
        };
        series.push(thinned(&self.mean, mean).named(label));
        let normal = Style::line(Colour::Series(1), Dash::Solid, 1.5);
        series.push(thinned(&self.normal, normal).named("normal"));
        series
    }
}

fn thinned(points: &[(f64, f64)], style: Style) -> Series {
    let joined = points.chunks(points.len().div_ceil(POINTS).max(1)).map(|bins| {
        let count = bins.len() as f64;
        let sum = bins.iter().fold((0.0, 0.0), |sum, bin| (sum.0 + bin.0, sum.1 + bin.1));
        (sum.0 / count, sum.1 / count)
    });
    Series::new(joined.collect::<Vec<_>>(), style)
}

/// Returns the item of `all` for the parameter point of a row, after adding an empty item if `all`
/// has none.
fn entry<'a>(table: &Table, row: usize, all: &'a mut Vec<Densities>) -> &'a mut Densities {
    let mut point = ensembles::point(table, row);
    point.remove(BIN.name);
    let at = all.iter().position(|known| known.point == point);
    let at = at.unwrap_or_else(|| {
        all.push(Densities { point, ..Densities::default() });
        all.len() - 1
    });
    &mut all[at]
}

fn pooled(table: &Table, all: &mut Vec<Densities>) -> Result<(), TableError> {
    let bins = table.reals(BIN.name)?;
    let column = |name: &str| table.reals(name);
    let (mean, normal) = (column(DENSITY_MEAN.name)?, column(DENSITY_NORMAL.name)?);
    let deviation = column(DENSITY_SD.name)?;
    let surfaces = table.integers(SURFACES.name)?;
    for rows in runs(bins.values()) {
        let densities = entry(table, rows.start, all);
        densities.surfaces = surfaces.value(rows.start).unsigned_abs() as usize;
        for row in rows {
            let bin = bins.value(row);
            densities.mean.push((bin, mean.value(row)));
            densities.normal.push((bin, normal.value(row)));
            if deviation.is_valid(row) {
                densities.deviation.push((bin, deviation.value(row)));
            }
        }
    }
    Ok(())
}

/// Adds the densities of single surfaces to `all`. For parameter points without pooled densities,
/// also adds their mean.
fn single(table: &Table, all: &mut Vec<Densities>) -> Result<(), TableError> {
    let (bins, density) = (table.reals(BIN.name)?, table.reals(DENSITY.name)?);
    let mut unpooled: Vec<Densities> = Vec::new();
    for rows in runs(bins.values()) {
        let curve = rows.clone().map(|row| (bins.value(row), density.value(row)));
        let point = entry(table, rows.start, all).point.clone();
        let pooled = all.iter_mut().find(|known| known.point == point && known.surfaces > 0);
        let densities = match pooled {
            Some(densities) => densities,
            None => entry(table, rows.start, &mut unpooled),
        };
        densities.single.push(curve.collect());
    }
    all.retain(|densities| densities.surfaces > 0);
    all.extend(unpooled.into_iter().map(Densities::averaged));
    all.iter_mut().for_each(|densities| densities.single.truncate(SINGLE));
    Ok(())
}

/// Returns linear and logarithmic charts of the densities of measured surfaces, and their caption,
/// or `None` without measured surfaces.
fn measured_charts(data: &FigureData) -> Option<(Vec<Chart>, String)> {
    let maps = data.maps.there();
    let shared = LengthUnit::common(maps.iter().map(|map| map.unit.as_deref()));
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
