//! Keys and checks of loads: they ascend, and pressures are kept or counted under some of them.

use std::fmt;

use schemars::{JsonSchema, Schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer, StrDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::Pressures;
use super::keys::SolveTable;
use asperity_contact::distribution::EqualBins;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::{Checks, NOT_NEGATIVE, POSITIVE, QUANTITY};
use asperity_manifest::written::{Key, Written, deserialize_either};

/// The most loads of one block.
const MOST_LOADS: u32 = 100_000;
/// The most bins of a distribution.
const MOST_BINS: u32 = 10_000;
/// Bins of all loads of a block together: as many numbers as a map of 4096² nodes has.
const MOST_BINS_OF_A_BLOCK: usize = 1 << 24;

/// The loads of a block.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Loads {
    /// One by one, ascending.
    List(#[schemars(length(min = 1), transform = positive_items)] Vec<Written<f64>>),
    /// Between two loads.
    Range(LoadRange),
}

deserialize_either! {
    'de, Loads, "a list of loads or a table `{ from, to, steps, spacing }`",

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Loads, A::Error> {
        Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(Loads::List)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Loads, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(table)).map(Loads::Range)
    }
}

/// Loads between two, the first of which is left out and the last included.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LoadRange {
    /// Where the block starts; no load itself, so that blocks join without a repetition.
    #[schemars(range(min = 0), extend("default" = 0.0))]
    pub from: Key<f64>,
    /// The last load.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub to: Key<f64>,
    /// Number of loads.
    #[schemars(required, range(min = 1, max = MOST_LOADS))]
    pub steps: Key<i64>,
    /// Equal differences, or equal ratios.
    #[schemars(extend("default" = "linear"))]
    pub spacing: Key<Spacing>,
}

/// How loads are spaced.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Geometric,
}

/// Which pressure fields are stored.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenPressures {
    /// None or all.
    Word(PressuresWord),
    /// Those at some loads.
    At(#[schemars(length(min = 1), transform = positive_items)] Vec<Written<f64>>),
}

deserialize_either! {
    'de, WrittenPressures, "`\"none\"`, `\"all\"` or a list of loads",

    fn visit_str<E: Error>(self, word: &str) -> Result<WrittenPressures, E> {
        PressuresWord::deserialize(StrDeserializer::new(word)).map(WrittenPressures::Word)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<WrittenPressures, A::Error> {
        Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(WrittenPressures::At)
    }
}

fn positive_items(schema: &mut Schema) {
    let items = schema.get_mut("items").and_then(Value::as_object_mut);
    if let Some(items) = items {
        items.insert("exclusiveMinimum".to_owned(), 0.into());
    }
}

/// All pressure fields, or none.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PressuresWord {
    /// No pressure field.
    None,
    /// The pressure field of every load.
    All,
}

/// Equal bins from zero on.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Bins {
    /// How many there are.
    #[schemars(required, range(min = 1, max = MOST_BINS))]
    pub count: Key<i64>,
    /// Where the last one ends.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub to: Key<f64>,
}

/// The loads of a block, ascending.
pub fn loads(table: &SolveTable, checks: &mut Checks) -> Option<Vec<f64>> {
    let written = checks.required("loads", &table.loads)?;
    match &written.value {
        Loads::List(list) if list.is_empty() => {
            let label = "must hold at least one load";
            checks.refuse("loads", "`loads` is empty", &written.span, label)
        }
        Loads::List(list) => listed(list, checks),
        Loads::Range(range) => spaced(range, written, checks),
    }
}

fn listed(list: &[Written<f64>], checks: &mut Checks) -> Option<Vec<f64>> {
    let loads: Vec<_> = list.iter().map(|load| checks.holds("loads", load, QUANTITY)).collect();
    let loads: Vec<f64> = loads.into_iter().collect::<Option<_>>()?;
    if let Some(index) = (1..loads.len()).find(|&index| !ascends(&loads[index - 1..=index])) {
        let [before, after] = [index - 1, index].map(|index| list[index].value);
        let place = list[index].span.clone();
        let differ_by_rounding = before != after && decimal::is_same(before, after);
        let problem = match differ_by_rounding {
            true => Problem::new(
                format!("`loads` holds {before:?} and {after:?}, one load but for rounding"),
                place,
                "no step above the load before",
            )
            .help("slopes between them would be noise: leave one of them out"),
            false => Problem::new(
                format!("`loads` must ascend: {after:?} follows {before:?}"),
                place,
                "not above the load before",
            )
            .help("each load starts from the contact of the load before it"),
        };
        return checks.reject(problem);
    }
    if list.len() > MOST_LOADS as usize {
        let message = format!("`loads` holds {} loads", list.len());
        let label = format!("at most {MOST_LOADS} fit in a block");
        return checks.reject(Problem::new(message, list[0].span.clone(), label));
    }
    Some(loads)
}

/// Whether each load is above the one before by more than rounding.
fn ascends(loads: &[f64]) -> bool {
    loads.is_sorted_by(|before, after| before < after && !decimal::is_same(*before, *after))
}

/// Loads between two, as a person would write them, the last of them as it is given.
fn spaced(range: &LoadRange, written: &Written<Loads>, checks: &mut Checks) -> Option<Vec<f64>> {
    let from = checks.number_or("from", &range.from, NOT_NEGATIVE, 0.0);
    let to = checks.required_in(("loads", &written.span), "to", &range.to);
    let steps = checks.required_in(("loads", &written.span), "steps", &range.steps);
    let to = to.and_then(|to| checks.is_in("to", to, QUANTITY));
    let steps = steps.and_then(|steps| checks.is_whole_in("steps", steps, &(1..=MOST_LOADS)));
    let (from, to, steps) = (from?, to?, steps?);
    if from >= to {
        let place = range.to.written()?.span.clone();
        let mut problem = Problem::new(
            format!("`loads` must ascend: `to = {to:?}` is not above `from = {from:?}`"),
            place,
            "not above `from`",
        );
        if let Some(from) = range.from.written() {
            problem = problem.and(from.span.clone(), "`from`");
        }
        return checks.reject(problem);
    }
    let load: Box<dyn Fn(f64) -> f64> = match range.spacing.value() {
        Some(Spacing::Geometric) if from == 0.0 => {
            let spacing = range.spacing.written()?;
            let problem = Problem::new(
                "geometric loads cannot start at zero",
                spacing.span.clone(),
                "needs `from` above 0",
            );
            let help = "equal ratios lead nowhere from zero: give the load that precedes the first";
            return checks.reject(problem.help(help));
        }
        Some(Spacing::Geometric) => Box::new(move |share| from * libm::pow(to / from, share)),
        Some(Spacing::Linear) | None => Box::new(move |share| from + (to - from) * share),
    };
    let share = |step: u32| f64::from(step) / f64::from(steps);
    let inner = (1..steps).map(|step| decimal::nearest(load(share(step))));
    let loads: Vec<f64> = inner.chain([to]).collect();
    if loads[0] > from && ascends(&loads) {
        return Some(loads);
    }
    let message = format!("{steps} loads from {from:?} to {to:?} differ by no more than rounding");
    checks.reject(Problem::new(message, written.span.clone(), "too many steps"))
}

/// What is kept of pressure fields. Chosen loads are those of the block to rounding, and are stored
/// as the block has them.
pub fn pressures(
    table: &SolveTable,
    loads: Option<&[f64]>,
    checks: &mut Checks,
) -> Option<Pressures> {
    let Some(written) = table.pressures.written() else {
        return Some(Pressures::None);
    };
    let list = match &written.value {
        WrittenPressures::Word(PressuresWord::None) => return Some(Pressures::None),
        WrittenPressures::Word(PressuresWord::All) => return Some(Pressures::All),
        WrittenPressures::At(list) => list,
    };
    if list.is_empty() {
        let label = "for no pressure field at all write \"none\"";
        let problem = Problem::new("`pressures` is empty", written.span.clone(), label);
        return checks.reject(problem);
    }
    let loads = loads?;
    let chosen: Vec<_> = list.iter().map(|load| chosen(load, loads, checks)).collect();
    let mut chosen: Vec<f64> = chosen.into_iter().collect::<Option<_>>()?;
    chosen.sort_by(f64::total_cmp);
    chosen.dedup();
    Some(Pressures::At(chosen))
}

fn chosen(load: &Written<f64>, loads: &[f64], checks: &mut Checks) -> Option<f64> {
    let value = checks.holds("pressures", load, POSITIVE)?;
    let distance = |other: &&f64| (**other - value).abs();
    let nearest = *loads.iter().min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
    if decimal::is_same(nearest, value) {
        return Some(nearest);
    }
    let message = format!("`pressures` asks for the load {value:?}, which is not in `loads`");
    let label = format!("the nearest load is {nearest:?}");
    checks.reject(Problem::new(message, load.span.clone(), label))
}

/// The bins of a key, if they are asked for.
pub fn bins(
    name: &str,
    key: &Key<Bins>,
    loads: Option<&[f64]>,
    checks: &mut Checks,
) -> Option<Option<EqualBins>> {
    let Some(written) = key.written() else {
        return (!checks.is_excused(name)).then_some(None);
    };
    let Bins { count, to } = &written.value;
    let count = part(name, "count", count, written, checks)
        .and_then(|count| checks.is_whole_in("count", count, &(1..=MOST_BINS)));
    let to = part(name, "to", to, written, checks).and_then(|to| checks.is_in("to", to, QUANTITY));
    let bins = EqualBins { count: count?, to: to? };
    let loads = loads.map_or(0, <[f64]>::len);
    if loads.saturating_mul(bins.count as usize) > MOST_BINS_OF_A_BLOCK {
        let message = format!("`{name}` asks for {} bins under each of {loads} loads", bins.count);
        let label = format!("at most {MOST_BINS_OF_A_BLOCK} bins fit in a block");
        return checks.refuse(name, message, &written.span, label);
    }
    Some(Some(bins))
}

fn part<'k, T>(
    name: &str,
    part: &str,
    key: &'k Key<T>,
    written: &Written<Bins>,
    checks: &mut Checks,
) -> Option<&'k Written<T>> {
    if key.written().is_none() {
        let label = "`{ count, to }` says how many bins there are and where the last one ends";
        return checks.refuse(name, format!("`{name}` lacks `{part}`"), &written.span, label);
    }
    key.written()
}
