//! Number of surfaces of a parameter point: fixed, or growing until a condition holds.
//!
//! The doc comments of keys are shown by editors and quoted in messages.

use std::fmt;
use std::ops::Mul;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Params;
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Spanned, deserialize_either};

/// Maximum number of surfaces of a point.
const MAX: u32 = 1_000_000;
/// Minimum number of surfaces that have a standard error.
const MIN: u32 = 2;
/// Default of `at_least`.
pub const AT_LEAST: u32 = 10;
/// Condition that all claims are decided.
const CLAIMS_DECIDED: &str = "claims decided";

/// The number of surfaces of each point of the grid.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Realizations {
    /// A fixed number.
    Number(#[schemars(range(min = 1, max = MAX))] u32),
    /// As many as a condition needs.
    Until(Growing),
}

/// As many surfaces as a condition on a mean or on claims needs.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Growing {
    /// Number of surfaces at the start.
    #[serde(default)]
    #[schemars(range(min = MIN, max = MAX), extend("default" = AT_LEAST))]
    pub at_least: Key<u32>,
    /// Number of surfaces at which sampling stops in any case.
    #[schemars(range(min = MIN, max = MAX))]
    pub at_most: Spanned<u32>,
    /// Condition that ends sampling. `"sem(STAGE.COLUMN) < 0.5 %"` bounds the standard error of the
    /// mean over surfaces, at each point and each load, relative to the mean; without `%` the bound
    /// is in the unit of the column. `"claims decided"` waits for all claims that the study can
    /// judge, and `"decided(CLAIM, …)"` for those that it names (`asperity claims` lists them).
    /// Claims need `at_least` of 5 or more.
    pub until: Spanned<String>,
}

deserialize_either!(Realizations { whole => Number, table => Until });

/// Surfaces that differ by their realization only.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedSurfaces {
    /// The first of them.
    pub params: Params,
    /// Number of surfaces, at least one; the number at the start if it grows.
    pub realizations: u32,
    /// Growth of the number, if it grows. Equal for all points of a stage.
    pub growth: Option<Arc<Growth>>,
    /// True if the lists that were read as pairs of nodes and sides might have been meant to be
    /// swept.
    pub may_be_swept: bool,
}

/// The growth of the number of surfaces of a stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Number of surfaces at the start.
    pub at_least: u32,
    /// Number of surfaces at which sampling stops in any case.
    pub at_most: u32,
    /// Condition that ends sampling.
    pub until: Until,
}

impl PlannedSurfaces {
    /// Returns the maximum number of surfaces.
    pub fn at_most(&self) -> u32 {
        let growth = self.growth.as_ref();
        growth.map_or(self.realizations, |growth| growth.at_most)
    }
}

/// A condition that ends sampling.
#[derive(Debug, Clone, PartialEq)]
pub enum Until {
    /// A mean is known with a given precision.
    Mean(KnownMean),
    /// The named claims are decided; an empty list stands for all that the study can judge.
    Claims(Vec<String>),
}

/// A bound of the standard error of a mean: `sem(area.area_fraction) < 0.5 %`.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownMean {
    /// The stage whose table has the column.
    pub stage: String,
    /// The column whose mean over surfaces is bounded, at each point and each load.
    pub column: String,
    /// Upper bound of the standard error of the mean.
    pub limit: Limit,
}

/// A bound of a standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// In the column's unit.
    Absolute(f64),
    /// Relative to the mean.
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

/// Multiplies a limit and rounds it to three digits.
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

/// Returns the number of surfaces at the start, and how it grows.
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

fn checked(written: &Spanned<String>, checks: &mut Checks) -> Option<Until> {
    parse(&written.value).or_else(|| {
        let message = format!("cannot read the condition {:?}", written.value);
        let label = "must be `sem(STAGE.COLUMN) < 0.5 %` (without `%` in the unit of the column), `claims \
                     decided` or `decided(CLAIM, …)`";
        checks.refuse("realizations.until", message, &written.span, label)
    })
}

/// Reads a condition; returns none if the text is not one.
pub fn parse(text: &str) -> Option<Until> {
    let text = text.trim();
    if text.split_whitespace().eq(CLAIMS_DECIDED.split_whitespace()) {
        return Some(Until::Claims(Vec::new()));
    }
    let named = text.strip_prefix("decided").map(str::trim_start);
    let names = named.and_then(|named| named.strip_prefix('(')?.strip_suffix(')'));
    match names {
        Some(names) => {
            let names = names.split(',').map(|name| name.trim().to_owned());
            let names: Vec<String> = names.collect();
            (!names.iter().any(String::is_empty)).then_some(Until::Claims(names))
        }
        None => known_mean(text).map(Until::Mean),
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_with_and_without_spaces_and_told_alike() {
        let told = |text: &str| parse(text).map(|until| until.to_string());
        let same = Some("sem(area.area_fraction) < 0.5 %".to_owned());
        assert_eq!(told("sem(area.area_fraction) < 0.5 %"), same);
        assert_eq!(told(" sem ( area . area_fraction )<0.50%"), same);
        assert_eq!(told("sem(s.alpha)<1e-3").as_deref(), Some("sem(s.alpha) < 0.001"));
        assert_eq!(told(" claims  decided").as_deref(), Some("claims decided"));
        assert_eq!(
            told("decided( area-above-persson,slope-decreases )").as_deref(),
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
