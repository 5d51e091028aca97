//! JSON Schema of manifests, for editors.

use serde_json::{Map, Value, json};

use super::StudyTable;
use super::claim::{ClaimTable, DataTable};
use super::figure::FigureTable;
use asperity_manifest::keys::declare::QUANTITY;
use asperity_manifest::keys::{KeyTable, quantity};
use asperity_manifest::names;
use asperity_stages::check_context::FromKey;
use asperity_stages::registry::StageVariant;

/// Returns the JSON Schema of manifests in draft 7, which the TOML extensions of editors support.
pub fn schema() -> Value {
    let mut stages: Vec<Value> = StageVariant::all().map(stage).collect();
    stages.iter_mut().for_each(accept_expressions);
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "asperity manifest",
        "description": "A statistical study of rough contact.",
        "type": "object",
        "properties": {
            "study": with_lists::<StudyTable>(),
            "parameters": parameters(),
            "stage": {
                "description": "Stages of the study, each a table `[stage.NAME]`.",
                "type": "object",
                "minProperties": 1,
                "propertyNames": { "pattern": names::PATTERN, "maxLength": names::MAX_LENGTH },
                "additionalProperties": { "oneOf": stages },
            },
            "figure": {
                "description": "Figures of the study, each a table `[figure.NAME]`.",
                "type": "object",
                "propertyNames": { "pattern": names::PATTERN, "maxLength": names::MAX_LENGTH },
                "additionalProperties": with_lists::<FigureTable>(),
            },
            "claim": {
                "description": "Claims of the study, each a table `[claim.NAME]`.",
                "type": "object",
                "additionalProperties": with_lists::<ClaimTable>(),
            },
            "data": {
                "description": "Data that several claims use, each a table `[data.NAME]`.",
                "type": "object",
                "additionalProperties": with_lists::<DataTable>(),
            },
        },
        "required": ["study", "stage"],
        "additionalProperties": false,
    })
}

fn parameters() -> Value {
    let value = json!({ "type": ["number", "string"], "pattern": EXPRESSION });
    json!({
        "description": "Named numbers, lists of numbers to sweep, and expressions in other \
                        parameters, which keys of stages use in expressions.",
        "type": "object",
        "propertyNames": { "pattern": "^[A-Za-z_][A-Za-z0-9_]*$" },
        "additionalProperties": {
            "anyOf": [value, { "type": "array", "items": value, "minItems": 1 }],
        },
    })
}

/// Regular expression of expressions: they contain a letter or an operator.
const EXPRESSION: &str = "[A-Za-z_*/^()+]";
/// Regular expression of expressions for keys that also take words: they contain an operator.
const OPERATION: &str = "[*/^()+]";
/// Regular expression of expressions and of quantities with a unit.
const QUANTITY_OR_EXPRESSION: &str = "[A-Za-zÅ_*/^()+]";

/// Lets all numbers in a schema be expressions.
fn accept_expressions(schema: &mut Value) {
    accept_expressions_within(schema, if takes_words(schema) { OPERATION } else { EXPRESSION });
}

/// Returns whether one of the alternatives of a schema, or of the items of a list, is a word.
fn takes_words(schema: &Value) -> bool {
    let mut alternatives =
        ["anyOf", "oneOf"].into_iter().filter_map(|rule| schema.get(rule)?.as_array()).flatten();
    let is_word = schema.get("enum").or(schema.get("const")).is_some();
    is_word || alternatives.any(takes_words) || schema.get("items").is_some_and(takes_words)
}

fn accept_expressions_within(schema: &mut Value, pattern: &str) {
    let kinds = schema.as_object().map(kinds_of).unwrap_or_default();
    if schema.get("pattern").is_some_and(|pattern| pattern == quantity::PATTERN) {
        schema["pattern"] = json!(QUANTITY_OR_EXPRESSION);
    } else if kinds.iter().any(|kind| kind == "number" || kind == "integer") {
        schema["type"] = [kinds, vec![json!("string")]].concat().into();
        schema["pattern"] = json!(pattern);
    }
    for rule in ["anyOf", "oneOf"] {
        let alternatives = schema.get_mut(rule).and_then(Value::as_array_mut);
        alternatives.into_iter().flatten().for_each(|one| accept_expressions_within(one, pattern));
    }
    if let Some(items) = schema.get_mut("items") {
        accept_expressions(items);
    }
    for rule in ["properties", "patternProperties"] {
        let keys = schema.get_mut(rule).and_then(Value::as_object_mut);
        keys.into_iter().flatten().for_each(|(_, key)| accept_expressions(key));
    }
    if let Some(more) = schema.get_mut("additionalProperties").filter(|more| more.is_object()) {
        accept_expressions(more);
    }
}

/// Returns the types that a schema allows.
fn kinds_of(schema: &Map<String, Value>) -> Vec<Value> {
    match schema.get("type") {
        Some(Value::Array(kinds)) => kinds.clone(),
        kind => kind.cloned().into_iter().collect(),
    }
}

/// Returns the schema of the table of a stage.
fn stage(variant: &StageVariant) -> Value {
    let layout = variant.layout;
    let (swept, lists, mut schema) = (&layout.swept, &layout.lists, layout.schema.clone());
    let with_units: Map<String, Value> = layout
        .properties()
        .iter()
        .map(|(key, value)| (key.clone(), with_units(value.clone(), false)))
        .collect();
    let mut required = vec![json!("kind")];
    let of_kind = json!({ "description": "Kind of the stage.", "const": variant.kind.name() });
    let mut properties = Map::from_iter([("kind".to_owned(), of_kind)]);
    if let Some((key, word)) = variant.selector {
        properties.insert(key.to_owned(), json!({ "description": variant.about, "const": word }));
        if !variant.is_default() {
            required.push(json!(key));
        }
    }
    if variant.from_key != FromKey::Absent {
        properties.insert("from".to_owned(), from());
    }
    if variant.from_key == FromKey::Required {
        required.push(json!("from"));
    }
    let must = schema.get("required").and_then(Value::as_array).cloned().unwrap_or_default();
    if !swept.is_empty() {
        properties.insert("cases".to_owned(), cases(swept, &with_units));
    }
    properties.extend(with_units.into_iter().map(|(key, value)| {
        let value = if swept.contains(&key.as_str()) {
            one_or_many(value, "swept over its values")
        } else if lists.contains(&key.as_str()) {
            item_or_list(value)
        } else {
            value
        };
        (key, value)
    }));
    let is_swept = |key: &Value| key.as_str().is_some_and(|key| swept.contains(&key));
    let (must_or_cases, must): (Vec<_>, Vec<_>) = must.into_iter().partition(is_swept);
    required.extend(must);
    if !must_or_cases.is_empty() {
        // Required keys may be set in the cases instead of the table.
        let either = json!([{ "required": must_or_cases }, { "required": ["cases"] }]);
        schema.insert("anyOf".to_owned(), either);
    }
    schema.insert("title".to_owned(), json!(variant.describe().replace('`', "")));
    schema.insert("properties".to_owned(), properties.into());
    schema.insert("required".to_owned(), required.into());
    schema.insert("additionalProperties".to_owned(), json!(false));
    schema.into()
}

/// Returns the schema of a table whose lists may be single items.
fn with_lists<T: KeyTable>() -> Value {
    let layout = T::layout();
    let keys = layout.properties().clone().into_iter().map(|(key, value)| {
        let is_list = layout.lists.contains(&key.as_str());
        (key, if is_list { item_or_list(value) } else { value })
    });
    let mut schema = layout.schema.clone();
    schema.insert("properties".to_owned(), keys.collect::<Map<_, _>>().into());
    schema.into()
}

/// Replaces the marker of quantities in the schema of a key: numbers may also be texts with a unit.
/// `is_quantity` tells that the numbers of the schema are quantities.
fn with_units(schema: Value, is_quantity: bool) -> Value {
    let mut object = match schema {
        Value::Object(object) => object,
        Value::Array(schemas) => {
            return schemas.into_iter().map(|schema| with_units(schema, is_quantity)).collect();
        }
        other => return other,
    };
    let is_quantity = object.remove(QUANTITY).is_some() || is_quantity;
    for keyword in ["anyOf", "oneOf", "items"] {
        if let Some(inner) = object.remove(keyword) {
            object.insert(keyword.to_owned(), with_units(inner, is_quantity));
        }
    }
    if let Some(Value::Object(keys)) = object.get_mut("properties") {
        keys.iter_mut().for_each(|(_, key)| *key = with_units(key.take(), false));
    }
    let mut kinds = kinds_of(&object);
    if is_quantity && kinds.contains(&json!("number")) {
        kinds.insert(1, json!("string"));
        object.insert("type".to_owned(), kinds.into());
        object.insert("pattern".to_owned(), json!(quantity::PATTERN));
    }
    object.into()
}

/// Returns the schema of the key `from`.
pub fn from() -> Value {
    json!({
        "description": "Name of the stage that this one reads, or a list of names.",
        "anyOf": [
            { "type": "string" },
            { "type": "array", "items": { "type": "string" }, "minItems": 1, "uniqueItems": true },
        ],
    })
}

fn cases(swept: &[&str], own: &Map<String, Value>) -> Value {
    let keys = swept.iter().filter_map(|key| Some((key.to_string(), own.get(*key)?.clone())));
    json!({
        "description": "List of parameter points; each case sets some of the swept keys.",
        "type": "array",
        "minItems": 1,
        "items": {
            "type": "object",
            "properties": keys.collect::<Map<_, _>>(),
            "additionalProperties": false,
        },
    })
}

/// Returns a schema that accepts what `value` accepts, or a list of such values. `why` becomes the
/// description of the list.
fn one_or_many(value: Value, why: &str) -> Value {
    let (about, bare) = split(value);
    let list = json!({ "description": why, "type": "array", "items": bare.clone(), "minItems": 1 });
    with(about, json!([bare, list]))
}

/// Returns a schema that accepts what `value`, the schema of a list, accepts, or a single item.
fn item_or_list(value: Value) -> Value {
    let (about, bare) = split(value);
    let item = bare.get("items").cloned().unwrap_or(json!({}));
    with(about, json!([item, bare]))
}

/// Splits a schema into its annotations (`description` and `default`) and all other keywords.
fn split(value: Value) -> (Map<String, Value>, Value) {
    let Value::Object(object) = value else {
        return (Map::new(), value);
    };
    let about = |key: &String| key == "description" || key == "default";
    let (about, bare) = object.into_iter().partition::<Map<_, _>, _>(|(key, _)| about(key));
    (about, Value::Object(bare))
}

fn with(mut about: Map<String, Value>, either: Value) -> Value {
    about.insert("anyOf".to_owned(), either);
    Value::Object(about)
}

#[cfg(test)]
mod tests;
