//! Keys of the stages that fit.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::StrDeserializer;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};

use asperity_manifest::written::{Key, Written, deserialize_either, table};

/// The largest `bootstrap`.
pub const MOST_RESAMPLINGS: u32 = 1_000_000;
/// `bootstrap` when left out.
pub const DEFAULT_RESAMPLINGS: u32 = 1000;
/// `level` when left out.
pub const DEFAULT_LEVEL: f64 = 0.95;

/// Fits the contact evolution law of Yastrebov, Anciaux & Molinari (2015).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionTable {
    /// What the law is fitted to: the slope of the mean curve, or the curve.
    #[schemars(extend("default" = "slope"))]
    pub to: Key<WrittenDatum>,
    /// What is known of κ: its value, `"free"`, or `"minimal-convex"`.
    #[schemars(extend("default" = "free"))]
    pub kappa: Key<WrittenKappa>,
    /// Smallest and largest load that count, in units of E* × rms slope.
    #[schemars(length(equal = 2), inner(range(min = 0)), extend("default" = [0.0, 0.06]))]
    pub window: Key<Vec<Written<f64>>>,
    /// Resamplings of whole surfaces for the intervals; 0 for none.
    #[schemars(range(min = 0, max = MOST_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<i64>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the resampling; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
}

table!(EvolutionTable, swept: ["to", "kappa"], lists: []);

/// Fits a law that has only its own parameters free.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LawTable {
    /// Smallest and largest load that count, in units of E* × rms slope: 0 to 0.06 when left out,
    /// for `"scaled-erf"` 0.3 to 2, for `"load-separation"` 0.01 to 0.1, for `"mesh-convergence"` and
    /// `"gap-percolation"` all. For `"self-affine"` the smallest and largest wavenumber, all when left out: a window leaves
    /// out what the instrument does not resolve.
    #[schemars(length(equal = 2), inner(range(min = 0)))]
    pub window: Key<Vec<Written<f64>>>,
    /// Resamplings of whole surfaces for the intervals; 0 for none.
    #[schemars(range(min = 0, max = MOST_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<i64>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the resampling; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
}

table!(LawTable, swept: [], lists: []);

/// What a fit compares.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrittenDatum {
    /// The slope of the mean curve, by differences.
    Slope,
    /// The mean curve.
    Area,
}

/// What is known of κ.
#[derive(Debug, Clone, Copy, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenKappa {
    /// Its value.
    Given(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// How to find it.
    Word(KappaWord),
}

/// How κ is found.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KappaWord {
    /// It is fitted like the other parameters.
    Free,
    /// The smallest for which the slopes of all curves of the stage are convex.
    MinimalConvex,
}

deserialize_either! {
    'de, WrittenKappa, "a number, `\"free\"` or `\"minimal-convex\"`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<WrittenKappa, E> {
        Ok(WrittenKappa::Given(number as f64))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<WrittenKappa, E> {
        Ok(WrittenKappa::Given(number))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<WrittenKappa, E> {
        KappaWord::deserialize(StrDeserializer::new(word)).map(WrittenKappa::Word)
    }
}
