//! Keys of the two bodies of a contact: elastic constants, hardness and conductivities.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::bodies::{Bodies, Conduction, LayerConduction};
use crate::check_context::{StageChecks, exclude, in_unit_of_surfaces};
use crate::solve::keys::{Method, SolveTable};
use crate::solve::layer::GivenLayer;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{conductivity, length, pressure, resistivity};
use asperity_manifest::keys::{Key, Spanned};
use asperity_mechanics::elasticity::{Base, Support};
use asperity_mechanics::grid::Boundary;
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
pub fn bodies(table: &SolveTable, checks: &mut StageChecks) -> Option<Bodies> {
    let listed = table.bodies.written().map_or(&[][..], |bodies| &bodies.value);
    let hardnesses = listed.iter().filter_map(|body| body.value.hardness.value());
    Some(Bodies {
        count: listed.len(),
        softest: hardnesses.map(decimal::nearest).reduce(f64::min),
        dundurs: dundurs(listed),
        conduction: conduction(table, checks)?,
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

/// Conductivities with the key that gives them.
struct GivenConduction {
    key: &'static str,
    span: Span,
    conduction: Conduction,
}

/// Returns the conductivities of the pair, or `Some(None)` if the manifest gives none. Refuses
/// values that would have no effect.
fn conduction(table: &SolveTable, checks: &mut StageChecks) -> Option<Option<Conduction>> {
    let given = match table.layer.written() {
        None => of_half_spaces(table, checks)?,
        Some(layer) => of_layered(table, layer, checks)?,
    };
    let Some(GivenConduction { key, span, conduction }) = given else {
        return Some(None);
    };
    if !checks.value("stiffness", &table.stiffness)? {
        let message = format!("`{key}` has no effect without `stiffness = true`");
        let problem = Problem::new(message, span, "needs the stiffness of contacts");
        return checks.reject(problem.help(
            "the conductance of a contact is computed with its stiffness: add `stiffness = true` \
             to the stage",
        ));
    }
    let is_unknown = |unit: &&String| length_ratio(unit, "m").is_none();
    if let Some(unit) = checks.surfaces.length_units.iter().find(is_unknown) {
        let message = match unit.as_str() {
            "" => format!("`{key}` needs lengths with a unit, but the surfaces have none"),
            unit => {
                format!("`{key}` needs lengths with a unit, but the surfaces are in `{unit}`")
            }
        };
        let label = "conductances in units of the SI need the side in metres";
        let problem = Problem::new(message, span, label);
        return checks.reject(
            problem.help("give the side of the surfaces with its unit, as in `side = \"100 um\"`"),
        );
    }
    Some(Some(conduction))
}

/// Returns the conductivities of one or two half-spaces.
fn of_half_spaces(table: &SolveTable, checks: &mut Checks) -> Option<Option<GivenConduction>> {
    let bodies = table.bodies.written().map_or(&[][..], |bodies| &bodies.value);
    let conductivities = of_all(bodies, "conductivity", |body| &body.conductivity, checks)?;
    let resistivities = of_all(bodies, "resistivity", |body| &body.resistivity, checks)?;
    let keys = [("conductivity", conductivities.first()), ("resistivity", resistivities.first())];
    let Some((key, first)) = keys.into_iter().find_map(|(key, first)| Some((key, first?))) else {
        return Some(None);
    };
    let sum = |values: &[&Spanned<f64>], term: fn(f64) -> f64| -> Option<f64> {
        let terms = values.iter().map(|value| term(decimal::nearest(value.value)));
        terms.reduce(|one, other| one + other)
    };
    let conduction = Conduction {
        conductivity: sum(&conductivities, |value| 1.0 / value).map(|sum| 2.0 / sum),
        resistivity: sum(&resistivities, |value| value).map(|sum| sum / 2.0),
        layer: None,
    };
    Some(Some(GivenConduction { key, span: first.span.clone(), conduction }))
}

/// Returns the conductivities of a layered body and of the rough body, or `Some(None)` if the
/// manifest gives none. A rigid base conducts perfectly, and so does a rough body that is not
/// described.
fn of_layered(
    table: &SolveTable,
    layer: &Spanned<LayerTable>,
    checks: &mut Checks,
) -> Option<Option<GivenConduction>> {
    let bodies = table.bodies.written().map_or(&[][..], |bodies| &bodies.value);
    let mut of_bodies =
        bodies.iter().flat_map(|body| [&body.value.conductivity, &body.value.resistivity]);
    if let Some(written) = of_bodies.find_map(|key| key.written()) {
        let message = "a conductivity in `bodies` has no effect with a `layer`";
        let problem = Problem::new(message, written.span.clone(), "belongs into `layer`")
            .and(layer.span.clone(), "the layer");
        return checks.reject(problem.help(
            "write `conductivity` or `resistivity` in `layer`, in its `substrate`, and in \
             `counter_body` for the rough body",
        ));
    }
    let substrate = table.substrate.written();
    let counter_body = table.counter_body.written();
    let heat = [
        Some(("layer", &layer.span, &layer.value.conductivity)),
        substrate.map(|below| ("substrate", &below.span, &below.value.conductivity)),
        counter_body.map(|body| ("counter_body", &body.span, &body.value.conductivity)),
    ];
    let current = [
        Some(("layer", &layer.span, &layer.value.resistivity)),
        substrate.map(|below| ("substrate", &below.span, &below.value.resistivity)),
        counter_body.map(|body| ("counter_body", &body.span, &body.value.resistivity)),
    ];
    let conductivities = of_parts("conductivity", heat, checks)?;
    let resistivities = of_parts("resistivity", current, checks)?;
    let (key, [own, of_substrate, of_counter_body], is_resistive) =
        match (conductivities, resistivities) {
            (None, None) if counter_body.is_some() => {
                let span = &counter_body?.span;
                let message = "`counter_body` has neither a `conductivity` nor a `resistivity`";
                return checks.refuse("counter_body", message, span, "describes no conduction");
            }
            (None, None) => return Some(None),
            (Some(found), None) => ("conductivity", found, false),
            (None, Some(found)) => ("resistivity", found, true),
            (Some([heat, ..]), Some([current, ..])) => {
                let message = "a `layer` has either a `conductivity` or a `resistivity`";
                let problem = Problem::new(message, current?.span.clone(), "for a current")
                    .and(heat?.span.clone(), "for heat");
                return checks.reject(problem.help(
                    "heat and current spread differently in a layer: give each in a stage of its \
                     own; loads with stored `pressures` are not solved again",
                ));
            }
        };
    let of_layer = own?;
    let number = |value: &Spanned<f64>| decimal::nearest(value.value);
    let to = |other: Option<&Spanned<f64>>| {
        other.map_or(0.0, |other| {
            let ratio = number(of_layer) / number(other);
            decimal::nearest(if is_resistive { 1.0 / ratio } else { ratio })
        })
    };
    let [to_substrate, to_counter_body] = [to(of_substrate), to(of_counter_body)];
    if let Some(ratio) = [to_substrate, to_counter_body].into_iter().find(|r| !r.is_finite()) {
        let message = format!("the ratio of two values of `{key}` is {ratio:?}");
        return checks.refuse("layer", message, &of_layer.span, "out of the range of numbers");
    }
    // k_s = 2/(1/k₁ + 1/k₃) and ρ_s = (ρ₁ + ρ₃)/2.
    let pair = (1.0 + to_counter_body) / 2.0;
    let conduction = Conduction {
        conductivity: (!is_resistive).then(|| number(of_layer) / pair),
        resistivity: is_resistive.then(|| number(of_layer) * pair),
        layer: Some(LayerConduction { to_substrate, to_counter_body }),
    };
    Some(Some(GivenConduction { key, span: of_layer.span.clone(), conduction }))
}

/// A body that the current flows through, with the name of its table, and a key of it.
type BodyKey<'k> = (&'static str, &'k Span, &'k Key<f64>);

/// Returns the values of a key of layer, substrate and rough body, or `Some(None)` if none of them
/// has it. Refuses a key that one of the described bodies lacks.
fn of_parts<'k>(
    name: &str,
    keys: [Option<BodyKey<'k>>; 3],
    checks: &mut Checks,
) -> Option<Option<[Option<&'k Spanned<f64>>; 3]>> {
    let values = keys.map(|key| key.and_then(|(_, _, key)| key.written()));
    let Some(given) = values.iter().flatten().next() else {
        return Some(None);
    };
    let mut described = keys.iter().flatten();
    let Some((table, span, _)) = described.find(|(_, _, key)| key.written().is_none()) else {
        return Some(Some(values));
    };
    let message = format!("`{table}` lacks the `{name}`");
    let problem = Problem::new(message, (*span).clone(), format!("has no `{name}`"))
        .and(given.span.clone(), "another body has it");
    checks.reject(problem.help(format!(
        "the current flows through all bodies: give `{name}` in `{table}`; a rigid base, and a rough \
         body without `counter_body`, conduct perfectly"
    )))
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

/// Elastic layer, the value of `layer`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerTable {
    /// Thickness of the layer, in the unit of the lengths of the surfaces or with a unit.
    #[schemars(extend("exclusiveMinimum" = 0), transform = length)]
    pub thickness: Spanned<f64>,
    /// Poisson's ratio ν of the layer, above −1 and at most 0.5.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = -1))]
    pub poisson_ratio: Spanned<f64>,
    /// Connection of the layer with its rigid base. Coatings have no such key, because they are
    /// bonded to the half-space below them.
    #[serde(default)]
    #[schemars(extend("default" = "bonded"))]
    pub base: Key<Base>,
    /// Young's modulus E of the layer. E* of the stage is then E/(1 − ν²). Give it here, or
    /// `effective_modulus` or `bodies` in the stage.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = pressure)]
    pub youngs_modulus: Key<f64>,
    /// Shear modulus of a coating over that of the half-space below it, which `substrate`
    /// describes. Young's moduli of both determine it, too; their ratio is another number. By
    /// default the layer has a rigid base.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub modulus_ratio: Key<f64>,
    /// Thermal conductivity of the layer, such as `"0.4 W/(m K)"`; a plain number is in W/(m K).
    /// With `stiffness = true`, the conductance of the contacts is then solved, and a `measure`
    /// stage has thermal conductances and resistances in units of the SI.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = conductivity)]
    pub conductivity: Key<f64>,
    /// Electrical resistivity of the layer, such as `"22 nohm m"`; a plain number is in Ω m. It has
    /// the effect of a `conductivity` for an electric current. Give one of the two.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = resistivity)]
    pub resistivity: Key<f64>,
}

/// Half-space below a coating, the value of `substrate`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubstrateTable {
    /// Poisson's ratio ν of the half-space, above −1 and at most 0.5.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = -1))]
    pub poisson_ratio: f64,
    /// Young's modulus E of the half-space, for a layer with `youngs_modulus`. The ratio of the
    /// shear moduli follows from both. By default the layer has a `modulus_ratio`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = pressure)]
    pub youngs_modulus: Key<f64>,
    /// Thermal conductivity of the half-space, needed if the `layer` has one.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = conductivity)]
    pub conductivity: Key<f64>,
    /// Electrical resistivity of the half-space, needed if the `layer` has one.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0), transform = resistivity)]
    pub resistivity: Key<f64>,
}

/// Rigid rough body that is pressed into a layer, the value of `counter_body`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CounterBodyTable {
    /// Thermal conductivity of the rough body, for a `layer` with a `conductivity`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = conductivity)]
    pub conductivity: Key<f64>,
    /// Electrical resistivity of the rough body, for a `layer` with a `resistivity`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = resistivity)]
    pub resistivity: Key<f64>,
}

/// Returns the layer of a point, or `Some(None)` for a half-space. Refuses keys that do not go with
/// a layer.
pub fn layer(
    table: &SolveTable,
    boundary: Boundary,
    checks: &mut StageChecks,
) -> Option<Option<GivenLayer>> {
    let Some(written) = checks.optional("layer", &table.layer)? else {
        return Some(None);
    };
    let LayerTable { thickness, poisson_ratio, .. } = &written.value;
    check_other_keys(table, boundary, &written.value, checks)?;
    let support = support(table, written, checks)?;
    let thickness = in_unit_of_surfaces(thickness, checks)?;
    let poisson_ratio = decimal::nearest(poisson_ratio.value);
    Some(Some(GivenLayer { thickness, poisson_ratio, support }))
}

/// Refuses keys of physics that is not combined with a layer, and bodies that are not the layer.
fn check_other_keys(
    table: &SolveTable,
    boundary: Boundary,
    layer: &LayerTable,
    checks: &mut Checks,
) -> Option<()> {
    if let (Boundary::Free, Some(written)) = (boundary, table.boundary.written()) {
        let message = "a `layer` needs a periodic cell, but `boundary` is \"free\"";
        let label = "must be \"periodic\" with `layer`";
        return checks.refuse("boundary", message, &written.span, label);
    }
    if let Some(written) = table.method.written().filter(|word| word.value == Method::Asperities) {
        let message = "`method = \"asperities\"` and `layer` exclude each other";
        let label = "Hertz contacts are on a half-space";
        return checks.refuse("method", message, &written.span, label);
    }
    let Some(bodies) = table.bodies.written() else {
        return Some(());
    };
    let LayerTable { poisson_ratio, youngs_modulus, .. } = layer;
    let (message, span, label) = match &bodies.value[..] {
        [Spanned { value: body, .. }] => {
            let own = youngs_modulus.written();
            let other = own.filter(|own| !decimal::is_same(own.value, body.youngs_modulus));
            match other {
                _ if !decimal::is_same(body.poisson_ratio, poisson_ratio.value) => (
                    "Poisson's ratio of the body in `bodies` differs from that of `layer`",
                    &poisson_ratio.span,
                    "Poisson's ratio of the layer",
                ),
                Some(other) => (
                    "Young's modulus of the body in `bodies` differs from that of `layer`",
                    &other.span,
                    "Young's modulus of the layer",
                ),
                None => return Some(()),
            }
        }
        _ => (
            "`bodies` has two bodies, but a layer is pressed by a rigid rough surface",
            &poisson_ratio.span,
            "Poisson's ratio of the layer",
        ),
    };
    let problem = Problem::new(message, bodies.span.clone(), "must be the layer alone")
        .and(span.clone(), label);
    checks.reject(problem.help(
        "loads refer to E* = E/(1 − ν²) of the layer: list only the layer in `bodies`, or give its \
         `effective_modulus`",
    ))
}

/// Returns what lies below the layer: a rigid base, or a half-space if the layer is a coating.
fn support(
    table: &SolveTable,
    layer: &Spanned<LayerTable>,
    checks: &mut Checks,
) -> Option<Support> {
    if let Some(substrate) = checks.optional("substrate", &table.substrate)? {
        let modulus_ratio = modulus_ratio(layer, substrate, checks)?;
        exclude! { &layer.value, checks,
            true => base: "a coating is bonded to the half-space below it";
        }?;
        let poisson_ratio = decimal::nearest(substrate.value.poisson_ratio);
        return Some(Support::HalfSpace { poisson_ratio, modulus_ratio });
    }
    let Some(ratio) = layer.value.modulus_ratio.written() else {
        return Some(Support::Rigid(layer.value.base.value().unwrap_or(Base::Bonded)));
    };
    let message = "the coating has no substrate";
    let problem = Problem::new(message, ratio.span.clone(), "ratio to the substrate");
    let help = "add `substrate = { poisson_ratio = … }`, or remove `modulus_ratio` for a layer on a \
                rigid base";
    checks.reject(problem.help(help))
}

/// Returns the shear modulus of a coating over that of the half-space below it, which is given or
/// follows from Young's moduli: G = E/(2 (1 + ν)).
fn modulus_ratio(
    layer: &Spanned<LayerTable>,
    substrate: &Spanned<SubstrateTable>,
    checks: &mut Checks,
) -> Option<f64> {
    let (above, below) = (&layer.value, &substrate.value);
    let ratio = above.modulus_ratio.written();
    let moduli = (above.youngs_modulus.written(), below.youngs_modulus.written());
    let problem = match (ratio, moduli) {
        (None, (Some(above_modulus), Some(below_modulus))) => {
            let shear_modulus = |modulus: f64, ratio: f64| {
                decimal::nearest(modulus) / (1.0 + decimal::nearest(ratio))
            };
            let ratio = shear_modulus(above_modulus.value, above.poisson_ratio.value)
                / shear_modulus(below_modulus.value, below.poisson_ratio);
            return Some(decimal::nearest(ratio));
        }
        (Some(ratio), (_, None)) => return Some(decimal::nearest(ratio.value)),
        (Some(ratio), (_, Some(modulus))) => {
            let message = "`modulus_ratio` and `substrate.youngs_modulus` exclude each other";
            Problem::new(message, ratio.span.clone(), "gives the ratio of the shear moduli")
                .and(modulus.span.clone(), "also determines the ratio")
        }
        (None, _) => {
            let message = "`layer` lacks the ratio of its shear modulus to that of `substrate`";
            Problem::new(message, layer.span.clone(), "no `modulus_ratio`")
                .and(substrate.span.clone(), "the half-space below the layer")
        }
    };
    checks.reject(problem.help(
        "give either `modulus_ratio` in `layer`, or `youngs_modulus` in `layer` and in `substrate`; \
         for a layer on a rigid base, remove `substrate`",
    ))
}

#[cfg(test)]
mod tests {
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
