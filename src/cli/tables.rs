//! `asperity table`, `show` and `columns`: print tables, results of queries, provenance and
//! columns.
//!
//! Decimal points are aligned, constant columns are printed once, and no line is wider than the
//! terminal.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray, StringArray};
use arrow::csv;
use arrow::datatypes::{DataType, Field, Float64Type};
use arrow::error::ArrowError;
use arrow::json::writer::LineDelimited;
use arrow::record_batch::RecordBatch;
use arrow::util::display::array_value_to_string;
use comfy_table::{ContentArrangement, Table as Grid, presets};
use serde_json::Value;

use super::terminal::{GAP, Output, in_columns, stdout};
use super::{Failure, SetArguments, StudyArguments, misused, unknown};
use crate::session::failures::COMMAND;
use crate::session::formatting::{cells, counted, listed, short, whole_cells, wrapped};
use crate::session::results::{Description, Table, TableSource, read_file};
use crate::session::{DataFolder, DescribedColumns, StoreError, TableUnits, parallel};
use asperity_tables::parquet::Metadata;

/// Number of rows that are converted to text together.
const CHUNK: usize = 1024;

#[derive(clap::Args)]
pub(crate) struct TableArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Stage whose table to print (required without `--sql`).
    #[arg(conflicts_with = "sql")]
    stage: Option<String>,

    /// Run an SQL query (polars dialect) in which every stage is a table.
    ///
    /// Put names that contain `-` in double quotes. Rows that `order by` does not distinguish keep
    /// the order of their source rows.
    #[arg(long, value_name = "QUERY")]
    sql: Option<String>,

    /// Columns to print, in this order (default: columns that vary and fit into the terminal).
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    columns: Vec<String>,

    /// Maximum number of rows to print; 0 prints all.
    #[arg(long, value_name = "N", default_value_t = 20, conflicts_with_all = ["csv", "json"])]
    rows: usize,

    /// Print all rows as CSV in full precision.
    #[arg(long, conflicts_with = "json")]
    csv: bool,

    /// Put units in the titles of the CSV, as in `pressure [MPa]`.
    ///
    /// Without this option, titles are names of columns, which scripts read, and stderr lists the
    /// units that the study names.
    #[arg(long, requires = "csv")]
    units: bool,

    /// Print all rows as JSON in full precision, one object per line.
    #[arg(long)]
    json: bool,
}

pub(crate) fn table(arguments: &TableArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = arguments.study.session(data);
    let (table, units): (TableSource, TableUnits) = match (&arguments.sql, &arguments.stage) {
        (Some(query), _) => {
            let (answer, units) = session.tables()?.sql(query)?;
            (answer.into(), units)
        }
        (None, Some(stage)) => {
            let tables = session.tables()?;
            (tables.open(stage)?, tables.units(stage))
        }
        (None, None) => {
            let stages = session.study()?.stages;
            let names = listed(stages.iter().map(|stage| stage.name.as_str()), "and");
            let message = format!(
                "choose a stage, or use `--sql QUERY`; `{}` has {names}",
                arguments.study.manifest.display()
            );
            return Err(misused(message));
        }
    };
    let columns = chosen_columns(&table, &arguments.columns)?;
    let units = TableUnits::from_source(&table)?.or(&units);
    if (arguments.csv || arguments.json) && !arguments.units {
        let schema = table.schema();
        let fields = columns.iter().map(|&column| schema.field(column));
        let with_unit = fields.filter(|field| units.shown_of(field).is_some());
        let heads: Vec<String> = with_unit.map(|field| head(field, &units)).collect();
        if !heads.is_empty() {
            super::warn(&format!("units: {}", heads.join(", ")));
        }
    }
    let mut out = stdout();
    if arguments.csv {
        let units = arguments.units.then_some(&units);
        write_csv(&mut out, &table, &columns, units)?;
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
        write_grid(&mut out, &table, &units, &columns, arguments.rows, layout)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the indices of the named columns, or of all columns if `names` is empty.
fn chosen_columns(table: &TableSource, names: &[String]) -> Result<Vec<usize>, Failure> {
    let known = table.names();
    if names.is_empty() {
        return Ok((0..known.len()).collect());
    }
    let index = |name: &String| {
        known.iter().position(|known| known == name).ok_or_else(|| {
            let all: Vec<&str> = known.iter().map(String::as_str).collect();
            unknown(format!("the table has no column `{name}`"), name, &all)
        })
    };
    names.iter().map(index).collect()
}

/// Splits the rows into chunks, because the text of a whole table could exceed the memory.
fn chunks(batch: &RecordBatch) -> impl Iterator<Item = RecordBatch> {
    let starts = (0..batch.num_rows()).step_by(CHUNK);
    starts.map(|start| batch.slice(start, CHUNK.min(batch.num_rows() - start)))
}

/// Writes a table as CSV, formatting chunks in parallel. The titles have units if `units` are
/// given.
///
/// Each chunk is formatted in memory, because arrow's writer would hide a closed pipe.
fn write_csv(
    out: &mut Output,
    table: &TableSource,
    columns: &[usize],
    units: Option<&TableUnits>,
) -> Result<(), Failure> {
    let header = table.first(columns, 0)?;
    let titles = header.with_fields(|field| match units {
        Some(units) => field.clone().with_name(head(&field, units)),
        None => field,
    });
    out.write_data(&csv_text(titles.batch(), true)?)?;
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
    builder.build(&mut text).write(&with_capital_booleans(batch)?)?;
    Ok(text)
}

/// Returns the rows with the texts `TRUE` and `FALSE` in place of booleans. R, pandas, polars,
/// DuckDB and Excel read these words as booleans, whereas R keeps `true` as a text.
fn with_capital_booleans(batch: &RecordBatch) -> Result<RecordBatch, ArrowError> {
    let word = |is_true| if is_true { "TRUE" } else { "FALSE" };
    let columns = batch.columns().iter().map(|column| match column.as_boolean_opt() {
        Some(truths) => {
            let words = truths.iter().map(|truth| truth.map(word));
            Arc::new(words.collect::<StringArray>()) as ArrayRef
        }
        None => column.clone(),
    });
    let schema = batch.schema();
    RecordBatch::try_from_iter(schema.fields().iter().map(|field| field.name()).zip(columns))
}

/// Writes one JSON object per line.
pub(crate) fn write_json(out: &mut impl Write, batch: &RecordBatch) -> Result<(), Failure> {
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
pub(crate) struct ShowArguments {
    /// Key of a finished task (at least its first 4 digits), or a Parquet file of the store or the
    /// results. If the rows of the task are in several files, the first of them is shown.
    #[arg(value_name = "KEY|FILE")]
    what: PathBuf,

    /// Maximum number of rows to print.
    #[arg(long, default_value_t = 10)]
    rows: usize,
}

pub(crate) fn show(arguments: &ShowArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let (path, table, metadata) = read_file(&arguments.what, data, &super::print_notice)?;
    let mut out = stdout();
    writeln!(out, "{:15}{}", "file", path.display())?;
    write_metadata(&mut out, &metadata)?;
    write_head(&mut out, &table, arguments.rows)?;
    Ok(ExitCode::SUCCESS)
}

fn write_metadata(out: &mut impl Write, metadata: &Metadata) -> Result<(), Failure> {
    if let Some(key) = metadata.key {
        writeln!(out, "{:15}{key}", "key")?;
    }
    for (name, value) in &metadata.entries {
        let (name, pretty) = match name.as_str() {
            "recipe" => {
                ("recipe", serde_json::from_str(value).map(|recipe: Value| format!("{recipe:#}")))
            }
            "columns" => ("columns", serde_json::from_str(value).map(column_lines)),
            "lacking" if value == "[]" => continue,
            "lacking" => ("absent columns", Ok(value.clone())),
            name => (name, Ok(value.clone())),
        };
        let value = pretty.unwrap_or_else(|_| value.clone());
        let indented = value.replace('\n', "\n               ");
        writeln!(out, "{:15}{indented}", name.replace('_', " "))?;
    }
    Ok(())
}

/// Returns one line for each of the described columns: name, unit and meaning.
fn column_lines(descriptions: Vec<BTreeMap<String, Value>>) -> String {
    let lines = descriptions.iter().map(|column| {
        let text = |key: &str| column.get(key).and_then(Value::as_str).unwrap_or_default();
        let unit = text("unit");
        let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        format!("{}{unit}: {}", text("name"), text("meaning"))
    });
    lines.collect::<Vec<_>>().join("\n")
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
    // One line per column, because 40 columns do not fit into a terminal.
    let mut grid = dynamic_grid();
    for (name, array) in table.names().iter().zip(batch.columns()) {
        let values = (0..shown).map(|row| value(array.as_ref(), row));
        grid.add_row(std::iter::once((*name).to_owned()).chain(values));
    }
    writeln!(out, "{grid}")?;
    Ok(())
}

/// Returns an empty grid that breaks long cells into lines.
fn dynamic_grid() -> Grid {
    let mut grid = Grid::new();
    grid.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    grid
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
        DataType::Float64 => short(array.as_primitive::<Float64Type>().value(row)),
        _ => array_value_to_string(array, row).unwrap_or_default(),
    }
}

#[derive(clap::Args)]
pub(crate) struct ColumnsArguments {
    /// Path of the manifest (default: list the columns of all kinds of stage).
    manifest: Option<PathBuf>,

    #[command(flatten)]
    set: SetArguments,

    /// Stage to describe (default: all stages).
    stage: Option<String>,

    /// Print the result as JSON.
    ///
    /// Form: `[{"stage", "kind", "columns": [{"name", "type", "role", "unit", "meaning"}, …]}, …]`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn columns(
    arguments: &ColumnsArguments,
    data: &DataFolder,
) -> Result<ExitCode, Failure> {
    let ColumnsArguments { manifest, set, stage, .. } = arguments;
    let described = match manifest {
        Some(manifest) => super::session(manifest, set, data).columns(stage.as_deref())?,
        None => {
            set.refuse()?;
            DescribedColumns::for_all_kinds()
        }
    };
    let mut out = stdout();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&described)?)?;
    } else {
        write!(out, "{}", columns_text(&described))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns one line per column; columns of several stages are listed once.
fn columns_text(described: &[DescribedColumns]) -> String {
    let mut text = String::new();
    let mut known: Vec<&Description> = Vec::new();
    for DescribedColumns { stage, kind, columns } in described {
        let is_new = |column: &&Description| !known.contains(column);
        let new: Vec<&Description> = columns.iter().filter(is_new).collect();
        let name = stage.as_ref().map_or_else(String::new, |stage| format!("{stage} · "));
        let shared = match columns.len() - new.len() {
            0 => String::new(),
            shared => format!(", and {} listed above", counted(shared, "column")),
        };
        text += &format!("{name}{kind}{shared}\n{}\n\n", descriptions(&new));
        known.extend(new);
    }
    text
}

fn descriptions(columns: &[&Description]) -> String {
    let mut grid = dynamic_grid();
    if grid.width().is_none() {
        grid.set_width(WIDTH as u16);
    }
    for column in columns {
        grid.add_row([&column.name, &column.unit, &column.explained()]);
    }
    grid.trim_fmt()
}

/// Width of the output in characters if stdout is not a terminal.
const WIDTH: usize = 120;

/// Selection of the columns of a printed table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnLayout {
    /// Columns that vary, as many as fit; constant columns are listed once above the table.
    Summary,
    /// As many columns as fit into the terminal.
    Fitting,
    /// All columns, even if they do not fit.
    Everything,
}

/// Prints the first `rows` rows (0: all) of the columns with these indices, and lists omitted
/// columns.
///
/// A single row that is too wide is printed with one column per line.
///
/// # Errors
/// Returns an error if the table is damaged or the output is closed.
fn write_grid(
    out: &mut impl Write,
    table: &TableSource,
    units: &TableUnits,
    columns: &[usize],
    rows: usize,
    layout: ColumnLayout,
) -> Result<(), Failure> {
    let width = Grid::new().width().map_or(WIDTH, usize::from);
    let shown = match rows {
        0 => table.rows(),
        rows => rows.min(table.rows()),
    };
    let (columns, constant) = printed(table, units, columns, shown, layout)?;
    let fitting = match layout {
        ColumnLayout::Everything => columns.len(),
        ColumnLayout::Summary | ColumnLayout::Fitting => fitting(&columns, width),
    };
    if table.rows() == 1 && fitting < columns.len() {
        return write_vertically(out, &columns);
    }
    let (printed, hidden) = columns.split_at(fitting);
    if !constant.is_empty() {
        let text = format!("in every row: {}", constant.join(" · "));
        writeln!(out, "{}", wrapped(&text))?;
    }
    if !printed.is_empty() {
        let header = printed.iter().map(|column| &column.name);
        let rows = (0..shown).map(|row| printed.iter().map(move |column| &column.cells[row]));
        writeln!(out, "{}", in_columns(header, rows, |index| printed[index].is_right))?;
    }
    if table.rows() > shown {
        let more = counted(table.rows() - shown, "more row");
        writeln!(out, "… {more}, use `--rows 0` to print all")?;
    }
    if !hidden.is_empty() {
        let names: Vec<&str> = hidden.iter().map(|column| column.name.as_str()).collect();
        let more = counted(hidden.len(), "more column");
        let text = format!("… {more}, use `--columns NAME,…` to print: {}", names.join(", "));
        writeln!(out, "{}", wrapped(&text))?;
    }
    Ok(())
}

/// Column whose cells are formatted as text.
struct Printed {
    name: String,
    cells: Vec<String>,
    is_right: bool,
}

impl Printed {
    fn width(&self) -> usize {
        let cells = self.cells.iter().map(|cell| cell.chars().count());
        cells.fold(self.name.chars().count(), usize::max)
    }
}

/// Formats the first `shown` rows of the columns `indices`. For [`ColumnLayout::Summary`], columns
/// that are constant are returned separately, as texts.
fn printed(
    table: &TableSource,
    units: &TableUnits,
    indices: &[usize],
    shown: usize,
    layout: ColumnLayout,
) -> Result<(Vec<Printed>, Vec<String>), StoreError> {
    let (mut printed, mut constant) = (Vec::new(), Vec::new());
    let first = table.first(indices, shown)?;
    let columns = first.batch().columns().iter().zip(first.batch().schema_ref().fields());
    for ((array, field), &index) in columns.zip(indices) {
        let name = field.name();
        let unit = units.shown_of(field);
        let is_summary = layout == ColumnLayout::Summary && table.rows() > 1;
        if is_summary && table.is_constant(index)? {
            if array.is_valid(0) {
                let suffix = unit.map(|unit| format!(" {unit}")).unwrap_or_default();
                constant.push(format!("{name} {}{suffix}", cells(array.as_ref(), 1).remove(0)));
            }
            continue;
        }
        // Never shorten a command, because users copy it.
        let is_whole = layout == ColumnLayout::Everything || name == COMMAND.name;
        printed.push(Printed {
            name: head(field, units),
            cells: if is_whole || table.rows() == 1 {
                whole_cells(array.as_ref(), shown)
            } else {
                cells(array.as_ref(), shown)
            },
            is_right: *array.data_type() != DataType::Utf8,
        });
    }
    Ok((printed, constant))
}

/// Returns the head of a column: its name, with the unit if there is one to show.
fn head(field: &Field, units: &TableUnits) -> String {
    match units.shown_of(field) {
        Some(unit) => format!("{} [{unit}]", field.name()),
        None => field.name().clone(),
    }
}

/// Prints a single row with one column per line.
fn write_vertically(out: &mut impl Write, columns: &[Printed]) -> Result<(), Failure> {
    let names = columns.iter().map(|column| column.name.chars().count());
    let width = names.max().unwrap_or(0) + GAP;
    for column in columns {
        writeln!(out, "{:width$}{}", column.name, column.cells[0])?;
    }
    Ok(())
}

/// Returns the number of leading columns that fit into `width` characters, at least one.
fn fitting(columns: &[Printed], width: usize) -> usize {
    let ends = columns.iter().scan(0, |end, column| {
        *end += column.width() + GAP;
        Some(*end)
    });
    let fitting = ends.take_while(|end| end - GAP <= width).count();
    fitting.clamp(1.min(columns.len()), columns.len())
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
        let units = TableUnits::default();
        write_grid(&mut out, &table, &units, &columns, rows, ColumnLayout::Summary).unwrap();
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
    fn decimal_points_are_aligned_and_constants_printed_once() {
        let expected = "in every row: nodes 128\n \
                        load  task\n\
                        0.004  aaaaaaaa\n\
                        0.020  bbbbbbbb\n\
                        1.700  cccccccc\n";
        assert_eq!(printed(&table(), 0), expected);
    }

    #[test]
    fn omitted_rows_are_counted() {
        assert!(printed(&table(), 2).ends_with("… 1 more row, use `--rows 0` to print all\n"));
    }

    #[test]
    fn columns_that_do_not_fit_are_omitted() {
        let columns: Vec<Printed> = (0..3)
            .map(|_| Printed { name: "x".repeat(10), cells: vec![], is_right: false })
            .collect();
        assert_eq!(fitting(&columns, 22), 2);
        assert_eq!(fitting(&columns, 21), 1);
        assert_eq!(fitting(&columns, 5), 1);
        assert_eq!(fitting(&[], 5), 0);
    }
}
