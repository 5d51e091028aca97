//! Number of surfaces of a parameter point: fixed, or adaptive until a condition holds.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::surface::planned::{Growth, PlannedSurfaces, Until, parse};
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::{GridPoint, Key, KeyTable, Section, Spanned, deserialize_either};

/// Maximum number of surfaces of a parameter point.
const MAX: u32 = 1_000_000;
/// Minimum number of surfaces for which a standard error exists.
const MIN: u32 = 2;
/// Default value of `at_least`.
pub const AT_LEAST: u32 = 10;
/// The number of surfaces at each parameter point, the value of `realizations`.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Realizations {
    /// A fixed number of surfaces.
    Number(#[schemars(range(min = 1, max = MAX))] u32),
    /// As many surfaces as a condition needs.
    Until(Growing),
}

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
