//! `asperity view`: heights, contact or pressures of one task as a picture.

mod choice;
mod loads;
mod picture;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::ValueEnum;
use serde::Serialize;
use serde_json::json;

use self::choice::{Coordinate, TaskChoice};
use self::picture::Picture;
use super::terminal::stdout;
use super::{Failure, Misused, picture_file};
use crate::session::task_names;
use asperity_manifest::diagnostics::listed;
use asperity_pipeline::data_folder::DataFolder;
use asperity_stages::generate::PerAxis;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::store::key::TaskKey;

/// Digits of a key in the name of a file.
const KEY_DIGITS: usize = 8;

#[derive(clap::Args)]
pub struct Arguments {
    /// A finished task, by its key or the first digits of it, as in the `task` column of tables;
    /// or the manifest of a study that has been run.
    #[arg(value_name = "KEY|MANIFEST")]
    what: PathBuf,

    /// In a study: the stage that has the task.
    stage: Option<String>,

    /// In a stage: what tells the task from others, as in `k_upper=32 realization=1`.
    #[arg(value_name = "COLUMN=VALUE")]
    coordinates: Vec<Coordinate>,

    /// What to draw; when left out, the heights of surfaces and the contact under loads.
    #[arg(long, value_enum)]
    map: Option<Map>,

    /// The load to draw, in the unit of the study: reduced, or in pascals where its loads are
    /// absolute. Without it, contacts at all loads are laid over each other, from dark at the
    /// lightest to light at the heaviest, and pressures are those at the heaviest load.
    #[arg(long, value_parser = finite)]
    load: Option<f64>,

    /// The file to write; named after the task and what is drawn when left out.
    #[arg(long, short, value_name = "FILE.png")]
    output: Option<PathBuf>,

    /// Overwrite another picture. Files other than PNG are never overwritten.
    #[arg(long)]
    replace: bool,

    /// Print JSON: `{"file", "task", "map", "nodes", "load", "load_column", "lowest", "highest",
    /// "unit"}`; `load` is in the unit of the column `load_column`; of a rectangle, `nodes` are
    /// those along x and along y.
    #[arg(long)]
    json: bool,
}

/// What is drawn of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Map {
    Heights,
    Contact,
    Pressures,
}

impl Map {
    fn name(self) -> &'static str {
        match self {
            Map::Heights => "heights",
            Map::Contact => "contact",
            Map::Pressures => "pressures",
        }
    }
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let (key, sources) = task(arguments, data)?;
    let store = data.look()?;
    let picture = picture::draw(key, arguments.map, arguments.load, &store, &sources)?;
    let default = || file_name(key, &picture).into();
    let path = arguments.output.clone().unwrap_or_else(default);
    picture_file::write(&path, &picture.raster.to_png(), arguments.replace)?;
    let mut out = stdout();
    match arguments.json {
        true => writeln!(out, "{:#}", as_json(key, &picture, &path))?,
        false => writeln!(out, "{}: {}", path.display(), caption(&picture))?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The task that is meant, and where the files of measured surfaces lie, which no key knows.
fn task(arguments: &Arguments, data: &DataFolder) -> Result<(TaskKey, SurfaceFiles), Failure> {
    let Some(stage) = &arguments.stage else {
        if arguments.what.is_file() {
            let study = super::session(&arguments.what, data).study()?;
            let stages: Vec<_> = study.stages.iter().map(|stage| &*stage.name).collect();
            return Err(Misused(format!(
                "say which stage of `{}` has the task: {}",
                arguments.what.display(),
                listed(stages, "or")
            ))
            .into());
        }
        let word = arguments.what.to_string_lossy();
        return Ok((task_names::finished(&word, data)?, SurfaceFiles::default()));
    };
    let session = super::session(&arguments.what, data);
    let tables = session.tables()?;
    let choice = TaskChoice { stage, coordinates: &arguments.coordinates, load: arguments.load };
    let key = choice.task(&tables.table(stage)?)?;
    if !tables.reading.archive.store().has(key) {
        return Err(format!(
            "the maps of task {key} are not in `{}`, only its rows are there; `asperity run {}` \
             computes them again",
            data.store().display(),
            arguments.what.display(),
        )
        .into());
    }
    Ok((key, tables.reading.study.sources))
}

fn finite(word: &str) -> Result<f64, String> {
    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| "a load is a number".to_owned())
}

fn file_name(key: TaskKey, picture: &Picture) -> String {
    let load = picture.load.map(|load| format!("-{load}"));
    format!(
        "{}-{}{}.png",
        &key.to_string()[..KEY_DIGITS],
        picture.map.name(),
        load.unwrap_or_default()
    )
}

fn caption(picture: &Picture) -> String {
    let load = match (picture.map, picture.load) {
        (Map::Heights, _) => String::new(),
        (_, Some(load)) => format!(" at {} {load}", load.column),
        (_, None) => " at all loads".to_owned(),
    };
    let range = picture.range.as_ref().map(|range| {
        let [lowest, highest] = range.ends.map(super::show::short);
        format!(", {lowest} … {highest} {}", range.unit)
    });
    let [nodes_x, nodes_y] = picture.nodes;
    format!(
        "{}{load} on {nodes_x} × {nodes_y} nodes{}",
        picture.map.name(),
        range.unwrap_or_default().trim_end()
    )
}

fn as_json(key: TaskKey, picture: &Picture, path: &Path) -> serde_json::Value {
    let range = picture.range.as_ref();
    json!({
        "file": path,
        "task": key,
        "map": picture.map,
        "nodes": PerAxis(picture.nodes),
        "load": picture.load.map(|load| load.value),
        "load_column": picture.load.map(|load| load.column),
        "lowest": range.map(|range| range.ends[0]),
        "highest": range.map(|range| range.ends[1]),
        "unit": range.map(|range| &range.unit),
    })
}
