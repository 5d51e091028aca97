//! Keys of the stages that reduce tables.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use asperity_manifest::written::{Key, Written, table};

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
    /// such as `"q05"`, confidence intervals of the mean such as `"ci95"` (Student's t). `"sem"`
    /// and intervals count surfaces: rows of one seed and realization are one sample. Against
    /// `load` the `"slope"` of the mean, the `"secant"`, and the `"approach"` of an area a to full
    /// contact, −ln[(1 − a) y √(2π)]; and in groups that span several loads `"regr_slope"` and
    /// `"regr_intercept"` of the least-squares line against `load`.
    #[schemars(extend("default" = ["mean", "sd", "sem"]))]
    pub statistics: Key<Vec<Written<String>>>,
    /// Theories whose area stands beside, under each row's load, as `area_MODEL`; with the slope,
    /// secant or approach to full contact where `statistics` ask for it. Asperity models take
    /// Nayak's parameter α of the spectrum over the modes of the cell, as `nayak_lattice` has it.
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
