//! Unit in which a page shows loads: the unit in which the manifest gives them.
//!
//! Reduced loads y = p₀/(E* h′) are pure numbers. Mean pressures p₀ are shown in pascals with a
//! prefix if their unit is known. If E* h′ is the same for all rows, charts against the reduced
//! load are drawn against the mean pressure.

use crate::charts::{Figure, Panel};
use crate::ensembles;
use crate::figure_data::{FinishedStages, LOAD_LABEL};
use crate::units::{LengthUnit, Scaled, Units, are_pascals, digits, in_pascals};
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_stages::Kind;
use asperity_stages::columns::{EFFECTIVE_MODULUS, LOAD, PRESSURE, PRESSURE_UNIT};
use asperity_stages::ensemble::load_column;
use asperity_tables::table::{Table, TableError};

/// Relative difference by which E* h′ may differ between rows that share one axis.
const ROUNDING: f64 = 1e-6;

/// Unit of the loads of a study.
#[derive(Debug, Clone, PartialEq)]
pub enum Loads {
    Reduced,
    Pressures {
        /// Pascals per unit of the pressures in tables, if known.
        pascals: Option<f64>,
        /// Mean pressure under the reduced load 1, in the unit of the tables, if it is the same for
        /// all rows.
        scale: Option<f64>,
    },
}

impl Loads {
    /// Reads the unit from the tables of solved loads.
    pub fn from_stages(finished: &FinishedStages, units: &Units) -> Result<Loads, TableError> {
        let columns = [LOAD.name, PRESSURE.name];
        let solved = finished.with(&columns).filter(|stage| stage.kind == Kind::Solve);
        let tables: Vec<&Table> = solved.map(|stage| &stage.table).collect();
        let is_pressure = |table: &&Table| load_column(table) == PRESSURE.name;
        if tables.is_empty() || !tables.iter().all(is_pressure) {
            return Ok(Loads::Reduced);
        }
        let mut pascals = Vec::new();
        let mut scales = Vec::new();
        for table in tables {
            pascals.push(pascals_of(table, units)?);
            let (loads, pressures) = (table.reals(LOAD.name)?, table.reals(PRESSURE.name)?);
            let pairs = pressures.values().iter().zip(loads.values());
            scales.extend(pairs.map(|(pressure, load)| pressure / load));
        }
        let scale = scales.first().copied().filter(|first| {
            first.is_finite() && scales.iter().all(|other| (other / first - 1.0).abs() < ROUNDING)
        });
        let first = pascals.first().copied().flatten();
        let pascals = first.filter(|_| pascals.iter().all(|other| *other == first));
        Ok(Loads::Pressures { pascals, scale })
    }

    /// Returns the name of a load in texts.
    pub fn name(&self) -> &'static str {
        match self {
            Loads::Reduced => "load y",
            Loads::Pressures { .. } => "mean pressure p₀",
        }
    }

    /// Formats a load of which both values are known.
    pub fn text(&self, reduced: f64, pressure: f64) -> String {
        match self {
            Loads::Reduced => digits(reduced, 3),
            Loads::Pressures { pascals, .. } => pressure_text(pressure, *pascals),
        }
    }

    /// Formats a reduced load, as a pressure if all rows have the same E* h′.
    pub fn text_of_reduced(&self, load: f64) -> String {
        match self {
            Loads::Reduced => digits(load, 3),
            Loads::Pressures { pascals, scale: Some(scale) } => {
                pressure_text(load * scale, *pascals)
            }
            Loads::Pressures { scale: None, .. } => format!("{} E* h′", digits(load, 3)),
        }
    }

    /// Converts the axes of a figure that show reduced loads to mean pressures, if possible.
    pub fn on_axes(&self, figure: &mut Figure) {
        let Loads::Pressures { pascals, scale: Some(scale) } = *self else {
            return;
        };
        let panels = figure.rows.iter_mut().flatten();
        let charts = panels.filter_map(|panel| match panel {
            Panel::Chart(chart) => Some(chart),
            Panel::Map(_) => None,
        });
        for chart in charts {
            let points = || chart.series.iter().flat_map(|series| &series.points);
            let unit = |largest: f64| unit_of(largest * scale, pascals);
            let largest = |values: &mut dyn Iterator<Item = f64>| {
                unit(values.filter(|value| value.is_finite()).fold(0.0, f64::max))
            };
            let along_x = largest(&mut points().map(|point| point.x));
            let along_y = largest(&mut points().map(|point| point.y));
            let label = |unit: &Scaled| format!("mean pressure p₀, in {}", unit.unit);
            if chart.x.label == LOAD_LABEL {
                chart.convert_x(along_x.factor * scale, label(&along_x));
            }
            if chart.y.label == LOAD_LABEL {
                chart.convert_y(along_y.factor * scale, label(&along_y));
            }
        }
    }
}

/// Returns the unit for pressures up to `largest`, which is in the unit of the tables.
pub fn unit_of(largest: f64, pascals: Option<f64>) -> Scaled {
    match pascals {
        Some(pascals) => {
            let Scaled { factor, unit } = in_pascals(largest * pascals);
            Scaled { factor: factor * pascals, unit }
        }
        None => Scaled { factor: 1.0, unit: "the unit of E*".to_owned() },
    }
}

/// Formats a pressure in the unit of the tables.
fn pressure_text(pressure: f64, pascals: Option<f64>) -> String {
    let Scaled { factor, unit } = unit_of(pressure, pascals);
    match pascals {
        Some(_) => format!("{} {unit}", digits(factor * pressure, 3)),
        None => digits(pressure, 3),
    }
}

/// Returns the pascals per unit of the pressures in a table, if known.
pub fn pascals_of(table: &Table, units: &Units) -> Result<Option<f64>, TableError> {
    if table.has(PRESSURE_UNIT.name) {
        let written = table.texts(PRESSURE_UNIT.name)?;
        return Ok(written.iter().flatten().next().and_then(pascals_in));
    }
    if table.rows() == 0 || !table.has(EFFECTIVE_MODULUS.name) {
        return Ok(None);
    }
    let moduli = table.reals(EFFECTIVE_MODULUS.name)?.iter().flatten();
    let least = moduli.fold(f64::INFINITY, f64::min);
    let ends = [0, table.rows() - 1].map(|row| ensembles::point(table, row));
    let lengths = LengthUnit::common(ends.iter().map(|point| units.at(point)));
    Ok(are_pascals(least, &lengths).then_some(1.0))
}

/// Returns the pascals in a unit such as `MPa`.
pub fn pascals_in(unit: &str) -> Option<f64> {
    let known = Unit::find(unit).filter(|known| known.dimension == Dimension::Pressure)?;
    Unit::find("Pa").map(|pascal| known.factor_to(pascal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::axis::Axis;
    use crate::charts::chart::{Chart, Series};
    use crate::charts::style::{self, Colour, Style};

    const PASCALS: Loads = Loads::Pressures { pascals: Some(1.0), scale: Some(2e9) };

    #[test]
    fn loads_are_written_in_the_unit_of_the_manifest() {
        assert_eq!(Loads::Reduced.text(0.0123456, 5.5e9), "0.0123");
        assert_eq!(PASCALS.text(0.0123456, 5.5e9), "5.5 GPa");
        assert_eq!(PASCALS.text_of_reduced(0.01), "20 MPa");
        let mixed = Loads::Pressures { pascals: Some(1e6), scale: None };
        assert_eq!(mixed.text(0.01, 20.0), "20 MPa");
        assert_eq!(mixed.text_of_reduced(0.01), "0.01 E* h′");
        let unknown = Loads::Pressures { pascals: None, scale: Some(2.0) };
        assert_eq!(unknown.text(0.01, 0.02), "0.02");
    }

    #[test]
    fn an_axis_of_loads_becomes_an_axis_of_pressures_and_others_stay() {
        let mut chart = Chart::new(Axis::linear(LOAD_LABEL).within(0.0, 0.1), Axis::linear("area"));
        let markers = Style::marker(Colour::Series(0), style::marker(0));
        chart.series.push(Series::new([(0.01, 0.2), (0.1, 0.9)], markers));
        chart.notes.push((0.05, 0.5, "note".to_owned()));
        let figure = Figure::from_chart(chart);
        let mut converted = figure.clone();
        PASCALS.on_axes(&mut converted);
        let Panel::Chart(chart) = &converted.rows[0][0] else { panic!("a chart") };
        assert_eq!(chart.x.label, "mean pressure p₀, in MPa");
        assert_eq!(chart.y.label, "area");
        let range = chart.x.range.unwrap();
        assert!((range[1] - 200.0).abs() < 1e-9, "{range:?}");
        assert!((chart.series[0].points[0].x - 20.0).abs() < 1e-9);
        assert_eq!(chart.series[0].points[0].y, 0.2);
        assert!((chart.notes[0].0 - 100.0).abs() < 1e-9);
        let mut same = figure.clone();
        Loads::Reduced.on_axes(&mut same);
        assert_eq!(same, figure);
    }

    #[test]
    fn units_of_pressure_are_converted_to_pascals() {
        let known = ["Pa", "MPa", "N/mm²", "psi"].map(pascals_in);
        assert_eq!(known, [Some(1.0), Some(1e6), Some(1e6), None]);
    }
}
