//! Advice on another octave towards a limit: the new points, and the expected reduction of the
//! standard error.
//!
//! Doubling some of the varied parameters gives a new point for every point. If this makes one
//! small parameter smaller and leaves the others unchanged, it is a step towards the limit of this
//! parameter alone. For example, with `k_lower / k_upper` and `k_upper / nodes`, doubling both
//! `k_upper` and `nodes` is a step towards the fractal limit.
//!
//! Two parameters that have the same ratio at all points, such as those of `k_upper = "8 *
//! k_lower"`, are tied: the points do not show the effect of their ratio. They are doubled
//! together.

use std::collections::BTreeSet;

use super::observations::ObservedGroup;
use super::{FormChoice, LimitChoices};
use crate::ensemble::ParameterPoint;
use asperity_manifest::decimal;
use asperity_statistics::bootstrap::Bootstrap;
use asperity_statistics::limits::{LimitFit, LimitProblem, TermForm};
use asperity_tables::column::Value;

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
    match point.get(name) {
        Some(Value::Real(number)) => *number,
        Some(Value::Integer(number)) => *number as f64,
        _ => f64::NAN,
    }
}
