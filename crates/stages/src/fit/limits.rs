//! Fits of the limit of an observable where small parameters vanish.
//!
//! Rows are grouped so that only the parameters of the terms vary within a group. Each group is
//! fitted under each load with each combination of the forms of the terms, and each fit is one row
//! of the table.

pub mod columns;
mod observations;

use std::collections::BTreeSet;

use serde::Serialize;

use crate::columns::{K_LOWER, K_ROLLOFF};
use crate::ensemble::ParameterPoint;
use crate::fit::Params;
use asperity_manifest::decimal;
use asperity_manifest::expression::Expression;
use asperity_statistics::FitError;
use asperity_statistics::bootstrap::{Bootstrap, Intervals};
use asperity_statistics::limits::{Assessment, Comparison, LimitFit, LimitProblem, TermForm};
use asperity_tables::column::Value;
use asperity_tables::table::{Table, TableError};

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

/// Extension of a sweep by one octave towards one limit, by doubling parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Octave {
    /// Small parameter, as in the manifest.
    pub term: String,
    /// Names of the doubled parameters.
    pub doubled: Vec<String>,
    /// Varied parameters of the points from which doubling gives new points.
    pub from: Vec<ParameterPoint>,
    /// Ratio of the standard error of the limit expected with the new points to the present
    /// standard error; `None` if it cannot be estimated.
    pub error_ratio: Option<f64>,
}

/// Best fit of a group of points at a load, with the possible octaves towards each limit.
#[derive(Debug, Clone)]
pub struct FitWithOctaves {
    pub forms: Vec<FormChoice>,
    pub fit: LimitFit,
    /// Standard error of the limit; `None` without resamplings.
    pub standard_error: Option<f64>,
    /// Varied parameters of the points of the fit.
    pub points: Vec<ParameterPoint>,
    pub octaves: Vec<Octave>,
}

/// Fits one group of points at one load with the forms that have the smallest Akaike criterion, and
/// finds the possible octaves. Returns `None` if no fit succeeds.
pub fn advise(
    group: &ObservedGroup,
    load: Option<f64>,
    choices: &LimitChoices,
    bootstrap: &Bootstrap,
) -> Option<FitWithOctaves> {
    let (points, small): (Vec<ParameterPoint>, Vec<_>) =
        group.points_with_parameters(load).into_iter().unzip();
    let problem = LimitProblem::new(small).ok()?;
    let fits = choices.combinations().into_iter().filter_map(|forms| {
        let term_forms: Vec<TermForm> = forms.iter().map(|form| form.term_form()).collect();
        let fit = problem.fit(&term_forms).ok()?;
        Some((forms, term_forms, fit))
    });
    let best = fits.min_by(|one, other| one.2.akaike().total_cmp(&other.2.akaike()));
    let (forms, term_forms, fit) = best?;
    let resampled = problem.resample(&[(&term_forms, &fit)], bootstrap);
    let interval = resampled.intervals.first()?.intervals.as_ref();
    let octaves = steps(choices, &points).into_iter().map(|mut octave| {
        let more: Vec<Vec<f64>> = octave
            .from
            .iter()
            .map(|point| small_parameters(choices, &doubled(point, &octave.doubled)))
            .collect();
        octave.error_ratio = problem.predicted_error_ratio(&term_forms, &fit, &more);
        octave
    });
    Some(FitWithOctaves {
        octaves: octaves.collect(),
        standard_error: interval.map(|all| all[0].standard_error),
        forms,
        fit,
        points,
    })
}

/// Returns the octaves that make one small parameter smaller and leave the others unchanged.
fn steps(choices: &LimitChoices, points: &[ParameterPoint]) -> Vec<Octave> {
    let names: Vec<&String> = choices.over.iter().collect();
    let subsets = 1..1_usize << names.len().min(8);
    let steps = subsets.filter_map(|subset| {
        let members = names.iter().enumerate().filter(|(index, _)| subset >> index & 1 == 1);
        let chosen: Vec<String> = members.map(|(_, name)| (*name).clone()).collect();
        step(choices, points, chosen)
    });
    steps.collect()
}

fn step(
    choices: &LimitChoices,
    points: &[ParameterPoint],
    parameters: Vec<String>,
) -> Option<Octave> {
    if are_torn(points, &choices.over, &parameters) {
        return None;
    }
    let mut smaller: Option<String> = None;
    for (index, term) in choices.terms.iter().enumerate() {
        let text = term.of.to_string();
        let mut ratios = points.iter().map(|point| {
            let number = |point: &ParameterPoint| small_parameters(choices, point)[index];
            number(&doubled(point, &parameters)) / number(point)
        });
        let first = ratios.next()?;
        if ratios.any(|other| !decimal::is_same(first, other)) {
            return None;
        }
        if decimal::is_same(first, 1.0) {
            continue;
        }
        // Several terms may use the same small parameter with different forms.
        if first > 1.0 || smaller.as_ref().is_some_and(|other| *other != text) {
            return None;
        }
        smaller = Some(text);
    }
    let known: BTreeSet<&ParameterPoint> = points.iter().collect();
    let is_new = |point: &&ParameterPoint| !known.contains(&doubled(point, &parameters));
    let from: Vec<ParameterPoint> = points.iter().filter(is_new).cloned().collect();
    Some(Octave { term: smaller?, from, doubled: parameters, error_ratio: None })
}

/// Returns whether only one of two tied parameters is doubled.
fn are_torn(points: &[ParameterPoint], over: &BTreeSet<String>, doubled: &[String]) -> bool {
    let ratios = |one: &str, other: &str| {
        let ratio = |point: &ParameterPoint| number(point, one) / number(point, other);
        points.iter().map(ratio).collect::<Vec<f64>>()
    };
    let is_constant =
        |values: &[f64]| values.iter().all(|&value| decimal::is_same(value, values[0]));
    let varies = |name: &str| {
        !is_constant(&points.iter().map(|point| number(point, name)).collect::<Vec<f64>>())
    };
    let others = || over.iter().filter(|name| !doubled.contains(name) && varies(name));
    doubled
        .iter()
        .filter(|name| varies(name))
        .any(|one| others().any(|other| is_constant(&ratios(one, other))))
}

fn doubled(point: &ParameterPoint, parameters: &[String]) -> ParameterPoint {
    let value = |name: &str, value: &Value| match value {
        value if !parameters.iter().any(|other| other == name) => value.clone(),
        Value::Integer(number) => Value::Integer(number.saturating_mul(2)),
        Value::Real(number) => Value::Real(2.0 * number),
        text => text.clone(),
    };
    point.map(value)
}

fn small_parameters(choices: &LimitChoices, point: &ParameterPoint) -> Vec<f64> {
    let terms = choices.terms.iter();
    terms.map(|term| term.of.value(&|name| number(point, name))).collect()
}

fn number(point: &ParameterPoint, name: &str) -> f64 {
    point.get(name).and_then(Value::number).unwrap_or(f64::NAN)
}
