//! Keys of the two bodies of a contact: elastic constants, hardness and conductivities.

use schemars::JsonSchema;
use serde::Deserialize;

use super::SolveTable;
use crate::bodies::{Bodies, Conduction};
use crate::check_context::Surfaces;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{conductivity, pressure, resistivity};
use asperity_manifest::keys::{Key, Spanned};
use asperity_topography_files::length_ratio;

/// Material of one body.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Young's modulus E of the body. All pressures of the stage have its unit.
    #[schemars(extend("exclusiveMinimum" = 0), transform = pressure)]
    pub youngs_modulus: f64,
    /// Poisson's ratio ν, above −1 and at most 0.5.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = -1))]
    pub poisson_ratio: f64,
    /// Hardness of the body, in the unit of its modulus. Unlike the key `hardness` of the stage, it
    /// changes no result: a run only reports where the peak pressure exceeds it. By default nothing
    /// is reported.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = pressure)]
    pub hardness: Key<f64>,
    /// Thermal conductivity, such as `"400 W/(m K)"`; a plain number is in W/(m K). With
    /// `stiffness = true`, a `measure` stage then has thermal conductances and resistances in units
    /// of the SI. A rigid body that is not listed conducts perfectly.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = conductivity)]
    pub conductivity: Key<f64>,
    /// Electrical resistivity, such as `"17 nohm m"` or `"1.7 uohm cm"`; a plain number is in Ω m.
    /// With `stiffness = true`, a `measure` stage then has electrical resistances in ohms. A rigid
    /// body that is not listed conducts perfectly.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = resistivity)]
    pub resistivity: Key<f64>,
}

/// Returns the properties of the bodies, or `None` after reporting problems.
pub fn bodies(table: &SolveTable, surfaces: &Surfaces, checks: &mut Checks) -> Option<Bodies> {
    let listed = table.bodies.written().map_or(&[][..], |bodies| &bodies.value);
    let hardnesses = listed.iter().filter_map(|body| body.value.hardness.value());
    Some(Bodies {
        count: listed.len(),
        softest: hardnesses.map(decimal::nearest).reduce(f64::min),
        dundurs: dundurs(listed),
        conduction: conduction(table, surfaces, checks)?,
    })
}

/// Returns the effective modulus E*, which is given or follows from the bodies or from Young's
/// modulus of the layer.
pub fn modulus(table: &SolveTable, checks: &mut Checks) -> Option<f64> {
    let bodies = checks.optional("bodies", &table.bodies)?;
    let layer = checks.optional("layer", &table.layer)?;
    let with_modulus = layer.filter(|layer| layer.value.youngs_modulus.written().is_some());
    let (name, span, moduli) = match (bodies, with_modulus) {
        (Some(bodies), _) => {
            let listed = bodies.value.iter().map(|body| &body.value);
            let moduli = listed.map(|body| (body.youngs_modulus, body.poisson_ratio)).collect();
            ("bodies", &bodies.span, moduli)
        }
        (None, Some(layer)) => {
            let modulus = layer.value.youngs_modulus.written()?;
            ("layer", &modulus.span, vec![(modulus.value, layer.value.poisson_ratio.value)])
        }
        (None, None) => return checks.number("effective_modulus", &table.effective_modulus),
    };
    if let Some(modulus) = table.effective_modulus.written() {
        let key = if name == "layer" { "layer.youngs_modulus" } else { name };
        let message = format!("`effective_modulus` and `{key}` exclude each other");
        let problem = Problem::new(message, modulus.span.clone(), "gives the effective modulus")
            .and(span.clone(), "also determines the effective modulus")
            .help("remove one of the two keys");
        checks.report(name, problem);
        return None;
    }
    let compliances = moduli.into_iter().map(|(modulus, ratio)| compliance(modulus, ratio));
    let modulus = 1.0 / compliances.sum::<f64>();
    if !(modulus.is_finite() && modulus > 0.0) {
        let message = format!("the effective modulus of `{name}` is {modulus:?}");
        let label = "out of the range of numbers";
        return checks.refuse(name, message, span, label);
    }
    Some(modulus)
}

/// Returns the compliance (1 − ν²)/E of a body.
pub fn compliance(youngs_modulus: f64, poisson_ratio: f64) -> f64 {
    let ratio = decimal::nearest(poisson_ratio);
    (1.0 - ratio * ratio) / decimal::nearest(youngs_modulus)
}

/// Returns Dundurs' constant β of two bodies, or of one body on a rigid one:
///
/// β = [(1 − 2ν₁)/G₁ − (1 − 2ν₂)/G₂]/(2 [(1 − ν₁)/G₁ + (1 − ν₂)/G₂]).
fn dundurs(bodies: &[Spanned<Body>]) -> Option<f64> {
    let terms = bodies.iter().enumerate().map(|(index, Spanned { value: body, .. })| {
        let [ratio, modulus] = [body.poisson_ratio, body.youngs_modulus].map(decimal::nearest);
        let shear_modulus = modulus / (2.0 * (1.0 + ratio));
        let sign = if index == 0 { 1.0 } else { -1.0 };
        [sign * (1.0 - 2.0 * ratio) / shear_modulus, (1.0 - ratio) / shear_modulus]
    });
    let sum = terms.reduce(|one, other| [one[0] + other[0], one[1] + other[1]]);
    sum.map(|[difference, compliance]| difference / (2.0 * compliance))
}

/// Returns the conductivities of the pair, or `Some(None)` if the manifest gives none. Refuses
/// values that would have no effect.
fn conduction(
    table: &SolveTable,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<Option<Conduction>> {
    let bodies = table.bodies.written().map_or(&[][..], |bodies| &bodies.value);
    let conductivities = of_all(bodies, "conductivity", |body| &body.conductivity, checks)?;
    let resistivities = of_all(bodies, "resistivity", |body| &body.resistivity, checks)?;
    let keys = [("conductivity", conductivities.first()), ("resistivity", resistivities.first())];
    let Some((key, first)) = keys.into_iter().find_map(|(key, first)| Some((key, first?))) else {
        return Some(None);
    };
    if !checks.value("stiffness", &table.stiffness)? {
        let message = format!("`{key}` has no effect without `stiffness = true`");
        let problem = Problem::new(message, first.span.clone(), "needs the stiffness of contacts");
        return checks.reject(problem.help(
            "the conductance of a contact follows from its stiffness: add `stiffness = true` to \
             the stage",
        ));
    }
    if let Some(layer) = table.layer.written() {
        let message = format!("`{key}` and `layer` exclude each other");
        let problem = Problem::new(message, first.span.clone(), "applies to half-spaces only")
            .and(layer.span.clone(), "this body is not a half-space");
        return checks.reject(problem.help(
            "remove one of the two keys; the conductance follows from the stiffness only for \
             half-spaces",
        ));
    }
    let is_unknown = |unit: &&String| length_ratio(unit, "m").is_none();
    if let Some(unit) = surfaces.length_units.iter().find(is_unknown) {
        let message = match unit.as_str() {
            "" => format!("`{key}` needs lengths with a unit, but the surfaces have none"),
            unit => {
                format!("`{key}` needs lengths with a unit, but the surfaces are in `{unit}`")
            }
        };
        let label = "conductances in units of the SI need the side in metres";
        let problem = Problem::new(message, first.span.clone(), label);
        return checks.reject(
            problem.help("give the side of the surfaces with its unit, as in `side = \"100 um\"`"),
        );
    }
    let sum = |values: &[&Spanned<f64>], term: fn(f64) -> f64| -> Option<f64> {
        let terms = values.iter().map(|value| term(decimal::nearest(value.value)));
        terms.reduce(|one, other| one + other)
    };
    Some(Some(Conduction {
        conductivity: sum(&conductivities, |value| 1.0 / value).map(|sum| 2.0 / sum),
        resistivity: sum(&resistivities, |value| value).map(|sum| sum / 2.0),
    }))
}

/// Returns the values of a key of all bodies, or no values if no body has it. Refuses a key that
/// only one of two bodies has.
fn of_all<'b>(
    bodies: &'b [Spanned<Body>],
    name: &str,
    key: fn(&Body) -> &Key<f64>,
    checks: &mut Checks,
) -> Option<Vec<&'b Spanned<f64>>> {
    let values: Vec<&Spanned<f64>> =
        bodies.iter().filter_map(|body| key(&body.value).written()).collect();
    let lacking = bodies.iter().find(|body| key(&body.value).written().is_none());
    let (Some(lacking), Some(given)) = (lacking, values.first()) else {
        return Some(values);
    };
    let message = format!("one of the `bodies` has a `{name}`, and the other has none");
    let problem = Problem::new(message, lacking.span.clone(), format!("lacks `{name}`"))
        .and(given.span.clone(), "the other body");
    checks.reject(problem.help("the current flows through both bodies: give the values of both"))
}

#[cfg(test)]
mod tests {
    use asperity_manifest::diagnostics::Span;

    use super::*;

    fn body(youngs_modulus: f64, poisson_ratio: f64) -> Spanned<Body> {
        let value = Body {
            youngs_modulus,
            poisson_ratio,
            hardness: Key::default(),
            conductivity: Key::default(),
            resistivity: Key::default(),
        };
        Spanned { value, span: Span::default() }
    }

    #[test]
    fn equal_and_incompressible_bodies_are_elastically_similar() {
        assert_eq!(dundurs(&[body(2.0, 0.3), body(2.0, 0.3)]), Some(0.0));
        assert_eq!(dundurs(&[body(2.0, 0.5), body(70.0, 0.5)]), Some(0.0));
        // (1 − 2ν₁)/G₁ = (1 − 2ν₂)/G₂ for ν = 0 and 0.25 with E₂ = 0.625 E₁.
        let similar = dundurs(&[body(1.0, 0.0), body(0.625, 0.25)]).unwrap();
        assert!(similar.abs() < 1e-15, "{similar}");
        assert_eq!(dundurs(&[body(3.0, 0.0)]), Some(0.5), "on a rigid body");
        assert_eq!(dundurs(&[]), None);
    }
}
