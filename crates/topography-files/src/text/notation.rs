//! How numbers are written.

/// What stands between numbers and within them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notation {
    /// Decimal points; spaces, tabs or semicolons between numbers.
    Points,
    /// Decimal commas; spaces, tabs or semicolons between numbers.
    DecimalCommas,
    /// Decimal points; commas between numbers.
    CommasBetween,
}

/// What a line is in a notation.
#[derive(Debug, PartialEq)]
pub enum Line {
    Empty,
    Numbers(Vec<f64>),
    /// Anything else.
    Words,
}

impl Notation {
    /// In the order in which they are tried: `1,5 2,5` are two numbers, `1, 5` are two as well, and
    /// `1,5` alone is one.
    pub const ALL: [Notation; 3] =
        [Notation::Points, Notation::DecimalCommas, Notation::CommasBetween];

    /// Reads a line.
    pub fn line(self, line: &str) -> Line {
        // What editors of MS-DOS end files with.
        let line = line.trim_matches(|letter: char| letter.is_whitespace() || letter == '\u{1a}');
        if line.is_empty() {
            return Line::Empty;
        }
        let separator = match self {
            Notation::CommasBetween => ',',
            Notation::Points | Notation::DecimalCommas => ';',
        };
        let numbers: Option<Vec<f64>> = match line.contains(separator) {
            true => {
                // A separator may end the line, too; within it, nothing between two is missing.
                let line = line.strip_suffix(separator).unwrap_or(line);
                let cells = line.split(separator);
                cells.map(|cell| self.cell(cell.trim())).collect()
            }
            false => line.split_whitespace().map(|word| self.number(word)).collect(),
        };
        numbers.map_or(Line::Words, Line::Numbers)
    }

    fn cell(self, cell: &str) -> Option<f64> {
        match cell.is_empty() {
            true => Some(f64::NAN),
            false => self.number(cell),
        }
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

    #[track_caller]
    fn reads(notation: Notation, line: &str, numbers: &[f64]) {
        assert_eq!(notation.line(line), Line::Numbers(numbers.to_vec()), "{line}");
    }

    #[test]
    fn numbers_stand_apart_by_what_is_usual() {
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
    fn what_was_not_measured_is_no_number() {
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
