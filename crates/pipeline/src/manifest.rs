//! Reader of manifests, which leaves the values unchecked.
//!
//! The reader expands the table of each stage into its parameter points. It keeps the position of
//! each value in the text, and it continues after an unreadable value so that all problems are
//! found. [`crate::study`] then checks the values.

pub mod claim;
pub mod composition;
pub mod figure;
mod schema;
pub mod setting;
pub mod syntax;

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable, DeValue};

use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
use asperity_manifest::keys::declare::{list, required};
use asperity_manifest::keys::derived::Scope;
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::parameters::Parameters;
use asperity_manifest::keys::validation::{unknown_word, validate_against};
use asperity_manifest::keys::values::found;
use asperity_manifest::keys::{Key, KeyTable, Section, Spanned, reader, table};
use asperity_stages::Kind;
use asperity_stages::check_context::FromKey;
use asperity_stages::registry::{StagePoints, StageVariant, with_article};

use self::claim::WrittenClaims;
use self::figure::{WrittenFigure, WrittenTable};

pub use schema::schema;

/// Keys of the study as a whole.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StudyTable {
    /// Name of the study and of the folder of its results: a letter or `_`, then letters, digits,
    /// `_` and `-`.
    #[schemars(transform = required)]
    pub name: Key<String>,
    /// Path of a manifest that this one extends, relative to the folder of this manifest. Tables
    /// are merged key by key, and the values of this manifest override those of the other one.
    /// Lists are replaced. The `name` is not inherited.
    pub extends: Key<String>,
    /// Keys of the extended manifest that are left out, such as `["stage.surfaces.k_rolloff"]`.
    pub remove: Key<Vec<String>>,
    /// Files of claims that `asperity claims` tests besides those of this manifest: a file of the
    /// program, such as `"yastrebov-2015"`, or a path relative to the folder of this manifest.
    #[schemars(length(min = 1), transform = list)]
    pub claims: Key<Vec<Spanned<String>>>,
    /// Seed of the stages that draw random numbers and have no `seed`.
    #[schemars(extend("default" = 0))]
    pub seed: Key<u64>,
    /// Units of published tables, figures, maps and pages: `{ length = "um", pressure = "MPa" }`.
    /// Surfaces are solved and stored in their own units, so stored results stay valid. By default
    /// these are the units of output, too.
    pub output_units: Key<OutputUnitsTable>,
}

table!(StudyTable);

/// Units of output, the value of `output_units`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutputUnitsTable {
    /// Unit of lengths, such as `"um"`.
    pub length: Key<String>,
    /// Unit of pressures, such as `"MPa"`.
    pub pressure: Key<String>,
}

/// Maximum number of stages of a study.
const MAX_STAGES: usize = 200;
/// Maximum number of figures of a study.
const MAX_FIGURES: usize = 200;
/// Maximum number of claims, and of their data, in a manifest or a file of claims.
const MAX_CLAIMS: usize = 500;

/// A manifest as written, with values that are not checked yet.
#[derive(Debug)]
pub struct Manifest {
    pub study: Section<StudyTable>,
    /// Tables `[stage.NAME]`, in the order of the file.
    pub stages: Vec<StageTable>,
    /// Tables `[figure.NAME]`, in the order of the file.
    pub figures: Vec<WrittenFigure>,
    /// Tables `[claim.NAME]` and `[data.NAME]`, in the order of the file.
    pub claims: WrittenClaims,
    /// Inherited parameters that no stage uses.
    pub unused_parameters: Vec<String>,
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
    pub points: Option<Box<dyn StagePoints>>,
    /// The swept parameters that the stage uses.
    pub swept_parameters: BTreeSet<String>,
}

type Entry<'i> = (TomlSpanned<DeString<'i>>, TomlSpanned<DeValue<'i>>);

impl Manifest {
    /// Reads the tables of a manifest. Values before the position `inherited` are from manifests
    /// that this one extends, or from a manifest that settings override.
    pub fn read(mut document: DeTable<'_>, inherited: usize, problems: &mut Problems) -> Manifest {
        let parameters = document.remove_entry("parameters");
        let table = parameters.and_then(|entry| table_of(entry, problems));
        let parameters =
            table.map_or_else(Parameters::default, |table| Parameters::read(table, problems));
        let (mut study, mut stages, mut figures) = (None, Vec::new(), Vec::new());
        let mut claims = WrittenClaims::default();
        for entry in document {
            match entry.0.get_ref().as_ref() {
                "study" => study = read_study(entry, problems),
                "stage" => stages = read_stages(entry, &parameters, problems),
                "figure" => figures = read_figures(entry, problems),
                "claim" | "data" => read_claims(entry, &mut claims, problems),
                _ => problems.push(unknown_table(&entry)),
            }
        }
        let mut unused_parameters = Vec::new();
        if problems.is_empty() {
            unused_parameters = parameters.report_unused(inherited, problems);
            report_repeated_sweeps(&stages, problems);
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
        Manifest { study, stages, figures, claims, unused_parameters }
    }
}

fn read_study(entry: Entry, problems: &mut Problems) -> Option<Section<StudyTable>> {
    let span = entry.0.span();
    let table = table_of(entry, problems)?;
    let expected = ExpectedKeys::of_table("`[study]`");
    Some(reader::read(table, span, &expected, problems))
}

/// Reads the stages in the order of the file.
fn read_stages(
    entry: Entry,
    parameters: &Parameters<'_>,
    problems: &mut Problems,
) -> Vec<StageTable> {
    let entries = entries_of(entry, "stages", MAX_STAGES, problems).into_iter();
    entries.map(|entry| read_stage(entry, parameters, problems)).collect()
}

/// Reads the tables `[figure.NAME]` of a file of the program.
pub fn read_figures_of(text: &str) -> Vec<WrittenFigure> {
    let (document, _) = DeTable::parse_recoverable(text);
    let mut entries = document.into_inner().into_iter();
    let entry = entries.find(|entry| entry.0.get_ref().as_ref() == "figure");
    entry.map_or_else(Vec::new, |entry| read_figures(entry, &mut Problems::default()))
}

/// Reads the figures in the order of the file.
fn read_figures(entry: Entry, problems: &mut Problems) -> Vec<WrittenFigure> {
    let entries = entries_of(entry, "figures", MAX_FIGURES, problems).into_iter();
    let figures = entries.filter_map(|(name, mut value)| {
        if let DeValue::Table(table) = value.get_mut() {
            figure::in_british_spelling(table);
        }
        read_named((name, value), "a figure", problems)
    });
    figures.collect()
}

/// Reads the tables of claims or of their data in the order of the file.
pub(crate) fn read_claims(entry: Entry, claims: &mut WrittenClaims, problems: &mut Problems) {
    let is_data = entry.0.get_ref() == "data";
    let things = if is_data { "tables of data" } else { "claims" };
    for entry in entries_of(entry, things, MAX_CLAIMS, problems) {
        if is_data {
            claims.data.extend(read_named(entry, "data of claims", problems));
        } else {
            claims.claims.extend(read_named(entry, "a claim", problems));
        }
    }
}

fn read_named<T: KeyTable>(
    entry: Entry,
    what: &str,
    problems: &mut Problems,
) -> Option<WrittenTable<T>> {
    let span = entry.0.span();
    let name = Spanned { value: entry.0.get_ref().to_string(), span: span.clone() };
    let table = table_of(entry, problems)?;
    let expected = ExpectedKeys::of_table(what);
    Some(WrittenTable { name, keys: reader::read(table, span, &expected, problems) })
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

/// Reads the table of a stage.
fn read_stage(entry: Entry, parameters: &Parameters<'_>, problems: &mut Problems) -> StageTable {
    let span = entry.0.span();
    let name = Spanned { value: entry.0.get_ref().to_string(), span: span.clone() };
    let Some(mut table) = table_of(entry, problems) else {
        return StageTable::unreadable(name);
    };
    let Some(kind) = read_kind(&mut table, &span, problems) else {
        return StageTable::unreadable(name);
    };
    let variant = StageVariant::select(kind, &mut table, problems);
    let from_key = variant.map_or(FromKey::of_kind(kind), |variant| variant.from_key);
    let from = match from_key {
        FromKey::Absent => Some(Vec::new()),
        FromKey::Optional if !table.contains_key("from") => Some(Vec::new()),
        FromKey::Optional | FromKey::Required => {
            let what = variant.map_or_else(|| with_article(kind), StageVariant::describe);
            read_from(&mut table, &what, &span, problems)
        }
    };
    let mut swept_parameters = BTreeSet::new();
    let points = variant.map(|variant| {
        let scope = Scope { parameters: Some(parameters), ..Scope::default() };
        let points = variant.read(table, span, &scope, problems);
        swept_parameters = scope.swept.into_inner();
        points
    });
    StageTable { name, kind: Some(kind), from, points, swept_parameters }
}

impl StageTable {
    /// Creates a stage of which only the name is known. Stages that read it then cause no further
    /// errors.
    fn unreadable(name: Spanned<String>) -> Self {
        Self { name, kind: None, from: None, points: None, swept_parameters: BTreeSet::new() }
    }
}

/// Reports stages that sweep the same parameter as a stage that they read, because they would
/// combine each of its values with every other one.
fn report_repeated_sweeps(stages: &[StageTable], problems: &mut Problems) {
    let inputs = |stage: &StageTable| {
        let names = stage.from.iter().flatten().map(|name| &name.value);
        let input = |name: &String| stages.iter().position(|input| input.name.value == *name);
        names.filter_map(input).collect::<Vec<_>>()
    };
    for stage in stages.iter().filter(|stage| !stage.swept_parameters.is_empty()) {
        let mut pending = inputs(stage);
        let mut seen = BTreeSet::new();
        while let Some(index) = pending.pop().filter(|_| !problems.is_full()) {
            if !seen.insert(index) {
                continue;
            }
            let input = &stages[index];
            pending.extend(inputs(input));
            for parameter in stage.swept_parameters.intersection(&input.swept_parameters) {
                let (early, late) = (&input.name, &stage.name);
                let message = format!(
                    "the stages `{}` and `{}` both sweep the parameter `{parameter}`",
                    early.value, late.value
                );
                let label = format!("would combine each value with all rows of `{}`", early.value);
                let problem = Problem::new(message, late.span.clone(), label);
                problems.push(problem.and(early.span.clone(), "sweeps it first").help(
                    "the parameter is a column of the earlier stage, which later stages keep; \
                     use it in one of the two stages",
                ));
            }
        }
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
    what: &str,
    span: &Span,
    problems: &mut Problems,
) -> Option<Vec<Spanned<String>>> {
    let Some(value) = table.remove("from") else {
        let message = format!("{what} needs `from`");
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

/// Returns the table that an entry is, or `None` after reporting that it is another value.
pub(crate) fn table_of<'i>(
    (key, value): Entry<'i>,
    problems: &mut Problems,
) -> Option<DeTable<'i>> {
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
        match did_you_mean(name, ["study", "stage", "figure", "claim", "data", "parameters"]) {
            Some(word) => format!("did you mean `{word}`?"),
            None if is_table => format!("if this is a stage, write `[stage.{name}]`"),
            None => "not allowed in a manifest".to_owned(),
        },
    );
    problem.help(
        "a manifest has one table `[study]`, a table `[stage.NAME]` for each stage and, if it needs \
         them, `[parameters]` and tables `[figure.NAME]`, `[claim.NAME]` and `[data.NAME]`",
    )
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
        let study = Study::parse(&text, "first.toml", Path::new(".")).unwrap();
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
