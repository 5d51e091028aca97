//! Area and mean gap against the mean pressure in the units of the study, and mean gap against the
//! load, which the paper does not show. Also the growth of the mean contact pressure with the load
//! (fig. 17).

use arrow::array::Array;

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::{self, EnsembleCurves, Mean, Point};
use crate::figure_data::{COUNTED_AREA, FigureData, texts_if_any};
use crate::figures::{Definition, Drawn, sample};
use crate::finished::FinishedStage;
use crate::loads::LOAD_LABEL;
use crate::symbols::AREA_LABEL;
use crate::units::{LengthUnit, PressureUnit, Scaled};
use asperity_contact::theory::persson;
use asperity_stages::columns::{CORRECTION, EFFECTIVE_MODULUS, MEAN_GAP, PRESSURE, PRESSURE_UNIT};
use asperity_stages::correct::AS_COUNTED;
use asperity_tables::table::{Table, TableError};

pub const AGAINST_PRESSURE: Definition = Definition {
    name: "pressure",
    title: "Area and mean gap against the mean pressure",
    draw: draw_against_pressure,
};

fn draw_against_pressure(data: &FigureData) -> Result<Drawn, ReportError> {
    let pressed = data.measured.iter();
    let pressed = pressed.filter(|one| modulus(one).is_some());
    let pressed: Vec<&EnsembleCurves> = pressed.collect();
    if pressed.is_empty() {
        // Propose bodies, whose modulus has the unit that the reader chooses.
        let lines = data.lines_of_loads(
            "{ to = 0.06, steps = 50 }\n\
             bodies = [{ youngs_modulus = 210e9, poisson_ratio = 0.3 }]",
        );
        return Ok(Drawn::missing(
            "loads on bodies with a modulus, for pressures in its unit",
            lines,
        ));
    }
    let gaps = gaps(data, pressed.iter().copied())?;
    let mut pressures = Vec::new();
    for ensemble in &pressed {
        pressures.push(ensemble.mean(PRESSURE.name)?);
    }
    let unit = unit_of_pressures(data, &pressed);
    let means = pressures.iter().flatten();
    let largest = means.fold(0.0_f64, |most, pressure| most.max(pressure.mean));
    let scaled = unit.scaled(largest);
    let in_unit = |pressure: &mut Mean| *pressure = pressure.times(scaled.factor);
    pressures.iter_mut().flatten().for_each(in_unit);
    let axis = || Axis::logarithmic(format!("mean pressure p₀, in {}", scaled.unit));
    let mut areas = Chart::new(axis(), Axis::logarithmic(AREA_LABEL));
    let mut mean_gaps = Chart::new(axis(), Axis::linear(gaps.label));
    let mut moduli: Vec<String> = Vec::new();
    for ((ensemble, gaps), pressures) in pressed.iter().zip(&gaps.means).zip(&pressures) {
        let area = against(pressures, &ensemble.mean(COUNTED_AREA)?);
        areas.series.push(data.markers(ensemble, area));
        mean_gaps.series.push(data.markers(ensemble, against(pressures, gaps)));
        areas.series.extend(theory(data, ensemble, pressures));
        moduli.extend(modulus(ensemble).map(|modulus| unit.text(modulus, 5)));
    }
    moduli.dedup();
    // One entry in the legend for all lines of the theory.
    let persson = Style::line(Colour::Text, Dash::Dashed, 1.2);
    areas.series.push(Series::new([], persson).named("Persson 2001"));
    let caption = format!(
        "Counted contact area fraction (left) and mean gap (right) against the mean pressure, from \
         {}. E* = {}. Points are means over the surfaces, bars are {}. An exponential relation of \
         pressure and gap appears as a straight line. {}{}",
        sample(&pressed.iter().map(|one| one.surfaces).collect::<Vec<_>>()),
        moduli.join(", "),
        data.bars,
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::side_by_side(areas, mean_gaps), caption))
}

/// Returns the unit that the pressures of all ensembles have.
fn unit_of_pressures(data: &FigureData, pressed: &[&EnsembleCurves]) -> PressureUnit {
    let moduli = pressed.iter().filter_map(|one| modulus(one));
    let least_modulus = moduli.fold(f64::INFINITY, f64::min);
    let assumed = PressureUnit::assumed(least_modulus, &data.unit_of_length());
    PressureUnit::common(pressed.iter().map(|one| match one.point.get(PRESSURE_UNIT.name) {
        Some(unit) => PressureUnit::named(unit),
        None => assumed.clone(),
    }))
}

/// Returns E* if the manifest gives it. Without a modulus, pressures are in units of E*, as in the
/// other figures.
fn modulus(ensemble: &EnsembleCurves) -> Option<f64> {
    let modulus = ensemble.point.get(EFFECTIVE_MODULUS.name)?.parse().ok();
    modulus.filter(|&modulus| modulus != 1.0)
}

/// Returns points (mean pressure, mean of the quantity), paired by index: both lists must have the
/// same loads.
fn against(pressures: &[Mean], means: &[Mean]) -> Vec<DataPoint> {
    let pairs = pressures.iter().zip(means);
    pairs
        .map(|(pressure, mean)| DataPoint { x: pressure.mean, y: mean.mean, bar: mean.bar() })
        .collect()
}

/// Returns Persson's area as a curve over the pressures of an ensemble.
fn theory(data: &FigureData, ensemble: &EnsembleCurves, pressures: &[Mean]) -> Option<Series> {
    let (first, last) = (pressures.first()?, pressures.last()?);
    let unit = first.mean / first.load;
    let style = Style::line(data.styles.colour(&ensemble.point), Dash::Dashed, 1.2);
    let range = [first.mean, last.mean];
    let curve = |pressure: f64| persson::area(pressure / unit);
    Some(Series::curve(curve, range, Spacing::Logarithmic, style))
}

pub const GAP: Definition = Definition { name: "gap", title: "Mean gap", draw: draw_gap };

fn draw_gap(data: &FigureData) -> Result<Drawn, ReportError> {
    let gaps = gaps(data, data.measured.iter())?;
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear(gaps.label.clone()));
    for (ensemble, gaps) in data.measured.iter().zip(&gaps.means) {
        chart.series.push(data.points(ensemble, gaps));
    }
    if !chart.has_curves() {
        let lines =
            data.lines_of_loads("{ from = 0.001, to = 1.7, steps = 40, spacing = \"geometric\" }");
        return Ok(Drawn::missing("measured contacts at two or more loads", lines));
    }
    let drawn = chart.series.len();
    for stage in data.finished.with(&["decay_length", "closing_load", "window_lower"]) {
        chart.series.extend(relations(data, &stage.table, &gaps)?);
    }
    let fits = if chart.series.len() > drawn {
        "Lines are least-squares fits of p₀ = p_c exp(−ū/u₀) over the loads that they cover."
    } else {
        "A fit with `law = \"load-separation\"` adds the exponential relation."
    };
    let caption = format!(
        "Mean gap ū against load, from {}. Points are means over the surfaces, bars are {}. {fits}",
        sample(&data.sample()),
        data.bars,
    );
    Ok(Drawn::figure(Figure::from_chart(chart), caption))
}

/// Mean gaps of ensembles in a common unit.
pub struct Gaps {
    /// Label of an axis of mean gaps.
    pub label: String,
    /// Mean gaps at the loads of each ensemble.
    pub means: Vec<Vec<Mean>>,
    shared: LengthUnit,
    factor: f64,
}

impl Gaps {
    /// Returns the factor that converts lengths of the surface at a point to the common unit.
    fn factor(&self, data: &FigureData, point: &Point) -> f64 {
        self.factor * self.shared.factor(data.units.at(point))
    }
}

/// Returns the mean gaps of measured contacts in a common unit.
pub fn gaps<'a>(
    data: &FigureData,
    ensembles: impl Iterator<Item = &'a EnsembleCurves<'a>>,
) -> Result<Gaps, TableError> {
    let shared = data.unit_of_length();
    let mut means = Vec::new();
    for ensemble in ensembles {
        let factor = shared.factor(data.units.at(&ensemble.point));
        let gaps = ensemble.mean(MEAN_GAP.name)?.into_iter();
        means.push(gaps.map(|gap| gap.times(factor)).collect::<Vec<_>>());
    }
    let largest = means.iter().flatten().fold(0.0_f64, |most, gap| most.max(gap.mean));
    let Scaled { factor, unit } = shared.scaled(largest);
    let scale = |gap: &mut Mean| *gap = gap.times(factor);
    means.iter_mut().flatten().for_each(scale);
    Ok(Gaps { label: format!("mean gap, in {unit}"), means, shared, factor })
}

/// Returns the fitted relations as lines over their windows of loads.
fn relations(data: &FigureData, table: &Table, gaps: &Gaps) -> Result<Vec<Series>, TableError> {
    let column = |name: &str| table.reals(name);
    let (lengths, closing) = (column("decay_length")?, column("closing_load")?);
    let (from, to) = (column("window_lower")?, column("window_upper")?);
    let loads = gaps.means.iter().flatten().map(|mean| mean.load);
    let heaviest = loads.fold(0.0, f64::max);
    let is_fitted = |&row: &usize| lengths.is_valid(row) && closing.is_valid(row);
    let lines = (0..table.rows()).filter(is_fitted).map(|row| {
        let point = ensembles::point(table, row);
        let length = gaps.factor(data, &point) * lengths.value(row);
        let gap = |load: f64| length * (closing.value(row) / load).ln();
        let colour = data.styles.colour(&point);
        // A window may begin at zero, where the gap diverges, or end far above all loads.
        let to = to.value(row).min(heaviest);
        let range = [from.value(row).max(1e-3 * to), to];
        let style = Style::line(colour, Dash::Solid, 1.5);
        Series::curve(gap, range, Spacing::Logarithmic, style)
    });
    Ok(lines.collect())
}

pub const GROWTH: Definition = Definition {
    name: "pressure-growth",
    title: "Growth of the mean contact pressure",
    draw: draw_growth,
};

/// Largest area of the chart; near full contact all curves fall to zero.
const MOST: f64 = 0.5;
/// Smallest number of points for which the chart is drawn.
const FEWEST: usize = 3;

/// Factor by which the guides lie above the data.
const GUIDES_ABOVE: f64 = 1.8;

/// Exponents of the guides in the paper.
const GUIDES: [(f64, Colour, Dash); 2] =
    [(-0.7, Colour::Text, Dash::Dashed), (-0.9, Colour::Muted, Dash::DashDot)];

fn draw_growth(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut chart =
        Chart::new(Axis::logarithmic(AREA_LABEL), Axis::logarithmic("dp̄/dp₀, with p̄ = p₀ A₀/A"));
    let (mut all, mut rising) = (0, 0);
    for ensemble in &data.measured {
        let mut growth = ensemble.pressure_growth(COUNTED_AREA)?;
        growth.retain(|one| one.x < MOST);
        all += growth.len();
        growth.retain(|one| one.y > 0.0);
        rising += growth.len();
        chart.series.push(data.markers(ensemble, growth));
    }
    let Some(extent) = Extent::new(&chart.series) else {
        let needs = if all < FEWEST {
            "measured contacts at four or more loads, with less than half of the area in contact"
                .to_owned()
        } else {
            format!(
                "a mean contact pressure that rises with the load in {FEWEST} or more steps of the \
                 load; here it rises in {rising} of {all}"
            )
        };
        let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
        return Ok(Drawn::missing(needs, lines));
    };
    let fits = fits(data, extent.areas)?;
    let fits_text = if fits.is_empty() {
        "A fit with `law = \"mean-pressure\"` adds the power laws of the spectra."
    } else {
        "Coloured lines are the fitted power laws."
    };
    chart.series.extend(fits);
    let [least, most] = extent.growths;
    let top = GUIDES_ABOVE * extent.growth_in_the_middle;
    for (exponent, colour, dash) in GUIDES {
        chart.series.push(extent.guide(top, exponent, colour, dash));
    }
    // Limit the axis, because bars may reach below zero.
    chart.y = chart.y.within(least / 1.5, 3.0 * most.max(top));
    let caption = format!(
        "Derivative of the mean contact pressure p̄ with respect to the mean pressure p₀, from \
         differences of the mean curves, against the counted area fraction up to {MOST}, from {}; \
         bars are {}. Straight black and grey lines are guides. {fits_text} Steps of the load in \
         which p̄ falls have no logarithm and are omitted: {} of {all}.",
        sample(&data.sample()),
        data.bars,
        all - rising,
    );
    Ok(Drawn::figure(Figure::from_chart(chart), caption))
}

/// Ranges of the points (area, growth of the mean contact pressure) of a chart.
struct Extent {
    areas: [f64; 2],
    growths: [f64; 2],
    /// Largest growth near the geometric mean of the range of areas.
    growth_in_the_middle: f64,
}

impl Extent {
    /// Returns the ranges, or `None` for fewer than [`FEWEST`] points.
    fn new(series: &[Series]) -> Option<Extent> {
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

    /// Returns the curve `growth` (a/a_m)^`exponent` about the geometric mean a_m of the smallest
    /// and the largest area a.
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

/// Returns the power laws fitted to counted areas.
fn fits(data: &FigureData, range: [f64; 2]) -> Result<Vec<Series>, ReportError> {
    let mut lines = Vec::new();
    let columns = ["exponent", "prefactor", "law"];
    for FinishedStage { table, .. } in data.finished.with(&columns) {
        let (exponents, prefactors) = (table.reals("exponent")?, table.reals("prefactor")?);
        let corrections = texts_if_any(table, CORRECTION.name)?;
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
