//! Curves of theories in figures of area fractions.

use asperity_stages::aggregate::{Model, nayak_parameters};
use asperity_stages::columns::LOAD;
use asperity_tables::table::TableError;

use crate::charts::axis::Spacing;
use crate::charts::chart::Series;
use crate::charts::style::{Colour, Dash, Style};
use crate::plotted::Points;

/// Number of loads at which a curve against the load is computed. Asperity models take
/// milliseconds for each.
const LOADS: usize = 60;

/// Points of a series as (x, table row), the points of its quantity, and the colour of the series.
pub type SeriesPoints<'a> = (Vec<(f64, usize)>, &'a Points, Colour);

/// The theories of a figure.
pub struct Theories<'a> {
    models: &'a [Model],
    is_against_load: bool,
    /// Name of a theory in the legend.
    name: &'a dyn Fn(Model) -> String,
}

impl Theories<'_> {
    pub fn new<'a>(
        models: &'a [Model],
        x: &str,
        name: &'a dyn Fn(Model) -> String,
    ) -> Theories<'a> {
        Theories { models, is_against_load: x == LOAD.name, name }
    }

    /// Returns the curves beside the series of a panel, with entries of the legend. `factor`
    /// converts x to the unit of the axis.
    ///
    /// Against the load, a theory is a smooth curve; a theory that needs no spectrum has one curve
    /// for all series. Against a parameter, its area is computed for the load and the spectrum of
    /// each point of the data.
    pub fn curves(
        &self,
        series: &[SeriesPoints],
        factor: f64,
        spacing: Spacing,
    ) -> Result<Vec<Series>, TableError> {
        const DASHES: [Dash; 4] = [Dash::Dashed, Dash::Dotted, Dash::DashDot, Dash::Solid];
        let mut curves = Vec::new();
        for (index, &model) in self.models.iter().enumerate() {
            let dash = DASHES[index % DASHES.len()];
            let width = if index < DASHES.len() { 1.6 } else { 2.8 };
            let is_common = self.is_against_load && model.asperities().is_none();
            if is_common && !series.is_empty() {
                let loads =
                    series.iter().flat_map(|(points, ..)| points.iter().map(|point| point.0));
                let style = Style::line(Colour::Text, dash, width);
                let curve = curve(range(loads), spacing, |load| model.area(load, None));
                curves.push(Series::new(scaled(curve, factor), style));
            }
            let mut own: Vec<(Vec<(f64, f64)>, Colour)> = Vec::new();
            for (points, data, colour) in series.iter().filter(|_| !is_common) {
                let curve = self.of_series(model, points, data, spacing)?;
                match own.iter_mut().find(|(known, _)| *known == curve) {
                    // Series under one load have one curve of a theory without a spectrum.
                    Some((_, shared)) => *shared = Colour::Text,
                    None => own.push((curve, *colour)),
                }
            }
            let is_alone = series.len() == 1;
            for (curve, colour) in own {
                let colour = if is_alone { Colour::Text } else { colour };
                let style = Style::line(colour, dash, width);
                curves.push(Series::new(scaled(curve, factor), style));
            }
            let entry = Style::line(Colour::Text, dash, width);
            curves.push(Series::new([], entry).named((self.name)(model)));
        }
        Ok(curves)
    }

    fn of_series(
        &self,
        model: Model,
        points: &[(f64, usize)],
        data: &Points,
        spacing: Spacing,
    ) -> Result<Vec<(f64, f64)>, TableError> {
        let nayak = match model.asperities() {
            Some(_) => nayak_parameters(&data.table)?,
            None => vec![None; data.table.rows()],
        };
        if self.is_against_load {
            let loads = points.iter().map(|point| point.0);
            let nayak = points.first().and_then(|&(_, row)| nayak[row]);
            return Ok(curve(range(loads), spacing, |load| model.area(load, nayak)));
        }
        let loads = data.table.reals(LOAD.name)?;
        let areas = points.iter().filter_map(|&(x, row)| {
            let load = arrow::array::Array::is_valid(loads, row).then(|| loads.value(row))?;
            Some((x, model.area(load, nayak[row])?))
        });
        Ok(areas.collect())
    }
}

fn scaled(points: Vec<(f64, f64)>, factor: f64) -> impl Iterator<Item = (f64, f64)> {
    points.into_iter().map(move |(x, y)| (factor * x, y))
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| {
        [least.min(value), most.max(value)]
    })
}

fn curve(
    [from, to]: [f64; 2],
    spacing: Spacing,
    area: impl Fn(f64) -> Option<f64>,
) -> Vec<(f64, f64)> {
    let load = |step: usize| {
        let share = step as f64 / (LOADS - 1) as f64;
        match spacing {
            Spacing::Linear => from + share * (to - from),
            Spacing::Logarithmic | Spacing::Octaves => from * (to / from).powf(share),
        }
    };
    (0..LOADS).map(load).filter_map(|load| Some((load, area(load)?))).collect()
}

/// Returns the usual name of a theory in legends.
pub fn name(model: Model) -> &'static str {
    match model {
        Model::Persson => "Persson 2001",
        Model::BushGibsonThomas => "Bush, Gibson & Thomas 1975",
        Model::Greenwood2006 => "Greenwood 2006",
        Model::MeanCurvature => "spheres of the mean curvature",
        Model::GreenwoodMccool => "Greenwood & Williamson 1966, McCool 1986",
        Model::BgtAsymptote => "asymptote √(2π) y of BGT",
        Model::PennyCrack => "isolated cracks",
    }
}
