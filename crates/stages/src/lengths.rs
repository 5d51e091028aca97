//! Conversion of lengths of a stage to the unit of the lengths of the surfaces that it reads.

use crate::check_context::Surfaces;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span, listed};
use asperity_manifest::keys::Spanned;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::quantity::{Dimension, Unit};

/// Multiplies a number by a power of ten and rounds it to twelve digits.
pub fn converted(number: f64, power: i32) -> f64 {
    decimal::nearest(decimal::shifted(&decimal::written(number), power))
}

/// Converts a length to the unit of the lengths of the surfaces. A number without a unit has this
/// unit.
pub fn in_unit_of_surfaces(
    length: &Spanned<f64>,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<f64> {
    let named = checks.units.length.as_ref().map(|named| named.unit);
    let Some(unit) = named.filter(|_| checks.units.is_quantity(&length.span)) else {
        return Some(decimal::nearest(length.value));
    };
    let of_surfaces = unit_of(surfaces, &length.span, checks)?;
    Some(converted(length.value, unit.power - of_surfaces.power))
}

/// Returns the unit of the lengths of the surfaces. Refuses surfaces without a common unit to which
/// the length at `span` could be converted.
pub fn unit_of(surfaces: &Surfaces, span: &Span, checks: &mut Checks) -> Option<&'static Unit> {
    let mut names = surfaces.length_units.iter().map(String::as_str);
    let (first, others) = (names.next().unwrap_or(""), names.count());
    let known = Unit::find(first).filter(|unit| unit.dimension == Dimension::Length);
    if let (Some(unit), 0) = (known, others) {
        return Some(unit);
    }
    let message = match (first, others) {
        ("", 0) => "a length has a unit, but the lengths of the surfaces have none".to_owned(),
        (name, 0) => {
            format!("a length has a unit, but the surfaces are in the unknown unit `{name}`")
        }
        _ => {
            let names = surfaces.length_units.iter().map(|name| match name.as_str() {
                "" => "no unit",
                name => name,
            });
            format!("a length has a unit, but the surfaces have several: {}", listed(names, "and"))
        }
    };
    let problem = Problem::new(message, span.clone(), "has a unit");
    checks.reject(problem.help(
        "give the side of all surfaces in one unit, such as `side = \"100 um\"`, or write lengths \
         here as plain numbers in the unit of the side",
    ))
}
