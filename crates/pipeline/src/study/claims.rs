//! Claims that a study declares: statements with the quantities that test them.
//!
//! The crate `claims` computes the quantities of each [`ClaimSpec`] from the tables of the study.

mod check;
pub(super) mod files;

use std::collections::BTreeMap;

use asperity_manifest::expression::Expression;
use asperity_stages::Kind;
use asperity_stages::columns::{HURST, K_LOWER, K_ROLLOFF, K_UPPER, NODES};
use asperity_statistics::expectation::Expectation;

pub use crate::manifest::claim::{Origin, Reduction, Statistic};
pub use crate::manifest::figure::SelectedValue;
pub use check::{ClaimContext, check};
pub use files::{own_files, shipped};

/// Text, source and test of a claim.
#[derive(Debug, Clone, PartialEq)]
pub struct ClaimSpec {
    /// Name of the claim, the same in every study.
    pub name: String,
    /// File of claims that has the claim, or `None` if it is in the manifest.
    pub file: Option<String>,
    pub origin: Origin,
    /// Text of the claim, quoted if it is the words of a paper.
    pub text: String,
    pub source: String,
    /// The quantity in words, with its unit if that is known.
    pub quantity: String,
    /// Condition that all quantities must meet.
    pub expected: Expectation,
    /// Reason for the expected range, and remarks.
    pub reason: String,
    /// Name of the report's figure that shows the quantity.
    pub figure: Option<String>,
    /// Test of the claim, or `None` for a misprint.
    pub test: Option<Test>,
}

/// Quantities of a claim, as expressions in the values of groups.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// Data of the claim. A closed form has none.
    pub data: Vec<DataSpec>,
    pub statistic: Option<Statistic>,
    pub loads: Loads,
    pub areas: Vec<f64>,
    pub between: Vec<[f64; 2]>,
    pub along: Vec<String>,
    pub equal: Option<Vec<Expression>>,
    pub from_zero: bool,
    pub per: Option<Vec<Expression>>,
    pub reduce: Option<Reduction>,
    pub regression: Option<Regression>,
    pub order: Vec<Expression>,
    /// Values by names and numbers of parameters.
    pub reference: ReferenceValues,
    /// Name of the file of these values.
    pub reference_file: Option<String>,
    pub tested: Vec<(Expression, Expectation)>,
    /// Expressions with their labels. A single one has no label.
    pub quantities: Vec<(Option<String>, Expression)>,
    pub needs: Option<String>,
}

/// Values with the numbers of parameters at which they hold.
pub type ReferenceValues = Vec<(BTreeMap<String, f64>, f64)>;

/// Least-squares fit over the groups of a family.
#[derive(Debug, Clone, PartialEq)]
pub struct Regression {
    pub of: Expression,
    pub on: Vec<Expression>,
}

/// Values that a claim compares.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSpec {
    /// Name of the values in expressions.
    pub name: String,
    /// The data in words.
    pub label: String,
    pub source: Source,
    pub value: Expression,
    pub selection: BTreeMap<String, Vec<SelectedValue>>,
    /// Ranges of expressions in parameters.
    pub within: Vec<(Expression, Expectation)>,
    /// Data of groups that these data lack.
    pub otherwise: Option<Box<DataSpec>>,
    pub needs: Option<String>,
    pub needs_groups: Option<String>,
}

/// Tables that have the values of a claim.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// Table of the stage of this name, grouped by all parameters.
    Stage(String),
    /// Tables of all stages of a kind, grouped by spectrum and mesh.
    Spectra(Kind),
}

/// Loads at which a claim is tested.
#[derive(Debug, Clone, PartialEq)]
pub enum Loads {
    All,
    Lightest,
    Heaviest,
    At(Vec<AskedLoad>),
}

/// A load at which a claim is tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AskedLoad {
    pub value: f64,
    /// True for a pressure in pascals; otherwise the load is in units of E* × rms slope.
    pub is_pressure: bool,
}

/// Parameters of the groups of [`Source::Spectra`]. The last one is Nayak's parameter α over the
/// modes of the cell.
pub const SPECTRUM: [&str; 6] =
    [HURST.name, K_LOWER.name, K_ROLLOFF.name, K_UPPER.name, NODES.name, "nayak"];

impl ClaimSpec {
    /// Returns whether more surfaces can decide the claim.
    pub fn depends_on_surfaces(&self) -> bool {
        self.test.as_ref().is_some_and(|test| !test.data.is_empty())
    }
}

impl Test {
    /// Returns whether a claim reads the table of a stage.
    pub fn reads(&self, stage: &str, kind: Kind) -> bool {
        self.data.iter().any(|data| data.reads(stage, kind))
    }
}

impl DataSpec {
    fn reads(&self, stage: &str, kind: Kind) -> bool {
        let own = match &self.source {
            Source::Stage(name) => name == stage,
            // Limits are fitted to the rows of corrected areas.
            Source::Spectra(Kind::Fit) => kind == Kind::Correct,
            Source::Spectra(own) => *own == kind,
        };
        own || self.otherwise.as_ref().is_some_and(|data| data.reads(stage, kind))
    }
}
