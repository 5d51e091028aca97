//! `asperity columns`: what the columns of the tables mean.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use comfy_table::{ContentArrangement, Table as Grid, presets};

use super::Failure;
use super::terminal::stdout;
use crate::session::DescribedColumns;
use asperity_pipeline::data_folder::DataFolder;
use asperity_tables::column::Description;

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

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let described = match &arguments.manifest {
        Some(manifest) => super::session(manifest, data).columns(arguments.stage.as_deref())?,
        None => DescribedColumns::of_kinds(),
    };
    let mut out = stdout();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&described)?)?;
    } else {
        write!(out, "{}", text(&described))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A line per column. What several stages share is said where it comes up first.
fn text(described: &[DescribedColumns]) -> String {
    let mut text = String::new();
    let mut known: Vec<&Description> = Vec::new();
    for DescribedColumns { stage, kind, columns } in described {
        let is_new = |column: &&Description| !known.contains(column);
        let new: Vec<&Description> = columns.iter().filter(is_new).collect();
        let name = stage.as_ref().map_or_else(String::new, |stage| format!("{stage} · "));
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
    grid.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    for column in columns {
        grid.add_row([&column.name, &column.unit, &column.meaning]);
    }
    grid.trim_fmt()
}
