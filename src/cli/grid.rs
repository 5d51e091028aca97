//! A table as people read it: numbers in line, what is the same in all rows said once, and no
//! wider than the terminal.

use std::io::Write;

use arrow::array::Array;
use arrow::datatypes::DataType;
use comfy_table::{CellAlignment, Table as Grid, presets};

use super::{Failure, counted};
use asperity_manifest::diagnostics::wrapped;
use asperity_tables::cells::cells;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;

/// Columns of text where the output is no terminal.
const WIDTH: usize = 120;
/// Spaces between columns.
const GAP: usize = 2;

/// Which columns are printed side by side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnLayout {
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
pub fn write(
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
    use asperity_tables::column::{Column, ColumnKind, integers, reals, texts};
    use asperity_tables::table::Table;

    const TASK: Column = Column::result("task", ColumnKind::Text, "", "task");
    const NODES: Column = Column::parameter("nodes", ColumnKind::Integer, "1", "nodes");
    const LOAD: Column = Column::parameter("load", ColumnKind::Real, "1", "load");

    fn printed(table: &Table, rows: usize) -> String {
        let mut out = Vec::new();
        let columns: Vec<usize> = (0..table.names().len()).collect();
        let table = table.clone().into();
        write(&mut out, &table, &columns, rows, ColumnLayout::Summary).unwrap();
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
