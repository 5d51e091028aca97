//! The page of all keys of manifests, from the schema that editors read.

use serde_json::{Map, Value};

use asperity_pipeline::manifest::schema;

const HEAD: &str = "\
# Manifest keys

<!-- Written by `asperity reference`; the source is the code. -->

A manifest has one table `[study]` and a table `[stage.NAME]` for each stage, of one of six kinds. What is
not of the type or outside the bounds that are said here is an error, and so is a key that is not here, or
one that is needed and missing: the message names the key, its value and its place, and says what would do
([errors](errors.md)). Numbers count to twelve significant digits.

- *swept* – a list of values gives a table row for each; several such lists make a grid.
- *pair* – `[along x, along y]`, of rectangles.
- `cases`, where any key is swept, names points of the grid outright: a list of tables that each set some of
  the swept keys.
- `from` names the stage that is read, or a list of several.

Lengths are in the unit of `side`, and pressures in that of `effective_modulus` or of the bodies' moduli; both
units are yours. Loads are mean pressures in units of E* × rms slope unless `load_unit` says otherwise.
";

/// The page of the guide that has the formulas of a kind of stage.
const THEORY: [(&str, &str); 6] = [
    ("generate", "surfaces.md"),
    ("solve", "contact.md"),
    ("measure", "surfaces.md"),
    ("correct", "corrections.md"),
    ("fit", "laws.md"),
    ("aggregate", "models.md"),
];

/// Keys that the head of the page explains, and the word that tells a form.
const EXPLAINED: [&str; 3] = ["kind", "from", "cases"];

/// The text of the page.
pub fn page() -> String {
    let schema = schema();
    let study = &schema["properties"]["study"];
    let mut page = format!("{HEAD}\n## `[study]`\n\n");
    for (name, key) in properties(study) {
        page += &item(name, key, name == "name", &[], 0);
    }
    let forms = schema["properties"]["stage"]["additionalProperties"]["oneOf"].as_array();
    let forms = forms.expect("a stage has one of several forms");
    for kind in kinds(forms) {
        page += &of_kind(&kind, forms);
    }
    page
}

/// The kinds of stages, in the order of a study.
fn kinds(forms: &[Value]) -> Vec<String> {
    let mut kinds: Vec<String> = forms.iter().map(|form| word(form, "kind")).collect();
    kinds.dedup();
    kinds
}

fn of_kind(kind: &str, forms: &[Value]) -> String {
    let forms: Vec<&Value> = forms.iter().filter(|form| word(form, "kind") == kind).collect();
    let mut text = format!("\n## `kind = \"{kind}\"`\n\n");
    if let Some((_, page)) = THEORY.iter().find(|(of, _)| *of == kind) {
        text += &format!("What is computed: [theory](../theory/{page}).\n\n");
    }
    let selector = ["method", "law"].into_iter().find(|key| !word(forms[0], key).is_empty());
    if let Some(key) = selector {
        text += &format!("| `{key}` | what it is |\n|---|---|\n");
        for (place, form) in forms.iter().enumerate() {
            let default = if place == 0 { ", when left out" } else { "" };
            text += &format!(
                "| `\"{}\"`{default} | {} |\n",
                word(form, key),
                about(&form["properties"][key])
            );
        }
        text.push('\n');
    } else {
        text += &format!("{}\n\n", about(forms[0]));
    }
    for Entry { name, key, words, required } in entries(&forms, selector) {
        let words = if words.len() == forms.len() { Vec::new() } else { words };
        text += &item(name, key, required, &words, 0);
    }
    text
}

/// A key as some forms of a kind have it.
struct Entry<'a> {
    name: &'a str,
    key: &'a Value,
    /// Those forms.
    words: Vec<String>,
    required: bool,
}

/// The keys of all forms of a kind, in the order of the alphabet; those that are equal once.
fn entries<'a>(forms: &[&'a Value], selector: Option<&str>) -> Vec<Entry<'a>> {
    let mut entries: Vec<Entry> = Vec::new();
    for form in forms {
        let word = selector.map_or_else(String::new, |key| word(form, key));
        let is_told = |name: &str| EXPLAINED.contains(&name) || selector == Some(name);
        for (name, key) in properties(form).filter(|(name, _)| !is_told(name)) {
            let required = is_required(form, name);
            let equal = |entry: &&mut Entry| {
                (entry.name, entry.key, entry.required) == (name, key, required)
            };
            match entries.iter_mut().find(equal) {
                Some(entry) => entry.words.push(word.clone()),
                None => entries.push(Entry { name, key, words: vec![word.clone()], required }),
            }
        }
    }
    entries.sort_by_key(|entry| entry.name);
    entries
}

/// Whether a key must be there, or be set by each of the `cases`.
fn is_required(form: &Value, name: &str) -> bool {
    let has = |list: &Value| list.as_array().is_some_and(|list| list.iter().any(|key| key == name));
    has(&form["required"]) || has(&form["anyOf"][0]["required"])
}

/// A key as an item of a list, those of its table indented below it.
fn item(name: &str, key: &Value, required: bool, words: &[String], depth: usize) -> String {
    let (value, is_swept) = unswept(key);
    let mut facts = vec![described(value)];
    facts.extend(is_swept.then(|| "*swept*".to_owned()));
    facts.extend(required.then(|| "**required**".to_owned()));
    facts.extend(
        key.get("default")
            .filter(|default| **default != "")
            .map(|default| format!("default `{}`", as_toml(default))),
    );
    if !words.is_empty() {
        let words: Vec<String> = words.iter().map(|word| format!("`\"{word}\"`")).collect();
        facts.push(format!("of {}", words.join(", ")));
    }
    let indent = "  ".repeat(depth);
    let mut text = format!("{indent}- `{name}` – {}. {}\n", facts.join("; "), about(key));
    for part in parts(value) {
        if let Some(word) = part.get("const") {
            text += &format!("{indent}  - `{}` – {}\n", as_toml(word), about(part));
        }
        let required = |key: &str| is_required(part, key);
        for (name, key) in properties(part) {
            text += &item(name, key, required(name), &[], depth + 1);
        }
    }
    text
}

/// A value without the list of such values that may stand for it.
fn unswept(key: &Value) -> (&Value, bool) {
    match key["anyOf"].as_array().map(Vec::as_slice) {
        Some([one, many]) if about(many) == "swept over its values" => (one, true),
        Some([one, many]) if many["items"] == *one => (many, false),
        _ => (key, false),
    }
}

/// The alternatives of a value, of its items too.
fn parts(value: &Value) -> Vec<&Value> {
    for several in ["oneOf", "anyOf"] {
        if let Some(several) = value[several].as_array() {
            return several.iter().flat_map(parts).collect();
        }
    }
    match value.get("items").filter(|_| value["type"] == "array") {
        Some(items) => parts(items),
        None => value
            .get("additionalProperties")
            .filter(|more| more.is_object())
            .map_or_else(|| vec![value], parts),
    }
}

/// Which values will do.
fn described(value: &Value) -> String {
    for several in ["oneOf", "anyOf"] {
        if let Some(several) = value[several].as_array() {
            let is_word = several.iter().all(|one| one.get("const").is_some());
            let kinds: Vec<String> = several.iter().map(described).collect();
            return if is_word { "a word".to_owned() } else { kinds.join(", or ") };
        }
    }
    let types: Vec<&str> = match &value["type"] {
        Value::String(one) => vec![one],
        Value::Array(several) => several.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    if types.contains(&"array") && types.len() > 1 {
        let mut one = value.clone();
        one["type"] = types[0].into();
        return format!("{}, or a pair", described(&one));
    }
    match types.first().copied() {
        _ if value.get("const").is_some() => format!("`{}`", as_toml(&value["const"])),
        Some("integer") => format!("a whole number{}", bounds(value)),
        Some("number") => format!("a number{}", bounds(value)),
        Some("boolean") => "`true` or `false`".to_owned(),
        Some("string") => "a text".to_owned(),
        Some("array") if value["maxItems"] == 2 && value["minItems"] == 2 => {
            format!("a pair, each {}", described(&value["items"]))
        }
        Some("array") => format!("a list, each {}", described(&value["items"])),
        Some("object") => "a table".to_owned(),
        _ => "anything".to_owned(),
    }
}

fn bounds(value: &Value) -> String {
    let of =
        |key: &str, word: &str| value.get(key).map(|bound| format!("{word} {}", as_toml(bound)));
    let lower = of("minimum", "from").or(of("exclusiveMinimum", "above"));
    let upper = of("maximum", "to").or(of("exclusiveMaximum", "below"));
    let both: Vec<String> = lower.into_iter().chain(upper).collect();
    if both.is_empty() { String::new() } else { format!(" {}", both.join(" ")) }
}

fn as_toml(value: &Value) -> String {
    match value {
        Value::Array(items) => {
            format!("[{}]", items.iter().map(as_toml).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

fn about(value: &Value) -> &str {
    value["description"].as_str().unwrap_or_default()
}

fn word(form: &Value, key: &str) -> String {
    let word = form["properties"][key]["const"].as_str();
    word.unwrap_or_default().to_owned()
}

fn properties(table: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let properties = table["properties"].as_object().into_iter().flat_map(Map::iter);
    properties.map(|(name, key)| (name.as_str(), key))
}
