//! The surfaces of a parameter point: a fixed number, or as many as a condition needs.

use std::fmt;
use std::ops::Mul;
use std::sync::Arc;

use super::{Heights, Origin, Params};
use crate::per_axis::PerAxis;

/// Text of the condition that all claims of the study are decided.
const CLAIMS_DECIDED: &str = "claims decided";

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
