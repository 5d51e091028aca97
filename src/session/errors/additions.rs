//! Lines of a manifest that add the surfaces which show the errors of the mesh, the cell and the
//! solver.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use toml::Table;

use super::{Costs, FEWEST, Surfaces};
use crate::session::status::in_hours;
use asperity_manifest::decimal;
use asperity_pipeline::plan::{Plan, PlannedStage};
use asperity_pipeline::results::StudyResults;
use asperity_stages::columns::{
    HURST, K_LOWER, K_ROLLOFF, K_UPPER, NODES, NODES_X, NODES_Y, RMS_HEIGHT_GIVEN, RMS_SLOPE, SIDE,
    SIDE_X, SIDE_Y, TARGET_KURTOSIS, TARGET_SKEWNESS, TOLERANCE, UNIT,
};
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::error_budget::{MESH, Term, in_wavelengths, number};
use asperity_stages::surface::Origin;
use asperity_stages::{Kind, Recipe};
use asperity_tables::column::Value;

/// Lines for one stage of the manifest.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct Addition {
    pub stage: String,
    /// Terms that the lines show.
    pub terms: Vec<&'static str>,
    /// Keys of the stage that the lines replace.
    pub replaced: Vec<&'static str>,
    /// Names in `[parameters]` that nothing uses then.
    pub unused: Vec<String>,
    pub lines: String,
    /// Expected core-seconds; `None` if they are not known.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: Option<f64>,
}

/// Fewest nodes to the shortest wavelength of a coarser mesh that shows the order.
const LEAST_NODES_PER_WAVE: f64 = 4.0;
/// Largest number of nodes per side, and largest wavenumber, of a manifest.
const MOST_NODES: f64 = 16384.0;
const MOST_WAVES: f64 = 8192.0;
/// Factor to a tolerance at which the error of the solver is negligible.
const TIGHTER: f64 = 0.01;

/// Keys that `cases` can list, each after the column that holds its value.
const KEYS: [(&str, &str); 12] = [
    (K_LOWER.name, "k_lower"),
    (K_ROLLOFF.name, "k_rolloff"),
    (K_UPPER.name, "k_upper"),
    (HURST.name, "hurst"),
    (RMS_SLOPE.name, "rms_slope"),
    (RMS_HEIGHT_GIVEN.name, "rms_height"),
    (TARGET_SKEWNESS.name, "skewness"),
    (TARGET_KURTOSIS.name, "kurtosis"),
    (SIDE.name, "side"),
    (NODES.name, "nodes"),
    (SIDE_X.name, "side"),
    (NODES_X.name, "nodes"),
];

/// Keys that exclude some of [`KEYS`], or the list of cases.
const EXCLUDED: [&str; 4] = ["longest_wavelength", "shortest_wavelength", "realizations", "cases"];

/// Surfaces of a parameter point, present or proposed.
struct Case {
    point: ParameterPoint,
    surfaces: usize,
    /// Terms that proposed surfaces show.
    terms: Vec<Term>,
}

/// Returns the lines that show the unknown terms.
pub(crate) fn additions(
    reading: &StudyResults,
    costs: &Costs,
    unknown: &BTreeSet<&str>,
) -> Vec<Addition> {
    let plan = &reading.plan;
    let manifest = reading.study.manifest.text.parse().unwrap_or_default();
    let has_lengths = plan.tasks.iter().any(|task| {
        let mut cells = task.recipe.coordinates().into_iter();
        cells.any(|(column, _)| is_length(column.unit) && ![SIDE, SIDE_X, SIDE_Y].contains(&column))
    });
    let stages = plan.stages.iter();
    let additions = stages.filter_map(|stage| match stage.kind {
        Kind::Generate => surfaces(plan, stage, costs, unknown, has_lengths),
        Kind::Solve if unknown.contains(Term::Solver.name()) => tolerance(plan, stage),
        _ => None,
    });
    additions.map(|addition| addition.in_manifest(&manifest)).collect()
}

impl Addition {
    /// Keeps the replaced keys that the manifest has, and finds the parameters that only they use.
    fn in_manifest(self, manifest: &Table) -> Addition {
        let mut rest = manifest.clone();
        let parameters = rest.remove("parameters");
        let parameters = || parameters.iter().filter_map(toml::Value::as_table).flatten();
        let stages = rest.get_mut("stage").and_then(|stages| stages.get_mut(&self.stage));
        let mut stage = stages.and_then(toml::Value::as_table_mut);
        let mut has = |key: &str| stage.as_mut().is_some_and(|keys| keys.remove(key).is_some());
        let replaced = self.replaced.iter().copied().filter(|key| has(key)).collect();
        let values = parameters().map(|(_, value)| value.to_string());
        let text = values.chain([rest.to_string()]).collect::<Vec<_>>().join("\n");
        let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
        let words: BTreeSet<&str> = text.split(|letter| !is_word(letter)).collect();
        let unused = parameters().map(|(name, _)| name).filter(|name| !words.contains(&name[..]));
        Addition { replaced, unused: unused.cloned().collect(), ..self }
    }
}

fn is_length(unit: &str) -> bool {
    ["length", "pressure × length"].contains(&unit)
}

/// Returns lines with a smaller tolerance for a stage that has only one.
fn tolerance(plan: &Plan, stage: &PlannedStage) -> Option<Addition> {
    let tolerances: BTreeSet<Value> = stage
        .tasks
        .iter()
        .flat_map(|&task| plan.tasks[task].recipe.coordinates())
        .filter_map(|(column, value)| (column == TOLERANCE).then_some(value))
        .collect();
    let [Value::Real(only)] = tolerances.into_iter().collect::<Vec<_>>()[..] else { return None };
    let tighter = decimal::nearest(only * TIGHTER);
    Some(Addition {
        stage: stage.name.clone(),
        terms: vec![Term::Solver.name()],
        replaced: vec!["tolerance"],
        unused: Vec::new(),
        lines: format!("tolerance = [{only:e}, {tighter:e}]\n"),
        seconds: None,
    })
}

/// Returns the cases of a stage of random surfaces, with those that show the unknown terms.
fn surfaces(
    plan: &Plan,
    stage: &PlannedStage,
    costs: &Costs,
    unknown: &BTreeSet<&str>,
    has_lengths: bool,
) -> Option<Addition> {
    let mut tasks: BTreeMap<ParameterPoint, Surfaces> = BTreeMap::new();
    let mut lengths = BTreeSet::new();
    for &task in &stage.tasks {
        let recipe = &plan.tasks[task].recipe;
        let Recipe::Generate(params) = recipe else { return None };
        if !matches!(params.origin, Origin::Random { .. }) {
            return None;
        }
        let cells = recipe.coordinates();
        let of_length = cells.iter().filter(|(column, _)| is_length(column.unit));
        lengths.extend(of_length.map(|(column, _)| column.name.to_owned()));
        tasks.entry(ParameterPoint::from_cells(cells)).or_default().insert(task);
    }
    let points: Vec<&ParameterPoint> = tasks.keys().collect();
    let mut cases: Vec<Case> = tasks
        .iter()
        .map(|(point, tasks)| Case {
            point: point.clone(),
            surfaces: tasks.len(),
            terms: Vec::new(),
        })
        .collect();
    let is_multilevel = plan.tasks.iter().any(|task| task.recipe.is_multilevel());
    // A force is another pressure in a cell of another size.
    let has_forces = plan
        .tasks
        .iter()
        .any(|task| matches!(&task.recipe, Recipe::Solve(params) if params.newtons.is_some()));
    let mut seconds = 0.0;
    for (point, tasks) in &tasks {
        let mut propose = |term: Term, point: ParameterPoint, count: usize, factor: f64| {
            let each = costs.per_surface(tasks, factor);
            if let Some(known) = cases.iter_mut().find(|case| case.point == point) {
                seconds += count.saturating_sub(known.surfaces) as f64 * each;
                known.surfaces = known.surfaces.max(count);
                known.terms.push(term);
                return;
            }
            seconds += count as f64 * each;
            cases.push(Case { point, surfaces: count, terms: vec![term] });
        };
        let meshes_of = |point: &ParameterPoint| {
            let cell = point.clone().without(&MESH);
            points.iter().filter(move |other| (***other).clone().without(&MESH) == cell)
        };
        // Cells that show the error of the cell need no meshes of their own.
        let is_shown_by = |other: &ParameterPoint| {
            let family = |point: &ParameterPoint| {
                in_wavelengths(point, &lengths).map(|point| point.without(&MESH))
            };
            family(other) == family(point) && meshes_of(other).count() > 1
        };
        let nodes = nodes_of(point);
        if unknown.contains(Term::Mesh.name())
            && !points.iter().any(|other| is_shown_by(other))
            && 2.0 * nodes <= MOST_NODES
        {
            let count = tasks.len().clamp(2, FEWEST);
            if tasks.len() < count {
                propose(Term::Mesh, (*point).clone(), count, 1.0);
            }
            propose(Term::Mesh, scaled(point, &MESH, 2.0), count, 2.0);
            let waves = number(point, K_UPPER.name).unwrap_or(0.0);
            if nodes >= 2.0 * LEAST_NODES_PER_WAVE * waves && nodes % 4.0 == 0.0 {
                propose(Term::Mesh, scaled(point, &MESH, 0.5), count, 0.5);
            }
        }
        let own = in_wavelengths(point, &lengths);
        let is_of_cell = |other: &&&ParameterPoint| in_wavelengths(other, &lengths) == own;
        let is_coarsest = || meshes_of(point).all(|other| nodes <= nodes_of(other));
        let count_of_cells = points.iter().filter(is_of_cell).count();
        let is_unknown = unknown.contains(Term::Cell.name()) && !has_forces;
        if is_unknown && count_of_cells == 1 && is_coarsest() {
            let per_side = [&MESH[..], &[K_LOWER.name, K_ROLLOFF.name, K_UPPER.name]].concat();
            let numbers: Vec<f64> =
                per_side.iter().filter_map(|name| number(point, name)).collect();
            let waves = number(point, K_LOWER.name)?;
            // A smaller cell costs as much for equal scatter, and gives a narrower interval.
            let has_half = waves >= 4.0 && numbers.iter().all(|number| number % 2.0 == 0.0);
            let (factor, count) = if has_half {
                (0.5, 4 * tasks.len())
            } else {
                (2.0, tasks.len().div_ceil(4).max(FEWEST))
            };
            if factor * nodes > MOST_NODES || factor * number(point, K_UPPER.name)? > MOST_WAVES {
                continue;
            }
            let sides: &[&str] = &[SIDE.name, SIDE_X.name, SIDE_Y.name];
            let sides = if has_lengths || point.get(UNIT.name).is_some() { sides } else { &[] };
            let cell = scaled(point, &[&per_side[..], sides].concat(), factor);
            if is_multilevel {
                let finer = scaled(&cell, &MESH, 2.0);
                propose(Term::Cell, finer, count.min(FEWEST), 2.0 * factor);
            }
            propose(Term::Cell, cell, count, factor);
        }
    }
    let terms: Vec<&str> = [Term::Mesh, Term::Cell]
        .into_iter()
        .filter(|term| cases.iter().any(|case| case.terms.contains(term)))
        .map(Term::name)
        .collect();
    if terms.is_empty() {
        return None;
    }
    let keys = varied(&cases)?;
    let replaced = keys.iter().map(|(_, key)| *key).chain(EXCLUDED);
    Some(Addition {
        stage: stage.name.clone(),
        terms,
        replaced: replaced.collect(),
        unused: Vec::new(),
        lines: lines(&cases, &keys),
        seconds: Some(seconds),
    })
}

/// Returns the larger number of nodes of a mesh.
fn nodes_of(point: &ParameterPoint) -> f64 {
    MESH.iter().filter_map(|name| number(point, name)).fold(0.0, f64::max)
}

fn scaled(point: &ParameterPoint, names: &[&str], factor: f64) -> ParameterPoint {
    point.map(|name, value| match value {
        _ if !names.contains(&name) => value.clone(),
        Value::Integer(number) => Value::Integer((*number as f64 * factor) as i64),
        Value::Real(number) => Value::Real(number * factor),
        Value::Text(_) => value.clone(),
    })
}

/// Returns the columns and keys in which the cases differ, and those of the spectrum and the mesh.
/// Returns `None` if cases cannot list one of them.
fn varied(cases: &[Case]) -> Option<Vec<(&'static str, &'static str)>> {
    let first = &cases[0].point;
    let differs = |name: &str| cases.iter().any(|case| case.point.get(name) != first.get(name));
    let is_key = |name: &str| {
        let along_y = [SIDE_Y.name, NODES_Y.name];
        along_y.contains(&name) || KEYS.iter().any(|(column, _)| *column == name)
    };
    let mut names = cases.iter().flat_map(|case| case.point.iter().map(|(name, _)| name));
    if names.any(|name| differs(name) && !is_key(name)) {
        return None;
    }
    let has_plateau = cases
        .iter()
        .any(|case| number(&case.point, K_ROLLOFF.name) != number(&case.point, K_LOWER.name));
    let always = [K_LOWER.name, K_UPPER.name, NODES.name, NODES_X.name];
    let is_listed = |(column, _): &(&str, &str)| match *column {
        name if name == K_ROLLOFF.name => has_plateau,
        name => (always.contains(&name) && first.get(name).is_some()) || differs(name),
    };
    Some(KEYS.into_iter().filter(is_listed).collect())
}

fn lines(cases: &[Case], keys: &[(&str, &str)]) -> String {
    let mut lines = "cases = [\n".to_owned();
    for Case { point, surfaces, terms } in cases {
        let mut cells: Vec<String> = keys
            .iter()
            .map(|(column, key)| format!("{key} = {}", written(point, column)))
            .collect();
        cells.push(format!("realizations = {surfaces}"));
        let names: Vec<&str> = terms.iter().map(|term| term.name()).collect();
        let comment = match names[..] {
            [] => String::new(),
            _ => format!(" # {}", names.join(", ")),
        };
        lines += &format!("    {{ {} }},{comment}\n", cells.join(", "));
    }
    lines + "]\n"
}

/// Returns the value of a key in a manifest, with its unit if it is a length.
fn written(point: &ParameterPoint, column: &str) -> String {
    let plain = |column: &str| match point.get(column) {
        Some(Value::Real(number)) => decimal::written(*number),
        Some(value) => value.to_string(),
        None => String::new(),
    };
    let unit = |text: String| match point.get(UNIT.name) {
        Some(unit) if [SIDE.name, SIDE_X.name, RMS_HEIGHT_GIVEN.name].contains(&column) => {
            format!("\"{text} {unit}\"")
        }
        _ => text,
    };
    let along_y = [(NODES_X.name, NODES_Y.name), (SIDE_X.name, SIDE_Y.name)];
    match along_y.into_iter().find(|(along_x, _)| *along_x == column) {
        Some((_, along_y)) => format!("[{}, {}]", plain(column), plain(along_y)),
        None => unit(plain(column)),
    }
}
