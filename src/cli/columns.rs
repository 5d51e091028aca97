//! `asperity columns`: what the columns of the tables mean.

use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use comfy_table::{ContentArrangement, Table as Grid, presets};
use serde::Serialize;

use super::{Data, Failure, place_of};
use crate::results;
use crate::stages::{Kind, columns_of};
use crate::store::column::Description;
use crate::store::table::Table;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study, which need not have been run; without one, all columns that any
    /// study may have.
    manifest: Option<PathBuf>,

    /// The stage to describe; all of the study when left out.
    stage: Option<String>,

    /// Print JSON: `[{"stage", "kind", "columns": [{"name", "type", "role", "unit", "meaning"},
    /// …]}, …]`.
    #[arg(long)]
    json: bool,
}

/// The columns of a stage's table, or those that a kind of stage may have.
#[derive(Serialize)]
struct Described {
    #[serde(skip_serializing_if = "Option::is_none")]
    stage: Option<String>,
    kind: Kind,
    columns: Vec<Description>,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let described = match &arguments.manifest {
        Some(manifest) => of_study(manifest, arguments.stage.as_deref(), data)?,
        None => Kind::ALL.into_iter().map(of_kind).collect(),
    };
    let mut out = stdout().lock();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&described)?)?;
    } else {
        write!(out, "{}", text(&described))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn of_kind(kind: Kind) -> Described {
    Described {
        stage: None,
        kind,
        columns: Table::empty(&columns_of(kind)).descriptions(),
    }
}

/// The stages of a study, or the one of this name.
fn of_study(manifest: &Path, wanted: Option<&str>, data: &Data) -> Result<Vec<Described>, Failure> {
    let study = data.reading(manifest)?.study;
    let tables = study.empty_tables()?;
    let mut described: Vec<_> = study
        .stages
        .iter()
        .zip(tables)
        .map(|(stage, table)| Described {
            stage: Some(stage.name.clone()),
            kind: stage.work.kind(),
            columns: results::with_own_columns(table).descriptions(),
        })
        .collect();
    if let Some(wanted) = wanted {
        let names: Vec<&str> = study
            .stages
            .iter()
            .map(|stage| stage.name.as_str())
            .collect();
        described = vec![described.swap_remove(place_of(&names, wanted)?)];
    }
    Ok(described)
}

/// A line per column. What several stages share is said where it comes up first.
fn text(described: &[Described]) -> String {
    let mut text = String::new();
    let mut known: Vec<&Description> = Vec::new();
    for Described {
        stage,
        kind,
        columns,
    } in described
    {
        let is_new = |column: &&Description| !known.contains(column);
        let new: Vec<&Description> = columns.iter().filter(is_new).collect();
        let name = stage
            .as_ref()
            .map_or_else(String::new, |stage| format!("{stage} · "));
        let shared = match columns.len() - new.len() {
            0 => String::new(),
            shared => format!(", and {shared} of the above"),
        };
        text += &format!("{name}{kind}{shared}\n{}\n\n", grid(&new));
        known.extend(new);
    }
    text
}

fn grid(columns: &[&Description]) -> String {
    let mut grid = Grid::new();
    grid.load_preset(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic);
    for column in columns {
        grid.add_row([&column.name, &column.unit, &column.meaning]);
    }
    grid.trim_fmt()
}
