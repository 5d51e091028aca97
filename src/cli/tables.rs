//! `asperity table`, `show` and `columns`: a stage's table or the answer to a query, how a table was
//! made, and what its columns mean. Numbers are in line, what is the same in all rows is said once,
//! and no line is wider than the terminal.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use arrow::array::{Array, AsArray};
use arrow::csv;
use arrow::datatypes::{DataType, Float64Type};
use arrow::error::ArrowError;
use arrow::json::writer::LineDelimited;
use arrow::record_batch::RecordBatch;
use arrow::util::display::array_value_to_string;
use comfy_table::{CellAlignment, ContentArrangement, Table as Grid, presets};

use super::terminal::{Output, stdout};
use super::{Failure, unknown};
use crate::session::results::{Description, Table, TableFile, TableSource};
use crate::session::words::{cells, counted, short, wrapped};
use crate::session::{DataFolder, DescribedColumns, StoreError, parallel};

/// Rows that are turned into text at once.
const CHUNK: usize = 1024;

#[derive(clap::Args)]
pub struct TableArguments {
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

pub fn table(arguments: &TableArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let table: TableSource = match (&arguments.sql, &arguments.stage) {
        (Some(query), _) => session.sql(query)?.into(),
        (None, stage) => session.tables()?.open(stage.as_deref().unwrap_or_default())?,
    };
    let columns = chosen_columns(&table, &arguments.columns)?;
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
        write_grid(&mut out, &table, &columns, arguments.rows, layout)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The places of these columns, in this order; all if none is named.
fn chosen_columns(table: &TableSource, names: &[String]) -> Result<Vec<usize>, Failure> {
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

#[derive(clap::Args)]
pub struct ShowArguments {
    /// A finished task's key or the first digits of it, or a Parquet file of the store or the results.
    #[arg(value_name = "KEY|FILE")]
    what: PathBuf,

    /// Rows to print.
    #[arg(long, default_value_t = 10)]
    rows: usize,
}

pub fn show(arguments: &ShowArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let file = TableFile::read(&arguments.what, data)?;
    let mut out = stdout();
    write_metadata(&mut out, &file)?;
    write_head(&mut out, &file.table, arguments.rows)?;
    Ok(ExitCode::SUCCESS)
}

fn write_metadata(out: &mut impl Write, file: &TableFile) -> Result<(), Failure> {
    let metadata = &file.metadata;
    writeln!(out, "{:15}{}", "file", file.path.display())?;
    if let Some(key) = metadata.key {
        writeln!(out, "{:15}{key}", "key")?;
    }
    for (name, value) in &metadata.entries {
        let pretty = match name.as_str() {
            "recipe" => serde_json::from_str::<serde_json::Value>(value)
                .and_then(|json| serde_json::to_string_pretty(&json)),
            _ => Ok(value.clone()),
        };
        let value = pretty.unwrap_or_else(|_| value.clone());
        let indented = value.replace('\n', "\n               ");
        writeln!(out, "{:15}{indented}", name.replace('_', " "))?;
    }
    Ok(())
}

fn write_head(out: &mut impl Write, table: &Table, rows: usize) -> Result<(), Failure> {
    let shown = rows.min(table.rows());
    let batch = table.batch();
    writeln!(
        out,
        "{:15}{} × {}",
        "table",
        counted(table.rows(), "row"),
        counted(table.names().len(), "column"),
    )?;
    // One line per column: a row of forty columns would not fit any terminal.
    let mut grid = Grid::new();
    grid.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    for (name, array) in table.names().iter().zip(batch.columns()) {
        let values = (0..shown).map(|row| value(array.as_ref(), row));
        grid.add_row(std::iter::once((*name).to_owned()).chain(values));
    }
    writeln!(out, "{grid}")?;
    Ok(())
}

fn value(array: &dyn Array, row: usize) -> String {
    if array.is_null(row) {
        return "–".to_owned();
    }
    match array.data_type() {
        DataType::LargeBinary => {
            counted(array.as_binary::<i64>().value_length(row).try_into().unwrap_or(0), "byte")
        }
        DataType::LargeList(_) => counted(array.as_list::<i64>().value(row).len(), "value"),
        DataType::Float64 => {
            let number = array.as_primitive::<Float64Type>().value(row);
            short(number)
        }
        _ => array_value_to_string(array, row).unwrap_or_default(),
    }
}

#[derive(clap::Args)]
pub struct ColumnsArguments {
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

pub fn columns(arguments: &ColumnsArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let described = match &arguments.manifest {
        Some(manifest) => super::session(manifest, data).columns(arguments.stage.as_deref())?,
        None => DescribedColumns::of_kinds(),
    };
    let mut out = stdout();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&described)?)?;
    } else {
        write!(out, "{}", columns_text(&described))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A line per column. What several stages share is said where it comes up first.
fn columns_text(described: &[DescribedColumns]) -> String {
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
        text += &format!("{name}{kind}{shared}\n{}\n\n", descriptions(&new));
        known.extend(new);
    }
    text
}

fn descriptions(columns: &[&Description]) -> String {
    let mut grid = Grid::new();
    grid.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    for column in columns {
        grid.add_row([&column.name, &column.unit, &column.explained()]);
    }
    grid.trim_fmt()
}

/// Columns of text where the output is no terminal.
const WIDTH: usize = 120;
/// Spaces between columns.
const GAP: usize = 2;

/// Which columns are printed side by side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnLayout {
    /// Those that differ between rows, as far as they fit; the others are said once.
    Summary,
    /// All that fit.
    Fitting,
    /// All.
    Everything,
}

/// Prints the first rows of some columns, by their places, and says what was left out; 0 for all
/// rows. A single row has all of its columns, one below the other where they do not fit.
///
/// # Errors
/// When the table is damaged, or the output is closed.
fn write_grid(
    out: &mut impl Write,
    table: &TableSource,
    columns: &[usize],
    rows: usize,
    layout: ColumnLayout,
) -> Result<(), Failure> {
    let width = Grid::new().width().map_or(WIDTH, usize::from);
    let shown = match rows {
        0 => table.rows(),
        rows => rows.min(table.rows()),
    };
    let (columns, constant) = printed(table, columns, shown, layout)?;
    let fitting = match layout {
        ColumnLayout::Everything => columns.len(),
        ColumnLayout::Summary | ColumnLayout::Fitting => fitting(&columns, width),
    };
    if table.rows() == 1 && fitting < columns.len() {
        return upright(out, &columns);
    }
    let (printed, hidden) = columns.split_at(fitting);
    if !constant.is_empty() {
        let text = format!("in every row: {}", constant.join(" · "));
        writeln!(out, "{}", wrapped(&text))?;
    }
    if !printed.is_empty() {
        writeln!(out, "{}", grid(printed, shown))?;
    }
    if table.rows() > shown {
        let more = counted(table.rows() - shown, "more row");
        writeln!(out, "… {more}, `--rows 0` for all")?;
    }
    if !hidden.is_empty() {
        let names: Vec<&str> = hidden.iter().map(|column| column.name.as_str()).collect();
        let more = counted(hidden.len(), "more column");
        let text = format!("… {more}, `--columns NAME,…` for any of these: {}", names.join(", "));
        writeln!(out, "{}", wrapped(&text))?;
    }
    Ok(())
}

/// A column as it is printed.
struct Printed {
    name: String,
    cells: Vec<String>,
    alignment: CellAlignment,
}

impl Printed {
    fn width(&self) -> usize {
        let cells = self.cells.iter().map(|cell| cell.chars().count());
        cells.fold(self.name.chars().count(), usize::max)
    }
}

/// The columns to print, and what those hold that are said once.
fn printed(
    table: &TableSource,
    places: &[usize],
    shown: usize,
    layout: ColumnLayout,
) -> Result<(Vec<Printed>, Vec<String>), StoreError> {
    let (mut printed, mut constant) = (Vec::new(), Vec::new());
    let first = table.first(places, shown)?;
    let columns = first.names().into_iter().zip(first.batch().columns());
    for ((name, array), &place) in columns.zip(places) {
        let is_summary = layout == ColumnLayout::Summary && table.rows() > 1;
        if is_summary && table.is_constant(place)? {
            if array.is_valid(0) {
                constant.push(format!("{name} {}", cells(array.as_ref(), 1).remove(0)));
            }
            continue;
        }
        printed.push(Printed {
            name: name.to_owned(),
            cells: cells(array.as_ref(), shown),
            alignment: match array.data_type() {
                DataType::Utf8 => CellAlignment::Left,
                _ => CellAlignment::Right,
            },
        });
    }
    Ok((printed, constant))
}

/// A single row that is too wide, column below column.
fn upright(out: &mut impl Write, columns: &[Printed]) -> Result<(), Failure> {
    let names = columns.iter().map(|column| column.name.chars().count());
    let width = names.max().unwrap_or(0) + GAP;
    for column in columns {
        writeln!(out, "{:width$}{}", column.name, column.cells[0])?;
    }
    Ok(())
}

/// How many columns fit side by side; one is printed however wide it is.
fn fitting(columns: &[Printed], width: usize) -> usize {
    let ends = columns.iter().scan(0, |end, column| {
        *end += column.width() + GAP;
        Some(*end)
    });
    let fitting = ends.take_while(|end| end - GAP <= width).count();
    fitting.clamp(1.min(columns.len()), columns.len())
}

fn grid(columns: &[Printed], rows: usize) -> String {
    let mut grid = Grid::new();
    grid.load_preset(presets::NOTHING);
    grid.set_header(columns.iter().map(|column| &column.name));
    for row in 0..rows {
        grid.add_row(columns.iter().map(|column| &column.cells[row]));
    }
    for (column, printed) in grid.column_iter_mut().zip(columns) {
        column.set_cell_alignment(printed.alignment);
        column.set_padding((0, GAP as u16));
    }
    grid.trim_fmt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::column::{Column, ColumnKind, integers, reals, texts};

    const TASK: Column = Column::result("task", ColumnKind::Text, "", "task");
    const NODES: Column = Column::parameter("nodes", ColumnKind::Integer, "1", "nodes");
    const LOAD: Column = Column::parameter("load", ColumnKind::Real, "1", "load");

    fn printed(table: &Table, rows: usize) -> String {
        let mut out = Vec::new();
        let columns: Vec<usize> = (0..table.names().len()).collect();
        let table = table.clone().into();
        write_grid(&mut out, &table, &columns, rows, ColumnLayout::Summary).unwrap();
        String::from_utf8(out).unwrap()
    }

    fn table() -> Table {
        let key = |digit: char| digit.to_string().repeat(32);
        Table::new(
            3,
            vec![
                (NODES, integers([128; 3])),
                (LOAD, reals([0.004, 0.02, 1.7])),
                (TASK, texts([key('a'), key('b'), key('c')])),
            ],
        )
    }

    #[test]
    fn points_are_in_line_and_constants_said_once() {
        let expected = "in every row: nodes 128\n \
                        load  task\n\
                        0.004  aaaaaaaa\n\
                        0.020  bbbbbbbb\n\
                        1.700  cccccccc\n";
        assert_eq!(printed(&table(), 0), expected);
    }

    #[test]
    fn rows_left_out_are_counted() {
        assert!(printed(&table(), 2).ends_with("… 1 more row, `--rows 0` for all\n"));
    }

    #[test]
    fn columns_that_do_not_fit_are_left_out() {
        let columns: Vec<Printed> = (0..3)
            .map(|_| Printed {
                name: "x".repeat(10),
                cells: vec![],
                alignment: CellAlignment::Left,
            })
            .collect();
        assert_eq!(fitting(&columns, 22), 2);
        assert_eq!(fitting(&columns, 21), 1);
        assert_eq!(fitting(&columns, 5), 1);
        assert_eq!(fitting(&[], 5), 0);
    }
}
