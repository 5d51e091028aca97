//! Graph of the stages, with checks of their names, their inputs and the kinds of rows.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::manifest::StageTable;
use asperity_manifest::diagnostics::{Problem, Problems, listed, suggestion};
use asperity_manifest::keys::Spanned;
use asperity_manifest::names;
use asperity_manifest::names::{MAX_LENGTH, is_plain};
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
        check_names(stages, problems);
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
        let pairs = inputs.iter().zip(&against);
        let read = pairs.map(|(inputs, against)| {
            inputs.as_ref().map(|inputs| inputs.iter().chain(against).copied().collect())
        });
        let mut order = sorted(&read.collect::<Vec<_>>());
        if order.len() < stages.len() {
            report_cycle(stages, &inputs, &order, problems);
            let mut is_sorted = vec![false; stages.len()];
            order.iter().for_each(|&stage| is_sorted[stage] = true);
            for stage in (0..stages.len()).filter(|&stage| !is_sorted[stage]) {
                inputs[stage] = None;
                order.push(stage);
            }
        }
        Graph { inputs, against, order }
    }
}

fn check_names(stages: &[StageTable], problems: &mut Problems) {
    let mut folded = BTreeMap::new();
    for Spanned { value, span } in stages.iter().map(|stage| &stage.name) {
        check_name("stage", value, span.clone(), problems);
        if value.eq_ignore_ascii_case(names::FAILURES) {
            let message = format!("a stage cannot be called `{value}`");
            let label = "this name is reserved for the table of failed tasks";
            problems.push(Problem::new(message, span.clone(), label));
        }
        let before = folded.insert(value.to_lowercase(), span);
        if let Some(before) = before {
            problems.push(
                Problem::new(
                    format!("stage name `{value}` differs from another one only in case"),
                    span.clone(),
                    "the same name in another case",
                )
                .and(before.clone(), "first name")
                .help(
                    "rename one stage: some file systems treat `area.parquet` and `Area.parquet` \
                     as the same file",
                ),
            );
        }
    }
}

/// Checks a name that becomes the name of a file and of a table in SQL queries. `what` says in
/// messages what the name belongs to, such as `stage`.
pub fn check_name(
    what: &str,
    name: &str,
    span: asperity_manifest::diagnostics::Span,
    problems: &mut Problems,
) {
    let (message, label) = if name.len() > MAX_LENGTH {
        (format!("the name of the {what} is too long"), "too long")
    } else if !is_plain(name) {
        (format!("{name:?} is not a valid name of a {what}"), "invalid name")
    } else {
        return;
    };
    let help = format!(
        "a name starts with a letter or `_`, continues with letters, digits, `_` or `-`, and has at \
         most {MAX_LENGTH} characters"
    );
    problems.push(Problem::new(message, span, label).help(help));
}

/// Returns the indices of the stages that `stage` reads, or `None` if one of them is invalid.
/// `names` has the indices of all stages by name.
fn resolve(
    stage: &StageTable,
    names: &BTreeMap<&str, usize>,
    problems: &mut Problems,
) -> Option<Vec<usize>> {
    let mut inputs = Vec::new();
    let mut seen = BTreeMap::new();
    let mut complete = true;
    for Spanned { value, span } in stage.from.as_ref()? {
        if problems.is_full() {
            return None;
        }
        let Some(&input) = names.get(value.as_str()) else {
            problems.push(unknown_stage(value, span, stage, names));
            complete = false;
            continue;
        };
        match seen.insert(input, span) {
            None => inputs.push(input),
            Some(before) => problems.push(
                Problem::new(
                    format!("`from` names `{value}` twice"),
                    span.clone(),
                    "repeated here",
                )
                .and(before.clone(), "first here"),
            ),
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
    span: &asperity_manifest::diagnostics::Span,
    stage: &StageTable,
    names: &BTreeMap<&str, usize>,
) -> Problem {
    let others = || names.keys().copied().filter(|other| *other != stage.name.value);
    let label = suggestion('`', name, others(), "unknown stage");
    let problem = Problem::new(format!("there is no stage {name:?}"), span.clone(), label);
    problem.help(format!("the other stages are {}", listed(others(), "and")))
}

/// Sorts the stages such that each comes after its inputs. Stages in a cycle, and those that depend
/// on one, are omitted.
fn sorted(inputs: &[Option<Vec<usize>>]) -> Vec<usize> {
    let mut readers = vec![Vec::new(); inputs.len()];
    let mut waiting = vec![0; inputs.len()];
    for (stage, inputs) in inputs.iter().enumerate() {
        for &input in inputs.iter().flatten() {
            readers[input].push(stage);
            waiting[stage] += 1;
        }
    }
    let mut ready: BinaryHeap<Reverse<usize>> =
        (0..inputs.len()).filter(|&stage| waiting[stage] == 0).map(Reverse).collect();
    let mut order = Vec::with_capacity(inputs.len());
    while let Some(Reverse(stage)) = ready.pop() {
        order.push(stage);
        for &reader in &readers[stage] {
            waiting[reader] -= 1;
            if waiting[reader] == 0 {
                ready.push(Reverse(reader));
            }
        }
    }
    order
}

/// Reports one cycle among the stages that could not be sorted.
fn report_cycle(
    stages: &[StageTable],
    inputs: &[Option<Vec<usize>>],
    sorted: &[usize],
    problems: &mut Problems,
) {
    let mut is_sorted = vec![false; stages.len()];
    sorted.iter().for_each(|&stage| is_sorted[stage] = true);
    let Some(mut stage) = is_sorted.iter().position(|sorted| !sorted) else {
        return;
    };
    // Each unsorted stage reads another unsorted one, so following the inputs leads into a cycle.
    let mut path = Vec::new();
    let mut position = vec![None; stages.len()];
    while position[stage].is_none() {
        position[stage] = Some(path.len());
        path.push(stage);
        let upstream = inputs[stage].iter().flatten();
        match upstream.copied().find(|&input| !is_sorted[input]) {
            Some(input) => stage = input,
            None => return,
        }
    }
    let cycle = &path[position[stage].unwrap_or(0)..];
    let link = |index: usize| {
        let (reader, input) = (&stages[cycle[index]], &stages[cycle[(index + 1) % cycle.len()]]);
        let from = reader.from.iter().flatten().find(|from| from.value == input.name.value)?;
        Some((reader.name.value.as_str(), from.span.clone()))
    };
    let links: Vec<_> = (0..cycle.len()).filter_map(link).collect();
    let problem = match links.as_slice() {
        [(name, span)] => {
            let message = format!("stage `{name}` reads itself");
            Problem::new(message, span.clone(), format!("`{name}` reads `{name}`"))
        }
        links => Problem::cycle("stages read each other in a cycle", "reads", links),
    };
    problems.push(
        problem
            .help("remove one of these inputs: results flow one way, from surfaces to statistics"),
    );
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
        let problem = |message| {
            let label = format!("this stage provides {}", rows.name());
            let help = match rows {
                RowKind::Spectra => {
                    "set `heights = \"redraw\"` in that stage so that it provides surfaces"
                        .to_owned()
                }
                RowKind::Profiles if kind == Kind::Solve => {
                    "a profile cannot be pressed; a `measure` stage with \
                     `what = \"spectrum-from-profiles\"` gives the spectrum of the surface, from which \
                     `method = \"spectrum\"` draws surfaces"
                        .to_owned()
                }
                _ if read.is_some_and(|(_, before)| before != rows)
                    && reads.rows.contains(&rows) =>
                {
                    "all stages in `from` must provide the same kind of rows; only an `aggregate` \
                     stage with `sql` can combine different kinds"
                        .to_owned()
                }
                _ => format!("{} reads {}", with_article(kind), reads.from),
            };
            Problem::new(message, from.span.clone(), label).help(help)
        };
        match read {
            _ if !reads.rows.contains(&rows) => {
                problems.push(problem(format!(
                    "{} cannot read {}",
                    with_article(kind),
                    rows.name()
                )));
            }
            Some((other, before)) if before != rows && !mixes => {
                problems.push(problem(format!(
                    "cannot combine the tables of `{other}` and `{name}`: they hold {} and {}",
                    before.name(),
                    rows.name()
                )));
            }
            _ => read = Some((name, rows)),
        }
    }
    let rows = read.map(|(_, rows)| rows);
    let made = points.and_then(|points| points.row_kind());
    (rows, made.or_else(|| (kind.definition().row_kind)(rows)))
}
