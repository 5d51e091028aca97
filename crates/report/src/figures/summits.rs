//! Nayak's parameter and the density of summits of the surfaces, compared with closed forms (figs.
//! A.1 and A.2).

use std::collections::{BTreeMap, BTreeSet};

use arrow::array::Array;

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::{self, Bars, Point, ends, mean_and_half_bar};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn, sample};
use crate::styles::Styles;
use asperity_contact::topography::moments::Continuum;
use asperity_stages::columns::{HURST, K_LOWER, K_ROLLOFF, K_UPPER, REALIZATION, SEED};
use asperity_stages::surface::coordinates;
use asperity_tables::table::{Table, TableError};

pub const NAYAK: Definition = Definition {
    name: "nayak",
    title: "Nayak's parameter of the surfaces",
    draw: |data| draw(data, &NAYAKS_PARAMETER),
};

pub const DENSITY: Definition = Definition {
    name: "summit-density",
    title: "Density of summits of the surfaces",
    draw: |data| draw(data, &DENSITY_OF_SUMMITS),
};

/// A quantity that follows from the moments of a surface.
struct Quantity {
    column: &'static str,
    label: &'static str,
    meaning: &'static str,
    /// Closed form for a spectrum over continuous wavenumbers with a given roll-off wavenumber.
    closed_form: fn(&Continuum, f64) -> f64,
}

const NAYAKS_PARAMETER: Quantity = Quantity {
    column: "nayak",
    label: "Nayak's parameter α",
    meaning: "Nayak's parameter α = m₀ m₄/m₂²",
    closed_form: |continuum, _| continuum.nayak(),
};

const DENSITY_OF_SUMMITS: Quantity = Quantity {
    column: "summit_density_integer",
    label: "density of summits D · (L/2π)²",
    meaning: "Density of summits in integer wavenumbers, D = (√3/18π) m₄/m₂",
    closed_form: Continuum::summit_density,
};

/// Hurst exponent of the paper's surfaces.
const PAPERS_HURST: f64 = 0.8;
/// Second Hurst exponent for which the paper shows closed forms.
const OTHER_HURST: f64 = 0.3;
/// Largest number of Hurst exponents for which each has its own chart.
const MOST_CHARTS: usize = 3;

/// Spectra that differ only in their upper cutoff.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Family {
    /// Bits of the Hurst exponent, which sort like positive numbers.
    hurst: u64,
    k_lower: i64,
    k_rolloff: i64,
}

/// Surfaces of one spectrum, each once, even if drawn on several meshes.
struct Surfaces {
    point: Point,
    values: BTreeMap<(i64, i64), f64>,
}

/// Spectra of a family by their upper cutoffs.
type Curve = BTreeMap<i64, Surfaces>;

fn draw(data: &FigureData, quantity: &Quantity) -> Result<Drawn, ReportError> {
    let mut curves: BTreeMap<Family, Curve> = BTreeMap::new();
    let columns = [quantity.column, K_ROLLOFF.name, SEED.name];
    for stage in data.finished.with(&columns) {
        collect(&stage.table, quantity.column, &mut curves)?;
    }
    let uppers: BTreeSet<&i64> = curves.values().flat_map(BTreeMap::keys).collect();
    if uppers.len() < 2 {
        let needs = format!("random surfaces with two or more values of `{}`", K_UPPER.name);
        return Ok(Drawn::missing(needs, data.lines_of_spectra(K_UPPER.name)));
    }
    let surfaces = curves.values().flat_map(Curve::values);
    let counts: Vec<usize> = surfaces.map(|one| one.values.len()).collect();
    let caption = format!(
        "{}: points are means over {}, bars are {}; lines are the closed form over continuous \
         wavenumbers{}. Periodic cells with few long waves deviate from it.",
        quantity.meaning,
        sample(&counts),
        data.bars,
        if has_other(&curves) {
            format!(", dashed for the other Hurst exponent of the paper, {OTHER_HURST}")
        } else {
            String::new()
        },
    );
    Ok(Drawn::figure(figure(&curves, data, quantity), caption))
}

/// Returns a figure with one chart for each Hurst exponent, or one for all if there are many.
fn figure(curves: &BTreeMap<Family, Curve>, data: &FigureData, quantity: &Quantity) -> Figure {
    let uppers = || curves.values().flat_map(BTreeMap::keys).copied();
    let ends = [uppers().min(), uppers().max()].map(|end| end.unwrap_or(1) as f64);
    let range = [ends[0] / 1.15, ends[1] * 1.15];
    let mut exponents: Vec<u64> = curves.keys().map(|family| family.hurst).collect();
    exponents.dedup();
    let chart = |has: &dyn Fn(&Family) -> bool| {
        let x = Axis::octaves("upper cutoff wavenumber k_upper").within(range[0], range[1]);
        let mut chart = Chart::new(x, Axis::logarithmic(quantity.label));
        for (family, curve) in curves.iter().filter(|(family, _)| has(family)) {
            let drawn = family.series(curve, range, &data.styles, quantity, data.bars);
            chart.series.extend(drawn);
        }
        chart
    };
    if exponents.len() == 1 || exponents.len() > MOST_CHARTS {
        let mut chart = chart(&|_| true);
        if has_other(curves) {
            chart.series.extend(curves.iter().map(|(family, curve)| {
                let other = Family { hurst: OTHER_HURST.to_bits(), ..*family };
                other.closed_form(curve, range, &data.styles, quantity, Dash::Dashed)
            }));
        }
        return Figure::from_chart(chart);
    }
    let charts = exponents.iter().map(|&hurst| {
        let title = format!("H = {}", f64::from_bits(hurst));
        chart(&|family| family.hurst == hurst).titled(title)
    });
    Figure::from_charts(vec![charts.collect()], [430.0, 340.0])
}

/// Returns true if the figure also shows the closed form for [`OTHER_HURST`]. It does so if all
/// spectra have the Hurst exponent [`PAPERS_HURST`].
fn has_other(curves: &BTreeMap<Family, Curve>) -> bool {
    let mut exponents = curves.keys().map(|family| f64::from_bits(family.hurst));
    exponents.all(|hurst| hurst == PAPERS_HURST)
}

impl Family {
    /// Returns the closed form as a line in the colour of a curve.
    fn closed_form(
        &self,
        curve: &Curve,
        [from, to]: [f64; 2],
        styles: &Styles,
        quantity: &Quantity,
        dash: Dash,
    ) -> Series {
        let [k_lower, k_rolloff] = [self.k_lower, self.k_rolloff].map(|k| k as f64);
        let closed_form = |k_upper: f64| {
            let continuum = Continuum {
                hurst: f64::from_bits(self.hurst),
                plateau: k_lower / k_rolloff,
                magnification: k_upper / k_rolloff,
            };
            (quantity.closed_form)(&continuum, k_rolloff)
        };
        let first = curve.values().next().map(|surfaces| &surfaces.point);
        let colour = first.map_or(Colour::Text, |point| styles.colour(point));
        let range = [from.max(k_rolloff), to];
        Series::curve(closed_form, range, Spacing::Octaves, Style::line(colour, dash, 1.3))
    }

    /// Returns the closed form as a line, and the mean of each spectrum as a point.
    fn series(
        &self,
        curve: &Curve,
        range: [f64; 2],
        styles: &Styles,
        quantity: &Quantity,
        bars: Bars,
    ) -> Vec<Series> {
        let line = self.closed_form(curve, range, styles, quantity, Dash::Solid);
        let mut series = vec![line];
        for (&k_upper, surfaces) in curve {
            let values: Vec<f64> = surfaces.values.values().copied().collect();
            let (mean, half) = mean_and_half_bar(&values, bars);
            let point = DataPoint { x: k_upper as f64, y: mean, bar: ends(mean, half) };
            series.push(Series {
                points: vec![point],
                style: styles.markers(&surfaces.point),
                label: styles.label(&surfaces.point),
            });
        }
        series
    }
}

fn collect(
    table: &Table,
    column: &str,
    curves: &mut BTreeMap<Family, Curve>,
) -> Result<(), TableError> {
    let hurst = table.reals(HURST.name)?;
    let cutoffs = [K_LOWER, K_ROLLOFF, K_UPPER].map(|cutoff| table.integers(cutoff.name));
    let [lower, rolloff, upper] = cutoffs;
    let (lower, rolloff, upper) = (lower?, rolloff?, upper?);
    let (seeds, realizations) = (table.integers(SEED.name)?, table.integers(REALIZATION.name)?);
    let values = table.reals(column)?;
    let is_shown = |row: &usize| {
        hurst.is_valid(*row) && values.is_valid(*row) && !coordinates::is_altered(table, *row)
    };
    for row in (0..table.rows()).filter(is_shown) {
        let family = Family {
            hurst: hurst.value(row).to_bits(),
            k_lower: lower.value(row),
            k_rolloff: rolloff.value(row),
        };
        let spectra = curves.entry(family).or_default();
        let surfaces = spectra.entry(upper.value(row)).or_insert_with(|| Surfaces {
            point: ensembles::point(table, row),
            values: BTreeMap::new(),
        });
        let draw = (seeds.value(row), realizations.value(row));
        surfaces.values.insert(draw, values.value(row));
    }
    Ok(())
}
