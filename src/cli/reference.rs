//! `asperity schema`, `completions`, `man` and `reference`: texts generated from the program.
//!
//! `reference` writes pages of the guide. They are committed under `docs/reference/`, and CI checks
//! that they are up to date.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Arg, Command, CommandFactory};
use clap_complete::Shell;
use serde_json::{Map, Value};

use super::Failure;
use super::terminal::stdout;
use crate::session::new_manifest;
use crate::session::results::{DescribedColumns, Description};
use crate::session::{StoreError, make_folder};
use asperity_manifest::keys::quantity;

#[derive(clap::Args)]
pub struct SchemaArguments {}

pub fn schema(_: &SchemaArguments) -> Result<ExitCode, Failure> {
    let schema = serde_json::to_string_pretty(&new_manifest::schema())?;
    writeln!(stdout(), "{schema}")?;
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub struct CompletionsArguments {
    /// Shell to print completions for.
    shell: Shell,
}

pub fn completions<C: CommandFactory>(
    arguments: &CompletionsArguments,
) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut C::command(), "asperity", &mut script);
    io::stdout().lock().write_all(&script)?;
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub struct ManArguments {
    /// Folder for `asperity.1`, `asperity-run.1` …, such as `~/.local/share/man/man1`; created if
    /// it does not exist.
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
}

pub fn man<C: CommandFactory>(arguments: &ManArguments) -> Result<ExitCode, Failure> {
    let folder = &arguments.output;
    make_folder(folder)?;
    clap_mangen::generate_to(C::command(), folder)
        .map_err(|source| StoreError::writing(folder, source))?;
    writeln!(stdout(), "{}", folder.join("asperity.1").display())?;
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub struct ReferenceArguments {
    /// Folder for `keys.md`, `columns.md` and `commands.md`.
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
}

pub fn reference<C: CommandFactory>(arguments: &ReferenceArguments) -> Result<ExitCode, Failure> {
    make_folder(&arguments.output)?;
    let pages = [
        ("keys.md", keys_page()),
        ("columns.md", columns_page()),
        ("commands.md", commands_page(C::command())),
    ];
    for (name, page) in pages {
        let path = arguments.output.join(name);
        fs::write(&path, page).map_err(|source| StoreError::writing(&path, source))?;
        writeln!(stdout(), "{}", path.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

const KEYS_HEAD: &str = "\
# Manifest keys

<!-- Written by `asperity reference`; the source is the code. -->

A manifest has one table `[study]`, a table `[stage.NAME]` for each stage, of one of six kinds, a table
`[figure.NAME]` for each figure that it declares, and optionally a table `[parameters]`. Values of another type,
values out of bounds, unknown keys and missing required keys are errors. The message names the key, its value
and its position, and explains how to correct it ([errors](errors.md)). Numbers are compared with twelve
significant digits.

- *swept* – a list of values gives one parameter point per value; several lists give a grid.
- *pair* – `[along x, along y]`, for rectangles.
- `cases`, allowed if any key is swept, lists parameter points explicitly: each of its tables sets some of the
  swept keys.
- `from` names the stage that is read, or lists several stages.
- A text in the place of a number is an [expression](../how-to/variants.md) in other keys of the same parameter
  point and in parameters, such as `\"8 * k_upper\"`.

A *text with a unit* is a number and a unit, such as `\"100 um\"` or `\"210 GPa\"`. Units of length are `m`, `cm`,
`mm`, `um` (`µm`), `nm`, `Å` and `pm`; units of pressure are `Pa`, `kPa`, `MPa`, `GPa`, `N/mm²` and `bar`.
[Units](../how-to/materials.md) says which unit the tables then have. Lengths without a unit are in the unit of
`side`, and pressures in the unit of `effective_modulus` or of the moduli of the bodies; you choose both units.
Loads without a unit are mean pressures in units of E* × rms slope, unless `load_unit` is set.
";

const PARAMETERS: &str = "
## `[parameters]`

Numbers, lists of numbers to sweep, and expressions in other parameters, each with a name of letters, digits
and `_`. Keys of stages use them in expressions; a list is one axis of each stage that uses it. See
[variants](../how-to/variants.md).
";

/// Page of the guide with the formulas of each kind of stage.
const THEORY: [(&str, &str); 6] = [
    ("generate", "surfaces.md"),
    ("solve", "contact.md"),
    ("measure", "surfaces.md"),
    ("correct", "corrections.md"),
    ("fit", "laws.md"),
    ("aggregate", "models.md"),
];

/// Keys that the head of the page explains.
const EXPLAINED: [&str; 3] = ["kind", "from", "cases"];

/// Returns the text of `keys.md`.
fn keys_page() -> String {
    let schema = new_manifest::declared();
    let study = &schema["properties"]["study"];
    let mut page = format!("{KEYS_HEAD}\n## `[study]`\n\n");
    for (name, key) in properties(study) {
        page += &key_item(name, key, name == "name", &[], 0);
    }
    page += PARAMETERS;
    let forms = schema["properties"]["stage"]["additionalProperties"]["oneOf"].as_array();
    let forms = forms.expect("a stage has one of several forms");
    for kind in kinds(forms) {
        page += &kind_section(&kind, forms);
    }
    let figure = &schema["properties"]["figure"]["additionalProperties"];
    page += &format!("\n## `[figure.NAME]`\n\n{}\n\n", about(figure));
    for (name, key) in properties(figure) {
        page += &key_item(name, key, is_required(figure, name), &[], 0);
    }
    page
}

/// Returns the kinds of stage in the order of a study.
fn kinds(forms: &[Value]) -> Vec<String> {
    let mut kinds: Vec<String> = forms.iter().map(|form| word(form, "kind")).collect();
    kinds.dedup();
    kinds
}

fn kind_section(kind: &str, forms: &[Value]) -> String {
    let forms: Vec<&Value> = forms.iter().filter(|form| word(form, "kind") == kind).collect();
    let mut text = format!("\n## `kind = \"{kind}\"`\n\n");
    if let Some((_, page)) = THEORY.iter().find(|(of, _)| *of == kind) {
        text += &format!("Formulas: [theory](../theory/{page}).\n\n");
    }
    let selector = ["method", "law"].into_iter().find(|key| !word(forms[0], key).is_empty());
    if let Some(key) = selector {
        text += &format!("| `{key}` | meaning |\n|---|---|\n");
        for (index, form) in forms.iter().enumerate() {
            let default = if index == 0 { " (default)" } else { "" };
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
        text += &key_item(name, key, required, &words, 0);
    }
    text
}

/// Key of a kind of stage, with the methods or laws that have it.
struct Entry<'a> {
    name: &'a str,
    key: &'a Value,
    /// Names of the methods or laws that have the key.
    words: Vec<String>,
    required: bool,
}

/// Returns the keys of all variants of a kind of stage in alphabetical order. `selector` is the key
/// that selects the variant. Equal keys of several variants are merged.
fn entries<'a>(forms: &[&'a Value], selector: Option<&str>) -> Vec<Entry<'a>> {
    let mut entries: Vec<Entry> = Vec::new();
    for form in forms {
        let word = selector.map_or_else(String::new, |key| word(form, key));
        let is_explained = |name: &str| EXPLAINED.contains(&name) || selector == Some(name);
        for (name, key) in properties(form).filter(|(name, _)| !is_explained(name)) {
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

/// Returns whether a key is required, in the table itself or in each of the `cases`.
fn is_required(form: &Value, name: &str) -> bool {
    let has = |list: &Value| list.as_array().is_some_and(|list| list.iter().any(|key| key == name));
    has(&form["required"]) || has(&form["anyOf"][0]["required"])
}

/// Formats a key as a list item, with the keys of its table as indented items below it.
fn key_item(name: &str, key: &Value, required: bool, words: &[String], depth: usize) -> String {
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
        facts.push(format!("only for {}", words.join(", ")));
    }
    let indent = "  ".repeat(depth);
    let mut text = format!("{indent}- `{name}` – {}. {}\n", facts.join("; "), about(key));
    for part in parts(value) {
        if let Some(word) = part.get("const") {
            text += &format!("{indent}  - `{}` – {}\n", as_toml(word), about(part));
        }
        let required = |key: &str| is_required(part, key);
        for (name, key) in properties(part) {
            text += &key_item(name, key, required(name), &[], depth + 1);
        }
    }
    text
}

/// Returns the schema of a single value, and whether the key can be swept over a list of values.
fn unswept(key: &Value) -> (&Value, bool) {
    match key["anyOf"].as_array().map(Vec::as_slice) {
        Some([one, many]) if about(many) == "swept over its values" => (one, true),
        Some([one, many]) if many["items"] == *one => (many, false),
        _ => (key, false),
    }
}

/// Returns the schemas that a value, or an item of a list or table, may have.
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

/// Describes the values that a key accepts.
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
        one["type"] = types.into_iter().filter(|kind| *kind != "array").collect();
        return format!("{}, or a pair", described(&one));
    }
    let may_have_unit = value["pattern"] == quantity::PATTERN;
    let unit = if may_have_unit { ", or a text with a unit" } else { "" };
    match types.first().copied() {
        _ if value.get("const").is_some() => format!("`{}`", as_toml(&value["const"])),
        Some("integer") => format!("a whole number{}", bounds(value)),
        Some("number") => format!("a number{}{unit}", bounds(value)),
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

const COLUMNS_HEAD: &str = "\
# Columns

<!-- Written by `asperity reference`; the source is the code. -->

All columns of tables, sorted by the first kind of stage that has them. A table also has those columns of its
input tables that distinguish its rows. `asperity columns MANIFEST [STAGE]` lists the columns of a study, and
the metadata of the fields of every table contain the same description.

Unit `1` marks a pure number; columns without numbers have no unit. *Length* and *pressure* are in the units
that the manifest uses for `side` and for `effective_modulus` or `bodies`.
";

/// Returns the text of `columns.md`.
fn columns_page() -> String {
    let mut page = COLUMNS_HEAD.to_owned();
    let mut known: Vec<Description> = Vec::new();
    for DescribedColumns { kind, columns, .. } in DescribedColumns::for_all_kinds() {
        let new: Vec<_> = columns.into_iter().filter(|column| !known.contains(column)).collect();
        page += &format!("\n## `{kind}`\n\n| column | unit | meaning |\n|---|---|---|\n");
        for column in &new {
            let Description { name, unit, .. } = column;
            page += &format!("| `{name}` | {} | {} |\n", cell(unit), cell(&column.explained()));
        }
        known.extend(new);
    }
    page
}

/// Escapes a text for a Markdown table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('<', "&lt;")
}

const COMMANDS_HEAD: &str = "\
# The command line

<!-- Written by `asperity reference`; the source is the code. -->

Exit codes: 0 success, 1 a task or a file failed, 2 error in the manifest or the command line, 130 stopped
by Ctrl-C, 143 stopped by `kill`, 129 terminal closed.

`ASPERITY_DATA` sets the default of `--data`. `ASPERITY_SIMD` selects the instruction set: `avx512`, `avx2` or
`portable`; the default is the widest set of the processor. `NO_COLOR` turns colours off.
";

/// Returns the text of `commands.md`.
fn commands_page(mut command: Command) -> String {
    command.build();
    let mut page = COMMANDS_HEAD.to_owned();
    let global: Vec<&Arg> = command.get_arguments().filter(|arg| arg.is_global_set()).collect();
    page += "\nOptions of every command:\n\n";
    global.iter().for_each(|arg| page += &option_item(arg));
    let commands = command.get_subcommands().filter(|command| !command.is_hide_set());
    for command in commands.filter(|command| command.get_name() != "help") {
        page += &command_section(command);
    }
    page
}

fn command_section(command: &Command) -> String {
    let about = command.get_long_about().or(command.get_about());
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").trim();
    let mut text = format!(
        "\n## `asperity {}`\n\n{}\n\n```text\n{usage}\n```\n",
        command.get_name(),
        about.map_or_else(String::new, |about| sentence(&about.to_string())),
    );
    let own = command.get_arguments().filter(|arg| !arg.is_global_set() && !arg.is_hide_set());
    let own: Vec<&Arg> =
        own.filter(|arg| !["help", "version"].contains(&arg.get_id().as_str())).collect();
    if !own.is_empty() {
        text.push('\n');
    }
    own.iter().for_each(|arg| text += &option_item(arg));
    text
}

fn option_item(arg: &Arg) -> String {
    let value = arg.get_value_names().unwrap_or_default().first();
    let value = value.filter(|_| arg.get_action().takes_values()).map(|value| value.to_string());
    let name = match (arg.get_short(), arg.get_long()) {
        (Some(short), Some(long)) => format!("-{short}, --{long}"),
        (None, Some(long)) => format!("--{long}"),
        _ => value.clone().unwrap_or_default(),
    };
    let value = value.filter(|_| arg.get_long().is_some());
    let value = value.map_or_else(String::new, |value| format!(" <{value}>"));
    let about = arg.get_long_help().or(arg.get_help());
    let about = about.map_or_else(String::new, |about| sentence(&about.to_string()));
    let words: Vec<String> = arg
        .get_possible_values()
        .iter()
        .filter(|word| !word.is_hide_set())
        .map(|word| format!("`{}`", word.get_name()))
        .collect();
    let words = if arg.get_action().takes_values() && !words.is_empty() {
        format!(" One of {}.", words.join(", "))
    } else {
        String::new()
    };
    let default = arg.get_default_values().first().filter(|_| arg.get_action().takes_values());
    let default = default
        .map_or_else(String::new, |value| format!(" Default: `{}`.", value.to_string_lossy()));
    format!("- `{name}{value}` – {about}{words}{default}\n")
}

/// Joins a text into one line and adds a full stop if it has none.
fn sentence(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if text.ends_with(['.', '!', '?']) { text } else { text + "." }
}
