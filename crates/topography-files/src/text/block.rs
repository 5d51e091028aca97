//! Part of a text file: a header and lines of numbers, which are a matrix or points.

use std::ops::Range;

use super::header::{Description, Header};
use super::labels::{Evidence, Labels};
use super::notation::{Row, Word};
use super::table::{self, Role, Title};
use crate::FormatError;
use crate::channel::{Channel, Sides};
use crate::grid::Grid;
use crate::raster::{Raster, checked_nodes};
use crate::unit::Unit;

/// Header and lines of numbers of a part of a file.
#[derive(Default)]
pub(crate) struct Block {
    header: Header,
    /// Lines of the header, the last of which may be titles.
    header_lines: Vec<String>,
    separator: Option<char>,
    pub(crate) columns: usize,
    pub(crate) lines: usize,
    numbers: Vec<f64>,
    /// Number of empty cells in each column.
    empty: Vec<usize>,
    /// True if a separator ends all lines.
    ends_empty: bool,
    /// First cell of the first line, if the cell is empty or a word.
    corner: Option<String>,
    /// Numbers of lines after which an empty line follows.
    pub(crate) breaks: Vec<usize>,
    /// Numbers of cells as in [`Row::commas`].
    commas: [usize; 2],
}

impl Block {
    pub(crate) fn add_header(&mut self, line: &str) {
        self.header.add(line);
        self.header_lines.push(line.to_owned());
    }

    /// Returns true for separators alone below a line of the header that ends with separators: the
    /// empty line of a spreadsheet, whose lines all have the same number of cells.
    pub(crate) fn is_padding(&self, row: &Row) -> bool {
        let above = self.header_lines.last().map(|line| line.trim_end_matches([' ', '\r']));
        let is_padded = || above.is_some_and(|line| line.ends_with([',', ';', '\t']));
        self.lines == 0 && row.empty.len() == row.numbers.len() && is_padded()
    }

    /// Notes that an empty line follows the last line of numbers.
    pub(crate) fn end_part(&mut self) {
        if self.lines > 0 && self.breaks.last() != Some(&self.lines) {
            self.breaks.push(self.lines);
        }
    }

    /// Takes a line of numbers and words above the first line of numbers for labels if it is a word
    /// and even labels. Refuses it if it has as many cells as the next line, and an unknown word.
    ///
    /// Comments and lines with a unit of length, such as `10 x 10 µm`, are part of the header.
    pub(crate) fn take_above(&mut self, mut above: Row, next: &Row) -> Result<(), String> {
        let columns = next.numbers.len();
        if above.has_comment(columns) {
            self.header_lines.pop();
            return self.push(above.without_comment(columns));
        }
        let is_header = || {
            let of_header = |word: &Word| {
                word.text.starts_with(['#', '%']) || Unit::parse(&word.text).per_metre().is_some()
            };
            above.separator.is_none() && above.words.iter().any(of_header)
        };
        if above.numbers.len() != next.numbers.len() || is_header() {
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
    pub(crate) fn starts_another_map(&self, row: &Row) -> bool {
        let allowed = usize::from(self.ends_empty || row.ends_empty());
        self.lines > 1
            && self.breaks.last() == Some(&self.lines)
            && row.numbers.len().abs_diff(self.columns) > allowed
    }

    pub(crate) fn push(&mut self, mut row: Row) -> Result<(), String> {
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
        self.commas = [0, 1].map(|index| self.commas[index] + row.commas[index]);
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
    /// the columns. Returns the number of the latter.
    fn drop_empty_columns(&mut self) -> usize {
        let mut between = 0;
        for column in (0..self.columns).rev() {
            let is_end = column + 1 == self.columns && self.ends_empty;
            let is_empty = self.empty[column] == self.lines;
            if self.columns > 1 && is_empty && (is_end || self.separator == Some('\t')) {
                self.drop_column(column);
                between += usize::from(!is_end);
                if column == 0 {
                    self.corner = None;
                }
            }
        }
        between
    }

    /// Reads one column of heights, or two columns x and height.
    ///
    /// # Errors
    /// Returns an error if there are other columns, or if x is not evenly spaced.
    pub(crate) fn profile(mut self) -> Result<Channel<'static>, FormatError> {
        self.drop_empty_columns();
        if !matches!(self.columns, 1 | 2) {
            let what = format!(
                "a profile has one column, of heights, or two, of x and heights; this text has {}",
                self.columns
            );
            return Err(FormatError::unsupported(what));
        }
        let titles = self.titles();
        let nodes = checked_nodes([self.lines, 1])?;
        let mut description = self.header.describe(nodes)?;
        for title in titles.iter().flatten() {
            title.check_unit()?;
        }
        let unit = |column: usize| titles.as_ref()?[column].unit.as_deref();
        let column = |column: usize| -> Vec<f64> {
            self.numbers.chunks_exact(self.columns).map(|row| row[column]).collect()
        };
        let z = self.columns - 1;
        description.set_units(unit(0).filter(|_| z == 1), None, unit(z))?;
        let heights = Raster::from_columns(nodes, column(z));
        if z == 0 {
            return channel(description, None, heights, None);
        }
        let step = even_step(&column(0))?;
        let sides = [step.abs() * self.lines as f64, step.abs()];
        let heights = if step < 0.0 { heights.mirrored() } else { heights };
        channel(description, Some(sides), heights, None)
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

    /// Reads the channels of the part.
    pub(crate) fn channels<'a>(mut self) -> Result<Vec<Channel<'a>>, FormatError> {
        let dropped = self.drop_empty_columns();
        let mut notes = Vec::new();
        if dropped > 0 {
            notes.push(format!("{dropped} columns between tabs are empty and are not used"));
        }
        if self.commas[0] > 0 && self.commas[0] == self.commas[1] {
            let note =
                "commas are taken for decimal signs, although all are followed by three digits";
            notes.push(note.to_owned());
        }
        let channels = self.points_or_matrices()?;
        Ok(channels.into_iter().map(|channel| channel.noted(&notes)).collect())
    }

    fn points_or_matrices<'a>(self) -> Result<Vec<Channel<'a>>, FormatError> {
        // A header may state the sides of points, too.
        let are_points = || self.columns == 3 && is_scan(&self.numbers, self.columns, 0);
        if self.header.is_of_matrix() && !are_points() {
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
        if table::are_letters(&titles) && titles.len() > 3 {
            self.matrices(has_index)
        } else if has(Role::X) && has(Role::Y) {
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
                return Ok(vec![channel.noted([format!(
                    "columns {x}, {y} and {z} are taken for x, y and height, because the first two \
                     lie on a grid; of {} columns, the others are not used",
                    self.columns
                )])]);
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
                // A further quantity beside the heights may have any unit.
                if titles.len() == 3 || title.role() != Role::Other {
                    title.check_unit()?;
                }
            }
            let [x, y, z] = columns.map(|index| titles[index].unit_or_degrees());
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
        // Empty lines between single lines, and within the lines of the header, separate no maps.
        let has_single = starts.iter().zip(&ends).any(|(start, end)| end - start < 2);
        let count = starts.len();
        if count == 1 || has_single || self.header.states_lines(self.lines) {
            return Ok(vec![self.matrix(0..self.lines, has_index)?]);
        }
        let parts = starts.into_iter().zip(ends).map(|(start, end)| {
            let channel = self.matrix(start..end, has_index)?;
            Ok(channel.noted([format!("empty lines separate {count} maps of the text")]))
        });
        parts.collect()
    }

    fn matrix<'a>(&self, lines: Range<usize>, has_index: bool) -> Result<Channel<'a>, FormatError> {
        let columns = self.columns;
        let numbers = &self.numbers[lines.start * columns..lines.end * columns];
        let corner = self.corner.as_deref().filter(|_| lines.start == 0);
        let evidence = match corner {
            Some(_) => Evidence::Corner,
            None if has_index => Evidence::Index,
            None if self.header.is_of_matrix() => Evidence::Header,
            None if self.separator.is_some() => Evidence::Cells,
            None => Evidence::Spaces,
        };
        let labels = Labels::find(numbers, columns, evidence);
        if labels == Labels::NONE
            && let Some(word) = corner.filter(|word| !word.is_empty())
        {
            if self.separator.is_none() {
                // A line of the header, such as `Scan 1 2 3`.
                return self.matrix(lines.start + 1..lines.end, has_index);
            }
            let problem = format!("the first line starts with `{word}`, but labels no columns");
            return Err(FormatError::unsupported(problem));
        }
        let [skip_x, skip_y] = [labels.column.is_some(), labels.line.is_some()].map(usize::from);
        let nodes = checked_nodes([columns - skip_x, lines.len() - skip_y])?;
        let rows = numbers.chunks_exact(columns).skip(skip_y);
        let heights: Vec<f64> = rows.flat_map(|line| &line[skip_x..]).copied().collect();
        let mut raster = Raster::from_rows(nodes, heights);
        let mut description = self.header.describe(nodes)?;
        let mut sides = description.sides;
        let unit = corner.map(axis_unit).transpose()?.flatten();
        if let Some([x, y]) = labels.steps(unit.is_some()) {
            sides = sides.or(Some([nodes[0] as f64 * x.abs(), nodes[1] as f64 * y.abs()]));
            if x < 0.0 {
                raster = raster.mirrored();
            }
            if y < 0.0 {
                raster = raster.upside_down();
            }
            if let Some(unit) = &unit {
                description.set_units(Some(unit), Some(unit), None)?;
            }
        }
        let note = labels.note(description.lateral.name().as_deref());
        Ok(channel(description, sides, raster, None)?.noted(note))
    }
}

/// Returns the distance between neighbouring positions along a profile.
///
/// # Errors
/// Returns an error if a position is a tenth of a step or more away from its place in an even row.
fn even_step(positions: &[f64]) -> Result<f64, FormatError> {
    const TOLERANCE: f64 = 0.1;
    let (first, last) = (positions[0], positions[positions.len() - 1]);
    let step = (last - first) / (positions.len() - 1).max(1) as f64;
    let place = |index: usize| first + step * index as f64;
    let is_even =
        |(index, position): (usize, &f64)| (position - place(index)).abs() < TOLERANCE * step.abs();
    if positions.iter().enumerate().all(is_even) {
        return Ok(step);
    }
    let steps = || positions.windows(2).map(|pair| pair[1] - pair[0]);
    let mut sorted: Vec<f64> = steps().collect();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    let distance = |step: f64| (step - usual).abs();
    let other = steps().enumerate().max_by(|one, two| distance(one.1).total_cmp(&distance(two.1)));
    let (index, other) = other.expect("there are two positions");
    Err(FormatError::unsupported(format!(
        "the positions in the first column are not evenly spaced: most are {usual:.4e} apart, \
         numbers {} and {} are {other:.4e} apart",
        index + 1,
        index + 2
    )))
}

fn channel<'a>(
    description: Description,
    sides: Option<[f64; 2]>,
    raster: Raster<'a>,
    name: Option<String>,
) -> Result<Channel<'a>, FormatError> {
    let size = Sides::given(sides, &description.lateral)?;
    let named = name.or(description.name).unwrap_or_else(|| "heights".to_owned());
    let raster = raster.scaled(description.factor, 0.0);
    Ok(Channel::new(named, description.height, size, raster))
}

/// Returns the unit of axes that the cell between them names, such as `µm` or `y / x (µm)`.
fn axis_unit(corner: &str) -> Result<Option<String>, FormatError> {
    let title = Title::parse(corner);
    title.check_unit()?;
    let is_length = Unit::parse(&title.name).per_metre().is_some();
    Ok(title.unit.or(Some(title.name).filter(|_| is_length)))
}

/// Lists the names of columns for a message, at most the first `MAX_NAMES`.
fn named(titles: &[Title]) -> String {
    const MAX_NAMES: usize = 6;
    let shown = titles.iter().take(MAX_NAMES).map(|title| format!("`{}`", title.name));
    let names = shown.collect::<Vec<_>>().join(", ");
    if titles.len() > MAX_NAMES { format!("{names}, …") } else { names }
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
