//! Text: a matrix with or without header, as Gwyddion, SPIP, Nova and others export it, or triplets
//! of x, y and height on a grid.
//!
//! A line of a matrix runs along x and the first has y = 0. Sides are those of the header, or nodes ×
//! size of a pixel; of triplets nodes × step. Numbers have decimal points or commas, and stand apart
//! by spaces, tabs, semicolons or commas. `nan`, `bad`, empty cells between semicolons, and points of
//! the grid without triplet are missing. Three columns are triplets, unless the header gives sides
//! or numbers of nodes.

mod header;
mod notation;
mod triplets;

use self::header::Header;
use self::notation::{Line, Notation};
use super::channel::{Channel, Size};
use super::cursor::latin1;
use super::error::FormatError;
use super::format::Format;
use super::raster::{Raster, checked_nodes};

pub const FORMAT: Format =
    Format { name: "text", title: "text", version: 1, has_signature: false, read };

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let text = decoded(bytes)?;
    if text.starts_with("Wyko ASCII") {
        let what = "Wyko's text format, whose lines are columns; its binary `.opd` is read";
        return Err(FormatError::unsupported(what));
    }
    let mut farthest: Option<(usize, FormatError)> = None;
    for notation in Notation::ALL {
        match blocks(&text, notation) {
            Ok(blocks) => return blocks.into_iter().map(Block::channel).collect(),
            Err((line, error)) => {
                if farthest.as_ref().is_none_or(|(far, _)| line > *far) {
                    farthest = Some((line, error));
                }
            }
        }
    }
    Err(farthest.expect("every notation that fails says why").1)
}

/// The letters of a file, in whichever of the usual encodings it is.
fn decoded(bytes: &[u8]) -> Result<String, FormatError> {
    let wide = |order: fn([u8; 2]) -> u16| {
        let (letters, _) = bytes[2..].as_chunks::<2>();
        let letters = letters.iter().map(|bytes| order(*bytes));
        char::decode_utf16(letters)
            .collect::<Result<String, _>>()
            .map_err(|_| FormatError::damaged("the UTF-16 text", "it has half a letter"))
    };
    let text = match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes)?,
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes)?,
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => match str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            Err(_) => latin1(bytes),
        },
    };
    let is_text = |letter: char| !letter.is_control() || "\t\r\n\u{c}\u{1a}".contains(letter);
    match text.chars().find(|letter| !is_text(*letter)) {
        None => Ok(text),
        Some(letter) => {
            let found = letter.escape_default();
            Err(FormatError::unsupported(format!("not text: it has the letter {found}")))
        }
    }
}

/// Lines of numbers below one header.
#[derive(Default)]
struct Block {
    header: Header,
    columns: usize,
    lines: usize,
    numbers: Vec<f64>,
}

/// The blocks of a file in a notation, or the number of the line that contradicts it.
fn blocks(text: &str, notation: Notation) -> Result<Vec<Block>, (usize, FormatError)> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut block = Block::default();
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let wrong = |problem: String| {
            let error = FormatError::Line { line: number, problem };
            Err((number, error))
        };
        match notation.line(line) {
            Line::Empty => {}
            Line::Numbers(numbers) => {
                let found = numbers.len();
                if block.lines == 0 {
                    block.columns = found;
                } else if block.columns != found {
                    let columns = block.columns;
                    let above = format!("it has {found} numbers, those above have {columns}");
                    return wrong(above);
                }
                block.lines += 1;
                block.numbers.extend(numbers);
            }
            Line::Words if block.lines == 0 => block.header.add(line),
            // A second map below the first one brings its own header.
            Line::Words if Header::starts_with(line) => {
                blocks.push(std::mem::take(&mut block));
                block.header.add(line);
            }
            Line::Words if line.trim_start().starts_with(['#', '%']) => {}
            Line::Words => {
                let start: String = line.trim().chars().take(40).collect();
                return wrong(format!("`{start}` is no line of numbers"));
            }
        }
    }
    if block.lines > 0 {
        blocks.push(block);
    }
    match blocks.is_empty() {
        true => Err((0, FormatError::unsupported("text without lines of numbers"))),
        false => Ok(blocks),
    }
}

impl Block {
    fn channel<'a>(self) -> Result<Channel<'a>, FormatError> {
        let is_matrix = self.header.is_of_matrix();
        let (raster, sides) = match self.columns {
            3 if !is_matrix => {
                let grid = triplets::grid(&self.numbers)?;
                (Raster::of_columns(grid.nodes, grid.heights), Some(grid.sides))
            }
            columns if columns > 3 || is_matrix => {
                let nodes = checked_nodes([columns as i64, self.lines as i64])?;
                (Raster::of_rows(nodes, self.numbers), None)
            }
            _ => {
                let what = "one or two columns of numbers: a profile and no map";
                return Err(FormatError::unsupported(what));
            }
        };
        let description = self.header.describe(raster.nodes())?;
        let size = match sides.or(description.sides) {
            Some(sides) => Size::of(sides, &description.lateral)?,
            None => Size::Unknown,
        };
        let name = description.name.unwrap_or_else(|| "heights".to_owned());
        let raster = raster.scaled(description.factor, 0.0);
        Ok(Channel::new(name, description.height, size, raster))
    }
}

#[cfg(test)]
mod tests;
