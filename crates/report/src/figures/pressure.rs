//! Area and mean gap against the mean pressure, in the units of the study; beyond the paper.

use super::gap;
use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles::{EnsembleCurves, Mean};
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{AREA_LABEL, COUNTED_AREA, FigureData};
use crate::units;
use crate::units::{Scaled, digits};
use asperity_contact::theory::persson;
use asperity_stages::columns::{EFFECTIVE_MODULUS, PRESSURE};

pub const FIGURE: Definition =
    Definition { name: "pressure", title: "Area and mean gap against the mean pressure", draw };

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
        return Ok(Drawn::missing("loads on bodies with a modulus: pressures in its unit", lines));
    }
    let gaps = gap::gaps(data, pressed.iter().copied())?;
    let mut pressures = Vec::new();
    for ensemble in &pressed {
        pressures.push(ensemble.mean(PRESSURE.name)?);
    }
    let scaled = unit_of(data, &pressed, &pressures);
    let in_unit = |pressure: &mut Mean| *pressure = pressure.times(scaled.factor);
    pressures.iter_mut().flatten().for_each(in_unit);
    let axis = || Axis::logarithmic(format!("mean pressure p₀, in {}", scaled.unit));
    let mut areas = Chart::new(axis(), Axis::logarithmic(AREA_LABEL));
    let mut mean_gaps = Chart::new(axis(), Axis::linear(gaps.label));
    let mut moduli: Vec<String> = Vec::new();
    for ((ensemble, gaps), pressures) in pressed.iter().zip(&gaps.means).zip(&pressures) {
        let style = data.styles.markers(&ensemble.point);
        let against =
            |means: &[Mean]| Series { points: against(pressures, means), style, label: None };
        let area = against(&ensemble.mean(COUNTED_AREA)?);
        areas.series.push(area.named(data.label(ensemble)));
        mean_gaps.series.push(against(gaps));
        areas.series.extend(theory(data, ensemble, pressures));
        moduli.extend(modulus(ensemble).map(|modulus| told(modulus, &scaled)));
    }
    moduli.dedup();
    // One entry for all of its lines.
    let persson = Style::line(Colour::Text, Dash::Dashed, 1.2);
    areas.series.push(Series::new([], persson).named("Persson 2001"));
    let caption = format!(
        "Contact area fraction and, to the right, mean gap against the mean pressure, from {}; \
         area as counted on the mesh. E* = {}. Points are means over the surfaces, bars {}. An exponential \
         relation of pressure and gap is a straight line. {}{}",
        sample(&pressed.iter().map(|one| one.surfaces).collect::<Vec<_>>()),
        moduli.join(", "),
        data.bars,
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::of_two(areas, mean_gaps), caption))
}

/// The unit of the pressures.
fn unit_of(data: &FigureData, pressed: &[&EnsembleCurves], pressures: &[Vec<Mean>]) -> Scaled {
    let moduli = pressed.iter().filter_map(|one| modulus(one));
    let least_modulus = moduli.fold(f64::INFINITY, f64::min);
    let pressures = pressures.iter().flatten();
    let largest = pressures.fold(0.0_f64, |most, pressure| most.max(pressure.mean));
    units::of_pressures(largest, least_modulus, &data.unit_of_length())
}

/// E* with its unit, where that is known.
fn told(modulus: f64, pressures: &Scaled) -> String {
    match pressures.unit.strip_suffix("Pa") {
        Some(_) => {
            let Scaled { factor, unit } = units::in_pascals(modulus);
            format!("{} {unit}", digits(factor * modulus, 5))
        }
        None => format!("{modulus:e}"),
    }
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
        .map(|(pressure, mean)| DataPoint { x: pressure.mean, y: mean.mean, bar: mean.bar() })
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
