//! Checks of the stages that press surfaces.

mod bins;
mod hardness;
mod loads;

use std::ops::Bound;
use std::sync::Arc;

use super::keys::{self, Body, InteractionWord, MOST_PAIRS, Method, SolveTable};
use super::{Params, PressureUnit};
use crate::Given;
use crate::Recipe;
use crate::form::Surfaces;
use asperity_contact::asperities::Interaction;
use asperity_contact::grid::Boundary;
use asperity_contact::solver::{DEFAULT_PAIR_LIMIT, DEFAULT_TOLERANCE};
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::written::checks::{Checks, QUANTITY, SHARE, report_equal_points};
use asperity_manifest::written::{Key, Section};

/// Loads of all points of a grid together.
const MOST_LOADS_OF_A_STAGE: usize = 1_000_000;

/// The blocks of a stage, point by point of its grid.
pub fn recipes(section: &Section<SolveTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let blocks = blocks(section, &given.surfaces, given.problems)?;
    let recipes = blocks.into_iter().map(|block| Recipe::Solve(Arc::new(block)));
    Some(recipes.collect())
}

fn blocks(
    section: &Section<SolveTable>,
    surfaces: &Surfaces,
    problems: &mut Problems,
) -> Option<Vec<Params>> {
    hardness::check_unit(section, problems);
    let mut blocks = Vec::with_capacity(section.points.len());
    let mut loads = 0;
    for point in &section.points {
        let checks = &mut Checks::of(section, point, problems);
        let boundary = boundary(&point.table, surfaces, section, checks);
        let block = block(&point.table, checks).zip(boundary);
        let block = block.map(|(block, boundary)| Params { boundary, ..block });
        if let Some(block) = &block {
            hardness::check_loads(&point.table, block, surfaces, checks);
        }
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
    let loads = loads::loads(table, checks);
    let hardness = hardness::given(table, checks);
    let softest_body = hardness::softest_body(table, checks);
    let tolerance = checks.number_or("tolerance", &table.tolerance, SHARE, DEFAULT_TOLERANCE);
    let max_pairs =
        checks.whole_or("max_pairs", &table.max_pairs, 1..=MOST_PAIRS, DEFAULT_PAIR_LIMIT);
    let load_unit = unit(&table.load_unit, PressureUnit::Relative);
    let pressures = loads::pressures(table, loads.as_deref(), checks);
    let pressure_bins =
        bins::checked("pressure_bins", &table.pressure_bins, loads.as_deref(), checks);
    let gap_bins = bins::checked("gap_bins", &table.gap_bins, loads.as_deref(), checks);
    let flow = flow(table, checks);
    let asperities = asperities(table, checks);
    Some(Params {
        effective_modulus: effective_modulus?,
        load_unit,
        loads: loads?,
        tolerance: tolerance?,
        max_pairs: max_pairs?,
        pressures: pressures?,
        boundary: Boundary::Periodic,
        hardness: hardness?,
        pressure_bins: pressure_bins?,
        gap_bins: gap_bins?,
        softest_body: softest_body?,
        bodies: table.bodies.written().map_or(0, |bodies| bodies.value.len()),
        flow: flow?,
        asperities: asperities?,
    })
}

/// Whether the flow through the gap is asked for, of surfaces that repeat themselves.
fn flow(table: &SolveTable, checks: &mut Checks) -> Option<bool> {
    let Some(written) = table.flow.written().filter(|flow| flow.value) else {
        return Some(false);
    };
    let open = table.boundary.written();
    if open.is_some_and(|boundary| boundary.value == keys::Boundary::Free) {
        let message = "`flow` is true, and `boundary` is \"free\"";
        let label = "is found where the gap repeats itself, with `boundary = \"periodic\"`";
        checks.report("flow", Problem::new(message, written.span.clone(), label));
        return None;
    }
    Some(true)
}

/// How asperities act on each other, if summits are pressed: elastic ones, around the cell.
fn asperities(table: &SolveTable, checks: &mut Checks) -> Option<Option<Interaction>> {
    let method = table.method.written().map(|method| method.value);
    if method != Some(Method::Asperities) {
        let why = "goes with `method = \"asperities\"`";
        return checks.forbidden("interaction", &table.interaction, why).map(|()| None);
    }
    let why = "Hertz' contacts are elastic under any pressure";
    let elastic = checks.forbidden("hardness", &table.hardness, why);
    let why =
        "counted of pressures and gaps of all nodes, which Hertz' contacts are not solved for";
    let pressures = checks.forbidden("pressure_bins", &table.pressure_bins, why);
    let gaps = checks.forbidden("gap_bins", &table.gap_bins, why);
    let why = "found of the gap of all nodes, which Hertz' contacts are not solved for";
    let flow = checks.forbidden("flow", &table.flow, why);
    elastic.and(pressures).and(gaps).and(flow)?;
    let open = table.boundary.written();
    let open = open.filter(|written| written.value == keys::Boundary::Free);
    if let Some(written) = open {
        let message = "asperities are pressed around the cell, and `boundary` is \"free\"";
        let label = "must be \"periodic\" with `method = \"asperities\"`";
        checks.report("boundary", Problem::new(message, written.span.clone(), label));
    }
    let interaction = match table.interaction.written().map(|written| written.value) {
        Some(InteractionWord::None) => Interaction::None,
        Some(InteractionWord::MeanField) => Interaction::MeanField,
        Some(InteractionWord::Explicit) | None => Interaction::Explicit,
    };
    open.is_none().then_some(Some(interaction))
}

/// What a pressure is measured in, or what it is when left out.
fn unit(written: &Key<keys::PressureUnit>, default: PressureUnit) -> PressureUnit {
    match written.written().map(|unit| unit.value) {
        Some(keys::PressureUnit::Absolute) => PressureUnit::Absolute,
        Some(keys::PressureUnit::Relative) => PressureUnit::Relative,
        None => default,
    }
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
    let compliances: Vec<_> =
        bodies.value.iter().map(|body| compliance(&body.value, checks)).collect();
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
