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
    Format::new("iso28600", "SPM data transfer format, ISO 28600", read);

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
    let find = |mark: &str| {
        let found = lines.iter().position(|line| *line == mark);
        found.ok_or_else(|| FormatError::missing(mark))
    };
    let (header, end) = (find("end of header")?, find("end of experiment")?);
    let is_regular = line(17) != "IRREGULAR MAPPING";
    let columns = channels.len() + if is_regular { 0 } else { 2 };
    let rows = lines.iter().zip(1..).take(end).skip(header + 1).map(|(line, number)| {
        (number, line.split([' ', '\t', ',']).filter(|word| !word.is_empty()))
    });
    let numbers = number::lines(rows, columns, number::parse_or_missing)?;
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
