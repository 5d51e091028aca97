//! Growth of the mean contact pressure with the load (fig. 17).

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{AREA_LABEL, COUNTED_AREA, FigureData};
use crate::tables::FinishedStage;
use asperity_stages::columns::CORRECTION;
use asperity_stages::correct::AS_COUNTED;

pub const FIGURE: Definition =
    Definition { name: "pressure-growth", title: "Growth of the mean contact pressure", draw };

/// The area to which the growth is shown: near full contact all curves fall to zero.
const MOST: f64 = 0.5;
/// Differences that tell a power law.
const FEWEST: usize = 3;

/// Guides pass above the data, by this factor.
const GUIDES_ABOVE: f64 = 1.8;

/// The exponents that the paper draws.
const GUIDES: [(f64, Colour, Dash); 2] =
    [(-0.7, Colour::Text, Dash::Dashed), (-0.9, Colour::Muted, Dash::DashDot)];

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut chart =
        Chart::new(Axis::logarithmic(AREA_LABEL), Axis::logarithmic("dp̄/dp₀, with p̄ = p₀ A₀/A"));
    let (mut all, mut rising) = (0, 0);
    for ensemble in &data.measured {
        let mut growth = ensemble.pressure_growth(COUNTED_AREA)?;
        growth.retain(|one| one.area < MOST);
        all += growth.len();
        growth.retain(|one| one.growth > 0.0);
        rising += growth.len();
        let style = data.styles.markers(&ensemble.point);
        let points =
            growth.iter().map(|one| DataPoint { x: one.area, y: one.growth, bar: one.bar });
        chart.series.push(Series {
            points: points.collect(),
            style,
            label: Some(data.label(ensemble)),
        });
    }
    let Some(extent) = Extent::of(&chart.series) else {
        let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
        return Ok(Drawn::missing("measured contacts under several light loads", lines));
    };
    let fits = fits(data, extent.areas)?;
    let told = match fits.is_empty() {
        true => "A fit with `law = \"mean-pressure\"` adds the power laws of the spectra.",
        false => "Lines in colours are the fitted power laws.",
    };
    chart.series.extend(fits);
    let [least, most] = extent.growths;
    let top = GUIDES_ABOVE * extent.growth_in_the_middle;
    for (exponent, colour, dash) in GUIDES {
        chart.series.push(extent.guide(top, exponent, colour, dash));
    }
    // Bars that reach far down, or below zero, would take the axis with them.
    chart.y = chart.y.within(least / 1.5, 3.0 * most.max(top));
    let caption = format!(
        "Derivative of the mean contact pressure p̄ with respect to the mean pressure p₀, by \
         differences of the mean curves, against the area fraction up to {MOST}; from {}, area as \
         counted on the mesh; bars are {}. Straight black and grey lines are guides. {told} In \
         {} of {all} steps of the load p̄ falls: these have no logarithm and are left out.",
        sample(&data.sample()),
        data.bars,
        all - rising,
    );
    Ok(Drawn::figure(Figure::of(chart), caption))
}

/// Where the points of a chart lie.
struct Extent {
    areas: [f64; 2],
    growths: [f64; 2],
    /// The largest growth near the geometric middle of the areas.
    growth_in_the_middle: f64,
}

impl Extent {
    /// Of fewer than [`FEWEST`] points, none.
    fn of(series: &[Series]) -> Option<Extent> {
        let points = || series.iter().flat_map(|series| &series.points);
        let ends = |of: fn(&DataPoint) -> f64| {
            let values = || points().map(of);
            [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
        };
        let [areas, growths] = [ends(|point| point.x), ends(|point| point.y)];
        let middle = (areas[0] * areas[1]).sqrt();
        let near = points().filter(|point| (point.x / middle).ln().abs() < 0.4);
        let largest = near.map(|point| point.y).reduce(f64::max);
        (points().count() >= FEWEST).then(|| Extent {
            areas,
            growths,
            growth_in_the_middle: largest.unwrap_or(growths[1]),
        })
    }

    /// A power of the area, through a growth in the middle of the areas.
    fn guide(&self, growth: f64, exponent: f64, colour: Colour, dash: Dash) -> Series {
        let middle = (self.areas[0] * self.areas[1]).sqrt();
        let guide = Series::curve(
            |area| growth * (area / middle).powf(exponent),
            [middle / 4.0, 4.0 * middle],
            Spacing::Logarithmic,
            Style::line(colour, dash, 1.8),
        );
        guide.named(format!("exponent {exponent}").replace('-', "−"))
    }
}

/// The power laws fitted to counted areas.
fn fits(data: &FigureData, range: [f64; 2]) -> Result<Vec<Series>, ReportError> {
    let mut lines = Vec::new();
    let columns = ["exponent", "prefactor", "law"];
    for FinishedStage { table, .. } in data.finished.with(&columns) {
        let (exponents, prefactors) = (table.reals("exponent")?, table.reals("prefactor")?);
        let corrections = table.has(CORRECTION.name);
        let corrections = corrections.then(|| table.texts(CORRECTION.name));
        let corrections = corrections.transpose()?;
        for row in (0..table.rows()).filter(|&row| exponents.is_valid(row)) {
            if corrections.is_some_and(|names| names.value(row) != AS_COUNTED) {
                continue;
            }
            let (exponent, prefactor) = (exponents.value(row), prefactors.value(row));
            let growth = |area: f64| prefactor * area.powf(exponent);
            let colour = data.styles.colour(&ensembles::point(table, row));
            let style = Style::line(colour, Dash::Solid, 1.2);
            let line = Series::curve(growth, range, Spacing::Logarithmic, style);
            lines.push(line);
        }
    }
    Ok(lines)
}
