//! Text files. They contain a matrix, as exported by Gwyddion, SPIP, Nova and others with or
//! without a header, or points x, y and height on a grid.
//!
//! - The lines of a matrix run along x; the first line has y = 0.
//! - The header may give the sides of a matrix, or its pixel size; the sides are then nodes × pixel
//!   size. The sides of a grid of points are nodes × step.
//! - Numbers have a decimal point or comma, perhaps groups of thousands (`1,500.0`), or exponents
//!   with `D`, and are separated by spaces, tabs, semicolons or commas.
//! - Words such as `nan` and `NA` (module `number`), empty cells and grid points without a point in
//!   the file are missing points. A separator at the end of all lines ends them; at the end of some
//!   lines, an empty cell follows it.
//! - Lines of titles may precede the numbers, with units in many spellings (module `table`). WSxM,
//!   SurfaceTopography and spreadsheets write such files. Columns with the titles x and y are
//!   points; each other column is a channel, except an index and the flag `valid`. Other titles of
//!   different quantities are a table, which is refused.
//! - Three columns are points unless the header gives sides or numbers of nodes. More columns are
//!   points if the first two lie on a full grid, line by line.
//! - Labels of lines and columns are no heights (module `labels`): the index and the columns of
//!   `to_csv` of pandas 3.0 and `write.table` of R 4.2, or axes. Evenly spaced axes give the sides.
//! - An empty line separates maps, as in the concatenated exports of Gwyddion 2.62, unless it
//!   follows each line. Empty lines between points separate the lines of a scan, as in gnuplot.

mod block;
mod header;
mod labels;
mod notation;
mod table;
#[cfg(test)]
mod tests;

use encoding_rs::Encoding;

use self::block::Block;
use self::header::Header;
use self::notation::{Line, Notation, Row};
use super::channel::Channel;
use super::input::{decode_text, lines};
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("text", "text", read).without_signature().changed(&[
    "units in all spellings of titles convert the numbers; labels are no heights; maps that empty \
     lines separate are channels",
    "lines above the numbers that look like numbers are a header",
    "more spellings of titles, headers and missing points",
]);

/// First lines of texts that are no maps, or their starts, with the names of the formats.
const OTHERS: [(&str, &str); 8] = [
    ("ply", "a PLY mesh or point cloud"),
    ("OFF", "an OFF mesh"),
    ("solid ", "an STL mesh"),
    ("# .PCD", "a PCD point cloud"),
    ("# vtk DataFile", "a VTK file"),
    ("#FORMAT      : EMSA/MAS", "an EMSA/MAS spectrum"),
    ("<?xml", "an XML file"),
    ("<", "a file in HTML or XML"),
];

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let first = bytes.split(|byte| b"\r\n".contains(byte)).next().unwrap_or_default();
    let other = OTHERS.iter().find(|(start, _)| {
        let is_word = start.bytes().all(|byte| byte.is_ascii_alphabetic());
        if is_word { first == start.as_bytes() } else { first.starts_with(start.as_bytes()) }
    });
    if let Some((_, name)) = other {
        return Err(FormatError::unsupported(format!("{name} is not a height map")));
    }
    let text = decoded(bytes)?;
    // Tabs may be separators, beside which cells are empty, or spaces that align the columns.
    let spaced = text.contains('\t').then(|| text.replace('\t', " "));
    // If every notation fails, report the error of the one that reached the farthest line.
    let mut farthest: Option<(usize, FormatError)> = None;
    for text in [Some(&text), spaced.as_ref()].into_iter().flatten() {
        for notation in Notation::ALL {
            match blocks(text, notation) {
                Ok(blocks) => {
                    let channels: Vec<Vec<Channel>> =
                        blocks.into_iter().map(Block::channels).collect::<Result<_, _>>()?;
                    return Ok(channels.into_iter().flatten().collect());
                }
                Err((line, error)) => {
                    if farthest.as_ref().is_none_or(|(far, _)| line > *far) {
                        farthest = Some((line, error));
                    }
                }
            }
        }
    }
    Err(farthest.expect("the loop ends only after an error").1)
}

/// Reads a profile: one column of heights, or two columns x and height, with units in titles.
pub(crate) fn profile(text: &str) -> Result<Channel<'static>, FormatError> {
    let mut first_error = None;
    for notation in Notation::ALL {
        let mut blocks = match blocks(text, notation) {
            Ok(blocks) => blocks,
            Err((_, error)) => {
                first_error.get_or_insert(error);
                continue;
            }
        };
        if blocks.len() > 1 {
            let what = format!("the text has {} blocks of numbers; a profile is one", blocks.len());
            return Err(FormatError::unsupported(what));
        }
        return blocks.remove(0).profile();
    }
    Err(first_error.expect("the loop ends only after an error"))
}

/// Decodes text in UTF-8 or UTF-16 with a byte order mark, in UTF-8 or in an encoding of
/// instruments.
pub(crate) fn decoded(bytes: &[u8]) -> Result<String, FormatError> {
    let text = match Encoding::for_bom(bytes) {
        Some((encoding, _)) => encoding.decode_with_bom_removal(bytes).0.into_owned(),
        None => decode_text(bytes),
    };
    let is_text = |letter: char| !letter.is_control() || "\t\r\n\u{c}\u{1a}".contains(letter);
    match text.chars().find(|letter| !is_text(*letter)) {
        None => Ok(text),
        Some(letter) => {
            let found = letter.escape_default();
            Err(FormatError::unsupported(format!("not a text file: it has the character {found}")))
        }
    }
}

/// Splits a file into blocks and parses its numbers in the given notation.
///
/// # Errors
/// Returns the number of the first line that cannot be read in this notation, and an error.
fn blocks(text: &str, notation: Notation) -> Result<Vec<Block>, (usize, FormatError)> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut block = Block::default();
    // Line above the numbers that has numbers and words.
    let mut mixed: Option<(usize, Row)> = None;
    for (index, line) in lines(text).enumerate() {
        let number = index + 1;
        let wrong = |problem: String| (number, FormatError::Line { line: number, problem });
        match notation.line(line) {
            Line::Empty => {
                mixed = None;
                block.end_part();
            }
            Line::Numbers(row) if block.lines == 0 && is_decoration(line, &row) => {}
            Line::Numbers(row) if block.is_padding(&row) => {}
            Line::Numbers(row) => {
                if let Some((line, above)) = mixed.take() {
                    block
                        .take_above(above, &row)
                        .map_err(|problem| (line, FormatError::Line { line, problem }))?;
                }
                if block.starts_another_map(&row) {
                    blocks.push(std::mem::take(&mut block));
                }
                block.push(row).map_err(wrong)?;
            }
            Line::Words(_) if block.lines > 0 && Header::starts_with(line) => {
                // The header of the next map.
                blocks.push(std::mem::take(&mut block));
                block.add_header(line);
            }
            Line::Words(Some(row)) if block.lines > 0 && row.has_comment(block.columns) => {
                let row = row.without_comment(block.columns);
                block.push(row).map_err(wrong)?;
            }
            Line::Words(row) if block.lines == 0 => {
                block.add_header(line);
                mixed = row.map(|row| (number, row));
            }
            Line::Words(_) if line.trim_start().starts_with(['#', '%']) => {}
            Line::Words(Some(row)) => return Err(wrong(row.words[0].problem())),
            Line::Words(None) => {
                let start: String = line.trim().chars().take(40).collect();
                return Err(wrong(format!("`{start}` is not a line of numbers")));
            }
        }
    }
    if block.lines > 0 {
        blocks.push(block);
    }
    if blocks.is_empty() {
        Err((0, FormatError::unsupported("the text has no lines of numbers")))
    } else {
        Ok(blocks)
    }
}

/// Returns true if a line above the numbers is a row of dashes or stars under the titles of a few
/// columns, or a single word, such as `None`, that marks a missing point elsewhere.
fn is_decoration(line: &str, row: &Row) -> bool {
    let is_rule = || line.chars().all(|letter| "-=* \t".contains(letter));
    let is_word = || row.numbers.len() == 1 && row.numbers[0].is_nan();
    (row.numbers.len() <= 3 && is_rule()) || is_word()
}
