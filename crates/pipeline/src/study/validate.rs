//! Validation of the stages, each after its inputs, and of the conditions on numbers of surfaces.

use std::collections::BTreeMap;
use std::path::Path;

use arrow::datatypes::DataType;

use crate::manifest::composition::EffectiveManifest;
use crate::manifest::{Manifest, StageTable, StudyTable};
use crate::study::claims::files::{self, FileError};
use crate::study::claims::{self, ClaimContext, ClaimSpec};
use crate::study::figures::{self, EmptySelection, FigureContext, known_values};
use crate::study::graph::Graph;
use crate::study::{Stage, Study, Work, graph, multilevel, pairs, units};
use asperity_manifest::diagnostics::{ManifestErrors, Problem, Problems, Span, listed, suggestion};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Section, Spanned};
use asperity_stages::absolute::{AbsoluteColumns, StageUnits};
use asperity_stages::check_context::{PressedStage, Surfaces};
use asperity_stages::columns::{SURFACE, needed_key};
use asperity_stages::output_units::Conversion;
use asperity_stages::surface::Origin;
use asperity_stages::surface::labels::Labels;
use asperity_stages::surface::planned::{
    self, AT_LEAST, Growing, KnownMean, PlannedSurfaces, Until,
};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{CheckContext, InputScope, Kind, RowKind, stacked};
use asperity_statistics::intervals::FEWEST_SURFACES;
use asperity_tables::column::{Description, Role, Value};
use asperity_tables::table::Table;

/// Maximum number of tasks of one stage.
const MAX_TASKS: usize = 1_000_000;
/// Maximum number of tasks of a study.
const MAX_TASKS_OF_STUDY: usize = 2_000_000;
/// Maximum number of rows of a stage. Planning takes 0.7 s and 30 MB per million rows.
const MAX_ROWS: usize = 10_000_000;

/// Validates a manifest and reports all problems. Returns `None` if it is invalid. Figures that
/// select rows which the study does not have are added to `empty_selections`. Files of claims are
/// relative to `folder`.
///
/// # Errors
/// Returns the mistakes in a file of claims.
pub fn validate(
    manifest: &Manifest,
    sources: SurfaceFiles,
    folder: &Path,
    problems: &mut Problems,
    empty_selections: &mut Vec<EmptySelection>,
) -> Result<Option<Study>, Box<ManifestErrors>> {
    let (name, seed) = validate_study(&manifest.study, problems);
    let graph = Graph::new(&manifest.stages, problems);
    let mut validator = Validator {
        stages: &manifest.stages,
        seed,
        sources,
        is_read: vec![false; manifest.stages.len()],
        tasks: 0,
        validated: manifest.stages.iter().map(|_| Validated::default()).collect(),
    };
    for &input in graph.inputs.iter().flatten().flatten() {
        validator.is_read[input] = true;
    }
    let drawn = manifest.figures.iter().filter_map(|figure| {
        let from = figure.keys.points.first()?.table.from.written()?;
        index_of(&manifest.stages, &from.value)
    });
    let data = manifest.claims.data.iter().filter_map(|data| data.keys.points.first());
    let data = data.filter_map(|point| point.table.from.written());
    let own = manifest.claims.claims.iter().filter_map(|claim| claim.keys.points.first());
    let own = own.filter_map(|point| point.table.from.written());
    let compared = own.chain(data).filter_map(|from| index_of(&manifest.stages, &from.value));
    for stage in observed_stages(&manifest.stages).into_iter().chain(drawn).chain(compared) {
        validator.is_read[stage] = true;
    }
    for &stage in &graph.order {
        validator.validated[stage] = validator.stage(stage, &graph, problems);
        validator.check_multilevel(stage, &graph, problems);
    }
    validator.check_labels(problems);
    let (stages, is_complete) = validator.sorted_stages(&graph);
    let stored = units::of_stages(&stages);
    let sorted_index = |name: &str| stages.iter().position(|stage| stage.name == name);
    let all = is_complete.then_some(stored.as_slice());
    let output_units = units::output(&manifest.study, all, problems);
    let conversion = |name: &str| {
        let from = stored[sorted_index(name)?].names.clone();
        Some(Conversion { from, to: output_units.clone() })
    };
    let names_of_units =
        |name: &str| Some(stored[sorted_index(name)?].names.clone().in_output(&output_units));
    let empty = |stage: usize| validator.validated[stage].empty.as_ref();
    // Figures and claims read published tables.
    let published = |stage: usize| {
        let table = empty(stage)?;
        let work = validator.validated[stage].work.as_ref()?;
        let read = graph.inputs[stage].iter().flatten().filter_map(|&input| empty(input));
        let quantity = units::unit_of_quantity(work, read);
        let index = sorted_index(&manifest.stages[stage].name.value);
        let units = index.map(|index| stored[index].clone()).unwrap_or_default();
        Some(AbsoluteColumns::new(table, &StageUnits { quantity, ..units }).beside(table))
    };
    let tables: Vec<Option<Table>> = (0..manifest.stages.len()).map(published).collect();
    let table = |name: &str| tables[index_of(&manifest.stages, name)?].as_ref();
    let names: Vec<&str> = manifest.stages.iter().map(|stage| stage.name.value.as_str()).collect();
    let context = FigureContext {
        stages: &names,
        table,
        values: |name: &str, column: &str| {
            let stage = index_of(&manifest.stages, name)?;
            let values = known_values(validator.works(stage, &graph)?, column)?;
            let unit = unit_of(empty(stage)?, column);
            let Some(conversion) = conversion(name) else { return Some(values) };
            let shown = |value: Value| match value {
                Value::Real(number) => Value::Real(conversion.number(number, &unit, true)),
                other => other,
            };
            Some(values.into_iter().map(shown).collect())
        },
        units: &names_of_units,
    };
    let figures = figures::check(&manifest.figures, &context, problems, empty_selections);
    let context = ClaimContext {
        file: None,
        stages: &names,
        table: &table,
        units: &names_of_units,
        reference: &|table: &str| files::read_text(&folder.join(table)),
    };
    let claims = read_claims(manifest, folder, &context, problems)?;
    check_conditions(&manifest.stages, &graph, (empty, claims.as_deref()), problems);
    let (Some(name), true, Some(figures), Some(claims)) = (name, is_complete, figures, claims)
    else {
        return Ok(None);
    };
    Ok(Some(Study {
        name,
        stages,
        figures,
        claims,
        empty_selections: Vec::new(),
        sources: validator.sources,
        output_units: output_units.clone(),
        manifest: EffectiveManifest::default(),
    }))
}

/// Reads the claims of the files that the manifest names, and those of the manifest. Returns `None`
/// after reporting problems of the manifest.
///
/// # Errors
/// Returns the mistakes in a file.
fn read_claims(
    manifest: &Manifest,
    folder: &Path,
    context: &ClaimContext,
    problems: &mut Problems,
) -> Result<Option<Vec<ClaimSpec>>, Box<ManifestErrors>> {
    let named = manifest.study.points.first().and_then(|point| point.table.claims.written());
    let mut all: Vec<ClaimSpec> = Vec::new();
    let mut is_complete = true;
    for file in named.into_iter().flat_map(|files| &files.value) {
        match files::read(&file.value, file.span.clone(), folder, context) {
            Ok(claims) => {
                let is_known = |claim: &ClaimSpec| all.iter().any(|known| known.name == claim.name);
                if let Some(claim) = claims.iter().find(|claim| is_known(claim)) {
                    let message = format!("two files have a claim `{}`", claim.name);
                    problems.push(Problem::new(message, file.span.clone(), "the second file"));
                }
                all.extend(claims);
            }
            Err(FileError::Invalid(errors)) => return Err(errors),
            Err(FileError::Unreadable(problem)) => {
                problems.push(problem);
                is_complete = false;
            }
        }
    }
    let own = claims::check(&manifest.claims, context, problems);
    for claim in &manifest.claims.claims {
        if let Some(known) = all.iter().find(|known| known.name == claim.name.value) {
            let file = known.file.as_deref().unwrap_or_default();
            let message = format!("the claims of `{file}` have a claim `{}`", known.name);
            problems.push(Problem::new(message, claim.name.span.clone(), "choose another name"));
        }
    }
    Ok(own.filter(|_| is_complete).map(|own| {
        all.extend(own);
        all
    }))
}

/// Validates the table `[study]` and returns its name and seed.
fn validate_study(section: &Section<StudyTable>, problems: &mut Problems) -> (Option<String>, u64) {
    let Some(point) = section.points.first() else {
        return (None, 0);
    };
    let mut checks = Checks::new(section, point, problems);
    let seed = checks.value("seed", &point.table.seed);
    let name = checks.required("name", &point.table.name);
    if let Some(name) = name {
        graph::check_name("study", &name.value, name.span.clone(), problems);
    }
    (name.map(|name| name.value.clone()), seed.unwrap_or(0))
}

/// Returns the declared unit of a column, or an empty text.
fn unit_of(table: &Table, column: &str) -> String {
    let field = table.batch().schema_ref().field_with_name(column);
    field.map_or_else(|_| String::new(), |field| Description::from(field).unit)
}

/// Properties of a validated stage that the validation of later stages uses.
#[derive(Default)]
struct Validated {
    rows: Option<RowKind>,
    surfaces: Surfaces,
    work: Option<Work>,
    /// Work of the stage with the pairs of surfaces that this stage presses, if it presses two
    /// rough surfaces against each other.
    pairs: Option<Work>,
    /// Table of the stage without rows, if another stage reads it.
    empty: Option<Table>,
    /// Indices of the stages on which this stage depends, the nearest first.
    earlier: Vec<usize>,
    tasks: usize,
    /// Upper bound on the number of rows per task.
    rows_per_task: usize,
}

impl Validated {
    /// Returns the surfaces that the stage generates, by parameter point.
    fn surfaces_made(&self) -> Option<&[PlannedSurfaces]> {
        match self.work.as_ref()? {
            Work::Generate(surfaces) => Some(surfaces),
            Work::Evaluate(_) => None,
        }
    }
}

struct Validator<'a> {
    stages: &'a [StageTable],
    seed: u64,
    sources: SurfaceFiles,
    /// For each stage of the manifest, true if another stage or a condition reads it.
    is_read: Vec<bool>,
    /// Total over the validated stages. Each stage counts with the number of its tasks or of the
    /// tasks of its inputs, whichever is larger.
    tasks: usize,
    /// Validated stages by their index in the manifest. Inputs are validated before the stages that
    /// read them.
    validated: Vec<Validated>,
}

impl Validator<'_> {
    /// Returns the works of a stage and of all stages that it reads, directly or not.
    fn works(&self, stage: usize, graph: &Graph) -> Option<Vec<&Work>> {
        let mut works = Vec::new();
        let mut open = vec![stage];
        let mut seen = vec![false; self.stages.len()];
        while let Some(stage) = open.pop() {
            if !std::mem::replace(&mut seen[stage], true) {
                works.push(self.validated[stage].work.as_ref()?);
                works.extend(&self.validated[stage].pairs);
                open.extend(graph.inputs[stage].as_deref()?);
            }
        }
        Some(works)
    }

    /// Refuses a surface that has other labels in another stage. The tables of a surface are
    /// computed once, and get their labels by its name.
    fn check_labels(&self, problems: &mut Problems) {
        let mut known: BTreeMap<String, (&Labels, usize)> = BTreeMap::new();
        let made = |stage: usize| {
            let validated = &self.validated[stage];
            validated.surfaces_made().into_iter().flatten().map(move |surfaces| (stage, surfaces))
        };
        let all: Vec<_> = (0..self.validated.len()).flat_map(made).collect();
        if all.iter().all(|(_, surfaces)| surfaces.params.origin.labels().is_none()) {
            return;
        }
        let none = Labels::default();
        for (stage, surfaces) in all {
            let params = &surfaces.params;
            if !matches!(params.origin, Origin::File(_)) {
                continue;
            }
            let labels = params.origin.labels().unwrap_or(&none);
            let name = params.surface_key().to_string();
            let (before, first) = *known.entry(name).or_insert((labels, stage));
            if before != labels {
                let [second, first] = [stage, first].map(|stage| &self.stages[stage].name);
                let content = params.origin.content();
                let path = content.and_then(|content| self.sources.path_of(content));
                let message = format!(
                    "`{}` is the same surface in `{}` and `{}`, with other labels or another \
                     `samples`",
                    path.unwrap_or(Path::new("")).display(),
                    first.value,
                    second.value
                );
                let problem = Problem::new(message, second.span.clone(), "labelled differently")
                    .and(first.span.clone(), "labelled first")
                    .help("let other stages read one of the two stages");
                problems.push(problem);
                return;
            }
        }
    }

    /// Checks the surfaces of a stage with multilevel means.
    fn check_multilevel(&self, stage: usize, graph: &Graph, problems: &mut Problems) {
        let points = self.stages[stage].points.as_ref();
        let Some(key) = points.and_then(|points| points.multilevel()) else { return };
        let mut surfaces = Vec::new();
        let mut open = vec![stage];
        let mut seen = vec![false; self.stages.len()];
        while let Some(stage) = open.pop() {
            if std::mem::replace(&mut seen[stage], true) {
                continue;
            }
            let Validated { work, pairs, .. } = &self.validated[stage];
            match pairs.as_ref().or(work.as_ref()) {
                Some(Work::Generate(own)) => surfaces.extend(own),
                Some(Work::Evaluate(_)) => open.extend(graph.inputs[stage].iter().flatten()),
                None => return,
            }
        }
        if let Some(problem) = multilevel::check(surfaces.into_iter(), key) {
            problems.push(problem);
        }
    }

    /// Returns the valid stages of the study, sorted, and whether these are all. The pairs of
    /// surfaces of a stage are a stage of their own before it.
    fn sorted_stages(&self, graph: &Graph) -> (Vec<Stage>, bool) {
        let mut stages = Vec::with_capacity(graph.order.len());
        let mut sorted_index = vec![None; self.stages.len()];
        for &stage in &graph.order {
            let name = self.stages[stage].name.value.clone();
            let inputs: Option<Vec<usize>> = graph.inputs[stage]
                .as_ref()
                .and_then(|inputs| inputs.iter().map(|&input| sorted_index[input]).collect());
            let Some((mut inputs, work)) = inputs.zip(self.validated[stage].work.clone()) else {
                continue;
            };
            if let Some(pairs) = self.validated[stage].pairs.clone() {
                inputs = vec![stages.len()];
                stages.push(Stage { name: pairs::name_of(&name), inputs: vec![], work: pairs });
            }
            sorted_index[stage] = Some(stages.len());
            stages.push(Stage { name, inputs, work });
        }
        (stages, sorted_index.iter().all(Option::is_some))
    }

    /// Returns the work of the stage with the pairs of surfaces that a stage with `against`
    /// presses, or `None` after reporting problems.
    fn pairs(&self, table: &StageTable, problems: &mut Problems) -> Option<Work> {
        let second = table.points.as_ref()?.against()?;
        let surfaces = |name: &str| self.validated[index_of(self.stages, name)?].surfaces_made();
        pairs::work(table, second, self.stages, surfaces, problems)
    }

    fn stage(&mut self, stage: usize, graph: &Graph, problems: &mut Problems) -> Validated {
        let table = &self.stages[stage];
        let is_read = self.is_read[stage];
        let inputs = graph.inputs[stage].as_deref().unwrap_or_default();
        let against = graph.against[stage];
        let pairs = against.and_then(|_| self.pairs(table, problems));
        let flowing: Vec<_> = inputs
            .iter()
            .map(|&input| (self.stages[input].name.value.as_str(), self.validated[input].rows))
            .collect();
        let points = table.points.as_ref();
        let is_query = points.is_some_and(|points| points.is_query());
        let (rows_read, rows) = graph::check_flow(table, &flowing, is_query, problems);
        // If the inputs of a stage are unknown, its columns are unknown too.
        let is_fed = !inputs.is_empty() || table.kind == Some(Kind::Generate);
        let read = match &pairs {
            Some(pairs) => {
                let name = pairs::name_of(&table.name.value);
                pairs.empty_table(&[]).ok().map(|empty| vec![(name, empty)])
            }
            None => self.tables_of(inputs).filter(|_| is_fed),
        };
        let joined = read.as_deref().and_then(|read| stacked(read).ok());
        let stacked = joined.filter(|table| !table.names().is_empty());
        let each = inputs.iter().chain(&against).map(|&input| &self.validated[input].surfaces);
        let above = each.fold(Surfaces::default(), Surfaces::and);
        // The slope of a sum of two surfaces is not known beforehand.
        let slopes = above.slopes.filter(|_| against.is_none());
        let above = Surfaces { slopes, ..above };
        // A surface drawn from a measured spectrum does not inherit properties of the measured one.
        let inherited = match table.kind {
            Some(Kind::Generate) => Surfaces::default(),
            _ => above,
        };
        let mut earlier: Vec<usize> = inputs.to_vec();
        for above in inputs.iter().flat_map(|&input| &self.validated[input].earlier) {
            if !earlier.contains(above) {
                earlier.push(*above);
            }
        }
        let known = |&index: &usize| {
            Some((self.stages[index].name.value.as_str(), self.validated[index].empty.as_ref()?))
        };
        let known: Vec<_> = earlier.iter().filter_map(known).collect();
        let mut given = CheckContext {
            surfaces: inherited.clone(),
            pressed: pressed(inputs, table, &self.validated, self.stages, graph),
            seed: self.seed,
            sources: &mut self.sources,
            reads_stages: table.from.as_ref().is_none_or(|from| !from.is_empty()),
            read: rows_read,
            input: stacked.as_ref(),
            earlier: &known,
            heights_of: against.and_then(|other| self.validated[other].surfaces_made()),
            problems,
        };
        let work = points.and_then(|points| points.work(&mut given));
        let above = match &pairs {
            Some(pairs) => pairs::at_one_shift(pairs),
            None => {
                let above = inputs.iter().map(|&input| self.validated[input].tasks);
                above.fold(0, usize::saturating_add)
            }
        };
        let tasks = work.as_ref().map_or(0, |work| work.tasks(above));
        self.count(tasks, above, &table.name.span, problems);
        let rows_per_task =
            self.count_rows(work.as_ref(), inputs, above, &table.name.span, problems);
        let computed = work
            .as_ref()
            .zip(read)
            .filter(|_| is_read || is_query)
            .map(|(work, read)| (work.empty_table(&read), read));
        let empty = computed
            .zip(points)
            .and_then(|((empty, read), points)| points.validate_answer(empty, &read, problems));
        let made = work.as_ref().map(|work| Surfaces::made_by(&table.name.value, work));
        let surfaces = inherited.and(&made.unwrap_or_default());
        Validated { rows, surfaces, work, pairs, empty, earlier, tasks, rows_per_task }
    }

    /// Adds the larger of `tasks` (of a stage) and `above` (of the inputs of the stage) to the
    /// total number of tasks. Reports a stage with too many tasks, and the first stage at which the
    /// study has too many.
    fn count(&mut self, tasks: usize, above: usize, name: &Span, problems: &mut Problems) {
        let before = self.tasks;
        self.tasks = before.saturating_add(tasks.max(above));
        let (message, label, help) = if tasks > MAX_TASKS {
            (
                format!("the stage has {tasks} tasks, but at most {MAX_TASKS} are allowed"),
                "limit exceeded here",
                "sweep fewer values: the parameter points of a stage multiply with those of its inputs",
            )
        } else if self.tasks > MAX_TASKS_OF_STUDY && before <= MAX_TASKS_OF_STUDY {
            (
                format!("the study has more than {MAX_TASKS_OF_STUDY} tasks"),
                "limit exceeded at this stage",
                "split the study: studies share the results of equal tasks",
            )
        } else {
            return;
        };
        problems.push(Problem::new(message, name.clone(), label).help(help));
    }

    /// Reports a stage with more rows than a data folder can hold. Returns an upper bound on the
    /// number of rows per task.
    fn count_rows(
        &self,
        work: Option<&Work>,
        inputs: &[usize],
        above: usize,
        name: &Span,
        problems: &mut Problems,
    ) -> usize {
        let read =
            inputs.iter().map(|&input| self.validated[input].rows_per_task).max().unwrap_or(1);
        let all = work.map_or(&[][..], Work::recipes).iter();
        let recipes = all.filter(|recipe| recipe.input_scope() == InputScope::Single);
        let per_task: Vec<usize> = recipes.map(|recipe| recipe.rows(read)).collect();
        let of_inputs = per_task.iter().fold(0, |rows: usize, one| rows.saturating_add(*one));
        let rows = of_inputs.saturating_mul(above);
        // A stage that only keeps the rows of its input would be the second to be reported.
        if rows > MAX_ROWS && per_task.iter().any(|&own| own > read) {
            let message = format!("the stage has {rows} rows, but at most {MAX_ROWS} are allowed");
            let problem = Problem::new(message, name.clone(), "limit exceeded here");
            problems.push(problem.help(
                "solve fewer loads or surfaces, or split the study: studies share the results of \
                 equal tasks",
            ));
        }
        per_task.into_iter().max().unwrap_or(1)
    }

    /// Returns the name and the table without rows of each input. Returns `None` if one of these
    /// tables is unknown.
    fn tables_of(&self, inputs: &[usize]) -> Option<Vec<(String, Table)>> {
        let tables = inputs.iter().map(|&input| {
            let name = self.stages[input].name.value.clone();
            Some((name, self.validated[input].empty.clone()?))
        });
        tables.collect()
    }
}

/// Returns the valid `solve` stages among the inputs of a stage, with the surfaces that they press.
fn pressed<'a>(
    inputs: &[usize],
    table: &'a StageTable,
    validated: &'a [Validated],
    stages: &[StageTable],
    graph: &Graph,
) -> Vec<PressedStage<'a>> {
    let solved = inputs.iter().filter(|&&input| stages[input].kind == Some(Kind::Solve));
    let pressed = |&input: &usize| {
        let name = &stages[input].name.value;
        let recipes = validated[input].work.as_ref()?.recipes();
        let above = graph.inputs[input].iter().flatten();
        let works: Vec<&Work> = match &validated[input].pairs {
            Some(pairs) => vec![pairs],
            None => above.map(|&above| validated[above].work.as_ref()).collect::<Option<_>>()?,
        };
        let surfaces = works.into_iter().flat_map(|work| match work {
            Work::Generate(surfaces) => surfaces.as_slice(),
            Work::Evaluate(_) => &[],
        });
        Some(PressedStage {
            name: table.from.iter().flatten().find(|from| from.value == *name)?,
            surfaces: surfaces.collect(),
            recipes,
        })
    };
    solved.filter_map(pressed).collect()
}

/// A condition on the number of surfaces of a stage.
struct Conditional<'a> {
    stage: usize,
    growing: &'a Growing,
    written: &'a Spanned<String>,
    until: Until,
}

impl Conditional<'_> {
    fn problem(&self, message: String, label: &str) -> Problem {
        Problem::new(message, self.written.span.clone(), label)
    }
}

fn conditions(stages: &[StageTable]) -> impl Iterator<Item = Conditional<'_>> {
    stages.iter().enumerate().filter_map(|(stage, table)| {
        let growing = table.points.as_ref()?.growing()?;
        let written = &growing.until;
        let until = planned::parse(&written.value)?;
        Some(Conditional { stage, growing, written, until })
    })
}

fn index_of(stages: &[StageTable], name: &str) -> Option<usize> {
    stages.iter().position(|stage| stage.name.value == name)
}

/// Returns the indices of the stages whose tables are used by conditions on means.
fn observed_stages(stages: &[StageTable]) -> Vec<usize> {
    conditions(stages)
        .filter_map(|condition| match &condition.until {
            Until::Mean(mean) => index_of(stages, &mean.stage),
            Until::Claims(_) => None,
        })
        .collect()
}

/// Checks the conditions that decide the numbers of surfaces.
///
/// A condition on a mean must name a stage with rows for each surface. A condition on claims must
/// name claims that depend on the number of surfaces. `empty` returns the table of a stage without
/// rows, if it is known. `claims` are those of the study, if they are valid.
fn check_conditions<'t>(
    stages: &[StageTable],
    graph: &Graph,
    (empty, claims): (impl Fn(usize) -> Option<&'t Table>, Option<&[ClaimSpec]>),
    problems: &mut Problems,
) {
    for condition in conditions(stages) {
        let problem = match &condition.until {
            Until::Mean(mean) => of_mean(&condition, mean, stages, graph, &empty),
            Until::Claims(names) => claims.and_then(|known| of_claims(&condition, names, known)),
        };
        problem.into_iter().for_each(|problem| problems.push(problem));
    }
}

fn of_mean<'t>(
    condition: &Conditional,
    mean: &KnownMean,
    stages: &[StageTable],
    graph: &Graph,
    empty: &impl Fn(usize) -> Option<&'t Table>,
) -> Option<Problem> {
    let names = || stages.iter().map(|stage| stage.name.value.as_str());
    let Some(observed) = names().position(|name| name == mean.stage) else {
        let label = suggestion('`', &mean.stage, names(), "unknown stage");
        let message = format!("there is no stage `{}`", mean.stage);
        let help = format!("the stages are {}", listed(names(), "and"));
        return Some(condition.problem(message, &label).help(help));
    };
    let surfaces = &stages[condition.stage].name.value;
    if !reads(graph, observed, condition.stage) {
        let message = format!("`{}` does not read `{surfaces}`", mean.stage);
        return Some(condition.problem(message, "its rows do not depend on these surfaces"));
    }
    let table = empty(observed)?;
    if stages[observed].points.as_ref().is_some_and(|points| points.multilevel().is_some()) {
        return of_multilevel_mean(condition, mean, table);
    }
    let is_pooled = matches!(stages[observed].kind, Some(Kind::Fit | Kind::Aggregate));
    if is_pooled || !table.has(SURFACE.name) {
        let message = format!("`{}` has no rows for each surface", mean.stage);
        let label = "must be a stage with rows for each surface";
        return Some(condition.problem(message, label));
    }
    let columns = numbers(table);
    if columns.contains(&mean.column.as_str()) {
        return None;
    }
    let is_known = |column: &str| table.has(column);
    let label = needed_key(&mean.column, is_known).unwrap_or_else(|| {
        suggestion('`', &mean.column, columns.iter().copied(), "unknown column")
    });
    let message = format!("`{}` has no result column `{}`", mean.stage, mean.column);
    let help = format!("its result columns are {}", listed(columns.iter().copied(), "and"));
    Some(condition.problem(message, &label).help(help))
}

/// Returns the problem of a condition on a column that a stage with multilevel means does not have.
fn of_multilevel_mean(condition: &Conditional, mean: &KnownMean, table: &Table) -> Option<Problem> {
    let shares = table.names().into_iter().filter_map(|name| name.strip_suffix(SHARE));
    let columns: Vec<&str> = shares.collect();
    if columns.contains(&mean.column.as_str()) {
        return None;
    }
    let label = suggestion('`', &mean.column, columns.iter().copied(), "unknown column");
    let message = format!("`{}` has no mean of a column `{}`", mean.stage, mean.column);
    let help = format!("it has the means of {}", listed(columns.iter().copied(), "and"));
    Some(condition.problem(message, &label).help(help))
}

/// End of the name of the column with the share of a mesh, which every multilevel mean has.
const SHARE: &str = "_share";

fn of_claims(condition: &Conditional, names: &[String], claims: &[ClaimSpec]) -> Option<Problem> {
    let known = claims.iter().filter(|claim| claim.depends_on_surfaces());
    let known: Vec<&str> = known.map(|claim| claim.name.as_str()).collect();
    if let Some(unknown) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Some(unknown_claim(condition, unknown, &known));
    }
    if known.is_empty() {
        let message = "the manifest has no claims";
        let label = "no claim can be decided";
        return Some(condition.problem(message.to_owned(), label).help(ADD_CLAIMS));
    }
    let given = condition.growing.at_least.written();
    let at_least = given.filter(|written| (written.value as usize) < FEWEST_SURFACES)?;
    let message = format!("`at_least = {}` is too few for claims", at_least.value);
    let label = format!("at least {FEWEST_SURFACES} surfaces are needed to estimate their scatter");
    let help = format!("the default is {AT_LEAST}");
    Some(Problem::new(message, at_least.span.clone(), label).help(help))
}

/// Advice for a manifest without claims.
const ADD_CLAIMS: &str = "add a table `[claim.NAME]`, or the claims of a paper to `[study]`: \
                          `claims = \"yastrebov-2015\"`";

/// Returns the problem of a claim that the manifest does not have, or that no surface decides.
fn unknown_claim(condition: &Conditional, unknown: &str, known: &[&str]) -> Problem {
    let message = format!("there is no claim `{unknown}` that surfaces decide");
    let shipped = claims::shipped();
    let of_file = shipped.iter().find(|claim| claim.name == unknown && claim.depends_on_surfaces());
    let file = of_file.and_then(|claim| claim.file.as_deref());
    if let Some(file) = file {
        let label = "a claim of a file that the manifest does not name";
        let help = format!("add the line `claims = \"{file}\"` to `[study]`");
        return condition.problem(message, label).help(help);
    }
    let names = known.iter().copied().chain(shipped.iter().map(|claim| claim.name.as_str()));
    let label = suggestion('`', unknown, names, "unknown claim");
    let problem = condition.problem(message, &label);
    problem.help(match known {
        [] => ADD_CLAIMS,
        _ => {
            "`asperity claims` with the manifest lists its claims; those on closed forms need no \
              surfaces"
        }
    })
}

/// Returns whether the stage with index `stage` is `source` or depends on it.
fn reads(graph: &Graph, stage: usize, source: usize) -> bool {
    let mut is_above = vec![false; graph.inputs.len()];
    let mut next = vec![stage];
    while let Some(stage) = next.pop() {
        if !std::mem::replace(&mut is_above[stage], true) {
            next.extend(graph.inputs[stage].iter().flatten());
        }
    }
    is_above[source]
}

/// Returns the names of the numeric result columns of a table.
fn numbers(table: &Table) -> Vec<&str> {
    let fields = table.batch().schema_ref().fields().iter();
    let is_number = |kind: &DataType| matches!(kind, DataType::Float64 | DataType::Int64);
    let is_result = |role: Option<&String>| role.is_some_and(|role| role == Role::Result.name());
    let numbers = fields
        .filter(|field| is_number(field.data_type()) && is_result(field.metadata().get("role")));
    numbers.map(|field| field.name().as_str()).collect()
}
