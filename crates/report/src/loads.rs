//! Unit in which a page shows loads: the unit in which the manifest gives them.
//!
//! Reduced loads y = p₀/(E* h′) are pure numbers. If E* h′ is the same for all rows, charts against
//! the reduced load are drawn against the mean pressure p₀.

use crate::charts::axis::Axis;
use crate::charts::{Figure, Panel};
use crate::finished::FinishedStages;
use crate::points;
use crate::units::{Scaled, Unit, Units, digits};
use asperity_stages::Kind;
use asperity_stages::columns::{
    EFFECTIVE_MODULUS, LOAD, PRESSURE, PRESSURE_DENSITY, PRESSURE_UNIT,
};
use asperity_stages::ensemble::{load_column, prescribed_length};
use asperity_tables::table::{Table, TableError};

/// Label of axes of the reduced load, with its unit.
pub const LOAD_LABEL: &str = "load p₀/(E* h′)";
/// Relative difference by which E* h′ may differ between rows that share one axis.
const ROUNDING: f64 = 1e-6;

/// Unit of the loads of a study.
#[derive(Debug, Clone, PartialEq)]
pub enum Loads {
    Reduced,
    Pressures {
        /// Unit of the pressures in tables.
        unit: Unit,
        /// Smallest and largest mean pressure under the reduced load 1, E* h′, in the unit of the
        /// tables.
        scales: [f64; 2],
    },
}

impl Loads {
    /// Reads the unit from the tables of solved loads.
    pub fn from_stages(finished: &FinishedStages, units: &Units) -> Result<Loads, TableError> {
        let columns = [LOAD.name, PRESSURE.name];
        let solved = finished.with(&columns).filter(|stage| stage.kind == Kind::Solve);
        let tables: Vec<&Table> = solved.map(|stage| &stage.table).collect();
        let mut are_pressures = !tables.is_empty();
        for table in &tables {
            are_pressures &= match load_column(table) {
                column if column == PRESSURE.name => true,
                // The loads of prescribed lengths are results. They are pressures if the manifest
                // gives a modulus with a unit.
                column if prescribed_length(column).is_some() => {
                    unit_of_pressures(table, units)?.name().is_some()
                }
                _ => false,
            };
        }
        if !are_pressures {
            return Ok(Loads::Reduced);
        }
        let mut pressure_units = Vec::new();
        let mut scales = [f64::INFINITY, 0.0];
        for table in tables {
            pressure_units.push(unit_of_pressures(table, units)?);
            let (loads, pressures) = (table.reals(LOAD.name)?, table.reals(PRESSURE.name)?);
            let pairs = pressures.values().iter().zip(loads.values());
            // A load of zero has no ratio.
            let scale =
                pairs.filter(|(_, load)| **load != 0.0).map(|(pressure, load)| pressure / load);
            for scale in scale {
                scales = [scales[0].min(scale), scales[1].max(scale)];
            }
        }
        Ok(Loads::Pressures { unit: Unit::common(pressure_units), scales })
    }

    /// Returns E* h′ if it is the same for all rows.
    fn scale(&self) -> Option<f64> {
        match self {
            Loads::Pressures { scales: [least, most], .. } => {
                (most / least - 1.0 < ROUNDING).then_some(*least)
            }
            Loads::Reduced => None,
        }
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
            Loads::Pressures { unit, .. } => unit.text(pressure, 3),
        }
    }

    /// Formats a reduced load, as a pressure if all rows have the same E* h′.
    pub fn text_of_reduced(&self, load: f64) -> String {
        match self {
            Loads::Reduced => digits(load, 3),
            Loads::Pressures { unit, .. } => match self.scale() {
                Some(scale) => unit.text(load * scale, 3),
                None => format!("{} E* h′", digits(load, 3)),
            },
        }
    }

    /// Converts the axes of a figure that show reduced loads to mean pressures. If E* h′ differs
    /// between the surfaces, returns a sentence for the caption instead.
    pub fn on_axes(&self, figure: &mut Figure) -> Option<String> {
        let Loads::Pressures { unit, scales } = self else {
            return None;
        };
        let panels = figure.rows.iter_mut().flatten();
        let mut charts = panels.filter_map(|panel| match panel {
            Panel::Chart(chart) => Some(chart),
            Panel::Map(_) | Panel::Blank => None,
        });
        let Some(scale) = self.scale() else {
            let is_reduced = |axis: &Axis| ReducedAxis::of(&axis.label).is_some();
            let has_loads = charts.any(|chart| is_reduced(&chart.x) || is_reduced(&chart.y));
            let [least, most] = scales.map(|scale| unit.text(scale, 3));
            return has_loads.then(|| {
                format!(
                    "Loads are mean pressures divided by E* h′, which is {least} to {most} on these \
                     surfaces."
                )
            });
        };
        for chart in charts {
            let points = || chart.series.iter().flat_map(|series| &series.points);
            let converted = |label: &str, values: &mut dyn Iterator<Item = f64>| {
                let axis = ReducedAxis::of(label)?;
                let sizes = values.filter(|value| value.is_finite()).map(f64::abs);
                let largest = if axis.is_inverse { 1.0 } else { sizes.fold(0.0, f64::max) };
                let Scaled { factor, unit } = unit.scaled(largest * scale);
                Some(match axis.is_inverse {
                    true => (1.0 / (factor * scale), format!("{}, in 1/{unit}", axis.name)),
                    false => (factor * scale, format!("{}, in {unit}", axis.name)),
                })
            };
            let along_x = converted(&chart.x.label, &mut points().map(|point| point.x));
            let along_y = converted(&chart.y.label, &mut points().map(|point| point.y));
            if let Some((factor, label)) = along_x {
                chart.convert_x(factor, label);
            }
            if let Some((factor, label)) = along_y {
                chart.convert_y(factor, label);
            }
        }
        None
    }
}

/// Axis of multiples of E* × rms slope.
struct ReducedAxis<'a> {
    /// Label without the unit.
    name: &'a str,
    /// True for densities, in 1/(E* × rms slope).
    is_inverse: bool,
}

impl ReducedAxis<'_> {
    fn of(label: &str) -> Option<ReducedAxis<'_>> {
        if label == LOAD_LABEL {
            return Some(ReducedAxis { name: "mean pressure p₀", is_inverse: false });
        }
        let (name, unit) = label.rsplit_once(", in ")?;
        let is_inverse = unit == PRESSURE_DENSITY.unit;
        (is_inverse || unit == LOAD.unit).then_some(ReducedAxis { name, is_inverse })
    }
}

/// Returns the unit of the pressures in a table.
pub fn unit_of_pressures(table: &Table, units: &Units) -> Result<Unit, TableError> {
    if table.has(PRESSURE_UNIT.name) {
        let written = table.texts(PRESSURE_UNIT.name)?;
        return Ok(Unit::common(written.iter().flatten().map(Unit::of_pressures)));
    }
    if table.rows() == 0 || !table.has(EFFECTIVE_MODULUS.name) {
        return Ok(Unit::NO_PRESSURE);
    }
    let moduli = table.reals(EFFECTIVE_MODULUS.name)?.iter().flatten();
    let least = moduli.fold(f64::INFINITY, f64::min);
    let ends = [0, table.rows() - 1].map(|row| points::at_row(table, row));
    let lengths = Unit::of_lengths(ends.iter().map(|point| units.at(point)));
    Ok(Unit::assumed(least, &lengths))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::chart::{Chart, Series};
    use crate::charts::style::{self, Colour, Style};

    const PASCALS: Loads = Loads::Pressures { unit: Unit::Si("Pa"), scales: [2e9; 2] };

    #[test]
    fn loads_are_written_in_the_unit_of_the_manifest() {
        assert_eq!(Loads::Reduced.text(0.0123456, 5.5e9), "0.0123");
        assert_eq!(PASCALS.text(0.0123456, 5.5e9), "5.5 GPa");
        assert_eq!(PASCALS.text_of_reduced(0.01), "20 MPa");
        let mixed = Loads::Pressures { unit: Unit::of_pressures("MPa"), scales: [1e3, 2e3] };
        assert_eq!(mixed.text(0.01, 2000.0), "2000 MPa");
        assert_eq!(mixed.text_of_reduced(0.01), "0.01 E* h′");
        let unknown = Loads::Pressures { unit: Unit::NO_PRESSURE, scales: [2.0; 2] };
        assert_eq!(unknown.text(0.01, 0.02), "0.02");
    }

    #[test]
    fn an_axis_of_loads_becomes_an_axis_of_pressures_and_others_stay() {
        let mut chart = Chart::new(Axis::linear(LOAD_LABEL).within(0.0, 0.1), Axis::linear("area"));
        let markers = Style::marker(Colour::Series(0), style::marker(0));
        chart.series.push(Series::new([(0.01, 0.2), (0.1, 0.9)], markers));
        let figure = Figure::from_chart(chart);
        let mut converted = figure.clone();
        assert_eq!(PASCALS.on_axes(&mut converted), None);
        let Panel::Chart(chart) = &converted.rows[0][0] else { panic!("a chart") };
        assert_eq!(chart.x.label, "mean pressure p₀, in MPa");
        assert_eq!(chart.y.label, "area");
        let range = chart.x.range.unwrap();
        assert!((range[1] - 200.0).abs() < 1e-9, "{range:?}");
        assert!((chart.series[0].points[0].x - 20.0).abs() < 1e-9);
        assert_eq!(chart.series[0].points[0].y, 0.2);
        let [x, y] = ["pressure p, in E* × rms slope", "density, in 1/(E* × rms slope)"];
        let mut chart = Chart::new(Axis::linear(x), Axis::linear(y));
        chart.series.push(Series::new([(0.01, 2e3)], markers));
        let mut densities = Figure::from_chart(chart);
        let unit = Unit::of_pressures("MPa");
        Loads::Pressures { unit, scales: [2e5; 2] }.on_axes(&mut densities);
        let Panel::Chart(chart) = &densities.rows[0][0] else { panic!("a chart") };
        assert_eq!([&*chart.x.label, &*chart.y.label], ["pressure p, in MPa", "density, in 1/MPa"]);
        assert!((chart.series[0].points[0].x - 2e3).abs() < 1e-9);
        assert!((chart.series[0].points[0].y - 0.01).abs() < 1e-12);
        let mut named = figure.clone();
        let unit = Unit::of_pressures("MPa");
        Loads::Pressures { unit, scales: [2e5; 2] }.on_axes(&mut named);
        let Panel::Chart(chart) = &named.rows[0][0] else { panic!("a chart") };
        assert_eq!(chart.x.label, "mean pressure p₀, in MPa");
        assert!((chart.series[0].points[1].x - 2e4).abs() < 1e-9);
        let mut same = figure.clone();
        assert_eq!(Loads::Reduced.on_axes(&mut same), None);
        assert_eq!(same, figure);
        let unit = Unit::of_pressures("MPa");
        let note = Loads::Pressures { unit, scales: [1e3, 1.5e3] }.on_axes(&mut same);
        assert!(note.is_some_and(|note| note.contains("E* h′, which is 1000 MPa to 1500 MPa")));
        assert_eq!(same, figure);
    }
}
