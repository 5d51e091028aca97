//! Nominal areas of surfaces, which turn loads that are forces into mean pressures.

use crate::{Recipe, surface};
use asperity_manifest::decimal;
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_mechanics::grid::Grid;

/// Nominal area of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalArea {
    /// Product of the sides.
    area: f64,
    /// Unit of the sides; `None` if it is unknown.
    unit: Option<&'static Unit>,
}

impl NominalArea {
    /// Returns the area of a map. `unit` is the symbol of the unit of its sides.
    pub fn new(grid: Grid, unit: &str) -> NominalArea {
        let [side_x, side_y] = grid.cell().size();
        NominalArea {
            area: decimal::nearest(side_x * side_y),
            unit: Unit::find(unit).filter(|unit| unit.dimension == Dimension::Length),
        }
    }

    /// Returns the area of a surface, or `None` if it has no valid mesh.
    pub fn of(surface: &surface::Params) -> Option<NominalArea> {
        Some(NominalArea::new(surface.grid().ok()?, surface.origin.unit()))
    }

    /// Returns the force in newtons on the area under the mean pressure 1 in the unit with the
    /// symbol `pressure`. Returns `None` if a unit is unknown.
    pub fn newtons(&self, pressure: &str) -> Option<f64> {
        let (length, pressure) = (self.unit?, Unit::find(pressure)?);
        let power = 2 * length.power + pressure.power;
        Some(decimal::shifted(&decimal::written(self.area), power))
    }
}

/// Returns whether a surface has the nominal area on which the mean pressure 1 in the unit with the
/// symbol `pressure` is the force `newtons`. Without `newtons`, any surface has it.
pub fn is_of(surface: &Recipe, newtons: Option<f64>, pressure: Option<&str>) -> bool {
    match (surface, newtons, pressure) {
        (Recipe::Generate(surface), Some(newtons), Some(pressure)) => {
            NominalArea::of(surface).and_then(|area| area.newtons(pressure)) == Some(newtons)
        }
        _ => true,
    }
}

/// Returns the mean pressure under a force in newtons, where the pressure 1 is the force `newtons`.
pub fn pressure(force: f64, newtons: f64) -> f64 {
    decimal::nearest(force / newtons)
}

/// Returns the mean pressures under loads, which are forces if `newtons` is given.
pub fn pressures(loads: &[f64], newtons: Option<f64>) -> Vec<f64> {
    match newtons {
        Some(newtons) => loads.iter().map(|force| pressure(*force, newtons)).collect(),
        None => loads.to_vec(),
    }
}

/// Returns the force in newtons under a mean pressure, where the pressure 1 is the force `newtons`.
///
/// Pressures have twelve digits. One digit less gives the force from which a pressure was computed.
pub fn force(pressure: f64, newtons: f64) -> f64 {
    let force = pressure * newtons;
    let written = format!("{force:.*e}", decimal::DIGITS - 2);
    written.parse().unwrap_or(force)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_follow_from_the_sides_and_from_pressures_again() {
        let micrometre = Unit::find("um");
        let area = NominalArea { area: 1e4, unit: micrometre };
        // 10 N on (100 µm)² are 1 GPa.
        let newtons = area.newtons("MPa").unwrap();
        assert_eq!((newtons, pressure(10.0, newtons)), (0.01, 1000.0));
        assert_eq!(area.newtons("GPa"), Some(10.0));
        assert_eq!(area.newtons("bars"), None);
        assert_eq!(NominalArea { unit: None, ..area }.newtons("Pa"), None);
        for side in [3.0_f64, 70.1, 1234.5, 0.0321] {
            let area = NominalArea { area: decimal::nearest(side * side), unit: micrometre };
            let newtons = area.newtons("MPa").unwrap();
            for given in [10.0, 0.3, 0.333_333_333_33, 7e-9] {
                assert_eq!(force(pressure(given, newtons), newtons), given);
            }
        }
    }
}
