//! Tests that the JSON Schema accepts what the reader of manifests accepts.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use crate::study::Study;
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_stages::{Kind, RowKind};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn study(text: &str) -> Result<Study, ManifestErrors> {
    Study::parse(text, "test.toml", &root().join("tests/manifests"))
}

/// Returns whether a value satisfies a schema. Supports only the parts of JSON Schema that
/// [`schema`] uses.
fn is_valid(value: &Value, schema: &Value) -> bool {
    let Some(rules) = schema.as_object() else {
        return schema.as_bool().unwrap_or(true);
    };
    rules.iter().all(|(rule, wanted)| satisfies(value, rule, wanted, schema))
}

fn satisfies(value: &Value, rule: &str, wanted: &Value, schema: &Value) -> bool {
    let number = value.as_f64();
    let limit = wanted.as_f64().unwrap_or(f64::NAN);
    let length = value.as_array().map(Vec::len);
    let fitting = || {
        let options = wanted.as_array().into_iter().flatten();
        options.filter(|option| is_valid(value, option)).count()
    };
    match rule {
        "type" => wanted.as_array().map_or_else(
            || is_of_type(value, wanted),
            |types| types.iter().any(|wanted| is_of_type(value, wanted)),
        ),
        "const" => value == wanted,
        "enum" => wanted.as_array().is_some_and(|words| words.contains(value)),
        "oneOf" => fitting() == 1,
        "anyOf" => fitting() > 0,
        "minimum" => number.is_none_or(|number| number >= limit),
        "maximum" => number.is_none_or(|number| number <= limit),
        "exclusiveMinimum" => number.is_none_or(|number| number > limit),
        "exclusiveMaximum" => number.is_none_or(|number| number < limit),
        "minItems" => length.is_none_or(|length| length as f64 >= limit),
        "maxItems" => length.is_none_or(|length| length as f64 <= limit),
        "items" => {
            value.as_array().is_none_or(|items| items.iter().all(|item| is_valid(item, wanted)))
        }
        "required" => value.as_object().is_none_or(|object| {
            let mut keys = wanted.as_array().into_iter().flatten();
            keys.all(|key| object.contains_key(key.as_str().unwrap_or_default()))
        }),
        "properties" => value.as_object().is_none_or(|object| {
            object
                .iter()
                .all(|(key, value)| wanted.get(key).is_none_or(|rule| is_valid(value, rule)))
        }),
        "additionalProperties" => value.as_object().is_none_or(|object| {
            let is_known = |key: &str| schema["properties"].get(key).is_some();
            object.iter().all(|(key, value)| is_known(key) || is_valid(value, wanted))
        }),
        "pattern" if wanted == quantity::PATTERN => {
            value.as_str().is_none_or(|text| quantity::split(text).is_some())
        }
        // All other patterns are those of expressions.
        "pattern" => value.as_str().is_none_or(|text| {
            let letters = wanted.as_str().unwrap_or_default();
            let has = |letter: char| match letter {
                letter if letter.is_ascii_alphabetic() || letter == '_' => letters.contains("A-Z"),
                letter => letters.contains(letter) && !letter.is_ascii_digit(),
            };
            text.contains(has)
        }),
        "$schema" | "title" | "description" | "default" | "format" | "propertyNames" => true,
        "minProperties" | "uniqueItems" => true,
        other => panic!("the schema uses `{other}`, which this test does not know"),
    }
}

fn is_of_type(value: &Value, wanted: &Value) -> bool {
    match wanted.as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some("boolean") => value.is_boolean(),
        other => panic!("the schema has the type {other:?}"),
    }
}

fn manifests(folder: &str) -> BTreeMap<String, String> {
    let entries = fs::read_dir(root().join(folder)).unwrap().map(Result::unwrap);
    let paths = entries.map(|entry| entry.path());
    paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| {
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            (name, fs::read_to_string(path).unwrap())
        })
        .collect()
}

#[test]
fn manifests_that_can_be_run_satisfy_the_schema() {
    let schema = schema();
    for (name, text) in manifests("manifests") {
        let value: Value = toml::from_str(&text).unwrap();
        assert!(is_valid(&value, &schema), "{name}");
    }
}

#[test]
fn mistakes_of_a_single_value_violate_the_schema() {
    let schema = schema();
    let bad = manifests("tests/manifests");
    let names = [
        "unknown-key",
        "unknown-key-nested",
        "key-of-another-method",
        "key-of-another-kind",
        "unknown-kind",
        "unknown-method",
        "unknown-table",
        "missing-kind",
        "missing-from",
        "missing-study",
        "hurst-outside",
        "realizations-negative",
        "swept-nothing",
        "not-swept",
        "poisson-ratio",
        "corrections",
        "fit-window",
        "shape",
    ];
    for name in names {
        // JSON has no such numbers.
        let text = bad[name].replace("nan, -inf", "0.5").replace("nan", "1");
        let value: Value = toml::from_str(&text).unwrap();
        assert!(!is_valid(&value, &schema), "{name}");
    }
}

#[test]
fn swept_keys_and_lists_are_keys() {
    for variant in StageVariant::all() {
        let layout = variant.layout;
        let pairs = layout.pairs.iter().chain(&layout.always_pairs);
        for key in layout.swept.iter().chain(&layout.lists).chain(pairs) {
            assert!(layout.has(key), "{} has no `{key}`", variant.describe());
        }
    }
}

// A stage that gets one of these keys makes the answer wrong.
#[test]
fn keys_that_are_answered_are_keys_of_no_stage() {
    for variant in StageVariant::all() {
        for key in asperity_manifest::keys::synonyms::words() {
            assert!(
                !variant.layout.has(key),
                "{} has `{key}`: remove its answer",
                variant.describe()
            );
        }
    }
}

// A number without bounds in the schema would not be checked at all.
#[test]
fn every_number_has_bounds() {
    fn unbounded(schema: &Value, path: &str, found: &mut Vec<String>) {
        let types = [&schema["type"], &schema["type"][0]];
        let is_number =
            ["number", "integer"].iter().any(|kind| types.iter().any(|one| one == kind));
        let bounds = ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"];
        if is_number && !bounds.iter().any(|bound| schema.get(bound).is_some()) {
            found.push(path.to_owned());
        }
        for one in
            ["anyOf", "oneOf"].iter().filter_map(|several| schema[several].as_array()).flatten()
        {
            unbounded(one, path, found);
        }
        if schema["items"].is_object() {
            unbounded(&schema["items"], path, found);
        }
        for (name, key) in schema["properties"].as_object().into_iter().flatten() {
            unbounded(key, &format!("{path}.{name}"), found);
        }
    }
    let mut found = Vec::new();
    for variant in StageVariant::all() {
        for (name, key) in variant.layout.properties() {
            unbounded(key, name, &mut found);
        }
    }
    // Positions on a map may have any coordinates. Loads with adhesion and heights about the mean
    // may have any sign. Any number may mark missing points.
    let is_free = |path: &str| {
        path.starts_with("level_through.")
            || ["crop.from", "loads", "missing", "smr_height"].contains(&path)
    };
    found.retain(|path| !is_free(path));
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn every_key_is_explained() {
    for variant in StageVariant::all() {
        for (key, about) in variant.layout.properties() {
            assert!(about["description"].is_string(), "{}: `{key}`", variant.describe());
        }
    }
}

/// Returns the lines of a manifest that set the required keys of a variant.
fn smallest(variant: &StageVariant) -> &'static str {
    match (variant.kind, variant.selector.map_or("", |(_, word)| word)) {
        (Kind::Generate, "filter" | "random-phase") => {
            "nodes = 64\nhurst = 0.8\nk_lower = 2\nk_upper = 16"
        }
        (Kind::Generate, "spectrum") => "path = \"maps/spectrum.csv\"\nnodes = 64\nside = 1",
        (Kind::Generate, "file") => {
            "path = \"maps/rough.npy\"\nside = 1\nperiodic = false\nedges = \"taper\"\n\
             spikes = 8\nalign = \"polynomial\"\nfill = \"lowest\""
        }
        (Kind::Generate, "paraboloid") => "nodes = 64\nradius = 0.4",
        (Kind::Generate, "wave" | "wave-product" | "wave-sum") => "nodes = 64\namplitude = 0.1",
        (Kind::Generate, "flat-punch") => "nodes = 64\nradius = 0.4\ndepth = 0.1",
        (Kind::Solve, _) => "loads = [0.1]",
        (Kind::Aggregate, _) => "over = \"load\"",
        (Kind::Fit, "limits") => "of = \"mean_gap\"\nterms = { of = \"1 / k_lower\" }",
        _ => "",
    }
}

/// Returns a manifest whose last table has only the required keys of a variant.
fn manifest(variant: &StageVariant) -> String {
    let mut text = "[study]\nname = \"s\"\n".to_owned();
    let can_read = |rows| variant.kind.definition().reads.rows.contains(&rows);
    let is_of_spectra = variant.selector == Some(("law", "self-affine"));
    let from = match () {
        () if is_of_spectra => "from = \"spectra\"",
        () if variant.selector == Some(("method", "yielded")) => "from = \"yielding\"",
        () if can_read(RowKind::Contacts) => "from = \"contacts\"",
        () if can_read(RowKind::Surfaces) => "from = \"surfaces\"",
        () if can_read(RowKind::Loads) => "from = \"loads\"",
        () => "",
    };
    text += "[stage.surfaces]\nkind = \"generate\"\n";
    text += smallest(StageVariant::all().next().unwrap());
    text += "\n[stage.loads]\nkind = \"solve\"\nfrom = \"surfaces\"\nloads = [0.1]\n";
    text +=
        "[stage.yielding]\nkind = \"solve\"\nfrom = \"surfaces\"\nloads = [0.1]\nhardness = 1\n";
    text += "[stage.contacts]\nkind = \"measure\"\nfrom = \"loads\"\n";
    text += "[stage.spectra]\nkind = \"measure\"\nfrom = \"surfaces\"\nwhat = \"spectrum\"\n";
    text += &format!("[stage.last]\nkind = \"{}\"\n{from}\n{}\n", variant.kind, smallest(variant));
    if let Some((key, word)) = variant.selector {
        text += &format!("{key} = \"{word}\"\n");
    }
    text
}

#[test]
fn defaults_written_out_change_nothing() {
    for variant in StageVariant::all() {
        let left_out = manifest(variant);
        let layout = variant.layout;
        let keys = layout.properties();
        let defaults = keys.iter().filter_map(|(key, about)| Some((key, about.get("default")?)));
        let defaults = defaults.map(|(key, value)| format!("{key} = {value}\n"));
        let written = left_out.clone() + &defaults.collect::<String>();
        let [left_out, written] = [left_out, written]
            .map(|text| study(&text).unwrap_or_else(|errors| panic!("{}", errors.render(false))));
        assert_eq!(left_out, written, "{}", variant.describe());
    }
}

#[test]
fn bounds_of_the_schema_are_those_of_the_study() {
    let mut bounds = 0;
    for variant in StageVariant::all() {
        let layout = variant.layout;
        let keys = layout.properties();
        for (key, about) in keys {
            let plain: Vec<_> = manifest(variant).lines().map(str::to_owned).collect();
            // Numbers that may be pairs name both types.
            let is_whole = [&about["type"], &about["type"][0]].contains(&&json!("integer"));
            // Only the last table is changed.
            let start = plain.iter().position(|line| line == "[stage.last]").unwrap();
            let is_key = |line: &String| line.starts_with(&format!("{key} ="));
            let (head, tail) = plain.split_at(start);
            let tail = tail.iter().filter(|line| !is_key(line));
            let rest: Vec<_> = head.iter().chain(tail).cloned().collect();
            let refuses = |value: f64| {
                let text = format!("{}\n{key} = {value:?}\n", rest.join("\n"));
                let text = if is_whole {
                    text.replace(&format!("{key} = {value:?}"), &format!("{key} = {value}"))
                } else {
                    text
                };
                let message = format!("`{key}` is ");
                study(&text).is_err_and(|errors| {
                    errors.problems().iter().any(|problem| problem.message().starts_with(&message))
                })
            };
            let expected = [
                ("minimum", -1.0, 0.0),
                ("maximum", 1.0, 0.0),
                ("exclusiveMinimum", 0.0, 1.0),
                ("exclusiveMaximum", 0.0, -1.0),
            ];
            for (rule, outside, inside) in expected {
                let Some(bound) = about.get(rule).and_then(Value::as_f64) else {
                    continue;
                };
                // Numbers of a manifest are read to twelve digits.
                let step = if is_whole { 1.0 } else { 1e-9 * bound.max(1.0) };
                let (outside, inside) = (bound + outside * step, bound + inside * step);
                assert!(refuses(outside), "{}: {key} beyond {rule}", variant.describe());
                assert!(!refuses(inside), "{}: {key} within {rule}", variant.describe());
                bounds += 1;
            }
        }
    }
    assert!(bounds > 50, "{bounds} bounds were compared");
}

#[test]
fn numbers_may_be_expressions_of_parameters() {
    let schema = schema();
    let manifest = |nodes: Value, correction: Value| {
        serde_json::json!({
            "study": { "name": "derived", "extends": "base.toml" },
            "parameters": { "k": [8, "2 * half"], "half": 8 },
            "stage": {
                "surfaces": {
                    "kind": "generate",
                    "nodes": nodes,
                    "hurst": ["hurst", 0.8],
                    "k_lower": 1,
                    "k_upper": "k",
                },
                "contact": {
                    "kind": "solve",
                    "from": "surfaces",
                    "loads": { "to": "0.5 * k_upper", "steps": 4 },
                },
                "area": { "kind": "measure", "from": "contact" },
                "corrected": { "kind": "correct", "from": "area", "correction": correction },
            },
        })
    };
    assert!(is_valid(&manifest("8 * k_upper".into(), "2017".into()), &schema));
    assert!(is_valid(&manifest(64.into(), "none".into()), &schema));
    assert!(!is_valid(&manifest("64".into(), "none".into()), &schema));
    assert!(!is_valid(&manifest(64.into(), "nonne".into()), &schema));
}
