//! Keys of layers and coatings.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Method, SolveTable};
use crate::check_context::Surfaces;
use crate::exclusions::exclude;
use crate::lengths::in_unit_of_surfaces;
use crate::solve::layer::GivenLayer;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{conductivity, length, pressure, resistivity};
use asperity_manifest::keys::{Key, Spanned};
use asperity_mechanics::elasticity::{Base, Support};
use asperity_mechanics::grid::Boundary;

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
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<Option<GivenLayer>> {
    let Some(written) = checks.optional("layer", &table.layer)? else {
        return Some(None);
    };
    let LayerTable { thickness, poisson_ratio, .. } = &written.value;
    check_other_keys(table, boundary, &written.value, checks)?;
    let support = support(table, written, checks)?;
    let thickness = in_unit_of_surfaces(thickness, surfaces, checks)?;
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
