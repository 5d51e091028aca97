//! The load of full contact of waves, which the loads of a manifest can use:
//! `loads = { to = "0.5 * full_contact", steps = 4 }`.
//!
//! A wave Δ cos(qx) is in full contact if its mean pressure is at least the amplitude E*qΔ/2 of the
//! pressure that flattens it. The other shapes are sums of two waves.

use std::f64::consts::TAU;

use toml::de::DeValue;

use crate::generate::mesh;
use crate::generate::method::SurfacePoints;
use crate::per_axis::PerAxis;
use crate::solve::keys::bodies;
use crate::surface::Origin;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problems;
use asperity_manifest::keys::bounds;
use asperity_manifest::keys::derived::Point;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::shapes::Shape;

/// Name of the load in expressions.
pub const NAME: &str = "full_contact";
/// Key whose unit the load has.
pub const UNIT_OF: &str = "loads";

/// Returns whether the loads of a stage are multiples of E* × rms slope, from the value of
/// `load_unit` and from whether a load has a unit.
pub fn is_relative(load_unit: Option<&DeValue<'_>>, has_unit: bool) -> bool {
    match load_unit.map(DeValue::as_str) {
        None => !has_unit,
        Some(word) => word == Some("relative"),
    }
}

/// Returns the load of full contact in the unit of `loads`, or the reason why it is not known.
///
/// `inputs` are the names of the stages that the stage reads, with the points of those that
/// generate surfaces. `key` is the key whose expression uses the load, and `point` its parameter
/// point.
pub fn load(
    inputs: &[(&str, Option<&SurfacePoints>)],
    key: &str,
    point: &Point<'_>,
) -> Result<f64, String> {
    if !matches!(key, "loads" | "pressures") {
        return Err(format!("`{NAME}` has the unit of `loads`; use it in `loads` or `pressures`"));
    }
    if point.value("layer").is_some() {
        return Err(format!(
            "`{NAME}` is the load of a half-space, and the stage has a `layer`; write the loads as \
             numbers"
        ));
    }
    if point.value("boundary").and_then(DeValue::as_str) == Some(Boundary::Free.name()) {
        return Err(format!(
            "`{NAME}` is the load of a periodic surface, and `boundary` is \"free\"; write the \
             loads as numbers"
        ));
    }
    if point.value("against").is_some() {
        let why = "it is known before a run only for waves on a smooth body; the column \
                   `full_contact_load` of the results has it";
        return Err(why.to_owned());
    }
    let is_relative = is_relative(point.value("load_unit"), point.is_quantity(UNIT_OF));
    let mut loads = Vec::new();
    for (stage, surfaces) in inputs {
        let waves = surfaces.and_then(full_contacts).ok_or_else(|| {
            format!(
                "the load is known before a run only for waves; the table of `{stage}` has the loads of \
                 its surfaces in the column `full_contact_load`"
            )
        })?;
        let load = |Wave { pressure, rms_slope }| {
            if is_relative { pressure / rms_slope } else { pressure }
        };
        loads.extend(waves.into_iter().map(load));
    }
    let first = *loads.first().ok_or_else(|| "the stage reads no surfaces".to_owned())?;
    if !loads.iter().all(|load| decimal::is_same(*load, first)) {
        return Err(
            "the surfaces that the stage reads have different loads of full contact".to_owned()
        );
    }
    if is_relative {
        return Ok(first);
    }
    // Quantities are plain numbers here: all pressures of the stage are in one unit, and so are the
    // lengths of each surface.
    match point.value("bodies") {
        Some(bodies) => match modulus_of(bodies) {
            Some(modulus) => Ok(first * modulus),
            None => Err("the moduli and Poisson ratios of `bodies` are not all numbers".to_owned()),
        },
        None => match point.number("effective_modulus") {
            Some(modulus) => Ok(first * modulus),
            None => Err("`effective_modulus` is not a number".to_owned()),
        },
    }
}

/// Returns the effective modulus of bodies, or `None` if one of their keys is not a number.
fn modulus_of(bodies: &DeValue) -> Option<f64> {
    let compliances = bodies.as_array()?.iter().map(|body| {
        let keys = body.get_ref().as_table()?;
        let read = |key: &str| match keys.get(key)?.get_ref() {
            value @ (DeValue::Integer(_) | DeValue::Float(_)) => Some(bounds::number(value)),
            _ => None,
        };
        Some(bodies::compliance(read("youngs_modulus")?, read("poisson_ratio")?))
    });
    Some(1.0 / compliances.sum::<Option<f64>>()?)
}

/// The full contact of a wave with an effective modulus of 1.
#[derive(Debug, Clone, Copy)]
struct Wave {
    /// Mean pressure of full contact.
    pressure: f64,
    rms_slope: f64,
}

/// Returns the full contacts of the waves of a stage, or `None` if it makes other surfaces.
fn full_contacts(surfaces: &SurfacePoints) -> Option<Vec<Wave>> {
    let SurfacePoints::Wave(shape, section) = surfaces else {
        return None;
    };
    // The stage itself reports its problems.
    let planned = mesh::wave(*shape, section, &mut Problems::default())?;
    let waves =
        planned.into_iter().map(|planned| match (planned.params.origin, planned.params.side) {
            (Origin::Shape { shape, .. }, Some(PerAxis(sides))) => Wave::new(shape, sides),
            _ => None,
        });
    waves.collect()
}

impl Wave {
    fn new(shape: Shape, sides: [f64; 2]) -> Option<Wave> {
        let along = |waves: u32| sides.map(|side| TAU * f64::from(waves) / side);
        let (pressure, rms_slope) = match shape {
            Shape::Wave { amplitude, waves } => {
                let [q, _] = along(waves);
                (q * amplitude / 2.0, q * amplitude / 2.0_f64.sqrt())
            }
            // Two waves of half the amplitude, along (q_x, q_y) and (q_x, −q_y).
            Shape::WaveProduct { amplitude, waves } => {
                let [x, y] = along(waves);
                let q = (x * x + y * y).sqrt();
                (q * amplitude / 2.0, q * amplitude / 2.0)
            }
            Shape::WaveSum { amplitude, waves } => {
                let [x, y] = along(waves);
                ((x + y) * amplitude / 2.0, ((x * x + y * y) / 2.0).sqrt() * amplitude)
            }
            Shape::Paraboloid { .. } | Shape::Punch { .. } => return None,
        };
        Some(Wave { pressure, rms_slope })
    }
}

#[cfg(test)]
mod tests {
    use asperity_mechanics::grid::{Cell, Grid};
    use asperity_mechanics::topography::descriptors::Descriptors;

    use super::*;

    #[test]
    fn loads_of_full_contact_are_those_of_the_drawn_waves() {
        let (amplitude, waves) = (0.1, 2);
        for sides in [[1.0, 1.0], [2.0, 1.0]] {
            let grid = Grid::new([32, 32], Cell::new(sides).unwrap()).unwrap();
            for shape in [
                Shape::Wave { amplitude, waves },
                Shape::WaveProduct { amplitude, waves },
                Shape::WaveSum { amplitude, waves },
            ] {
                let drawn = Descriptors::from_surface(&shape.draw(grid)).full_contact_load;
                let Wave { pressure, rms_slope } = Wave::new(shape, sides).unwrap();
                let load = pressure / rms_slope;
                assert!((load - drawn).abs() < 1e-12, "{shape:?}: {load} and {drawn}");
            }
        }
    }
}
