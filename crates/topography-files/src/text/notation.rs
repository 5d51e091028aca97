//! Notations of numbers, and the cells of a line.

use super::table;
use crate::number;

/// Notation of the numbers of a file, and their separator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Notation {
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
pub(crate) enum Line {
    Empty,
    Numbers(Row),
    /// A line of words; with its cells if some of them are numbers.
    Words(Option<Row>),
}

/// Cells of a line. A missing point, an empty cell and a word are NaN.
#[derive(Debug, PartialEq, Default)]
pub(crate) struct Row {
    pub(crate) numbers: Vec<f64>,
    pub(crate) separator: Option<char>,
    /// Indices of the empty cells.
    pub(crate) empty: Vec<usize>,
    /// Cells that are neither numbers nor words for missing points.
    pub(crate) words: Vec<Word>,
    /// Number of cells with a decimal comma, and of those that would also be thousands: `1,234`.
    pub(crate) commas: [usize; 2],
}

/// Cell that is not a number.
#[derive(Debug, PartialEq)]
pub(crate) struct Word {
    pub(crate) index: usize,
    pub(crate) text: String,
    /// Position in the line, in characters from 1.
    pub(crate) column: usize,
}

impl Word {
    pub(crate) fn problem(&self) -> String {
        let start: String = self.text.chars().take(40).collect();
        format!(
            "`{start}` at column {} is neither a number nor a known word for a missing point",
            self.column
        )
    }
}

impl Row {
    /// Returns true if a comment follows `columns` numbers.
    pub(crate) fn has_comment(&self, columns: usize) -> bool {
        self.words.first().is_some_and(|word| {
            let starts = ["#", "%", "//"].iter().any(|mark| word.text.starts_with(mark));
            word.index == columns && starts
        })
    }

    /// Removes the comment after `columns` numbers.
    pub(crate) fn without_comment(mut self, columns: usize) -> Row {
        self.numbers.truncate(columns);
        self.words.clear();
        self
    }

    pub(crate) fn ends_empty(&self) -> bool {
        self.empty.last().is_some_and(|last| last + 1 == self.numbers.len())
    }
}

impl Notation {
    /// All notations, in the order in which they are tried.
    ///
    /// `1,5 2,5` is two numbers with decimal commas, `1, 5` is two integers, and `1,5` alone is one
    /// number.
    pub(crate) const ALL: [Notation; 5] = [
        Notation::Points,
        Notation::DecimalCommas,
        Notation::CommasBetween,
        Notation::GroupedByCommas,
        Notation::GroupedByPoints,
    ];

    pub(crate) fn line(self, line: &str) -> Line {
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
                if self.has_decimal_comma(cell) {
                    row.commas[0] += 1;
                    row.commas[1] += usize::from(is_of_thousands(cell));
                }
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

    fn has_decimal_comma(self, cell: &str) -> bool {
        matches!(self, Notation::DecimalCommas | Notation::CommasBetween) && cell.contains(',')
    }

    fn separator(self, line: &str) -> Option<char> {
        let is_between_tabs = || {
            let is_number = |word: &str| number::parse(word).is_some();
            // The corner of a table may be a text such as `y / x (µm)`.
            let has_no_space = |cell: &str| {
                let cell = cell.trim();
                !cell.contains(char::is_whitespace) || !cell.split_whitespace().any(is_number)
            };
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

/// Returns true if a number with a comma may also be one of thousands, as `1,234` but not `0,123`.
fn is_of_thousands(cell: &str) -> bool {
    let digits = cell.trim_matches('"').trim_start_matches(['+', '-']);
    !digits.starts_with('0') && ungrouped(digits, ',').is_some()
}

/// Removes the separators between groups of three digits. Returns `None` if the groups before the
/// decimal sign have other lengths.
///
/// Spaces of fixed width and apostrophes, as in France and Switzerland, separate groups, too.
fn ungrouped(word: &str, between: char) -> Option<String> {
    let between_too = ['\u{a0}', '\u{202f}', '\'', '’'];
    let is_other = word.contains(between_too);
    if is_other && word.contains(between) {
        return None;
    }
    let word = word.replace(between_too, between.encode_utf8(&mut [0; 4]));
    let decimal = if between == ',' { '.' } else { ',' };
    let (whole, fraction) = word.split_at(word.find(decimal).unwrap_or(word.len()));
    let mut groups = whole.trim_start_matches(['+', '-']).split(between);
    let first = groups.next().unwrap_or_default();
    let others: Vec<&str> = groups.collect();
    let is_grouped = (1..=3).contains(&first.len()) && others.iter().all(|group| group.len() == 3);
    (others.is_empty() || is_grouped).then(|| whole.replace(between, "") + fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let grouped = "1\u{a0}423,6;711,8";
        assert_eq!(numbers(Notation::GroupedByCommas, grouped), None);
        reads(Notation::GroupedByPoints, grouped, &[1423.6, 711.8]);
        reads(Notation::GroupedByCommas, "1'423.6;711.8", &[1423.6, 711.8]);
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
    }

    #[test]
    fn words_are_no_numbers() {
        for line in ["# 1 2", "h=650 w=650", "1 2 m", "e", "1 e"] {
            assert_eq!(numbers(Notation::Points, line), None, "{line}");
        }
        assert_eq!(Notation::Points.line(" \t"), Line::Empty);
        assert_eq!(Notation::Points.line("\u{1a}"), Line::Empty);
    }
}
