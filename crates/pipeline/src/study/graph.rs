//! Graph of the stages, with checks of their names, their inputs and the kinds of rows.

use std::collections::BTreeMap;

use crate::manifest::StageTable;
use asperity_manifest::diagnostics::{Problem, Problems, Span, listed, suggestion};
use asperity_manifest::keys::Spanned;
use asperity_manifest::names::{FAILURES, MAX_LENGTH, is_plain};
use asperity_stages::registry::with_article;
use asperity_stages::{Kind, RowKind};

/// Directed graph of the stages of a manifest.
pub struct Graph {
    /// Indices of the inputs of each stage, in the order of the file. `None` if one is invalid.
    pub inputs: Vec<Option<Vec<usize>>>,
    /// Index of the stage that `against` or `height_distribution` names.
    pub against: Vec<Option<usize>>,
    /// Indices of the stages: each stage after its inputs, otherwise in the order of the file.
    pub order: Vec<usize>,
}

impl Graph {
    /// Creates the graph, and reports invalid names, unknown inputs and cycles.
    pub fn new(stages: &[StageTable], problems: &mut Problems) -> Graph {
        check_names("stage", stages.iter().map(|stage| &stage.name), problems);
        for Spanned { value, span } in stages.iter().map(|stage| &stage.name) {
            if value.eq_ignore_ascii_case(FAILURES) {
                let message = format!("a stage cannot be called `{value}`");
                let label = "this name is reserved for the table of failed tasks";
                problems.push(Problem::new(message, span.clone(), label));
            }
        }
        let indexed = stages.iter().enumerate();
        let names: BTreeMap<&str, usize> =
            indexed.map(|(index, stage)| (stage.name.value.as_str(), index)).collect();
        let mut inputs: Vec<Option<Vec<usize>>> =
            stages.iter().map(|stage| resolve(stage, &names, problems)).collect();
        let mut against = vec![None; stages.len()];
        for (index, stage) in stages.iter().enumerate() {
            let points = stage.points.as_ref();
            let named = points.and_then(|points| points.against().or(points.heights_of()));
            if let Some(name) = named {
                against[index] = resolve_against(stage, name, stages, &names, problems);
                if against[index].is_none() {
                    inputs[index] = None;
                }
            }
        }
        let mut order: Vec<usize> = Vec::with_capacity(stages.len());
        let is_next = |order: &[usize], stage: usize| {
            let mut read = inputs[stage].iter().flatten().chain(&against[stage]);
            !order.contains(&stage) && read.all(|input| order.contains(input))
        };
        while let Some(next) = (0..stages.len()).find(|&stage| is_next(&order, stage)) {
            order.push(next);
        }
        if order.len() < stages.len() {
            report_cycle(stages, &inputs, &order, problems);
            let left: Vec<usize> = (0..stages.len()).filter(|at| !order.contains(at)).collect();
            left.iter().for_each(|&stage| inputs[stage] = None);
            order.extend(left);
        }
        Graph { inputs, against, order }
    }
}

/// Checks names that become names of files and of tables in SQL queries. `what` says in messages
/// what the names belong to, such as `stage`.
pub fn check_names<'a>(
    what: &str,
    names: impl IntoIterator<Item = &'a Spanned<String>>,
    problems: &mut Problems,
) {
    let mut folded = BTreeMap::new();
    for Spanned { value, span } in names {
        if value.len() > MAX_LENGTH || !is_plain(value) {
            let message = format!("{value:?} is not a valid name of a {what}");
            let help = format!(
                "a name starts with a letter or `_`, continues with letters, digits, `_` or `-`, \
                 and has at most {MAX_LENGTH} characters"
            );
            problems.push(Problem::new(message, span.clone(), "invalid name").help(help));
        }
        if let Some(before) = folded.insert(value.to_lowercase(), span) {
            let message = format!("{what} name `{value}` differs from another one only in case");
            let problem = Problem::new(message, span.clone(), "the same name in another case");
            problems.push(problem.and(before.clone(), "first name").help(
                "rename one of them: some file systems treat `area.parquet` and `Area.parquet` as \
                 the same file",
            ));
        }
    }
}

/// Returns the indices of the stages that `stage` reads, or `None` if one of them is invalid.
/// `names` has the indices of all stages by name.
fn resolve(
    stage: &StageTable,
    names: &BTreeMap<&str, usize>,
    problems: &mut Problems,
) -> Option<Vec<usize>> {
    let mut inputs = Vec::new();
    let mut complete = true;
    for Spanned { value, span } in stage.from.as_ref()? {
        match names.get(value.as_str()) {
            Some(input) if inputs.contains(input) => {
                let message = format!("`from` names `{value}` twice");
                problems.push(Problem::new(message, span.clone(), "repeated here"));
            }
            Some(&input) => inputs.push(input),
            None => {
                problems.push(unknown_stage(value, span, stage, names));
                complete = false;
            }
        }
    }
    complete.then_some(inputs)
}

/// Returns the index of the stage in `against` or `height_distribution`, or `None` if it does not
/// generate surfaces on its own.
fn resolve_against(
    stage: &StageTable,
    name: &Spanned<String>,
    stages: &[StageTable],
    names: &BTreeMap<&str, usize>,
    problems: &mut Problems,
) -> Option<usize> {
    let Some(&index) = names.get(name.value.as_str()) else {
        problems.push(unknown_stage(&name.value, &name.span, stage, names));
        return None;
    };
    let other = &stages[index];
    let (kind, from) = (other.kind?, other.from.as_ref()?);
    let reads = other.points.as_ref().and_then(|points| points.reads());
    let has_measured_spectrum =
        !from.is_empty() && reads.is_some_and(|reads| reads.rows == [RowKind::PowerSpectra]);
    let is_modal =
        other.points.as_ref().and_then(|points| points.row_kind()) == Some(RowKind::Spectra);
    let problem = |label: String| {
        let wanted = match stage.kind {
            Some(Kind::Generate) => "heights whose distribution is known before a run",
            _ => "surfaces to press against",
        };
        let message = format!("`{}` has no {wanted}", name.value);
        Problem::new(message, name.span.clone(), label)
    };
    let refused = match kind {
        Kind::Generate if is_modal => problem("its surfaces have no heights".to_owned())
            .help("set `heights = \"redraw\"` in that stage"),
        Kind::Generate if has_measured_spectrum => problem(
            "its spectrum is measured in this study".to_owned(),
        )
        .help(
            "its surfaces cannot be drawn again; write the spectrum to a file and name it by `path` \
             in that stage",
        ),
        Kind::Generate => return Some(index),
        _ => problem(format!("must be a `generate` stage, but is {}", with_article(kind))),
    };
    problems.push(refused);
    None
}

fn unknown_stage(
    name: &str,
    span: &Span,
    stage: &StageTable,
    names: &BTreeMap<&str, usize>,
) -> Problem {
    let others = || names.keys().copied().filter(|other| *other != stage.name.value);
    let label = suggestion('`', name, others(), "unknown stage");
    let problem = Problem::new(format!("there is no stage {name:?}"), span.clone(), label);
    problem.help(format!("the other stages are {}", listed(others(), "and")))
}

/// Reports one cycle among the stages that could not be sorted.
fn report_cycle(
    stages: &[StageTable],
    inputs: &[Option<Vec<usize>>],
    sorted: &[usize],
    problems: &mut Problems,
) {
    // Each unsorted stage reads another unsorted one, so following the inputs leads into a cycle.
    let unsorted = |stages: &[usize]| stages.iter().copied().find(|at| !sorted.contains(at));
    let next = |stage: usize| unsorted(inputs[stage].as_deref()?);
    let all: Vec<usize> = (0..stages.len()).collect();
    let mut path: Vec<usize> = Vec::new();
    let mut stage = unsorted(&all);
    while let Some(last) = stage.filter(|last| !path.contains(last)) {
        path.push(last);
        stage = next(last);
    }
    let Some(first) = stage else { return };
    let cycle = path.into_iter().skip_while(|at| *at != first);
    let links = cycle.filter_map(|reader| {
        let input = &stages[next(reader)?].name.value;
        let from = stages[reader].from.iter().flatten().find(|from| from.value == *input)?;
        Some((stages[reader].name.value.as_str(), from.span.clone()))
    });
    let problem = match &links.collect::<Vec<_>>()[..] {
        [(name, span)] => {
            let message = format!("stage `{name}` reads itself");
            Problem::new(message, span.clone(), format!("`{name}` reads `{name}`"))
        }
        links => Problem::cycle("stages read each other in a cycle", "reads", links),
    };
    let help = "remove one of these inputs: results flow one way, from surfaces to statistics";
    problems.push(problem.help(help));
}

/// Checks the kinds of rows that a stage reads, and returns the kind that it reads and the kind
/// that it writes. `None` means that a kind is unknown.
///
/// `inputs` has the name of each input and the kind of its rows. If `mixes` is true, the stage may
/// read several kinds.
pub fn check_flow(
    stage: &StageTable,
    inputs: &[(&str, Option<RowKind>)],
    mixes: bool,
    problems: &mut Problems,
) -> (Option<RowKind>, Option<RowKind>) {
    let Some(kind) = stage.kind else {
        return (None, None);
    };
    let points = stage.points.as_ref();
    let reads =
        points.and_then(|points| points.reads()).unwrap_or_else(|| kind.definition().reads.clone());
    let mut read: Option<(&str, RowKind)> = None;
    for (name, rows) in inputs {
        let from = stage.from.iter().flatten().find(|from| from.value == *name);
        let (Some(from), Some(rows)) = (from, *rows) else {
            continue;
        };
        let message = match read {
            _ if !reads.rows.contains(&rows) => {
                format!("{} cannot read {}", with_article(kind), rows.name())
            }
            Some((other, before)) if before != rows && !mixes => format!(
                "cannot combine the tables of `{other}` and `{name}`: they hold {} and {}",
                before.name(),
                rows.name()
            ),
            _ => {
                read = Some((name, rows));
                continue;
            }
        };
        let help = match rows {
            RowKind::Spectra => {
                "set `heights = \"redraw\"` in that stage so that it provides surfaces".to_owned()
            }
            RowKind::Profiles if kind == Kind::Solve => {
                "a profile cannot be pressed; a `measure` stage with \
                 `what = \"spectrum-from-profiles\"` gives the spectrum of the surface, from which \
                 `method = \"spectrum\"` draws surfaces"
                    .to_owned()
            }
            _ if reads.rows.contains(&rows) => {
                "all stages in `from` must provide the same kind of rows; only an `aggregate` \
                 stage with `sql` can combine different kinds"
                    .to_owned()
            }
            _ => format!("{} reads {}", with_article(kind), reads.from),
        };
        let label = format!("this stage provides {}", rows.name());
        problems.push(Problem::new(message, from.span.clone(), label).help(help));
    }
    let rows = read.map(|(_, rows)| rows);
    let made = points.and_then(|points| points.row_kind());
    (rows, made.or_else(|| (kind.definition().row_kind)(rows)))
}
