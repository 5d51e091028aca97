//! Keys of the stages that evaluate contacts: measure, correct, fit and aggregate.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::written::{Key, Written, deserialize_either, table};

/// The largest `bootstrap`.
pub const MOST_RESAMPLINGS: u32 = 1_000_000;
/// `bootstrap` when left out.
pub const DEFAULT_RESAMPLINGS: u32 = 1000;
/// `level` when left out.
pub const DEFAULT_LEVEL: f64 = 0.95;
/// The largest `bins`.
pub const MOST_BINS: u32 = 1_000_000;
/// `bins` when left out.
pub const DEFAULT_BINS: u32 = 1000;
/// `range` when left out.
pub const DEFAULT_RANGE: f64 = 5.0;

/// Counts contacts, or the heights of surfaces.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureTable {
    /// Bins of the histogram of heights; for surfaces only.
    #[schemars(range(min = 1, max = MOST_BINS), extend("default" = DEFAULT_BINS))]
    pub bins: Key<i64>,
    /// Half width of the histogram of heights, in rms heights; for surfaces only.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = DEFAULT_RANGE))]
    pub range: Key<f64>,
    /// Whether all surfaces of a parameter point share one histogram, with mean and standard
    /// deviation between them, instead of having one each; for surfaces only.
    #[schemars(extend("default" = false))]
    pub pool: Key<bool>,
}

table!(MeasureTable, swept: [], lists: []);

/// Corrects the contact area for the mesh.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CorrectTable {
    /// The estimator, or several, each giving its own rows.
    #[schemars(extend("default" = "2017"))]
    pub correction: Key<Vec<Written<Correction>>>,
}

table!(CorrectTable, swept: [], lists: ["correction"]);

/// Fits the contact evolution law of Yastrebov, Anciaux & Molinari (2015).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionTable {
    /// What the law is fitted to: the slope of the mean curve, or the curve.
    #[schemars(extend("default" = "slope"))]
    pub to: Key<Datum>,
    /// What is known of κ: its value, `"free"`, or `"minimal-convex"`.
    #[schemars(extend("default" = "free"))]
    pub kappa: Key<Kappa>,
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
    /// for `"scaled-erf"` 0.3 to 2, for `"load-separation"` 0.01 to 0.1, for `"mesh-convergence"` all.
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
pub enum Datum {
    /// The slope of the mean curve, by differences.
    Slope,
    /// The mean curve.
    Area,
}

/// Reduces tables to statistics.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AggregateTable {
    /// A query over the stages named in `from`; it replaces the other keys. Rows that no `order by`
    /// tells apart come in the order of the rows that they are made of.
    pub sql: Key<String>,
    /// What columns of the query's answer mean, by their names: `{ unit = "…", meaning = "…" }`.
    /// Columns called as in the tables that are read mean the same unless it is said here.
    pub columns: Key<BTreeMap<String, Written<ColumnTable>>>,
    /// Columns that name a group; every coordinate but surface, seed and realization when left out.
    pub group_by: Key<Vec<Written<String>>>,
    /// Columns to reduce.
    pub over: Key<Vec<Written<String>>>,
    /// What to compute of each: `"mean"`, `"sd"`, `"sem"`, `"min"`, `"max"`, `"median"`, quantiles
    /// such as `"q05"`, confidence intervals of the mean such as `"ci95"` (Student's t, over as many
    /// values as there are surfaces); against `load` the `"slope"` of the mean, the `"secant"`, and
    /// the `"approach"` of an area a to full contact, −ln[(1 − a) y √(2π)]; and in groups that span
    /// several loads `"regr_slope"` and `"regr_intercept"` of the least-squares line against `load`.
    #[schemars(extend("default" = ["mean", "sd", "sem"]))]
    pub statistics: Key<Vec<Written<String>>>,
    /// Theories whose area stands beside, under each row's load, as `area_MODEL`; with the slope,
    /// secant or approach to full contact where `statistics` ask for it. Asperity models take α
    /// from the spectrum in closed form.
    pub models: Key<Vec<Written<ModelWord>>>,
}

table!(AggregateTable, swept: [], lists: ["group_by", "over", "statistics", "models"]);

/// What a column of a query's answer means.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnTable {
    /// Unit of its values: `"1"` for pure numbers, empty where units make no sense.
    #[serde(default)]
    pub unit: String,
    /// One phrase that says what it means.
    pub meaning: String,
}

/// A theory of the contact area.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
pub enum ModelWord {
    /// Persson 2001.
    #[serde(rename = "persson")]
    Persson,
    /// Bush, Gibson & Thomas 1975.
    #[serde(rename = "bush-gibson-thomas")]
    BushGibsonThomas,
    /// The simplified elliptic model of Greenwood 2006.
    #[serde(rename = "greenwood-2006")]
    Greenwood2006,
    /// Spheres of the mean curvature of each summit, after Nayak and Thomas.
    #[serde(rename = "mean-curvature")]
    MeanCurvature,
    /// Greenwood & Williamson 1966 with the parameters of McCool 1986.
    #[serde(rename = "greenwood-mccool")]
    GreenwoodMccool,
    /// √(2π) times the load, what asperity models tend to at light load.
    #[serde(rename = "bgt-asymptote")]
    BgtAsymptote,
    /// Isolated cracks near full contact: 1 − (3/4) erfc(√2 y).
    #[serde(rename = "penny-crack")]
    PennyCrack,
}

/// What is known of κ.
#[derive(Debug, Clone, Copy, JsonSchema)]
#[schemars(untagged)]
pub enum Kappa {
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

/// An estimator of the contact area.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Correction {
    /// A known one.
    Word(CorrectionWord),
    /// Its coefficient, which is its name too.
    Coefficient(#[schemars(range(min = 0), extend("exclusiveMaximum" = 10))] f64),
    /// A coefficient with a name.
    Named(NamedCorrection),
}

/// A known estimator.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
pub enum CorrectionWord {
    /// The counted area.
    #[serde(rename = "none")]
    None,
    /// Half way between counting edge nodes and not: coefficient π/8.
    #[serde(rename = "pi/8")]
    PiOver8,
    /// Yastrebov, Anciaux & Molinari 2017: coefficient (π − 1 + ln 2)/24.
    #[serde(rename = "2017")]
    Of2017,
}

/// A coefficient with a name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedCorrection {
    /// What the column `correction` says.
    pub name: Written<String>,
    /// Share of Manhattan perimeter × mesh step taken off the counted area.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 10))]
    pub coefficient: Written<f64>,
}

deserialize_either! {
    'de, Kappa, "a number, `\"free\"` or `\"minimal-convex\"`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<Kappa, E> {
        Ok(Kappa::Given(number as f64))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Kappa, E> {
        Ok(Kappa::Given(number))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Kappa, E> {
        KappaWord::deserialize(StrDeserializer::new(word)).map(Kappa::Word)
    }
}

deserialize_either! {
    'de, Correction,
    "`\"none\"`, `\"pi/8\"`, `\"2017\"`, a coefficient or a table `{ name, coefficient }`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<Correction, E> {
        Ok(Correction::Coefficient(number as f64))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Correction, E> {
        Ok(Correction::Coefficient(number))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Correction, E> {
        CorrectionWord::deserialize(StrDeserializer::new(word)).map(Correction::Word)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Correction, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(table)).map(Correction::Named)
    }
}
