//! Statistics of a group of rows: their names in manifests and columns, and the statistics that
//! polars does not provide.
//!
//! Standard errors and confidence intervals of means use Student's t over surfaces. A surface
//! counts once, even if a group contains several of its rows: areas of one surface under
//! neighbouring loads are strongly correlated, and so are areas of one seed and realization at
//! several points of a sweep, which share random numbers (see [`sampling_units`]). For n surfaces
//! with sums Sᵢ over nᵢ rows, the mean m of all rows has the variance n/(n − 1) Σ(Sᵢ − m
//! nᵢ)²/(Σnᵢ)² of a ratio of two means. With one row per surface it equals the square of s/√n. A
//! single surface has no error.
//!
//! [`sampling_units`]: crate::ensemble::sampling_units
//!
//! Coverage of 95 % intervals of the mean of n values, in 20 000 simulated samples (6000 for
//! resampling with 1000 replicates, 4000 for n ≥ 20); ln x of the lognormal values has the standard
//! deviation σ:
//!
//! | values | | n = 5 | 10 | 20 | 50 |
//! |---|---|---|---|---|---|
//! | normal | Student's t | 0.95 | 0.95 | 0.95 | 0.95 |
//! | | percentiles of resamples | 0.85 | 0.90 | 0.93 | 0.94 |
//! | lognormal, σ = 0.5 | Student's t | 0.92 | 0.92 | 0.93 | 0.94 |
//! | | percentiles of resamples | 0.81 | 0.88 | 0.91 | 0.93 |
//! | lognormal, σ = 1 | Student's t | 0.82 | 0.84 | 0.86 | 0.90 |
//! | | percentiles of resamples | 0.72 | 0.81 | 0.84 | 0.90 |
//!
//! Student's t is never worse, needs no random numbers, and is exact for normal values. Areas of
//! surfaces of one spectrum are nearly normal.

use std::collections::HashMap;

use polars::prelude::{
    self, DataType, Expr, Field, LazyFrame, NULL, NamedFrom, PolarsResult, Schema, Series, col,
    lit, when,
};
use serde::Serialize;

use crate::StageError;
use crate::columns::{LOAD, columns, integer, real};
use asperity_queries::frame::polars_error;
use asperity_statistics::intervals::two_sided_quantile;
use asperity_tables::column::Column;

/// Statistic over the rows of a group.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Statistic {
    Mean,
    /// Sample standard deviation of the rows.
    Sd,
    /// Standard error of the mean over surfaces.
    Sem,
    Min,
    Max,
    /// Quantile of the rows by linear interpolation.
    Quantile(f64),
    /// Confidence interval of the mean at this level, by Student's t over surfaces.
    Confidence(f64),
    /// Slope of the least-squares line through the rows against `load`.
    #[serde(rename = "regr_slope")]
    RegressionSlope,
    /// Value of the least-squares line at zero load.
    #[serde(rename = "regr_intercept")]
    RegressionIntercept,
    /// Slope of the mean against `load`, by finite differences.
    Slope,
    /// Secant of the mean curve: the mean divided by `load`.
    Secant,
    /// Approach to full contact, F = −ln[(1 − a) y √(2π)] of the mean area a under the load y.
    Approach,
}

/// Statistics with a fixed name. Names of quantiles and intervals contain the decimals of a number:
/// `q05` is the 5 % quantile, `q975` the 97.5 % quantile, `ci95` the 95 % confidence interval.
const WORDS: [(&str, Statistic); 11] = [
    ("mean", Statistic::Mean),
    ("sd", Statistic::Sd),
    ("sem", Statistic::Sem),
    ("min", Statistic::Min),
    ("max", Statistic::Max),
    ("median", Statistic::Quantile(0.5)),
    ("regr_slope", Statistic::RegressionSlope),
    ("regr_intercept", Statistic::RegressionIntercept),
    ("slope", Statistic::Slope),
    ("secant", Statistic::Secant),
    ("approach", Statistic::Approach),
];

impl Statistic {
    /// Returns whether the statistic compares groups under several loads.
    pub fn is_against_load(self) -> bool {
        matches!(self, Statistic::Slope | Statistic::Secant | Statistic::Approach)
    }

    /// Returns the names of all statistics except quantiles and confidence intervals.
    pub fn words() -> impl Iterator<Item = &'static str> {
        WORDS.iter().map(|(word, _)| *word)
    }

    /// Returns the statistic that has this name in manifests.
    pub fn named(word: &str) -> Option<Statistic> {
        let known = WORDS.iter().find(|(known, _)| *known == word);
        known
            .map(|(_, statistic)| *statistic)
            .or_else(|| fraction_after("ci", word).map(Statistic::Confidence))
            .or_else(|| fraction_after("q", word).map(Statistic::Quantile))
    }

    /// Returns the suffix of the column of the statistic. For a confidence interval, it is the
    /// common beginning of the suffixes of both columns.
    pub fn suffix(self) -> String {
        let known = WORDS.iter().find(|(_, statistic)| *statistic == self);
        match (known, self) {
            (Some((word, _)), _) => (*word).to_owned(),
            (None, Statistic::Confidence(level)) => interval_word(level),
            (None, Statistic::Quantile(share)) => format!("q{share}").replace("q0.", "q"),
            (None, _) => unreachable!("every other statistic has a word"),
        }
    }

    /// Returns the name of the column with the statistic of a column.
    pub fn column_of(self, name: &str) -> String {
        format!("{name}_{}", self.suffix())
    }

    /// Returns the names of all columns with the statistic of a column.
    pub fn columns_of(self, name: &str) -> Vec<String> {
        self.suffixes().into_iter().map(|suffix| format!("{name}_{suffix}")).collect()
    }

    /// Returns the column of which `column` is this statistic, according to its name.
    pub fn base_of(self, column: &str) -> Option<&str> {
        column.strip_suffix(&self.suffix())?.strip_suffix('_')
    }

    /// Returns the suffixes of all columns of the statistic.
    pub fn suffixes(self) -> Vec<String> {
        match self {
            Statistic::Confidence(level) => {
                ["lower", "upper"].map(|end| format!("{}_{end}", interval_word(level))).into()
            }
            _ => vec![self.suffix()],
        }
    }
}

/// Returns the fraction whose decimals follow a prefix, such as 0.05 for `q05`.
fn fraction_after(prefix: &str, word: &str) -> Option<f64> {
    let digits = word.strip_prefix(prefix)?;
    let is_plain = (2..=6).contains(&digits.len()) && digits.bytes().all(|b| b.is_ascii_digit());
    // `q100` and `ci100` would mean 10 %, which is surely not intended.
    let is_shortest = digits.len() == 2 || !digits.ends_with('0');
    let share: f64 = format!("0.{digits}").parse().ok()?;
    (is_plain && is_shortest && share > 0.0).then_some(share)
}

/// Returns the name of a confidence interval, with at least two decimals of its level: `ci95` for
/// 0.95.
fn interval_word(level: f64) -> String {
    let digits = level.to_string().replace("0.", "");
    format!("ci{digits:0<2}")
}

/// Describes the statistic in a column whose name ends with `suffix`.
pub fn meaning(suffix: &str) -> Option<String> {
    // Rounded, because 0.29 × 100 is not an integer in floating point.
    let percent = |share: f64| (share * 1e6).round() / 1e4;
    if let Some((word, end @ ("lower" | "upper"))) = suffix.rsplit_once('_') {
        let level = percent(fraction_after("ci", word)?);
        return Some(format!(
            "{end} end of the {level} % confidence interval, by Student's t over surfaces, of the \
             mean"
        ));
    }
    let meaning = match Statistic::named(suffix)? {
        Statistic::Quantile(0.5) => "median",
        Statistic::Quantile(share) => return Some(format!("{} % quantile", percent(share))),
        Statistic::Mean => "mean",
        Statistic::Sd => "standard deviation",
        Statistic::Sem => "standard error of the mean",
        Statistic::Min => "minimum",
        Statistic::Max => "maximum",
        Statistic::RegressionSlope => "slope of the least-squares line against the load",
        Statistic::RegressionIntercept => "value of the least-squares line at zero load",
        Statistic::Slope => "slope of the mean against the load",
        Statistic::Secant => "mean divided by the load",
        Statistic::Approach | Statistic::Confidence(_) => return None,
    };
    Some(meaning.to_owned())
}

/// Intermediate column with the sampling unit of each row. Names of users' columns have no spaces.
pub const SAMPLING_UNIT: &str = "sampling unit";

/// Adds two columns for each column in `over`: the sum and the number of the values that the
/// sampling unit of the row has in the group of the row.
pub fn with_sums(rows: LazyFrame, keys: &[Expr], over: &[String]) -> Result<LazyFrame, StageError> {
    let unit: Vec<Expr> = keys.iter().cloned().chain([col(SAMPLING_UNIT)]).collect();
    let within = |values: Expr| values.over(unit.clone()).map_err(polars_error);
    let mut sums = Vec::new();
    for name in over {
        sums.push(within(value(name).sum())?.alias(sum_of(name)));
        let count = within(value(name).count())?.cast(DataType::Float64);
        sums.push(count.alias(rows_of(name)));
    }
    Ok(rows.with_columns(sums))
}

/// Returns the expressions of a group's standard error and number of surfaces, from which [`ends`]
/// computes intervals.
pub fn of_group(name: &str) -> [Expr; 2] {
    [standard_error(name).alias(error_of(name)), surfaces(name).alias(surfaces_of(name))]
}

/// Returns the number of surfaces that have a value in the group.
fn surfaces(name: &str) -> Expr {
    let known = col(SAMPLING_UNIT).filter(value(name).is_not_null());
    known.n_unique().cast(DataType::Float64)
}

/// Returns the standard error of a group's mean; null for a single surface.
pub fn standard_error(name: &str) -> Expr {
    let known = || value(name).is_not_null();
    let deviation = col(sum_of(name)) - col(rows_of(name)) * value(name).mean();
    // All rows of a surface hold its deviation. Divided by their number, they count once.
    let each = (deviation.clone() * deviation / col(rows_of(name))).filter(known());
    let variance = each.sum() * surfaces(name) / (surfaces(name) - lit(1.0));
    let count = value(name).count().cast(DataType::Float64);
    when(surfaces(name).gt(lit(1.0)))
        .then(variance.sqrt() / count)
        .otherwise(lit(polars::prelude::NULL))
}

/// Returns the ends of the confidence interval of a group's mean; null for a single surface.
pub fn ends(name: &str, level: f64) -> [Expr; 2] {
    let factor = col(surfaces_of(name)).map(
        move |surfaces| factors(&surfaces, level),
        |_: &Schema, field: &Field| Ok(Field::new(field.name().clone(), DataType::Float64)),
    );
    let half_width = factor * col(error_of(name));
    let mean = || col(mean_of(name));
    let several = || col(surfaces_of(name)).gt(lit(1.0));
    let end = |value: Expr| when(several()).then(value).otherwise(lit(polars::prelude::NULL));
    let word = interval_word(level);
    [
        end(mean() - half_width.clone()).alias(format!("{name}_{word}_lower")),
        end(mean() + half_width).alias(format!("{name}_{word}_upper")),
    ]
}

/// Returns the two-sided quantile of Student's t for each number of surfaces in the column. The
/// quantile of each distinct number is computed once.
fn factors(surfaces: &prelude::Column, level: f64) -> PolarsResult<prelude::Column> {
    let mut known: HashMap<u32, f64> = HashMap::new();
    let mut factor = |surfaces: f64| {
        let freedom = surfaces as u32 - 1;
        let quantile = || two_sided_quantile(level, freedom);
        *known.entry(freedom).or_insert_with(quantile)
    };
    let counts = surfaces.f64()?.iter();
    let factors: Vec<Option<f64>> =
        counts.map(|surfaces| surfaces.filter(|&n| n > 1.0).map(&mut factor)).collect();
    Ok(Series::new(surfaces.name().clone(), factors).into())
}

/// Converts a column to real numbers; flags become 1 or 0.
fn value(name: &str) -> Expr {
    col(name).cast(DataType::Float64)
}

// Names of intermediate columns. Names of users' columns have no spaces.
fn sum_of(name: &str) -> String {
    format!("{name} sum")
}

fn rows_of(name: &str) -> String {
    format!("{name} rows")
}

fn error_of(name: &str) -> String {
    format!("{name} error")
}

fn surfaces_of(name: &str) -> String {
    format!("{name} surfaces")
}

/// Returns the slope of the least-squares line, `REGR_SLOPE` of standard SQL.
pub fn slope(values: &Expr) -> Expr {
    let LoadCurve { loads, values } = LoadCurve::new(values);
    let from_mean = loads.clone() - loads.clone().mean();
    let joint = (from_mean.clone() * (values.clone() - values.mean())).sum();
    // If all loads are equal, rounding of their mean would leave some scatter.
    let differ = loads.clone().min().lt(loads.max());
    let slope = joint / (from_mean.clone() * from_mean).sum();
    when(differ).then(slope).otherwise(lit(NULL))
}

/// Returns the value of the least-squares line at zero load, `REGR_INTERCEPT` of standard SQL.
pub fn intercept(values: &Expr) -> Expr {
    let LoadCurve { loads, values: known } = LoadCurve::new(values);
    known.mean() - slope(values) * loads.mean()
}

/// Data of the least-squares line of a group: values against their loads. Rows without a value are
/// left out, and rows under a single load have no line.
struct LoadCurve {
    loads: Expr,
    values: Expr,
}

impl LoadCurve {
    fn new(values: &Expr) -> LoadCurve {
        let is_known = values.clone().is_not_null();
        LoadCurve {
            loads: col(LOAD.name).filter(is_known),
            values: values.clone().drop_nulls().cast(DataType::Float64),
        }
    }
}

columns! {
    /// number of rows in the group
    pub const COUNT: Column = integer("count", "1");
    /// number of surfaces in the group, distinguished by seed and realization or by their region of
    /// a file; one surface may have several rows, at several parameter points
    pub const SURFACES: Column = integer("surfaces", "1");
    /// number of rows in the group whose load did not converge; the statistics include them
    pub const UNCONVERGED: Column = integer("unconverged", "1");
    /// number of failed fits in the group; `count` includes them, the statistics do not
    pub const UNFITTED: Column = integer("unfitted", "1");
    /// mean of this load and the previous load of the curve, at which slopes are evaluated
    pub const LOAD_MIDPOINT: Column = real("load_midpoint", "E* × rms slope");
}

/// All columns of the reduced table except group columns and statistics.
pub const GROUP_COLUMNS: [Column; 5] = [COUNT, SURFACES, UNCONVERGED, UNFITTED, LOAD_MIDPOINT];

/// Intermediate column with the reduced load of a group, for slopes, secants and theories.
pub const LOAD_OF_GROUP: &str = "load of group";

/// Returns the name of the intermediate column with the mean of a column.
pub fn mean_of(name: &str) -> String {
    format!("{name} mean")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_of_a_quantile_are_those_after_the_point() {
        assert_eq!(Statistic::named("q05"), Some(Statistic::Quantile(0.05)));
        assert_eq!(Statistic::named("q975"), Some(Statistic::Quantile(0.975)));
        assert_eq!(Statistic::named("q50"), Statistic::named("median"));
        for name in ["q", "q5", "q00", "q100", "q-5", "q0x", "q1234567", "p05", "quantile"] {
            assert_eq!(Statistic::named(name), None, "{name}");
        }
    }

    #[test]
    fn digits_of_a_confidence_interval_are_its_level() {
        for (word, level) in [("ci90", 0.9), ("ci95", 0.95), ("ci99", 0.99), ("ci999", 0.999)] {
            let found = Statistic::named(word).unwrap();
            assert_eq!(found, Statistic::Confidence(level));
            assert_eq!(found.suffix(), word);
        }
        for name in ["ci", "ci9", "ci00", "ci100", "ci950", "ci-5", "ci1234567"] {
            assert_eq!(Statistic::named(name), None, "{name}");
        }
    }
}
