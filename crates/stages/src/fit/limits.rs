//! Limits of an observable of rough contact where small numbers vanish, as fitted to tables.
//!
//! Rows are sorted into groups, within which only the parameters of the terms vary; each group is
//! fitted under each load, by each combination of the forms that terms may take. One row a fit.

use std::collections::BTreeSet;

use serde::Serialize;

use super::Params;
use crate::columns::{K_LOWER, K_ROLLOFF};
use asperity_manifest::expression::Expression;
use asperity_statistics::FitError;
use asperity_statistics::bootstrap::Intervals;
use asperity_statistics::limits::{Assessment, Comparison, LimitFit, LimitProblem, TermForm};
use asperity_tables::table::{Table, TableError};

pub mod columns;
pub mod keys;
mod observations;
pub mod octaves;

pub use observations::{Group, groups};

/// The word in manifests and tables.
pub const WORD: &str = "limits";

/// All loads, unless others are given: no surface is out of full contact under ten times its rms
/// slope × E*.
pub const WINDOW: [f64; 2] = [0.0, 10.0];

/// Terms that a law may have: three limits, and one term more.
pub const MOST_TERMS: usize = 4;
/// Combinations of forms that are compared.
pub const MOST_COMBINATIONS: usize = 64;

/// What is taken to which limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "law", rename = "limits")]
pub struct LimitChoices {
    /// The observable Q.
    pub of: Expression,
    /// The loads at which it is looked at; all those of the window when empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<f64>,
    pub terms: Vec<Term>,
    /// Parameters that vary among the points of one fit.
    pub over: BTreeSet<String>,
    /// The column with the standard error of a fitted parameter; none where rows are about
    /// surfaces, whose scatter tells it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// A small number, and what the observable may be of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// The small number, an expression in parameters.
    pub of: Expression,
    pub forms: Vec<Form>,
}

/// What a term may be of its small number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    Power(f64),
    FreePower,
    Logarithm,
}

impl Form {
    /// As numerics know it.
    pub fn numeric(self) -> TermForm {
        match self {
            Form::Power(exponent) => TermForm::Power(exponent),
            Form::FreePower => TermForm::FreePower,
            Form::Logarithm => TermForm::Logarithm,
        }
    }

    /// What tables call it.
    pub fn word(self) -> String {
        match self {
            Form::Power(exponent) => format!("power {exponent}"),
            Form::FreePower => "power, free".to_owned(),
            Form::Logarithm => "logarithm".to_owned(),
        }
    }
}

impl LimitChoices {
    /// Whether the ends of plateaus, where there are any, go along with `k_lower`.
    fn goes_with_rolloff(&self, table: &Table) -> bool {
        let varies = |name: &str| self.over.contains(name);
        varies(K_LOWER.name) && !varies(K_ROLLOFF.name) && table.has(K_ROLLOFF.name)
    }

    /// Every choice of one form for each term, the last term's fastest.
    pub fn combinations(&self) -> Vec<Vec<Form>> {
        self.terms.iter().fold(vec![Vec::new()], |chosen, term| {
            let extended = chosen.iter().flat_map(|before| {
                let with = |form: &Form| before.iter().copied().chain([*form]).collect();
                term.forms.iter().map(with)
            });
            extended.collect()
        })
    }
}

/// One fit.
pub struct Line<'a> {
    pub group: &'a Group,
    /// Under which load, if there are any.
    pub load: Option<f64>,
    pub forms: Vec<Form>,
    /// Points that have the observable there.
    pub points: usize,
    /// The fewest surfaces of a point.
    pub surfaces: usize,
    pub outcome: Result<Outcome, FitError>,
}

/// A fit, how well it does, and how it compares.
pub struct Outcome {
    pub fit: LimitFit,
    pub judged: Assessment,
    /// Intervals of the limit, the coefficients and the free exponents.
    pub intervals: Intervals,
    /// How it compares with other forms for the same points.
    pub comparison: Comparison,
}

/// Fits every group under every load.
///
/// # Errors
/// When a column is missing.
pub fn run(table: &Table, choices: &LimitChoices, params: &Params) -> Result<Table, TableError> {
    let groups = groups(table, choices, params.window())?;
    let lines: Vec<Line> = groups
        .iter()
        .flat_map(|group| group.loads.iter().map(move |&load| (group, load)))
        .flat_map(|(group, load)| lines(group, load, choices, params))
        .collect();
    Ok(columns::table(table, choices, params, &lines))
}

/// The fits of one group under one load, by each combination of forms.
fn lines<'a>(
    group: &'a Group,
    load: Option<f64>,
    choices: &LimitChoices,
    params: &Params,
) -> Vec<Line<'a>> {
    let points = group.points_under(load);
    let count = points.len();
    let combinations = choices.combinations();
    let line = |forms: Vec<Form>, surfaces, outcome| Line {
        group,
        load,
        forms,
        points: count,
        surfaces,
        outcome,
    };
    let problem = match LimitProblem::new(points) {
        Ok(problem) => problem,
        Err(error) => {
            let failed = combinations.into_iter();
            let failed = failed.map(|forms| line(forms, 0, Err(error.clone())));
            return failed.collect();
        }
    };
    let numeric: Vec<Vec<TermForm>> = combinations
        .iter()
        .map(|forms| forms.iter().map(|form| form.numeric()).collect())
        .collect();
    let fits: Vec<_> = numeric.iter().map(|forms| problem.fit(forms)).collect();
    let fitted: Vec<(&[TermForm], &LimitFit)> = numeric
        .iter()
        .zip(&fits)
        .filter_map(|(forms, fit)| Some((&forms[..], fit.as_ref().ok()?)))
        .collect();
    let resampled = problem.resample(&fitted, &params.bootstrap());
    let mut resampled = resampled.intervals.into_iter().zip(resampled.comparison);
    let fits = combinations.into_iter().zip(&numeric).zip(&fits);
    fits.map(|((forms, numeric), fit)| {
        let outcome = fit.clone().map(|fit| {
            let (intervals, comparison) = resampled.next().expect("each fit was resampled");
            Outcome { judged: problem.assess(numeric, &fit), fit, intervals, comparison }
        });
        line(forms, problem.surfaces(), outcome)
    })
    .collect()
}

#[cfg(test)]
mod tests;
