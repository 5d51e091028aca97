//! Reports of syntax errors in manifests.

use toml::de::Error;

use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::keys::quantity::{self, Unit};

/// Maximum number of syntax errors that are examined, because each requires a search through the
/// text.
const MAX_ERRORS: usize = 200;

/// Reports syntax errors, except those that are consequences of other errors.
pub fn report_syntax(text: &str, errors: &[Error], problems: &mut Problems) {
    let mut last_line = None;
    let mut repeated_table: Option<usize> = None;
    for error in errors.iter().take(MAX_ERRORS) {
        let mut span = error.span().unwrap_or(text.len()..text.len());
        span.start = span.start.min(text.len());
        let line = line_start(text, span.start);
        // Later errors on a line are mostly consequences of the first one.
        if last_line.replace(line) == Some(line) {
            continue;
        }
        if error.message() != "duplicate key" {
            problems.push(syntax_error(text, error, span));
            continue;
        }
        // If a table is repeated, its repeated keys are not reported.
        let is_within = |table: usize| !text[table..span.start].contains("\n[");
        if repeated_table.is_some_and(is_within) {
            continue;
        }
        if text[line..].starts_with('[') {
            repeated_table = Some(line);
        }
        problems.push(duplicate(text, line, span));
    }
}

fn line_start(text: &str, position: usize) -> usize {
    text[..position].rfind('\n').map_or(0, |end| end + 1)
}

fn syntax_error(text: &str, error: &Error, span: Span) -> Problem {
    if is_decimal_comma(text, span.start) {
        let message = "invalid TOML: a comma within a number";
        return Problem::new(message, span, "write the decimal point as `.`");
    }
    let written = text.get(span.clone()).unwrap_or_default();
    if let Some((message, label)) = slip(written, &text[span.start..]) {
        return Problem::new(format!("invalid TOML: {message}"), span, label);
    }
    Problem::new(format!("invalid TOML: {}", error.message()), span, "here")
}

/// Recognises a frequent slip in an invalid value, from the text of the error and the text from its
/// start to the end of the manifest. Returns the message and the label of the problem.
fn slip(written: &str, from_start: &str) -> Option<(&'static str, String)> {
    let fraction = from_start.strip_prefix('.').unwrap_or_default();
    let end = fraction.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(fraction.len());
    if end > 0 {
        let label = format!("write `0.{}`", &fraction[..end]);
        return Some(("a number without a digit before its decimal point", label));
    }
    let rest = text_after_number(written);
    if rest.len() == written.len() {
        return None;
    }
    if rest == "%" {
        let percent = written.trim_end_matches(['%', ' ']);
        let fraction = decimal::written(decimal::shifted(percent, -2));
        return Some(("a percent sign after a number", format!("write `{fraction}` for a ratio")));
    }
    if rest.starts_with(['%', ';']) || rest.starts_with("//") {
        return Some(("text after a number", "comments begin with `#`".to_owned()));
    }
    if text_after_number(rest) != rest {
        return Some(("numbers without a comma between them", "a comma is missing".to_owned()));
    }
    Unit::find(quantity::split(written)?.1)?;
    Some(("a quantity without quotes", format!("write \"{}\"", written.trim())))
}

/// Returns the text that follows a number at the beginning of a text, without surrounding spaces,
/// or the whole text if it does not begin with a number.
fn text_after_number(text: &str) -> &str {
    let is_part = |letter: char| letter.is_ascii_digit() || "+-._eE".contains(letter);
    let end = text.find(|letter| !is_part(letter)).unwrap_or(text.len());
    match text[..end].parse::<f64>() {
        Ok(_) => text[end..].trim(),
        Err(_) => text,
    }
}

fn is_decimal_comma(text: &str, position: usize) -> bool {
    let is_digit = |at: Option<usize>| {
        at.and_then(|at| text.as_bytes().get(at)).is_some_and(u8::is_ascii_digit)
    };
    text.as_bytes().get(position) == Some(&b',')
        && is_digit(position.checked_sub(1))
        && is_digit(Some(position + 1))
}

/// Describes the problem that the key or table at `span` appears twice. `line` is the start of its
/// line in `text`.
fn duplicate(text: &str, line: usize, span: Span) -> Problem {
    let name = text.get(span.clone()).unwrap_or_default();
    let (what, help) = if text[line..].starts_with('[') {
        ("the table", "rename one of the stages, or remove it")
    } else {
        ("the key", "remove one of them")
    };
    let mut problem = Problem::new(
        format!("{what} `{}` appears twice", name.trim()),
        span.clone(),
        "repeated here",
    )
    .help(help);
    let beginning = text.get(line..span.end).unwrap_or_default();
    let is_end = |rest: &str| rest.starts_with([' ', '\t', '=', ']', '.']);
    let is_same = |&(position, _): &(usize, &str)| {
        position == line_start(text, position) && is_end(&text[position + beginning.len()..])
    };
    let before = text[..line].match_indices(beginning).filter(is_same).last();
    if let Some((position, _)) = before.filter(|_| !name.is_empty()) {
        let end = position + beginning.len();
        problem = problem.and(end - name.len()..end, "first here");
    }
    problem
}
