//! Judges stage after stage, each with what is known of those that it reads.

use super::flow;
use super::graph::{self, Graph};
use super::{ClaimNames, Stage, Study, Work, until};
use crate::manifest::{Manifest, StageTable, StudyTable};
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::written::Section;
use asperity_manifest::written::checks::Checks;
use asperity_stages::Given;
use asperity_stages::given::Surfaces;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Kind, Rows, stacked};
use asperity_tables::table::Table;

/// Tasks of one stage.
const MOST_TASKS: usize = 1_000_000;
/// Of all stages together.
const MOST_TASKS_OF_A_STUDY: usize = 2_000_000;

/// Validates a manifest; whatever is wrong is reported.
pub fn validate(
    manifest: &Manifest,
    sources: SurfaceFiles,
    claims: ClaimNames,
    problems: &mut Problems,
) -> Option<Study> {
    let (name, seed) = validate_study(&manifest.study, problems);
    let graph = Graph::of(&manifest.stages, problems);
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
    for stage in until::looked_at(&manifest.stages) {
        validator.is_read[stage] = true;
    }
    for &stage in &graph.order {
        validator.validated[stage] =
            validator.stage(stage, graph.inputs[stage].as_deref(), problems);
    }
    let empty = |stage: usize| validator.validated[stage].empty.as_ref();
    until::check(&manifest.stages, &graph, (empty, claims), problems);
    let mut place = vec![0; graph.order.len()];
    let sorted = graph.order.iter().enumerate();
    sorted.for_each(|(position, &stage)| place[stage] = position);
    let stages = graph.order.iter().map(|&stage| {
        let inputs = graph.inputs[stage].as_deref()?;
        Some(Stage {
            name: manifest.stages[stage].name.value.clone(),
            inputs: inputs.iter().map(|&input| place[input]).collect(),
            work: validator.validated[stage].work.take()?,
        })
    });
    Some(Study { name: name?, stages: stages.collect::<Option<_>>()?, sources: validator.sources })
}

/// Name and seed.
fn validate_study(section: &Section<StudyTable>, problems: &mut Problems) -> (Option<String>, u64) {
    let Some(point) = section.points.first() else {
        return (None, 0);
    };
    let mut checks = Checks::of(section, point, problems);
    let seed = checks.whole_or("seed", &point.table.seed, 0..=i64::MAX as u64, 0);
    let name = checks.required("name", &point.table.name);
    if let Some(name) = name {
        graph::check_name("study", &name.value, name.span.clone(), problems);
    }
    (name.map(|name| name.value.clone()), seed.unwrap_or(0))
}

/// What is known of a stage once it has been validated.
#[derive(Default)]
struct Validated {
    rows: Option<Rows>,
    surfaces: Surfaces,
    work: Option<Work>,
    /// Its table without rows, if another stage reads it.
    empty: Option<Table>,
    tasks: usize,
}

struct Validator<'a> {
    stages: &'a [StageTable],
    seed: u64,
    sources: SurfaceFiles,
    /// Whether another stage, or a condition, reads it, by the stage's position in the manifest.
    is_read: Vec<bool>,
    /// Tasks of the stages so far, or inputs of tasks, whichever are more.
    tasks: usize,
    /// By the stage's position in the manifest; those that a stage reads are there before it.
    validated: Vec<Validated>,
}

impl Validator<'_> {
    fn stage(
        &mut self,
        stage: usize,
        inputs: Option<&[usize]>,
        problems: &mut Problems,
    ) -> Validated {
        let table = &self.stages[stage];
        let is_read = self.is_read[stage];
        let inputs = inputs.unwrap_or_default();
        let flowing: Vec<_> = inputs
            .iter()
            .map(|&input| (self.stages[input].name.value.as_str(), self.validated[input].rows))
            .collect();
        let points = table.points.as_ref();
        let is_query = points.is_some_and(|points| points.is_query());
        let (rows_read, rows) = flow::check(table, &flowing, is_query, problems);
        // A stage whose inputs are not known has columns that are not known either.
        let is_fed = !inputs.is_empty() || table.kind == Some(Kind::Generate);
        let read = self.tables_of(inputs).filter(|_| is_fed);
        let stacked = read.as_deref().and_then(|read| stacked(read).ok());
        let stacked = stacked.filter(|table| !table.names().is_empty());
        let above = inputs.iter().map(|&input| &self.validated[input].surfaces);
        let above = above.fold(Surfaces::default(), Surfaces::and);
        // What is drawn with a spectrum is another surface than the one that was measured.
        let surfaces = match table.kind {
            Some(Kind::Generate) => Surfaces::default(),
            _ => above,
        };
        let mut given = Given {
            surfaces: surfaces.clone(),
            seed: self.seed,
            sources: &mut self.sources,
            reads_stages: table.from.as_ref().is_none_or(|from| !from.is_empty()),
            read: rows_read,
            input: stacked.as_ref(),
            problems,
        };
        let work = points.and_then(|points| points.work(&mut given));
        let above = inputs.iter().map(|&input| self.validated[input].tasks);
        let above = above.fold(0, usize::saturating_add);
        let tasks = work.as_ref().map_or(0, |work| work.tasks(above));
        self.count(tasks, above, &table.name.span, problems);
        let empty = work
            .as_ref()
            .zip(read)
            .filter(|_| is_read || is_query)
            .map(|(work, read)| (work.empty_table(&read), read));
        let empty = empty
            .zip(points)
            .and_then(|((empty, read), points)| points.validate_answer(empty, &read, problems));
        let made = work.as_ref().map(|work| Surfaces::made_by(&table.name.value, work));
        Validated { rows, surfaces: surfaces.and(&made.unwrap_or_default()), work, empty, tasks }
    }

    /// Refuses a stage of too many tasks, and the stage with which a study has too many.
    fn count(&mut self, tasks: usize, above: usize, name: &Span, problems: &mut Problems) {
        let before = self.tasks;
        self.tasks = before.saturating_add(tasks.max(above));
        let (message, label) = if tasks > MOST_TASKS {
            (
                format!("the stage has {tasks} tasks, {MOST_TASKS} is the most"),
                "its grid and those that it reads multiply",
            )
        } else if self.tasks > MOST_TASKS_OF_A_STUDY && before <= MOST_TASKS_OF_A_STUDY {
            (
                format!("the study has more than {MOST_TASKS_OF_A_STUDY} tasks"),
                "up to this stage; make several studies of it, which share what is equal",
            )
        } else {
            return;
        };
        problems.push(Problem::new(message, name.clone(), label));
    }

    /// The tables of a stage's inputs without rows, where they are known.
    fn tables_of(&self, inputs: &[usize]) -> Option<Vec<(String, Table)>> {
        let tables = inputs.iter().map(|&input| {
            let name = self.stages[input].name.value.clone();
            Some((name, self.validated[input].empty.clone()?))
        });
        tables.collect()
    }
}
