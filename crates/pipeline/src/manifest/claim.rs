//! Keys of the tables `[claim.NAME]`, with which a study declares statements that its results test,
//! and of the tables `[data.NAME]`, which name data that several claims use.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::figure::{Selected, WrittenTable};
use asperity_manifest::keys::declare::{list, required};
use asperity_manifest::keys::{Key, Spanned, deserialize_either, table};
use asperity_stages::Kind;

/// A statement that `asperity claims` tests with the results of the study: each quantity must be as
/// expected. Claims do not influence results or their keys.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClaimTable {
    /// The statement in words.
    #[schemars(transform = required)]
    pub text: Key<String>,
    /// Source of the statement, such as a section and figure of a paper.
    pub source: Key<String>,
    /// Origin of the statement. By default it is a statement of the study.
    pub origin: Key<Origin>,
    /// Reason for the expected range, and remarks.
    pub reason: Key<String>,
    /// Name of the figure of the report that shows the quantity.
    pub figure: Key<String>,
    /// The quantity in words. By default it is the expression `quantity`.
    pub description: Key<String>,
    /// Name of the stage whose table has the values. Groups of rows that differ in a parameter are
    /// compared, and the surfaces of a group give the interval.
    pub from: Key<String>,
    /// Column of the values, or an expression in columns of one row, such as
    /// `"area_fraction / load"`.
    pub value: Key<String>,
    /// Selection of the rows by columns, as for figures: `{ correction = "none", hurst = 0.8 }`. A
    /// parameter with a single selected value does not distinguish groups.
    #[serde(rename = "where")]
    pub selection: Key<BTreeMap<String, Spanned<Selected>>>,
    /// Ranges of expressions in parameters that a group must meet: `{ k_lower = ">= 8" }`.
    pub within: Key<BTreeMap<String, Spanned<RangeKey>>>,
    /// Names of tables `[data.NAME]` in place of `from` and `value`. `this` is a value of the first
    /// one; values of the others, at the same parameters and loads, have their names.
    #[schemars(length(min = 1), transform = list)]
    pub data: Key<Vec<Spanned<String>>>,
    /// Number that is computed from the curve of each group over its loads, in place of a mean at
    /// each load.
    pub statistic: Key<Statistic>,
    /// Loads at which the claim is tested: numbers, pressures such as `"50 MPa"`, `"lightest"` or
    /// `"heaviest"`. The nearest load of a group counts, if it is within 10 %. By default all loads
    /// count.
    #[schemars(length(min = 1), transform = list)]
    pub loads: Key<Vec<Spanned<LoadKey>>>,
    /// Contact areas at which the statistic `at-area` interpolates.
    #[schemars(length(min = 1), transform = list)]
    pub areas: Key<Vec<Spanned<f64>>>,
    /// Ranges of pressures, in units of E* × rms slope, of which the value is the fraction of the
    /// nominal area. Only for `value = "pressure_density"`.
    #[schemars(length(min = 1))]
    pub between: Key<Vec<[f64; 2]>>,
    /// Parameter, a list of parameters, or `"load"`: the quantity compares each group with the one
    /// of the next larger value, all else equal. `this` and `next` are their values, and
    /// `previous` that of the next smaller one.
    #[schemars(length(min = 1), transform = list)]
    pub along: Key<Vec<Spanned<String>>>,
    /// Expressions in parameters that must be equal in groups that `along` compares, in place of
    /// all other parameters: `["k_upper / k_lower", "nodes"]`.
    #[schemars(length(min = 1), transform = list)]
    pub equal: Key<Vec<Spanned<String>>>,
    /// True if curves start at load 0 with the value 0, which is then the `previous` of the
    /// lightest load.
    pub from_zero: Key<bool>,
    /// Expressions in parameters. Groups that agree in them are one family, from which `regress`
    /// and `reduce` compute one quantity. By default `regress` has a family for all parameters
    /// that are not in `on`, and `reduce` one for each mesh.
    #[schemars(length(min = 1), transform = list)]
    pub per: Key<Vec<Spanned<String>>>,
    /// Reduction of the values of a family to one, before the quantity is computed.
    pub reduce: Key<Reduction>,
    /// Dependent variable of a least-squares fit over the groups of a family, such as
    /// `"ln(this)"`. The quantity can use `slope1` and `slope2`, the slopes of the plane over the
    /// variables in `on`; `step1` and `range1`, the smallest step and the range of a variable;
    /// `residual1`, the rms residual of the line over one variable alone; and `spread`, the rms
    /// deviation from the mean.
    pub regress: Key<String>,
    /// Independent variables of `regress`, as expressions in parameters. Slopes need one or two.
    #[schemars(length(min = 1, max = 3), transform = list)]
    pub on: Key<Vec<Spanned<String>>>,
    /// Expressions in parameters by which groups are ordered. `first` is the value of the first
    /// group, with which the quantity compares all others.
    #[schemars(length(min = 1), transform = list)]
    pub order: Key<Vec<Spanned<String>>>,
    /// Table of reference values, as CSV. Its first line has names of parameters, and then that of
    /// the values. `reference` is the value at the parameters of a group.
    pub reference: Key<String>,
    /// Ranges of expressions that a quantity must meet to be tested at all, such as
    /// `{ this = "<= 0.8" }`. They are computed from all surfaces.
    pub tested: Key<BTreeMap<String, Spanned<RangeKey>>>,
    /// The quantity: an expression in `this`, `next`, `load`, parameters and the other names that
    /// the keys above explain, or a table of several expressions with their names. `next_load` and
    /// `next_hurst` are properties of the next group, `deviation` is the standard deviation between
    /// surfaces, `error` the standard error of the mean, and `surfaces` their number; names of
    /// theories, such as `persson`, are their area fractions at the load. By default the quantity
    /// is `this`.
    pub quantity: Key<QuantityKey>,
    /// Range in which all quantities are expected: `"> 0"`, `"<= 0.05"` or `[0.9, 1.1]`.
    pub expected: Key<RangeKey>,
    /// What a study needs if it has the data, but not for this claim.
    pub needs: Key<String>,
}

table!(ClaimTable);

/// Data that several claims use.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DataTable {
    /// The data in words.
    pub label: Key<String>,
    /// Name of the stage whose table has the values.
    pub from: Key<String>,
    /// Kind of stage, in place of `from`, for claims in files that many studies use. The values are
    /// those of random isotropic surfaces in all stages of this kind, and groups are spectra and
    /// meshes. If other parameters vary as well, such as the tolerance, the combination with the
    /// most rows counts.
    pub kind: Key<SourceKind>,
    /// Column of the values, or an expression in columns of one row.
    pub value: Key<String>,
    /// Selection of the rows by columns, as for figures.
    #[serde(rename = "where")]
    pub selection: Key<BTreeMap<String, Spanned<Selected>>>,
    /// Ranges of expressions in parameters that a group must meet.
    pub within: Key<BTreeMap<String, Spanned<RangeKey>>>,
    /// Name of data that are used for groups which these data do not have.
    pub otherwise: Key<String>,
    /// What a study without such rows needs.
    pub needs: Key<String>,
    /// What a study needs if no group meets `within`.
    pub needs_groups: Key<String>,
}

table!(DataTable);

/// Origin of a statement.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// A sentence of a paper.
    Paper,
    /// A misprint of a paper: a note without a verdict.
    Misprint,
    /// A statement of asperity or of other authors.
    Ours,
    /// A statement of the study.
    Study,
}

impl Origin {
    /// Returns the name of the origin in manifests and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Origin::Paper => "paper",
            Origin::Misprint => "misprint",
            Origin::Ours => "ours",
            Origin::Study => "study",
        }
    }
}

/// Kind of stage whose tables have the values of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SourceKind {
    /// Properties of surfaces.
    Generate,
    /// Asperity models of `solve` stages.
    Solve,
    /// Measured contacts, or distributions of contact pressures.
    Measure,
    /// Corrected areas.
    Correct,
    /// Limits of the secant that `fit` stages with `law = "limits"` compute.
    Fit,
}

impl SourceKind {
    pub fn kind(self) -> Kind {
        match self {
            SourceKind::Generate => Kind::Generate,
            SourceKind::Solve => Kind::Solve,
            SourceKind::Measure => Kind::Measure,
            SourceKind::Correct => Kind::Correct,
            SourceKind::Fit => Kind::Fit,
        }
    }
}

/// A number that a function computes from the values of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Statistic {
    /// Third divided difference of the value at three loads and at load 0, where it is 0. It is
    /// positive if the slope of the curve is convex.
    ThirdDifference,
    /// Area at which the slope of the area falls below that of Persson's theory.
    CrossingOfPersson,
    /// Smallest κ of the contact evolution law whose slopes are convex up to the load 0.06.
    LeastConvexKappa,
    /// Exponent of dp̄/dp₀ as a power of the area, up to the load 0.06.
    PressureGrowth,
    /// Rms relative residual of the contact evolution law, fitted to areas below 20 %.
    EvolutionResidual,
    /// Exponent η of the approach to full contact, at areas from 0.9 to 0.998.
    FullContactExponent,
    /// Area at which the relative difference of the second data from the first one is half of that
    /// at the lightest load.
    AreaOfHalfError,
    /// Exponent of the stiffness −dy/dū as a power of the load, between the loads 0.01 and 0.05.
    StiffnessExponent,
    /// Load up to which the two data agree within 10 %.
    LoadOfAgreement,
    /// Logarithm of the value, interpolated in the second data, at the values `areas` of these.
    AtArea,
    /// Corrected area at which the gap of each surface stops percolating.
    SealingArea,
    /// Coefficient c of the error of the mesh in A = A* + c S_d Δx, from several meshes.
    MeshError,
    /// Exponent of the bandwidth in the limits of κ, from the curvature of κ over its logarithm.
    KappaExponent,
    /// κ for the widest and the narrowest spectrum, in its limits, at the lightest load up to 0.02.
    KappaAtBandwidths,
    /// Contribution of a cell of sixteen longest wavelengths to κ.
    KappaOfCell,
    /// Contribution of a mesh of eight nodes per shortest wavelength to κ.
    KappaOfMesh,
    /// Exponent of α(ζ) for large ζ over twice the Hurst exponent.
    AsymptoteOfAlpha,
    /// Deficits of κ in the simplified elliptic model at two areas.
    GreenwoodDeficit,
    /// Relative decrease of the area of Bush, Gibson & Thomas from α = 2 to α = 10.
    AlphaInBgt,
    /// Third derivative of the area of Persson's theory at light loads.
    PerssonConcavity,
    /// Summits counted on twenty surfaces over the tabulated density.
    SummitDensity,
}

impl Statistic {
    /// Returns whether the number is that of a closed form, which needs no data.
    pub fn is_closed_form(self) -> bool {
        matches!(
            self,
            Statistic::AsymptoteOfAlpha
                | Statistic::GreenwoodDeficit
                | Statistic::AlphaInBgt
                | Statistic::PerssonConcavity
                | Statistic::SummitDensity
        )
    }
}

/// Reduction of the values of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reduction {
    /// Mean over the groups.
    Mean,
    /// Largest value of the groups.
    Max,
    /// The group with the largest quantity.
    Largest,
}

/// Range of numbers.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum RangeKey {
    /// A single number.
    Number(f64),
    /// A bound, such as `"> 0"` or `"<= 1"`, with a unit if the column has one.
    Word(String),
    /// Lower and upper end.
    List([f64; 2]),
}

deserialize_either!(RangeKey { number => Number, word => Word, list => List });

/// A load at which a claim is tested.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum LoadKey {
    /// Load in units of E* × rms slope.
    Number(f64),
    /// Pressure with its unit, `"lightest"` or `"heaviest"`.
    Word(String),
}

deserialize_either!(LoadKey { number => Number, word => Word });

/// One or several quantities.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum QuantityKey {
    /// An expression.
    Word(String),
    /// Expressions with their names.
    Table(BTreeMap<String, Spanned<String>>),
}

deserialize_either!(QuantityKey { word => Word, table => Table });

/// Claims and data of a manifest or of a file of claims, as written.
#[derive(Debug, Default)]
pub struct WrittenClaims {
    pub claims: Vec<WrittenTable<ClaimTable>>,
    pub data: Vec<WrittenTable<DataTable>>,
}
