//! How large clusters of contact are, and how round; beyond the paper.

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::Chart;
use crate::charts::figure::Figure;
use crate::distributions;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::FigureData;
use asperity_stages::columns::{
    CLUSTER_AREA, CLUSTER_AREA_SHARE, CLUSTER_COMPACTNESS, CLUSTER_DENSITY,
};
use asperity_tables::column::Column;

pub const FIGURE: Definition = Definition { name: "clusters", title: "Clusters of contact", draw };

/// What the axis of areas says.
const LABEL: &str = "area of a cluster over A₀";

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let numbers = distributions::of(data, [CLUSTER_AREA, CLUSTER_DENSITY])?;
    if numbers.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let loads = distributions::shown_loads(&numbers);
    let areas = numbers.iter().flat_map(|one| &one.loads);
    let areas = areas.flat_map(|(_, points)| points.iter().map(|point| point.x));
    let x = Axis::logarithmic(LABEL);
    let [from, to] = x.ends(areas);
    let x = x.within(from, to);
    let row = |of: Column, y: &dyn Fn([f64; 2]) -> Axis| -> Result<Vec<Chart>, ReportError> {
        let found = distributions::of(data, [CLUSTER_AREA, of])?;
        let charts = loads.iter().filter_map(|&load| {
            let empty = Chart::new(x.clone(), y(distributions::range(&found, load)?));
            Some(distributions::chart(data, &found, load, &empty))
        });
        Ok(charts.collect())
    };
    let rows = vec![
        row(CLUSTER_DENSITY, &|[least, most]| {
            Axis::logarithmic("clusters per ln(area)").within(0.5 * least, 2.0 * most)
        })?,
        row(CLUSTER_AREA_SHARE, &|_| Axis::linear("share of A₀ covered"))?,
        row(CLUSTER_COMPACTNESS, &|_| Axis::linear("4π area/perimeter²").within(0.0, 1.3))?,
    ];
    let caption = format!(
        "Clusters of contact nodes that share edges, by their area, from {}: how many there are, how much of \
         the nominal area they cover together, and how compact they are (1 is a disc). Markers are means \
         over the surfaces, bars {}; of the compactness only where each surface has clusters of that size.",
        sample(&distributions::surfaces(&numbers)),
        data.bars,
    );
    Ok(Drawn::figure(Figure::of_charts(rows, [300.0, 230.0]), caption))
}
