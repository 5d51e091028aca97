//! Asperity models beside the boundary-element solution, on the same surfaces; beyond the paper.

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::{EnsembleCurves, Mean};
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{COUNTED_AREA, FigureData, LOAD_LABEL, series};
use asperity_stages::columns::{
    AREA_CORRECTED, ASPERITY_AREA_FRACTION, INTERACTION, LOAD, SURFACE,
};

pub const FIGURE: Definition =
    Definition { name: "asperities", title: "Asperity models beside the solution", draw };

/// Interactions in the order of what they know.
const INTERACTIONS: [(&str, &str); 3] =
    [("none", "no interaction"), ("mean-field", "mean field"), ("explicit", "each by all others")];

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let wanted = [SURFACE.name, LOAD.name, INTERACTION.name, ASPERITY_AREA_FRACTION.name];
    let mut models = Vec::new();
    for stage in data.finished.with(&wanted) {
        models.extend(ensembles::of(&stage.table, data.bars)?);
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
        "Contact area of Hertz' ellipses at the summits over that of the boundary-element solution, {}, surface \
         by surface, from {}: without interaction, in the mean field of the pressure, and each summit \
         displaced by the forces of all others. Points are means over the surfaces, bars {}. Where ellipses \
         overlap the models count area twice.",
        match correction {
            Some(correction) => format!("corrected as in `{correction}`"),
            None => "as counted on the mesh".to_owned(),
        },
        sample(&surfaces),
        data.bars,
    );
    let figure = Figure::of_charts(vec![charts], [300.0, 270.0]);
    Ok(Drawn::figure(figure, caption))
}

fn interaction<'a>(model: &'a EnsembleCurves) -> Option<&'a str> {
    model.point.get(INTERACTION.name).map(String::as_str)
}

/// Whether a solution is of the surfaces of a model.
fn is_of(solved: &EnsembleCurves, model: &EnsembleCurves) -> bool {
    let own = model.point.iter();
    own.filter(|(name, _)| *name != INTERACTION.name)
        .all(|(name, value)| solved.point.get(name) == Some(value))
}

/// The ratios of all charts between the same ends.
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
    chart.series.push(line.named("as solved"));
    chart
}
