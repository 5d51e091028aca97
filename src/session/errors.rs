//! Errors of the means of a study, with the costs of halving them, and missing surfaces.

mod additions;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use serde::Serialize;

use super::advice::{StudyAdvice, stacked};
use super::status::in_hours;
use super::{Session, SessionError, UnknownName, name_lookup};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::{StudyResults, TASK};
use asperity_pipeline::study::MeansOfStage;
use asperity_stages::Kind;
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, COEFFICIENT, CORRECTION, K_LOWER, K_ROLLOFF, K_UPPER, NODES,
    TOLERANCE,
};
use asperity_stages::ensemble::{Ensemble, ParameterPoint, load_column};
use asperity_stages::error_budget::{
    self, ErrorBudget, LoadBudget, MESH, SizeError, SolverError, Term, number,
};
use asperity_statistics::differences::MeanDifference;
use asperity_statistics::intervals::LEVEL;
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

pub use self::additions::Addition;
pub use super::advice::{AdvisedFit, AdvisedStep};

/// Errors of the means and of the fitted limits of a study.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct StudyErrors {
    pub means: Vec<MeanErrors>,
    /// Fits of limits, with the octaves that would extend them.
    pub limits: Vec<AdvisedFit>,
    /// Number of fits of limits without a result.
    pub limits_without_result: usize,
    /// Surfaces that the study lacks for some terms.
    pub additions: Vec<Addition>,
}

/// Errors of the means of a column at one parameter point.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct MeanErrors {
    pub stage: String,
    pub column: String,
    /// Unit of the column, if the study names units.
    pub unit: Option<String>,
    /// Parameters in which the points of the table differ, and the cutoffs.
    pub point: String,
    /// Number of nodes per side of the mesh of the mean.
    pub nodes: Option<f64>,
    /// Column that identifies the loads.
    pub load_column: &'static str,
    pub loads: Vec<LoadErrors>,
    /// Costs of halving the known terms.
    pub halving: Vec<Halving>,
    /// Terms that the study cannot show.
    pub unknown: Vec<&'static str>,
}

/// Mean at one load with its errors.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct LoadErrors {
    pub load: f64,
    pub surfaces: usize,
    pub value: f64,
    pub terms: Vec<TermError>,
    /// Largest term: sampling with half of its interval, a bias whose interval excludes zero with
    /// its magnitude, or a bound.
    pub largest: Option<&'static str>,
}

/// One term of the errors of a mean. A positive error means that the mean is too large.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct TermError {
    pub term: &'static str,
    /// Bias; `None` for sampling and for bounds, which have a magnitude only.
    pub bias: Option<f64>,
    /// `None` for bounds.
    pub standard_error: Option<f64>,
    /// 95 % confidence interval.
    pub interval: [f64; 2],
    /// Order of the error of the mesh or of the cell.
    pub order: Option<f64>,
    /// True if the means show the order, and false if it is assumed.
    pub order_is_shown: Option<bool>,
    /// Meshes, cells or tolerances that the term compares: numbers of nodes per side, values of
    /// `k_lower`, or tolerances.
    pub sizes: Vec<f64>,
    /// Number of surfaces of each size.
    pub surfaces: Vec<usize>,
    /// Number of nodes per side on which the error of the cell is computed.
    pub on_nodes: Option<f64>,
}

/// Change of a study that halves a term.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct Halving {
    pub term: &'static str,
    pub change: String,
    /// Expected core-seconds.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
}

impl StudyErrors {
    /// Returns the errors as JSON.
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("errors are plain data")
    }
}

impl Session<'_> {
    /// Computes the errors of all means of the study, or of those of one stage or column, and the
    /// cost of extending fits of limits. Writes nothing.
    ///
    /// # Errors
    /// Returns the same errors as [`Session::status`], an error if a stage or column does not
    /// exist or has no means over surfaces, and an error if a table is damaged.
    pub fn errors(
        &self,
        stage: Option<&str>,
        column: Option<&str>,
    ) -> Result<StudyErrors, SessionError> {
        let reading = self.reading()?;
        let advice = StudyAdvice::new(&reading, stage)?;
        let mut sources = match stage {
            None => reading.study.means()?,
            Some(name) => means_of(&reading, name)?.into_iter().collect(),
        };
        let is_of_limits = !advice.fits.is_empty() || advice.without > 0;
        if let (Some(name), []) = (stage, &sources[..])
            && !is_of_limits
        {
            return Err(SessionError::Refused(format!(
                "stage `{name}` has no means over surfaces under loads; name a `solve`, `measure` \
                 or `correct` stage, or an `aggregate` stage with `\"mean\"`"
            )));
        }
        let mut errors = StudyErrors {
            means: Vec::new(),
            limits: advice.fits,
            limits_without_result: advice.without,
            additions: Vec::new(),
        };
        let costs = Costs::new(&reading.plan);
        for source in &mut sources {
            if let Some(column) = column {
                source.columns = vec![column.to_owned()];
            }
            add_means(&reading, source, &costs, &mut errors.means)?;
        }
        let unknown: BTreeSet<&str> =
            errors.means.iter().flat_map(|mean| mean.unknown.iter().copied()).collect();
        if !unknown.is_empty() {
            errors.additions = additions::additions(&reading, &costs, &unknown);
        }
        Ok(errors)
    }
}

fn means_of(reading: &StudyResults, name: &str) -> Result<Option<MeansOfStage>, SessionError> {
    let names: Vec<&str> = reading.plan.stages.iter().map(|stage| stage.name.as_str()).collect();
    Ok(reading.study.means_of(name_lookup::stage(name, &names)?)?)
}

fn add_means(
    reading: &StudyResults,
    source: &MeansOfStage,
    costs: &Costs,
    means: &mut Vec<MeanErrors>,
) -> Result<(), SessionError> {
    let plan = &reading.plan;
    let Some(table) = stacked(reading, &source.rows)? else { return Ok(()) };
    let stage = &plan.stages[source.stage].name;
    let units = reading.study.units_of(stage);
    let parameters = table.in_role(Role::Parameter);
    let common = ParameterPoint::from_row(&parameters.common(), 0);
    // A counted area is in the rows of each correction, and those of none repeat it.
    let mut seen = BTreeSet::new();
    for column in &source.columns {
        if !table.has(column) {
            let message = format!("stage `{stage}` has no means of a column `{column}`");
            return Err(UnknownName::new(message, column, &table.names()).into());
        }
        let field = table.batch().schema_ref().field_with_name(column).expect("the column exists");
        for budget in error_budget::budgets(&table, column, source.is_multilevel)? {
            let counted = if column == AREA_CORRECTED.name { AREA_FRACTION.name } else { column };
            if !seen.insert((counted.to_owned(), identity(&budget))) {
                continue;
            }
            let surfaces: Vec<Surfaces> = budget
                .ensembles
                .iter()
                .map(|ensemble| costs.surfaces_of(&table, ensemble))
                .collect::<Result<_, _>>()?;
            let unknown = Term::ALL
                .into_iter()
                .filter(|term| budget.loads.iter().all(|load| load.error(*term).is_none()));
            means.push(MeanErrors {
                stage: stage.clone(),
                column: column.clone(),
                unit: units.shown_of(field),
                point: description(&budget.point, &common, column),
                nodes: number(&budget.point, NODES.name),
                load_column: load_column(&table),
                loads: budget.loads.iter().map(LoadErrors::new).collect(),
                halving: halving(&budget, &surfaces, costs),
                unknown: unknown.map(Term::name).collect(),
            });
        }
    }
    Ok(())
}

/// Returns the cutoffs and the parameters that differ from those of other points.
fn description(point: &ParameterPoint, common: &ParameterPoint, column: &str) -> String {
    let cutoffs = point.clone().only(&[K_LOWER.name, K_UPPER.name]);
    let distinct = point.clone().beyond(common).without(&MESH).without(&DERIVED).and(cutoffs);
    match column {
        name if name == AREA_CORRECTED.name => distinct.to_string(),
        _ => distinct.without(&[CORRECTION.name]).to_string(),
    }
}

/// Parameters that others determine, or that differ between surfaces of a mean and those of its
/// errors.
const DERIVED: [&str; 3] = [K_ROLLOFF.name, COEFFICIENT.name, TOLERANCE.name];

/// Returns what equal budgets have in common: the point without the correction, and the values.
fn identity(budget: &ErrorBudget) -> (ParameterPoint, Vec<u64>) {
    let values = budget.loads.iter().map(|load| load.mean.value.to_bits());
    let point = budget.point.clone().without(&[COEFFICIENT.name, CORRECTION.name]);
    (point, values.collect())
}

impl LoadErrors {
    fn new(budget: &LoadBudget) -> LoadErrors {
        let terms = Term::ALL.into_iter().filter_map(|term| {
            let (value, interval) = budget.error(term)?;
            let size = match term {
                Term::Mesh => budget.mesh.as_ref(),
                Term::Cell => budget.cell.as_ref(),
                Term::Sampling | Term::Solver => None,
            };
            let known: Option<&MeanDifference> = match (term, size, &budget.solver) {
                (Term::Sampling, ..) => Some(&budget.mean),
                (Term::Solver, _, Some(SolverError::Difference { error, .. })) => Some(error),
                (_, size, _) => size.map(|size| &size.found.error),
            };
            Some(TermError {
                term: term.name(),
                bias: known.filter(|_| term != Term::Sampling).map(|_| value),
                standard_error: known.map(|known| known.error),
                interval,
                order: size.map(|size| size.found.order),
                order_is_shown: size.map(|size| size.found.is_order_shown),
                sizes: match (term, &budget.solver) {
                    (Term::Solver, Some(SolverError::Difference { tolerance, .. })) => {
                        vec![*tolerance]
                    }
                    _ => size.map(|size| size.sizes.clone()).unwrap_or_default(),
                },
                surfaces: size.map(|size| size.surfaces.clone()).unwrap_or_default(),
                on_nodes: size.and_then(|size| size.on_mesh),
            })
        });
        LoadErrors {
            load: budget.load.given,
            surfaces: budget.surfaces,
            value: budget.mean.value,
            terms: terms.collect(),
            largest: budget.largest().map(Term::name),
        }
    }
}

/// Fewest surfaces that are proposed, for intervals with three degrees of freedom.
const FEWEST: usize = 4;

/// Returns the changes that halve the known terms. `surfaces` are those of the meshes of the mean.
fn halving(budget: &ErrorBudget, surfaces: &[Surfaces], costs: &Costs) -> Vec<Halving> {
    let Some(finest) = surfaces.last() else { return Vec::new() };
    let count = finest.len();
    let mut halving = Vec::new();
    if count > 1 {
        let change = match surfaces {
            [only] => format!("{} more surfaces", 3 * only.len()),
            _ => "four times the surfaces on each mesh".to_owned(),
        };
        let seconds = surfaces.iter().map(|own| own.len() as f64 * costs.per_surface(own, 1.0));
        let seconds = 3.0 * seconds.sum::<f64>();
        halving.push(Halving { term: Term::Sampling.name(), change, seconds });
    }
    let times = |names: &[&str], factor: usize| {
        let changed = names.iter().filter_map(|name| {
            Some(format!("{name} = {}", number(&budget.point, name)? * factor as f64))
        });
        changed.collect::<Vec<_>>().join(", ")
    };
    let meshes: Vec<(&LoadBudget, &SizeError)> =
        budget.loads.iter().filter_map(|load| Some((load, load.mesh.as_ref()?))).collect();
    let nodes = number(&budget.point, NODES.name);
    if let Some(factor) = factor(&meshes) {
        // The variance of the difference to the finer mesh is to add a fifth at most.
        let for_loads = meshes.iter().map(|(load, mesh)| {
            let error = &mesh.found.error;
            let left = 1.0 - mesh.found.remaining(factor as f64);
            let variance = (left * error.error).powi(2) * mesh.surfaces[0] as f64;
            5.0 * variance / load.mean.error.powi(2)
        });
        let most = for_loads.filter(|needed| needed.is_finite()).fold(0.0, f64::max);
        let needed = (most.ceil() as usize).max(FEWEST).min(count);
        halving.push(Halving {
            term: Term::Mesh.name(),
            change: format!(
                "{needed} of the surfaces with {}, and `estimator = \"multilevel\"`",
                times(&MESH, factor)
            ),
            seconds: needed as f64 * costs.per_surface(finest, factor as f64),
        });
    } else if let ([(_, mesh), ..], Some(nodes)) = (&meshes[..], nodes) {
        halving.push(more_surfaces(Term::Mesh, mesh, finest, costs, |size| size / nodes));
    }
    let cells: Vec<(&LoadBudget, &SizeError)> =
        budget.loads.iter().filter_map(|load| Some((load, load.cell.as_ref()?))).collect();
    if let Some(factor) = factor(&cells) {
        // The variance between surfaces falls with the number of waves in the cell.
        let needed = count.div_ceil(factor * factor).max(FEWEST);
        let names = [&[K_LOWER.name, K_UPPER.name], &MESH[..]].concat();
        halving.push(Halving {
            term: Term::Cell.name(),
            change: format!("{needed} surfaces with {}", times(&names, factor)),
            seconds: needed as f64 * costs.per_surface(finest, factor as f64),
        });
    } else if let ([(_, cell), ..], Some(nodes)) = (&cells[..], nodes) {
        let on_mesh = cell.on_mesh.unwrap_or(nodes) / nodes;
        let waves = number(&budget.point, K_LOWER.name).unwrap_or(1.0);
        let relative = |size: f64| on_mesh * size / waves;
        halving.push(more_surfaces(Term::Cell, cell, finest, costs, relative));
    }
    halving
}

/// Returns the change that halves the interval of a bias that may be zero. `relative` is the number
/// of nodes per side for a size, in units of that of the mean.
fn more_surfaces(
    term: Term,
    size: &SizeError,
    surfaces: &Surfaces,
    costs: &Costs,
    relative: impl Fn(f64) -> f64,
) -> Halving {
    let sizes = size.sizes.iter().zip(&size.surfaces);
    let seconds =
        sizes.map(|(&size, &count)| count as f64 * costs.per_surface(surfaces, relative(size)));
    Halving {
        term: term.name(),
        change: "its interval includes zero; four times its surfaces halve the interval".to_owned(),
        seconds: 3.0 * seconds.sum::<f64>(),
    }
}

/// Returns the factor of a size that halves its error, from the median order. Returns `None` if the
/// error may be zero at most loads.
fn factor(sizes: &[(&LoadBudget, &SizeError)]) -> Option<usize> {
    let is_known = |(_, size): &&(&LoadBudget, &SizeError)| {
        let [lower, upper] = size.found.interval(LEVEL);
        lower > 0.0 || upper < 0.0
    };
    let mut orders: Vec<f64> =
        sizes.iter().filter(is_known).map(|(_, size)| size.found.order).collect();
    orders.sort_by(f64::total_cmp);
    let order = orders.get(orders.len() / 2)?;
    // An order of 0.9 nearly halves the error.
    (2 * orders.len() > sizes.len()).then_some(if *order > 0.9 { 2 } else { 4 })
}

/// Tasks that make the surfaces of an ensemble.
type Surfaces = BTreeSet<usize>;

/// Tasks of a plan, grouped by the surface that they depend on.
struct Costs<'a> {
    plan: &'a Plan,
    model: CostModel,
    by_surface: BTreeMap<usize, Vec<usize>>,
    /// Surface on which the task with a key in published tables depends.
    surfaces: HashMap<String, usize>,
}

impl<'a> Costs<'a> {
    fn new(plan: &'a Plan) -> Costs<'a> {
        let mut surface_of: Vec<Option<usize>> = Vec::with_capacity(plan.tasks.len());
        let mut by_surface: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut surfaces = HashMap::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            let surface = match task.recipe.kind() {
                Kind::Generate => Some(index),
                kind if kind.depends_on_one_surface() && task.inputs.len() == 1 => {
                    surface_of[task.inputs[0]]
                }
                _ => None,
            };
            if let Some(surface) = surface {
                by_surface.entry(surface).or_default().push(index);
                surfaces.insert(task.table.key.to_string(), surface);
            }
            surface_of.push(surface);
        }
        Costs { plan, model: CostModel::default(), by_surface, surfaces }
    }

    /// Returns the surfaces of an ensemble of rows of a published table.
    fn surfaces_of(&self, table: &Table, ensemble: &Ensemble) -> Result<Surfaces, TableError> {
        let keys = table.texts(TASK.name)?;
        let known = ensemble.states().filter_map(|(_, _, row)| self.surfaces.get(keys.value(row)));
        Ok(known.copied().collect())
    }

    /// Returns the mean of the expected core-seconds of surfaces with `factor` times the nodes per
    /// side.
    fn per_surface(&self, surfaces: &Surfaces, factor: f64) -> f64 {
        let tasks = surfaces.iter().flat_map(|surface| &self.by_surface[surface]);
        let seconds = tasks.map(|&task| {
            let task = &self.plan.tasks[task];
            self.model.seconds_on(task, task.nodes.map(|nodes| (nodes as f64 * factor) as usize))
        });
        seconds.sum::<f64>() / surfaces.len().max(1) as f64
    }
}
