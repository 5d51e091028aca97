//! Validation of the stages, each after its inputs, and of the conditions on numbers of surfaces.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use crate::manifest::composition::EffectiveManifest;
use crate::manifest::{Manifest, StageTable, StudyTable};
use crate::study::claims::files::{self, FileError};
use crate::study::claims::{self, ClaimContext, ClaimSpec};
use crate::study::columns::{StageTables, is_number};
use crate::study::figures;
use crate::study::graph::Graph;
use crate::study::{EmptyTables, Stage, Study, Work, graph, multilevel, pairs, units};
use asperity_manifest::diagnostics::{ManifestErrors, Problem, Problems, listed, suggestion};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Section, Spanned};
use asperity_stages::check_context::{PressedStage, Surfaces};
use asperity_stages::columns::{SURFACE, needed_key};
use asperity_stages::surface::Origin;
use asperity_stages::surface::labels::Labels;
use asperity_stages::surface::planned::{
    self, AT_LEAST, Growing, KnownMean, PlannedSurfaces, Until,
};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::units::TableUnits;
use asperity_stages::{CheckContext, Kind, RowKind, stacked};
use asperity_statistics::intervals::FEWEST_SURFACES;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// Maximum number of tasks of a study.
const MAX_TASKS: usize = 2_000_000;

/// Validates a manifest and reports all problems. Returns `None` if it is invalid. Files of claims
/// are relative to `folder`.
///
/// # Errors
/// Returns the mistakes in a file of claims.
pub fn validate(
    manifest: &Manifest,
    sources: SurfaceFiles,
    folder: &Path,
    problems: &mut Problems,
) -> Result<Option<Study>, Box<ManifestErrors>> {
    let (name, seed) = validate_study(&manifest.study, problems);
    let graph = Graph::new(&manifest.stages, problems);
    let mut validator = Validator {
        stages: &manifest.stages,
        seed,
        sources,
        tasks: 0,
        validated: manifest.stages.iter().map(|_| Validated::default()).collect(),
    };
    for &stage in &graph.order {
        validator.validated[stage] = validator.stage(stage, &graph, problems);
        validator.check_multilevel(stage, &graph, problems);
    }
    validator.check_labels(problems);
    let (stages, is_complete) = validator.sorted_stages(&graph);
    let stored = units::of_stages(&stages);
    let study = Study {
        name: name.unwrap_or_default(),
        output_units: units::output(&manifest.study, is_complete.then_some(&stored), problems),
        stages,
        figures: Vec::new(),
        claims: Vec::new(),
        sources: validator.sources,
        manifest: EffectiveManifest::default(),
    };
    let index = |name: &str| study.stages.iter().position(|stage| stage.name == name);
    let tables = EmptyTables::new(&study);
    let empty = |name: &str| tables.of(&study, index(name)?).ok();
    // Figures and claims read published tables.
    let published: Vec<OnceLock<Option<Table>>> =
        study.stages.iter().map(|_| OnceLock::new()).collect();
    let table = |name: &str| {
        let table = || Some(study.absolute_columns(&tables, name).ok()?.0.beside(empty(name)?));
        published[index(name)?].get_or_init(table).as_ref()
    };
    let names: Vec<&str> = manifest.stages.iter().map(|stage| stage.name.value.as_str()).collect();
    let units = |name: &str| index(name).map_or_else(TableUnits::default, |_| study.units_of(name));
    let tables = StageTables { stages: &names, table: &table, units: &units };
    let figures = figures::check(&manifest.figures, tables, problems);
    let claims = read_claims(manifest, folder, tables, problems)?;
    for (surfaces, table) in manifest.stages.iter().enumerate() {
        let Some(growing) = table.points.as_ref().and_then(|points| points.growing()) else {
            continue;
        };
        let problem = match planned::parse(&growing.until.value) {
            Some(Until::Mean(mean)) => {
                of_mean(growing, &mean, manifest, (surfaces, &graph), &empty)
            }
            Some(Until::Claims(names)) => {
                claims.as_ref().and_then(|known| of_claims(growing, &names, known))
            }
            None => None,
        };
        problem.into_iter().for_each(|problem| problems.push(problem));
    }
    let parts = figures.zip(claims).filter(|_| is_complete && !study.name.is_empty());
    Ok(parts.map(|(figures, claims)| Study { figures, claims, ..study }))
}

/// Reads the claims of the files that the manifest names, and those of the manifest. Returns `None`
/// after reporting problems of the manifest.
///
/// # Errors
/// Returns the mistakes in a file.
fn read_claims(
    manifest: &Manifest,
    folder: &Path,
    tables: StageTables,
    problems: &mut Problems,
) -> Result<Option<Vec<ClaimSpec>>, Box<ManifestErrors>> {
    let named = manifest.study.points.first().and_then(|point| point.table.claims.written());
    let mut all: Vec<ClaimSpec> = Vec::new();
    let mut is_complete = true;
    for file in named.into_iter().flat_map(|files| &files.value) {
        match files::read(&file.value, file.span.clone(), folder, tables) {
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
    let reference = &|table: &str| files::read_text(&folder.join(table));
    let context = ClaimContext { file: None, tables, reference };
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
        graph::check_names("study", [name], problems);
    }
    (name.map(|name| name.value.clone()), seed.unwrap_or(0))
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
}

impl Validated {
    /// Returns the surfaces that the stage generates, by parameter point.
    fn surfaces_made(&self) -> Option<&[PlannedSurfaces]> {
        self.work.as_ref().map(Work::surfaces)
    }
}

struct Validator<'a> {
    stages: &'a [StageTable],
    seed: u64,
    sources: SurfaceFiles,
    /// Total over the validated stages. Each stage counts with the number of its tasks or of the
    /// tasks of its inputs, whichever is larger.
    tasks: usize,
    /// Validated stages by their index in the manifest. Inputs are validated before the stages that
    /// read them.
    validated: Vec<Validated>,
}

impl Validator<'_> {
    /// Refuses a surface that has other labels in another stage. The tables of a surface are
    /// computed once, and get their labels by its name.
    fn check_labels(&self, problems: &mut Problems) {
        let mut known: BTreeMap<String, (&Labels, &Spanned<String>)> = BTreeMap::new();
        let none = Labels::default();
        for (table, validated) in self.stages.iter().zip(&self.validated) {
            let surfaces = validated.surfaces_made().into_iter().flatten();
            let params = surfaces.map(|surfaces| &surfaces.params);
            for params in params.filter(|params| matches!(params.origin, Origin::File(_))) {
                let labels = params.origin.labels().unwrap_or(&none);
                let key = params.surface_key().to_string();
                let (before, first) = *known.entry(key).or_insert((labels, &table.name));
                if before != labels {
                    let content = params.origin.content();
                    let path = content.and_then(|content| self.sources.path_of(content));
                    let message = format!(
                        "`{}` is the same surface in `{}` and `{}`, with other labels or another \
                         `samples`",
                        path.unwrap_or(Path::new("")).display(),
                        first.value,
                        table.name.value
                    );
                    let span = table.name.span.clone();
                    let problem = Problem::new(message, span, "labelled differently")
                        .and(first.span.clone(), "labelled first");
                    let help = "let other stages read one of the two stages";
                    return problems.push(problem.help(help));
                }
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
        let is_read = graph.inputs.iter().flatten().any(|inputs| inputs.contains(&stage));
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
        let before = self.tasks;
        self.tasks = before.saturating_add(tasks.max(above));
        if self.tasks > MAX_TASKS && before <= MAX_TASKS {
            let message = format!("the study has more than {MAX_TASKS} tasks");
            let label = format!("this stage has {tasks} of them");
            let help = "sweep fewer values, because the parameter points of a stage multiply with \
                        those of its inputs, or split the study: studies share the results of equal \
                        tasks";
            problems.push(Problem::new(message, table.name.span.clone(), label).help(help));
        }
        let computed = work.as_ref().zip(read).filter(|_| is_read || is_query);
        let empty = computed.zip(points).and_then(|((work, read), points)| {
            points.validate_answer(work.empty_table(&read), &read, problems)
        });
        let made = work.as_ref().map(|work| Surfaces::made_by(&table.name.value, work));
        let surfaces = inherited.and(&made.unwrap_or_default());
        Validated { rows, surfaces, work, pairs, empty, earlier, tasks }
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
        Some(PressedStage {
            name: table.from.iter().flatten().find(|from| from.value == *name)?,
            surfaces: works.into_iter().flat_map(Work::surfaces).collect(),
            recipes,
        })
    };
    solved.filter_map(pressed).collect()
}

fn index_of(stages: &[StageTable], name: &str) -> Option<usize> {
    stages.iter().position(|stage| stage.name.value == name)
}

/// Returns the problem of a condition on a mean, which must be that of a column of a stage with
/// rows for each surface of the stage `surfaces`. `empty` returns the table of a stage without
/// rows, if it is known.
fn of_mean<'t>(
    growing: &Growing,
    mean: &KnownMean,
    manifest: &Manifest,
    (surfaces, graph): (usize, &Graph),
    empty: &impl Fn(&str) -> Option<&'t Table>,
) -> Option<Problem> {
    let problem =
        |message: String, label: &str| Problem::new(message, growing.until.span.clone(), label);
    let names = || manifest.stages.iter().map(|stage| stage.name.value.as_str());
    let Some(observed) = names().position(|name| name == mean.stage) else {
        let label = suggestion('`', &mean.stage, names(), "unknown stage");
        let help = format!("the stages are {}", listed(names(), "and"));
        return Some(problem(format!("there is no stage `{}`", mean.stage), &label).help(help));
    };
    let [stage, grown] = [observed, surfaces].map(|index| &manifest.stages[index]);
    if !reads(graph, observed, surfaces) {
        let message = format!("`{}` does not read `{}`", mean.stage, grown.name.value);
        return Some(problem(message, "its rows do not depend on these surfaces"));
    }
    let table = empty(&mean.stage)?;
    let is_multilevel = stage.points.as_ref().is_some_and(|points| points.multilevel().is_some());
    let is_pooled = matches!(stage.kind, Some(Kind::Fit | Kind::Aggregate));
    let columns: Vec<&str> = if is_multilevel {
        // Every multilevel mean has a column with the share of a mesh.
        table.names().into_iter().filter_map(|name| name.strip_suffix("_share")).collect()
    } else if is_pooled || !table.has(SURFACE.name) {
        let message = format!("`{}` has no rows for each surface", mean.stage);
        return Some(problem(message, "must be a stage with rows for each surface"));
    } else {
        let fields = table.batch().schema_ref().fields().iter();
        let results = fields.filter(|field| {
            Role::from_field(field) == Some(Role::Result) && is_number(table, field.name())
        });
        results.map(|field| field.name().as_str()).collect()
    };
    if columns.contains(&mean.column.as_str()) {
        return None;
    }
    let label = needed_key(&mean.column, |column| table.has(column)).unwrap_or_else(|| {
        suggestion('`', &mean.column, columns.iter().copied(), "unknown column")
    });
    let message = format!("`{}` has no mean of a column `{}`", mean.stage, mean.column);
    let help = format!("it has the means of {}", listed(columns, "and"));
    Some(problem(message, &label).help(help))
}

/// Returns the problem of a condition on claims, which must depend on the number of surfaces.
fn of_claims(growing: &Growing, names: &[String], claims: &[ClaimSpec]) -> Option<Problem> {
    let of_surfaces = claims.iter().filter(|claim| claim.depends_on_surfaces());
    let known: Vec<&str> = of_surfaces.map(|claim| claim.name.as_str()).collect();
    let (message, label) = match names.iter().find(|name| !known.contains(&name.as_str())) {
        Some(unknown) => {
            let label = suggestion('`', unknown, known.iter().copied(), "unknown claim");
            (format!("there is no claim `{unknown}` that surfaces decide"), label)
        }
        None if known.is_empty() => {
            ("the manifest has no claims".to_owned(), "no claim can be decided".to_owned())
        }
        None => {
            let given = growing.at_least.written();
            let at_least = given.filter(|written| (written.value as usize) < FEWEST_SURFACES)?;
            let message = format!("`at_least = {}` is too few for claims", at_least.value);
            let label =
                format!("at least {FEWEST_SURFACES} surfaces are needed to estimate their scatter");
            let help = format!("the default is {AT_LEAST}");
            return Some(Problem::new(message, at_least.span.clone(), label).help(help));
        }
    };
    let help = "add the line `claims = \"yastrebov-2015\"` to `[study]` for the claims of a paper; \
                `asperity claims` with the manifest lists those that it has";
    Some(Problem::new(message, growing.until.span.clone(), label).help(help))
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
