//! Keys of the stages that press surfaces.
//!
//! The comments of the keys are what editors show and what messages quote.

use asperity_contact::solver::{DEFAULT_PAIR_LIMIT, DEFAULT_TOLERANCE};
use std::fmt;

use schemars::{JsonSchema, Schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer, StrDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use asperity_manifest::written::{Key, Written, deserialize_either, table};

/// The most bins of a distribution.
pub const MOST_BINS: u32 = 10_000;
/// The largest `max_pairs`.
pub const MOST_PAIRS: u32 = 1_000_000;

/// Presses surfaces through one block of loads.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolveTable {
    /// Effective modulus E*, with 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂; `bodies` may stand instead.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    pub effective_modulus: Key<f64>,
    /// The two bodies in contact, or one pressed against a rigid one; instead of
    /// `effective_modulus`.
    #[schemars(length(min = 1, max = 2))]
    pub bodies: Key<Vec<Written<Body>>>,
    /// The loads, one after the other: a list, or `{ from, to, steps, spacing }`.
    #[schemars(required)]
    pub loads: Key<Loads>,
    /// How contact is found: of every node, by boundary elements, or as Hertz' contacts of the summits of
    /// the surface.
    #[schemars(extend("default" = "boundary-elements"))]
    pub method: Key<Method>,
    /// How asperities act on each other, where `method` is "asperities": `"explicit"` when left out.
    pub interaction: Key<InteractionWord>,
    /// What lies beyond the edges of the surfaces: the same again, for ever, or nothing.
    #[schemars(extend("default" = "periodic"))]
    pub boundary: Key<Boundary>,
    /// What `loads` and `pressures` are measured in.
    #[schemars(extend("default" = "relative"))]
    pub load_unit: Key<PressureUnit>,
    /// The highest pressure that the material bears: where it is reached, the material yields, and
    /// every load must be below it. For loading alone: unloading is another problem. None when left
    /// out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hardness: Key<f64>,
    /// What `hardness` is measured in.
    #[schemars(extend("default" = "absolute"))]
    pub hardness_unit: Key<PressureUnit>,
    /// When to stop: largest gap in contact and largest penetration outside it, over rms slope ×
    /// mesh step.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_TOLERANCE))]
    pub tolerance: Key<f64>,
    /// Pairs of Fourier transforms after which a load is given up; its row says so.
    #[schemars(range(min = 1, max = MOST_PAIRS), extend("default" = DEFAULT_PAIR_LIMIT))]
    pub max_pairs: Key<i64>,
    /// Which pressure fields are stored: `"none"`, `"all"`, or those at some of the `loads`.
    #[schemars(extend("default" = "none"))]
    pub pressures: Key<Pressures>,
    /// Bins in which pressures are counted under each load, `{ count, to }`: so many equal ones from
    /// zero to that pressure in units of E* × rms slope. A `measure` stage with `what = "pressures"`
    /// tells their distribution, and no pressure has to be stored.
    pub pressure_bins: Key<Bins>,
    /// Bins in which gaps are counted under each load, `{ count, to }`: so many equal ones from zero
    /// to that gap in rms heights. A `measure` stage with `what = "gaps"` tells their distribution. It
    /// costs a pair of transforms a load.
    pub gap_bins: Key<Bins>,
    /// Whether what flows through the gap is found under each load, along x and along y, by Reynolds'
    /// equation on the mesh. It takes ten to twenty times as long as the loads themselves; surfaces must
    /// repeat themselves.
    #[schemars(extend("default" = false))]
    pub flow: Key<bool>,
}

table!(SolveTable, swept: ["effective_modulus", "tolerance", "boundary", "hardness", "interaction"], lists: []);

/// Equal bins from zero on.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Bins {
    /// How many there are.
    #[schemars(required, range(min = 1, max = MOST_BINS))]
    pub count: Key<i64>,
    /// Where the last one ends.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub to: Key<f64>,
}

/// An elastic body.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Young's modulus E.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub youngs_modulus: Written<f64>,
    /// Poisson's ratio ν, above −1 and at most 0.5.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = -1))]
    pub poisson_ratio: Written<f64>,
    /// The highest pressure that it bears, in the unit of its modulus. It bounds nothing and changes no
    /// result, as `hardness` of the stage does, but a run tells where the peak pressure passes it.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hardness: Key<f64>,
}

/// How contact is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The contact of every node is solved.
    BoundaryElements,
    /// Hertz' elliptic contacts of the summits.
    Asperities,
}

/// How asperities act on each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum InteractionWord {
    /// Not at all.
    None,
    /// Through the mean pressure, which displaces the body uniformly: areas and forces under a load are
    /// those without interaction.
    MeanField,
    /// Each through its own force.
    Explicit,
}

/// What lies beyond the edges of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// The surface repeats itself.
    Periodic,
    /// Nothing: pressure is zero there, displacements are absolute, contact and clusters end at the
    /// edges.
    Free,
}

/// What loads and hardnesses are measured in.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PressureUnit {
    /// In units of E* × rms slope.
    Relative,
    /// As pressures, in the unit of the moduli.
    Absolute,
}

/// The loads of a block.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Loads {
    /// One by one, ascending.
    List(#[schemars(length(min = 1), transform = positive_items)] Vec<Written<f64>>),
    /// Between two loads.
    Range(LoadRange),
}

/// Loads between two, the first of which is left out and the last included.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LoadRange {
    /// Where the block starts; no load itself, so that blocks join without a repetition.
    #[schemars(range(min = 0), extend("default" = 0.0))]
    pub from: Key<f64>,
    /// The last load.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub to: Key<f64>,
    /// Number of loads.
    #[schemars(required, range(min = 1, max = 100_000))]
    pub steps: Key<i64>,
    /// Equal differences, or equal ratios.
    #[schemars(extend("default" = "linear"))]
    pub spacing: Key<Spacing>,
}

/// How loads are spaced.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Geometric,
}

/// Which pressure fields are stored.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Pressures {
    /// None or all.
    Word(PressuresWord),
    /// Those at some loads.
    At(#[schemars(length(min = 1), transform = positive_items)] Vec<Written<f64>>),
}

fn positive_items(schema: &mut Schema) {
    let items = schema.get_mut("items").and_then(Value::as_object_mut);
    if let Some(items) = items {
        items.insert("exclusiveMinimum".to_owned(), 0.into());
    }
}

/// All pressure fields, or none.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PressuresWord {
    /// No pressure field.
    None,
    /// The pressure field of every load.
    All,
}

deserialize_either! {
    'de, Loads, "a list of loads or a table `{ from, to, steps, spacing }`",

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Loads, A::Error> {
        Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(Loads::List)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Loads, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(table)).map(Loads::Range)
    }
}

deserialize_either! {
    'de, Pressures, "`\"none\"`, `\"all\"` or a list of loads",

    fn visit_str<E: Error>(self, word: &str) -> Result<Pressures, E> {
        PressuresWord::deserialize(StrDeserializer::new(word)).map(Pressures::Word)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Pressures, A::Error> {
        Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(Pressures::At)
    }
}
