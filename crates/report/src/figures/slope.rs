//! Slope of the area under light load with fits of the contact evolution law (fig. 6).

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::Slope;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{COUNTED_AREA, FigureData, LIGHT, LOAD_LABEL};
use asperity_contact::theory::law::{ContactEvolution, KAPPA_BGT};
use asperity_contact::theory::persson;
use asperity_stages::correct::AS_COUNTED;
use asperity_tables::table::{Table, TableError};

pub const FIGURE: Definition =
    Definition { name: "slope", title: "Slope of the contact area under light load", draw };

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let axis = Axis::linear(LOAD_LABEL).within(0.0, 1.05 * LIGHT);
    let mut chart = Chart::new(axis, Axis::linear("slope d(A/A₀)/dy"));
    let mut kappas: Vec<String> = Vec::new();
    for ensemble in &data.measured {
        let slopes = ensemble.slope(COUNTED_AREA)?;
        let style = data.styles.markers(&ensemble.point);
        let label = data.label(ensemble);
        chart.series.push(points(&slopes, style).named(label));
    }
    if chart.series.iter().all(|series| series.points.len() < 2) {
        let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
        return Ok(Drawn::missing("measured contacts under several loads up to 0.06", lines));
    }
    for stage in data.finished.with(&["law", "kappa", "beta", "mu", "fitted_to"]) {
        for fit in fits(&stage.table)? {
            let style = Style::line(data.styles.colour(&fit.point), Dash::Solid, 2.0);
            let range = [LIGHT * 1e-3, LIGHT];
            let curve = Series::curve(|load| fit.law.slope(load), range, Spacing::Linear, style);
            chart.series.push(curve);
            let kappa = format!("κ = {:.3} √(2π)", fit.law.kappa / KAPPA_BGT);
            if !kappas.contains(&kappa) {
                kappas.push(kappa);
            }
        }
    }
    let persson = Style::line(Colour::Text, Dash::Dashed, 1.8);
    let range = [0.0, LIGHT];
    chart
        .series
        .push(Series::curve(persson::slope, range, Spacing::Linear, persson).named("Persson 2001"));
    let fits = match kappas.is_empty() {
        true => "The study has no fit of the contact evolution law with a given κ to the counted \
                 area."
            .to_owned(),
        false => format!(
            "Lines are least-squares fits of the contact evolution law with {}.",
            kappas.join(", ")
        ),
    };
    let caption = format!(
        "Slope of the mean area curve between neighbouring loads, from {}; area as counted on the \
         mesh. Bars are {}. {fits}{}",
        sample(&data.sample()),
        data.bars,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::of(chart), caption))
}

fn points(slopes: &[Slope], style: Style) -> Series {
    let is_light = |slope: &&Slope| slope.load <= LIGHT;
    let points = slopes.iter().filter(is_light).map(|slope| DataPoint {
        x: slope.load,
        y: slope.slope,
        bar: slope.bar,
    });
    Series { points: points.collect(), style, label: None }
}

struct Fit {
    point: ensembles::Point,
    law: ContactEvolution,
}

/// The fits with a given κ to the counted area.
fn fits(table: &Table) -> Result<Vec<Fit>, TableError> {
    let texts = |name: &str| table.texts(name);
    let (laws, kappas) = (texts("law")?, texts("kappa_is")?);
    let corrections = table.has("correction").then(|| texts("correction")).transpose()?;
    let [kappa, beta, mu] = ["kappa", "beta", "mu"].map(|name| table.reals(name));
    let (kappa, beta, mu) = (kappa?, beta?, mu?);
    let is_shown = |&row: &usize| {
        let counted = corrections.is_none_or(|column| column.value(row) == AS_COUNTED);
        let is_known = beta.is_valid(row) && mu.is_valid(row) && kappa.is_valid(row);
        counted
            && is_known
            && laws.value(row) == "contact-evolution"
            && kappas.value(row) == "given"
    };
    let fit = |row: usize| Fit {
        point: ensembles::point(table, row),
        law: ContactEvolution { kappa: kappa.value(row), beta: beta.value(row), mu: mu.value(row) },
    };
    Ok((0..table.rows()).filter(is_shown).map(fit).collect())
}
