//! Keys of loads, of stored pressure fields and of histograms in `solve` stages.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::{StageChecks, in_unit_of_surfaces};
use crate::solve::keys::SolveTable;
use crate::solve::{ListedLoads, Pressures};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{length_or_ratio, load, positive_items, pressure_or_ratio};
use asperity_manifest::keys::quantity::Dimension;
use asperity_manifest::keys::{Key, Spanned, deserialize_either};
use asperity_mechanics::distribution::EqualBins;

/// Maximum number of loads of a parameter point.
const MAX_LOADS: u32 = 100_000;
/// Maximum number of bins of a histogram.
const MAX_BINS: u32 = 10_000;
/// Maximum number of bins of a histogram, summed over the loads of a parameter point: the number
/// of nodes of a map of 4096².
const MAX_BINS_OF_POINT: usize = 1 << 24;

/// The loads of a parameter point, the value of `loads`.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Loads {
    /// A list of loads.
    List(#[schemars(length(min = 1, max = MAX_LOADS))] Vec<Spanned<f64>>),
    /// Evenly spaced loads in a range.
    Range(LoadRange),
}

deserialize_either!(Loads { list => List, table => Range });

/// A range of loads, which excludes its start and includes its end.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadRange {
    /// Start of the range of loads. It is not a load itself, so that consecutive ranges do not
    /// repeat a load.
    #[serde(default)]
    #[schemars(range(min = 0), extend("default" = 0.0), transform = load)]
    pub from: Key<f64>,
    /// End of the range, which is the last load.
    #[schemars(extend("exclusiveMinimum" = 0), transform = load)]
    pub to: Spanned<f64>,
    /// Number of loads in the range.
    #[schemars(range(min = 1, max = MAX_LOADS))]
    pub steps: u32,
    /// Spacing of the loads in the range: `"linear"` has equal differences, `"geometric"` has equal
    /// ratios.
    #[serde(default)]
    #[schemars(extend("default" = "linear"))]
    pub spacing: Key<Spacing>,
}

/// The spacing of the loads in a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// Equal differences between consecutive loads.
    Linear,
    /// Equal ratios of consecutive loads.
    Geometric,
}

/// The pressure fields that are stored, the value of `pressures`.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum StoredPressures {
    /// No pressure field, or the fields under all loads.
    Word(Pressures),
    /// The pressure fields under some of the loads.
    At(#[schemars(length(min = 1), transform = positive_items)] Vec<Spanned<f64>>),
}

deserialize_either!(StoredPressures { word => Word, list => At });

/// A histogram of pressures with equal bins from zero.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureBins {
    /// Number of bins of the histogram.
    #[schemars(range(min = 1, max = MAX_BINS))]
    pub count: u32,
    /// Upper edge of the last bin: a multiple of E* × rms slope, or a pressure with a unit if all
    /// surfaces have one given `rms_slope`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = pressure_or_ratio)]
    pub to: Spanned<f64>,
}

/// A histogram of gaps with equal bins from zero.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GapBins {
    /// Number of bins of the histogram.
    #[schemars(range(min = 1, max = MAX_BINS))]
    pub count: u32,
    /// Upper edge of the last bin: a multiple of the rms height, or a length with a unit if all
    /// surfaces have one given `rms_height`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = length_or_ratio)]
    pub to: Spanned<f64>,
}

impl Loads {
    /// Returns the values that may have a unit, with their positions.
    pub fn values(&self) -> Vec<&Spanned<f64>> {
        match self {
            Loads::List(list) => list.iter().collect(),
            Loads::Range(range) => range.from.written().into_iter().chain([&range.to]).collect(),
        }
    }
}

/// Returns the loads of a parameter point in ascending order, and how the list differs from them.
/// Returns `None` after reporting problems.
pub fn loads(table: &SolveTable, checks: &mut Checks) -> Option<(Vec<f64>, ListedLoads)> {
    let written = checks.required("loads", &table.loads)?;
    match &written.value {
        // If the list has lost invalid items, its problems have been reported.
        Loads::List(list) => listed(list, checks).filter(|_| !checks.is_reported("loads")),
        Loads::Range(range) => {
            let loads = spaced(range, written, checks)?;
            let start = Some(decimal::nearest(range.from.value().unwrap_or(0.0)));
            Some((loads, ListedLoads { start, ..ListedLoads::default() }))
        }
    }
}

/// Sorts the loads of a list and removes repeated ones. Refuses loads that differ only by rounding.
fn listed(list: &[Spanned<f64>], checks: &mut Checks) -> Option<(Vec<f64>, ListedLoads)> {
    let mut too_small = list.iter().filter(|load| load.value <= 0.0).peekable();
    if too_small.peek().is_some() {
        for load in too_small {
            let message = format!("`loads` holds {}", decimal::written(load.value));
            let problem = Problem::new(message, load.span.clone(), "must be above 0");
            checks.problems.push(if load.value < 0.0 {
                problem.help("surfaces bear tension only with the key `adhesion`")
            } else {
                problem
            });
        }
        return None;
    }
    let mut sorted: Vec<&Spanned<f64>> = list.iter().collect();
    sorted.sort_by(|one, other| one.value.total_cmp(&other.value));
    for pair in sorted.windows(2) {
        let [before, after] = [pair[0].value, pair[1].value];
        let are_equal = decimal::nearest(before) == decimal::nearest(after);
        if !are_equal && decimal::is_same(before, after) {
            let message =
                format!("`loads` holds {before:?} and {after:?}, which differ only by rounding");
            let label = "equal to another load";
            let problem = Problem::new(message, pair[1].span.clone(), label);
            return checks
                .reject(problem.help("remove one of them: slopes between them would be noise"));
        }
    }
    let written = || list.iter().map(|load| decimal::nearest(load.value));
    let mut loads: Vec<f64> = written().collect();
    loads.sort_by(f64::total_cmp);
    let repeats = loads.windows(2).filter(|pair| pair[0] == pair[1]);
    let mut repeated: Vec<f64> = repeats.map(|pair| pair[0]).collect();
    repeated.dedup();
    loads.dedup();
    let is_unsorted = !written().is_sorted();
    Some((loads, ListedLoads { is_unsorted, repeated, ..ListedLoads::default() }))
}

/// Returns whether each load exceeds the previous one by more than rounding errors.
fn ascends(loads: &[f64]) -> bool {
    loads.is_sorted_by(|before, after| before < after && !decimal::is_same(*before, *after))
}

/// Returns the loads of a range, rounded to twelve digits.
fn spaced(range: &LoadRange, written: &Spanned<Loads>, checks: &mut Checks) -> Option<Vec<f64>> {
    let from = checks.number("loads.from", &range.from)?;
    let spacing = checks.value("loads.spacing", &range.spacing)?;
    let (to, steps) = (decimal::nearest(range.to.value), range.steps);
    if from >= to {
        let message = format!("`loads` must ascend: `to = {to:?}` is not above `from = {from:?}`");
        let problem = Problem::new(message, range.to.span.clone(), "not above `from`");
        return checks.reject(match range.from.written() {
            Some(from) => problem.and(from.span.clone(), "start of the range"),
            None => problem,
        });
    }
    if let Some(spacing) = range.spacing.written().filter(|_| from == 0.0)
        && spacing.value == Spacing::Geometric
    {
        let message = "geometric loads cannot start at zero";
        let problem = Problem::new(message, spacing.span.clone(), "needs `from` above 0");
        return checks.reject(problem.help("set `from` to the load before the first one"));
    }
    let load = |fraction: f64| match spacing {
        Spacing::Geometric => from * libm::pow(to / from, fraction),
        Spacing::Linear => from + (to - from) * fraction,
    };
    let fraction = |step: u32| f64::from(step) / f64::from(steps);
    let inner = (1..steps).map(|step| decimal::nearest(load(fraction(step))));
    let loads: Vec<f64> = inner.chain([to]).collect();
    if loads[0] > from && ascends(&loads) {
        return Some(loads);
    }
    let message = format!("{steps} loads from {from:?} to {to:?} differ by no more than rounding");
    checks.reject(Problem::new(message, written.span.clone(), "too many steps"))
}

/// Returns the loads under which pressure fields are stored. The manifest may give them with
/// rounding errors; the result contains exact values of `loads`.
pub fn pressures(
    table: &SolveTable,
    loads: Option<&[f64]>,
    checks: &mut Checks,
) -> Option<Pressures> {
    let Some(written) = checks.optional("pressures", &table.pressures)? else {
        return Some(Pressures::None);
    };
    let list = match &written.value {
        StoredPressures::Word(pressures) => return Some(pressures.clone()),
        StoredPressures::At(list) => list,
    };
    let loads = loads?;
    let found: Vec<_> = list.iter().map(|load| chosen(load, loads, checks)).collect();
    let mut chosen: Vec<f64> = found.into_iter().collect::<Option<_>>()?;
    chosen.sort_by(f64::total_cmp);
    chosen.dedup();
    Some(Pressures::At(chosen))
}

/// Returns the value of `loads` that equals a listed load up to rounding errors. Reports a listed
/// load that equals none.
fn chosen(load: &Spanned<f64>, loads: &[f64], checks: &mut Checks) -> Option<f64> {
    let value = decimal::nearest(load.value);
    let distance = |other: &&f64| (**other - value).abs();
    let nearest = *loads.iter().min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
    if decimal::is_same(nearest, value) {
        return Some(nearest);
    }
    let message = format!("`pressures` holds {value:?}, which is not in `loads`");
    let label = format!("the nearest load is {nearest:?}");
    checks.reject(Problem::new(message, load.span.clone(), label))
}

/// Returns the bins of the histogram of pressures, in units of E* × rms slope, or `Some(None)` if
/// the key is left out. `modulus` is E*, if it is valid.
pub fn pressure_bins(
    table: &SolveTable,
    modulus: Option<f64>,
    loads: Option<&[f64]>,
    checks: &mut StageChecks,
) -> Option<Option<EqualBins>> {
    let Some(Spanned { value: bins, span }) =
        checks.optional("pressure_bins", &table.pressure_bins)?
    else {
        return Some(None);
    };
    let to = decimal::nearest(bins.to.value);
    let to = if checks.units.is_quantity(&bins.to.span) {
        let relative = to / modulus?;
        match checks.surfaces.common_slope() {
            Some(slope) => decimal::nearest(relative / slope),
            None => return several_slopes(&bins.to, relative, checks),
        }
    } else {
        to
    };
    checked_bins("pressure_bins", EqualBins { count: bins.count, to }, span, loads, checks)
}

/// Refuses an upper edge with a unit that would be a different multiple of E* × rms slope on each
/// surface. `relative` is its ratio to E*.
fn several_slopes<T>(to: &Spanned<f64>, relative: f64, checks: &mut Checks) -> Option<T> {
    let message = "`pressure_bins.to` has a unit, but its bins are multiples of E* × rms slope, and \
                   the surfaces do not have one given `rms_slope`";
    let problem = Problem::new(message, to.span.clone(), "must be a number without a unit");
    checks.reject(problem.help(format!(
        "this pressure is {} / (rms slope) in units of E* × rms slope; `asperity surface` and the \
         column `rms_slope` tell the rms slope",
        decimal::written(format!("{relative:.2e}").parse().unwrap_or(relative))
    )))
}

/// Returns the bins of the histogram of gaps, or `Some(None)` if the key is left out.
pub fn gap_bins(
    table: &SolveTable,
    loads: Option<&[f64]>,
    checks: &mut StageChecks,
) -> Option<Option<EqualBins>> {
    let Some(Spanned { value, span }) = checks.optional("gap_bins", &table.gap_bins)? else {
        return Some(None);
    };
    let GapBins { count, to } = value;
    let relative = if !checks.units.is_quantity(&to.span) {
        to.value
    } else if let Some(height) = checks.surfaces.common_height() {
        in_unit_of_surfaces(to, checks)? / height
    } else {
        let message = "`gap_bins.to` has a unit, but its bins are multiples of the rms height, and \
                       the surfaces do not have one given `rms_height`";
        let label = "must be a number without a unit";
        let problem = Problem::new(message, to.span.clone(), label);
        return checks.reject(problem.help(
            "divide the gap by the rms height; `asperity surface` and the column `rms_height` tell \
             it",
        ));
    };
    let bins = EqualBins { count: *count, to: decimal::nearest(relative) };
    checked_bins("gap_bins", bins, span, loads, checks)
}

/// Refuses too many bins under all loads together.
fn checked_bins(
    name: &str,
    bins: EqualBins,
    span: &Span,
    loads: Option<&[f64]>,
    checks: &mut Checks,
) -> Option<Option<EqualBins>> {
    let count = bins.count;
    let number = loads.map_or(0, <[f64]>::len);
    if number.saturating_mul(count as usize) > MAX_BINS_OF_POINT {
        let message = format!("`{name}` has {count} bins under each of {number} loads");
        let label = format!("must be at most {MAX_BINS_OF_POINT} bins under all loads together");
        return checks.refuse(name, message, span, label);
    }
    Some(Some(bins))
}

/// Returns the force in newtons under the pressure 1 on each nominal area of the surfaces, in
/// ascending order. The result is `None` alone if the loads are not forces. Loads that are results
/// are forces, too, if pressures and lengths have units.
pub fn newtons(table: &SolveTable, checks: &mut StageChecks) -> Option<Vec<Option<f64>>> {
    if table.control.value().is_some_and(|control| !control.is_load()) {
        return Some(known(checks).unwrap_or(vec![None]));
    }
    let loads = given(table);
    let units = checks.units;
    let is_force = |load: &&&Spanned<f64>| units.dimension_of(&load.span) == Some(Dimension::Force);
    let Some(force) = loads.iter().find(is_force).map(|load| &load.span) else {
        return Some(vec![None]);
    };
    let is_other = |load: &&&Spanned<f64>| load.value != 0.0 && !is_force(load);
    if let Some(other) = loads.iter().find(is_other) {
        let number = decimal::written(other.value);
        let (message, label) = if units.is_quantity(&other.span) {
            ("one load is a pressure, but another one is a force", "a pressure".to_owned())
        } else {
            let label = format!("write \"{number} N\" if it is in newtons");
            ("one load has no unit, but another one is a force", label)
        };
        let problem = Problem::new(message, other.span.clone(), label);
        return checks.reject(problem.and(force.clone(), "a force"));
    }
    let Some(pressure) = units.pressure.as_ref().map(|named| named.unit.symbol) else {
        let message = "a load is a force, but the modulus of the stage has no unit";
        let problem = Problem::new(message, force.clone(), "has a unit");
        return checks.reject(problem.help(
            "give E* with a unit, such as `effective_modulus = \"70 GPa\"`, or the `bodies`",
        ));
    };
    if checks.surfaces.areas.iter().any(|area| area.newtons(pressure).is_none()) {
        return without_area(force, checks);
    }
    known(checks)
}

/// Returns the force in newtons under the pressure 1 on each nominal area, or `None` if a unit is
/// unknown.
fn known(checks: &StageChecks) -> Option<Vec<Option<f64>>> {
    let pressure = checks.units.pressure.as_ref()?.unit.symbol;
    let of_areas = checks.surfaces.areas.iter().map(|area| area.newtons(pressure));
    let mut newtons = of_areas.collect::<Option<Vec<f64>>>()?;
    newtons.sort_by(f64::total_cmp);
    newtons.dedup();
    (!newtons.is_empty()).then(|| newtons.into_iter().map(Some).collect())
}

/// Returns the loads and the loads with stored pressures, as the manifest gives them.
pub(super) fn given(table: &SolveTable) -> Vec<&Spanned<f64>> {
    let mut loads = Vec::new();
    if let Some(written) = table.loads.written() {
        loads.extend(written.value.values());
    }
    if let Some(StoredPressures::At(list)) = table.pressures.written().map(|written| &written.value)
    {
        loads.extend(list);
    }
    loads
}

fn without_area<T>(force: &Span, checks: &mut Checks) -> Option<T> {
    let message = "a load is a force, but the lengths of the surfaces have no unit";
    let problem = Problem::new(message, force.clone(), "needs the nominal area in m²");
    checks.reject(problem.help(
        "give the sides of all surfaces a unit, such as `side = \"100 um\"`, or write the loads as \
         mean pressures",
    ))
}
