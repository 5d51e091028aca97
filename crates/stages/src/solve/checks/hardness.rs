//! Checks of hardnesses: a material bears the loads that are known to press it.

use super::super::keys::{Loads, SolveTable};
use super::super::{GivenHardness, Params, PressureUnit};
use super::unit;
use crate::form::Surfaces;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::written::Section;
use asperity_manifest::written::checks::{Checks, QUANTITY};

/// A hardness is one of a material, whatever its surface.
const DEFAULT: PressureUnit = PressureUnit::Absolute;

/// Refuses a unit of nothing, unless it is the default, which may be written out anywhere. Some points of
/// a grid may have no hardness where others have one.
pub fn check_unit(section: &Section<SolveTable>, problems: &mut Problems) {
    let is_given = |table: &SolveTable| table.hardness.written().is_some();
    if section.points.iter().any(|point| is_given(&point.table)) {
        return;
    }
    for point in &section.points {
        let checks = &mut Checks::of(section, point, problems);
        let is_default = unit(&point.table.hardness_unit, DEFAULT) == DEFAULT;
        if !is_default && !checks.is_excused("hardness") {
            let why = "there is no `hardness` to be measured in it";
            checks.forbidden("hardness_unit", &point.table.hardness_unit, why);
        }
    }
}

/// The hardness, where there is one.
pub fn given(table: &SolveTable, checks: &mut Checks) -> Option<Option<GivenHardness>> {
    let Some(written) = table.hardness.written() else {
        return Some(None);
    };
    let pressure = checks.is_in("hardness", written, QUANTITY)?;
    let unit = unit(&table.hardness_unit, DEFAULT);
    Some(Some(GivenHardness { pressure, unit }))
}

/// The smallest hardness that a body has, where one has any.
pub fn softest_body(table: &SolveTable, checks: &mut Checks) -> Option<Option<f64>> {
    let bodies = table.bodies.written().into_iter();
    let bodies = bodies.flat_map(|bodies| &bodies.value);
    let written = bodies.filter_map(|body| body.value.hardness.written());
    let hardnesses: Vec<_> =
        written.map(|hardness| checks.is_in("bodies.hardness", hardness, QUANTITY)).collect();
    let hardnesses: Vec<f64> = hardnesses.into_iter().collect::<Option<_>>()?;
    Some(hardnesses.into_iter().reduce(f64::min))
}

/// Reports the heaviest load if it presses a surface by more than the material bears, as far as that
/// is known before there is a surface.
pub fn check_loads(table: &SolveTable, block: &Params, surfaces: &Surfaces, checks: &mut Checks) {
    let (Some(hardness), Some(&heaviest)) = (block.hardness, block.loads.last()) else {
        return;
    };
    let slopes = match hardness.unit == block.load_unit {
        true => Some([1.0; 2]),
        false => surfaces.slopes,
    };
    let pressure = |value: f64, unit: PressureUnit, slope: f64| match unit {
        PressureUnit::Absolute => value,
        PressureUnit::Relative => decimal::nearest(value * block.effective_modulus * slope),
    };
    let of_load = |slope: f64| pressure(heaviest, block.load_unit, slope);
    let of_hardness = |slope: f64| pressure(hardness.pressure, hardness.unit, slope);
    let mut slopes = slopes.into_iter().flatten();
    let Some(slope) = slopes.find(|slope| of_load(*slope) >= of_hardness(*slope)) else {
        return;
    };
    let told = |value: f64, unit: PressureUnit| match unit {
        PressureUnit::Relative if hardness.unit != block.load_unit => {
            let pressure = pressure(value, unit, slope);
            format!("{value:?}, a pressure of {pressure:?} where the rms slope is {slope:?}")
        }
        _ => format!("{value:?}"),
    };
    let message = format!(
        "`loads` holds {}, and `hardness` is {}",
        told(heaviest, block.load_unit),
        told(hardness.pressure, hardness.unit)
    );
    let Some((load, hardness)) = place_of_heaviest(table).zip(table.hardness.written()) else {
        return;
    };
    let limit = of_hardness(slope) / pressure(1.0, block.load_unit, slope);
    let problem = Problem::new(message, load, "more than the material bears");
    let problem = problem.and(hardness.span.clone(), "the highest pressure that it bears");
    checks.problems.push(problem.help(format!(
        "under a mean pressure of its hardness a material yields everywhere: each load must be below \
         {:?} here",
        decimal::nearest(limit)
    )));
}

/// Where the heaviest load is written.
fn place_of_heaviest(table: &SolveTable) -> Option<Span> {
    match &table.loads.written()?.value {
        Loads::List(list) => Some(list.last()?.span.clone()),
        Loads::Range(range) => Some(range.to.written()?.span.clone()),
    }
}
