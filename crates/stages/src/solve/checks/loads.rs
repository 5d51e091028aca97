//! Checks of loads: they ascend, and pressures are kept of some of them.

use super::super::Pressures;
use super::super::keys::{
    LoadRange, Loads, Pressures as WrittenPressures, PressuresWord, SolveTable, Spacing,
};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::Written;
use asperity_manifest::written::checks::{Checks, NOT_NEGATIVE, POSITIVE, QUANTITY};

/// Loads of one block.
const MOST_LOADS: u32 = 100_000;

/// The loads of a block, ascending.
pub fn loads(table: &SolveTable, checks: &mut Checks) -> Option<Vec<f64>> {
    let written = checks.required("loads", &table.loads)?;
    match &written.value {
        Loads::List(list) if list.is_empty() => {
            let label = "must hold at least one load";
            checks.report("loads", Problem::new("`loads` is empty", written.span.clone(), label));
            None
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
        checks.problems.push(problem);
        return None;
    }
    if list.len() > MOST_LOADS as usize {
        let message = format!("`loads` holds {} loads", list.len());
        let label = format!("at most {MOST_LOADS} fit in a block");
        checks.problems.push(Problem::new(message, list[0].span.clone(), label));
        return None;
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
    let mut given = |name, is_given: bool| {
        if !is_given {
            let message = format!("`loads` lacks `{name}`");
            let label = format!("`{name}` is missing here");
            checks.report("loads", Problem::new(message, written.span.clone(), label));
        }
    };
    given("to", range.to.written().is_some());
    given("steps", range.steps.written().is_some());
    let to = range.to.written().map(|to| checks.is_in("to", to, QUANTITY));
    let steps = range.steps.written();
    let steps = steps.map(|_| checks.whole("steps", &range.steps, 1..=MOST_LOADS));
    let (from, to, steps) = (from?, to??, steps??);
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
        checks.problems.push(problem);
        return None;
    }
    let load: Box<dyn Fn(f64) -> f64> = match range.spacing.written().map(|spacing| spacing.value) {
        Some(Spacing::Geometric) if from == 0.0 => {
            let spacing = range.spacing.written()?;
            let problem = Problem::new(
                "geometric loads cannot start at zero",
                spacing.span.clone(),
                "needs `from` above 0",
            );
            let help = "equal ratios lead nowhere from zero: give the load that precedes the first";
            checks.problems.push(problem.help(help));
            return None;
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
    checks.problems.push(Problem::new(message, written.span.clone(), "too many steps"));
    None
}

/// What is kept of pressure fields. Chosen loads are those of the block to rounding, and are stored as the block has them.
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
        checks.problems.push(problem);
        return None;
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
    checks.problems.push(Problem::new(message, load.span.clone(), label));
    None
}
