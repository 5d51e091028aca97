//! Area and mean gap against the mean pressure, in the units of the study; beyond the paper.

use crate::contact::theory::persson;
use crate::figures::axis::{Axis, Spacing};
use crate::figures::chart::{Chart, DataPoint, Series};
use crate::figures::colour::Colour;
use crate::figures::figure::Figure;
use crate::figures::style::{Dash, Style};
use crate::report::ReportError;
use crate::report::ensembles::{EnsembleCurves, Mean};
use crate::report::figure::{Definition, Drawn, sample};
use crate::report::figure_data::{AREA_LABEL, COUNTED_AREA, FigureData};
use crate::stages::columns::{EFFECTIVE_MODULUS, MEAN_GAP, PRESSURE};

pub const FIGURE: Definition = Definition {
    name: "pressure",
    title: "Area and mean gap against the mean pressure",
    draw,
};

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let pressed = data.measured.iter();
    let pressed = pressed.filter(|one| modulus(one).is_some());
    let pressed: Vec<&EnsembleCurves> = pressed.collect();
    if pressed.is_empty() {
        // Two bodies in place of E*, whose units are the reader's.
        let lines = data.lines_of_loads(
            "{ to = 0.06, steps = 50 }\n\
             bodies = [{ youngs_modulus = 210e9, poisson_ratio = 0.3 }]",
        );
        return Ok(Drawn::missing(
            "loads on bodies with a modulus: pressures in its unit",
            lines,
        ));
    }
    let axis = || Axis::logarithmic("mean pressure p₀, in the unit of E*");
    let mut areas = Chart::new(axis(), Axis::logarithmic(AREA_LABEL));
    let gap = format!("mean gap, in {}", data.unit_of_length());
    let mut gaps = Chart::new(axis(), Axis::linear(gap));
    let mut moduli: Vec<String> = Vec::new();
    for ensemble in &pressed {
        let pressures = ensemble.mean(PRESSURE.name)?;
        let style = data.styles.markers(&ensemble.point);
        let against = |means: &[Mean]| Series {
            points: against(&pressures, means),
            style,
            label: None,
        };
        let area = against(&ensemble.mean(COUNTED_AREA)?);
        areas.series.push(area.named(data.label(ensemble)));
        gaps.series.push(against(&ensemble.mean(MEAN_GAP.name)?));
        areas.series.extend(theory(data, ensemble, &pressures));
        moduli.extend(modulus(ensemble).map(|modulus| format!("{modulus:e}")));
    }
    moduli.dedup();
    // One entry for all of its lines.
    let persson = Style::line(Colour::Text, Dash::Dashed, 1.2);
    areas
        .series
        .push(Series::new([], persson).named("Persson 2001"));
    let caption = format!(
        "Contact area fraction and, to the right, mean gap against the mean pressure, from {}; \
         area as counted on the mesh. E* = {}, in whose unit pressures are: pascals if it is given \
         in pascals. Points are means over the surfaces, bars {}. An exponential \
         relation of pressure and gap is a straight line. {}{}",
        sample(&pressed.iter().map(|one| one.surfaces).collect::<Vec<_>>()),
        moduli.join(", "),
        data.bars,
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::of_two(areas, gaps), caption))
}

/// E*, if it was given: pressures in units of it are what the other figures show.
fn modulus(ensemble: &EnsembleCurves) -> Option<f64> {
    let modulus = ensemble.point.get(EFFECTIVE_MODULUS.name)?.parse().ok();
    modulus.filter(|&modulus| modulus != 1.0)
}

/// Means against the mean pressures of the same loads.
fn against(pressures: &[Mean], means: &[Mean]) -> Vec<DataPoint> {
    let pairs = pressures.iter().zip(means);
    pairs
        .map(|(pressure, mean)| DataPoint {
            x: pressure.mean,
            y: mean.mean,
            bar: mean.bar(),
        })
        .collect()
}

/// Persson's theory over the pressures of an ensemble.
fn theory(data: &FigureData, ensemble: &EnsembleCurves, pressures: &[Mean]) -> Option<Series> {
    let (first, last) = (pressures.first()?, pressures.last()?);
    let unit = first.mean / first.load;
    let style = Style::line(data.styles.colour(&ensemble.point), Dash::Dashed, 1.2);
    let range = [first.mean, last.mean];
    let curve = |pressure: f64| persson::area(pressure / unit);
    Some(Series::curve(curve, range, Spacing::Logarithmic, style))
}
