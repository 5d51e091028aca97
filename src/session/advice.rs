//! Advice on extending fits of limits, in which small parameters tend to zero.
//!
//! The advice estimates the cost of halving a small parameter once more (one octave), and the
//! expected reduction of the standard error of the limit.

use std::collections::BTreeMap;

use serde::Serialize;

use super::SessionError;
use super::status::in_hours;
use asperity_manifest::expression::Expression;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::{Plan, PlannedStage};
use asperity_pipeline::results::StudyResults;
use asperity_stages::columns::{COEFFICIENT, K_ROLLOFF, LOAD, NODES, NODES_X, NODES_Y};
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::fit;
use asperity_stages::fit::laws::Law;
use asperity_stages::fit::limits::{self, FitWithOctaves, Octave};
use asperity_stages::fit::limits::{LimitChoices, ObservedGroup, groups};
use asperity_stages::units::TableUnits;
use asperity_stages::{Kind, Recipe};
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// Advice for all fits of limits of a study.
#[derive(Debug)]
pub(crate) struct StudyAdvice {
    pub(crate) fits: Vec<AdvisedFit>,
    /// Number of fits without advice, because they have too few points or are not computed.
    pub(crate) without: usize,
}

/// One fit with the possible extensions.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct AdvisedFit {
    pub stage: String,
    /// Quantity and parameters, such as `area_fraction / load, load 0.02, hurst 0.8`.
    pub what: String,
    /// Fitted function of each small parameter. If several laws were fitted, it belongs to the law
    /// with the smallest Akaike criterion.
    pub forms: Vec<String>,
    pub limit: f64,
    /// Unit of the limit, if the quantity is a column and the study names units.
    pub unit: Option<String>,
    /// Bootstrap standard error of the limit; `None` without a bootstrap.
    pub standard_error: Option<f64>,
    /// Number of points of the fit.
    pub points: usize,
    pub steps: Vec<AdvisedStep>,
}

/// One possible extension of a fit.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct AdvisedStep {
    /// Small parameter that is halved; `None` for doubling the number of surfaces.
    pub term: Option<String>,
    /// Names of the parameters in the manifest that are doubled in order to halve `term`.
    pub doubled: Vec<String>,
    /// Number of additional points to compute.
    pub points: usize,
    /// Expected core-seconds of these points.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
    /// Expected ratio of the new standard error of the limit to the present one.
    pub factor: Option<f64>,
}

impl AdvisedStep {
    /// Returns the decrease of ln(standard error) per core-hour, −ln(`factor`)/cost. Returns `None`
    /// if the step has no cost, or if it does not reduce the standard error.
    pub(crate) fn gain(&self) -> Option<f64> {
        let factor = self.factor.filter(|factor| *factor < 1.0)?;
        (self.seconds > 0.0).then(|| -factor.ln() / (self.seconds / 3600.0))
    }
}

impl StudyAdvice {
    /// Estimates, for each fit of limits of the study or of one stage, the cost and the gain of
    /// halving each of its small parameters once more.
    ///
    /// # Errors
    /// Returns an error if a table is damaged.
    pub(super) fn new(
        reading: &StudyResults,
        stage: Option<&str>,
    ) -> Result<StudyAdvice, SessionError> {
        let mut advice = StudyAdvice { fits: Vec::new(), without: 0 };
        for (index, planned) in reading.plan.stages.iter().enumerate() {
            let is_wanted = stage.is_none_or(|name| name == planned.name);
            if planned.kind == Kind::Fit && is_wanted {
                add_stage(reading, index, planned, &mut advice)?;
            }
        }
        Ok(advice)
    }
}

fn add_stage(
    reading: &StudyResults,
    index: usize,
    stage: &PlannedStage,
    advice: &mut StudyAdvice,
) -> Result<(), SessionError> {
    let plan = &reading.plan;
    let limits = stage.tasks.iter().filter_map(|&task| {
        let Recipe::Fit(params) = &plan.tasks[task].recipe else { return None };
        let Law::Limits(choices) = &params.law else { return None };
        Some((task, params.as_ref(), choices.as_ref()))
    });
    let recipes: Vec<(usize, &fit::Params, &LimitChoices)> = limits.collect();
    if recipes.is_empty() {
        return Ok(());
    }
    let Some(table) = stacked(reading, &reading.study.stages[index].inputs)? else {
        advice.without += recipes.len();
        return Ok(());
    };
    let units = reading.study.units_of(&stage.name);
    for (task, params, choices) in recipes {
        let costs = Costs::new(plan, task, choices);
        let unit = match &choices.of {
            Expression::Column(name) => {
                let field = table.batch().schema_ref().field_with_name(name);
                field.ok().and_then(|field| units.shown_of(field))
            }
            _ => None,
        };
        for group in groups(&table, choices, params.window())? {
            for &load in &group.loads {
                match limits::advise(&group, load, choices, &params.bootstrap()) {
                    Some(advised) => advice.fits.push(AdvisedFit {
                        stage: stage.name.clone(),
                        what: description(&table, &group, load, choices, &units),
                        forms: advised.forms.iter().map(|form| form.word()).collect(),
                        limit: advised.fit.limit,
                        unit: unit.clone(),
                        standard_error: advised.standard_error,
                        points: advised.points.len(),
                        steps: steps(&advised, &costs),
                    }),
                    None => advice.without += 1,
                }
            }
        }
    }
    Ok(())
}

/// Reads the rows of several stages as one table; `None` if no stage has rows.
pub(super) fn stacked(
    reading: &StudyResults,
    stages: &[usize],
) -> Result<Option<Table>, SessionError> {
    let mut tables = Vec::new();
    for &stage in stages {
        tables.extend(reading.rows(&reading.plan.stages[stage])?.table);
    }
    Ok(if tables.is_empty() { None } else { Some(Table::stack(&tables)?) })
}

/// Returns the description of a fit: its quantity, its load if it has one, and the parameters that
/// distinguish the fit from the other fits of the table.
fn description(
    table: &Table,
    group: &ObservedGroup,
    load: Option<f64>,
    choices: &LimitChoices,
    units: &TableUnits,
) -> String {
    let parameters = table.in_role(Role::Parameter);
    let own = ParameterPoint::from_row(&parameters, group.row);
    let all = ParameterPoint::from_row(&parameters.common(), 0);
    let over: Vec<&str> = choices.over.iter().map(String::as_str).collect();
    let distinct = own.beyond(&all).without(&over).without(&[K_ROLLOFF.name, COEFFICIENT.name]);
    let load_unit = units.shown(LOAD.unit).map_or_else(String::new, |unit| format!(" {unit}"));
    let at_load = load.map(|load| format!("load {load}{load_unit}"));
    let distinct = Some(distinct.to_string()).filter(|text| !text.is_empty());
    let parts = [Some(choices.of.to_string()), at_load, distinct];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn steps(advised: &FitWithOctaves, costs: &Costs) -> Vec<AdvisedStep> {
    let again = AdvisedStep {
        term: None,
        doubled: vec!["realizations".to_owned()],
        points: advised.points.len(),
        seconds: advised.points.iter().map(|point| costs.seconds_of(point, &[])).sum(),
        factor: Some(0.5_f64.sqrt()),
    };
    let step = |octave: &Octave| AdvisedStep {
        term: Some(octave.term.clone()),
        doubled: octave.doubled.clone(),
        points: octave.from.len(),
        seconds: octave.from.iter().map(|point| costs.seconds_of(point, &octave.doubled)).sum(),
        factor: octave.error_ratio,
    };
    advised.octaves.iter().map(step).chain([again]).collect()
}

/// Costs of the tasks that a fit depends on, grouped by parameter point.
struct Costs<'a> {
    plan: &'a Plan,
    model: CostModel,
    /// Task indices by parameter point; a point contains only the parameters that the fit varies.
    tasks: BTreeMap<ParameterPoint, Vec<usize>>,
}

impl<'a> Costs<'a> {
    fn new(plan: &'a Plan, fit: usize, choices: &LimitChoices) -> Costs<'a> {
        let over: Vec<&str> = choices.over.iter().map(String::as_str).collect();
        let mut is_read = vec![false; plan.tasks.len()];
        is_read[fit] = true;
        for task in (0..=fit).rev() {
            if is_read[task] {
                let inputs = &plan.tasks[task].inputs;
                inputs.iter().for_each(|&input| is_read[input] = true);
            }
        }
        let mut points: Vec<ParameterPoint> = Vec::with_capacity(fit);
        let mut tasks: BTreeMap<ParameterPoint, Vec<usize>> = BTreeMap::new();
        for (index, task) in plan.tasks.iter().enumerate().take(fit) {
            let above = task.inputs.first().map(|&input| points[input].clone());
            let own = ParameterPoint::from_cells(task.recipe.coordinates());
            let point = above.unwrap_or_default().and(own).only(&over);
            // Fits that are inputs of this fit use all surfaces; their cost is negligible.
            if is_read[index] && task.recipe.kind() != Kind::Fit {
                tasks.entry(point.clone()).or_default().push(index);
            }
            points.push(point);
        }
        Costs { plan, model: CostModel::default(), tasks }
    }

    /// Returns the expected core-seconds of all tasks of a parameter point after doubling the
    /// parameters `doubled`.
    fn seconds_of(&self, point: &ParameterPoint, doubled: &[String]) -> f64 {
        let factor = |name: &str| if doubled.iter().any(|one| one == name) { 2 } else { 1 };
        let both = factor(NODES.name);
        let factors = [both * factor(NODES_X.name), both * factor(NODES_Y.name)];
        let tasks = self.tasks.get(point).into_iter().flatten();
        let seconds = tasks.map(|&task| {
            let task = &self.plan.tasks[task];
            let nodes = [0, 1].map(|axis| task.nodes[axis] * factors[axis]);
            self.model.seconds_on(task, nodes)
        });
        seconds.sum()
    }
}
