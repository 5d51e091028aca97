//! `asperity table`: a stage's table, or the answer to a query over all of them.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use arrow::csv;
use arrow::error::ArrowError;
use arrow::json::writer::LineDelimited;
use arrow::record_batch::RecordBatch;

use super::grid::{self, ColumnLayout};
use super::terminal::{Output, stdout};
use super::{Failure, unknown};
use asperity_pipeline::data_folder::DataFolder;
use asperity_tables::parallel;
use asperity_tables::source::TableSource;

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
    let table: TableSource = match (&arguments.sql, &arguments.stage) {
        (Some(query), _) => session.sql(query)?.into(),
        (None, stage) => session.tables()?.open(stage.as_deref().unwrap_or_default())?,
    };
    let columns = chosen(&table, &arguments.columns)?;
    let mut out = stdout();
    if arguments.csv {
        write_csv(&mut out, &table, &columns)?;
    } else if arguments.json {
        for part in table.parts(&columns) {
            write_json(&mut out, part?.batch())?;
        }
    } else {
        let layout = match (&arguments.sql, arguments.columns.is_empty()) {
            (_, false) => ColumnLayout::Everything,
            (Some(_), true) => ColumnLayout::Fitting,
            (None, true) => ColumnLayout::Summary,
        };
        grid::write(&mut out, &table, &columns, arguments.rows, layout)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The places of these columns, in this order; all if none is named.
fn chosen(table: &TableSource, names: &[String]) -> Result<Vec<usize>, Failure> {
    let known = table.names();
    if names.is_empty() {
        return Ok((0..known.len()).collect());
    }
    let place = |name: &String| {
        let found = known.iter().position(|known| known == name);
        found.ok_or_else(|| {
            let message = format!("the table has no column `{name}`");
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            unknown(message, name, &known)
        })
    };
    names.iter().map(place).collect()
}

/// The rows in chunks: text for the whole table would fill memory many times over.
fn chunks(batch: &RecordBatch) -> impl Iterator<Item = RecordBatch> {
    let starts = (0..batch.num_rows()).step_by(CHUNK);
    starts.map(|start| batch.slice(start, CHUNK.min(batch.num_rows() - start)))
}

/// Chunks become text on all cores and are written in their order. Each goes through memory, because
/// the writer would hide that its reader has left.
fn write_csv(out: &mut Output, table: &TableSource, columns: &[usize]) -> Result<(), Failure> {
    let header = table.first(columns, 0)?;
    out.write_data(&csv_text(header.batch(), true)?)?;
    for part in table.parts(columns) {
        let chunks: Vec<RecordBatch> = chunks(part?.batch()).collect();
        for text in parallel::map(&chunks, |chunk| csv_text(chunk, false)) {
            out.write_data(&text?)?;
        }
    }
    Ok(())
}

fn csv_text(batch: &RecordBatch, with_header: bool) -> Result<Vec<u8>, ArrowError> {
    let mut text = Vec::new();
    let builder = csv::WriterBuilder::new().with_header(with_header);
    builder.build(&mut text).write(batch)?;
    Ok(text)
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
