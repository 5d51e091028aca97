//! The plan of a study: the list of its tasks, made without reading any file.
//!
//! A task computes one table, such as one surface or the contact of a surface under its loads. The
//! key of a task depends on everything that decides the content of its table. More surfaces or
//! another cutoff add tasks and leave the keys of the other tasks unchanged.
//!
//! The rows of some tables do not depend on each other, such as the rows of loads. The store keeps
//! such rows as a [series](asperity_tables::store::series) under a key of their own, which does not
//! depend on the values of the rows. Further loads change the keys of the tasks, but not the keys
//! of the series, so only the new rows are computed.

pub mod missing_rows;
pub mod reasons;
pub mod sources;

use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use crate::study::{Stage, Study};
use asperity_manifest::names;
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::surface::labels::{PATH, SurfaceLabels};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{InputScope, Recipe, Series, Work, surface};
use asperity_tables::key::{Digest, KeyMap, TaskKey};
use asperity_tables::parallel;
use asperity_tables::store::Store;
use asperity_tables::store::provenance::Provenance;
use asperity_tables::store::series::TableRef;
use asperity_tables::table::{Table, TableError};

pub use asperity_stages::Kind;

/// All tasks of a study, ordered such that each task comes after its inputs.
///
/// ```
/// use std::path::Path;
///
/// use asperity_pipeline::plan::Plan;
/// use asperity_pipeline::study::Study;
///
/// let manifest = |upper: &str| format!(r#"
///     [study]
///     name = "small"
///     [stage.surfaces]
///     kind = "generate"
///     nodes = 32
///     hurst = 0.8
///     k_lower = 1
///     k_upper = {upper}
/// "#);
/// let plan = |upper: &str| {
///     let study = Study::parse(&manifest(upper), "small.toml", Path::new(""));
///     study.map(|study| Plan::new(&study))
/// };
/// let (few, more) = (plan("[4]")?, plan("[4, 8]")?);
/// assert_eq!([few.tasks.len(), more.tasks.len()], [1, 2]);
/// // The task of the smaller study keeps its key, so that its finished table is reused.
/// assert!(more.keys().is_superset(&few.keys()));
/// # Ok::<(), asperity_pipeline::study::ManifestErrors>(())
/// ```
#[derive(Debug)]
pub struct Plan {
    pub study: String,
    /// All tasks. A task that belongs to several stages is listed once.
    pub tasks: Vec<Task>,
    /// Stages, each after the stages that it reads.
    pub stages: Vec<PlannedStage>,
    /// Labels of the measured surfaces, which tasks of several surfaces read.
    pub labels: SurfaceLabels,
    /// Index of each task, by key.
    indices: KeyMap<usize>,
}

#[derive(Debug)]
pub struct Task {
    /// Key of the task: a hash of everything that decides its table.
    pub key: TaskKey,
    /// Table of the task in the store: a whole table under the key of the task, or rows of a series
    /// under the key of the series. Users know tasks by the key of their table.
    pub table: TableRef,
    /// Stage parameters that decide the table.
    pub recipe: Recipe,
    /// Indices of the tasks whose tables this task reads, in order.
    pub inputs: Vec<usize>,
    /// Key of the task without the parameters that later stages do not read and without parts; see
    /// [`TaskKey::new`].
    identity: TaskKey,
    /// Numbers of nodes of the surface along x and y.
    pub nodes: [usize; 2],
    /// Longer side of the cell.
    pub longer_side: f64,
    /// Number of rows per surface in the task's table, or in the tables that the task pools.
    pub rows: usize,
    /// Labels and path of the measured surface of the task, if it depends on a single one.
    named: Named,
}

/// What the tables of a measured surface get beside the numbers of its tasks.
#[derive(Debug, Clone, Default)]
struct Named {
    /// Hash of the labels; `None` without labels.
    labels: Option<Digest>,
    path: Option<Arc<Path>>,
}

impl Task {
    /// Returns the key on which the keys of the tasks that read this task depend. It covers the
    /// values of the rows and those parts that `reader` reads. For tasks of several surfaces it
    /// also covers the labels of the surface, and its path if `reader` uses it.
    fn identity_for(&self, reader: &Recipe) -> TaskKey {
        let key = self.with_parts_of(self.identity, reader);
        let Named { labels, path } = &self.named;
        if reader.input_scope() == InputScope::Single {
            return key;
        }
        let key = labels.map_or(key, |labels| TaskKey::new("labels", 1, labels, &[key]));
        match path.as_ref().filter(|_| reader.uses_column(PATH.name)) {
            Some(path) => TaskKey::new(PATH.name, 1, Digest::from_params(&path), &[key]),
            None => key,
        }
    }

    /// Returns the key on which the key of a series depends whose rows are computed from single
    /// rows of this task. It does not cover the values of the rows.
    fn series_identity_for(&self, reader: &Recipe) -> TaskKey {
        match self.table.series {
            None => self.identity_for(reader),
            Some(_) => self.with_parts_of(self.table.key, reader),
        }
    }

    fn with_parts_of(&self, key: TaskKey, reader: &Recipe) -> TaskKey {
        let parts = self.table.series.iter().flat_map(|series| &series.parts);
        let read = parts.filter(|of| reader.reads_part(&of.part));
        let names: Vec<&str> = read.map(|of| of.part.name.as_str()).collect();
        if names.is_empty() {
            return key;
        }
        TaskKey::new("parts", 1, Digest::from_params(&names), &[key])
    }
}

/// Returns the series of a recipe: its rows, and the recipe that these rows share. Returns `None`
/// if the rows depend on each other. `inputs` are the tasks that the recipe reads.
fn series(recipe: &Recipe, inputs: &[usize], tasks: &[Task]) -> Option<Series> {
    let input = match inputs {
        [input] => tasks[*input].table.series.as_deref(),
        _ => None,
    };
    recipe.series(input)
}

/// A stage and the tasks whose tables form its table.
#[derive(Debug)]
pub struct PlannedStage {
    pub name: String,
    pub kind: Kind,
    /// Indices of the tasks, in the order of the rows of the stage's table.
    pub tasks: Vec<usize>,
}

impl PlannedStage {
    /// Returns the tasks of this stage that are selected. `selected` has an entry for each task of
    /// the plan.
    pub fn tasks_where(&self, selected: &[bool]) -> Vec<usize> {
        let tasks = self.tasks.iter().zip(selected).filter(|(_, selected)| **selected);
        tasks.map(|(&task, _)| task).collect()
    }
}

impl Plan {
    /// Creates the plan of a study.
    pub fn new(study: &Study) -> Plan {
        let surfaces = study.stages.iter().flat_map(|stage| stage.work.surfaces());
        let labels = SurfaceLabels::new(surfaces.map(|surfaces| &surfaces.params));
        let mut builder = Builder::new(&study.sources);
        for stage in &study.stages {
            let tasks = builder.tasks_of(stage, &study.stages);
            builder.stages.push(PlannedStage {
                name: stage.name.clone(),
                kind: stage.work.kind(),
                tasks,
            });
        }
        let Builder { tasks, stages, known: indices, .. } = builder;
        Plan { study: study.name.clone(), tasks, stages, labels, indices }
    }

    /// Returns the index of the task with this key, or `None` if the plan has no such task.
    pub fn index_of(&self, task: TaskKey) -> Option<usize> {
        self.indices.get(&task).copied()
    }

    /// Returns the provenance of a task's table: stage, version, parameters and inputs. The
    /// parameters of a series lack the values of the rows.
    pub fn provenance(&self, task: usize) -> Provenance {
        let Task { recipe, inputs, .. } = &self.tasks[task];
        let series = series(recipe, inputs, &self.tasks);
        self.provenance_of(task, series.as_ref().map_or(recipe, |series| &series.recipe))
    }

    /// Returns the provenance of the table of `rows` rows with which the longer table of a task
    /// begins, if its rows depend on the rows before them.
    pub fn beginning(&self, task: usize, rows: usize) -> Option<Provenance> {
        let recipe = self.tasks[task].recipe.beginning(rows)?;
        Some(self.provenance_of(task, &recipe))
    }

    /// Returns the longest table in a store with which the table of a task begins, and its number
    /// of rows.
    pub fn stored_beginning(&self, task: usize, store: &Store) -> Option<(usize, TableRef)> {
        let rows = self.tasks[task].rows;
        let beginning = |rows| Some((rows, TableRef::from(self.beginning(task, rows)?.key())));
        (1..rows).rev().map_while(beginning).find(|(_, table)| store.has(table))
    }

    /// Returns the provenance of a table that `stored` makes from the inputs of a task.
    fn provenance_of(&self, task: usize, stored: &Recipe) -> Provenance {
        let Task { recipe, inputs, table, .. } = &self.tasks[task];
        let identity = |&input: &usize| match table.series {
            None => self.tasks[input].identity_for(recipe),
            Some(_) => self.tasks[input].series_identity_for(recipe),
        };
        Provenance {
            stage: recipe.kind().name().to_owned(),
            version: recipe.kind().version(),
            recipe: serde_json::to_string(stored).expect("parameters are plain data"),
            inputs: inputs.iter().map(|&input| self.tasks[input].table.key).collect(),
            input_identities: inputs.iter().map(identity).collect(),
        }
    }

    /// Returns the keys of the tables of all tasks.
    pub fn keys(&self) -> HashSet<TaskKey> {
        self.tasks.iter().map(|task| task.table.key).collect()
    }

    /// Returns the tables of a stage's tasks, in the order of the tasks.
    pub fn tables_of(&self, stage: &PlannedStage) -> Vec<&TableRef> {
        stage.tasks.iter().map(|&task| &self.tasks[task].table).collect()
    }

    /// Returns whether `study` is the study of this plan, and `table` is one of its stages or the
    /// table of failures.
    pub fn has_table(&self, study: &str, table: &str) -> bool {
        let mut names = self.stages.iter().map(|stage| stage.name.as_str());
        self.study == study && (table == names::FAILURES || names.any(|name| name == table))
    }

    /// Returns the index of the first task whose table has the given key.
    pub fn task_of(&self, key: TaskKey) -> Option<usize> {
        self.tasks.iter().position(|task| task.table.key == key)
    }

    /// Returns the first stage that contains a task.
    pub fn stage_of(&self, task: usize) -> Option<&PlannedStage> {
        self.stages.iter().find(|stage| stage.tasks.contains(&task))
    }

    /// Returns, for each task, the name of the first stage that contains it.
    pub fn stage_names(&self) -> Vec<&str> {
        let mut names = vec![""; self.tasks.len()];
        for stage in self.stages.iter().rev() {
            for &task in &stage.tasks {
                names[task] = &stage.name;
            }
        }
        names
    }

    /// Returns the recipe of the surface on which a task depends, or `None` if it depends on
    /// several surfaces.
    pub fn surface_of(&self, task: usize) -> Option<&surface::Params> {
        let Task { recipe, inputs, .. } = &self.tasks[task];
        match (recipe, inputs.as_slice()) {
            (Recipe::Generate(params), _) => Some(params),
            (_, [input]) => self.surface_of(*input),
            _ => None,
        }
    }

    /// Returns the parameter columns of a task as a table with one row. For a task that reads
    /// several surfaces, these are the parameters that all the surfaces share.
    ///
    /// # Errors
    /// Returns an error if two parameters of the same name differ in type. This would be a bug of a
    /// stage.
    pub fn coordinates(&self, task: usize) -> Result<Table, TableError> {
        /// Number of rows stacked at a time. As a table, a single row takes kilobytes.
        const CHUNK: usize = 1024;
        let Task { recipe, inputs, .. } = &self.tasks[task];
        let own = Table::row(&recipe.coordinates());
        // A generated surface inherits no coordinates from the measured spectrum that it may read.
        if inputs.is_empty() || recipe.kind() == Kind::Generate {
            return Ok(own);
        }
        let chunks = inputs.chunks(CHUNK).map(|inputs| {
            let above = inputs.iter().map(|&input| self.coordinates(input));
            Ok(Table::stack(&above.collect::<Result<Vec<_>, _>>()?)?.common())
        });
        let above = chunks.collect::<Result<Vec<_>, TableError>>()?;
        Ok(Table::stack(&above)?.common().beside(&own))
    }

    /// Returns, for each task, the indices of the tasks that read its table.
    pub fn dependents(&self) -> Vec<Vec<usize>> {
        let mut dependents = vec![Vec::new(); self.tasks.len()];
        for (task, reads) in self.tasks.iter().enumerate() {
            for &input in &reads.inputs {
                dependents[input].push(task);
            }
        }
        dependents
    }
}

/// Number of surfaces of a stage above which their recipes are hashed on several threads.
const MANY: usize = 1000;

struct Builder<'a> {
    sources: &'a SurfaceFiles,
    tasks: Vec<Task>,
    stages: Vec<PlannedStage>,
    known: KeyMap<usize>,
    /// Hash of the last recipe with a series, and hash of the recipe that its rows share, because
    /// consecutive tasks often have the same recipe.
    shared: Option<(Digest, Digest)>,
}

impl<'a> Builder<'a> {
    fn new(sources: &'a SurfaceFiles) -> Builder<'a> {
        let known = KeyMap::default();
        Builder { sources, tasks: Vec::new(), stages: Vec::new(), known, shared: None }
    }

    /// Returns the labels and the path of the measured surface of a task.
    fn named(&self, recipe: &Recipe, inputs: &[usize]) -> Named {
        match (recipe, inputs) {
            (Recipe::Generate(params), _) => Named {
                labels: params.origin.labels().map(Digest::from_params),
                path: params
                    .origin
                    .content()
                    .and_then(|content| self.sources.path_of(content).map(Arc::from)),
            },
            (_, [input]) if recipe.input_scope() == InputScope::Single => {
                self.tasks[*input].named.clone()
            }
            _ => Named::default(),
        }
    }

    fn tasks_of(&mut self, stage: &Stage, all: &[Stage]) -> Vec<usize> {
        let feeding = stage.inputs.iter().map(|&input| &self.stages[input]);
        let inputs: Vec<usize> = feeding.flat_map(|stage| stage.tasks.clone()).collect();
        match &stage.work {
            Work::Generate(surfaces) => {
                let drawn = surfaces.iter().flat_map(|surfaces| {
                    // With measured spectra, every surface is drawn once for each spectrum.
                    let read: Vec<Vec<usize>> = if surfaces.params.origin.reads_stage() {
                        inputs.iter().map(|&input| vec![input]).collect()
                    } else {
                        vec![vec![]]
                    };
                    read.into_iter().flat_map(move |read| {
                        (0..surfaces.realizations).map(move |number| {
                            let params = surfaces.params.realization(number);
                            (Recipe::Generate(params), read.clone())
                        })
                    })
                });
                let recipes: Vec<(Recipe, Vec<usize>)> = drawn.collect();
                let hashes = |(recipe, _): &(Recipe, Vec<usize>)| Digests::new(recipe);
                let digests = if recipes.len() > MANY {
                    parallel::map(&recipes, hashes)
                } else {
                    recipes.iter().map(hashes).collect()
                };
                let known = recipes.into_iter().zip(digests);
                known.map(|((recipe, read), digests)| self.add(recipe, digests, read)).collect()
            }
            Work::Evaluate(recipes) => {
                let table = |&input: &usize| {
                    let tasks = &self.stages[input].tasks;
                    (all[input].name.clone(), tasks.len())
                };
                let tables: Vec<_> = stage.inputs.iter().map(table).collect();
                let tasks = recipes.iter().flat_map(|recipe| {
                    let recipe = recipe.for_inputs(tables.clone()).unwrap_or(recipe.clone());
                    self.evaluate(&recipe, &inputs)
                });
                tasks.collect()
            }
        }
    }

    /// Adds the tasks that evaluate a recipe on the tables of the tasks `inputs`. Returns their
    /// indices.
    fn evaluate(&mut self, recipe: &Recipe, inputs: &[usize]) -> Vec<usize> {
        let is_read = |&input: &usize| recipe.reads_input(&self.tasks[input].recipe);
        let read: Vec<usize> = inputs.iter().copied().filter(is_read).collect();
        let groups = match recipe.input_scope() {
            InputScope::Single => read.into_iter().map(|input| vec![input]).collect(),
            InputScope::ParameterPoint => self.by_point(&read),
            InputScope::All => vec![read],
        };
        let digests = Digests::new(recipe);
        let tasks = groups.into_iter();
        tasks.map(|group| self.add(recipe.clone(), digests, group)).collect()
    }

    fn add(&mut self, recipe: Recipe, digests: Digests, inputs: Vec<usize>) -> usize {
        let read: Vec<TaskKey> =
            inputs.iter().map(|&input| self.tasks[input].identity_for(&recipe)).collect();
        let (stage, version) = (recipe.kind().name(), recipe.kind().version());
        let key = TaskKey::new(stage, version, digests.whole, &read);
        if let Some(&task) = self.known.get(&key) {
            return task;
        }
        let task = self.tasks.len();
        let first = inputs.first().map(|&input| &self.tasks[input]);
        let of_input = || first.map_or(([0; 2], 0.0), |first| (first.nodes, first.longer_side));
        let (nodes, longer_side) = recipe.mesh().unwrap_or_else(of_input);
        let rows = recipe.rows(first.map_or(0, |first| first.rows));
        let table = match series(&recipe, &inputs, &self.tasks) {
            None => key.into(),
            Some(Series { recipe: shared, rows }) => {
                let identity = |&input: &usize| self.tasks[input].series_identity_for(&recipe);
                let read: Vec<TaskKey> = inputs.iter().map(identity).collect();
                let digest = match self.shared {
                    Some((of, digest)) if of == digests.whole => digest,
                    _ => Digest::from_params(&shared),
                };
                self.shared = Some((digests.whole, digest));
                let key = TaskKey::new(stage, version, digest, &read);
                TableRef { key, series: Some(rows.into()) }
            }
        };
        self.tasks.push(Task {
            key,
            table,
            nodes,
            longer_side,
            rows,
            identity: TaskKey::new(stage, version, digests.identity, &read),
            named: self.named(&recipe, &inputs),
            recipe,
            inputs,
        });
        self.known.insert(key, task);
        task
    }

    /// Groups tasks by parameter point: the tasks of a group differ only in surface and block of
    /// loads. Groups are in the order of their first tasks. Of several tasks that differ only in
    /// the columns that they keep, only the first is included.
    fn by_point(&self, tasks: &[usize]) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        let mut known = BTreeMap::new();
        let mut identities = HashSet::new();
        for &task in tasks {
            if !identities.insert(self.tasks[task].identity) {
                continue;
            }
            let group = *known.entry(self.point(task)).or_insert(groups.len());
            if group == groups.len() {
                groups.push(Vec::new());
            }
            groups[group].push(task);
        }
        groups
    }

    /// Returns the parameter point of a task, including the parameters of its inputs.
    fn point(&self, task: usize) -> ParameterPoint {
        let task = &self.tasks[task];
        let upstream = task.inputs.first().map(|&input| self.point(input));
        upstream.unwrap_or_default().and(ParameterPoint::from_cells(task.recipe.coordinates()))
    }
}

/// Hashes of a recipe. `whole` is the hash of all parameters, and `identity` the hash of the
/// parameters on which later stages depend.
#[derive(Clone, Copy)]
struct Digests {
    whole: Digest,
    identity: Digest,
}

impl Digests {
    fn new(recipe: &Recipe) -> Digests {
        let whole = Digest::from_params(recipe);
        let identity = match recipe.identity() {
            Cow::Borrowed(_) => whole,
            Cow::Owned(identity) => Digest::from_params(&identity),
        };
        Digests { whole, identity }
    }
}

impl Plan {
    /// Returns, for each task that depends on a single surface, the identity of the task that
    /// generates this surface. The identity does not depend on whether the heights are kept.
    ///
    /// The entry is `None` for tasks that read several surfaces. It is also `None` for fits and
    /// aggregates, which may read more surfaces in an extended study.
    pub fn surfaces(&self) -> Vec<Option<TaskKey>> {
        let mut surfaces: Vec<Option<TaskKey>> = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            let surface = match task.recipe.kind() {
                Kind::Generate => Some(task.identity),
                kind if kind.depends_on_one_surface() => common(task, &surfaces),
                _ => None,
            };
            surfaces.push(surface);
        }
        surfaces
    }
}

fn common(task: &Task, surfaces: &[Option<TaskKey>]) -> Option<TaskKey> {
    let mut read = task.inputs.iter().map(|&input| surfaces[input]);
    let first = read.next()??;
    read.all(|surface| surface == Some(first)).then_some(first)
}
