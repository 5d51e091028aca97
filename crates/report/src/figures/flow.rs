//! Area and load at which the gap is sealed, and the flow through the gap along both axes. The
//! paper does not show these quantities.

use arrow::array::Array;

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::{self, EnsembleCurves, Mean};
use crate::figure_data::{FigureData, interval, series};
use crate::figures::{Definition, Drawn, sample};
use crate::loads::LOAD_LABEL;
use crate::styles::Styles;
use asperity_stages::columns::{FLOW_FACTOR_X, FLOW_FACTOR_Y, K_LOWER, SURFACES};
use asperity_tables::column::Column;
use asperity_tables::table::{Table, TableError};

pub const SEALING: Definition =
    Definition { name: "sealing", title: "Where the interface seals", draw: draw_sealing };

/// Area at which the gap of isotropic surfaces stops percolating, by Wang & Müser (2020).
const WANG_MUSER: f64 = 0.415;
/// Area at which the gap stops percolating, by Bruggeman's effective-medium theory, as used by
/// Persson (2008).
const BRUGGEMAN: f64 = 0.5;

fn draw_sealing(data: &FigureData) -> Result<Drawn, ReportError> {
    let wanted = ["percolation_area_corrected", "percolation_load", K_LOWER.name];
    let Some(stage) = data.finished.with(&wanted).next() else {
        return Ok(Drawn::NotAsked);
    };
    let table = &stage.table;
    let chart = |quantity: &str, label: &str| -> Result<Chart, TableError> {
        let mut chart = Chart::new(Axis::octaves("k_lower"), Axis::linear(label));
        chart.series = sealing_thresholds(data, table, quantity)?;
        Ok(chart)
    };
    let mut areas = chart("percolation_area_corrected", "contact area A/A₀, corrected")?;
    // Anisotropic surfaces seal at different areas along x and y and have no mean of both.
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
        "Contact area and load at which the last channel of the gap through the cell closes, \
         averaged over both directions and the surfaces, from {}; bars are intervals from \
         resampling whole surfaces. The area is corrected for the mesh. The scatter between \
         surfaces is larger for small k_lower.",
        sample(&surfaces),
    );
    Ok(Drawn::figure(Figure::side_by_side(areas, loads), caption))
}

/// Returns the thresholds of a quantity with their intervals, one series for each parameter point.
fn sealing_thresholds(
    data: &FigureData,
    table: &Table,
    quantity: &str,
) -> Result<Vec<Series>, TableError> {
    let column = |ending: &str| table.reals(&format!("{quantity}{ending}"));
    let (value, lower, upper) = (column("")?, column("_lower")?, column("_upper")?);
    let cutoffs = table.integers(K_LOWER.name)?;
    let points: Vec<_> = (0..table.rows()).map(|row| ensembles::point(table, row)).collect();
    let styles = Styles::new(&points, &data.files);
    let is_known = |&row: &usize| value.is_valid(row) && cutoffs.is_valid(row);
    let series = (0..table.rows()).filter(is_known).map(|row| Series {
        points: vec![DataPoint {
            x: cutoffs.value(row) as f64,
            y: value.value(row),
            bar: interval(lower, upper, row),
        }],
        style: styles.markers(&points[row]),
        label: Some(styles.name(&points[row], "the surfaces")),
    });
    Ok(series.collect())
}

pub const FLOW: Definition =
    Definition { name: "flow", title: "Flow through the gap", draw: draw_flow };

fn draw_flow(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut left = chart(data, "along x", FLOW_FACTOR_X)?;
    let mut right = chart(data, "along y", FLOW_FACTOR_Y)?;
    if left.series.is_empty() && right.series.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let thresholds =
        [thresholds(data, "percolation_load_x")?, thresholds(data, "percolation_load_y")?];
    let range = range([&left, &right]);
    for (chart, thresholds) in [&mut left, &mut right].into_iter().zip(&thresholds) {
        for &(load, style) in thresholds {
            let ends = range.map(|flow| (load, flow));
            chart.series.push(Series::new(ends, style));
        }
    }
    let sealed = if thresholds.iter().all(Vec::is_empty) {
        "A fit with `law = \"gap-percolation\"` adds the loads above which the gap is sealed."
    } else {
        "Dotted lines are the mean loads above which the gap does not percolate in this direction."
    };
    let caption = format!(
        "Flow factor of the gap against load, from {}: the ratio of the flow to that between \
         smooth walls at the mean gap. Points are means over the surfaces, with zero for sealed \
         ones. Bars are {}; bars that reach below a tenth of the mean are omitted. {sealed}",
        sample(&data.sample()),
        data.bars,
    );
    Ok(Drawn::figure(Figure::side_by_side(left, right), caption))
}

fn chart(data: &FigureData, title: &str, column: Column) -> Result<Chart, TableError> {
    let label = "flow factor 12 μ q/(ū³ ∇p)";
    let mut chart = Chart::new(Axis::linear(LOAD_LABEL), Axis::logarithmic(label));
    title.clone_into(&mut chart.title);
    for ensemble in data.measured.iter().filter(|one| one.has(column.name)) {
        let means = flowing(ensemble, column)?;
        if !means.is_empty() {
            let style = data.styles.markers(&ensemble.point).joined();
            let points = series(&means, style).named(data.label(ensemble));
            chart.series.push(points);
        }
    }
    Ok(chart)
}

/// Returns the positive means of a flow column. Error bars that reach below a tenth of the mean are
/// removed: if only one surface has flow, the bar would end at zero except for rounding.
fn flowing(ensemble: &EnsembleCurves, column: Column) -> Result<Vec<Mean>, TableError> {
    let means = ensemble.mean(column.name)?.into_iter();
    let flowing = means.filter(|flow| flow.mean > 0.0).map(|flow| Mean {
        half_bar: flow.half_bar.filter(|half| *half < 0.9 * flow.mean),
        ..flow
    });
    Ok(flowing.collect())
}

/// Returns, for each parameter point, the fitted load above which the gap does not percolate, with
/// the style of its line.
fn thresholds(data: &FigureData, column: &str) -> Result<Vec<(f64, Style)>, TableError> {
    let mut thresholds = Vec::new();
    for stage in data.finished.with(&[column]) {
        let loads = stage.table.reals(column)?;
        for row in (0..stage.table.rows()).filter(|&row| loads.is_valid(row)) {
            let colour = data.styles.colour(&ensembles::point(&stage.table, row));
            thresholds.push((loads.value(row), Style::line(colour, Dash::Dotted, 1.5)));
        }
    }
    Ok(thresholds)
}

/// Returns the smallest and the largest y of all points of both charts.
fn range(charts: [&Chart; 2]) -> [f64; 2] {
    let series = charts.into_iter().flat_map(|chart| &chart.series);
    let flows = series.flat_map(|series| &series.points).map(|point| point.y);
    flows.fold([f64::INFINITY, 0.0], |[least, most], flow| [least.min(flow), most.max(flow)])
}
