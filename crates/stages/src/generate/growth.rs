//! How many surfaces a point has, and until when their number grows: keys, checks, and the plan.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::fmt;
use std::ops::Mul;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::Params;
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Written, deserialize_either};

/// The most surfaces of one point.
const MOST: u32 = 1_000_000;
/// The fewest surfaces that have a scatter.
const FEWEST: u32 = 2;
/// Surfaces to begin with, when nothing is said.
pub const AT_LEAST: u32 = 10;
/// The condition on all claims.
const CLAIMS_DECIDED: &str = "claims decided";

/// How many surfaces are drawn for each point of the grid.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Realizations {
    /// So many.
    Number(#[schemars(range(min = 1, max = MOST))] i64),
    /// As many as it takes to know a mean, or to decide claims.
    Until(Growing),
}

/// As many surfaces as it takes to know a mean, or to decide claims.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Growing {
    /// Surfaces to begin with.
    #[schemars(range(min = FEWEST, max = MOST), extend("default" = AT_LEAST))]
    pub at_least: Key<i64>,
    /// Surfaces at which to give up.
    #[schemars(required, range(min = FEWEST, max = MOST))]
    pub at_most: Key<i64>,
    /// What must hold at each point and each load: `"sem(STAGE.COLUMN) < 0.5 %"` of the mean, or
    /// without `%` in the unit of the column. `sem` is the standard error of the mean over surfaces.
    /// Or `"claims decided"`: all claims that the study can judge are decided; or
    /// `"decided(CLAIM, …)"`, those of these names, as `asperity claims` lists them. Then `at_least` is
    /// 5 or more.
    #[schemars(required)]
    pub until: Key<String>,
}

deserialize_either! {
    'de, Realizations, "a whole number or a table `{ at_least, at_most, until }`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<Realizations, E> {
        Ok(Realizations::Number(number))
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Realizations, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(table)).map(Realizations::Until)
    }
}

/// Surfaces that differ by their realization only.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedSurfaces {
    /// The first of them.
    pub params: Params,
    /// How many there are, at least one; at first, if their number grows.
    pub realizations: u32,
    /// Until when more are drawn, if their number is not given. Equal for all of a stage.
    pub growth: Option<Arc<Growth>>,
    /// Whether the lists that were read as its nodes and sides might have been meant to be swept.
    pub may_be_swept: bool,
}

/// How the number of surfaces of a stage grows.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Where it begins.
    pub at_least: u32,
    /// Where it ends in any case.
    pub at_most: u32,
    /// What is to be reached.
    pub until: Until,
}

impl PlannedSurfaces {
    /// The most surfaces that there may be.
    pub fn at_most(&self) -> u32 {
        let growth = self.growth.as_ref();
        growth.map_or(self.realizations, |growth| growth.at_most)
    }
}

/// What is to be reached.
#[derive(Debug, Clone, PartialEq)]
pub enum Until {
    /// A mean is known well enough.
    Mean(KnownMean),
    /// The claims of these names are decided; without any, all that the study can judge.
    Claims(Vec<String>),
}

/// When a mean is known well enough: `sem(area.area_fraction) < 0.5 %`.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownMean {
    /// The stage whose table has the column.
    pub stage: String,
    /// The column whose mean over surfaces it is about, at each point and each load.
    pub column: String,
    /// What the standard error of the mean must be below.
    pub limit: Limit,
}

/// A bound of a standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// In the column's unit.
    Absolute(f64),
    /// As a share of the mean.
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
            // A hundredth of a percentage may have a digit too many.
            Limit::Relative(share) => write!(formatter, "{} %", (share * 1e8).round() / 1e6),
        }
    }
}

/// So many times a limit, with three digits: more mean nothing.
impl Mul<f64> for Limit {
    type Output = Limit;

    fn mul(self, factor: f64) -> Limit {
        let times = |limit: f64| {
            let exact = format!("{:.2e}", limit * factor);
            exact.parse().unwrap_or(f64::INFINITY)
        };
        match self {
            Limit::Absolute(limit) => Limit::Absolute(times(limit)),
            Limit::Relative(share) => Limit::Relative(times(share)),
        }
    }
}

/// How many surfaces a point has at first, and what decides whether there will be more.
pub fn realizations(
    key: &Key<Realizations>,
    checks: &mut Checks,
) -> Option<(u32, Option<Arc<Growth>>)> {
    let Some(written) = key.written() else {
        return Some((1, None));
    };
    let growing = match &written.value {
        Realizations::Number(number) => {
            let number = Written { value: *number, span: written.span.clone() };
            return Some((checks.is_whole_in("realizations", &number, &(1..=MOST))?, None));
        }
        Realizations::Until(growing) => growing,
    };
    let at_least = checks.whole_or("at_least", &growing.at_least, FEWEST..=MOST, AT_LEAST);
    let here = ("realizations", &written.span);
    let written_most = checks.required_in(here, "at_most", &growing.at_most);
    let until = checks.required_in(here, "until", &growing.until);
    let at_most =
        written_most.and_then(|most| checks.is_whole_in("at_most", most, &(FEWEST..=MOST)));
    let until = until.and_then(|until| checked(until, checks));
    let (at_least, at_most, until) = (at_least?, at_most?, until?);
    if at_least > at_most {
        let message = format!("`at_least = {at_least}` lies above `at_most = {at_most}`");
        return checks.refuse("realizations", message, &written_most?.span, "larger");
    }
    let growth = Growth { at_least, at_most, until };
    Some((at_least, Some(Arc::new(growth))))
}

/// The condition, if it can be read.
fn checked(written: &Written<String>, checks: &mut Checks) -> Option<Until> {
    parse(&written.value).or_else(|| {
        let message = format!("{:?} is no condition on surfaces", written.value);
        let label = "must be `sem(STAGE.COLUMN) < 0.5 %`, or without `%` in the column's unit; or `claims \
                     decided`, or `decided(CLAIM, …)`";
        checks.refuse("realizations", message, &written.span, label)
    })
}

/// A condition, if the text is one.
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
    let (number, is_share) = match number.strip_suffix('%') {
        Some(number) => (number.trim_end(), true),
        None => (number, false),
    };
    let limit = number.parse().ok().filter(|limit: &f64| limit.is_finite() && *limit > 0.0)?;
    Some(KnownMean {
        stage: stage.trim().to_owned(),
        column: column.trim().to_owned(),
        limit: match is_share {
            true => Limit::Relative(limit / 100.0),
            false => Limit::Absolute(limit),
        },
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
