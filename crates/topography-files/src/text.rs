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
//!   `to_csv` of pandas, or axes. Evenly spaced axes give the sides.
//! - An empty line separates maps, as in the concatenated exports of Gwyddion 2.62, unless it
//!   follows each line. Empty lines between points separate the lines of a scan, as in gnuplot.

mod header;
mod labels;
mod table;

use self::header::{Description, Header};
use self::labels::{Labels, Spacing};
use self::table::{Role, Title};
use super::channel::{Channel, Size};
use super::grid::Grid;
use super::input::{lines, utf8_or_latin1};
use super::number;
use super::raster::{Raster, checked_nodes};
use super::{Format, FormatError};

pub const FORMAT: Format =
    Format { name: "text", title: "text", version: 2, has_signature: false, read };

/// First lines of texts that are no maps, or their starts, with the names of the formats.
const OTHERS: [(&str, &str); 7] = [
    ("ply", "a PLY mesh or point cloud"),
    ("OFF", "an OFF mesh"),
    ("solid ", "an STL mesh"),
    ("# .PCD", "a PCD point cloud"),
    ("# vtk DataFile", "a VTK file"),
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
    // If every notation fails, report the error of the one that reached the farthest line.
    let mut farthest: Option<(usize, FormatError)> = None;
    for notation in Notation::ALL {
        match blocks(&text, notation) {
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
    Err(farthest.expect("the loop ends only after an error").1)
}

/// Decodes text in UTF-16 with a byte order mark, in UTF-8 or in an encoding of instruments.
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

/// Header and lines of numbers of a part of a file.
#[derive(Default)]
struct Block {
    header: Header,
    /// Lines of the header, the last of which may be titles.
    header_lines: Vec<String>,
    separator: Option<char>,
    columns: usize,
    lines: usize,
    numbers: Vec<f64>,
    /// Number of empty cells in each column.
    empty: Vec<usize>,
    /// True if a separator ends all lines.
    ends_empty: bool,
    /// First cell of the first line, if the cell is empty or a word.
    corner: Option<String>,
    /// Numbers of lines after which an empty line follows.
    breaks: Vec<usize>,
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
            Line::Numbers(row) if block.lines == 0 && is_rule(line, &row) => {}
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

/// Returns true if a line has only dashes, under the titles of a few columns.
fn is_rule(line: &str, row: &Row) -> bool {
    row.numbers.len() <= 3 && line.chars().all(|letter| "-= \t".contains(letter))
}

impl Block {
    fn add_header(&mut self, line: &str) {
        self.header.add(line);
        self.header_lines.push(line.to_owned());
    }

    /// Notes that an empty line follows the last line of numbers.
    fn end_part(&mut self) {
        if self.lines > 0 && self.breaks.last() != Some(&self.lines) {
            self.breaks.push(self.lines);
        }
    }

    /// Takes a line of numbers and words above the first line of numbers for labels if it is a word
    /// and even labels. Refuses it if it has as many cells as the next line, and an unknown word.
    fn take_above(&mut self, mut above: Row, next: &Row) -> Result<(), String> {
        if above.numbers.len() != next.numbers.len() {
            return Ok(());
        }
        let is_labelled = above.words.len() == 1 && above.words[0].index == 0;
        if is_labelled && above.numbers.len() > 3 && Labels::are_even(&above.numbers[1..]) {
            self.header_lines.pop();
            self.corner = Some(above.words.remove(0).text);
            return self.push(above);
        }
        if above.words[0].index > 0 && 2 * above.words.len() <= above.numbers.len() {
            return Err(above.words[0].problem());
        }
        Ok(())
    }

    /// Returns true if a line belongs to another map: it has another number of cells, and an empty
    /// line precedes it.
    fn starts_another_map(&self, row: &Row) -> bool {
        let allowed = usize::from(self.ends_empty || row.ends_empty());
        self.lines > 1
            && self.breaks.last() == Some(&self.lines)
            && row.numbers.len().abs_diff(self.columns) > allowed
    }

    fn push(&mut self, mut row: Row) -> Result<(), String> {
        if self.lines == 0 {
            self.columns = row.numbers.len();
            self.separator = row.separator;
            self.ends_empty = row.ends_empty();
            self.empty = vec![0; self.columns];
            if row.empty.first() == Some(&0) {
                self.corner = Some(String::new());
            }
        }
        if row.numbers.len() == self.columns + 1 && row.ends_empty() {
            row.numbers.pop();
            row.empty.pop();
        } else if row.numbers.len() + 1 == self.columns && self.ends_empty {
            self.drop_column(self.columns - 1);
        }
        let (found, columns) = (row.numbers.len(), self.columns);
        if found != columns {
            return Err(format!("it has {found} numbers, but the lines above have {columns}"));
        }
        self.ends_empty &= row.ends_empty();
        row.empty.iter().for_each(|&index| self.empty[index] += 1);
        self.numbers.extend(row.numbers);
        self.lines += 1;
        Ok(())
    }

    fn drop_column(&mut self, dropped: usize) {
        let columns = self.columns;
        let mut index = 0;
        self.numbers.retain(|_| {
            index += 1;
            (index - 1) % columns != dropped
        });
        self.columns -= 1;
        self.empty.remove(dropped);
        self.ends_empty = false;
    }

    /// Drops the cell after the separator that ends each line, and cells between tabs that align
    /// the columns.
    fn drop_empty_columns(&mut self) {
        for column in (0..self.columns).rev() {
            let is_end = column + 1 == self.columns && self.ends_empty;
            let is_empty = self.empty[column] == self.lines;
            if self.columns > 1 && is_empty && (is_end || self.separator == Some('\t')) {
                self.drop_column(column);
                if column == 0 {
                    self.corner = None;
                }
            }
        }
    }

    /// Returns the titles of the columns in the last lines of the header, with their units.
    fn titles(&self) -> Option<Vec<Title>> {
        let titles = |line: &String| table::titles(line, self.separator, self.columns);
        let mut above = self.header_lines.iter().rev().filter(|line| !line.trim().is_empty());
        let last = titles(above.next()?)?;
        let before = above.next().and_then(titles);
        if let Some(mut before) = before
            && table::add_units(&mut before, &last)
        {
            return Some(before);
        }
        Some(last)
    }

    fn channels<'a>(mut self) -> Result<Vec<Channel<'a>>, FormatError> {
        self.drop_empty_columns();
        if self.header.is_of_matrix() {
            return self.matrices(false);
        }
        if self.columns < 3 {
            let what = "one or two columns of numbers are a profile, not a map";
            return Err(FormatError::unsupported(what));
        }
        let Some(titles) = self.titles() else {
            return self.untitled();
        };
        let has = |role| titles.iter().any(|title| title.role() == role);
        let has_index = titles[0].role() == Role::Index;
        if has(Role::X) && has(Role::Y) {
            self.titled_points(&titles)
        } else if table::is_table(&titles) {
            Err(FormatError::unsupported(format!(
                "the columns {} are a table, not a map, or points with the columns x and y",
                named(&titles)
            )))
        } else if self.columns > 3 || has_index {
            self.matrices(has_index)
        } else {
            Ok(vec![self.points([0, 1, 2], None, Some(&titles), None)?])
        }
    }

    /// Reads points or matrices whose columns have no titles.
    fn untitled<'a>(self) -> Result<Vec<Channel<'a>>, FormatError> {
        if self.columns == 3 {
            return Ok(vec![self.points([0, 1, 2], None, None, None)?]);
        }
        for x in [0, 1] {
            if x + 3 <= self.columns && is_scan(&self.numbers, self.columns, x) {
                let channel = self.points([x, x + 1, x + 2], None, None, None)?;
                let [x, y, z] = [1, 2, 3].map(|more| x + more);
                return Ok(vec![channel.noted(format!(
                    "columns {x}, {y} and {z} are taken for x, y and height, because the first two \
                     lie on a grid; of {} columns, the others are not used",
                    self.columns
                ))]);
            }
        }
        self.matrices(false)
    }

    /// Reads a channel from each column of points that is no coordinate, index or flag.
    fn titled_points<'a>(self, titles: &[Title]) -> Result<Vec<Channel<'a>>, FormatError> {
        let at = |role| titles.iter().position(|title| title.role() == role);
        let (Some(x), Some(y)) = (at(Role::X), at(Role::Y)) else {
            return Err(FormatError::missing("titles x and y"));
        };
        let is_value = |index: &usize| {
            let is_counted = matches!(titles[*index].role(), Role::Index | Role::Valid);
            *index != x && *index != y && !is_counted
        };
        let (mut values, others): (Vec<usize>, Vec<usize>) = (0..titles.len())
            .filter(is_value)
            .partition(|index| titles[*index].role() == Role::Height);
        values.extend(others);
        if values.is_empty() {
            let what = format!("the columns {} are a profile, not a map", named(titles));
            return Err(FormatError::unsupported(what));
        }
        let is_one = values.len() == 1;
        let channels = values.into_iter().map(|z| {
            let name = (!is_one).then(|| titles[z].name.clone());
            self.points([x, y, z], at(Role::Valid), Some(titles), name)
        });
        channels.collect()
    }

    /// Puts points onto their grid. `columns` are those of x, y and height, `valid` that of a flag
    /// which is zero for missing points.
    fn points<'a>(
        &self,
        columns: [usize; 3],
        valid: Option<usize>,
        titles: Option<&[Title]>,
        name: Option<String>,
    ) -> Result<Channel<'a>, FormatError> {
        let mut triplets = Vec::with_capacity(3 * self.lines);
        for line in self.numbers.chunks_exact(self.columns) {
            let [x, y, z] = columns.map(|index| line[index]);
            let is_valid = valid.is_none_or(|index| line[index] != 0.0);
            triplets.extend([x, y, if is_valid { z } else { f64::NAN }]);
        }
        let grid = Grid::from_triplets(&triplets)?;
        let mut description = self.header.describe(grid.nodes)?;
        if let Some(titles) = titles {
            for title in columns.map(|index| &titles[index]) {
                title.check_unit()?;
            }
            let [x, y, z] = columns.map(|index| titles[index].unit.as_deref());
            description.set_units(x, y, z)?;
        }
        let [x, y] = grid.sides;
        let sides = [x, y * description.y_ratio];
        let raster = Raster::from_columns(grid.nodes, grid.heights);
        channel(description, Some(sides), raster, name)
    }

    /// Reads one matrix, or several that empty lines separate. `has_index` is true if the first
    /// column counts the lines.
    fn matrices<'a>(self, has_index: bool) -> Result<Vec<Channel<'a>>, FormatError> {
        let mut starts = vec![0];
        starts.extend(self.breaks.iter().copied().filter(|end| *end < self.lines));
        let ends: Vec<usize> = starts[1..].iter().copied().chain([self.lines]).collect();
        // Empty lines between single lines separate no maps.
        if starts.iter().zip(&ends).any(|(start, end)| end - start < 2) {
            return Ok(vec![self.matrix(0..self.lines, has_index)?]);
        }
        let parts = starts.into_iter().zip(ends);
        parts.map(|(start, end)| self.matrix(start..end, has_index)).collect()
    }

    fn matrix<'a>(
        &self,
        lines: std::ops::Range<usize>,
        has_index: bool,
    ) -> Result<Channel<'a>, FormatError> {
        let columns = self.columns;
        let numbers = &self.numbers[lines.start * columns..lines.end * columns];
        let corner = self.corner.as_deref().filter(|_| lines.start == 0);
        let labels = Labels::find(numbers, columns, corner.is_some(), has_index);
        if labels == Labels::NONE
            && let Some(word) = corner.filter(|word| !word.is_empty())
        {
            let problem = format!("the first line starts with `{word}`, but labels no columns");
            return Err(FormatError::unsupported(problem));
        }
        let [skip_x, skip_y] = [labels.column.is_some(), labels.line.is_some()].map(usize::from);
        let nodes = [columns - skip_x, lines.len() - skip_y];
        let nodes = checked_nodes(nodes.map(|nodes| nodes as i64))?;
        let heights = numbers.chunks_exact(columns).skip(skip_y);
        let heights: Vec<f64> = heights.flat_map(|line| &line[skip_x..]).copied().collect();
        let mut raster = Raster::from_rows(nodes, heights);
        let mut description = self.header.describe(nodes)?;
        let mut sides = description.sides;
        if let (Some(Spacing::Step(x)), Some(Spacing::Step(y))) = (labels.line, labels.column) {
            sides = sides.or(Some([nodes[0] as f64 * x.abs(), nodes[1] as f64 * y.abs()]));
            if x < 0.0 {
                raster = raster.mirrored();
            }
            if y < 0.0 {
                raster = raster.upside_down();
            }
            let corner = corner.map(Title::parse);
            let unit = corner.and_then(|corner| corner.unit.or(Some(corner.name)));
            if let Some(unit) = unit.filter(|unit| table::is_unit(unit)) {
                description.set_units(Some(&unit), Some(&unit), None)?;
            }
        }
        let note = labels.note(description.lateral.name().as_deref());
        let channel = channel(description, sides, raster, None)?;
        Ok(match note {
            Some(note) => channel.noted(note),
            None => channel,
        })
    }
}

fn channel<'a>(
    description: Description,
    sides: Option<[f64; 2]>,
    raster: Raster<'a>,
    name: Option<String>,
) -> Result<Channel<'a>, FormatError> {
    let size = match sides {
        Some(sides) => Size::new(sides, &description.lateral)?,
        None => Size::Unknown,
    };
    let name = name.or(description.name).unwrap_or_else(|| "heights".to_owned());
    let raster = raster.scaled(description.factor, 0.0);
    let channel = Channel::new(name, description.height, size, raster);
    Ok(if sides.is_some() { channel.sides_in(&description.lateral) } else { channel })
}

fn named(titles: &[Title]) -> String {
    let names: Vec<String> = titles.iter().map(|title| format!("`{}`", title.name)).collect();
    names.join(", ")
}

/// Returns true if columns `x` and the next one are coordinates of points on a full grid, line by
/// line. If `x` is 1, the first column must count the points.
fn is_scan(numbers: &[f64], columns: usize, x: usize) -> bool {
    let points = || numbers.chunks_exact(columns);
    let count = numbers.len() / columns;
    let is_monotone = |axis: usize| {
        let pairs = || points().zip(points().skip(1));
        pairs().all(|(one, next)| one[axis] <= next[axis])
            || pairs().all(|(one, next)| one[axis] >= next[axis])
    };
    let counts =
        || points().enumerate().all(|(index, point)| point[0] == index as f64 + numbers[0]);
    if count < 6 || !(is_monotone(x) || is_monotone(x + 1)) || (x > 0 && !counts()) {
        return false;
    }
    let triplets: Vec<f64> = points().flat_map(|point| [point[x], point[x + 1], 0.0]).collect();
    let grid = Grid::from_triplets(&triplets);
    grid.is_ok_and(|grid| 2 * count > grid.nodes[0] * grid.nodes[1])
}

/// Notation of the numbers of a file, and their separator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Notation {
    /// Numbers with decimal points, separated by spaces, tabs or semicolons.
    Points,
    /// Numbers with decimal commas, separated by spaces, tabs or semicolons.
    DecimalCommas,
    /// Numbers with decimal points, separated by commas.
    CommasBetween,
    /// Numbers such as `1,500.0`, separated by spaces, tabs or semicolons.
    GroupedByCommas,
    /// Numbers such as `1.500,0`, separated by spaces, tabs or semicolons.
    GroupedByPoints,
}

/// Content of a line in a given notation.
#[derive(Debug, PartialEq)]
enum Line {
    Empty,
    Numbers(Row),
    /// A line of words; with its cells if some of them are numbers.
    Words(Option<Row>),
}

/// Cells of a line. A missing point, an empty cell and a word are NaN.
#[derive(Debug, PartialEq, Default)]
struct Row {
    numbers: Vec<f64>,
    separator: Option<char>,
    /// Indices of the empty cells.
    empty: Vec<usize>,
    /// Cells that are neither numbers nor words for missing points.
    words: Vec<Word>,
}

/// Cell that is not a number.
#[derive(Debug, PartialEq)]
struct Word {
    index: usize,
    text: String,
    /// Position in the line, in characters from 1.
    column: usize,
}

impl Word {
    fn problem(&self) -> String {
        let start: String = self.text.chars().take(40).collect();
        format!(
            "`{start}` at column {} is neither a number nor a known word for a missing point",
            self.column
        )
    }
}

impl Row {
    fn ends_empty(&self) -> bool {
        self.empty.last().is_some_and(|last| last + 1 == self.numbers.len())
    }
}

impl Notation {
    /// All notations, in the order in which they are tried.
    ///
    /// `1,5 2,5` is two numbers with decimal commas, `1, 5` is two integers, and `1,5` alone is one
    /// number.
    const ALL: [Notation; 5] = [
        Notation::Points,
        Notation::DecimalCommas,
        Notation::CommasBetween,
        Notation::GroupedByCommas,
        Notation::GroupedByPoints,
    ];

    fn line(self, line: &str) -> Line {
        // Editors of MS-DOS write 0x1a at the end of a file.
        let is_end =
            |letter: char| (letter.is_whitespace() && letter != '\t') || letter == '\u{1a}';
        let line = line.trim_end_matches(is_end);
        if line.trim().is_empty() {
            return Line::Empty;
        }
        let mut row = Row { separator: self.separator(line), ..Row::default() };
        let cells: Vec<&str> = match row.separator {
            Some(separator) => table::split(line, separator),
            None => line.split_whitespace().collect(),
        };
        for (index, cell) in cells.iter().enumerate() {
            let cell = cell.trim();
            if cell.is_empty() || cell == "\"\"" {
                row.empty.push(index);
                row.numbers.push(f64::NAN);
            } else if let Some(number) = self.number(cell) {
                row.numbers.push(number);
            } else {
                row.numbers.push(f64::NAN);
                let before = &line[..cell.as_ptr() as usize - line.as_ptr() as usize];
                let column = before.chars().count() + 1;
                row.words.push(Word { index, text: cell.to_owned(), column });
            }
        }
        let numbers = row.numbers.len() - row.empty.len() - row.words.len();
        match (row.words.is_empty(), numbers) {
            (true, _) => Line::Numbers(row),
            (false, 0) => Line::Words(None),
            (false, _) => Line::Words(Some(row)),
        }
    }

    fn separator(self, line: &str) -> Option<char> {
        let is_between_tabs = || {
            let has_no_space = |cell: &str| !cell.trim().contains(char::is_whitespace);
            line.contains('\t') && line.split('\t').all(has_no_space)
        };
        match self {
            Notation::CommasBetween if line.contains(',') => Some(','),
            _ if line.contains(';') => Some(';'),
            _ => is_between_tabs().then_some('\t'),
        }
    }

    fn number(self, word: &str) -> Option<f64> {
        let quoted = word.strip_prefix('"').and_then(|word| word.strip_suffix('"'));
        let word = quoted.unwrap_or(word).trim();
        let with_comma = |word: &str| {
            let is_other = word.contains('.') || word.ends_with(',');
            if is_other { None } else { number::parse(&word.replacen(',', ".", 1)) }
        };
        let grouped = |word: &str| number::parse(&ungrouped(word, ',')?);
        let number = match self {
            Notation::Points => number::parse(word),
            Notation::DecimalCommas => with_comma(word),
            Notation::CommasBetween if quoted.is_some() => {
                number::parse(word).or_else(|| with_comma(word)).or_else(|| grouped(word))
            }
            Notation::CommasBetween => number::parse(word),
            Notation::GroupedByCommas => grouped(word),
            Notation::GroupedByPoints => ungrouped(word, '.').and_then(|word| with_comma(&word)),
        };
        number.or_else(|| number::is_missing(word).then_some(f64::NAN))
    }
}

/// Removes the separators between groups of three digits. Returns `None` if the groups before the
/// decimal sign have other lengths.
fn ungrouped(word: &str, between: char) -> Option<String> {
    let decimal = if between == ',' { '.' } else { ',' };
    let (whole, fraction) = word.find(decimal).map_or((word, ""), |end| word.split_at(end));
    let mut groups = whole.trim_start_matches(['+', '-']).split(between);
    let first = groups.next().unwrap_or_default();
    let others: Vec<&str> = groups.collect();
    let is_grouped = (1..=3).contains(&first.len()) && others.iter().all(|group| group.len() == 3);
    (others.is_empty() || is_grouped).then(|| whole.replace(between, "") + fraction)
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
        let unknown = "is neither a number nor a known word for a missing point";
        refused("1 2 3 4\n5 6 x 8\n", &format!("line 2: `x` at column 5 {unknown}"));
        refused("1 2 x 4\n5 6 7 8\n", &format!("line 1: `x` at column 5 {unknown}"));
        refused("1 2 3 4\nend of file\n", "line 2: `end of file` is not a line of numbers");
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

    /// Returns the numbers of a line, or `None` if it is a line of words.
    fn numbers(notation: Notation, line: &str) -> Option<Vec<f64>> {
        match notation.line(line) {
            Line::Numbers(row) => Some(row.numbers),
            Line::Words(_) => None,
            Line::Empty => panic!("`{line}` is empty"),
        }
    }

    #[track_caller]
    fn reads(notation: Notation, line: &str, expected: &[f64]) {
        assert_eq!(numbers(notation, line).as_deref(), Some(expected), "{line}");
    }

    #[test]
    fn numbers_are_separated_by_spaces_tabs_or_semicolons() {
        reads(Notation::Points, " 1.5 -2\t3e-9 ", &[1.5, -2.0, 3e-9]);
        reads(Notation::Points, "1.5;2;\"3\"", &[1.5, 2.0, 3.0]);
    }

    #[test]
    fn commas_are_decimal_or_between_numbers_or_between_thousands() {
        assert_eq!(numbers(Notation::Points, "1,5 2,5"), None);
        reads(Notation::DecimalCommas, "1,5 2,5", &[1.5, 2.5]);
        reads(Notation::DecimalCommas, "1,5; 2", &[1.5, 2.0]);
        assert_eq!(numbers(Notation::DecimalCommas, "1, 5"), None);
        assert_eq!(numbers(Notation::DecimalCommas, "1,2,3"), None);
        reads(Notation::CommasBetween, "1, 5.5,7", &[1.0, 5.5, 7.0]);
        reads(Notation::CommasBetween, "\"1,5\",\"2,500.5\"", &[1.5, 2500.5]);
        reads(Notation::GroupedByCommas, "1,500.0 -12,000.5 7", &[1500.0, -12000.5, 7.0]);
        assert_eq!(numbers(Notation::GroupedByCommas, "1,50.0"), None);
        reads(Notation::GroupedByPoints, "1.500,5 2.000 7,5", &[1500.5, 2000.0, 7.5]);
        let map = channels("1,500.0\t2\t3\t4\n5\t6,000\t7\t1,234,567.5\n")[0].map();
        assert_eq!(
            (map.get(0, 0), map.get(1, 1), map.get(3, 1)),
            (Some(1500.0), Some(6000.0), Some(1234567.5))
        );
    }

    #[test]
    fn words_are_no_numbers() {
        for line in ["# 1 2", "h=650 w=650", "1 2 m", "e", "1 e"] {
            assert_eq!(numbers(Notation::Points, line), None, "{line}");
        }
        assert_eq!(Notation::Points.line(" \t"), Line::Empty);
        assert_eq!(Notation::Points.line("\u{1a}"), Line::Empty);
    }

    #[track_caller]
    fn missing(text: &str, expected: &[[usize; 2]]) {
        let map = channels(text)[0].map();
        let [nodes_x, nodes_y] = map.nodes();
        let nodes = (0..nodes_x).flat_map(|i| (0..nodes_y).map(move |j| [i, j]));
        let found: Vec<[usize; 2]> = nodes.filter(|[i, j]| map.get(*i, *j).is_none()).collect();
        assert_eq!(found, expected, "{text}");
    }

    #[test]
    fn empty_cells_are_missing_points_and_separators_at_all_ends_are_not() {
        missing("1,2,3,4\n5,,7,8\n", &[[1, 1]]);
        missing("1,2,3,4\n5,6,7,\n", &[[3, 1]]);
        missing("1,2,3,\n5,6,7,8\n", &[[3, 0]]);
        missing("1;2;3;4;\n5;6;;8;\n", &[[2, 1]]);
        missing("1\t2\t3\t4\n5\t\t7\t8\n", &[[1, 1]]);
        missing("1\t\t2\t\t3\t\t4\n5\t\t6\t\t7\t\t8\n", &[]);
        missing("1;2;3;4;\n5;6;7;8\n", &[]);
        missing("1;2;3;4\n5;6;7;8;\n", &[]);
        missing("1,2,3,4\n,,,\n5,6,7,8\n", &[[0, 1], [1, 1], [2, 1], [3, 1]]);
    }

    #[test]
    fn lines_may_end_with_cr() {
        let map = channels("# Width: 3 um\r# Height: 2 um\r1 2 3\r4 5 6\r")[0].map();
        assert_eq!((map.nodes(), map.get(2, 1)), ([3, 2], Some(6.0)));
    }

    /// Returns a map of 4 × 3 points as lines of points, each with `more` at its end.
    fn points(title: &str, separator: &str, more: impl Fn(usize) -> String) -> String {
        let mut text = title.to_owned();
        for index in 0..12 {
            let (x, y) = (index % 4, index / 4);
            let cells = [0.5 * x as f64, 2.0 * y as f64, (index * index) as f64];
            let cells = cells.map(|cell| cell.to_string()).join(separator);
            text += &format!("{cells}{}\n", more(index));
        }
        text
    }

    #[track_caller]
    fn is_grid(text: &str, size: Size, height: f64) {
        let channel = &channels(text)[0];
        assert_eq!(channel.nodes(), [4, 3], "{text}");
        let (found, expected) = (channel.size().sides().unwrap(), size.sides().unwrap());
        let agrees = |axis: usize| (found[axis] / expected[axis] - 1.0).abs() < 1e-12;
        assert!(agrees(0) && agrees(1), "{text}: {:?}", channel.size());
        assert_eq!(
            std::mem::discriminant(&channel.size()),
            std::mem::discriminant(&size),
            "{text}"
        );
        let found = channel.map().get(3, 2).unwrap();
        assert!((found / height - 1.0).abs() < 1e-12, "{text}: {found}");
    }

    #[test]
    fn titles_give_the_units_of_points_in_all_spellings() {
        let metres = Size::Metres([2e-6, 6e-6]);
        for titles in [
            "x in µm,y in µm,z in nm\n",
            "x_um,y_um,z_nm\n",
            "X_(microns),Y_(microns),Height(nm)\n",
            "X / µm,Y / µm,Z / nm\n",
            "x [um],y [um],z [nm]\n",
            "X,Y,Z\n[um],[um],[nm]\n",
            "X,Y,Height\nµm,µm,nm\n",
            "\"X (µm)\",\"Y (µm)\",\"Z (nm)\"\n",
        ] {
            is_grid(&points(titles, ",", |_| String::new()), metres, 121e-9);
        }
        for titles in
            ["X, µm\tY, µm\tZ, nm\n", "# x[um] y[um] z[nm]\n", "x in µm  y in µm  z in nm\n"]
        {
            is_grid(&points(titles, "\t", |_| String::new()), metres, 121e-9);
        }
        let text = points("x [furlong],y [furlong],z [nm]\n", ",", |_| String::new());
        refused(
            &text,
            "`unit in the title of the column `x`` is furlong; expected a known unit, such as µm",
        );
    }

    #[test]
    fn further_columns_of_points_are_an_index_a_flag_or_channels() {
        let size = Size::Unitless([2.0, 6.0]);
        is_grid(&points("", " ", |index| format!(" {index}")), size, 121.0);
        is_grid(&points("x,y,z,intensity\n", ",", |index| format!(",{index}")), size, 121.0);
        let text = points("x,y,z,valid\n", ",", |index| format!(",{}", usize::from(index != 5)));
        is_grid(&text, size, 121.0);
        missing(&text, &[[1, 1]]);
        let text =
            points("x [um],y [um],height [nm],current [nA]\n", ",", |index| format!(",{index}"));
        let found = channels(&text);
        let listed: Vec<_> = found.iter().map(|one| (one.name(), one.unit())).collect();
        assert_eq!(listed, [("height", Some("m")), ("current", Some("nA"))]);
        // The index of `to_csv` of pandas.
        let text: String = points("", ",", |_| String::new())
            .lines()
            .enumerate()
            .map(|(index, line)| format!("{index},{line}\n"))
            .collect();
        is_grid(&format!(",x,y,z\n{text}"), size, 121.0);
        is_grid(&text, size, 121.0);
        assert!(channels(&text)[0].notes()[0].starts_with("columns 2, 3 and 4 are taken for x, y"));
    }

    #[test]
    fn labels_of_a_matrix_are_no_heights() {
        let rows = ["7,1,4,9", "2,8,3,6", "5,2,9,1"];
        let with = |title: &str, labels: [&str; 3]| {
            let rows = labels.iter().zip(rows).map(|(label, row)| format!("{label}{row}\n"));
            format!("{title}{}", rows.collect::<String>())
        };
        let plain = channels(&with("", [""; 3]))[0].map();
        for text in [
            with(",0,1,2,3\n", ["0,", "1,", "2,"]),
            with(",a,b,c,d\n", ["0,", "1,", "2,"]),
            with("0,1,2,3\n", [""; 3]),
            with("y0,y1,y2,y3\n", [""; 3]),
            with("A,B,C,D\n", [""; 3]),
        ] {
            assert_eq!(channels(&text)[0].map(), plain, "{text}");
        }
        let axes = with("µm,0.5,1,1.5,2\n", ["0,", "2,", "4,"]);
        let channel = &channels(&axes)[0];
        assert_eq!(channel.map().heights(), plain.heights());
        assert_eq!(channel.size(), Size::Metres([2e-6, 6e-6]));
        assert_eq!(
            channel.notes(),
            ["the first line and the first column are taken for axes in µm"]
        );
        // The axis along y descends.
        let axes = with(",0.5,1,1.5,2\n", ["4,", "2,", "0,"]);
        let channel = &channels(&axes)[0];
        assert_eq!(
            (channel.map().get(0, 0), channel.size()),
            (Some(5.0), Size::Unitless([2.0, 6.0]))
        );
    }

    #[test]
    fn tables_that_are_no_maps_are_refused() {
        let rows = "1,2,3,4\n5,6,7,8\n9,10,11,13\n";
        let named = "are a table, not a map, or points with the columns x and y";
        refused(
            &format!("Z(nm),T(V),Z2(nm),T2(V)\n{rows}"),
            &format!("the columns `Z`, `T`, `Z2`, `T2` {named}"),
        );
        refused(
            &format!("Time,Force,Height,Phase\n{rows}"),
            &format!("the columns `Time`, `Force`, `Height`, `Phase` {named}"),
        );
        refused(
            "X;Y;valid\n[mm];[mm];[1/0]\n1;2;1\n2;3;1\n",
            "the columns `X`, `Y`, `valid` are a profile, not a map",
        );
        refused(
            "ply\nformat ascii 1.0\nend_header\n0 0 1\n",
            "a PLY mesh or point cloud is not a height map",
        );
    }

    #[test]
    fn empty_lines_separate_maps_but_not_lines_of_a_scan() {
        let two = channels("1 2 3 4\n5 6 7 8\n\n9 8 7 6\n5 4 3 2\n1 0 1 0\n");
        let nodes: Vec<_> = two.iter().map(|one| one.nodes()).collect();
        assert_eq!(nodes, [[4, 2], [4, 3]]);
        assert_eq!(
            channels(
                "1 2 3 4\n5 6 7 8\n\n9 8 7\n5 4 3\n"
                    .replace("9 8 7\n5 4 3", "9 8 7 6 5\n1 2 3 4 5")
                    .as_str()
            )
            .len(),
            2
        );
        assert_eq!(channels("1 2 3 4\n\n5 6 7 8\n\n9 8 7 6\n")[0].nodes(), [4, 3]);
        assert_eq!(channels("0 0 1\n0 1 2\n\n1 0 3\n1 1 4\n")[0].nodes(), [2, 2]);
    }
}
