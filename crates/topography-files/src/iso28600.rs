//! SPM data transfer format of ISO 28600 (`.spm`), with a text header of fixed lines, followed by
//! numbers.
//!
//! Line 17 gives the mode, lines 24 to 29 the points, units and sides along x and y, lines 69 and
//! 70 the name and unit of a single channel, and lines from 94 on the number of channels and their
//! names, units and comments. Each line of numbers is a point with a number for each channel, which
//! x and y precede in an irregular mapping. Lines run along x; the first has y = 0. Gwyddion 2.62
//! writes such files, with `top to bottom` as the direction of the lines. Whether other programs
//! write `bottom to top` in reverse order is not known; the direction is not used.

use super::channel::{Channel, Sides};
use super::grid::Grid;
use super::input::{after, decode_text, lines};
use super::number;
use super::raster::{Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format =
    Format::new("iso28600", "SPM data transfer format, ISO 28600", 1, read);

const SIGNATURE: &[u8] = b"ISO/TC 201 SPM data transfer format";

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, SIGNATURE)?;
    let text = decode_text(bytes);
    let lines: Vec<&str> = lines(&text).map(str::trim).collect();
    let line = |number: usize| lines.get(number - 1).copied().unwrap_or_default();
    let entry = |number: usize| format!("line {number} of the header");
    let real = |number: usize| {
        number::parse(line(number))
            .ok_or_else(|| FormatError::value(&entry(number), line(number), "a number"))
    };
    let channels = match line(8) {
        "MAP_SC" => vec![(line(69), line(70))],
        "MAP_MC" => {
            let count = real(94)? as usize;
            if !(1..=8).contains(&count) {
                return Err(FormatError::value(&entry(94), count, "1 to 8 channels"));
            }
            (0..count).map(|index| (line(95 + 3 * index), line(96 + 3 * index))).collect()
        }
        other => {
            return Err(FormatError::value("mode of the experiment", other, "MAP_SC or MAP_MC"));
        }
    };
    let found = lines.iter().position(|line| *line == "end of header");
    let end = found.ok_or_else(|| FormatError::missing("end of header"))?;
    let is_regular = line(17) != "IRREGULAR MAPPING";
    let columns = channels.len() + if is_regular { 0 } else { 2 };
    let numbers = numbers(&lines[end + 1..], columns, end + 2)?;
    let [unit_x, unit_y] = [26, 27].map(line);
    let channels = channels.into_iter().enumerate().map(|(index, (name, unit))| {
        let column = |index: usize| numbers.iter().skip(index).step_by(columns).copied();
        let (raster, sides) = if is_regular {
            let nodes = checked_nodes([real(24)? as i64, real(25)? as i64])?;
            let heights: Vec<f64> = column(index).collect();
            (Raster::from_words(nodes, heights)?, [real(28)?, real(29)?])
        } else {
            let points = column(0).zip(column(1)).zip(column(index + 2));
            let triplets: Vec<f64> = points.flat_map(|((x, y), z)| [x, y, z]).collect();
            let grid = Grid::from_triplets(&triplets)?;
            (Raster::from_columns(grid.nodes, grid.heights), grid.sides)
        };
        let size = Sides::in_units(sides, [unit_x, unit_y])?;
        // `n` and `d` are numbers without a unit.
        let unit = if matches!(unit, "n" | "d") { Unit::None } else { Unit::parse(unit) };
        let name = if name.is_empty() { "heights" } else { name };
        Ok(Channel::new(name, unit, size, raster))
    });
    channels.collect()
}

/// Reads lines of `columns` numbers up to the line `end of experiment`. `first` is the number of
/// the first line, for errors.
fn numbers(lines: &[&str], columns: usize, first: usize) -> Result<Vec<f64>, FormatError> {
    let mut numbers = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        if *line == "end of experiment" {
            return Ok(numbers);
        }
        let before = numbers.len();
        for word in line.split([' ', '\t', ',']).filter(|word| !word.is_empty()) {
            let number = number::parse_or_missing(word);
            numbers.push(number.ok_or_else(|| FormatError::Line {
                line: first + index,
                problem: format!("`{word}` is not a number"),
            })?);
        }
        let found = numbers.len() - before;
        if found != columns && found > 0 {
            let problem = format!("it has {found} numbers, but each point has {columns}");
            return Err(FormatError::Line { line: first + index, problem });
        }
    }
    Err(FormatError::missing("end of experiment"))
}
