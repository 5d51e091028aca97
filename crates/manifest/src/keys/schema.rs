//! What the JSON schema of a key accepts.

use serde_json::Value;
use toml::de::DeValue;

/// Returns the alternatives of a schema; a value must satisfy one of them.
pub fn alternatives(schema: &Value) -> Vec<&Value> {
    match schema.get("oneOf").or(schema.get("anyOf")).and_then(Value::as_array) {
        Some(several) => several.iter().flat_map(alternatives).collect(),
        None => vec![schema],
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

pub(super) fn is_number(schema: &Value) -> bool {
    is_type(schema, "number") || is_type(schema, "integer")
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
