//! Numbers of surfaces that follow from how well a mean must be known.

use std::fmt;
use std::ops::Mul;
use std::sync::Arc;

use arrow::datatypes::DataType;

use super::Growth;
use super::graph::Graph;
use crate::diagnostics::{Problem, Problems, did_you_mean, listed};
use crate::manifest::generate::{Growing, Realizations};
use crate::manifest::{Points, StageTable};
use crate::stages::Kind;
use crate::stages::columns::SURFACE;
use crate::store::column::Role;
use crate::store::table::Table;
use crate::written::checks::Checks;
use crate::written::{Key, Written};

/// Surfaces of one point.
const MOST: u32 = 1_000_000;
/// Fewer have no scatter.
const FEWEST: u32 = 2;
const AT_LEAST: u32 = 10;

/// When a mean is known well enough: `sem(area.area_fraction) < 0.5 %`.
#[derive(Debug, Clone, PartialEq)]
pub struct Until {
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
        let Until {
            stage,
            column,
            limit,
        } = self;
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
            let number = Written {
                value: *number,
                span: written.span.clone(),
            };
            return Some((
                checks.is_whole_in("realizations", &number, &(1..=MOST))?,
                None,
            ));
        }
        Realizations::Until(growing) => growing,
    };
    let at_least = checks.whole_or("at_least", &growing.at_least, FEWEST..=MOST, AT_LEAST);
    let mut given = |name: &str, is_given: bool| {
        if !is_given {
            let message = format!("`realizations` lacks `{name}`");
            let label = format!("`{name}` is missing here");
            checks.report(
                "realizations",
                Problem::new(message, written.span.clone(), label),
            );
        }
    };
    given("at_most", growing.at_most.written().is_some());
    given("until", growing.until.written().is_some());
    let at_most = growing.at_most.written();
    let at_most = at_most.map(|_| checks.whole("at_most", &growing.at_most, FEWEST..=MOST));
    let until = growing.until.written().map(|until| checked(until, checks));
    let (at_least, at_most, until) = (at_least?, at_most??, until??);
    if at_least > at_most {
        let message = format!("`at_least = {at_least}` lies above `at_most = {at_most}`");
        let place = growing.at_most.written()?.span.clone();
        checks.report("realizations", Problem::new(message, place, "larger"));
        return None;
    }
    Some((at_least, Some(Arc::new(Growth { at_most, until }))))
}

/// The condition, if it can be read.
fn checked(written: &Written<String>, checks: &mut Checks) -> Option<Until> {
    let until = parse(&written.value);
    if until.is_none() {
        let message = format!("{:?} is no condition on a mean", written.value);
        let label = "must be `sem(STAGE.COLUMN) < 0.5 %`, or without `%` in the column's unit";
        checks.report(
            "realizations",
            Problem::new(message, written.span.clone(), label),
        );
    }
    until
}

fn parse(text: &str) -> Option<Until> {
    let inside = text
        .trim()
        .strip_prefix("sem")?
        .trim_start()
        .strip_prefix('(')?;
    let (mean, rest) = inside.split_once(')')?;
    let (stage, column) = mean.split_once('.')?;
    let number = rest.trim_start().strip_prefix('<')?.trim();
    let (number, is_share) = match number.strip_suffix('%') {
        Some(number) => (number.trim_end(), true),
        None => (number, false),
    };
    let limit = number
        .parse()
        .ok()
        .filter(|limit: &f64| limit.is_finite() && *limit > 0.0)?;
    Some(Until {
        stage: stage.trim().to_owned(),
        column: column.trim().to_owned(),
        limit: match is_share {
            true => Limit::Relative(limit / 100.0),
            false => Limit::Absolute(limit),
        },
    })
}

/// A stage whose surfaces are as many as a condition asks for, and the condition as it is written.
struct Conditional<'a> {
    stage: usize,
    written: &'a Written<String>,
    until: Until,
}

fn conditions(stages: &[StageTable]) -> impl Iterator<Item = Conditional<'_>> {
    let stages = stages.iter().enumerate();
    stages.filter_map(|(stage, table)| {
        let Some(Points::Random(_, section)) = &table.points else {
            return None;
        };
        // The points of a grid share it.
        let realizations = section.points.first()?.table.realizations.written()?;
        let Realizations::Until(Growing { until, .. }) = &realizations.value else {
            return None;
        };
        let written = until.written()?;
        let until = parse(&written.value)?;
        Some(Conditional {
            stage,
            written,
            until,
        })
    })
}

/// The stages whose tables conditions look at.
pub fn looked_at(stages: &[StageTable]) -> Vec<usize> {
    let named = |name: &str| stages.iter().position(|stage| stage.name.value == name);
    conditions(stages)
        .filter_map(|condition| named(&condition.until.stage))
        .collect()
}

/// Checks that conditions look at tables with rows for each surface; `empty` gives the tables of
/// stages without rows, as far as they are known.
pub fn check<'t>(
    stages: &[StageTable],
    graph: &Graph,
    empty: impl Fn(usize) -> Option<&'t Table>,
    problems: &mut Problems,
) {
    for Conditional {
        stage,
        written,
        until,
    } in conditions(stages)
    {
        let problem =
            |message: String, label: &str| Problem::new(message, written.span.clone(), label);
        let names = || stages.iter().map(|stage| stage.name.value.as_str());
        let Some(looked_at) = names().position(|name| name == until.stage) else {
            let meant = did_you_mean(&until.stage, names());
            let label = meant.map_or("unknown stage".to_owned(), |m| {
                format!("did you mean `{m}`?")
            });
            let message = format!("there is no stage `{}`", until.stage);
            let help = format!("the stages are {}", listed(names(), "and"));
            problems.push(problem(message, &label).help(help));
            continue;
        };
        let surfaces = &stages[stage].name.value;
        if !reads(graph, looked_at, stage) {
            let message = format!("`{}` does not read `{surfaces}`", until.stage);
            problems.push(problem(message, "its rows say nothing of these surfaces"));
            continue;
        }
        let Some(table) = empty(looked_at) else {
            continue;
        };
        let is_pooled = matches!(stages[looked_at].kind, Some(Kind::Fit | Kind::Aggregate));
        if is_pooled || !table.has(SURFACE.name) {
            let message = format!("`{}` has no rows for each surface", until.stage);
            let label = "must be a stage that looks at surfaces one by one";
            problems.push(problem(message, label));
            continue;
        }
        let columns = numbers(table);
        if !columns.contains(&until.column.as_str()) {
            let meant = did_you_mean(&until.column, columns.iter().copied());
            let label = meant.map_or("unknown column".to_owned(), |m| {
                format!("did you mean `{m}`?")
            });
            let message = format!(
                "`{}` has no column of results `{}`",
                until.stage, until.column
            );
            let help = format!("there are {}", listed(columns.iter().copied(), "and"));
            problems.push(problem(message, &label).help(help));
        }
    }
}

/// Whether rows of a stage come from another, itself included.
fn reads(graph: &Graph, stage: usize, source: usize) -> bool {
    let mut is_above = vec![false; graph.inputs.len()];
    let mut next = vec![stage];
    while let Some(stage) = next.pop() {
        if !std::mem::replace(&mut is_above[stage], true) {
            next.extend(graph.inputs[stage].iter().flatten());
        }
    }
    is_above[source]
}

/// The columns that hold results and are numbers.
fn numbers(table: &Table) -> Vec<&str> {
    let fields = table.batch().schema_ref().fields().iter();
    let is_number = |kind: &DataType| matches!(kind, DataType::Float64 | DataType::Int64);
    let is_result = |role: Option<&String>| role.is_some_and(|role| role == Role::Result.name());
    let numbers = fields
        .filter(|field| is_number(field.data_type()) && is_result(field.metadata().get("role")));
    numbers.map(|field| field.name().as_str()).collect()
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
        assert_eq!(
            told("sem(s.alpha)<1e-3").as_deref(),
            Some("sem(s.alpha) < 0.001")
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
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
