//! Keys of `solve` stages, and checks of their values.
//!
//! Editors show the doc comments of keys, and messages quote them.

pub mod adhesion;
pub mod against;
pub mod bodies;
mod loads;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::{NamedSurfaces, Property, StageChecks, exclude};
use crate::reduced_units::{GivenHardness, LoadUnit, PressureUnit};
use crate::solve::keys::adhesion::{AdhesionTable, Gaps, PathShape};
use crate::solve::keys::bodies::{
    Body, CounterBodyTable, LayerTable, SubstrateTable, bodies, layer, modulus,
};
use crate::solve::keys::loads::{GapBins, Loads, PressureBins, StoredPressures};
use crate::solve::{Control, ListedLoads, Params, Stiffness};
use crate::stage_points::{StagePoints, Work};
use crate::surface::pair::MirrorAxis;
use crate::surface::planned::PlannedSurfaces;
use crate::{CheckContext, Recipe, nominal_area, unloading};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::declare::{
    always_pair, length, load, pressure, pressure_or_ratio, swept, unit_of_pressures,
};
use asperity_manifest::keys::quantity::{self, Dimension};
use asperity_manifest::keys::{Key, OnAxes, Section, Spanned, table};
use asperity_mechanics::asperities::Interaction;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::solver::{DEFAULT_PAIR_LIMIT, DEFAULT_TOLERANCE};

/// Maximum value of `max_pairs`.
const MAX_PAIRS: u32 = 1_000_000;
/// Maximum number of loads, summed over all parameter points of a stage.
const MAX_LOADS_OF_STAGE: usize = 1_000_000;

/// Solution of the contact of surfaces under a sequence of loads.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolveTable {
    /// Loads (mean pressures), in the unit of `load_unit` or with a unit: a list such as `[0.01,
    /// 0.1]` or `["10 MPa", "20 MPa"]`, or a range `{ from, to, steps, spacing }`, which excludes
    /// `from` and includes `to`. Forces such as `["10 N", "20 N"]` are divided by the nominal area
    /// of each surface. A list is sorted, and repeated loads are solved once.
    #[schemars(transform = load)]
    pub loads: Key<Loads>,
    /// Effective modulus E* of the two bodies: 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂. All pressures of
    /// the stage have its unit. Give either this key or `bodies`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    #[schemars(transform = swept, transform = pressure)]
    pub effective_modulus: Key<f64>,
    /// Tolerance of the solver, a pure number. A load is solved when the largest gap in contact and
    /// the largest penetration outside contact, both divided by rms slope × mesh step, are at most
    /// this number. With `adhesion` the largest error of a pressure is at most this number, in
    /// units of E* × rms slope, and at most a hundredth of the largest attraction and of the load.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_TOLERANCE))]
    #[schemars(transform = swept)]
    pub tolerance: Key<f64>,
    /// Boundary condition at the edges of the cell.
    #[schemars(extend("default" = "periodic"), transform = swept)]
    pub boundary: Key<Boundary>,
    /// Hardness of the material, in the unit of `hardness_unit`: pressures are limited to it, and
    /// nodes that reach it yield. Every load must be below it. `path` follows loads
    /// that decrease. By default the material is elastic.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = swept, transform = pressure_or_ratio)]
    pub hardness: Key<f64>,
    /// Interaction of the asperities, for `method = "asperities"` only. The default is
    /// `"explicit"`.
    #[schemars(transform = swept)]
    pub interaction: Key<Interaction>,
    /// Materials of the two bodies, or of one elastic body that is pressed against a rigid one: `{
    /// youngs_modulus, poisson_ratio }`, optionally with `hardness`, `conductivity` and
    /// `resistivity`. Give either this key or `effective_modulus`.
    #[schemars(length(min = 1, max = 2))]
    pub bodies: Key<Vec<Spanned<Body>>>,
    /// Contact model of the stage: `"boundary-elements"` solves the contact of every node,
    /// `"asperities"` replaces the summits by Hertz contacts.
    #[schemars(extend("default" = "boundary-elements"))]
    pub method: Key<Method>,
    /// Unit of `loads` and of the list `pressures`: `"relative"` for multiples of E* × rms slope,
    /// `"absolute"` for the unit of the moduli, or a unit such as `"MPa"`, to which all pressures
    /// of the stage are converted and which plain numbers have. By default loads that are written
    /// with a unit determine the unit of all pressures, and plain loads are relative.
    #[schemars(extend("default" = "relative"), transform = unit_of_pressures)]
    pub load_unit: Key<LoadUnit>,
    /// Unit of the key `hardness`.
    #[schemars(extend("default" = "absolute"))]
    pub hardness_unit: Key<PressureUnit>,
    /// Maximum number of pairs of Fourier transforms per load. If a load needs more, the solver
    /// stops before it converges, and the row of the load records this. With `adhesion` the default
    /// is 20000, because the search for the load of pull-off counts as one load.
    #[schemars(range(min = 1, max = MAX_PAIRS), extend("default" = DEFAULT_PAIR_LIMIT))]
    pub max_pairs: Key<u32>,
    /// Pressure fields that are stored: `"none"`, `"all"`, or a list of loads, which must be among
    /// `loads`.
    #[schemars(extend("default" = "none"), transform = load)]
    pub pressures: Key<StoredPressures>,
    /// Histogram of the pressures under each load, `{ count, to }`: `count` equal bins from zero to
    /// the pressure `to`, in units of E* × rms slope or with a unit such as `"2 GPa"`, which needs
    /// surfaces of one given `rms_slope`. With `adhesion`, bins of the same width also extend down
    /// to −w/ρ. A `measure` stage with `what = "pressures"` reads it and needs no
    /// stored pressure fields. By default pressures are not counted.
    pub pressure_bins: Key<PressureBins>,
    /// Histogram of the gaps under each load, `{ count, to }`: `count` equal bins from zero to the
    /// gap `to`, in units of the rms height or with a unit such as `"2 um"`, which needs surfaces
    /// of one given `rms_height`. A `measure` stage with `what = "gaps"` reads it.
    /// Without `adhesion` it costs one pair of Fourier transforms per load. By default gaps are not
    /// counted.
    pub gap_bins: Key<GapBins>,
    /// Name of another `generate` stage whose surfaces are pressed against those of `from`. The
    /// heights of both are added node by node, and the sum is pressed against a flat body. Heights
    /// are positive towards the other body, and both maps have the same x and y axes. By default
    /// the other body is smooth.
    pub against: Key<String>,
    /// Lateral shift of the surfaces of `against` along x and y, as fractions of the sides, such as
    /// `[0.1, 0]`. A single number shifts them by this fraction along x and along y. The maps are
    /// continued periodically. By default they are not shifted.
    #[schemars(range(min = -1, max = 1), transform = always_pair, transform = swept)]
    pub shift: Key<OnAxes<f64>>,
    /// Axis along which the maps of `against` are reversed before they are shifted, `"x"` or `"y"`.
    /// Measured maps need it: an instrument sees each surface from its front, so one of two facing
    /// maps is mirrored. By default the maps of both stages have the same axes.
    pub mirror: Key<MirrorAxis>,
    /// `true` solves Reynolds' equation for the flow through the gap under each load, along x and
    /// along y. This takes 10 to 16 times as long as the contact and needs
    /// `boundary = "periodic"`.
    #[schemars(extend("default" = false))]
    pub flow: Key<bool>,
    /// `true` computes the stiffness of the contact under each load: the derivative of the mean
    /// pressure with respect to the approach of the bodies, exact on the mesh. With a `hardness`,
    /// the stiffness at the beginning of unloading is computed, too. Each takes up to twelve pairs
    /// of Fourier transforms per load. The contact conductance is proportional to the stiffness, or
    /// to that of unloading with a `hardness`. That of a `layer` with a `conductivity` or a
    /// `resistivity` is solved besides, in up to twenty pairs.
    #[schemars(extend("default" = false))]
    pub stiffness: Key<bool>,
    /// Elastic layer between the rough surface and a rigid base, `{ thickness, poisson_ratio, base
    /// }`, or a coating of the half-space `substrate`, `{ thickness, youngs_modulus, poisson_ratio
    /// }`. E* of the stage is then the modulus E/(1 − ν²) of the layer. By default the elastic body
    /// is a half-space.
    #[schemars(transform = swept)]
    pub layer: Key<LayerTable>,
    /// Half-space below a coating, `{ youngs_modulus, poisson_ratio }`, or `{ poisson_ratio }` for
    /// a `layer` with `modulus_ratio`.
    #[schemars(transform = swept)]
    pub substrate: Key<SubstrateTable>,
    /// Conductivity of the rigid rough body that is pressed into a `layer`, `{ conductivity }` or
    /// `{ resistivity }`. By default this body conducts perfectly.
    pub counter_body: Key<CounterBodyTable>,
    /// Attraction between the surfaces, `{ work, range }`. The states then form a path: each starts
    /// from the one before. `loads` keep their order, may be negative and may decrease again. By
    /// default the surfaces do not attract each other.
    #[schemars(transform = swept)]
    pub adhesion: Key<AdhesionTable>,
    /// Quantity that the contact prescribes: `"load"`, the mean pressure of `loads`; `"gap"`, the
    /// mean gap of `gaps`; or `"displacement"`, the rigid approach of the bodies of
    /// `displacements`, not with `adhesion`. Loads are then results, at two to three times the cost
    /// of a load.
    #[schemars(extend("default" = "load"))]
    pub control: Key<Control>,
    /// Mean gaps for `control = "gap"`: a list such as `["10 nm", "5 nm"]`, or a range `{ from, to,
    /// steps }`, which includes both ends. With `adhesion` they are in the order of the path. The
    /// surfaces first touch at the height of the highest node above the mean plane. Plain numbers
    /// are in the unit of the lengths of the surfaces.
    #[schemars(transform = length)]
    pub gaps: Key<Gaps>,
    /// Displacements for `control = "displacement"`: the rigid approach of the bodies since the
    /// first touch of the highest node, a list or a range `{ from, to, steps }`, which includes
    /// both ends. On a periodic half-space this is the approach of the mean planes, on a layer with
    /// its uniform compression, and with a free boundary that of distant points. Plain numbers are
    /// in the unit of the lengths of the surfaces.
    #[schemars(transform = length)]
    pub displacements: Key<Gaps>,
    /// Order of the states of a path, with `adhesion` or with a `hardness`: `"as-given"` follows
    /// the list, `"there-and-back"` then also follows it backwards. With a hardness, the surface
    /// keeps its plastic depth where the load decreases.
    pub path: Key<PathShape>,
}

table!(SolveTable);

/// A contact model, the value of `method`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The elastic contact of all nodes is solved with boundary elements.
    BoundaryElements,
    /// The summits are elliptic Hertz contacts.
    Asperities,
}

impl StagePoints for Section<SolveTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        Work::evaluate(recipes(self, context))
    }

    fn against(&self) -> Option<&Spanned<String>> {
        self.points.first()?.table.against.written()
    }

    fn pairs(
        &self,
        from: &[NamedSurfaces],
        against: NamedSurfaces,
        problems: &mut Problems,
    ) -> Option<Vec<PlannedSurfaces>> {
        against::pairs(self, from, against, problems)
    }
}

/// Returns the recipes of a stage, one for each parameter point, or `None` after reporting
/// problems.
fn recipes(section: &Section<SolveTable>, context: &mut CheckContext) -> Option<Vec<Recipe>> {
    check_hardness_unit(section, context.problems);
    let mut checked = Vec::with_capacity(section.points.len());
    let mut loads = 0;
    for point in &section.points {
        let checks = &mut StageChecks::new(section, point, context);
        let boundary = boundary(&point.table, &section.span, checks);
        let adhesion = checks.optional("adhesion", &point.table.adhesion);
        let clear = adhesion.and_then(|_| refuse_excluded(&point.table, checks));
        let recipes = match adhesion {
            None => None,
            Some(None) => elastic(&point.table, boundary, checks),
            Some(Some(adhesion)) => {
                adhesion::recipes(&point.table, adhesion.value, boundary, checks)
            }
        };
        loads += recipes.iter().flatten().map(|recipe| recipe.rows(0)).sum::<usize>();
        if loads > MAX_LOADS_OF_STAGE {
            let message = format!("the stage has more than {MAX_LOADS_OF_STAGE} loads");
            let label = "swept lists are combined with each other";
            return checks.reject(Problem::new(message, section.span.clone(), label));
        }
        checked.push(clear.and(recipes));
    }
    let points = checked.into_iter().collect::<Option<Vec<_>>>()?;
    check_same_conduction(section, &points, context.problems)?;
    report_equal_points(section, &points, context.problems);
    Some(points.concat())
}

/// Refuses points with layers of different conductivities, whose contacts no column would keep
/// apart.
fn check_same_conduction(
    section: &Section<SolveTable>,
    points: &[Vec<Recipe>],
    problems: &mut Problems,
) -> Option<()> {
    let of_layer = |recipe: &Recipe| match recipe {
        Recipe::Solve(params) => params.bodies.conduction,
        _ => None,
    };
    let conductions = || points.iter().flatten().map(of_layer);
    if conductions().all(|conduction| Some(conduction) == conductions().next()) {
        return Some(());
    }
    let message = "the layers of the stage have different conductivities";
    let problem = Problem::new(message, section.span.clone(), "has several layers");
    problems.push(problem.help(
        "give each conductivity in a stage of its own; loads with stored `pressures` are not solved \
         again",
    ));
    None
}

/// Refuses keys that other keys exclude.
fn refuse_excluded(table: &SolveTable, checks: &mut Checks) -> Option<()> {
    let lacks = |name: &str, is_written: bool| !is_written && !checks.is_reported(name);
    let adhesive = table.adhesion.written().is_some();
    let layered = table.layer.written().is_some();
    let is_half_space = lacks("layer", layered);
    let is_elastic = lacks("hardness", table.hardness.written().is_some());
    let is_alone = lacks("against", table.against.written().is_some());
    let control = table.control.value();
    let [by_gap, by_displacement] =
        [Control::Gap, Control::Displacement].map(|other| control == Some(other));
    let by_load = lacks("control", by_gap || by_displacement);
    let of_asperities = table.method.value() == Some(Method::Asperities);
    let of_nodes = lacks("method", of_asperities);
    let is_free = table.boundary.value() == Some(Boundary::Free);
    exclude! { table, checks,
        adhesive => hardness: "a material with a hardness is not combined with `adhesion`";
        adhesive => layer, stiffness, substrate, flow: "is not computed together with `adhesion`";
        adhesive || is_half_space => counter_body:
            "needs a `layer`; list the two bodies of other contacts in `bodies`";
        adhesive => interaction: "asperities have no adhesion here";
        adhesive && by_displacement => control: "a path with `adhesion` prescribes loads or gaps";
        by_gap => loads: "with `control = \"gap\"` the states are `gaps`";
        by_displacement => loads, gaps:
            "with `control = \"displacement\"` the states are `displacements`";
        by_load => gaps:
            "needs `control = \"gap\"`; with `control = \"load\"` the states are `loads`";
        by_load || by_gap => displacements: "needs `control = \"displacement\"`";
        !adhesive && (by_gap || by_displacement) => path: "unloading follows `loads`";
        of_asperities && (by_gap || by_displacement) => control: "asperities bear given `loads`";
        !adhesive && is_half_space => substrate:
            "needs a coating, `layer = { …, modulus_ratio = … }`";
        !adhesive && layered => path: "unloading is not combined with a `layer`";
        !adhesive && is_half_space && is_elastic => path:
            "needs `adhesion` or a `hardness`: other contacts unload along the curve of loading";
        !adhesive && of_nodes => interaction: "needs `method = \"asperities\"`";
        !adhesive && of_asperities => hardness: "Hertz contacts are elastic under any pressure";
        !adhesive && of_asperities => pressure_bins, gap_bins, flow, stiffness:
            "needs pressures and gaps at all nodes, which `method = \"asperities\"` does not solve \
             for";
        !adhesive && !of_asperities && is_free && table.flow.value() == Some(true) => flow:
            "the flow is solved in a periodic gap, and `boundary` is \"free\"";
        is_alone => shift, mirror: "needs the key `against`";
    }
}

/// Returns the recipes of a point without adhesion: one, or one for each branch of a path. If loads
/// are forces, each nominal area has its own.
fn elastic(
    table: &SolveTable,
    boundary: Option<Boundary>,
    checks: &mut StageChecks,
) -> Option<Vec<Recipe>> {
    let forces = loads::newtons(table, checks)?;
    let layer = boundary.and_then(|boundary| layer(table, boundary, checks))?;
    let given = Params { boundary: boundary?, layer, ..params(table, checks)? };
    let on_areas: Vec<Params> =
        forces.iter().map(|newtons| given.clone().under_forces(*newtons)).collect();
    // The smallest area has the largest pressures.
    if given.control.is_load() {
        check_bearing(table, on_areas.first()?, checks);
    }
    let path = checks.optional("path", &table.path)?;
    let Some(path) = path.filter(|_| given.control.is_load()) else {
        let recipes = on_areas.into_iter().map(|params| Recipe::Solve(Arc::new(params)));
        return Some(recipes.collect());
    };
    let listed = adhesion::listed_loads(table, checks)?;
    let recipes = on_areas.iter().flat_map(|params| {
        let states = path.value.states(nominal_area::pressures(&listed, params.newtons));
        let block = |(branch, loads)| {
            let branch = Some(branch);
            let listed =
                ListedLoads { is_unsorted: false, repeated: vec![], ..params.listed.clone() };
            Recipe::Solve(Arc::new(Params { branch, loads, listed, ..params.clone() }))
        };
        unloading::branches(&states).into_iter().map(block).collect::<Vec<_>>()
    });
    Some(recipes.collect())
}

/// Returns the boundary condition of the contact. Refuses a periodic contact of a map that is not
/// periodic.
fn boundary(table: &SolveTable, default: &Span, checks: &mut StageChecks) -> Option<Boundary> {
    let boundary = checks.value("boundary", &table.boundary)?;
    let open = checks.surfaces.stage_with(Property::Open);
    let Some(stage) = open.filter(|_| boundary == Boundary::Periodic) else {
        return Some(boundary);
    };
    let message = format!(
        "the map of stage `{stage}` is not periodic, but its contact is solved as periodic"
    );
    let (span, label) = match table.boundary.written() {
        Some(written) => (&written.span, "`boundary` is \"periodic\" here"),
        None => (default, "`boundary` is \"periodic\" by default"),
    };
    let problem = Problem::new(message, span.clone(), label);
    checks.reject(problem.help(format!(
        "`boundary = \"free\"` presses the map as an isolated patch; `edges = \"mirror\"` or \
         `\"taper\"` in stage `{stage}` makes it periodic"
    )))
}

fn params(table: &SolveTable, checks: &mut StageChecks) -> Option<Params> {
    let effective_modulus = modulus(table, checks);
    let control = checks.value("control", &table.control)?;
    let loads = if control.is_load() {
        loads::loads(table, checks)
    } else {
        adhesion::lengths(control, table, checks).map(|lengths| (lengths, ListedLoads::default()))
    };
    let load_unit = load_unit(table, checks);
    let hardness = hardness(table, checks);
    let tolerance = checks.number("tolerance", &table.tolerance);
    let max_pairs = checks.value("max_pairs", &table.max_pairs);
    let all = loads.as_ref().map(|(loads, _)| loads.as_slice());
    let pressures = if control.is_load() {
        loads::pressures(table, all, checks)
    } else {
        adhesion::all_or_none(table, "must be \"none\" or \"all\" with this `control`", checks)
    };
    let pressure_bins = loads::pressure_bins(table, effective_modulus, all, checks);
    let gap_bins = loads::gap_bins(table, all, checks);
    let flow = checks.value("flow", &table.flow);
    let stiffness = checks.value("stiffness", &table.stiffness);
    let bodies = bodies(table, checks);
    let asperities = asperities(table, checks);
    let shift = against::shift(table, checks);
    let conduction = bodies.as_ref().and_then(|bodies| bodies.conduction);
    let (loads, listed) = loads?;
    let load_unit = load_unit?;
    if control.is_load() && load_unit == PressureUnit::Relative {
        check_samples(table, checks)?;
    }
    let lack_unit = control.is_load() && lack_unit(table, load_unit, checks);
    let listed = ListedLoads { lack_unit, ..listed };
    let hardness = hardness?;
    let stiffness = match (stiffness?, hardness) {
        (false, _) => Stiffness::None,
        (true, None) => Stiffness::Loading,
        (true, Some(_)) => Stiffness::LoadingAndUnloading,
    };
    Some(Params {
        effective_modulus: effective_modulus?,
        control,
        load_unit,
        pressure_unit: checks.units.pressure.as_ref().map(|named| named.unit.symbol),
        loads,
        listed,
        tolerance: tolerance?,
        max_pairs: max_pairs?,
        pressures: pressures?,
        hardness,
        pressure_bins: pressure_bins?,
        gap_bins: gap_bins?,
        layer_conduction: conduction.and_then(|conduction| conduction.layer),
        bodies: bodies?,
        flow: flow?,
        stiffness,
        asperities: asperities?,
        shift: shift?,
        ..Params::default()
    })
}

/// Refuses loads in units of E* × rms slope on samples of different sides or steps. Their slopes
/// are those of different bands of wavelengths, so that equal loads are no equal pressures.
fn check_samples(table: &SolveTable, checks: &mut StageChecks) -> Option<()> {
    let (Some(stage), Some(loads)) =
        (checks.surfaces.stage_with(Property::UnequalSamples), table.loads.written())
    else {
        return Some(());
    };
    let message = format!(
        "the samples of `{stage}` have different sides or steps, and loads are in units of E* × \
         rms slope"
    );
    let label = "the rms slope of each scan depends on its step";
    checks.reject(Problem::new(message, loads.span.clone(), label).help(
        "give loads with a unit, such as \"10 MPa\", and a modulus with a unit, so that all scans \
         are under equal pressures; or give all scans the same `crop` and `resample`",
    ))
}

/// Returns whether plain loads are read in units of E* × rms slope only because `load_unit` is left
/// out, although other pressures of the stage have a unit.
pub(super) fn lack_unit(table: &SolveTable, unit: PressureUnit, checks: &Checks) -> bool {
    let is_default = unit == PressureUnit::Relative && table.load_unit.written().is_none();
    is_default && checks.units.pressure.is_some()
}

/// Returns the unit of the loads. Loads with a unit are absolute. Refuses pressures without a unit
/// beside pressures with one, unless `load_unit` names the unit.
pub(super) fn load_unit(table: &SolveTable, checks: &mut Checks) -> Option<PressureUnit> {
    let word = checks.value("load_unit", &table.load_unit)?;
    let written = match word {
        LoadUnit::Relative => PressureUnit::Relative,
        _ => PressureUnit::Absolute,
    };
    let Some(named) = &checks.units.pressure else {
        return Some(written);
    };
    let symbol = named.unit.symbol;
    let of_layer = table.layer.written().and_then(|layer| layer.value.youngs_modulus.written());
    let has_modulus = table.effective_modulus.written().is_some()
        || table.bodies.written().is_some()
        || of_layer.is_some();
    let is_reported = ["effective_modulus", "bodies", "layer"].map(|key| checks.is_reported(key));
    if !has_modulus && !is_reported.contains(&true) {
        let message = "pressures have a unit, but the stage has no modulus";
        let problem = Problem::new(message, named.span.clone(), "has a unit");
        return checks.reject(problem.help(
            "give E* with a unit, such as `effective_modulus = \"70 GPa\"`, or the `bodies`",
        ));
    }
    let loads = loads::given(table);
    let has_unit = |value: &&&Spanned<f64>| checks.units.is_quantity(&value.span);
    let absolute = loads.iter().find(has_unit).map(|load| load.span.clone());
    if absolute.is_none() && word != LoadUnit::Absolute {
        return Some(written);
    }
    if let (LoadUnit::Relative, Some(written), Some(absolute)) =
        (word, table.load_unit.written(), &absolute)
    {
        let dimension = checks.units.dimension_of(absolute).unwrap_or(Dimension::Pressure);
        let message = format!("`load_unit` is \"relative\", but a load has a unit of {dimension}");
        let problem =
            Problem::new(message, written.span.clone(), "loads in units of E* × rms slope");
        let help = format!("remove `load_unit`, or set `load_unit = \"{symbol}\"`");
        return checks.reject(problem.and(absolute.clone(), "has a unit").help(help));
    }
    let is_plain = |load: &&&Spanned<f64>| !has_unit(load) && load.value != 0.0;
    if let Some(plain) = loads.iter().find(is_plain).filter(|_| !named.by_key) {
        let number = decimal::written(plain.value);
        let (other, span) = match absolute {
            Some(span) => ("another load", span),
            None => ("another pressure", named.span.clone()),
        };
        let message = format!("the load {number} has no unit, but {other} has one");
        let label = format!("write \"{number} {symbol}\" if it is in {symbol}");
        let problem = Problem::new(message, plain.span.clone(), label).and(span, "has a unit");
        return checks.reject(problem.help(format!(
            "or set `load_unit = \"{symbol}\"`, which is then the unit of all numbers without a unit"
        )));
    }
    Some(PressureUnit::Absolute)
}

/// Refuses a hardness that is a pressure with a unit where `hardness_unit` is relative, and a
/// hardness without a unit beside pressures that have one.
fn check_unit_of_hardness(
    hardness: &Spanned<f64>,
    unit: PressureUnit,
    checks: &mut Checks,
) -> Option<()> {
    let Some(named) = &checks.units.pressure else {
        return Some(());
    };
    let symbol = named.unit.symbol;
    let number = decimal::written(hardness.value);
    let (message, label) = match (unit, checks.units.is_quantity(&hardness.span)) {
        (PressureUnit::Relative, true) => (
            "`hardness` has a unit, but `hardness_unit` is \"relative\"".to_owned(),
            "remove `hardness_unit`".to_owned(),
        ),
        (PressureUnit::Absolute, false) if !named.by_key => (
            "`hardness` has no unit, but another pressure has one".to_owned(),
            format!("write \"{number} {symbol}\" if it is in {symbol}"),
        ),
        _ => return Some(()),
    };
    checks.refuse("hardness", message, &hardness.span, label)
}

/// Returns the interaction of the asperities, or no interaction for boundary elements.
fn asperities(table: &SolveTable, checks: &mut Checks) -> Option<Option<Interaction>> {
    if checks.value("method", &table.method)? != Method::Asperities {
        return Some(None);
    }
    let free = table.boundary.written().filter(|written| written.value == Boundary::Free);
    if let Some(written) = free {
        let message = "asperities are pressed in a periodic cell, and `boundary` is \"free\"";
        let label = "must be \"periodic\" with `method = \"asperities\"`";
        return checks.refuse("boundary", message, &written.span, label);
    }
    Some(Some(table.interaction.value().unwrap_or(Interaction::Explicit)))
}

/// Refuses a `hardness_unit` other than the default if no parameter point has a hardness.
fn check_hardness_unit(section: &Section<SolveTable>, problems: &mut Problems) {
    let is_given = |table: &SolveTable| table.hardness.written().is_some();
    if section.points.iter().any(|point| is_given(&point.table)) {
        return;
    }
    for point in &section.points {
        let checks = &mut Checks::new(section, point, problems);
        let unit = point.table.hardness_unit.value();
        let is_other = unit.is_some_and(|unit| unit != checks.default_of("hardness_unit"));
        if is_other && !checks.is_reported("hardness") {
            exclude! { &point.table, checks, true => hardness_unit: "needs the key `hardness`"; };
        }
    }
}

/// Returns the hardness of the material, or `Some(None)` if the material is elastic.
fn hardness(table: &SolveTable, checks: &mut Checks) -> Option<Option<GivenHardness>> {
    let pressure = checks.optional_number("hardness", &table.hardness)?;
    let unit = checks.value("hardness_unit", &table.hardness_unit)?;
    if let Some(written) = table.hardness.written() {
        check_unit_of_hardness(written, unit, checks)?;
    }
    Some(pressure.map(|pressure| GivenHardness { pressure, unit }))
}

/// Reports a largest load that is not below the hardness. Hardness and load in different units are
/// compared with the rms slopes to which the surfaces are scaled, if these are known.
fn check_bearing(table: &SolveTable, params: &Params, checks: &mut StageChecks) {
    let (Some(hardness), Some(&largest)) = (params.hardness, params.loads.last()) else {
        return;
    };
    let given =
        if hardness.unit == params.load_unit { Some([1.0; 2]) } else { checks.surfaces.slopes };
    let pressure = |value: f64, unit: PressureUnit, slope: f64| match unit {
        PressureUnit::Absolute => value,
        PressureUnit::Relative => decimal::nearest(value * params.effective_modulus * slope),
    };
    let of_load = |slope: f64| pressure(largest, params.load_unit, slope);
    let of_hardness = |slope: f64| pressure(hardness.pressure, hardness.unit, slope);
    let mut slopes = given.into_iter().flatten();
    let Some(slope) = slopes.find(|slope| of_load(*slope) >= of_hardness(*slope)) else {
        return;
    };
    let shown = |value: f64, unit: PressureUnit| match unit {
        PressureUnit::Relative => decimal::written(value),
        PressureUnit::Absolute => quantity::written(value, params.pressure_unit),
    };
    let message = format!(
        "`loads` holds {}, but `hardness` is {}",
        shown(largest, params.load_unit),
        shown(hardness.pressure, hardness.unit)
    );
    let Some((load, written)) = span_of_largest_load(table).zip(table.hardness.written()) else {
        return;
    };
    let limit = of_hardness(slope) / pressure(1.0, params.load_unit, slope);
    let problem = Problem::new(message, load, "load that is not below the hardness")
        .and(written.span.clone(), "the hardness");
    checks.problems.push(problem.help(format!(
        "a material yields everywhere under a mean pressure equal to its hardness; each load must be \
         below {} here",
        shown(decimal::nearest(limit), params.load_unit)
    )));
}

/// Returns the position of the largest load in the manifest.
fn span_of_largest_load(table: &SolveTable) -> Option<Span> {
    match &table.loads.written()?.value {
        Loads::List(list) => {
            let largest = list.iter().max_by(|one, other| one.value.total_cmp(&other.value));
            Some(largest?.span.clone())
        }
        Loads::Range(range) => Some(range.to.span.clone()),
    }
}
