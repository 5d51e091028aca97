//! `asperity show`: how a table was made, and its first rows.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use arrow::array::{Array, AsArray};
use arrow::datatypes::DataType;
use arrow::util::display::array_value_to_string;
use comfy_table::{ContentArrangement, Table as Grid, presets};

use super::terminal::stdout;
use super::{Failure, counted};
use crate::session::task_names;
use asperity_pipeline::data_folder::DataFolder;
use asperity_tables::parquet::{Columns, Metadata};
use asperity_tables::store::files::read_whole;
use asperity_tables::table::Table;

#[derive(clap::Args)]
pub struct Arguments {
    /// A finished task's key or the first digits of it, or a Parquet file of the store or the results.
    #[arg(value_name = "KEY|FILE")]
    what: PathBuf,

    /// Rows to print.
    #[arg(long, default_value_t = 10)]
    rows: usize,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let path = find(&arguments.what, data)?;
    let (table, metadata) = read_whole(&path, Columns::All)?;
    let mut out = stdout();
    write_metadata(&mut out, &path, &metadata)?;
    write_head(&mut out, &table, arguments.rows)?;
    Ok(ExitCode::SUCCESS)
}

/// A file by its path, or a finished task's by its key.
fn find(what: &Path, data: &DataFolder) -> Result<PathBuf, Failure> {
    if what.is_file() {
        return Ok(what.to_owned());
    }
    let key = task_names::finished(&what.to_string_lossy(), data)?;
    Ok(data.look()?.path(key))
}

fn write_metadata(out: &mut impl Write, path: &Path, metadata: &Metadata) -> Result<(), Failure> {
    writeln!(out, "{:15}{}", "file", path.display())?;
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
            let number = array.as_primitive::<arrow::datatypes::Float64Type>().value(row);
            short(number)
        }
        _ => array_value_to_string(array, row).unwrap_or_default(),
    }
}

/// Six significant digits: enough to recognise a number.
pub fn short(number: f64) -> String {
    let magnitude = number.abs();
    if number == 0.0 || (1e-4..1e6).contains(&magnitude) {
        let digits = (5 - magnitude.max(1e-300).log10().floor() as i32).clamp(0, 9) as usize;
        let text = format!("{number:.*}", if number == 0.0 { 0 } else { digits });
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    } else {
        format!("{number:.5e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_with_six_digits_and_no_tail() {
        let shown = [0.0, 0.5, 1234.0, 0.123456789, 1.5e-7, 2.5e9].map(short);
        assert_eq!(shown, ["0", "0.5", "1234", "0.123457", "1.50000e-7", "2.50000e9"]);
    }
}
