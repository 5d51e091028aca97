//! Distribution of heights: linear, close to its tail, logarithmic (figs. 3 and B.1); of measured
//! surfaces in their unit of length, too.

use std::f64::consts::TAU;

use arrow::array::Array;

use super::measured_heights;
use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::Point;
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::FigureData;
use crate::measured::{FILE_IS_GONE, MeasuredMaps};
use crate::samples::MOST;
use crate::surface_curves::runs;
use asperity_stages::columns::{BIN, DENSITY, DENSITY_MEAN, DENSITY_NORMAL, DENSITY_SD, SURFACES};
use asperity_tables::table::{Table, TableError};

pub const FIGURE: Definition =
    Definition { name: "heights", title: "Distribution of heights", draw };

/// Single surfaces that stand beside the mean.
const SINGLE: usize = 3;
/// Points of a curve: finer bins are joined, their densities averaged.
const POINTS: usize = 200;

/// The densities of one parameter point, by bin.
#[derive(Default)]
struct Densities {
    point: Point,
    surfaces: usize,
    mean: Vec<(f64, f64)>,
    deviation: Vec<(f64, f64)>,
    normal: Vec<(f64, f64)>,
    single: Vec<Vec<(f64, f64)>>,
}

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut all: Vec<Densities> = Vec::new();
    for stage in data.finished.with(&[BIN.name, DENSITY_MEAN.name]) {
        pooled(&stage.table, &mut all)?;
    }
    for stage in data.finished.with(&[BIN.name, DENSITY.name]) {
        single(&stage.table, &mut all)?;
    }
    let measured = measured_heights::charts(data);
    if all.is_empty() && measured.is_none() {
        let lines = data.lines_of_heights();
        return Ok(match data.maps {
            MeasuredMaps::Gone => Drawn::gone(FILE_IS_GONE),
            MeasuredMaps::There(_) => Drawn::missing("a distribution of heights", lines),
        });
    }
    let (mut rows, mut captions): (Vec<_>, Vec<_>) = measured.into_iter().unzip();
    let size = match all.is_empty() {
        true => [430.0, 340.0],
        false => [300.0, 225.0],
    };
    if !all.is_empty() {
        let shown = &all[..all.len().min(MOST)];
        rows.extend(shown.iter().map(|densities| charts(data, densities)));
        captions.push(caption(shown));
    }
    let figure = Figure::of_charts(rows, size);
    Ok(Drawn::figure(figure, captions.join(" ")))
}

/// What is to be seen of densities over the rms height.
fn caption(shown: &[Densities]) -> String {
    let surfaces: Vec<usize> = shown.iter().map(|densities| densities.surfaces).collect();
    format!(
        "Probability density of heights over their rms: linear, close to the tail, logarithmic. \
         Black the mean over {}, dashed one standard deviation between surfaces to either side, \
         vermilion the normal density, other colours three single surfaces. Bins are joined to {POINTS}.",
        sample(&surfaces),
    )
}

fn charts(data: &FigureData, densities: &Densities) -> Vec<Chart> {
    let x = Axis::linear("height over its rms");
    let y = Axis::linear("density");
    let label = data.styles.label(&densities.point).unwrap_or_default();
    let axes = [
        (x.clone().within(-5.0, 5.0), y.clone().within(0.0, 0.75)),
        (x.clone().within(2.0, 4.0), y.within(0.0, 0.1)),
        (x.within(-5.0, 5.0), Axis::logarithmic("density").within(1e-6, 1.5)),
    ];
    let chart =
        |(x, y)| Chart { series: densities.series(), ..Chart::new(x, y).titled(label.clone()) };
    axes.map(chart).into()
}

impl Densities {
    /// Mean and standard deviation of single surfaces.
    fn averaged(self) -> Densities {
        let bins = self.single.iter().map(Vec::len).min().unwrap_or(0);
        let surfaces = self.single.len() as f64;
        let of_bin = |bin: usize| self.single.iter().map(move |curve| curve[bin].1);
        let mean = |bin: usize| of_bin(bin).sum::<f64>() / surfaces;
        let deviation = |bin: usize| {
            let mean = mean(bin);
            let square = of_bin(bin).map(|density| (density - mean).powi(2)).sum::<f64>();
            (square / (surfaces - 1.0)).sqrt()
        };
        let curve = |value: &dyn Fn(usize) -> f64| {
            let points = (0..bins).map(|bin| (self.single[0][bin].0, value(bin)));
            points.collect::<Vec<_>>()
        };
        let normal = |bin: usize| (-self.single[0][bin].0.powi(2) / 2.0).exp() / TAU.sqrt();
        Densities {
            surfaces: self.single.len(),
            mean: curve(&mean),
            deviation: if surfaces > 1.0 { curve(&deviation) } else { Vec::new() },
            normal: curve(&normal),
            ..self
        }
    }

    fn series(&self) -> Vec<Series> {
        let mut series: Vec<Series> = Vec::new();
        let singles = self.single.iter().filter(|_| self.surfaces > 1);
        for (place, single) in singles.enumerate() {
            let style = Style::line(Colour::Series([0, 2, 4][place % 3]), Dash::Solid, 0.8);
            let label = format!("surface {}", place + 1);
            series.push(thinned(single, style).named(label));
        }
        let bound = |sign: f64| {
            let both = self.mean.iter().zip(&self.deviation);
            let points: Vec<(f64, f64)> = both
                .map(|(mean, deviation)| (mean.0, (mean.1 + sign * deviation.1).max(0.0)))
                .collect();
            thinned(&points, Style::line(Colour::Text, Dash::Dashed, 1.0))
        };
        if !self.deviation.is_empty() {
            series.push(bound(1.0).named("± standard deviation"));
            series.push(bound(-1.0));
        }
        let mean = Style::line(Colour::Text, Dash::Solid, 1.5);
        let label = match self.surfaces {
            1 => "the surface",
            _ => "mean of the surfaces",
        };
        series.push(thinned(&self.mean, mean).named(label));
        let normal = Style::line(Colour::Series(1), Dash::Solid, 1.5);
        series.push(thinned(&self.normal, normal).named("normal"));
        series
    }
}

fn thinned(points: &[(f64, f64)], style: Style) -> Series {
    let joined = points.chunks(points.len().div_ceil(POINTS).max(1)).map(|bins| {
        let count = bins.len() as f64;
        let sum = bins.iter().fold((0.0, 0.0), |sum, bin| (sum.0 + bin.0, sum.1 + bin.1));
        (sum.0 / count, sum.1 / count)
    });
    Series::new(joined.collect::<Vec<_>>(), style)
}

/// The densities of the point of a row.
fn entry<'a>(table: &Table, row: usize, all: &'a mut Vec<Densities>) -> &'a mut Densities {
    let mut point = ensembles::point(table, row);
    point.remove(BIN.name);
    let at = all.iter().position(|known| known.point == point);
    let at = at.unwrap_or_else(|| {
        all.push(Densities { point, ..Densities::default() });
        all.len() - 1
    });
    &mut all[at]
}

fn pooled(table: &Table, all: &mut Vec<Densities>) -> Result<(), TableError> {
    let bins = table.reals(BIN.name)?;
    let column = |name: &str| table.reals(name);
    let (mean, normal) = (column(DENSITY_MEAN.name)?, column(DENSITY_NORMAL.name)?);
    let deviation = column(DENSITY_SD.name)?;
    let surfaces = table.integers(SURFACES.name)?;
    for rows in runs(bins.values()) {
        let densities = entry(table, rows.start, all);
        densities.surfaces = surfaces.value(rows.start).unsigned_abs() as usize;
        for row in rows {
            let bin = bins.value(row);
            densities.mean.push((bin, mean.value(row)));
            densities.normal.push((bin, normal.value(row)));
            if deviation.is_valid(row) {
                densities.deviation.push((bin, deviation.value(row)));
            }
        }
    }
    Ok(())
}

/// Single surfaces; of points without pooled densities, their mean too.
fn single(table: &Table, all: &mut Vec<Densities>) -> Result<(), TableError> {
    let (bins, density) = (table.reals(BIN.name)?, table.reals(DENSITY.name)?);
    let mut unpooled: Vec<Densities> = Vec::new();
    for rows in runs(bins.values()) {
        let curve = rows.clone().map(|row| (bins.value(row), density.value(row)));
        let point = entry(table, rows.start, all).point.clone();
        let pooled = all.iter_mut().find(|known| known.point == point && known.surfaces > 0);
        let densities = match pooled {
            Some(densities) => densities,
            None => entry(table, rows.start, &mut unpooled),
        };
        densities.single.push(curve.collect());
    }
    all.retain(|densities| densities.surfaces > 0);
    all.extend(unpooled.into_iter().map(Densities::averaged));
    all.iter_mut().for_each(|densities| densities.single.truncate(SINGLE));
    Ok(())
}
