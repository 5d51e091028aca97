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
        ("length = nan", vec!["`length` is nan (must be above 0 and finite); `length`: Length."]),
        ("length = 1e-31", vec!["(must be from 1e-30 to 1e30; another unit may help)"]),
        ("length = 2024-01-01", vec!["`length` must be a number (this is a date)"]),
        (
            "length = \"2 mm\"",
            vec!["(this is the text \"2 mm\"); write a number without a unit; `length`: Length."],
        ),
        ("width = \"10 um\"", vec!["write a number without a unit"]),
        ("words = 1", vec!["`words` must be a list of texts in quotes (this is the number 1)"]),
        ("words = []", vec!["`words` is empty (must have at least one entry)"]),
        (
            "words = [\"twoo\", 1]",
            vec!["did you mean \"two\"?", "`words` must be a word in quotes"],
        ),
        ("range = { t = 1 }", vec!["`range` has no key `t` (did you mean `to`?)"]),
        ("range = { to = \"1\", steps = -1 }", vec!["`range.steps` is -1", "`range.to` must be"]),
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
    let label = "write \"2017\" in quotes for the word; a number must be at least 0 and below 10";
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
