//! Examples of surfaces (fig. 4).

use std::collections::BTreeSet;

use crate::figures::figure::{Figure, Panel, panel_of_map};
use crate::figures::raster::Raster;
use crate::report::ReportError;
use crate::report::figure::{Definition, Drawn};
use crate::report::figure_data::FigureData;
use crate::report::samples::{self, Sample};
use crate::stages::StageError;
use crate::stages::generate::Heights;

pub const FIGURE: Definition = Definition {
    name: "surfaces",
    title: "Examples of surfaces",
    draw,
};

/// Pixels per side of a map.
const PIXELS: usize = 512;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut samples = samples::of(data)?;
    samples.retain(|sample| sample.params.heights != Heights::None);
    if samples.is_empty() {
        let lines = data.lines_of_surfaces();
        return Ok(Drawn::missing("surfaces with heights", lines));
    }
    let labels = samples
        .iter()
        .map(|sample| data.styles.label(&sample.point).unwrap_or_default());
    let labels: Vec<String> = labels.collect();
    let mut panels = Vec::new();
    for (sample, title) in samples.iter().zip(labels) {
        let surface = match sample.draw(data) {
            Err(StageError::Source(_)) => {
                let needs = "the file of a measured surface, which is gone or has changed";
                return Ok(Drawn::Gone { needs });
            }
            drawn => drawn.map_err(ReportError::Surface)?,
        };
        panels.push(Panel::Map {
            title,
            raster: Raster::of_heights(surface.grid().nodes(), surface.heights()).at_most(PIXELS),
            size: surface.grid().cell().size(),
        });
    }
    let panel = panel_of_map(panels.iter(), 230.0);
    let columns = columns(&samples);
    let mut rows: Vec<Vec<Panel>> = Vec::new();
    while !panels.is_empty() {
        let rest = panels.split_off(columns.min(panels.len()));
        rows.push(std::mem::replace(&mut panels, rest));
    }
    let caption = "The first surface of each parameter point: dark blue valleys, yellow peaks, \
                   each over its own range of heights.";
    Ok(Drawn::figure(Figure { rows, panel }, caption))
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
