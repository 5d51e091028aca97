//! Loads that the manifest gives as forces on the nominal area.

use super::SolveTable;
use super::loads::StoredPressures;
use crate::check_context::Surfaces;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::Spanned;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::quantity::Dimension;

/// Returns the force in newtons under the pressure 1 on each nominal area of the surfaces, in
/// ascending order. The result is `None` alone if the loads are not forces. Loads that are results
/// are forces, too, if pressures and lengths have units.
pub fn newtons(
    table: &SolveTable,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<Vec<Option<f64>>> {
    if table.control.value().is_some_and(|control| !control.is_load()) {
        return Some(known(surfaces, checks).unwrap_or(vec![None]));
    }
    let loads = loads(table);
    let units = checks.units;
    let is_force = |load: &&&Spanned<f64>| units.dimension_of(&load.span) == Some(Dimension::Force);
    let Some(force) = loads.iter().find(is_force).map(|load| &load.span) else {
        return Some(vec![None]);
    };
    let is_other = |load: &&&Spanned<f64>| load.value != 0.0 && !is_force(load);
    if let Some(other) = loads.iter().find(is_other) {
        let number = decimal::written(other.value);
        let (message, label) = if units.is_quantity(&other.span) {
            ("one load is a pressure, but another one is a force", "a pressure".to_owned())
        } else {
            let label = format!("write \"{number} N\" if it is in newtons");
            ("one load has no unit, but another one is a force", label)
        };
        let problem = Problem::new(message, other.span.clone(), label);
        return checks.reject(problem.and(force.clone(), "a force"));
    }
    let Some(pressure) = units.pressure.as_ref().map(|named| named.unit.symbol) else {
        let message = "a load is a force, but the modulus of the stage has no unit";
        let problem = Problem::new(message, force.clone(), "has a unit");
        return checks.reject(problem.help(
            "give E* with a unit, such as `effective_modulus = \"70 GPa\"`, or the `bodies`",
        ));
    };
    if surfaces.areas.iter().any(|area| area.newtons(pressure).is_none()) {
        return without_area(force, checks);
    }
    known(surfaces, checks)
}

/// Returns the force in newtons under the pressure 1 on each nominal area, or `None` if a unit is
/// unknown.
fn known(surfaces: &Surfaces, checks: &Checks) -> Option<Vec<Option<f64>>> {
    let pressure = checks.units.pressure.as_ref()?.unit.symbol;
    let of_areas = surfaces.areas.iter().map(|area| area.newtons(pressure));
    let mut newtons = of_areas.collect::<Option<Vec<f64>>>()?;
    newtons.sort_by(f64::total_cmp);
    newtons.dedup();
    (!newtons.is_empty()).then(|| newtons.into_iter().map(Some).collect())
}

/// Returns the loads and the loads with stored pressures, as the manifest gives them.
pub(super) fn loads(table: &SolveTable) -> Vec<&Spanned<f64>> {
    let mut loads = Vec::new();
    if let Some(written) = table.loads.written() {
        loads.extend(written.value.values());
    }
    if let Some(StoredPressures::At(list)) = table.pressures.written().map(|written| &written.value)
    {
        loads.extend(list);
    }
    loads
}

fn without_area<T>(force: &Span, checks: &mut Checks) -> Option<T> {
    let message = "a load is a force, but the lengths of the surfaces have no unit";
    let problem = Problem::new(message, force.clone(), "needs the nominal area in m²");
    checks.reject(problem.help(
        "give the sides of all surfaces a unit, such as `side = \"100 um\"`, or write the loads as \
         mean pressures",
    ))
}
