//! Fits of the limit of an observable where small parameters vanish.
//!
//! Rows are grouped so that only the parameters of the terms vary within a group. Each group is
//! fitted under each load with each combination of the forms of the terms, and each fit is one row
//! of the table.

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
mod observations;
pub mod octaves;

pub use observations::{ObservedGroup, groups};

/// Name of the law in manifests and tables.
pub const WORD: &str = "limits";

/// Default window of loads. It contains all practical loads, because a periodic surface is in full
/// contact at 10 E* × rms slope.
pub const WINDOW: [f64; 2] = [0.0, 10.0];

/// Maximum number of terms of a law, one more than the usual three limits.
pub const MAX_TERMS: usize = 4;
/// Maximum number of combinations of forms that are fitted.
pub const MAX_COMBINATIONS: usize = 64;

/// Law Q = Q₀ + Σ cⱼ fⱼ(xⱼ), and the choice of data for the fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "law", rename = "limits")]
pub struct LimitChoices {
    /// Expression of the observable Q in columns.
    pub of: Expression,
    /// Loads at which fits are made, or empty for all loads of the window.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<f64>,
    pub terms: Vec<Term>,
    /// Parameters that vary among the points of one fit.
    pub over: BTreeSet<String>,
    /// Column with the standard error of the observable, if it is a fitted parameter. `None` for
    /// rows of single surfaces, whose scatter gives the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// Term cⱼ fⱼ(xⱼ) of the law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Small parameter xⱼ, an expression in parameters.
    pub of: Expression,
    /// Forms fⱼ that are fitted and compared.
    pub forms: Vec<FormChoice>,
}

/// Form of a term as a function of its small parameter, as a manifest gives it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FormChoice {
    Power(f64),
    FreePower,
    Logarithm,
}

impl FormChoice {
    /// Converts the form for the numerical fit.
    pub fn term_form(self) -> TermForm {
        match self {
            FormChoice::Power(exponent) => TermForm::Power(exponent),
            FormChoice::FreePower => TermForm::FreePower,
            FormChoice::Logarithm => TermForm::Logarithm,
        }
    }

    /// Returns the name of the form in tables.
    pub fn word(self) -> String {
        match self {
            FormChoice::Power(exponent) => format!("power {exponent}"),
            FormChoice::FreePower => "power, free".to_owned(),
            FormChoice::Logarithm => "logarithm".to_owned(),
        }
    }
}

impl LimitChoices {
    /// Returns whether `k_rolloff` must vary in proportion to `k_lower` within a fit.
    fn scales_rolloff(&self, table: &Table) -> bool {
        let varies = |name: &str| self.over.contains(name);
        varies(K_LOWER.name) && !varies(K_ROLLOFF.name) && table.has(K_ROLLOFF.name)
    }

    /// Returns all combinations of one form per term. The form of the last term varies fastest.
    pub fn combinations(&self) -> Vec<Vec<FormChoice>> {
        self.terms.iter().fold(vec![Vec::new()], |chosen, term| {
            let extended = chosen.iter().flat_map(|before| {
                let with = |form: &FormChoice| before.iter().copied().chain([*form]).collect();
                term.forms.iter().map(with)
            });
            extended.collect()
        })
    }
}

/// Row of the table of fits.
pub struct LimitRow<'a> {
    pub group: &'a ObservedGroup,
    /// Load of the fit; `None` if the fitted rows have no loads.
    pub load: Option<f64>,
    pub forms: Vec<FormChoice>,
    /// Number of points at which the observable is known.
    pub points: usize,
    /// Smallest number of surfaces among the points.
    pub surfaces: usize,
    pub outcome: Result<Outcome, FitError>,
}

/// Fit with its quality and its intervals.
pub struct Outcome {
    pub fit: LimitFit,
    pub assessment: Assessment,
    /// Intervals of the limit, the coefficients and the free exponents, in this order.
    pub intervals: Intervals,
    /// Comparison with other forms for the same points.
    pub comparison: Comparison,
}

/// Fits every group of points at every load, and returns the table of fits.
///
/// # Errors
/// Returns an error if a column is missing.
pub fn run(table: &Table, choices: &LimitChoices, params: &Params) -> Result<Table, TableError> {
    let groups = groups(table, choices, params.window())?;
    let lines: Vec<LimitRow> = groups
        .iter()
        .flat_map(|group| group.loads.iter().map(move |&load| (group, load)))
        .flat_map(|(group, load)| lines(group, load, choices, params))
        .collect();
    Ok(columns::table(table, choices, params, &lines))
}

/// Fits one group of points at one load with each combination of forms.
fn lines<'a>(
    group: &'a ObservedGroup,
    load: Option<f64>,
    choices: &LimitChoices,
    params: &Params,
) -> Vec<LimitRow<'a>> {
    let points = group.points_under(load);
    let count = points.len();
    let combinations = choices.combinations();
    let line = |forms: Vec<FormChoice>, surfaces, outcome| LimitRow {
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
            let failed = combinations.into_iter().map(|forms| line(forms, 0, Err(error.clone())));
            return failed.collect();
        }
    };
    let term_forms: Vec<Vec<TermForm>> = combinations
        .iter()
        .map(|forms| forms.iter().map(|form| form.term_form()).collect())
        .collect();
    let fits: Vec<_> = term_forms.iter().map(|forms| problem.fit(forms)).collect();
    let fitted: Vec<(&[TermForm], &LimitFit)> = term_forms
        .iter()
        .zip(&fits)
        .filter_map(|(forms, fit)| Some((&forms[..], fit.as_ref().ok()?)))
        .collect();
    let estimates = problem.resample(&fitted, &params.bootstrap());
    let mut resampled = estimates.intervals.into_iter().zip(estimates.comparison);
    let fits = combinations.into_iter().zip(&term_forms).zip(&fits);
    fits.map(|((forms, term_forms), fit)| {
        let outcome = fit.clone().map(|fit| {
            let (intervals, comparison) = resampled.next().expect("each fit was resampled");
            Outcome { assessment: problem.assess(term_forms, &fit), fit, intervals, comparison }
        });
        line(forms, problem.surfaces(), outcome)
    })
    .collect()
}

#[cfg(test)]
mod tests;
