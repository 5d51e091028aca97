//! The surfaces of a parameter point: a fixed number, or as many as a condition needs.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Mul;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::per_axis::PerAxis;
use crate::surface::{Heights, Origin, Params};
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::{GridPoint, Key, KeyTable, Section, Spanned, deserialize_either};

/// Text of the condition that all claims of the study are decided.
const CLAIMS_DECIDED: &str = "claims decided";

/// Maximum number of surfaces of a parameter point.
const MAX: u32 = 1_000_000;
/// Minimum number of surfaces for which a standard error exists.
const MIN: u32 = 2;
/// Default value of `at_least`.
pub const AT_LEAST: u32 = 10;

/// Keys of adaptive sampling, which draws surfaces until a condition on a mean or on claims holds.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Growing {
    /// Number of surfaces at the start, before the condition is tested.
    #[serde(default)]
    #[schemars(range(min = MIN, max = MAX), extend("default" = AT_LEAST))]
    pub at_least: Key<u32>,
    /// Maximum number of surfaces, even if the condition does not hold.
    #[schemars(range(min = MIN, max = MAX))]
    pub at_most: Spanned<u32>,
    /// Condition that ends sampling. `"sem(STAGE.COLUMN) < 0.5 %"` bounds the standard error of the
    /// mean over surfaces, relative to the mean, at every point and load; without `%` the bound is
    /// in the unit of the column. If the stage computes multilevel means, each mesh gets its own
    /// number of surfaces. `"claims decided"` waits for all claims that the study can judge,
    /// and `"decided(CLAIM, …)"` for the claims that it names (`asperity claims` lists them).
    /// Conditions on claims need `at_least` of 5 or more.
    pub until: Spanned<String>,
}

/// The surfaces of one parameter point, which differ only by the realization.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedSurfaces {
    /// Recipe of the first surface, which is realization 0.
    pub params: Params,
    /// Number of surfaces, at least one except for samples. With adaptive sampling, the number at
    /// the start.
    pub realizations: u32,
    /// Adaptive sampling, which is the same at all points of a stage; `None` for a fixed number.
    pub growth: Option<Arc<Growth>>,
    /// Index of a measured surface among the samples of its parameter point; `None` for other
    /// surfaces. Each sample is planned alone, with one realization, or none while adaptive
    /// sampling has not reached it.
    pub sample: Option<u32>,
    /// True if the values of `nodes` and `side` that were read as pairs could also be lists to
    /// sweep.
    pub may_be_swept: bool,
}

impl PlannedSurfaces {
    /// Returns the maximum number of surfaces.
    pub fn at_most(&self) -> u32 {
        match &self.growth {
            Some(growth) => self.with_surfaces(growth.at_most).realizations,
            None => self.realizations,
        }
    }

    /// Returns the number of surfaces of the parameter point, as far as these tell it: a sample
    /// tells that the samples before it are planned, too.
    pub fn surfaces(&self) -> u32 {
        self.realizations + self.sample.filter(|_| self.realizations > 0).unwrap_or(0)
    }

    /// Returns the plan with another number of surfaces of the parameter point.
    pub fn with_surfaces(&self, surfaces: u32) -> PlannedSurfaces {
        let realizations = match self.sample {
            Some(sample) => u32::from(sample < surfaces),
            None => surfaces,
        };
        PlannedSurfaces { realizations, ..self.clone() }
    }
}

/// Adaptive sampling of a stage: its condition and the bounds of the number of surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Number of surfaces at the start.
    pub at_least: u32,
    /// Maximum number of surfaces, even if the condition does not hold.
    pub at_most: u32,
    /// Condition that ends the sampling.
    pub until: Until,
}

/// A condition that ends sampling, on a mean or on claims.
#[derive(Debug, Clone, PartialEq)]
pub enum Until {
    /// The standard error of a mean is below a bound.
    Mean(KnownMean),
    /// The named claims are decided. An empty list stands for all claims that the study can judge.
    Claims(Vec<String>),
}

/// A bound of the standard error of a mean: `sem(area.area_fraction) < 0.5 %`.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownMean {
    /// Name of the stage whose table has the column.
    pub stage: String,
    /// Name of the column whose mean over surfaces is bounded, at every point and load.
    pub column: String,
    /// Upper bound of the standard error of the mean.
    pub limit: Limit,
}

/// An upper bound of a standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// Bound in the unit of the column.
    Absolute(f64),
    /// Bound relative to the mean, as a fraction.
    Relative(f64),
}

impl fmt::Display for Until {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Until::Mean(mean) => mean.fmt(formatter),
            Until::Claims(names) if names.is_empty() => formatter.write_str(CLAIMS_DECIDED),
            Until::Claims(names) => write!(formatter, "decided({})", names.join(", ")),
        }
    }
}

impl fmt::Display for KnownMean {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let KnownMean { stage, column, limit } = self;
        write!(formatter, "sem({stage}.{column}) < {limit}")
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Limit::Absolute(limit) => write!(formatter, "{limit}"),
            // The product may have spurious last digits.
            Limit::Relative(ratio) => write!(formatter, "{} %", (ratio * 1e8).round() / 1e6),
        }
    }
}

/// Multiplies a bound by a factor and rounds the product to three significant digits.
impl Mul<f64> for Limit {
    type Output = Limit;

    fn mul(self, factor: f64) -> Limit {
        let times = |limit: f64| {
            let exact = format!("{:.2e}", limit * factor);
            exact.parse().unwrap_or(f64::INFINITY)
        };
        match self {
            Limit::Absolute(limit) => Limit::Absolute(times(limit)),
            Limit::Relative(ratio) => Limit::Relative(times(ratio)),
        }
    }
}

/// Parses a condition of adaptive sampling. Returns `None` if the text is not a condition.
pub fn parse(text: &str) -> Option<Until> {
    let text = text.trim();
    if text.split_whitespace().eq(CLAIMS_DECIDED.split_whitespace()) {
        return Some(Until::Claims(Vec::new()));
    }
    let named = text.strip_prefix("decided").map(str::trim_start);
    let names = named.and_then(|named| named.strip_prefix('(')?.strip_suffix(')'));
    match names {
        Some(list) => {
            let names: Vec<String> = list.split(',').map(|name| name.trim().to_owned()).collect();
            (!names.iter().any(String::is_empty)).then_some(Until::Claims(names))
        }
        None => known_mean(text).map(Until::Mean),
    }
}

/// Parses a bound of a standard error: `sem(STAGE.COLUMN) < 0.5 %`.
fn known_mean(text: &str) -> Option<KnownMean> {
    let inside = text.strip_prefix("sem")?.trim_start().strip_prefix('(')?;
    let (mean, rest) = inside.split_once(')')?;
    let (stage, column) = mean.split_once('.')?;
    let number = rest.trim_start().strip_prefix('<')?.trim();
    let (number, is_relative) = match number.strip_suffix('%') {
        Some(number) => (number.trim_end(), true),
        None => (number, false),
    };
    let limit = number.parse().ok().filter(|limit: &f64| limit.is_finite() && *limit > 0.0)?;
    Some(KnownMean {
        stage: stage.trim().to_owned(),
        column: column.trim().to_owned(),
        limit: if is_relative { Limit::Relative(limit / 100.0) } else { Limit::Absolute(limit) },
    })
}

/// Plans a single surface, for files and shapes, which have no realizations.
pub fn single(heights: Heights, side: Option<PerAxis<f64>>, origin: Origin) -> PlannedSurfaces {
    PlannedSurfaces {
        params: Params { heights, side, origin },
        realizations: 1,
        growth: None,
        sample: None,
        may_be_swept: false,
    }
}

/// The number of surfaces at each parameter point, the value of `realizations`.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Realizations {
    /// A fixed number of surfaces.
    Number(#[schemars(range(min = 1, max = MAX))] u32),
    /// As many surfaces as a condition needs.
    Until(Growing),
}

deserialize_either!(Realizations { whole => Number, table => Until });

/// Returns the number of surfaces at the start, and the adaptive sampling (`None` for a fixed
/// number of surfaces).
pub fn realizations(
    key: &Key<Realizations>,
    checks: &mut Checks,
) -> Option<(u32, Option<Arc<Growth>>)> {
    let Some(written) = checks.optional("realizations", key)? else {
        return Some((checks.default_of("realizations"), None));
    };
    let growing = match &written.value {
        Realizations::Number(number) => return Some((*number, None)),
        Realizations::Until(growing) => growing,
    };
    let at_least = checks.value("realizations.at_least", &growing.at_least)?;
    let Spanned { value: at_most, span } = &growing.at_most;
    let until = checked(&growing.until, checks)?;
    if at_least > *at_most {
        let message = format!("`at_least = {at_least}` is above `at_most = {at_most}`");
        return checks.refuse("realizations", message, span, "must be at least `at_least`");
    }
    let growth = Growth { at_least, at_most: *at_most, until };
    Some((at_least, Some(Arc::new(growth))))
}

/// Parses the condition of adaptive sampling. Reports a text that is not a condition.
fn checked(written: &Spanned<String>, checks: &mut Checks) -> Option<Until> {
    parse(&written.value).or_else(|| {
        let message = format!("cannot read the condition {:?}", written.value);
        let label = "must be `sem(STAGE.COLUMN) < 0.5 %`, `sem(STAGE.COLUMN) < 0.01` (in the unit of the \
                     column), `claims decided` or `decided(CLAIM, …)`";
        checks.refuse("realizations.until", message, &written.span, label)
    })
}

/// Applies `surfaces` to each parameter point and reports points with equal parameters. Returns
/// `None` if the surfaces of a point could not be determined.
pub fn surfaces<T: KeyTable>(
    section: &Section<T>,
    problems: &mut Problems,
    mut surfaces: impl FnMut(&T, &mut Checks) -> Option<PlannedSurfaces>,
) -> Option<Vec<PlannedSurfaces>> {
    let mut checked =
        |point: &GridPoint<T>| surfaces(&point.table, &mut Checks::new(section, point, problems));
    let found: Vec<Option<_>> = section.points.iter().map(&mut checked).collect();
    let planned: Vec<PlannedSurfaces> = found.into_iter().collect::<Option<_>>()?;
    check_growth(section, &planned, problems)?;
    check_numbers(section, &planned, problems)?;
    let params = planned.iter().map(|surfaces| &surfaces.params);
    report_equal_points(section, params, problems);
    Some(planned)
}

/// Refuses several numbers of surfaces at one parameter point.
fn check_numbers<T>(
    section: &Section<T>,
    planned: &[PlannedSurfaces],
    problems: &mut Problems,
) -> Option<()> {
    if planned.iter().all(|one| one.realizations == planned[0].realizations) {
        return Some(());
    }
    let mut numbers = BTreeMap::new();
    for (point, surfaces) in section.points.iter().zip(planned) {
        let text = serde_json::to_string(&surfaces.params).expect("parameters are plain data");
        let number = surfaces.realizations;
        let first = *numbers.entry(text).or_insert(number);
        if first != number {
            let message = "a parameter point has several numbers of surfaces";
            let label = format!("{first} and {number} surfaces");
            problems.push(Problem::new(message, point.span.clone(), label).help(
                "give each mesh its own number, as in `cases = [{ nodes = 128, realizations = 400 \
                 }, { nodes = 256, realizations = 60 }]`",
            ));
            return None;
        }
    }
    Some(())
}

/// Refuses a stage whose parameter points have different conditions on the number of surfaces.
fn check_growth<T>(
    section: &Section<T>,
    planned: &[PlannedSurfaces],
    problems: &mut Problems,
) -> Option<()> {
    let growth = |index: usize| planned[index].growth.as_deref();
    let Some(other) = (1..planned.len()).find(|&index| growth(index) != growth(0)) else {
        return Some(());
    };
    let message = "the parameter points of a stage have different conditions in `realizations`";
    let problem = Problem::new(message, section.points[other].span.clone(), "another condition");
    problems.push(problem.and(section.points[0].span.clone(), "first point").help(
        "write the condition once, outside of `cases`; it applies to all points of the stage",
    ));
    None
}

/// Returns the condition that the key `realizations` has, if it has one.
pub fn growing(key: &Key<Realizations>) -> Option<&Growing> {
    match &key.written()?.value {
        Realizations::Until(growing) => Some(growing),
        Realizations::Number(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_with_and_without_spaces() {
        let shown = |text: &str| parse(text).map(|until| until.to_string());
        let same = Some("sem(area.area_fraction) < 0.5 %".to_owned());
        assert_eq!(shown("sem(area.area_fraction) < 0.5 %"), same);
        assert_eq!(shown(" sem ( area . area_fraction )<0.50%"), same);
        assert_eq!(shown("sem(s.alpha)<1e-3").as_deref(), Some("sem(s.alpha) < 0.001"));
        assert_eq!(shown(" claims  decided").as_deref(), Some("claims decided"));
        assert_eq!(
            shown("decided( area-above-persson,slope-decreases )").as_deref(),
            Some("decided(area-above-persson, slope-decreases)")
        );
    }

    #[test]
    fn anything_else_is_no_condition() {
        for text in [
            "",
            "sem",
            "sem(area)",
            "sem(area.x) > 1",
            "sem(area.x) < ",
            "sem(area.x) < 0 %",
            "sem(area.x) < -1",
            "sem(area.x) < nan",
            "sd(area.x) < 1",
            "sem(area.x) < 1 % x",
            "claims",
            "claimsdecided",
            "decided",
            "decided()",
            "decided(slope-decreases,)",
            "decided(slope-decreases",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
