//! Reports of syntax errors in manifests.

use toml::de::Error;

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
    if quantity::split(written).is_some_and(|(_, unit)| Unit::find(unit).is_some()) {
        let label = format!("write \"{}\"", written.trim());
        return Problem::new("invalid TOML: a quantity without quotes", span, label);
    }
    Problem::new(format!("invalid TOML: {}", error.message()), span, "here")
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
    let name = text.get(span.clone()).unwrap_or_default().trim();
    let (what, help) = if text[line..].starts_with('[') {
        ("table", "rename one of the stages, or remove it")
    } else {
        ("key", "remove one of them")
    };
    let message = format!("the {what} `{name}` appears twice");
    Problem::new(message, span, "repeated here").help(help)
}
