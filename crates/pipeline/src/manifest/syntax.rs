//! Mistakes that make a manifest no TOML.

use toml::de::Error;

use asperity_manifest::diagnostics::{Problem, Problems, Span};

/// Nobody reads more, and each takes a walk through the text.
const MOST_ERRORS: usize = 200;

/// Reports syntax errors, without those that only follow from others.
pub fn report(text: &str, errors: &[Error], problems: &mut Problems) {
    let mut last_line = None;
    let mut repeated_table: Option<usize> = None;
    for error in errors.iter().take(MOST_ERRORS) {
        let mut span = error.span().unwrap_or(text.len()..text.len());
        span.start = span.start.min(text.len());
        let line = line_start(text, span.start);
        // What follows the first error on a line is mostly its consequence.
        if last_line.replace(line) == Some(line) {
            continue;
        }
        if error.message() != "duplicate key" {
            problems.push(not_toml(text, error, span));
            continue;
        }
        // The keys of a table that is there twice are there twice, too.
        let is_within = |table: usize| !text[table..span.start].contains("\n[");
        if repeated_table.is_some_and(is_within) {
            continue;
        }
        if text[line..].starts_with('[') {
            repeated_table = Some(line);
        }
        problems.push(twice(text, line, span));
    }
}

fn line_start(text: &str, position: usize) -> usize {
    text[..position].rfind('\n').map_or(0, |end| end + 1)
}

fn not_toml(text: &str, error: &Error, span: Span) -> Problem {
    if is_decimal_comma(text, span.start) {
        let message = "not TOML: a comma within a number";
        return Problem::new(message, span, "a decimal point is written `.`");
    }
    let message = error.message();
    let (what, expected) = message.split_once(", expected ").unwrap_or((message, ""));
    let problem = Problem::new(format!("not TOML: {what}"), span, "here");
    match expected {
        "" => problem,
        expected => problem.help(format!("expected {expected}")),
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

/// A key, or the name of a table, that is there already.
fn twice(text: &str, line: usize, span: Span) -> Problem {
    let name = text.get(span.clone()).unwrap_or_default();
    let (what, help) = if text[line..].starts_with('[') {
        ("the table", "each stage has a name of its own: rename one, or remove it")
    } else {
        ("the key", "keep one of them")
    };
    let mut problem = Problem::new(
        format!("{what} `{}` is there twice", name.trim()),
        span.clone(),
        "here again",
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
