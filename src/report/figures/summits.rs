//! Nayak's parameter and the density of summits of the surfaces beside their closed forms (figs.
//! A.1 and A.2).

use std::collections::BTreeMap;

use arrow::array::Array;

use crate::figures::axis::Axis;
use crate::figures::chart::{Chart, Dash, Marker, Point, Series, Style};
use crate::figures::ink::Ink;
use crate::figures::sheet::Sheet;
use crate::report::ReportError;
use crate::report::ensembles::mean_and_error;
use crate::report::evidence::Evidence;
use crate::report::figure::{Definition, Drawn, sample};
use crate::stages::columns::{HURST, K_LOWER, K_UPPER, METHOD};
use crate::store::table::{Table, TableError};

pub const NAYAK: Definition = Definition {
    name: "nayak",
    title: "Nayak's parameter of the surfaces",
    draw: |evidence| {
        let columns = ["nayak", "nayak_continuum"];
        draw(
            evidence,
            columns,
            "Nayak's parameter α",
            "Nayak's parameter α = m₀ m₄/m₂²",
        )
    },
};

pub const DENSITY: Definition = Definition {
    name: "summit-density",
    title: "Density of summits of the surfaces",
    draw: |evidence| {
        let columns = ["summit_density_integer", "summit_density_continuum"];
        let what = "Density of summits in integer wavenumbers, D = (√3/18π) m₄/m₂";
        draw(evidence, columns, "density of summits D · (L/2π)²", what)
    },
};

/// The surfaces of one Hurst exponent and lower cutoff, by upper cutoff.
type Curve = BTreeMap<i64, Values>;

#[derive(Default)]
struct Values {
    computed: Vec<f64>,
    continuum: f64,
}

fn draw(
    evidence: &Evidence,
    [computed, continuum]: [&str; 2],
    label: &str,
    what: &str,
) -> Result<Drawn, ReportError> {
    let mut curves: BTreeMap<(u64, i64), Curve> = BTreeMap::new();
    for stage in evidence.finished.with(&[METHOD.name, computed, continuum]) {
        collect(&stage.table, [computed, continuum], &mut curves)?;
    }
    if curves.values().map(BTreeMap::len).sum::<usize>() < 2 {
        let lines = evidence.lines_of_surfaces();
        return Ok(Drawn::missing(
            "random surfaces of at least two spectra",
            lines,
        ));
    }
    let axes = (
        Axis::logarithmic("upper cutoff wavenumber k_upper"),
        Axis::logarithmic(label),
    );
    let mut chart = Chart::new(axes.0, axes.1);
    let mut counts = Vec::new();
    let mut exponents: Vec<u64> = curves.keys().map(|key| key.0).collect();
    exponents.dedup();
    let mut cutoffs: Vec<i64> = curves.keys().map(|key| key.1).collect();
    cutoffs.sort_unstable();
    cutoffs.dedup();
    for (&(hurst, k_lower), curve) in &curves {
        let exponent = exponents.partition_point(|&known| known < hurst);
        let ink = Ink::Series(cutoffs.partition_point(|&known| known < k_lower));
        let dash = if exponent == 0 {
            Dash::Solid
        } else {
            Dash::Dashed
        };
        let continuum = curve
            .iter()
            .map(|(&k_upper, values)| (k_upper as f64, values.continuum));
        let line = Style::line(ink, dash, 1.3);
        chart.series.push(Series::new(continuum, line));
        counts.extend(curve.values().map(|values| values.computed.len()));
        let points = curve.iter().map(|(&k_upper, values)| {
            let (mean, error) = mean_and_error(&values.computed);
            Point {
                x: k_upper as f64,
                y: mean,
                bar: error.map(|error| [mean - error, mean + error]),
            }
        });
        chart.series.push(Series {
            points: points.collect(),
            style: Style::marker(ink, Marker::of(exponent)),
            label: Some(format!("H {} · k_lower {k_lower}", f64::from_bits(hurst))),
        });
    }
    let caption = format!(
        "{what}: means over {} with standard errors, and, as lines, the closed form over \
         continuous wavenumbers (solid for the smallest Hurst exponent). Periodic cells with few \
         long waves differ from it.",
        sample(&counts),
    );
    Ok(Drawn::figure(Sheet::of(chart), caption))
}

fn collect(
    table: &Table,
    [computed, continuum]: [&str; 2],
    curves: &mut BTreeMap<(u64, i64), Curve>,
) -> Result<(), TableError> {
    let hurst = table.reals(HURST.name)?;
    let (lower, upper) = (table.integers(K_LOWER.name)?, table.integers(K_UPPER.name)?);
    let (computed, continuum) = (table.reals(computed)?, table.reals(continuum)?);
    for row in (0..table.rows()).filter(|&row| hurst.is_valid(row) && computed.is_valid(row)) {
        let curve = curves.entry((hurst.value(row).to_bits(), lower.value(row)));
        let values = curve.or_default().entry(upper.value(row)).or_default();
        values.computed.push(computed.value(row));
        values.continuum = continuum.value(row);
    }
    Ok(())
}
