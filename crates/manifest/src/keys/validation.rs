//! Validates a TOML value against the schema of its key: types, words, keys of tables, lengths of
//! lists and [bounds](super::bounds) of numbers. All mistakes in a value are reported.

use serde_json::{Map, Value};
use serde_spanned::Spanned as TomlSpanned;
use toml::de::DeValue;

use super::bounds::out_of_bounds;
use super::derived::Expressions;
use super::{Layout, quantity, tried};
use crate::diagnostics::{Problem, did_you_mean, listed, suggestion};

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
    let root = ValuePath { path: name, is_item: false, help_for_lists, expressions };
    root.check(value, &layout.properties()[name], None, &mut problems);
    problems
}

/// Validates a value against a schema, and returns the mistakes in it. Messages call the value
/// `name`.
pub fn validate_against(schema: &Value, name: &str, value: &Written<'_>) -> Vec<Problem> {
    let mut problems = Vec::new();
    let root = ValuePath { path: name, is_item: false, help_for_lists: None, expressions: None };
    root.check(value, schema, None, &mut problems);
    problems
}

/// Returns the alternatives of a schema; a value must satisfy one of them.
pub fn alternatives(schema: &Value) -> Vec<&Value> {
    match schema.get("oneOf").or(schema.get("anyOf")).and_then(Value::as_array) {
        Some(several) => several.iter().flat_map(alternatives).collect(),
        None => vec![schema],
    }
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
}

impl ValuePath<'_> {
    fn check(
        &self,
        written: &Written<'_>,
        schema: &Value,
        outer_help: Option<&str>,
        problems: &mut Vec<Problem>,
    ) {
        let Self { path, .. } = self;
        let about = schema.get("description").and_then(Value::as_str).filter(|_| !self.is_item);
        let help = about.map(|about| format!("`{path}`: {about}"));
        let help = help.as_deref().or(outer_help);
        let value = written.get_ref();
        let alternatives = alternatives(schema);
        let mut fitting = alternatives.iter().copied().filter(|one| is_of_type(value, one));
        let words = words(&alternatives);
        let expressions = self.expressions.iter();
        let checked = expressions.filter_map(|own| own.check(path, written, &alternatives)).next();
        if let Some(found) = checked {
            problems.extend(found);
            return;
        }
        let problem = |message: String, label: String| {
            let problem = Problem::new(message, written.span(), label);
            match help {
                Some(help) => problem.help(help),
                None => problem,
            }
        };
        match (value, fitting.next()) {
            (DeValue::String(text), Some(_)) if !words.is_empty() => {
                if !words.contains(&text.as_ref()) {
                    problems.push(unknown_word(path, written, &words));
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
                let item = ValuePath { is_item: true, help_for_lists: None, ..*self };
                let rules = schema.get("items").unwrap_or(&Value::Null);
                items.iter().for_each(|value| item.check(value, rules, help, problems));
            }
            (DeValue::Table(_), Some(schema)) => self.check_table(written, schema, help, problems),
            (_, Some(_)) => {}
            (_, None) => {
                let message = format!("`{path}` must be {}", expected(&alternatives));
                let is_number = |one: &&Value| is_type(one, "number") || is_type(one, "integer");
                let help = number_in_quotes(value)
                    .filter(|_| alternatives.iter().any(is_number))
                    .or_else(|| self.help_for_lists.clone().filter(|_| value.is_array()));
                let problem = problem(message, found(value));
                problems.push(match help {
                    Some(help) => problem.help(help),
                    None => problem,
                });
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
                let inner =
                    ValuePath { path: &path, is_item: false, help_for_lists: None, ..*self };
                inner.check(value, rules, help, problems);
                continue;
            }
            let message = format!("`{path}` has no key `{name}`");
            let has = |one: &str| keys.contains_key(one);
            if self.expressions.is_some()
                && let Some((problem, instead)) = tried::answer(&message, name, key.span(), has)
            {
                meant.extend(instead);
                problems.push(problem);
                continue;
            }
            let known = key_names(schema);
            meant.extend(did_you_mean(name, known.iter().copied()));
            let label = suggestion('`', name, known.iter().copied(), "unknown key");
            let problem = Problem::new(message, key.span(), label);
            problems.push(problem.help(format!("its keys are {}", listed(known, "and"))));
        }
        let required = schema.get("required").and_then(Value::as_array).into_iter().flatten();
        for name in required.filter_map(Value::as_str) {
            let is_there = table.is_some_and(|table| table.contains_key(name));
            if !is_there && !meant.contains(&name) {
                let message = format!("`{path}` lacks `{name}`");
                let label = format!("`{name}` is missing here");
                let problem = Problem::new(message, written.span(), label);
                problems.push(match help {
                    Some(help) => problem.help(help),
                    None => problem,
                });
            }
        }
    }
}

/// Returns the problem of a value that is none of the words allowed for its key.
pub fn unknown_word(key: &str, value: &Written<'_>, words: &[&str]) -> Problem {
    let words = words.iter().copied();
    let help = format!("one of {}", listed(words.clone(), "and"));
    let (message, label) = match value.get_ref().as_str() {
        Some(written) => (
            format!("`{key}` cannot be {written:?}"),
            suggestion('"', written, words, "unknown word"),
        ),
        None => (format!("`{key}` must be a word in quotes"), found(value.get_ref())),
    };
    Problem::new(message, value.span(), label).help(help)
}

/// Describes a value for a label: `this is the number 4.5`.
pub fn found(value: &DeValue<'_>) -> String {
    const MAX_LENGTH: usize = 40;
    match value {
        DeValue::String(text) if text.chars().count() <= MAX_LENGTH => {
            format!("this is the text {text:?}")
        }
        DeValue::String(_) => "this is a text".to_owned(),
        DeValue::Integer(_) | DeValue::Float(_) => format!("this is the number {}", shown(value)),
        DeValue::Boolean(truth) => format!("this is `{truth}`"),
        DeValue::Datetime(_) => "this is a date".to_owned(),
        DeValue::Array(_) => "this is a list".to_owned(),
        DeValue::Table(_) => "this is a table".to_owned(),
    }
}

/// Formats a number as in the manifest.
pub(super) fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        _ => String::new(),
    }
}

pub(super) fn is_of_type(value: &DeValue<'_>, schema: &Value) -> bool {
    let is = |kind| is_type(schema, kind);
    match value {
        DeValue::String(_) => is("string"),
        DeValue::Integer(_) => is("integer") || is("number"),
        DeValue::Float(_) => is("number"),
        DeValue::Boolean(_) => is("boolean"),
        DeValue::Array(_) => is("array"),
        DeValue::Table(_) => is("object"),
        DeValue::Datetime(_) => false,
    }
}

pub(super) fn is_type(schema: &Value, kind: &str) -> bool {
    match schema.get("type") {
        Some(Value::Array(kinds)) => kinds.iter().any(|one| one == kind),
        one => one.is_some_and(|one| one == kind),
    }
}

/// Returns the words of which a text must be one. The list is empty if any text is valid.
pub(super) fn words<'a>(alternatives: &[&'a Value]) -> Vec<&'a str> {
    let texts = alternatives.iter().filter(|one| is_type(one, "string"));
    let words = texts.map(|text| match (text.get("const"), text.get("enum")) {
        (Some(Value::String(word)), _) => Some(vec![word.as_str()]),
        (_, Some(Value::Array(words))) => Some(words.iter().filter_map(Value::as_str).collect()),
        _ => None,
    });
    words.collect::<Option<Vec<_>>>().unwrap_or_default().concat()
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
            let own = self::words(&[one]);
            parts.extend(own.into_iter().map(|word| format!("`\"{word}\"`")));
        }
        if is("array") {
            let is_pair = one.get("maxItems") == Some(&2.into());
            let items = one.get("items").map(described_items).unwrap_or_default();
            let list = if is_pair { "a pair" } else { "a list" };
            parts.push(format!("{list}{items}"));
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

/// Describes the items of a list, as a continuation of `a list`.
fn described_items(items: &Value) -> &'static str {
    match alternatives(items).as_slice() {
        [one] if is_type(one, "number") => " of numbers",
        [one] if is_type(one, "integer") => " of whole numbers",
        [one] if is_type(one, "object") => " of tables",
        [one] if is_type(one, "string") => " of texts in quotes",
        _ => "",
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

/// Returns help for a number that is written as a text, with or without a unit.
fn number_in_quotes(value: &DeValue<'_>) -> Option<String> {
    let text = value.as_str()?.trim();
    if let Some((number, unit)) = quantity::split(text) {
        return Some(format!(
            "this key has no unit: write `{number}`, without quotes and without `{unit}`"
        ));
    }
    text.parse::<f64>().ok()?;
    Some("write numbers without quotes".to_owned())
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde::Deserialize;
    use toml::de::DeTable;

    use super::*;
    use crate::keys::declare::{list, pair, swept};
    use crate::keys::{Key, KeyTable, OnAxes, Spanned, table};

    #[derive(Default, Deserialize, JsonSchema)]
    #[serde(default, deny_unknown_fields)]
    struct Example {
        #[schemars(range(min = 1, max = 9), transform = pair, transform = swept)]
        width: Key<OnAxes<u32>>,
        /// Length.
        #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = swept)]
        length: Key<f64>,
        #[schemars(length(min = 1), transform = list)]
        words: Key<Vec<Spanned<Word>>>,
        range: Key<Range>,
    }

    table!(Example);

    #[derive(Deserialize, JsonSchema)]
    #[serde(rename_all = "lowercase")]
    enum Word {
        One,
        Two,
    }

    #[derive(Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only the declarations are used")]
    struct Range {
        to: Spanned<f64>,
        #[serde(default)]
        #[schemars(extend("default" = 2))]
        steps: Key<u32>,
    }

    fn problems(text: &str) -> Vec<String> {
        let table = DeTable::parse(text).unwrap().into_inner();
        let (key, value) = table.iter().next().unwrap();
        let problems = validate(Example::layout(), key.get_ref(), value, None);
        problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn values_that_satisfy_the_schema_have_no_problems() {
        for text in [
            "width = 9",
            "width = [1, 9]",
            "length = 1",
            "length = 1e30",
            "words = [\"one\", \"two\"]",
            "range = { to = 1 }",
        ] {
            assert_eq!(problems(text), [""; 0], "{text}");
        }
    }

    #[test]
    fn all_mistakes_of_a_value_are_reported() {
        for (text, expected) in [
            ("width = 1.5", vec!["`width` must be a whole number or a pair of whole numbers"]),
            ("width = [1]", vec!["`width` has 1 entry (must have 2 entries)"]),
            ("width = [0, 10]", vec!["`width` holds 0 (must be from 1 to 9)", "`width` holds 10"]),
            ("width = 99999999999999999999", vec!["(must be at most 9223372036854775807)"]),
            ("length = 99999999999999999999", vec!["(must have an exponent, as in 1e20)"]),
            (
                "length = nan",
                vec!["`length` is nan (must be above 0 and finite); `length`: Length."],
            ),
            ("length = 1e-31", vec!["(must be from 1e-30 to 1e30; another unit may help)"]),
            ("length = 2024-01-01", vec!["`length` must be a number (this is a date)"]),
            (
                "length = \"2 mm\"",
                vec!["this key has no unit: write `2`, without quotes and without `mm`"],
            ),
            ("words = []", vec!["`words` is empty (must have at least one entry)"]),
            (
                "words = [\"twoo\", 1]",
                vec!["did you mean \"two\"?", "`words` must be a word in quotes"],
            ),
            ("range = { t = 1 }", vec!["`range` has no key `t` (did you mean `to`?)"]),
            (
                "range = { to = \"1\", steps = -1 }",
                vec!["`range.steps` is -1", "`range.to` must be"],
            ),
        ] {
            let problems = problems(text);
            assert_eq!(problems.len(), expected.len(), "{text}: {problems:?}");
            for (problem, part) in problems.iter().zip(expected) {
                assert!(problem.contains(part), "{text}: {part} in {problem}");
            }
        }
    }

    #[test]
    fn a_number_that_is_also_a_word_may_lack_quotes() {
        let schema = serde_json::json!({ "anyOf": [
            { "type": "string", "enum": ["none", "2017"] },
            { "type": "number", "minimum": 0, "exclusiveMaximum": 10 },
        ] });
        let table = DeTable::parse("correction = 2017").unwrap().into_inner();
        let (_, value) = table.iter().next().unwrap();
        let problem = validate_against(&schema, "correction", value)[0].to_string();
        let label =
            "write \"2017\" in quotes for the word; a number must be at least 0 and below 10";
        assert!(problem.contains(label), "{problem}");
    }

    #[test]
    fn keys_are_swept_in_the_order_of_their_declaration() {
        let layout = Example::layout();
        assert_eq!(layout.swept, ["width", "length"]);
        assert_eq!((&*layout.lists, &*layout.pairs), (&["words"][..], &["width"][..]));
        assert_eq!(layout.default_of("range.steps"), Some(2));
        assert_eq!(layout.default_of::<f64>("length"), Some(1.0));
        assert!(!serde_json::to_string(&layout.schema).unwrap().contains("x-"));
    }
}
