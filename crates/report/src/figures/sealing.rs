//! From which area and which load on no channel of gap leads through; beyond the paper.

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::FigureData;
use crate::styles::Styles;
use asperity_stages::columns::{K_LOWER, SURFACES};
use asperity_tables::table::{Table, TableError};

pub const FIGURE: Definition =
    Definition { name: "sealing", title: "Where the interface seals", draw };

/// Where the gap of isotropic surfaces stops percolating by Wang & Müser (2020).
const WANG_MUSER: f64 = 0.415;
/// The same by Bruggeman's effective medium, as by Persson (2008).
const BRUGGEMAN: f64 = 0.5;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let wanted = ["percolation_area_corrected", "percolation_load", K_LOWER.name];
    let Some(stage) = data.finished.with(&wanted).next() else {
        return Ok(Drawn::NotAsked);
    };
    let table = &stage.table;
    let chart = |quantity: &str, label: &str| -> Result<Chart, TableError> {
        let mut chart = Chart::new(Axis::octaves("k_lower"), Axis::linear(label));
        chart.series = thresholds(data, table, quantity)?;
        Ok(chart)
    };
    let mut areas = chart("percolation_area_corrected", "contact area A/A₀, corrected")?;
    // Surfaces with a grain seal along and across it at different areas and have no mean of both.
    if areas.series.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let cutoffs = areas.series.iter().flat_map(|one| &one.points);
    let [from, to] = areas.x.ends(cutoffs.map(|point| point.x));
    for (area, label, dash) in [
        (WANG_MUSER, "Wang & Müser 2020: 0.415", Dash::Dashed),
        (BRUGGEMAN, "effective medium: 0.5", Dash::Dotted),
    ] {
        let style = Style::line(Colour::Text, dash, 1.5);
        let line = Series::new([(from, area), (to, area)], style);
        areas.series.push(line.named(label));
    }
    areas.x = areas.x.within(from, to);
    let mut loads = chart("percolation_load", "load p₀/(E* h′)")?;
    loads.x = loads.x.within(from, to);
    let surfaces = table.integers(SURFACES.name)?.values().iter();
    let surfaces: Vec<usize> = surfaces.map(|count| count.unsigned_abs() as usize).collect();
    let caption = format!(
        "Contact area and load from which on no channel of gap leads through the cell, mean of both \
         directions and of the surfaces, from {}; bars are intervals by resampling of whole surfaces. The \
         area is corrected for the mesh. Single surfaces scatter the more, the fewer of their longest waves \
         fit the cell.",
        sample(&surfaces),
    );
    Ok(Drawn::figure(Figure::of_two(areas, loads), caption))
}

/// The thresholds of a quantity with their intervals, a series for each parameter point.
fn thresholds(data: &FigureData, table: &Table, quantity: &str) -> Result<Vec<Series>, TableError> {
    let column = |ending: &str| table.reals(&format!("{quantity}{ending}"));
    let (value, lower, upper) = (column("")?, column("_lower")?, column("_upper")?);
    let cutoffs = table.integers(K_LOWER.name)?;
    let points: Vec<_> = (0..table.rows()).map(|row| ensembles::point(table, row)).collect();
    let styles = Styles::of(&points, &data.files);
    let is_known = |&row: &usize| value.is_valid(row) && cutoffs.is_valid(row);
    let series = (0..table.rows()).filter(is_known).map(|row| {
        let has_interval = lower.is_valid(row) && upper.is_valid(row);
        let label = styles.label(&points[row]);
        Series {
            points: vec![DataPoint {
                x: cutoffs.value(row) as f64,
                y: value.value(row),
                bar: has_interval.then(|| [lower.value(row), upper.value(row)]),
            }],
            style: styles.markers(&points[row]),
            label: Some(label.unwrap_or_else(|| "the surfaces".to_owned())),
        }
    });
    Ok(series.collect())
}
