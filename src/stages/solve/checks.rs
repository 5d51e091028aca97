//! Checks of the stages that press surfaces.

use std::ops::Bound;
use std::sync::Arc;

use super::keys::{
    self, Body, LoadRange, Loads, MOST_PAIRS, Pressures as WrittenPressures, PressuresWord,
    SolveTable, Spacing,
};
use super::{LoadUnit, Params, Pressures};
use crate::contact::grid::Boundary;
use crate::contact::solver::{DEFAULT_PAIR_LIMIT, DEFAULT_TOLERANCE};
use crate::decimal;
use crate::diagnostics::{Problem, Problems};
use crate::stages::Given;
use crate::stages::Recipe;
use crate::stages::given::Surfaces;
use crate::written::Section;
use crate::written::Written;
use crate::written::checks::{
    Checks, NOT_NEGATIVE, POSITIVE, QUANTITY, SHARE, report_equal_points,
};

/// Loads of one block.
const MOST_LOADS: u32 = 100_000;
/// Loads of all points of a grid together.
const MOST_LOADS_OF_A_STAGE: usize = 1_000_000;

/// The blocks of a stage, point by point of its grid.
pub fn recipes(section: &Section<SolveTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let blocks = blocks(section, &given.surfaces, given.problems)?;
    let recipes = blocks
        .into_iter()
        .map(|block| Recipe::Solve(Arc::new(block)));
    Some(recipes.collect())
}

fn blocks(
    section: &Section<SolveTable>,
    surfaces: &Surfaces,
    problems: &mut Problems,
) -> Option<Vec<Params>> {
    let mut blocks = Vec::with_capacity(section.points.len());
    let mut loads = 0;
    for point in &section.points {
        let checks = &mut Checks::of(section, point, problems);
        let boundary = boundary(&point.table, surfaces, section, checks);
        let block = block(&point.table, checks).zip(boundary);
        let block = block.map(|(block, boundary)| Params { boundary, ..block });
        loads += block.as_ref().map_or(0, |block| block.loads.len());
        if loads > MOST_LOADS_OF_A_STAGE {
            let message = format!("the stage has more than {MOST_LOADS_OF_A_STAGE} loads");
            let label = "the lists of this stage multiply";
            problems.push(Problem::new(message, section.place.clone(), label));
            return None;
        }
        blocks.push(block);
    }
    let blocks = blocks.into_iter().collect::<Option<Vec<_>>>()?;
    report_equal_points(section, &blocks, problems);
    Some(blocks)
}

/// What lies beyond the edges: a map that is not periodic must not be taken for one that is.
fn boundary(
    table: &SolveTable,
    surfaces: &Surfaces,
    section: &Section<SolveTable>,
    checks: &mut Checks,
) -> Option<Boundary> {
    let written = table.boundary.written();
    if written.is_some_and(|written| written.value == keys::Boundary::Free) {
        return Some(Boundary::Free);
    }
    let Some(stage) = &surfaces.open else {
        return Some(Boundary::Periodic);
    };
    let message =
        format!("the map of stage `{stage}` is not periodic, and pressed as if it repeated itself");
    let place = written.map_or(&section.place, |written| &written.span);
    let label = "`boundary` is \"periodic\" here";
    let problem = Problem::new(message, place.clone(), label);
    checks.problems.push(problem.help(format!(
        "`boundary = \"free\"` presses it as it is, with nothing beyond its edges; `edges = \
         \"mirror\"` or `\"taper\"` in stage `{stage}` makes its edges meet"
    )));
    None
}

fn block(table: &SolveTable, checks: &mut Checks) -> Option<Params> {
    let effective_modulus = modulus(table, checks);
    let loads = loads(table, checks);
    let tolerance = checks.number_or("tolerance", &table.tolerance, SHARE, DEFAULT_TOLERANCE);
    let max_pairs = checks.whole_or(
        "max_pairs",
        &table.max_pairs,
        1..=MOST_PAIRS,
        DEFAULT_PAIR_LIMIT,
    );
    let load_unit = match table.load_unit.written().map(|unit| unit.value) {
        Some(keys::LoadUnit::Absolute) => LoadUnit::Absolute,
        Some(keys::LoadUnit::Relative) | None => LoadUnit::Relative,
    };
    let pressures = pressures(table, loads.as_deref(), checks);
    Some(Params {
        effective_modulus: effective_modulus?,
        load_unit,
        loads: loads?,
        tolerance: tolerance?,
        max_pairs: max_pairs?,
        pressures: pressures?,
        boundary: Boundary::Periodic,
    })
}

/// E*, given or from the two bodies.
fn modulus(table: &SolveTable, checks: &mut Checks) -> Option<f64> {
    let Some(bodies) = table.bodies.written() else {
        return checks.number_or("effective_modulus", &table.effective_modulus, QUANTITY, 1.0);
    };
    if let Some(modulus) = table.effective_modulus.written() {
        let message = "`effective_modulus` and `bodies` exclude each other";
        let problem = Problem::new(message, modulus.span.clone(), "the effective modulus")
            .and(bodies.span.clone(), "follows from the bodies");
        checks.report("bodies", problem);
        return None;
    }
    if !(1..=2).contains(&bodies.value.len()) {
        let message = format!("`bodies` has {} entries", bodies.value.len());
        let label = "must be two, or one against a rigid body";
        checks.report("bodies", Problem::new(message, bodies.span.clone(), label));
        return None;
    }
    let compliances: Vec<_> = bodies
        .value
        .iter()
        .map(|body| compliance(&body.value, checks))
        .collect();
    let compliances: Option<Vec<f64>> = compliances.into_iter().collect();
    let modulus = 1.0 / compliances?.iter().sum::<f64>();
    if !(modulus.is_finite() && modulus > 0.0) {
        let message = format!("the effective modulus of the bodies comes to {modulus:?}");
        let label = "out of the range of numbers";
        checks.report("bodies", Problem::new(message, bodies.span.clone(), label));
        return None;
    }
    Some(modulus)
}

/// (1 − ν²)/E.
fn compliance(body: &Body, checks: &mut Checks) -> Option<f64> {
    let modulus = checks.is_in("youngs_modulus", &body.youngs_modulus, QUANTITY);
    let ratio = (Bound::Excluded(-1.0), Bound::Included(0.5));
    let ratio = checks.is_in("poisson_ratio", &body.poisson_ratio, ratio);
    let (modulus, ratio) = (modulus?, ratio?);
    Some((1.0 - ratio * ratio) / modulus)
}

fn loads(table: &SolveTable, checks: &mut Checks) -> Option<Vec<f64>> {
    let written = checks.required("loads", &table.loads)?;
    match &written.value {
        Loads::List(list) if list.is_empty() => {
            let label = "must hold at least one load";
            checks.report(
                "loads",
                Problem::new("`loads` is empty", written.span.clone(), label),
            );
            None
        }
        Loads::List(list) => listed(list, checks),
        Loads::Range(range) => spaced(range, written, checks),
    }
}

fn listed(list: &[Written<f64>], checks: &mut Checks) -> Option<Vec<f64>> {
    let loads: Vec<_> = list
        .iter()
        .map(|load| checks.holds("loads", load, QUANTITY))
        .collect();
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
        checks
            .problems
            .push(Problem::new(message, list[0].span.clone(), label));
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
    let to = range
        .to
        .written()
        .map(|to| checks.is_in("to", to, QUANTITY));
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
    checks.problems.push(Problem::new(
        message,
        written.span.clone(),
        "too many steps",
    ));
    None
}

/// Chosen loads are those of the block to rounding, and are stored as the block has them.
fn pressures(table: &SolveTable, loads: Option<&[f64]>, checks: &mut Checks) -> Option<Pressures> {
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
    let chosen: Vec<_> = list
        .iter()
        .map(|load| chosen(load, loads, checks))
        .collect();
    let mut chosen: Vec<f64> = chosen.into_iter().collect::<Option<_>>()?;
    chosen.sort_by(f64::total_cmp);
    chosen.dedup();
    Some(Pressures::At(chosen))
}

fn chosen(load: &Written<f64>, loads: &[f64], checks: &mut Checks) -> Option<f64> {
    let value = checks.holds("pressures", load, POSITIVE)?;
    let distance = |other: &&f64| (**other - value).abs();
    let nearest = *loads
        .iter()
        .min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
    if decimal::is_same(nearest, value) {
        return Some(nearest);
    }
    let message = format!("`pressures` asks for the load {value:?}, which is not in `loads`");
    let label = format!("the nearest load is {nearest:?}");
    checks
        .problems
        .push(Problem::new(message, load.span.clone(), label));
    None
}
