//! Keys of the stages that press surfaces, and their checks.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::ops::Bound;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::loads::{Bins, Loads, WrittenPressures};
use super::units::PressureUnit;
use super::{GivenHardness, Params, loads};
use crate::form::Surfaces;
use crate::{Given, Recipe};
use asperity_contact::asperities::Interaction;
use asperity_contact::grid::Boundary;
use asperity_contact::solver::{DEFAULT_PAIR_LIMIT, DEFAULT_TOLERANCE};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::written::checks::{Checks, QUANTITY, SHARE, report_equal_points};
use asperity_manifest::written::{Key, Section, Written, table};

/// The largest `max_pairs`.
const MOST_PAIRS: u32 = 1_000_000;
/// Loads of all points of a grid together.
const MOST_LOADS_OF_A_STAGE: usize = 1_000_000;
/// A hardness is one of a material, whatever its surface.
const HARDNESS_UNIT: PressureUnit = PressureUnit::Absolute;

/// Presses surfaces through one block of loads.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolveTable {
    /// Effective modulus E*, with 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂; `bodies` may stand instead.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    pub effective_modulus: Key<f64>,
    /// The two bodies in contact, or one pressed against a rigid one; instead of
    /// `effective_modulus`.
    #[schemars(length(min = 1, max = 2))]
    pub bodies: Key<Vec<Written<Body>>>,
    /// The loads, one after the other: a list, or `{ from, to, steps, spacing }`.
    #[schemars(required)]
    pub loads: Key<Loads>,
    /// How contact is found: of every node, by boundary elements, or as Hertz' contacts of the summits of
    /// the surface.
    #[schemars(extend("default" = "boundary-elements"))]
    pub method: Key<Method>,
    /// How asperities act on each other, where `method` is "asperities": `"explicit"` when left out.
    pub interaction: Key<Interaction>,
    /// What lies beyond the edges of the surfaces: the same again, for ever, or nothing.
    #[schemars(extend("default" = "periodic"))]
    pub boundary: Key<Boundary>,
    /// What `loads` and `pressures` are measured in.
    #[schemars(extend("default" = "relative"))]
    pub load_unit: Key<PressureUnit>,
    /// The highest pressure that the material bears: where it is reached, the material yields, and
    /// every load must be below it. For loading alone: unloading is another problem. None when left
    /// out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hardness: Key<f64>,
    /// What `hardness` is measured in.
    #[schemars(extend("default" = "absolute"))]
    pub hardness_unit: Key<PressureUnit>,
    /// When to stop: largest gap in contact and largest penetration outside it, over rms slope ×
    /// mesh step.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_TOLERANCE))]
    pub tolerance: Key<f64>,
    /// Pairs of Fourier transforms after which a load is given up; its row says so.
    #[schemars(range(min = 1, max = MOST_PAIRS), extend("default" = DEFAULT_PAIR_LIMIT))]
    pub max_pairs: Key<i64>,
    /// Which pressure fields are stored: `"none"`, `"all"`, or those at some of the `loads`.
    #[schemars(extend("default" = "none"))]
    pub pressures: Key<WrittenPressures>,
    /// Bins in which pressures are counted under each load, `{ count, to }`: so many equal ones from
    /// zero to that pressure in units of E* × rms slope. A `measure` stage with `what = "pressures"`
    /// tells their distribution, and no pressure has to be stored.
    pub pressure_bins: Key<Bins>,
    /// Bins in which gaps are counted under each load, `{ count, to }`: so many equal ones from zero
    /// to that gap in rms heights. A `measure` stage with `what = "gaps"` tells their distribution. It
    /// costs a pair of transforms a load.
    pub gap_bins: Key<Bins>,
    /// Whether what flows through the gap is found under each load, along x and along y, by Reynolds'
    /// equation on the mesh. It takes ten to twenty times as long as the loads themselves; surfaces must
    /// repeat themselves.
    #[schemars(extend("default" = false))]
    pub flow: Key<bool>,
}

table!(SolveTable, swept: ["effective_modulus", "tolerance", "boundary", "hardness", "interaction"], lists: []);

/// An elastic body.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Young's modulus E.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub youngs_modulus: Written<f64>,
    /// Poisson's ratio ν, above −1 and at most 0.5.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = -1))]
    pub poisson_ratio: Written<f64>,
    /// The highest pressure that it bears, in the unit of its modulus. It bounds nothing and changes no
    /// result, as `hardness` of the stage does, but a run tells where the peak pressure passes it.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hardness: Key<f64>,
}

/// How contact is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The contact of every node is solved.
    BoundaryElements,
    /// Hertz' elliptic contacts of the summits.
    Asperities,
}

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
    check_hardness_unit(section, problems);
    let mut blocks = Vec::with_capacity(section.points.len());
    let mut loads = 0;
    for point in &section.points {
        let checks = &mut Checks::of(section, point, problems);
        let boundary = boundary(&point.table, surfaces, section, checks);
        let block = block(&point.table, checks).zip(boundary);
        let block = block.map(|(block, boundary)| Params { boundary, ..block });
        if let Some(block) = &block {
            check_bearing(&point.table, block, surfaces, checks);
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
    if table.boundary.value() == Some(Boundary::Free) {
        return Some(Boundary::Free);
    }
    let Some(stage) = &surfaces.open else {
        return Some(Boundary::Periodic);
    };
    let message =
        format!("the map of stage `{stage}` is not periodic, and pressed as if it repeated itself");
    let place = table.boundary.written().map_or(&section.place, |written| &written.span);
    let label = "`boundary` is \"periodic\" here";
    let problem = Problem::new(message, place.clone(), label);
    checks.reject(problem.help(format!(
        "`boundary = \"free\"` presses it as it is, with nothing beyond its edges; `edges = \
         \"mirror\"` or `\"taper\"` in stage `{stage}` makes its edges meet"
    )))
}

fn block(table: &SolveTable, checks: &mut Checks) -> Option<Params> {
    let effective_modulus = modulus(table, checks);
    let loads = loads::loads(table, checks);
    let hardness = hardness(table, checks);
    let softest_body = softest_body(table, checks);
    let tolerance = checks.number_or("tolerance", &table.tolerance, SHARE, DEFAULT_TOLERANCE);
    let max_pairs =
        checks.whole_or("max_pairs", &table.max_pairs, 1..=MOST_PAIRS, DEFAULT_PAIR_LIMIT);
    let pressures = loads::pressures(table, loads.as_deref(), checks);
    let pressure_bins =
        loads::bins("pressure_bins", &table.pressure_bins, loads.as_deref(), checks);
    let gap_bins = loads::bins("gap_bins", &table.gap_bins, loads.as_deref(), checks);
    let flow = flow(table, checks);
    let asperities = asperities(table, checks);
    Some(Params {
        effective_modulus: effective_modulus?,
        load_unit: table.load_unit.value().unwrap_or(PressureUnit::Relative),
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
    if table.boundary.value() == Some(Boundary::Free) {
        let message = "`flow` is true, and `boundary` is \"free\"";
        let label = "is found where the gap repeats itself, with `boundary = \"periodic\"`";
        return checks.refuse("flow", message, &written.span, label);
    }
    Some(true)
}

/// How asperities act on each other, if summits are pressed: elastic ones, around the cell.
fn asperities(table: &SolveTable, checks: &mut Checks) -> Option<Option<Interaction>> {
    if table.method.value() != Some(Method::Asperities) {
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
    let open = table.boundary.written().filter(|written| written.value == Boundary::Free);
    if let Some(written) = open {
        let message = "asperities are pressed around the cell, and `boundary` is \"free\"";
        let label = "must be \"periodic\" with `method = \"asperities\"`";
        checks.report("boundary", Problem::new(message, written.span.clone(), label));
    }
    let interaction = table.interaction.value().unwrap_or(Interaction::Explicit);
    open.is_none().then_some(Some(interaction))
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
        return checks.refuse("bodies", message, &bodies.span, label);
    }
    let compliances: Vec<_> =
        bodies.value.iter().map(|body| compliance(&body.value, checks)).collect();
    let compliances: Option<Vec<f64>> = compliances.into_iter().collect();
    let modulus = 1.0 / compliances?.iter().sum::<f64>();
    if !(modulus.is_finite() && modulus > 0.0) {
        let message = format!("the effective modulus of the bodies comes to {modulus:?}");
        let label = "out of the range of numbers";
        return checks.refuse("bodies", message, &bodies.span, label);
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

/// Refuses a unit of nothing, unless it is the default, which may be written out anywhere. Some points of
/// a grid may have no hardness where others have one.
fn check_hardness_unit(section: &Section<SolveTable>, problems: &mut Problems) {
    let is_given = |table: &SolveTable| table.hardness.written().is_some();
    if section.points.iter().any(|point| is_given(&point.table)) {
        return;
    }
    for point in &section.points {
        let checks = &mut Checks::of(section, point, problems);
        let unit = point.table.hardness_unit.value().unwrap_or(HARDNESS_UNIT);
        if unit != HARDNESS_UNIT && !checks.is_excused("hardness") {
            let why = "there is no `hardness` to be measured in it";
            checks.forbidden("hardness_unit", &point.table.hardness_unit, why);
        }
    }
}

/// The hardness, where there is one.
fn hardness(table: &SolveTable, checks: &mut Checks) -> Option<Option<GivenHardness>> {
    let Some(written) = table.hardness.written() else {
        return Some(None);
    };
    let pressure = checks.is_in("hardness", written, QUANTITY)?;
    let unit = table.hardness_unit.value().unwrap_or(HARDNESS_UNIT);
    Some(Some(GivenHardness { pressure, unit }))
}

/// The smallest hardness that a body has, where one has any.
fn softest_body(table: &SolveTable, checks: &mut Checks) -> Option<Option<f64>> {
    let bodies = table.bodies.written().into_iter();
    let bodies = bodies.flat_map(|bodies| &bodies.value);
    let written = bodies.filter_map(|body| body.value.hardness.written());
    let hardnesses: Vec<_> =
        written.map(|hardness| checks.is_in("bodies.hardness", hardness, QUANTITY)).collect();
    let hardnesses: Vec<f64> = hardnesses.into_iter().collect::<Option<_>>()?;
    Some(hardnesses.into_iter().reduce(f64::min))
}

/// Reports the heaviest load if it presses a surface by more than the material bears, as far as that
/// is known before there is a surface.
fn check_bearing(table: &SolveTable, block: &Params, surfaces: &Surfaces, checks: &mut Checks) {
    let (Some(hardness), Some(&heaviest)) = (block.hardness, block.loads.last()) else {
        return;
    };
    let slopes = match hardness.unit == block.load_unit {
        true => Some([1.0; 2]),
        false => surfaces.slopes,
    };
    let pressure = |value: f64, unit: PressureUnit, slope: f64| match unit {
        PressureUnit::Absolute => value,
        PressureUnit::Relative => decimal::nearest(value * block.effective_modulus * slope),
    };
    let of_load = |slope: f64| pressure(heaviest, block.load_unit, slope);
    let of_hardness = |slope: f64| pressure(hardness.pressure, hardness.unit, slope);
    let mut slopes = slopes.into_iter().flatten();
    let Some(slope) = slopes.find(|slope| of_load(*slope) >= of_hardness(*slope)) else {
        return;
    };
    let told = |value: f64, unit: PressureUnit| match unit {
        PressureUnit::Relative if hardness.unit != block.load_unit => {
            let pressure = pressure(value, unit, slope);
            format!("{value:?}, a pressure of {pressure:?} where the rms slope is {slope:?}")
        }
        _ => format!("{value:?}"),
    };
    let message = format!(
        "`loads` holds {}, and `hardness` is {}",
        told(heaviest, block.load_unit),
        told(hardness.pressure, hardness.unit)
    );
    let Some((load, hardness)) = place_of_heaviest(table).zip(table.hardness.written()) else {
        return;
    };
    let limit = of_hardness(slope) / pressure(1.0, block.load_unit, slope);
    let problem = Problem::new(message, load, "more than the material bears");
    let problem = problem.and(hardness.span.clone(), "the highest pressure that it bears");
    checks.problems.push(problem.help(format!(
        "under a mean pressure of its hardness a material yields everywhere: each load must be below \
         {:?} here",
        decimal::nearest(limit)
    )));
}

/// Where the heaviest load is written.
fn place_of_heaviest(table: &SolveTable) -> Option<Span> {
    match &table.loads.written()?.value {
        Loads::List(list) => Some(list.last()?.span.clone()),
        Loads::Range(range) => Some(range.to.written()?.span.clone()),
    }
}
