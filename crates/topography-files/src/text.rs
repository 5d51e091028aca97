//! Text files. They contain a matrix, as exported by Gwyddion, SPIP, Nova and others with or
//! without a header, or triplets of x, y and height on a grid.
//!
//! - The lines of a matrix run along x; the first line has y = 0.
//! - The header may give the sides of a matrix, or its pixel size; the sides are then nodes × pixel
//!   size. The sides of a grid of triplets are nodes × step.
//! - Numbers have a decimal point or comma and are separated by spaces, tabs, semicolons or commas.
//! - `nan`, `bad`, `inf`, empty cells and grid points without a triplet are missing points.
//! - A line of column titles with units, such as `X[nm] Y[nm] Z[nm]`, may precede triplets. WSxM
//!   exports such files.
//! - Three columns are triplets unless the header gives sides or numbers of nodes.

mod header;

use self::header::Header;
use super::channel::{Channel, Size};
use super::grid::Grid;
use super::input::utf8_or_latin1;
use super::raster::{Raster, checked_nodes};
use super::{Format, FormatError};

pub const FORMAT: Format =
    Format { name: "text", title: "text", version: 1, has_signature: false, read };

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let text = decoded(bytes)?;
    // If every notation fails, report the error of the one that reached the farthest line.
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
    Err(farthest.expect("the loop ends only after an error").1)
}

/// Decodes text in UTF-16 with a byte order mark, in UTF-8 or in ISO-8859-1.
pub fn decoded(bytes: &[u8]) -> Result<String, FormatError> {
    let wide = |order: fn([u8; 2]) -> u16| {
        let (letters, _) = bytes[2..].as_chunks::<2>();
        let letters: Vec<u16> = letters.iter().map(|bytes| order(*bytes)).collect();
        String::from_utf16(&letters)
            .map_err(|_| FormatError::damaged("the UTF-16 text", "it has an unpaired surrogate"))
    };
    let text = match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes)?,
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes)?,
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => utf8_or_latin1(bytes),
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

/// Header and lines of numbers of one channel.
#[derive(Default)]
struct Block {
    header: Header,
    columns: usize,
    lines: usize,
    numbers: Vec<f64>,
}

/// Splits a file into blocks and parses its numbers in the given notation.
///
/// # Errors
/// Returns the number of the first line that cannot be read in this notation, and an error.
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
                    let above =
                        format!("it has {found} numbers, but the lines above have {columns}");
                    return wrong(above);
                }
                block.lines += 1;
                block.numbers.extend(numbers);
            }
            Line::Words if block.lines == 0 => block.header.add(line),
            // The header of the next map.
            Line::Words if Header::starts_with(line) => {
                blocks.push(std::mem::take(&mut block));
                block.header.add(line);
            }
            Line::Words if line.trim_start().starts_with(['#', '%']) => {}
            Line::Words => {
                let start: String = line.trim().chars().take(40).collect();
                return wrong(format!("`{start}` is not a line of numbers"));
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

impl Block {
    fn channel<'a>(self) -> Result<Channel<'a>, FormatError> {
        let is_matrix = self.header.is_of_matrix();
        let (raster, sides) = match self.columns {
            3 if !is_matrix => {
                let grid = Grid::from_triplets(&self.numbers)?;
                (Raster::from_columns(grid.nodes, grid.heights), Some(grid.sides))
            }
            columns if columns > 3 || is_matrix => {
                let nodes = checked_nodes([columns as i64, self.lines as i64])?;
                (Raster::from_rows(nodes, self.numbers), None)
            }
            _ => {
                let what = "one or two columns of numbers are a profile, not a map";
                return Err(FormatError::unsupported(what));
            }
        };
        let description = self.header.describe(raster.nodes())?;
        let of_grid = sides.map(|[x, y]| [x, y * description.y_ratio]);
        let size = match of_grid.or(description.sides) {
            Some(sides) => Size::new(sides, &description.lateral)?,
            None => Size::Unknown,
        };
        let name = description.name.unwrap_or_else(|| "heights".to_owned());
        let raster = raster.scaled(description.factor, 0.0);
        Ok(Channel::new(name, description.height, size, raster))
    }
}

/// Decimal sign and separator of the numbers of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Notation {
    /// Numbers with decimal points, separated by spaces, tabs or semicolons.
    Points,
    /// Numbers with decimal commas, separated by spaces, tabs or semicolons.
    DecimalCommas,
    /// Numbers with decimal points, separated by commas.
    CommasBetween,
}

/// Content of a line in a given notation.
#[derive(Debug, PartialEq)]
enum Line {
    Empty,
    Numbers(Vec<f64>),
    Words,
}

impl Notation {
    /// All notations, in the order in which they are tried.
    ///
    /// `1,5 2,5` is two numbers with decimal commas, `1, 5` is two integers, and `1,5` alone is one
    /// number.
    const ALL: [Notation; 3] = [Notation::Points, Notation::DecimalCommas, Notation::CommasBetween];

    fn line(self, line: &str) -> Line {
        // Editors of MS-DOS write 0x1a at the end of a file.
        let line = line.trim_matches(|letter: char| letter.is_whitespace() || letter == '\u{1a}');
        if line.is_empty() {
            return Line::Empty;
        }
        let separator = match self {
            Notation::CommasBetween => ',',
            Notation::Points | Notation::DecimalCommas => ';',
        };
        let numbers: Option<Vec<f64>> = if line.contains(separator) {
            // A separator may end the line. An empty cell within the line is a missing point.
            let line = line.strip_suffix(separator).unwrap_or(line);
            let cells = line.split(separator);
            cells.map(|cell| self.cell(cell.trim())).collect()
        } else {
            line.split_whitespace().map(|word| self.number(word)).collect()
        };
        numbers.map_or(Line::Words, Line::Numbers)
    }

    fn cell(self, cell: &str) -> Option<f64> {
        if cell.is_empty() { Some(f64::NAN) } else { self.number(cell) }
    }

    fn number(self, word: &str) -> Option<f64> {
        let is_letter_of_number =
            |byte: u8| matches!(byte, b'0'..=b'9' | b'.' | b',' | b'+' | b'-' | b'e' | b'E');
        if !word.bytes().all(is_letter_of_number) {
            let missing = ["nan", "inf", "-inf", "infinite", "infinity", "bad"];
            let is_missing = missing.iter().any(|known| word.eq_ignore_ascii_case(known));
            return is_missing.then_some(f64::NAN);
        }
        match self {
            Notation::DecimalCommas if word.contains('.') || word.ends_with(',') => None,
            Notation::DecimalCommas => word.replacen(',', ".", 1).parse().ok(),
            Notation::Points | Notation::CommasBetween => word.parse().ok(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Quantity;

    #[track_caller]
    fn channels(text: &str) -> Vec<Channel<'_>> {
        read(text.as_bytes()).unwrap()
    }

    #[track_caller]
    fn refused(text: &str, message: &str) {
        let error = read(text.as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), message);
    }

    #[test]
    fn a_matrix_alone_has_no_size_and_no_unit() {
        let channel = &channels("1 2 3 4\n5 6 7 8\n")[0];
        assert_eq!(channel.nodes(), [4, 2]);
        assert_eq!(channel.size(), Size::Unknown);
        assert_eq!(channel.quantity(), &Quantity::Unitless);
        assert_eq!(channel.map().get(3, 0), Some(4.0));
    }

    #[test]
    fn decimal_commas_are_not_taken_for_separators() {
        let channel = &channels("0,5 1 2 3\n4 5,5 6 7\n")[0];
        assert_eq!(channel.nodes(), [4, 2]);
        assert_eq!(channel.map().get(1, 1), Some(5.5));
        let channel = &channels("0.5, 1, 2, 3\n4, 5.5, 6, 7\n")[0];
        assert_eq!(channel.map().get(1, 1), Some(5.5));
    }

    #[test]
    fn several_maps_in_a_file_have_separate_headers() {
        let one = "# Channel: A\n# Width: 1 µm\n# Height: 2 µm\n# Value units: m\n1 2\n3 4\n";
        let other = "# Channel: B\n# Width: 3 µm\n# Height: 2 µm\n# Value units: V\n1 2 3\n";
        let text = format!("{one}\n{other}");
        let channels = channels(&text);
        let listed: Vec<_> = channels.iter().map(|c| (c.name(), c.unit(), c.nodes()[0])).collect();
        assert_eq!(listed, [("A", Some("m"), 2), ("B", Some("V"), 3)]);
    }

    #[test]
    fn pixels_give_the_size() {
        let text = "pixel size = 2 nm\nheight conversion factor (-> nm) = 3\n1 2 3 4\n5 6 7 8\n";
        let channel = &channels(text)[0];
        let sides = channel.size().sides().unwrap();
        assert!((sides[0] / 8e-9 - 1.0).abs() < 1e-14 && (sides[1] / 4e-9 - 1.0).abs() < 1e-14);
        assert!((channel.map().get(1, 1).unwrap() / 18e-9 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_header_that_contradicts_the_matrix_is_refused() {
        refused(
            "h=3 w=4\n1 2 3 4\n5 6 7 8\n",
            "`y-pixels` is 3; expected 2, the number in the matrix",
        );
        refused("1 2 3 4\n5 6 7\n", "line 2: it has 3 numbers, but the lines above have 4");
        refused("1 2 3 4\n5 6 x 8\n", "line 2: `5 6 x 8` is not a line of numbers");
    }

    #[test]
    fn a_profile_is_refused() {
        refused("0 1\n1 2\n2 3\n", "one or two columns of numbers are a profile, not a map");
        refused("0 0 1\n1 1 2\n2 2 3\n3 3 3\n", "4 triplets along a line are a profile, not a map");
    }

    #[test]
    fn triplets_are_put_onto_their_grid() {
        let text = "0 0 1\n0 2 2\n1.001 0 3\n1 2 4\n2 0 5\n2 2 6\n";
        let channel = &channels(text)[0];
        assert_eq!(channel.nodes(), [3, 2]);
        assert_eq!(channel.size(), Size::Unitless([3.0, 4.0]));
        assert_eq!(channel.map().heights(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn titles_of_columns_may_give_the_units() {
        let text = "max [V]\nx (µm); y (mm); Height z [nm]\n0;0;1\n0;1;2\n2;0;3\n2;1;4\n";
        let channel = &channels(text)[0];
        assert_eq!(channel.size(), Size::Metres([4e-6, 2e-3]));
        assert_eq!(channel.map().get(1, 1), Some(4e-9));
        let text = "X[s] Y[nm] Z[nm]\n0 0 1\n0 1 2\n2 0 3\n2 1 4\n";
        refused(text, "`unit of y` is nm; expected a unit like that of x, `s`");
    }

    #[test]
    fn a_grid_may_have_missing_lines() {
        let text = "0 0 1\n0 1 2\n1 0 3\n1 1 4\n3 0 5\n3 1 6\n";
        let map = channels(text)[0].map();
        assert_eq!(map.nodes(), [4, 2]);
        assert_eq!((map.get(2, 0), map.get(3, 1)), (None, Some(6.0)));
    }

    #[test]
    fn triplets_that_lie_on_no_grid_are_refused() {
        refused("0 0 1\n0 1 2\n0 1 2\n1 0 3\n1 1 4\n", "two triplets have x = 0, y = 1");
        refused(
            "0 0 1\n0 1 2\n1 0 3\n1 1 4\n2.5 0 5\n2.5 1 6\n3.77 0 1\n3.77 1 1\n",
            "the x coordinates of the triplets are not evenly spaced",
        );
    }

    #[test]
    fn control_characters_are_named() {
        let error = decoded(b"1 2\x00").unwrap_err();
        assert_eq!(error.to_string(), "not a text file: it has the character \\u{0}");
    }

    #[track_caller]
    fn reads(notation: Notation, line: &str, numbers: &[f64]) {
        assert_eq!(notation.line(line), Line::Numbers(numbers.to_vec()), "{line}");
    }

    #[test]
    fn numbers_are_separated_by_spaces_tabs_or_semicolons() {
        reads(Notation::Points, " 1.5 -2\t3e-9 ", &[1.5, -2.0, 3e-9]);
        reads(Notation::Points, "1.5;2;3;", &[1.5, 2.0, 3.0]);
    }

    #[test]
    fn commas_are_decimal_or_between_numbers() {
        assert_eq!(Notation::Points.line("1,5 2,5"), Line::Words);
        reads(Notation::DecimalCommas, "1,5 2,5", &[1.5, 2.5]);
        reads(Notation::DecimalCommas, "1,5; 2", &[1.5, 2.0]);
        assert_eq!(Notation::DecimalCommas.line("1, 5"), Line::Words);
        assert_eq!(Notation::DecimalCommas.line("1,2,3"), Line::Words);
        reads(Notation::CommasBetween, "1, 5.5,7,", &[1.0, 5.5, 7.0]);
    }

    #[test]
    fn markers_and_empty_cells_are_missing_points() {
        for word in ["nan", "BAD", "-inf", "NaN"] {
            let Line::Numbers(numbers) = Notation::Points.line(&format!("1 {word}")) else {
                panic!("`{word}`");
            };
            assert!(numbers[1].is_nan());
        }
        let Line::Numbers(numbers) = Notation::Points.line("1;;2") else {
            panic!();
        };
        assert!(numbers[1].is_nan() && numbers[2] == 2.0);
    }

    #[test]
    fn words_are_no_numbers() {
        for line in ["# 1 2", "h=650 w=650", "1 2 m", "e", "--"] {
            assert_eq!(Notation::Points.line(line), Line::Words, "{line}");
        }
        assert_eq!(Notation::Points.line(" \t"), Line::Empty);
        assert_eq!(Notation::Points.line("\u{1a}"), Line::Empty);
    }
}
