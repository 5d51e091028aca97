//! Words for values that cannot be read, and what to write instead.

use serde::de::DeserializeOwned;
use serde_spanned::Spanned;
use toml::de::{DeValue, Error, ValueDeserializer};

use super::Layout;
use super::on_axes::NUMBER_OR_PAIR;
use crate::diagnostics::{Problem, Span, did_you_mean, listed, suggestion};

/// Reads a value of the parsed document; the places in it stay those of the text.
pub fn deserialize<T: DeserializeOwned>(value: Spanned<DeValue<'_>>) -> Result<T, Error> {
    T::deserialize(ValueDeserializer::from(value))
}

/// Keys that have been given another name, that name, and what it is for.
const RENAMED: [(&str, &str, &str); 1] = [(
    "youngs_modulus",
    "effective_modulus",
    "it holds E*, the effective modulus of the two bodies together; their own moduli go into \
     `bodies = [{ youngs_modulus, poisson_ratio }]`",
)];

/// Finds another table that has a key, as messages call it.
pub type Owner = dyn Fn(&str) -> Option<String>;

/// What a table is, for messages about its keys.
pub struct Wanted {
    /// How messages call the table.
    pub place: String,
    /// Keys that are read before the others.
    pub common: Vec<&'static str>,
    /// Another table that has a key, as messages call it.
    pub owner: Box<Owner>,
}

impl Wanted {
    /// A key that does not belong here, and the key that was meant, if that is clear.
    pub fn unknown_key(
        &self,
        layout: &'static Layout,
        key: &str,
        span: Span,
    ) -> (Problem, Option<String>) {
        let known = || layout.keys().chain(self.common.iter().copied());
        let message = format!("{} has no key `{key}`", self.place);
        if let Some((_, now, help)) = RENAMED.iter().find(|(was, ..)| *was == key)
            && layout.has(now)
        {
            let label = format!("renamed: `{now} = …`");
            let problem = Problem::new(message, span, label).help(*help);
            return (problem, Some((*now).to_owned()));
        }
        if let Some(owner) = (self.owner)(key) {
            let label = format!("belongs to {owner}");
            return (Problem::new(message, span, label), None);
        }
        match did_you_mean(key, known()) {
            Some(meant) => {
                let label = format!("did you mean `{meant}`?");
                (Problem::new(message, span, label), Some(meant.to_owned()))
            }
            None => {
                let problem = Problem::new(message, span, "unknown key")
                    .help(format!("its keys are {}", listed(known(), "and")));
                (problem, None)
            }
        }
    }
}

/// A value that is none of the words that would do.
pub fn no_such_word(key: &str, value: &Spanned<DeValue<'_>>, words: &[&str]) -> Problem {
    let words = words.iter().copied();
    let help = format!("one of {}", listed(words.clone(), "and"));
    let (message, label) = match value.get_ref().as_str() {
        Some(written) => (
            format!("`{key}` cannot be {written:?}"),
            suggestion('"', written, words, "unknown word"),
        ),
        None => (format!("`{key}` must be a word"), found(value.get_ref())),
    };
    Problem::new(message, value.span(), label).help(help)
}

/// What a value is, for the label of a caret.
pub fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(_) => "this is a text",
        DeValue::Integer(_) | DeValue::Float(_) => "this is a number",
        DeValue::Boolean(_) => "this is `true` or `false`",
        DeValue::Datetime(_) => "this is a date",
        DeValue::Array(_) => "this is a list",
        DeValue::Table(_) => "this is a table",
    }
    .to_owned()
}

/// A value that serde could not read, in words for people who never heard of serde.
pub fn unusable(
    key: &str,
    value: &Spanned<DeValue<'_>>,
    error: &Error,
    help: Option<String>,
) -> Problem {
    let span = error.span().unwrap_or(value.span());
    let key = &path(error).unwrap_or_else(|| key.to_owned());
    let reason = error.message();
    let (reason, expected) = reason.rsplit_once(", expected ").unwrap_or((reason, ""));
    let about = |prefix: &str| reason.strip_prefix(prefix);
    let quoted = |text: &str| text.trim_matches('`').to_owned();
    if let Some(found) = about("invalid type: ").or_else(|| about("invalid value: ")) {
        let message = format!("`{key}` must be {}", expected_in_words(expected));
        let help = number_in_quotes(found, expected).or(help);
        return with_help(Problem::new(message, span, found_in_words(found)), help);
    }
    let candidates = || expected.split('`').skip(1).step_by(2);
    if let Some(word) = about("unknown variant ") {
        let message = format!("`{key}` cannot be {:?}", quoted(word));
        let label = suggestion('"', &quoted(word), candidates(), "unknown word");
        return Problem::new(message, span, label)
            .help(format!("one of {}", listed(candidates(), "and")));
    }
    if let Some(word) = about("unknown field ") {
        let message = format!("`{key}` has no key {word}");
        let label = suggestion('`', &quoted(word), candidates(), "unknown key");
        return Problem::new(message, span, label)
            .help(format!("its keys are {}", listed(candidates(), "and")));
    }
    if let Some(field) = about("missing field ") {
        let message = format!("`{key}` lacks {field}");
        return with_help(Problem::new(message, span, format!("{field} is missing here")), help);
    }
    if reason.starts_with("wanted ") {
        let message = format!("`{key}` must be a word in quotes");
        return with_help(Problem::new(message, span, found(value.get_ref())), help);
    }
    with_help(Problem::new(format!("`{key}` cannot be read"), span, reason), help)
}

/// The key that serde was at, `loads.spacing`; the error says so only when it is printed.
fn path(error: &Error) -> Option<String> {
    let printed = error.to_string();
    let path = printed.lines().last()?.strip_prefix("in `")?.strip_suffix('`')?;
    Some(path.to_owned())
}

fn with_help(problem: Problem, help: Option<String>) -> Problem {
    match help {
        Some(help) => problem.help(help),
        None => problem,
    }
}

/// Serde's name for what a type takes.
fn expected_in_words(expected: &str) -> &str {
    match expected {
        "f64" => "a number",
        "i64" => "a whole number",
        "a boolean" => "`true` or `false`",
        "a string" => "a text in quotes",
        "a sequence" => "a list",
        _ if expected.starts_with("struct ") => "a table",
        other => other,
    }
}

/// Serde's name for what it met instead.
fn found_in_words(found: &str) -> String {
    const LONGEST: usize = 40;
    let (what, value) = found.split_once(' ').unwrap_or((found, ""));
    match what {
        "string" if value.chars().count() <= LONGEST => format!("this is the text {value}"),
        "string" => "this is a text".to_owned(),
        "integer" => format!("this is the number {value}"),
        "floating" => format!("this is the number {}", value.trim_start_matches("point ")),
        "boolean" => format!("this is {value}"),
        "sequence" => "this is a list".to_owned(),
        "map" => "this is a table".to_owned(),
        _ => format!("this is {found}"),
    }
}

/// What to do where a number was asked for and one is there as a text, perhaps with a unit.
fn number_in_quotes(found: &str, expected: &str) -> Option<String> {
    let text = found.strip_prefix("string ")?.trim_matches('"').trim();
    if !matches!(expected, "f64" | "i64" | NUMBER_OR_PAIR) {
        return None;
    }
    let number = text.trim_end_matches(|letter: char| !letter.is_ascii_digit());
    let unit = text[number.len()..].trim();
    number.parse::<f64>().ok()?;
    Some(match unit {
        "" => "a number is written without quotes".to_owned(),
        unit => format!(
            "a number is written without quotes and without `{unit}`: all lengths of a study have \
             one unit, all pressures another, and both are yours to choose"
        ),
    })
}
