//! `asperity init`, `check`, `plan` and `explain`: write and validate manifests, and list tasks
//! with their costs and reasons.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::available_parallelism;
use std::time::Duration;

use serde_json::{Value, json};

use super::tables::write_json;
use super::terminal::{in_columns, stdout};
use super::{Failure, StudyArguments, misused, print_json};
use crate::session::formatting::{counted, duration, shell_word};
use crate::session::status::{StageCount, StageStatus, TasksFromStore, growing};
use crate::session::{DataFolder, Plan, SessionError, Status, StoreError, name_lookup};
use asperity_manifest::names;
use asperity_pipeline::manifest::{SCHEMA, schema, template};

/// Maximum number of reasons printed per stage; `--json` prints all.
const MAX_REASONS: usize = 20;

#[derive(clap::Args)]
pub(crate) struct InitArguments {
    /// Name of the study.
    ///
    /// The command writes `NAME.toml` and `asperity.schema.json` into the current folder. Editors
    /// use the schema to complete and check manifests. Existing files are not changed.
    #[arg(default_value = "study")]
    name: String,
}

pub(crate) fn init(arguments: &InitArguments) -> Result<ExitCode, Failure> {
    let name = &arguments.name;
    if !names::is_plain(name) || name.len() > names::MAX_LENGTH {
        return Err(misused(format!(
            "`{name}` must be a letter or `_`, then letters, digits, `_` and `-`, at most {} in \
             all",
            names::MAX_LENGTH
        )));
    }
    let manifest = PathBuf::from(format!("{name}.toml"));
    if !write_new(&manifest, &template(name))? {
        let path = manifest.display();
        return Err(misused(format!("`{path}` already exists; give the study another name")));
    }
    let is_new = write_new(Path::new(SCHEMA), &format!("{:#}\n", schema()))?;
    let unchanged = if is_new { "" } else { " (exists, unchanged)" };
    let mut out = stdout();
    writeln!(out, "manifest  {}", manifest.display())?;
    writeln!(out, "schema    {SCHEMA}{unchanged}")?;
    writeln!(out, "next      asperity run {}", shell_word(&manifest))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a file and returns true, or returns false if the file exists already.
fn write_new(path: &Path, text: &str) -> Result<bool, StoreError> {
    let created = File::create_new(path);
    match created.and_then(|mut file| file.write_all(text.as_bytes())) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(source) => Err(StoreError::writing(path, source)),
    }
}

pub(crate) fn check(arguments: &StudyArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let study = arguments.session(data).study()?;
    let plan = Plan::new(&study);
    let maps = study.measured_maps();
    super::print_warnings(&study.warnings());
    super::print_warnings(&maps.warnings);
    let mut out = stdout();
    let at_least = if study.grows() { "at least " } else { "" };
    writeln!(
        out,
        "`{}` is valid: study `{}`, {}, {at_least}{}",
        arguments.manifest.display(),
        plan.study,
        counted(plan.stages.len(), "stage"),
        counted(plan.tasks.len(), "task"),
    )?;
    for summary in study.summaries() {
        writeln!(out, "  {summary}")?;
    }
    for line in maps.lines {
        writeln!(out, "  {line}")?;
    }
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub(crate) struct PlanArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Print the result as JSON.
    ///
    /// Form: `{"stages": [{"name", "kind", "cached", "to_run", "core_hours", "reasons"}, …],
    /// "core_hours", "growing": [{"name", "surfaces", "at_most", "until", "holds", "undecided"},
    /// …], "summaries": [{"stage", "text"}, …], "warnings": [{"stage", "message"}, …]}`. A stage
    /// whose tables are read from read-only stores also has `"stores": [{"store", "tasks"}, …]`.
    /// If meshes have different numbers of surfaces, an entry of `growing` also has
    /// `"meshes": [{"nodes", "surfaces"}, …]`.
    #[arg(long)]
    json: bool,

    /// Print every task as one line of JSON, inputs first.
    ///
    /// Form: `{"stage", "task", "state", "core_seconds", …}`. `state` is "cached" or "missing". The
    /// remaining values are the parameters and the realization of the task. If read-only stores are
    /// in use, `store` names the one that has the task. `run --only TASK` computes a single task.
    #[arg(long)]
    tasks: bool,
}

pub(crate) fn plan(arguments: &PlanArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let status = arguments.study.session(data).status()?;
    let stages = status.stages();
    super::print_warnings(&status.warnings);
    let mut out = stdout();
    if arguments.tasks {
        for table in status.tasks() {
            write_json(&mut out, table?.batch())?;
        }
    } else if arguments.json {
        let mut study = study_json(&status, &stages)?;
        for (index, stage) in stages.iter().enumerate() {
            study["stages"][index]["reasons"] = reasons(stage).into();
        }
        study["summaries"] = serde_json::to_value(&status.summaries)?;
        study["warnings"] = serde_json::to_value(&status.warnings)?;
        print_json(&mut out, &study)?;
    } else {
        let stores = stages.iter().map(|stage| (stage.count.name, stage.stores.as_slice()));
        let stores = store_lines(stores);
        writeln!(out, "{}", plan_table(&stages))?;
        for summary in &status.summaries {
            writeln!(out, "  {summary}")?;
        }
        writeln!(out, "{stores}{}", forecast(&status))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the JSON output of `explain`, and of `plan` but for the reasons and the warnings.
fn study_json(status: &Status, stages: &[StageStatus]) -> Result<Value, serde_json::Error> {
    Ok(json!({
        "stages": serde_json::to_value(stages)?,
        "core_hours": status.total_seconds() / 3600.0,
        "growing": growing(&status.adaptive),
    }))
}

/// Returns the reasons why the tasks of a stage will run, each as a phrase.
fn reasons(stage: &StageStatus) -> Vec<String> {
    let reasons = stage.reasons.iter().map(|reason| {
        let remaining = reason.remaining.iter().map(String::as_str);
        let rows = remaining.map(|rows| format!("{rows}: ")).collect::<String>();
        rows + &reason.phrases().join("; ")
    });
    reasons.collect()
}

fn plan_table(stages: &[StageStatus]) -> String {
    let rows = stages.iter().map(|stage| {
        let StageCount { name, kind, cached, to_run, .. } = stage.count;
        let why = match reasons(stage).as_slice() {
            [] => String::new(),
            [one] => one.clone(),
            [first, more @ ..] => format!("{first}, and {}", counted(more.len(), "other reason")),
        };
        [name.to_owned(), kind.to_string(), cached.to_string(), to_run.to_string(), why]
    });
    in_columns(["stage", "kind", "finished", "to run", "why"], rows, |index| {
        (2..4).contains(&index)
    })
}

/// Returns a line for each read-only store with the numbers of tasks that are read from it.
pub(crate) fn store_lines<'a>(
    stages: impl Iterator<Item = (&'a str, &'a [TasksFromStore])>,
) -> String {
    let mut stores: Vec<(&Path, Vec<String>)> = Vec::new();
    for (name, sources) in stages {
        for TasksFromStore { store, tasks } in sources {
            let index = stores.iter().position(|(known, _)| known == store).unwrap_or_else(|| {
                stores.push((store, Vec::new()));
                stores.len() - 1
            });
            stores[index].1.push(format!("{tasks} {name}"));
        }
    }
    let line = |(store, stages): (&Path, Vec<String>)| {
        format!("finished in `{}`: {}\n", store.display(), stages.join(", "))
    };
    stores.into_iter().map(line).collect()
}

#[derive(clap::Args)]
pub(crate) struct ExplainArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Stage to explain (default: all stages).
    stage: Option<String>,

    /// Print the result as JSON.
    ///
    /// Form: `{"stages": [{"name", "kind", "cached", "to_run", "core_hours", "reasons": [{"tasks",
    /// "rows", "remaining", "core_hours", "causes": [{"stage", "why", …}, …]}, …]}, …],
    /// "core_hours", "growing"}`. `rows` is the number of loads to compute, or null for tasks that
    /// compute whole tables, and `remaining` says how they are computed. `growing` and `stores` are
    /// as in `plan --json`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn explain(
    arguments: &ExplainArguments,
    data: &DataFolder,
) -> Result<ExitCode, Failure> {
    let status = arguments.study.session(data).status()?;
    let mut stages = status.stages();
    if let Some(wanted) = &arguments.stage {
        let names: Vec<&str> = stages.iter().map(|stage| stage.count.name).collect();
        let index = name_lookup::stage(wanted, &names).map_err(SessionError::from)?;
        stages = vec![stages.swap_remove(index)];
    }
    let mut out = stdout();
    if arguments.json {
        print_json(&mut out, &study_json(&status, &stages)?)?;
    } else {
        for stage in &stages {
            write!(out, "{}", explained(stage))?;
        }
        if arguments.stage.is_none() {
            writeln!(out, "{}", forecast(&status))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Describes a stage, with one line for each reason why its tasks will run.
fn explained(stage: &StageStatus) -> String {
    let StageCount { name, kind, cached, to_run, .. } = stage.count;
    let mut text = format!("{name} ({kind}): {cached} finished");
    for TasksFromStore { store, tasks } in &stage.stores {
        text += &format!(" ({tasks} in `{}`)", store.display());
    }
    if to_run > 0 {
        text += &format!(", {to_run} to run, {}", core_hours(stage.seconds));
    }
    text.push('\n');
    for reason in stage.reasons.iter().take(MAX_REASONS) {
        let tasks = counted(reason.tasks, "task");
        let rows = reason.remaining.iter().map(|rows| format!(", {rows}")).collect::<String>();
        let cost = match stage.reasons.as_slice() {
            [_] => String::new(),
            _ => format!(", {}", core_hours(reason.seconds)),
        };
        text += &format!("  {tasks}{rows}{cost}: {}\n", reason.phrases().join("; "));
    }
    let more = stage.reasons.len().saturating_sub(MAX_REASONS);
    if more > 0 {
        text += &format!("  and {}\n", counted(more, "other reason"));
    }
    text
}

/// Returns a line for each adaptive stage and the expected time of the missing tasks.
fn forecast(status: &Status) -> String {
    let adaptive: String = status.adaptive.iter().map(|stage| format!("{stage}\n")).collect();
    if status.missing.is_empty() {
        return adaptive + "nothing to do";
    }
    let seconds = status.total_seconds();
    let cores = available_parallelism().map_or(1, usize::from);
    let (at_once, each) = status.core_distribution(cores);
    let used = cores.min(at_once * each);
    let wall = duration(Duration::from_secs_f64((seconds / used as f64).ceil()));
    let cost = core_hours(seconds);
    let shared = match each {
        1 => String::new(),
        _ if at_once < cores => format!(", up to {} per surface", cores.div_ceil(at_once)),
        _ => ", one per surface, several for the last surfaces".to_owned(),
    };
    format!("{adaptive}{cost} expected: {wall} on {}{shared}", counted(used, "core"))
}

/// Formats core-seconds as core-hours with two significant digits.
pub(crate) fn core_hours(seconds: f64) -> String {
    if seconds == 0.0 {
        return "0 core-hours".to_owned();
    }
    let hours = seconds / 3600.0;
    let decimals = (1.0 - hours.max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{hours:.decimals$} core-hours")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn core_hours_have_two_digits() {
        let text = |hours: f64| core_hours(3600.0 * hours);
        assert_eq!(text(0.0), "0 core-hours");
        assert_eq!(text(0.000_123), "0.00012 core-hours");
        assert_eq!(text(0.27), "0.27 core-hours");
        assert_eq!(text(3.07), "3.1 core-hours");
        assert_eq!(text(412.0), "412 core-hours");
    }
}
