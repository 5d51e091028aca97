//! `asperity table`: a stage's table, or the answer to a query over all of them.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use arrow::csv;
use arrow::json::writer::LineDelimited;
use arrow::record_batch::RecordBatch;

use super::grid::{self, ColumnLayout};
use super::{Failure, unknown};
use crate::data_folder::DataFolder;
use crate::store::table::Table;

/// Rows that are turned into text at once.
const CHUNK: usize = 1024;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run.
    manifest: PathBuf,

    /// The stage whose table to print.
    #[arg(required_unless_present = "sql")]
    stage: Option<String>,

    /// Ask all tables of the study instead: a query in the SQL of polars, in which every stage is
    /// a table. A name with `-` needs double quotes. Rows that no `order by` tells apart come in the
    /// order of the rows that they are made of.
    #[arg(long, value_name = "QUERY", conflicts_with = "stage")]
    sql: Option<String>,

    /// Columns to print, in this order; those that differ between rows and fit when left out.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    columns: Vec<String>,

    /// Rows to print for reading; 0 for all.
    #[arg(long, value_name = "N", default_value_t = 20, conflicts_with_all = ["csv", "json"])]
    rows: usize,

    /// Print all rows as comma-separated values, to the last digit.
    #[arg(long, conflicts_with = "json")]
    csv: bool,

    /// Print all rows as JSON, one object a line, to the last digit.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let table = match (&arguments.sql, &arguments.stage) {
        (Some(query), _) => session.sql(query)?,
        (None, stage) => session.table(stage.as_deref().unwrap_or_default())?,
    };
    let table = chosen(&table, &arguments.columns)?;
    let mut out = stdout().lock();
    if arguments.csv {
        write_csv(&mut out, table.batch())?;
    } else if arguments.json {
        write_json(&mut out, table.batch())?;
    } else {
        let layout = match (&arguments.sql, arguments.columns.is_empty()) {
            (_, false) => ColumnLayout::Everything,
            (Some(_), true) => ColumnLayout::Fitting,
            (None, true) => ColumnLayout::Summary,
        };
        grid::write(&mut out, &table, arguments.rows, layout)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// These columns in this order; all if none is named.
fn chosen(table: &Table, names: &[String]) -> Result<Table, Failure> {
    if names.is_empty() {
        return Ok(table.clone());
    }
    let known = table.names();
    let index = |name: &String| {
        let found = known.iter().position(|known| known == name);
        found.ok_or_else(|| {
            let message = format!("the table has no column `{name}`");
            unknown(message, name, &known)
        })
    };
    let indices = names.iter().map(index).collect::<Result<Vec<_>, _>>()?;
    Ok(Table::from(table.batch().project(&indices)?))
}

/// The rows in chunks: text for the whole table would fill memory many times over.
fn chunks(batch: &RecordBatch) -> impl Iterator<Item = RecordBatch> {
    let starts = (0..batch.num_rows()).step_by(CHUNK);
    starts.map(|start| batch.slice(start, CHUNK.min(batch.num_rows() - start)))
}

/// Each chunk goes through memory, because the writer would hide that its reader has left.
fn write_csv(out: &mut impl Write, batch: &RecordBatch) -> Result<(), Failure> {
    let header = batch.slice(0, 0);
    for (index, chunk) in std::iter::once(header).chain(chunks(batch)).enumerate() {
        let mut text = Vec::new();
        let builder = csv::WriterBuilder::new().with_header(index == 0);
        builder.build(&mut text).write(&chunk)?;
        out.write_all(&text)?;
    }
    Ok(())
}

/// One object a line.
pub fn write_json(out: &mut impl Write, batch: &RecordBatch) -> Result<(), Failure> {
    for chunk in chunks(batch) {
        let mut text = Vec::new();
        let builder = arrow::json::WriterBuilder::new().with_explicit_nulls(true);
        let mut writer = builder.build::<_, LineDelimited>(&mut text);
        writer.write(&chunk)?;
        writer.finish()?;
        drop(writer);
        out.write_all(&text)?;
    }
    Ok(())
}
