//! The flow factor of the gap against the load, along both axes, with the loads from which on the gap is
//! sealed; beyond the paper.

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, Series};
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::{EnsembleCurves, Mean};
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{FigureData, LOAD_LABEL, series};
use asperity_stages::columns::{FLOW_FACTOR_X, FLOW_FACTOR_Y};
use asperity_tables::column::Column;
use asperity_tables::table::TableError;

pub const FIGURE: Definition = Definition { name: "flow", title: "Flow through the gap", draw };

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
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
        "A fit with `law = \"gap-percolation\"` adds the loads from which on the gap is sealed."
    } else {
        "Dotted lines are the mean loads from which on the gap does not percolate along this direction."
    };
    let caption = format!(
        "Flow factor of the gap against load, from {}: flow over that between smooth walls at the mean gap. \
         Points are means over the surfaces, those without flow counted as zero, bars {}, where they end \
         above a tenth of the mean. {sealed}",
        sample(&data.sample()),
        data.bars,
    );
    Ok(Drawn::figure(Figure::of_two(left, right), caption))
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

/// The means that are above zero, with the bars that end above a tenth of them: of a single surface that
/// flows among many the bar ends at zero, but for rounding.
fn flowing(ensemble: &EnsembleCurves, column: Column) -> Result<Vec<Mean>, TableError> {
    let means = ensemble.mean(column.name)?.into_iter();
    let flowing = means.filter(|flow| flow.mean > 0.0).map(|flow| Mean {
        half_bar: flow.half_bar.filter(|half| *half < 0.9 * flow.mean),
        ..flow
    });
    Ok(flowing.collect())
}

/// Returns the fitted loads above which the gap of each point does not percolate.
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

/// The smallest and the largest flow of charts.
fn range(charts: [&Chart; 2]) -> [f64; 2] {
    let series = charts.into_iter().flat_map(|chart| &chart.series);
    let flows = series.flat_map(|series| &series.points).map(|point| point.y);
    flows.fold([f64::INFINITY, 0.0], |[least, most], flow| [least.min(flow), most.max(flow)])
}
