//! Maps of heights: measured surfaces as they were measured and as they are pressed, and examples of
//! others (fig. 4).

use std::collections::BTreeSet;

use crate::ReportError;
use crate::charts::figure::{Figure, Panel, in_rows, panel_of_map};
use crate::charts::height_map::HeightMap;
use crate::charts::map_panel::{ColourBar, MapPanel};
use crate::charts::raster::Raster;
use crate::figure::{Definition, Drawn};
use crate::figure_data::FigureData;
use crate::measured::{FILE_IS_GONE, MeasuredMap, MeasuredMaps, ShownMap};
use crate::samples;
use crate::samples::Sample;
use crate::units::{LengthUnit, digits, scale_bar};
use asperity_stages::generate::Heights;

pub const FIGURE: Definition = Definition { name: "surfaces", title: "Maps of heights", draw };

/// Pixels per side of a map.
const PIXELS: usize = 512;
/// Width of a panel, in pixels, beside which there are others; and where there are one or two.
const WIDTHS: [f64; 2] = [230.0, 380.0];

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut samples = samples::of(data.finished)?;
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
    let caption = caption(measured_panels > 0, are_all_measured, has_holes);
    Ok(Drawn::figure(Figure { rows, panel }, caption))
}

fn caption(is_any_measured: bool, are_all_measured: bool, has_holes: bool) -> String {
    let measured = match is_any_measured {
        true => {
            "Heights of the measured surfaces: as measured, with the form removed that the \
             manifest removes, and as pressed, where that is not the same. "
        }
        false => "",
    };
    let others = match (is_any_measured, are_all_measured) {
        (true, true) => "D",
        (true, false) => "Of other parameter points the first surface: d",
        (false, _) => "The first surface of each parameter point: d",
    };
    let holes = match has_holes {
        true => " Red where nothing was measured.",
        false => "",
    };
    format!(
        "{measured}{others}ark blue valleys, yellow peaks, each over its own range of heights.{holes}"
    )
}

/// A measured surface before and after its preparation.
fn of_measured(data: &FigureData, map: &MeasuredMap) -> Vec<Panel> {
    let name = data.styles.label(&map.point).unwrap_or_default();
    let title = |what: &str| match name.is_empty() {
        true => what.to_owned(),
        false => format!("{name} · {what}"),
    };
    let unit = map.unit.as_deref();
    let seen = map.as_measured.as_ref().map(|seen| {
        let missing = match seen.missing > 0.0 {
            true => format!(" · {} % missing", digits(100.0 * seen.missing, 2)),
            false => String::new(),
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

/// The first surface of a parameter point that was not measured.
fn of_sample(data: &FigureData, sample: &Sample) -> Result<MapPanel, ReportError> {
    let surface = sample.draw(data.finished).map_err(ReportError::Surface)?;
    let (grid, heights) = (surface.grid(), surface.heights());
    let title = data.styles.label(&sample.point).unwrap_or_default();
    let size = grid.cell().size();
    Ok(match data.units.at(&sample.point) {
        // Lengths without a unit need no bars.
        None => {
            let raster = Raster::of_heights(grid.nodes(), heights).at_most(PIXELS);
            MapPanel::new(title, raster, size)
        }
        Some(unit) => {
            let heights = HeightMap::of(grid.nodes(), heights, PIXELS);
            panel(title, &ShownMap { heights, size }, Some(unit))
        }
    })
}

/// A map with its bars.
fn panel(title: String, map: &ShownMap, unit: Option<&str>) -> MapPanel {
    let ShownMap { heights, size } = map;
    MapPanel {
        scale_bar: scale_bar(size[0], unit),
        colour_bar: heights.range.map(|range| colour_bar(heights, range, unit)),
        ..MapPanel::new(title, heights.raster.clone(), *size)
    }
}

fn colour_bar(heights: &HeightMap, range: [f64; 2], unit: Option<&str>) -> ColourBar {
    let shared = LengthUnit::common([unit]);
    let range = range.map(|height| shared.factor(unit) * height);
    let scaled = shared.scaled(range[0].abs().max(range[1].abs()));
    let told = |height: f64| {
        let number = digits(scaled.factor * height, 3);
        match shared {
            LengthUnit::Unknown => number,
            LengthUnit::Metre | LengthUnit::Named(_) => format!("{number} {}", scaled.unit),
        }
    };
    ColourBar { colours: heights.colours.clone(), lowest: told(range[0]), highest: told(range[1]) }
}

/// One column for each upper cutoff where all pairs of cutoffs are there, else three.
fn columns(samples: &[Sample]) -> usize {
    let cutoffs = samples.iter().filter_map(|sample| {
        let spectrum = sample.random()?.spectrum;
        Some((spectrum.k_lower, spectrum.k_upper))
    });
    let cutoffs: BTreeSet<(u32, u32)> = cutoffs.collect();
    let lower: BTreeSet<u32> = cutoffs.iter().map(|cutoffs| cutoffs.0).collect();
    let upper: BTreeSet<u32> = cutoffs.iter().map(|cutoffs| cutoffs.1).collect();
    match upper.len() * lower.len() == samples.len() && upper.len() <= 4 {
        true => upper.len(),
        false => samples.len().min(3),
    }
}
