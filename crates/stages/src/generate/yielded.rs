//! Keys of surfaces that have yielded: the residual surfaces of `solve` stages with a hardness.
//!
//! Editors show the doc comments of keys, and messages quote them.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::PressedStage;
use crate::reduced_units::{GivenHardness, PressureUnit};
use crate::stage_points::{StagePoints, Work};
use crate::surface::pair::Yielded;
use crate::surface::planned::PlannedSurfaces;
use crate::surface::{Heights, Origin, Params};
use crate::unloading::Branch;
use crate::{CheckContext, Reads, Recipe, RowKind, Stage as _, nominal_area, solve};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_manifest::keys::{Key, Section, declare, table};

/// Surfaces that keep their plastic depth after a `solve` stage with a `hardness`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct YieldedTable {
    /// Load that presses the surfaces before they are used: one of the `loads` of the stage in
    /// `from`, in their unit. The default is the largest of them.
    #[schemars(extend("exclusiveMinimum" = 0), transform = declare::swept)]
    #[schemars(transform = declare::load)]
    pub load: Key<f64>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` solves the contact
    /// again when needed.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(YieldedTable);

/// Contact of a `solve` stage in which surfaces yield.
#[derive(Clone, Copy)]
struct Yielding<'a> {
    stage: &'a PressedStage<'a>,
    contact: &'a solve::Params,
    hardness: GivenHardness,
}

impl StagePoints for Section<YieldedTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        surfaces(self, context).map(Work::Generate)
    }

    fn reads(&self) -> Option<Reads> {
        let from = "`solve` stages, where its method is `yielded`".into();
        Some(Reads { rows: &[RowKind::Loads], from })
    }
}

/// Returns the surfaces of a stage with `method = "yielded"`, or `None` after reporting problems.
fn surfaces(
    section: &Section<YieldedTable>,
    context: &mut CheckContext,
) -> Option<Vec<PlannedSurfaces>> {
    let (stages, problems) = (&context.pressed, &mut *context.problems);
    let of_stages: Vec<_> = stages.iter().map(|stage| contacts(stage, problems)).collect();
    let contacts = of_stages.into_iter().collect::<Option<Vec<_>>>()?.concat();
    if contacts.is_empty() {
        // All stages in `from` have problems, which have been reported.
        return None;
    }
    let mut points = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let checks = &mut Checks::new(section, point, problems);
        let heights = checks.value("heights", &point.table.heights)?;
        let mut planned: Vec<PlannedSurfaces> = Vec::new();
        for yielding in &contacts {
            let load = yielding.load(&point.table, checks)?;
            planned.extend(yielding.surfaces(load, heights));
        }
        points.push(planned);
    }
    let params = |planned: &Vec<PlannedSurfaces>| -> Vec<Params> {
        planned.iter().map(|surfaces| surfaces.params.clone()).collect()
    };
    let params: Vec<Vec<Params>> = points.iter().map(params).collect();
    report_equal_points(section, &params, problems);
    Some(points.concat())
}

/// Returns the contacts of a stage in which surfaces yield, one for each hardness, or `None` after
/// reporting problems.
fn contacts<'a>(stage: &'a PressedStage<'a>, problems: &mut Problems) -> Option<Vec<Yielding<'a>>> {
    match check(stage) {
        Ok(contacts) => Some(contacts),
        Err(problem) => {
            problems.push(*problem);
            None
        }
    }
}

fn check<'a>(stage: &'a PressedStage<'a>) -> Result<Vec<Yielding<'a>>, Box<Problem>> {
    let name = stage.name.value.as_str();
    let problem = |message: String, label: &str, help: &str| {
        let problem = Problem::new(message, stage.name.span.clone(), label);
        Err(Box::new(problem.help(help)))
    };
    let mut contacts: Vec<Yielding> = Vec::new();
    for recipe in stage.recipes {
        let contact = match recipe {
            Recipe::Solve(contact) => contact.as_ref(),
            _ => {
                let label = "surfaces with `adhesion` are elastic";
                let help = "name a `solve` stage with a `hardness`";
                return problem(format!("the surfaces of `{name}` do not yield"), label, help);
            }
        };
        let Some(hardness) = contact.hardness else {
            let help = "set `hardness` in that stage: elastic surfaces keep their heights";
            let message = format!("the surfaces of `{name}` do not yield");
            return problem(message, "this stage has no `hardness`", help);
        };
        if contact.layer.is_some() {
            let help = "unloading is not combined with a `layer`";
            let message = format!("the surfaces of `{name}` lie on a layer");
            return problem(message, "this stage has a `layer`", help);
        }
        if !contact.control.is_load() {
            let help = "press them under `loads` in another stage";
            let message = format!("`{name}` prescribes {}", contact.control.key());
            return problem(message, "needs a stage with `loads`", help);
        }
        if matches!(contact.branch, Some(Branch::Unloading(_))) {
            continue;
        }
        let is_same = |other: &&Yielding| {
            (other.hardness, other.contact.shift, other.contact.newtons)
                == (hardness, contact.shift, contact.newtons)
        };
        if contacts.iter().any(|other| is_same(&other)) {
            let help = "tables tell surfaces that have yielded apart by load and hardness; give \
                        each value of the other keys its own `solve` stage";
            let message = format!("`{name}` has several contacts with the same hardness");
            return problem(message, "sweeps another key than `hardness`", help);
        }
        contacts.push(Yielding { stage, contact, hardness });
    }
    for surfaces in &stage.surfaces {
        let origin = &surfaces.params.origin;
        if origin.has_yielded() {
            let help = "press the surface further in a single `solve` stage: the plastic depth \
                        depends on the largest load only";
            let message = format!("the surfaces of `{name}` have yielded before");
            return problem(message, "reads surfaces with `method = \"yielded\"`", help);
        }
        if origin.reads_stage() {
            let help = "write the spectrum to a file and name it by `path` in the stage of the \
                        surfaces";
            let message = format!("the surfaces of `{name}` cannot be drawn again");
            return problem(message, "their spectrum is measured in this study", help);
        }
        if let Some(growth) = &surfaces.growth {
            let label = format!("presses surfaces until {}", growth.until);
            let message = "the number of surfaces that yield must be fixed".to_owned();
            return problem(message, &label, "set `realizations` to a number");
        }
    }
    Ok(contacts)
}

/// Creates the first surface of a parameter point that has yielded under a load of a contact.
fn yielded(body: &Params, hardness: GivenHardness, load: f64, contact: &solve::Params) -> Yielded {
    Yielded {
        body: Box::new(body.realization(0).with(Heights::Redraw)),
        load,
        load_unit: contact.load_unit,
        hardness,
        effective_modulus: contact.effective_modulus,
        tolerance: contact.tolerance,
        max_pairs: contact.max_pairs,
        boundary: contact.boundary,
        solve_version: solve::VERSION.number(),
    }
}

impl Yielding<'_> {
    /// Returns the load of a point: the given one, or the largest load of the contact. Refuses a
    /// load that the contact does not solve.
    fn load(&self, table: &YieldedTable, checks: &mut Checks) -> Option<f64> {
        let (contact, name) = (self.contact, &self.stage.name.value);
        let Some(written) = checks.optional("load", &table.load)? else {
            return contact.loads.last().copied();
        };
        let unit = contact.unit_of_loads();
        let dimension = checks.units.dimension_of(&written.span);
        let value = match (&checks.units.pressure, dimension) {
            (_, Some(Dimension::Force)) => {
                let Some(newtons) = contact.newtons else {
                    let message = format!("`load` is a force, but the loads of `{name}` are not");
                    let label = "must be one of these loads";
                    return checks.refuse("load", message, &written.span, label);
                };
                nominal_area::pressure(written.value, newtons)
            }
            (Some(named), Some(_)) => {
                let Some(to) = unit.and_then(Unit::find) else {
                    let message = format!("`load` has a unit, but the loads of `{name}` have none");
                    let label = match contact.load_unit {
                        PressureUnit::Relative => "must be in units of E* × rms slope",
                        PressureUnit::Absolute => "must be a number in the unit of the modulus",
                    };
                    return checks.refuse("load", message, &written.span, label);
                };
                decimal::nearest(written.value * named.unit.factor_to(to))
            }
            _ => decimal::nearest(written.value),
        };
        let distance = |load: &&f64| (**load - value).abs();
        let nearest = contact.loads.iter();
        let nearest = *nearest.min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
        if decimal::is_same(nearest, value) {
            return Some(nearest);
        }
        let shown = |load: f64| contact.written_load(load);
        let message = format!("`loads` of `{name}` does not contain {}", shown(value));
        let label = format!("the nearest load is {}", shown(nearest));
        checks.refuse("load", message, &written.span, label)
    }

    /// Returns the surfaces that have yielded under a load.
    fn surfaces(&self, load: f64, heights: Heights) -> impl Iterator<Item = PlannedSurfaces> {
        let is_pressed = |surfaces: &&&PlannedSurfaces| {
            self.contact.reads_input(&Recipe::Generate(surfaces.params.clone()))
        };
        let pressed = self.stage.surfaces.iter().filter(is_pressed);
        pressed.map(move |surfaces| {
            let yielded = yielded(&surfaces.params, self.hardness, load, self.contact);
            PlannedSurfaces {
                params: Params { heights, side: None, origin: Origin::Yielded(Box::new(yielded)) },
                realizations: surfaces.realizations,
                growth: None,
                sample: surfaces.sample,
                may_be_swept: false,
            }
        })
    }
}
