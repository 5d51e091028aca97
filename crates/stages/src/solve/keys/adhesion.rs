//! Keys of `solve` stages with adhesion, and checks of their values.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::{StageChecks, converted, unit_of};
use crate::solve::adhesion::{Params, VERSION};
use crate::solve::keys::loads::{self, Loads, StoredPressures};
use crate::solve::keys::{Method, SolveTable, against, bodies, lack_unit, load_unit};
use crate::solve::{Control, Pressures};
use crate::{Recipe, nominal_area};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{length, positive_items, work};
use asperity_manifest::keys::{Key, Spanned, deserialize_either};
use asperity_mechanics::adhesion::{BISTABLE, Settings};
use asperity_mechanics::grid::Boundary;

/// Maximum number of states of a path.
const MAX_STATES: u32 = 10_000;

/// Attraction between the surfaces, the value of `adhesion`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdhesionTable {
    /// Work of adhesion w, the energy per area that separates two flat surfaces in contact, such as
    /// `"50 mJ/m^2"`. A plain number has the unit of the modulus times the unit of the surfaces:
    /// with MPa and µm this is J/m².
    #[schemars(range(min = 0), transform = work)]
    pub work: f64,
    /// Range ρ of the interaction, such as `"2 nm"`. A plain number is in the unit of the lengths
    /// of the surfaces.
    #[schemars(extend("exclusiveMinimum" = 0), transform = length)]
    pub range: f64,
    /// `true` also solves on a mesh that is too coarse for the interaction, Δx w/(E* ρ²) > π/2. On
    /// such a mesh single nodes jump into contact.
    #[serde(default, rename = "override")]
    #[schemars(extend("default" = false))]
    pub on_coarse_mesh: bool,
}

/// The states of a path, the value of `path`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PathShape {
    /// The states follow the list.
    AsGiven,
    /// The states follow the list, and then the list backwards.
    ThereAndBack,
}

impl PathShape {
    /// Returns the states of a path, given its list.
    pub fn states(self, mut listed: Vec<f64>) -> Vec<f64> {
        if self == PathShape::ThereAndBack {
            let back: Vec<f64> = listed.iter().rev().skip(1).copied().collect();
            listed.extend(back);
        }
        listed
    }
}

/// Mean gaps or displacements, the value of `gaps` and of `displacements`.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Gaps {
    /// A list of lengths.
    List(
        #[schemars(length(min = 1, max = MAX_STATES), transform = positive_items)]
        Vec<Spanned<f64>>,
    ),
    /// Evenly spaced lengths.
    Range(GapRange),
}

deserialize_either!(Gaps { list => List, table => Range });

/// Evenly spaced mean gaps or displacements, which include both ends.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GapRange {
    /// First of the lengths.
    #[schemars(extend("exclusiveMinimum" = 0), transform = length)]
    pub from: f64,
    /// Last of the lengths.
    #[schemars(extend("exclusiveMinimum" = 0), transform = length)]
    pub to: f64,
    /// Number of lengths, including `from` and `to`.
    #[schemars(range(min = 2, max = MAX_STATES))]
    pub steps: u32,
}

/// Returns the recipes of a point with adhesion, or `None` after reporting problems. There is one,
/// or one for each nominal area if loads are forces.
pub fn recipes(
    table: &SolveTable,
    adhesion: AdhesionTable,
    boundary: Option<Boundary>,
    checks: &mut StageChecks,
) -> Option<Vec<Recipe>> {
    check_method(table, checks)?;
    let prescribes_gaps = table.control.value().is_some_and(|control| !control.is_load());
    let forces = if prescribes_gaps { vec![None] } else { loads::newtons(table, checks)? };
    bodies::bodies(table, checks)?;
    let effective_modulus = bodies::modulus(table, checks);
    let load_unit = load_unit(table, checks);
    let conversion = Conversion::new(adhesion.work, checks)?;
    let adhesion = AdhesionTable {
        work: conversion.work(adhesion.work),
        range: conversion.length(adhesion.range),
        ..adhesion
    };
    check_mesh(table, adhesion, effective_modulus?, checks)?;
    let control = checks.value("control", &table.control)?;
    let listed = match control {
        Control::Load => listed_loads(table, checks)?,
        Control::Gap => listed_lengths("gaps", &table.gaps, conversion, checks)?,
        // This control is refused beside `adhesion`.
        Control::Displacement => return None,
    };
    let path = checks.optional("path", &table.path)?;
    let targets = path.map_or(PathShape::AsGiven, |path| path.value).states(listed);
    let all = Some(&targets[..]);
    let pressure_bins = loads::pressure_bins(table, effective_modulus, all, checks);
    let gap_bins = loads::gap_bins(table, all, checks);
    let load_unit = load_unit?;
    let has_loads = control == Control::Load && targets.iter().any(|load| *load != 0.0);
    let given = Params {
        version: VERSION.number(),
        effective_modulus: effective_modulus?,
        load_unit,
        pressure_unit: checks.units.pressure.as_ref().map(|named| named.unit.symbol),
        newtons: None,
        work: adhesion.work,
        range: adhesion.range,
        control,
        targets,
        tolerance: checks.number("tolerance", &table.tolerance)?,
        max_pairs: checks.value_or(
            "max_pairs",
            &table.max_pairs,
            Settings::OF_STUDIES.pair_limit,
        )?,
        keeps_maps: keeps_maps(table, checks)?,
        pressure_bins: pressure_bins?,
        gap_bins: gap_bins?,
        boundary: boundary?,
        shift: against::shift(table, checks)?,
        loads_lack_unit: has_loads && lack_unit(table, load_unit, checks),
    };
    let on_area = |newtons: Option<f64>| {
        let targets = nominal_area::pressures(&given.targets, newtons);
        Recipe::Adhesion(Arc::new(Params { newtons, targets, ..given.clone() }))
    };
    Some(forces.into_iter().map(on_area).collect())
}

/// Refuses a mesh on which single nodes jump into contact.
fn check_mesh(
    table: &SolveTable,
    adhesion: AdhesionTable,
    modulus: f64,
    checks: &mut StageChecks,
) -> Option<()> {
    let AdhesionTable { work, range, on_coarse_mesh } = adhesion;
    let Some((stage, step)) = checks.surfaces.coarsest.as_ref().filter(|_| !on_coarse_mesh) else {
        return Some(());
    };
    let number = mesh_number(*step, work, range, modulus);
    if number <= BISTABLE {
        return Some(());
    }
    let message = format!(
        "the mesh of stage `{stage}` is too coarse for the adhesion: Δx w/(E* ρ²) = {} exceeds π/2, \
         with the mesh step Δx, the work w and the range ρ",
        short(number)
    );
    let label = "single nodes would jump into contact";
    let problem = Problem::new(message, table.adhesion.written()?.span.clone(), label);
    checks.reject(problem.help(format!(
        "the mean pressure is accurate to 0.5 % up to {RESOLVED}: use {}; `override = true` in \
         `adhesion` solves anyway",
        resolution(number)
    )))
}

/// Largest factor by which a message advises to refine a mesh.
const LARGEST_REFINEMENT: f64 = 100.0;

/// Describes a mesh or a range for which a mesh number is reduced to [`RESOLVED`].
pub fn resolution(number: f64) -> String {
    let factor = number / RESOLVED;
    let range = format!("a range {} times as large", short(factor.sqrt()));
    if factor > LARGEST_REFINEMENT {
        return range;
    }
    format!("{} times as many nodes along each side, or {range}", factor.ceil())
}

/// Formats a number with two decimals, or a large one in scientific notation.
pub fn short(number: f64) -> String {
    if number < 1e4 { format!("{number:.2}") } else { format!("{number:.1e}") }
}

/// Mesh number Δx w/(E* ρ²) up to which the mean pressure is accurate to 0.5 %.
pub const RESOLVED: f64 = 0.3;

/// Returns the mesh number Δx w/(E* ρ²), the ratio of the mesh step to the length over which the
/// attraction deforms the body.
pub fn mesh_number(step: f64, work: f64, range: f64, modulus: f64) -> f64 {
    step * work / (modulus * range * range)
}

/// Refuses asperities with adhesion.
fn check_method(table: &SolveTable, checks: &mut Checks) -> Option<()> {
    if let Some(written) = table.method.written().filter(|word| word.value == Method::Asperities) {
        let message = "`method = \"asperities\"` and `adhesion` exclude each other";
        return checks.refuse("method", message, &written.span, "has no adhesion");
    }
    Some(())
}

/// Returns the loads in the order of the list. Loads may be negative and may repeat.
pub(in crate::solve) fn listed_loads(table: &SolveTable, checks: &mut Checks) -> Option<Vec<f64>> {
    let written = checks.required("loads", &table.loads)?;
    match &written.value {
        Loads::List(list) => {
            check_steps("loads", list, checks)?;
            // If the list has lost invalid items, its problems have been reported.
            let loads = list.iter().map(|load| decimal::nearest(load.value)).collect();
            Some(loads).filter(|_| !checks.is_reported("loads"))
        }
        Loads::Range(_) => Some(loads::loads(table, checks)?.0),
    }
}

/// Returns the mean gaps or the displacements of a contact without adhesion, in ascending order.
pub(super) fn lengths(
    control: Control,
    table: &SolveTable,
    checks: &mut StageChecks,
) -> Option<Vec<f64>> {
    let name = control.key();
    let key = if control == Control::Gap { &table.gaps } else { &table.displacements };
    let conversion = Conversion::of_lengths(checks)?;
    let mut lengths = listed_lengths(name, key, conversion, checks)?;
    lengths.sort_by(f64::total_cmp);
    let repeated = lengths.windows(2).find(|pair| decimal::is_same(pair[0], pair[1]));
    if let (Some(pair), Some(written)) = (repeated, key.written()) {
        let message = format!("`{name}` holds {} twice", decimal::written(pair[0]));
        return checks.refuse(name, message, &written.span, "must differ");
    }
    Some(lengths).filter(|_| !checks.is_reported(name))
}

/// Returns mean gaps or displacements in the order of the list, in the unit of the surfaces.
fn listed_lengths(
    name: &str,
    key: &Key<Gaps>,
    conversion: Conversion,
    checks: &mut Checks,
) -> Option<Vec<f64>> {
    let written = checks.required(name, key)?;
    let GapRange { from, to, steps } = match &written.value {
        Gaps::List(list) => {
            check_steps(name, list, checks)?;
            return Some(list.iter().map(|gap| conversion.length(gap.value)).collect());
        }
        Gaps::Range(range) => *range,
    };
    let last = f64::from(steps - 1);
    let gap = |step: u32| conversion.length(from + (to - from) * f64::from(step) / last);
    let gaps: Vec<f64> = (0..steps).map(gap).collect();
    if gaps.windows(2).any(|pair| decimal::is_same(pair[0], pair[1])) {
        let message =
            format!("{steps} {name} from {from:?} to {to:?} differ by no more than rounding");
        return checks.refuse(name, message, &written.span, "too many steps");
    }
    Some(gaps)
}

/// Refuses a state that equals the state before it.
fn check_steps(name: &str, list: &[Spanned<f64>], checks: &mut Checks) -> Option<()> {
    let repeated = list.windows(2).find(|pair| decimal::is_same(pair[0].value, pair[1].value));
    let Some([before, after]) = repeated else {
        return Some(());
    };
    let message = format!("`{name}` holds the same state twice in a row");
    let problem = Problem::new(message, after.span.clone(), "here again");
    checks.reject(problem.and(before.span.clone(), "first here").help("remove one of them"))
}

/// Returns whether the pressures and gaps of all states are stored.
fn keeps_maps(table: &SolveTable, checks: &mut Checks) -> Option<bool> {
    let label = "must be \"none\" or \"all\" with `adhesion`";
    Some(all_or_none(table, label, checks)? == Pressures::All)
}

/// Returns the stored pressure fields of states that no load identifies. Refuses a list with
/// `label`.
pub(super) fn all_or_none(
    table: &SolveTable,
    label: &str,
    checks: &mut Checks,
) -> Option<Pressures> {
    let Some(written) = checks.optional("pressures", &table.pressures)? else {
        return Some(Pressures::None);
    };
    match &written.value {
        StoredPressures::Word(pressures) => Some(pressures.clone()),
        StoredPressures::At(_) => {
            let message = "`pressures` cannot list states of a path";
            checks.refuse("pressures", message, &written.span, label)
        }
    }
}

/// Powers of ten that convert numbers of the manifest to the units of the surfaces. They are zero
/// for numbers without a unit, which are in these units already.
#[derive(Debug, Clone, Copy, Default)]
pub struct Conversion {
    length: i32,
    work: i32,
}

impl Conversion {
    /// Compares the units of a table with those of its surfaces and of its modulus, or returns
    /// `None` after reporting problems. `work` is the number of the work of adhesion.
    pub fn new(work: f64, checks: &mut StageChecks) -> Option<Conversion> {
        let units = checks.units;
        let (lengths, works) = match (&units.length, &units.work) {
            (None, None) => return Some(Conversion::default()),
            (Some(lengths), works) if works.is_some() || work == 0.0 => (lengths, works),
            (Some(lengths), _) => return one_has_none(["range", "work"], &lengths.span, checks),
            (None, Some(works)) => return one_has_none(["work", "range"], &works.span, checks),
        };
        let of_surfaces = unit_of(&lengths.span, checks)?;
        let length = lengths.unit.power - of_surfaces.power;
        let Some(works) = works else {
            return Some(Conversion { length, work: 0 });
        };
        let Some(pressures) = &units.pressure else {
            let message = "`adhesion.work` has a unit, but the modulus of the stage has none";
            let problem = Problem::new(message, works.span.clone(), "has a unit");
            return checks.reject(problem.help(
                "give E* with a unit, such as `effective_modulus = \"70 GPa\"`, or the `bodies`",
            ));
        };
        let work = works.unit.power - pressures.unit.power - of_surfaces.power;
        Some(Conversion { length, work })
    }

    /// Compares the unit of the lengths of a table with that of its surfaces, or returns `None`
    /// after reporting a problem.
    pub fn of_lengths(checks: &mut StageChecks) -> Option<Conversion> {
        let Some(lengths) = &checks.units.length else { return Some(Conversion::default()) };
        let of_surfaces = unit_of(&lengths.span, checks)?;
        Some(Conversion { length: lengths.unit.power - of_surfaces.power, work: 0 })
    }

    /// Converts a length of the manifest to the unit of the surfaces.
    pub fn length(self, length: f64) -> f64 {
        converted(length, self.length)
    }

    /// Converts a work per area to the unit of the modulus times the unit of the surfaces.
    pub fn work(self, work: f64) -> f64 {
        converted(work, self.work)
    }
}

/// Reports that the first of two keys of `adhesion` has a unit and the second has none.
fn one_has_none<T>([with, without]: [&str; 2], span: &Span, checks: &mut Checks) -> Option<T> {
    let message = format!("`adhesion.{with}` has a unit, but `adhesion.{without}` has none");
    let problem = Problem::new(message, span.clone(), "has a unit");
    checks.reject(problem.help(
        "write both with units, such as `adhesion = { work = \"50 mJ/m^2\", range = \"2 nm\" }`, \
         or neither",
    ))
}
