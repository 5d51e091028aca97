//! Reader of manifests, which leaves the values unchecked.
//!
//! The reader expands the table of each stage into its parameter points. It keeps the position of
//! each value in the text, and it continues after an unreadable value so that all problems are
//! found. [`crate::study`] then checks the values.

pub mod figure;
mod schema;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable, DeValue, Error};

use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
use asperity_manifest::keys::declare::required;
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::validation::{found, unknown_word, validate_against};
use asperity_manifest::keys::{Key, Section, Spanned, reader, table};
use asperity_stages::Kind;
use asperity_stages::form::{FromKey, StagePoints, StageVariant, with_article};

use self::figure::WrittenFigure;

pub use schema::schema;

/// Keys of the study as a whole.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StudyTable {
    /// Name of the study and of the folder of its results: a letter or `_`, then letters, digits,
    /// `_` and `-`.
    #[schemars(transform = required)]
    pub name: Key<String>,
    /// Seed of the stages that draw random numbers and have no `seed`.
    #[schemars(extend("default" = 0))]
    pub seed: Key<u64>,
}

table!(StudyTable);

/// Maximum number of stages of a study.
const MAX_STAGES: usize = 200;
/// Maximum number of figures of a study.
const MAX_FIGURES: usize = 200;

/// A manifest as written, with values that are not checked yet.
#[derive(Debug)]
pub struct Manifest {
    pub study: Section<StudyTable>,
    /// Tables `[stage.NAME]`, in the order of the file.
    pub stages: Vec<StageTable>,
    /// Tables `[figure.NAME]`, in the order of the file.
    pub figures: Vec<WrittenFigure>,
}

/// One table `[stage.NAME]` as written.
#[derive(Debug)]
pub struct StageTable {
    pub name: Spanned<String>,
    pub kind: Option<Kind>,
    /// Names of the stages that this stage reads, or `None` if `from` is missing or invalid.
    pub from: Option<Vec<Spanned<String>>>,
    /// All other keys, at each parameter point. `None` if the kind is unknown, because it decides
    /// which keys are valid.
    pub points: Option<StagePoints>,
}

type Entry<'i> = (TomlSpanned<DeString<'i>>, TomlSpanned<DeValue<'i>>);

impl Manifest {
    /// Parses the text of a manifest. Returns `None` if it is not valid TOML.
    pub fn parse(text: &str, problems: &mut Problems) -> Option<Manifest> {
        let (document, errors) = DeTable::parse_recoverable(text);
        if !errors.is_empty() {
            report_syntax(text, &errors, problems);
            return None;
        }
        let (mut study, mut stages, mut figures) = (None, Vec::new(), Vec::new());
        for entry in document.into_inner() {
            match entry.0.get_ref().as_ref() {
                "study" => study = read_study(entry, problems),
                "stage" => stages = read_stages(entry, problems),
                "figure" => figures = read_figures(entry, problems),
                _ => problems.push(unknown_table(&entry)),
            }
        }
        if stages.is_empty() && problems.is_empty() {
            problems.push(
                Problem::without_position("the manifest has no stages")
                    .help("add a table such as `[stage.surface]` with `kind = \"generate\"`"),
            );
        }
        let study = study.unwrap_or_else(|| {
            if problems.is_empty() {
                problems.push(
                    Problem::without_position("the table `[study]` is missing")
                        .help("start the manifest with `[study]` and `name = \"…\"`"),
                );
            }
            Section::unreadable(0..0)
        });
        Some(Manifest { study, stages, figures })
    }

    /// Returns the name of the study, if it has one.
    pub fn study_name(&self) -> Option<&str> {
        let name = self.study.points.first()?.table.name.written()?;
        Some(&name.value)
    }
}

fn read_study(entry: Entry, problems: &mut Problems) -> Option<Section<StudyTable>> {
    let span = entry.0.span();
    let table = table_of(entry, problems)?;
    let expected = ExpectedKeys::of_table("`[study]`");
    Some(reader::read(table, span, &expected, problems))
}

/// Reads the stages in the order of the file.
fn read_stages(entry: Entry, problems: &mut Problems) -> Vec<StageTable> {
    let entries = entries_of(entry, "stages", MAX_STAGES, problems).into_iter();
    entries.map(|entry| read_stage(entry, problems)).collect()
}

/// Reads the figures in the order of the file.
fn read_figures(entry: Entry, problems: &mut Problems) -> Vec<WrittenFigure> {
    let entries = entries_of(entry, "figures", MAX_FIGURES, problems).into_iter();
    entries.filter_map(|entry| read_figure(entry, problems)).collect()
}

fn read_figure(entry: Entry, problems: &mut Problems) -> Option<WrittenFigure> {
    let span = entry.0.span();
    let name = Spanned { value: entry.0.get_ref().to_string(), span: span.clone() };
    let mut table = table_of(entry, problems)?;
    figure::in_british_spelling(&mut table);
    let expected = ExpectedKeys::of_table("a figure");
    Some(WrittenFigure { name, keys: reader::read(table, span, &expected, problems) })
}

/// Returns the entries of a table in the order of the file, at most `max` of them. `things` says in
/// messages what they are.
fn entries_of<'i>(
    entry: Entry<'i>,
    things: &str,
    max: usize,
    problems: &mut Problems,
) -> Vec<Entry<'i>> {
    let mut entries: Vec<_> = table_of(entry, problems).into_iter().flatten().collect();
    entries.sort_by_key(|(name, _)| name.span().start);
    if let Some((name, _)) = entries.get(max) {
        let message = format!("the study has {} {things}", entries.len());
        let label = format!("at most {max} {things} are allowed");
        problems.push(Problem::new(message, name.span(), label));
        entries.truncate(max);
    }
    entries
}

fn read_stage(entry: Entry, problems: &mut Problems) -> StageTable {
    let span = entry.0.span();
    let name = Spanned { value: entry.0.get_ref().to_string(), span: span.clone() };
    let Some(mut table) = table_of(entry, problems) else {
        return StageTable::unreadable(name);
    };
    let Some(kind) = read_kind(&mut table, &span, problems) else {
        return StageTable::unreadable(name);
    };
    let variant = StageVariant::select(kind, &mut table, problems);
    let from_key = variant.map_or(FromKey::of_kind(kind), StageVariant::from_key);
    let from = match from_key {
        FromKey::Absent => Some(Vec::new()),
        FromKey::Optional if !table.contains_key("from") => Some(Vec::new()),
        FromKey::Optional | FromKey::Required => read_from(&mut table, kind, &span, problems),
    };
    let points = variant.map(|variant| variant.read(table, span, problems));
    StageTable { name, kind: Some(kind), from, points }
}

impl StageTable {
    /// Creates a stage of which only the name is known. Stages that read it then cause no further
    /// errors.
    fn unreadable(name: Spanned<String>) -> Self {
        Self { name, kind: None, from: None, points: None }
    }
}

fn read_kind(table: &mut DeTable, span: &Span, problems: &mut Problems) -> Option<Kind> {
    let words = Kind::ALL.map(Kind::name);
    let Some(value) = table.remove("kind") else {
        problems.push(
            Problem::new("the stage has no `kind`", span.clone(), "`kind` is missing here")
                .help(format!("set `kind` to one of {}", listed(words, "and"))),
        );
        return None;
    };
    let kind = value
        .get_ref()
        .as_str()
        .and_then(|word| Kind::ALL.into_iter().find(|kind| kind.name() == word));
    if kind.is_none() {
        problems.push(unknown_word("kind", &value, &words));
    }
    kind
}

fn read_from(
    table: &mut DeTable,
    kind: Kind,
    span: &Span,
    problems: &mut Problems,
) -> Option<Vec<Spanned<String>>> {
    let Some(value) = table.remove("from") else {
        let message = format!("{} needs `from`", with_article(kind));
        let problem = Problem::new(message, span.clone(), "`from` is missing here");
        problems.push(
            problem
                .help("set `from` to the name of the stage that it reads, or to a list of names"),
        );
        return None;
    };
    let mistakes = validate_against(&schema::from(), "from", &value);
    let is_valid = mistakes.is_empty();
    mistakes.into_iter().for_each(|mistake| problems.push(mistake));
    let names = is_valid.then(|| reader::deserialize(reader::as_list(value)));
    names.and_then(Result::ok)
}

fn table_of<'i>((key, value): Entry<'i>, problems: &mut Problems) -> Option<DeTable<'i>> {
    let span = value.span();
    match value.into_inner() {
        DeValue::Table(table) => Some(table),
        other => {
            let message = format!("`{}` must be a table", key.get_ref());
            let label = found(&other);
            problems.push(Problem::new(message, span, label));
            None
        }
    }
}

fn unknown_table((key, value): &Entry) -> Problem {
    let name = key.get_ref();
    let is_table = value.get_ref().is_table();
    let what = if is_table { "table" } else { "key" };
    let problem = Problem::new(
        format!("unknown {what} `{name}`"),
        key.span(),
        match did_you_mean(name, ["study", "stage", "figure"]) {
            Some(word) => format!("did you mean `{word}`?"),
            None if is_table => format!("if this is a stage, write `[stage.{name}]`"),
            None => "not allowed in a manifest".to_owned(),
        },
    );
    problem.help(
        "a manifest has one table `[study]`, a table `[stage.NAME]` for each stage and, if it \
         declares figures, a table `[figure.NAME]` for each of them",
    )
}

/// Maximum number of syntax errors that are examined, because each requires a search through the
/// text.
const MAX_ERRORS: usize = 200;

/// Reports syntax errors, except those that are consequences of other errors.
pub fn report_syntax(text: &str, errors: &[Error], problems: &mut Problems) {
    let mut last_line = None;
    let mut repeated_table: Option<usize> = None;
    for error in errors.iter().take(MAX_ERRORS) {
        let mut span = error.span().unwrap_or(text.len()..text.len());
        span.start = span.start.min(text.len());
        let line = line_start(text, span.start);
        // Later errors on a line are mostly consequences of the first one.
        if last_line.replace(line) == Some(line) {
            continue;
        }
        if error.message() != "duplicate key" {
            problems.push(syntax_error(text, error, span));
            continue;
        }
        // If a table is repeated, its repeated keys are not reported.
        let is_within = |table: usize| !text[table..span.start].contains("\n[");
        if repeated_table.is_some_and(is_within) {
            continue;
        }
        if text[line..].starts_with('[') {
            repeated_table = Some(line);
        }
        problems.push(duplicate(text, line, span));
    }
}

fn line_start(text: &str, position: usize) -> usize {
    text[..position].rfind('\n').map_or(0, |end| end + 1)
}

fn syntax_error(text: &str, error: &Error, span: Span) -> Problem {
    if is_decimal_comma(text, span.start) {
        let message = "invalid TOML: a comma within a number";
        return Problem::new(message, span, "write the decimal point as `.`");
    }
    Problem::new(format!("invalid TOML: {}", error.message()), span, "here")
}

fn is_decimal_comma(text: &str, position: usize) -> bool {
    let is_digit = |at: Option<usize>| {
        at.and_then(|at| text.as_bytes().get(at)).is_some_and(u8::is_ascii_digit)
    };
    text.as_bytes().get(position) == Some(&b',')
        && is_digit(position.checked_sub(1))
        && is_digit(Some(position + 1))
}

/// Describes the problem that the key or table at `span` appears twice. `line` is the start of its
/// line in `text`.
fn duplicate(text: &str, line: usize, span: Span) -> Problem {
    let name = text.get(span.clone()).unwrap_or_default();
    let (what, help) = if text[line..].starts_with('[') {
        ("the table", "rename one of the stages, or remove it")
    } else {
        ("the key", "remove one of them")
    };
    let mut problem = Problem::new(
        format!("{what} `{}` appears twice", name.trim()),
        span.clone(),
        "repeated here",
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

/// Name of the schema file. The first line of the template refers to this file in the folder of the
/// manifest.
pub const SCHEMA: &str = "asperity.schema.json";

/// Placeholder in the template, which [`template`] replaces by the name of the study.
const NAME: &str = "STUDY";

/// Returns a template manifest with comments for a study of the given name, which must be valid.
pub fn template(name: &str) -> String {
    include_str!("manifest/template.toml").replace(NAME, name)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::plan::Plan;
    use crate::study::Study;

    use super::*;

    #[test]
    fn the_template_makes_sense_as_it_is() {
        let text = template("first");
        let study =
            Study::parse(&text, "first.toml", Path::new("."), crate::study::no_claims).unwrap();
        assert_eq!(study.name, "first");
        assert!(study.warnings().is_empty());
        assert_eq!(Plan::new(&study).stages.len(), 5);
        assert!(!text.contains(NAME), "{text}");
    }

    #[test]
    fn editors_find_the_schema_on_the_first_line() {
        let first = template("first").lines().next().map(str::to_owned);
        assert_eq!(first, Some(format!("#:schema ./{SCHEMA}")));
    }
}
