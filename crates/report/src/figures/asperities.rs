//! Asperity models compared with the boundary-element solution, which the paper does not show.

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::{self, EnsembleCurves, Mean};
use crate::figure_data::{COUNTED_AREA, FigureData, series};
use crate::figures::{Definition, Drawn, sample};
use crate::loads::LOAD_LABEL;
use asperity_stages::columns::{
    AREA_CORRECTED, ASPERITY_AREA_FRACTION, INTERACTION, LOAD, SURFACE,
};

pub const ASPERITIES: Definition = Definition {
    name: "asperities",
    title: "Asperity models beside the solution",
    draw: draw_asperities,
};

/// Values of `interaction`, from the simplest to the most detailed, with the titles of their
/// charts.
const INTERACTIONS: [(&str, &str); 3] = [
    ("none", "no interaction"),
    ("mean-field", "mean field"),
    ("explicit", "explicit interaction"),
];

fn draw_asperities(data: &FigureData) -> Result<Drawn, ReportError> {
    let wanted = [SURFACE.name, LOAD.name, INTERACTION.name, ASPERITY_AREA_FRACTION.name];
    let mut models = Vec::new();
    for stage in data.finished.with(&wanted) {
        models.extend(ensembles::from_table(&stage.table, data.bars)?);
    }
    let correction = data.corrections().first().copied();
    let solved: Vec<&EnsembleCurves> = match correction {
        Some(correction) => data.under(correction).collect(),
        None => data.measured.iter().collect(),
    };
    let column = match correction {
        Some(_) => AREA_CORRECTED.name,
        None => COUNTED_AREA,
    };
    let mut charts = Vec::new();
    let mut surfaces = Vec::new();
    for (word, title) in INTERACTIONS {
        let models = models.iter().filter(|model| interaction(model) == Some(word));
        let beside = models.filter_map(|model| {
            let solved = solved.iter().find(|solved| is_of(solved, model))?;
            Some((model, *solved))
        });
        let mut ratios = Vec::new();
        for (model, solved) in beside {
            let means = model.ratio(ASPERITY_AREA_FRACTION.name, solved, column)?;
            ratios.push((solved, means));
        }
        if !ratios.is_empty() {
            surfaces = ratios.iter().map(|(solved, _)| solved.surfaces).collect();
            charts.push(chart(data, title, &ratios));
        }
    }
    if charts.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    share_the_axis(&mut charts);
    let caption = format!(
        "Ratio of the area of asperity models (Hertzian ellipses at the summits) to the area of \
         the boundary-element solution, {}, from {}. The ratio is computed for each surface. \
         Panels: without interaction, with the displacement by the mean pressure (mean field), and \
         with each summit displaced by the forces on all others. Points are means over the surfaces, bars are {}. The models \
         count the common area of overlapping ellipses twice.",
        match correction {
            Some(correction) => format!("corrected as in `{correction}`"),
            None => "as counted on the mesh".to_owned(),
        },
        sample(&surfaces),
        data.bars,
    );
    let figure = Figure::from_charts(vec![charts], [300.0, 270.0]);
    Ok(Drawn::figure(figure, caption))
}

fn interaction<'a>(model: &'a EnsembleCurves) -> Option<&'a str> {
    model.point.get(INTERACTION.name).map(String::as_str)
}

/// Returns true if the boundary-element solution `solved` has the same surfaces as the asperity
/// model.
fn is_of(solved: &EnsembleCurves, model: &EnsembleCurves) -> bool {
    let own = model.point.iter();
    own.filter(|(name, _)| *name != INTERACTION.name)
        .all(|(name, value)| solved.point.get(name) == Some(value))
}

/// Gives all charts the same range of ratios.
fn share_the_axis(charts: &mut [Chart]) {
    let points = charts.iter().flat_map(|chart| &chart.series);
    let ratios = points.flat_map(|series| series.points.iter().map(|point| point.y));
    let [from, to] = charts[0].y.ends(ratios);
    for chart in charts {
        chart.y = chart.y.clone().within(from, to);
    }
}

fn chart(data: &FigureData, title: &str, ratios: &[(&EnsembleCurves, Vec<Mean>)]) -> Chart {
    let ratio = Axis::linear("area of the model/of the solution");
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), ratio).titled(title);
    for (ensemble, means) in ratios {
        let style = data.styles.markers(&ensemble.point).joined();
        chart.series.push(series(means, style).named(data.label(ensemble)));
    }
    let points = chart.series.iter().flat_map(|one| &one.points);
    let range = chart.x.ends(points.map(|point| point.x));
    let style = Style::line(Colour::Text, Dash::Dashed, 1.4);
    let line = Series::curve(|_| 1.0, range, Spacing::Logarithmic, style);
    chart.series.push(line.named("solution"));
    chart
}
