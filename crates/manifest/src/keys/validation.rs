//! Validates a TOML value against the schema of its key: types, words, keys of tables, lengths of
//! lists and [bounds](super::bounds) of numbers. All mistakes in a value are reported.

use serde_json::{Map, Value};
use serde_spanned::Spanned as TomlSpanned;
use toml::de::DeValue;

use super::bounds::out_of_bounds;
use super::derived::Expressions;
use super::expected_keys::{its_keys, unknown_key};
use super::quantity::Declared;
use super::schema::{alternatives, is_number, is_of_type, is_type, words};
use super::values::{found, shown};
use super::{Layout, quantity, schema};
use crate::diagnostics::{Problem, listed, suggestion};

type Written<'i> = TomlSpanned<DeValue<'i>>;

/// Validates the value of a key of a table, and returns the mistakes in it. With `expressions`, the
/// value may contain expressions, whose results are not validated.
pub fn validate(
    layout: &Layout,
    name: &str,
    value: &Written<'_>,
    expressions: Option<Expressions<'_>>,
) -> Vec<Problem> {
    let is_sweep = value.get_ref().is_array() && !layout.swept.contains(&name);
    let help_for_lists =
        (is_sweep && !layout.swept.is_empty() && !layout.takes_pairs(name)).then(|| {
            format!("only lists of {} are swept", listed(layout.swept.iter().copied(), "and"))
        });
    let mut problems = Vec::new();
    let root = ValuePath { expressions, help_for_lists, ..ValuePath::new(name) };
    root.check(value, &layout.properties()[name], None, &mut problems);
    problems
}

/// Validates a value against a schema, and returns the mistakes in it. Messages call the value
/// `name`.
pub fn validate_against(schema: &Value, name: &str, value: &Written<'_>) -> Vec<Problem> {
    let mut problems = Vec::new();
    ValuePath::new(name).check(value, schema, None, &mut problems);
    problems
}

/// The position of a value in its table, and help for its messages.
struct ValuePath<'a> {
    /// Key in the table, with the keys of inner tables: `loads.from`.
    path: &'a str,
    /// True if the value is an item of the list of this key.
    is_item: bool,
    /// Help if the value is a list and must not be one.
    help_for_lists: Option<String>,
    /// The expressions that the table may contain.
    expressions: Option<Expressions<'a>>,
    /// The quantity of the numbers of the list that contains the value.
    quantity: Option<Declared>,
}

impl<'a> ValuePath<'a> {
    fn new(path: &'a str) -> Self {
        Self { path, is_item: false, help_for_lists: None, expressions: None, quantity: None }
    }

    fn check(
        &self,
        written: &Written<'_>,
        schema: &Value,
        outer_help: Option<&str>,
        problems: &mut Vec<Problem>,
    ) {
        let Self { path, .. } = self;
        let about = schema.get("description").and_then(Value::as_str).filter(|_| !self.is_item);
        let own_help = about.map(|about| format!("`{path}`: {about}"));
        let help = own_help.as_deref().or(outer_help);
        let value = written.get_ref();
        let alternatives = alternatives(schema);
        let mut fitting = alternatives.iter().copied().filter(|one| is_of_type(value, one));
        let words = words(&alternatives);
        let quantity = Declared::from_schema(schema).or(self.quantity);
        let expressions = self.expressions.iter();
        let checked = expressions.filter_map(|own| own.check(path, written, &alternatives)).next();
        if let Some(found) = checked {
            problems.extend(found);
            return;
        }
        let problem = |message: String, label: String| {
            Problem::new(message, written.span(), label).help_if(help)
        };
        match (value, fitting.next()) {
            (DeValue::String(text), Some(_)) if !words.is_empty() => {
                if !words.contains(&text.as_ref()) {
                    let help = number_in_quotes(value, &alternatives, quantity, help);
                    problems.push(match help {
                        Some(help) => {
                            let message = format!("`{path}` must be {}", expected(&alternatives));
                            Problem::new(message, written.span(), found(value)).help(help)
                        }
                        None => unknown_word(path, written, &words),
                    });
                }
            }
            (DeValue::Integer(_) | DeValue::Float(_), Some(schema)) => {
                let verb = if self.is_item { "holds" } else { "is" };
                if let Some(must) = out_of_bounds(value, schema) {
                    let shown = shown(value);
                    let label = if words.contains(&shown.as_str()) {
                        format!("write \"{shown}\" in quotes for the word; a number {must}")
                    } else {
                        must
                    };
                    problems.push(problem(format!("`{path}` {verb} {shown}"), label));
                }
            }
            (DeValue::Array(items), Some(schema)) => {
                if let Some(must) = wrong_length(items.len(), schema) {
                    let has = match items.len() {
                        0 => "is empty".to_owned(),
                        1 => "has 1 entry".to_owned(),
                        several => format!("has {several} entries"),
                    };
                    problems.push(problem(format!("`{path}` {has}"), must));
                }
                let item = ValuePath { is_item: true, help_for_lists: None, quantity, ..*self };
                let rules = schema.get("items").unwrap_or(&Value::Null);
                items.iter().for_each(|value| item.check(value, rules, help, problems));
            }
            (DeValue::Table(_), Some(schema)) => self.check_table(written, schema, help, problems),
            (_, Some(_)) => {}
            (_, None) => {
                let message = format!("`{path}` must be {}", expected(&alternatives));
                let help = number_in_quotes(value, &alternatives, quantity, help)
                    .or_else(|| self.help_for_lists.clone().filter(|_| value.is_array()));
                problems.push(problem(message, found(value)).help_if(help));
            }
        }
    }

    fn check_table(
        &self,
        written: &Written<'_>,
        schema: &Value,
        help: Option<&str>,
        problems: &mut Vec<Problem>,
    ) {
        let Self { path, .. } = self;
        let no_keys = Map::new();
        let keys = schema.get("properties").and_then(Value::as_object).unwrap_or(&no_keys);
        let more = schema.get("additionalProperties").filter(|more| more.is_object());
        let table = written.get_ref().as_table();
        let mut meant = Vec::new();
        for (key, value) in table.into_iter().flatten() {
            let name = key.get_ref().as_ref();
            if let Some(rules) = keys.get(name).or(more) {
                let path = format!("{path}.{name}");
                let inner = ValuePath { expressions: self.expressions, ..ValuePath::new(&path) };
                inner.check(value, rules, help, problems);
                continue;
            }
            let message = format!("`{path}` has no key `{name}`");
            let known = key_names(schema);
            let has_synonyms = self.expressions.is_some();
            let (problem, own) = unknown_key(&message, name, key.span(), has_synonyms, &known);
            meant.extend(own);
            let has_advice = problem.advice().is_some();
            problems.push(if has_advice { problem } else { problem.help(its_keys(&known)) });
        }
        let required = schema.get("required").and_then(Value::as_array).into_iter().flatten();
        for name in required.filter_map(Value::as_str) {
            let is_there = table.is_some_and(|table| table.contains_key(name));
            if !is_there && !meant.contains(&name) {
                let message = format!("`{path}` lacks `{name}`");
                let label = format!("`{name}` is missing here");
                problems.push(Problem::new(message, written.span(), label).help_if(help));
            }
        }
    }
}

/// Returns the problem of a value that is none of the words allowed for its key.
pub fn unknown_word(key: &str, value: &Written<'_>, words: &[&str]) -> Problem {
    let help = format!("one of {}", listed(words.iter().copied(), "and"));
    let (message, label) = match value.get_ref().as_str() {
        Some(written) => (
            format!("`{key}` cannot be {written:?}"),
            suggestion('"', written, words.iter().copied(), "unknown word"),
        ),
        None => (format!("`{key}` must be a word in quotes"), found(value.get_ref())),
    };
    Problem::new(message, value.span(), label).help(help)
}

/// Describes the valid values of a key: `a number, "free" or a list of numbers`.
fn expected(alternatives: &[&Value]) -> String {
    let words = words(alternatives);
    let are_words = !words.is_empty() && alternatives.iter().all(|one| is_type(one, "string"));
    if are_words {
        return "a word in quotes".to_owned();
    }
    let mut parts = Vec::new();
    for one in alternatives {
        let is = |kind| is_type(one, kind);
        parts.extend(is("number").then(|| "a number".to_owned()));
        parts.extend(is("integer").then(|| "a whole number".to_owned()));
        parts.extend(is("boolean").then(|| "`true` or `false`".to_owned()));
        parts.extend((is("string") && words.is_empty()).then(|| "a text in quotes".to_owned()));
        if is("string") {
            let own = schema::words(&[one]);
            parts.extend(own.into_iter().map(|word| format!("`\"{word}\"`")));
        }
        if is("array") {
            let limits = ["minItems", "maxItems"].map(|rule| one.get(rule).and_then(Value::as_u64));
            let items = one.get("items").map(described_items).unwrap_or_default();
            parts.push(match limits {
                [Some(2), Some(2)] => format!("a pair of {items}"),
                [Some(1), Some(2)] => format!("a list of one or two {items}"),
                _ => format!("a list of {items}"),
            });
        }
        if is("object") {
            let keys = key_names(one);
            parts.push(if keys.is_empty() {
                "a table".to_owned()
            } else {
                format!("a table `{{ {} }}`", keys.join(", "))
            });
        }
    }
    match parts.as_slice() {
        [most @ .., last] if !most.is_empty() => format!("{} or {last}", most.join(", ")),
        _ => parts.concat(),
    }
}

/// Returns the keys of a table: first the required keys in the order of their declaration, then the
/// others.
fn key_names(schema: &Value) -> Vec<&str> {
    let required = schema.get("required").and_then(Value::as_array).into_iter().flatten();
    let mut names: Vec<&str> = required.filter_map(Value::as_str).collect();
    let all = schema.get("properties").and_then(Value::as_object).into_iter().flatten();
    let optional: Vec<&str> = all.map(|(name, _)| name.as_str()).collect();
    names.extend(optional.into_iter().filter(|name| !names.contains(name)).collect::<Vec<_>>());
    names
}

/// Describes the items of a list, as a continuation of `a list of`.
fn described_items(items: &Value) -> &'static str {
    match alternatives(items).as_slice() {
        [one] if is_type(one, "number") => "numbers",
        [one] if is_type(one, "integer") => "whole numbers",
        [one] if is_type(one, "object") => "tables",
        [one] if is_type(one, "string") => "texts in quotes",
        _ => "values",
    }
}

/// Returns the requirement on the length of a list if the list violates it.
fn wrong_length(length: usize, schema: &Value) -> Option<String> {
    let limit = |rule: &str| schema.get(rule).and_then(Value::as_u64);
    let (least, most) = (limit("minItems").unwrap_or(0), limit("maxItems"));
    let length = length as u64;
    if length >= least && most.is_none_or(|most| length <= most) {
        return None;
    }
    Some(match most {
        _ if length == 0 && least == 1 => "must have at least one entry".to_owned(),
        Some(most) if most == least => format!("must have {most} entries"),
        Some(most) => format!("must have from {least} to {most} entries"),
        None => format!("must have at least {least} entries"),
    })
}

/// Returns help for a number that is written as a text, alone or with a unit. `about` describes the
/// key.
fn number_in_quotes(
    value: &DeValue<'_>,
    alternatives: &[&Value],
    quantity: Option<Declared>,
    about: Option<&str>,
) -> Option<String> {
    alternatives.iter().find(|one| is_number(one))?;
    let text = value.as_str()?.trim();
    if text.parse::<f64>().is_ok() {
        return Some("write numbers without quotes".to_owned());
    }
    let is_pure = quantity.is_none_or(|declared| declared.or_ratio);
    quantity::split(text).filter(|_| is_pure)?;
    // The number without its unit may mean something else, so the advice is the meaning of the key.
    let about = about.map_or_else(String::new, |about| format!("; {about}"));
    Some(format!("write a number without a unit{about}"))
}

#[cfg(test)]
mod tests;
