//! Numbers in text files, and words for missing points.

use std::borrow::Cow;

use super::FormatError;

/// Words that mark missing points, in lower case.
const MISSING: [&str; 34] = [
    "nan",
    "na",
    "n/a",
    "n.a.",
    "<na>",
    "none",
    "null",
    "nil",
    "nodata",
    "no_data",
    "void",
    "bad",
    "invalid",
    "undef",
    "undefined",
    "inf",
    "infinite",
    "infinity",
    "missing",
    "masked",
    "---",
    "--",
    "-",
    "?",
    "#n/a",
    "#n/v",
    "#nv",
    "#num!",
    "#value!",
    "#div/0!",
    "#ref!",
    "#name?",
    "#null!",
    "#zahl!",
];

/// Returns true if a word marks a missing point.
///
/// - `nan`, `NaN(ind)`, `-nan(ind)`: C libraries; `1.#QNAN`, `1.#IND`, `1.#INF`: Microsoft.
/// - `NA`, `N/A`, `<NA>`, `NULL`: R, pandas and databases; `--`: masked arrays of NumPy.
/// - `#N/A`, `#NUM!`, `#DIV/0!` and, in German, `#NV` and `#ZAHL!`: spreadsheets.
/// - `BAD`, `void`, `NoData`, `---`, `***`: profilometers and geographic programs. `***` is also
///   what Fortran writes for a number that is too long.
pub(crate) fn is_missing(word: &str) -> bool {
    let word = word.trim_matches('"').to_ascii_lowercase();
    let unsigned = word.strip_prefix(['-', '+']).unwrap_or(&word);
    let is_starred = !word.is_empty() && word.bytes().all(|byte| byte == b'*');
    is_starred
        || MISSING.contains(&word.as_str())
        || (unsigned.len() > 1 && MISSING.contains(&unsigned))
        || (unsigned.starts_with("nan(") && unsigned.ends_with(')'))
        || unsigned.starts_with("1.#")
}

/// Reads lines of `columns` numbers each, which `number` parses. Lines without words are skipped.
/// The lines have their numbers, for errors.
pub(crate) fn lines<'t, W: Iterator<Item = &'t str>>(
    lines: impl Iterator<Item = (usize, W)>,
    columns: usize,
    number: impl Fn(&str) -> Option<f64>,
) -> Result<Vec<f64>, FormatError> {
    let mut numbers = Vec::new();
    for (line, words) in lines {
        let wrong = |problem: String| FormatError::Line { line, problem };
        let before = numbers.len();
        for word in words {
            let read = number(word).ok_or_else(|| wrong(format!("`{word}` is not a number")))?;
            numbers.push(read);
        }
        let found = numbers.len() - before;
        if found != columns && found > 0 {
            return Err(wrong(format!("it has {found} numbers in place of {columns}")));
        }
    }
    Ok(numbers)
}

/// Parses a height, or a word for a missing point as NaN.
pub(crate) fn height(word: &str) -> Result<f64, FormatError> {
    let allowed = "a number, or a word for a missing point";
    parse_or_missing(word).ok_or_else(|| FormatError::value("height", word, allowed))
}

/// Parses a number, or a word for a missing point as NaN.
pub(crate) fn parse_or_missing(word: &str) -> Option<f64> {
    parse(word).or_else(|| is_missing(word).then_some(f64::NAN))
}

/// Parses a number with a decimal point, whose exponent may be written with `D`, as in Fortran.
///
/// The minus sign of Unicode, which typesetting programs write, is a sign, too. Returns `None` for
/// other words, including `inf` and `nan`.
pub(crate) fn parse(word: &str) -> Option<f64> {
    if word.contains('\u{2212}') {
        return parse(&word.replace('\u{2212}', "-"));
    }
    let is_of_number =
        |byte: u8| matches!(byte, b'0'..=b'9' | b'.' | b'+' | b'-' | b'e' | b'E' | b'd' | b'D');
    if !word.bytes().all(is_of_number) {
        return None;
    }
    let word: Cow<str> =
        if word.contains(['d', 'D']) { word.replace(['d', 'D'], "e").into() } else { word.into() };
    word.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_many_programs_mark_missing_points() {
        for word in [
            "nan",
            "-nan",
            "NaN(ind)",
            "-nan(ind)",
            "nan(snan)",
            "1.#QNAN",
            "-1.#IND",
            "1.#INF",
            "+inf",
            "-Infinity",
            "NA",
            "N/A",
            "#N/A",
            "None",
            "null",
            "NoData",
            "void",
            "--",
            "---",
            "***",
            "BAD",
            "<NA>",
            "#NV",
            "#DIV/0!",
        ] {
            assert!(is_missing(word) && parse(word).is_none(), "{word}");
        }
        for word in ["1", "-1", "e", "x", "name", "", "+"] {
            assert!(!is_missing(word), "{word}");
        }
    }

    #[test]
    fn fortran_writes_exponents_with_d() {
        assert_eq!(parse("1.0D+02"), Some(100.0));
        assert_eq!(parse("-2.5d-1"), Some(-0.25));
        assert_eq!((parse("1e3"), parse("−1e−3")), (Some(1000.0), Some(-1e-3)));
        assert_eq!((parse("d"), parse("1,5"), parse("")), (None, None, None));
    }
}
