//! Where a study of limits should go on: what one more octave towards each limit costs, and by how
//! much it narrows the limit's interval.

use std::collections::BTreeMap;

use serde::Serialize;

use super::status::in_hours;
use super::{Session, SessionError};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::{Plan, PlannedStage};
use asperity_pipeline::results::StudyResults;
use asperity_stages::columns::{COEFFICIENT, K_ROLLOFF, NODES, NODES_X, NODES_Y};
use asperity_stages::ensemble::Point;
use asperity_stages::fit;
use asperity_stages::fit::laws::Law;
use asperity_stages::fit::limits::octaves::{self, Advised, Octave};
use asperity_stages::fit::limits::{Group, LimitChoices, groups};
use asperity_stages::{Kind, Recipe};
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// What is advised of all fits of limits of a study.
#[derive(Debug)]
pub struct StudyAdvice {
    /// Fit after fit.
    pub fits: Vec<AdvisedFit>,
    /// Fits of limits whose points are too few as yet, or not computed.
    pub without: usize,
}

/// One fit, and what would narrow its interval.
#[derive(Debug, Serialize)]
pub struct AdvisedFit {
    pub stage: String,
    /// What has a limit, and where: `area_fraction / load, load 0.02, hurst 0.8`.
    pub what: String,
    /// The form of each term, of those that are compared the ones with the least of Akaike's criterion.
    pub forms: Vec<String>,
    pub limit: f64,
    /// Its standard error by resampling; none without.
    pub standard_error: Option<f64>,
    /// Points of the fit.
    pub points: usize,
    pub steps: Vec<AdvisedStep>,
}

/// One way to go on.
#[derive(Debug, Serialize)]
pub struct AdvisedStep {
    /// The small number that is halved; none for as many surfaces again.
    pub term: Option<String>,
    /// The parameters that are doubled.
    pub doubled: Vec<String>,
    /// Points that are computed.
    pub points: usize,
    /// Seconds of one core that they are expected to take.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
    /// The factor by which the standard error of the limit is expected to change.
    pub factor: Option<f64>,
}

impl AdvisedStep {
    /// By how much ln(standard error) falls for each core-hour.
    pub fn gain(&self) -> Option<f64> {
        let factor = self.factor.filter(|factor| *factor < 1.0)?;
        (self.seconds > 0.0).then(|| -factor.ln() / (self.seconds / 3600.0))
    }
}

impl Session<'_> {
    /// What one more octave towards each limit would cost, and do to the interval of the limit. Nothing
    /// is written.
    ///
    /// # Errors
    /// As [`Session::reading`], and when a table is damaged.
    pub fn advice(&self) -> Result<StudyAdvice, SessionError> {
        let reading = self.reading()?;
        let mut advice = StudyAdvice { fits: Vec::new(), without: 0 };
        for (place, stage) in reading.plan.stages.iter().enumerate() {
            if stage.kind == Kind::Fit {
                of_stage(&reading, place, stage, &mut advice)?;
            }
        }
        Ok(advice)
    }
}

fn of_stage(
    reading: &StudyResults,
    place: usize,
    stage: &PlannedStage,
    advice: &mut StudyAdvice,
) -> Result<(), SessionError> {
    let plan = &reading.plan;
    let recipes = stage.tasks.iter().filter_map(|&task| match &plan.tasks[task].recipe {
        Recipe::Fit(params) => match &params.law {
            Law::Limits(choices) => Some((task, params.as_ref(), choices.as_ref())),
            _ => None,
        },
        _ => None,
    });
    let recipes: Vec<(usize, &fit::Params, &LimitChoices)> = recipes.collect();
    if recipes.is_empty() {
        return Ok(());
    }
    let inputs = &reading.study.stages[place].inputs;
    let mut tables = Vec::new();
    for &input in inputs {
        tables.extend(reading.rows(&plan.stages[input])?.table);
    }
    if tables.is_empty() {
        advice.without += recipes.len();
        return Ok(());
    }
    let table = Table::stack(&tables)?;
    for (task, params, choices) in recipes {
        let costs = Costs::of(plan, task, choices);
        for group in groups(&table, choices, params.window())? {
            for &load in &group.loads {
                match octaves::advise(&group, load, choices, &params.bootstrap()) {
                    Some(advised) => advice.fits.push(AdvisedFit {
                        stage: stage.name.clone(),
                        what: told(&table, &group, load, choices),
                        forms: advised.forms.iter().map(|form| form.word()).collect(),
                        limit: advised.fit.limit,
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

/// What has a limit, and what places the group among others of its table.
fn told(table: &Table, group: &Group, load: Option<f64>, choices: &LimitChoices) -> String {
    let parameters = table.in_role(Role::Parameter);
    let own = Point::of_row(&parameters, group.row);
    let all = Point::of_row(&parameters.common(), 0);
    let over: Vec<&str> = choices.over.iter().map(String::as_str).collect();
    let distinct = own.beyond(&all).without(&over).without(&[K_ROLLOFF.name, COEFFICIENT.name]);
    let load = load.map(|load| format!("load {load}"));
    let distinct = Some(distinct.to_string()).filter(|text| !text.is_empty());
    let parts = [Some(choices.of.to_string()), load, distinct];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn steps(advised: &Advised, costs: &Costs) -> Vec<AdvisedStep> {
    let again = AdvisedStep {
        term: None,
        doubled: vec!["realizations".to_owned()],
        points: advised.points.len(),
        seconds: advised.points.iter().map(|point| costs.of_point(point, &[])).sum(),
        factor: Some(0.5_f64.sqrt()),
    };
    let step = |octave: &Octave| AdvisedStep {
        term: Some(octave.term.clone()),
        doubled: octave.doubled.clone(),
        points: octave.from.len(),
        seconds: octave.from.iter().map(|point| costs.of_point(point, &octave.doubled)).sum(),
        factor: octave.narrowing,
    };
    advised.octaves.iter().map(step).chain([again]).collect()
}

/// What surfaces of each point cost, whatever is done to them for a fit.
struct Costs<'a> {
    plan: &'a Plan,
    model: CostModel,
    /// The tasks of each point, by its parameters that vary.
    tasks: BTreeMap<Point, Vec<usize>>,
}

impl<'a> Costs<'a> {
    fn of(plan: &'a Plan, fit: usize, choices: &LimitChoices) -> Costs<'a> {
        let over: Vec<&str> = choices.over.iter().map(String::as_str).collect();
        let mut is_read = vec![false; plan.tasks.len()];
        is_read[fit] = true;
        for task in (0..=fit).rev() {
            if is_read[task] {
                let inputs = &plan.tasks[task].inputs;
                inputs.iter().for_each(|&input| is_read[input] = true);
            }
        }
        let mut points: Vec<Point> = Vec::with_capacity(fit);
        let mut tasks: BTreeMap<Point, Vec<usize>> = BTreeMap::new();
        for (place, task) in plan.tasks.iter().enumerate().take(fit) {
            let above = task.inputs.first().map(|&input| points[input].clone());
            let own = Point::of(task.recipe.coordinates());
            let point = above.unwrap_or_default().and(own).only(&over);
            // Fits that a fit reads are of all surfaces at once, and take no time beside them.
            if is_read[place] && task.recipe.kind() != Kind::Fit {
                tasks.entry(point.clone()).or_default().push(place);
            }
            points.push(point);
        }
        Costs { plan, model: CostModel::default(), tasks }
    }

    /// Seconds of one core for a point with some parameters doubled.
    fn of_point(&self, point: &Point, doubled: &[String]) -> f64 {
        let factor = |name: &str| match doubled.iter().any(|one| one == name) {
            true => 2,
            false => 1,
        };
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
