//! Composition of a manifest from the manifests that it extends and the settings of the command
//! line.
//!
//! Tables are merged key by key, and lists are replaced. A manifest overrides the manifests that it
//! extends, and settings override the manifest.
//!
//! Each text is parsed behind as many spaces as all texts before it are long. The position of a
//! value in the padded text thus also tells the text that contains the value.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable, DeValue, Error};

use super::setting::Setting;
use super::syntax::report_syntax;
use asperity_manifest::diagnostics::{
    ManifestErrors, Problem, Problems, SourceText, Span, listed, suggestion,
};
use asperity_manifest::keys::values::found;
use asperity_tables::store::regular::read_regular;

/// Maximum size of a manifest in bytes.
const MAX_BYTES: u64 = 4 << 20;
/// Maximum number of manifests that extend each other.
const MAX_FILES: usize = 16;

/// The manifest of a study after the manifests that it extends and the settings were applied.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EffectiveManifest {
    /// Text of the manifest. If it extends no other one and nothing is set, this is the text of its
    /// file.
    pub text: String,
    /// Paths of the extended manifests relative to the folder of the manifest, the directly
    /// extended one first.
    pub bases: Vec<PathBuf>,
    /// First paragraph of the comment at the beginning of the manifest.
    pub description: Option<String>,
    /// Settings of the command line, in TOML.
    pub settings: Vec<String>,
}

impl EffectiveManifest {
    /// Returns whether the text differs from the file of the manifest.
    pub fn is_composed(&self) -> bool {
        !self.bases.is_empty() || !self.settings.is_empty()
    }
}

/// The texts of which a manifest is composed.
#[derive(Debug)]
pub struct Composition {
    /// Name of the manifest in messages.
    file: String,
    /// Extended manifests, then the manifest, then settings; each overrides those before it.
    sources: Vec<Source>,
    bases: Vec<PathBuf>,
}

#[derive(Debug)]
struct Source {
    /// Name of the text in messages.
    name: String,
    /// The text behind `start` characters of padding.
    padded: String,
    start: usize,
    is_setting: bool,
}

/// A manifest that has been read, with its path relative to the folder of the first one.
struct File {
    path: PathBuf,
    text: String,
}

impl Composition {
    /// Reads a manifest and the manifests that it extends.
    ///
    /// # Errors
    /// Returns an error if one of the manifests cannot be read, or if manifests extend each other.
    pub fn read(path: &Path, settings: &[Setting]) -> Result<Composition, ManifestErrors> {
        let file = path.display().to_string();
        let text = read_text(path).map_err(|reason| {
            let problem =
                Problem::without_position(format!("cannot read manifest `{file}`: {reason}"));
            let mut problems = Problems::default();
            problems.push(with_suggestion(problem, path));
            problems.into_errors(&file, "")
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Composition::new(text, &file, folder, Some(path), settings)
    }

    /// Composes a manifest whose text is known, and reads the manifests that it extends. `file` is
    /// the name of the manifest in messages, and `own` its path if it has one.
    ///
    /// # Errors
    /// Returns the same errors as [`Composition::read`].
    pub fn new(
        text: String,
        file: &str,
        folder: &Path,
        own: Option<&Path>,
        settings: &[Setting],
    ) -> Result<Composition, ManifestErrors> {
        let mut files = vec![File { path: PathBuf::new(), text }];
        let mut seen: BTreeSet<PathBuf> =
            own.and_then(|path| fs::canonicalize(path).ok()).into_iter().collect();
        let mut failed = None;
        while let Some((base, span)) = extended_by(&files[files.len() - 1].text) {
            match File::extended(&files[files.len() - 1], &base, folder, &mut seen) {
                Ok(_) if files.len() == MAX_FILES => {
                    let message = format!("more than {MAX_FILES} manifests extend each other");
                    failed = Some(Problem::new(message, span, "one too many"));
                }
                Ok(base) => {
                    files.push(base);
                    continue;
                }
                Err(failure) => failed = Some(failure.at(&base, span)),
            }
            break;
        }
        let bases: Vec<PathBuf> = files[1..].iter().map(|file| file.path.clone()).collect();
        let mut sources: Vec<Source> = Vec::new();
        for (index, File { path, text }) in files.into_iter().enumerate().rev() {
            let name =
                if index == 0 { file.to_owned() } else { folder.join(path).display().to_string() };
            sources.push(Source::after(sources.last(), name, &text, false));
        }
        let unread = failed.map(|problem| problem.shifted(sources[0].start));
        for setting in settings {
            let name = "--set".to_owned();
            sources.push(Source::after(sources.last(), name, setting.line(), true));
        }
        let composition = Composition { file: file.to_owned(), sources, bases };
        match unread {
            None => Ok(composition),
            Some(problem) => {
                let mut problems = Problems::default();
                problems.push(problem);
                Err(composition.errors(problems))
            }
        }
    }

    /// Returns problems as errors that show the text of each.
    pub fn errors(&self, problems: Problems) -> ManifestErrors {
        let sources = self.sources.iter().map(Source::in_messages);
        problems.into_errors_in(&self.file, sources.collect())
    }

    /// Parses and merges the texts. Returns `None` after reporting problems if one of them is not
    /// valid TOML.
    pub fn document(&self, problems: &mut Problems) -> Option<DeTable<'_>> {
        let mut merged: Option<DeTable> = None;
        let mut is_valid = true;
        for (index, source) in self.sources.iter().enumerate() {
            let (parsed, errors) = DeTable::parse_recoverable(&source.padded);
            if let Some(first) = errors.first() {
                if index < self.bases.len() {
                    problems.push(self.not_toml(index, first));
                } else {
                    report_syntax(&source.padded, &errors, problems);
                }
                is_valid = false;
                continue;
            }
            let mut document = parsed.into_inner();
            let removed = take_study_keys(&mut document, source.is_setting, problems);
            match &mut merged {
                None => {
                    report_nothing_to_remove(&removed, problems);
                    merged = Some(document);
                }
                Some(merged) if source.is_setting => {
                    if has_stages(merged, &document, problems) {
                        merge(merged, document);
                    }
                }
                Some(merged) => {
                    removed.iter().for_each(|path| remove(merged, path, problems));
                    extend(merged, document);
                }
            }
        }
        let mut document = merged.filter(|_| is_valid)?;
        if !self.bases.is_empty() {
            remove_unknown_stages(&mut document, problems);
        }
        Some(document)
    }

    /// Returns the problem of an extended manifest that is not valid TOML, at the key that names
    /// it. The file can be any file on this machine, so the message does not quote it.
    fn not_toml(&self, index: usize, error: &Error) -> Problem {
        let [base, extending] = [&self.sources[index], &self.sources[index + 1]];
        let (_, span) = extended_by(extending.text()).expect("it was found by this key");
        let [line, column] =
            base.in_messages().line_and_column(error.span().map_or(base.start, |span| span.start));
        let message = format!(
            "cannot extend `{name}`, which is not valid TOML in line {line}, column {column}; `asperity \
             check {name}` shows the line",
            name = base.name
        );
        Problem::new(message, span, "extended here").shifted(extending.start)
    }

    /// Returns the position before which values are inherited: from extended manifests, or, if keys
    /// were set, from the manifest.
    pub fn inherited(&self) -> usize {
        let first = |is_setting| self.sources.iter().find(|source| source.is_setting == is_setting);
        let own = || self.sources.iter().rfind(|source| !source.is_setting);
        first(true).or_else(own).map_or(0, |source| source.start)
    }

    /// Returns the effective manifest; `document` is the result of [`Composition::document`].
    /// Unused parameters are left out, because only a manifest that is extended may have them.
    pub fn effective(&self, mut document: DeTable<'_>, unused: &[String]) -> EffectiveManifest {
        if let Some(DeValue::Table(parameters)) =
            document.get_mut("parameters").map(TomlSpanned::get_mut)
        {
            unused.iter().for_each(|name| drop(parameters.remove(name.as_str())));
            if parameters.is_empty() {
                document.remove("parameters");
            }
        }
        let given = self.sources.iter().filter(|source| source.is_setting);
        let settings: Vec<_> = given.map(|source| source.text().to_owned()).collect();
        let text = match self.sources.as_slice() {
            [only] => only.text().to_owned(),
            _ => self.merged_text(&document, &settings),
        };
        let own = self.sources.iter().rfind(|source| !source.is_setting);
        let description = own.and_then(|source| description(source.text()));
        EffectiveManifest { text, bases: self.bases.clone(), description, settings }
    }

    /// Writes the merged tables as TOML, with every value as it is written in its source.
    fn merged_text(&self, document: &DeTable<'_>, settings: &[String]) -> String {
        let name = Path::new(&self.file).file_name().unwrap_or_default();
        let mut text = format!("# Effective manifest of `{}`", name.to_string_lossy());
        for base in &self.bases {
            text += &format!(", which extends `{}`", base.display());
        }
        text.push('\n');
        for setting in settings {
            text += &format!("# --set {setting}\n");
        }
        self.write_table(document, &mut Vec::new(), &mut text);
        text
    }

    /// Writes the values of a table, then its tables with headers. Tables of a stage are written
    /// inline.
    fn write_table<'d>(&self, table: &'d DeTable<'_>, path: &mut Vec<&'d str>, text: &mut String) {
        let is_inline = path.len() == 2 || path.first() == Some(&"study");
        let (tables, values): (Vec<_>, Vec<_>) = in_order(table)
            .into_iter()
            .partition(|(_, value)| value.get_ref().is_table() && !is_inline);
        if !values.is_empty() || (tables.is_empty() && !path.is_empty()) {
            let header: Vec<_> = path.iter().map(|key| key_text(key)).collect();
            *text += &format!("\n[{}]\n", header.join("."));
        }
        for (key, value) in values {
            *text += &format!("{} = {}\n", key_text(key), self.value_text(value));
        }
        for (key, value) in tables {
            path.push(key);
            self.write_table(value.get_ref().as_table().expect("it is a table"), path, text);
            path.pop();
        }
    }

    /// Returns a value as it is written, except that tables are written inline.
    fn value_text(&self, value: &TomlSpanned<DeValue<'_>>) -> String {
        match value.get_ref() {
            DeValue::Table(table) => {
                let entries = in_order(table)
                    .into_iter()
                    .map(|(key, value)| format!("{} = {}", key_text(key), self.value_text(value)));
                format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
            }
            DeValue::Array(items) if items.iter().any(|item| item.get_ref().is_table()) => {
                let lines = items.iter().map(|item| format!("    {},\n", self.value_text(item)));
                format!("[\n{}]", lines.collect::<String>())
            }
            _ => {
                let span = value.span();
                let source = self.sources.iter().rfind(|source| source.start <= span.start);
                let written = source.and_then(|source| source.padded.get(span));
                written.unwrap_or_default().to_owned()
            }
        }
    }
}

impl Source {
    /// Creates the source that follows `last`.
    fn after(last: Option<&Source>, name: String, text: &str, is_setting: bool) -> Source {
        // The newline makes the first line of the text begin after the padding.
        let start = last.map_or(0, |last| last.padded.len() + 1);
        let mut padded = " ".repeat(start.saturating_sub(1));
        if start > 0 {
            padded.push('\n');
            // A byte order mark is valid only at the start of a file.
            padded += &text.replacen('\u{feff}', "   ", 1);
        } else {
            padded += text;
        }
        Source { name, padded, start, is_setting }
    }

    fn text(&self) -> &str {
        &self.padded[self.start..]
    }

    fn in_messages(&self) -> SourceText {
        SourceText { name: self.name.clone(), text: self.text().to_owned(), start: self.start }
    }
}

/// A reason why a manifest cannot be extended.
enum Failure {
    Unreadable { path: PathBuf, reason: String },
    Cycle,
}

impl Failure {
    /// Returns the problem at the position of the key `extends` with the value `base`.
    fn at(self, base: &str, span: Span) -> Problem {
        match self {
            Failure::Unreadable { path, reason } => {
                let message = format!("cannot read manifest `{}`: {reason}", path.display());
                with_suggestion(Problem::new(message, span, "extended here"), &path)
            }
            Failure::Cycle => {
                let message = format!("`{base}` is extended by itself");
                Problem::new(message, span, "leads back to a manifest that extends this one")
            }
        }
    }
}

impl File {
    /// Reads the manifest `base` that `file` extends. `seen` has the manifests read so far.
    fn extended(
        file: &File,
        base: &str,
        folder: &Path,
        seen: &mut BTreeSet<PathBuf>,
    ) -> Result<File, Failure> {
        let path = normalized(&file.path.parent().unwrap_or(Path::new("")).join(base));
        let full = folder.join(&path);
        let unreadable = |reason: String| Failure::Unreadable { path: full.clone(), reason };
        let canonical = fs::canonicalize(&full).map_err(|error| unreadable(error.to_string()))?;
        if !seen.insert(canonical) {
            return Err(Failure::Cycle);
        }
        let text = read_text(&full).map_err(unreadable)?;
        Ok(File { path, text })
    }
}

/// Returns the first paragraph of the comment at the beginning of a manifest.
fn description(manifest: &str) -> Option<String> {
    let comments = manifest.lines().map_while(|line| line.trim().strip_prefix('#'));
    // Editors read `#:schema` as the path of the schema.
    let lines = comments.filter(|line| !line.starts_with(':')).map(str::trim);
    let paragraph = lines.skip_while(|line| line.is_empty()).take_while(|line| !line.is_empty());
    let text = paragraph.collect::<Vec<_>>().join(" ");
    (!text.is_empty()).then_some(text)
}

/// Returns a path without `.`, and without `..` after a folder.
pub fn normalized(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        let is_inside = matches!(normal.components().next_back(), Some(Component::Normal(_)));
        match part {
            Component::CurDir => {}
            Component::ParentDir if is_inside => {
                normal.pop();
            }
            part => normal.push(part),
        }
    }
    normal
}

/// Reads the text of a manifest, or returns the reason why it cannot be read.
fn read_text(path: &Path) -> Result<String, String> {
    let bytes = read_regular(path, MAX_BYTES).map_err(|error| error.to_string())?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count();
        format!("line {line} is not UTF-8")
    })
}

/// Adds help to the problem of a path without its ending `.toml`.
fn with_suggestion(problem: Problem, path: &Path) -> Problem {
    let with_ending = path.with_extension("toml");
    if path.extension().is_none() && with_ending.is_file() {
        problem.help(format!("did you mean `{}`?", with_ending.display()))
    } else {
        problem
    }
}

/// Returns whether a file is a manifest with a study of this name.
pub fn names_study(manifest: &Path, name: &str) -> bool {
    let Ok(text) = read_text(manifest) else {
        return false;
    };
    let (document, _) = DeTable::parse_recoverable(&text);
    let study = document.get_ref().get("study");
    let own = study.and_then(|study| study.get_ref().get("name"));
    own.and_then(|own| own.get_ref().as_str()) == Some(name)
}

/// Returns the value of `extends` in the text of a manifest with its position.
fn extended_by(text: &str) -> Option<(String, Span)> {
    let (document, _) = DeTable::parse_recoverable(text);
    let extends = document.get_ref().get("study")?.get_ref().get("extends")?;
    Some((extends.get_ref().as_str()?.to_owned(), extends.span()))
}

/// Removes `extends` and `remove` from the table `[study]`, and returns the paths in `remove`.
/// Reports values of another type, and settings of these keys.
fn take_study_keys(
    document: &mut DeTable<'_>,
    is_setting: bool,
    problems: &mut Problems,
) -> Vec<TomlSpanned<String>> {
    let Some(study) = document.get_mut("study") else {
        return Vec::new();
    };
    let DeValue::Table(study) = study.get_mut() else {
        return Vec::new();
    };
    let [extends, removed] = ["extends", "remove"].map(|key| study.remove(key));
    if let Some(value) = extends.iter().chain(&removed).next().filter(|_| is_setting) {
        let message = "`extends` and `remove` cannot be set";
        problems.push(Problem::new(message, value.span(), "belongs into a manifest"));
        return Vec::new();
    }
    if let Some(value) = extends.filter(|value| !value.get_ref().is_str()) {
        let message = "`extends` must be the path of a manifest in quotes";
        problems.push(Problem::new(message, value.span(), found(value.get_ref())));
    }
    let Some(removed) = removed else {
        return Vec::new();
    };
    let items = match removed.get_ref() {
        DeValue::Array(items) => items.iter().cloned().collect(),
        _ => vec![removed],
    };
    let path = |item: TomlSpanned<DeValue>| match item.get_ref().as_str() {
        Some(path) => Some(TomlSpanned::new(item.span(), path.to_owned())),
        None => {
            let message = "`remove` must be a list of keys in quotes";
            let label = found(item.get_ref());
            let problem = Problem::new(message, item.span(), label);
            problems.push(problem.help("such as `remove = [\"stage.surfaces.k_rolloff\"]`"));
            None
        }
    };
    items.into_iter().filter_map(path).collect()
}

fn report_nothing_to_remove(removed: &[TomlSpanned<String>], problems: &mut Problems) {
    if let Some(path) = removed.first() {
        let message = "`remove` needs `extends`";
        let problem = Problem::new(message, path.span(), "there is nothing to remove it from");
        problems.push(problem.help("it removes keys of the manifest that `extends` names"));
    }
}

/// Removes a value from the extended manifests, given its path, such as `stage.surfaces.hurst`.
fn remove(merged: &mut DeTable<'_>, path: &TomlSpanned<String>, problems: &mut Problems) {
    let mut parts: Vec<&str> = path.get_ref().split('.').map(str::trim).collect();
    let last = parts.pop().unwrap_or_default();
    let mut table = merged;
    for part in parts {
        if !matches!(table.get(part).map(TomlSpanned::get_ref), Some(DeValue::Table(_))) {
            return problems.push(nothing_at(path, part, table));
        }
        let Some(DeValue::Table(inner)) = table.get_mut(part).map(TomlSpanned::get_mut) else {
            return;
        };
        table = inner;
    }
    if table.remove(last).is_none() {
        problems.push(nothing_at(path, last, table));
    }
}

fn nothing_at(path: &TomlSpanned<String>, part: &str, table: &DeTable<'_>) -> Problem {
    let message = format!("the extended manifest has no `{}`", path.get_ref());
    let known: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
    let label = suggestion('`', part, known, &format!("there is no `{part}`"));
    Problem::new(message, path.span(), label)
}

/// Returns whether the manifest has the stage of a setting. Reports a problem if not.
fn has_stages(merged: &DeTable<'_>, setting: &DeTable<'_>, problems: &mut Problems) -> bool {
    fn stages<'t>(table: &'t DeTable<'_>) -> impl Iterator<Item = &'t TomlSpanned<DeString<'t>>> {
        let stages = table.get("stage").and_then(|stages| stages.get_ref().as_table());
        stages.into_iter().flat_map(|stages| stages.keys())
    }
    let known: Vec<&str> = stages(merged).map(|name| name.get_ref().as_ref()).collect();
    let is_known = |name: &&TomlSpanned<DeString>| known.contains(&name.get_ref().as_ref());
    let problem = if let Some(name) = stages(setting).find(|name| !is_known(name)) {
        let message = format!("the manifest has no stage `{}`", name.get_ref());
        let label = suggestion('`', name.get_ref(), known.iter().copied(), "unknown stage");
        Problem::new(message, name.span(), label)
    } else if let Some(stage) = setting.keys().find(is_known) {
        let label = format!("write `stage.{}`", stage.get_ref());
        Problem::new("the key of a stage begins with `stage.`", stage.span(), label)
    } else {
        return true;
    };
    problems.push(problem);
    false
}

/// Removes stages without a `kind` after reporting them: they override a stage that no extended
/// manifest has.
fn remove_unknown_stages(merged: &mut DeTable<'_>, problems: &mut Problems) {
    let Some(DeValue::Table(stages)) = merged.get_mut("stage").map(TomlSpanned::get_mut) else {
        return;
    };
    let is_known = |stage: &TomlSpanned<DeValue>| match stage.get_ref() {
        DeValue::Table(keys) => keys.contains_key("kind"),
        _ => true,
    };
    let (defined, undefined): (Vec<_>, Vec<_>) =
        stages.iter().partition(|(_, stage)| is_known(stage));
    let known: Vec<String> = defined.iter().map(|(name, _)| name.get_ref().to_string()).collect();
    let unknown: Vec<_> = undefined.into_iter().map(|(name, _)| name.clone()).collect();
    let known = || known.iter().map(String::as_str);
    for name in unknown {
        stages.remove(name.get_ref().as_ref());
        let name_text = name.get_ref();
        let message = format!("no extended manifest has a stage `{name_text}`");
        let label = suggestion('`', name_text, known(), "has no `kind`");
        let help = format!("the stages are {}; a new stage needs a `kind`", listed(known(), "and"));
        problems.push(Problem::new(message, name.span(), label).help(help));
    }
}

/// Merges a manifest into the manifests that it extends. The name of a study is not inherited,
/// because the tables of two studies with the same name would be in the same folder.
fn extend<'i>(merged: &mut DeTable<'i>, mut document: DeTable<'i>) {
    let mut study = DeTable::new();
    if let Some((_, inherited)) = merged.remove_entry("study")
        && let DeValue::Table(inherited) = inherited.into_inner()
    {
        study = inherited;
        study.remove("name");
    }
    if let Some((key, value)) = document.remove_entry("study") {
        let span = value.span();
        let value = match value.into_inner() {
            DeValue::Table(own) => {
                merge(&mut study, own);
                DeValue::Table(study)
            }
            other => other,
        };
        merged.insert(key, TomlSpanned::new(span, value));
    }
    merge(merged, document);
}

/// Merges a table into another one key by key. Its values override those of the other table, except
/// that tables are merged.
fn merge<'i>(merged: &mut DeTable<'i>, table: DeTable<'i>) {
    for (key, value) in table {
        match (merged.get_mut(key.get_ref().as_ref()).map(TomlSpanned::get_mut), value.get_ref()) {
            (Some(DeValue::Table(inner)), DeValue::Table(own)) => merge(inner, own.clone()),
            _ => {
                // Inserting alone would keep the position of the overridden key.
                merged.remove(key.get_ref().as_ref());
                merged.insert(key, value);
            }
        }
    }
}

/// Returns the entries of a table in the order of their positions.
fn in_order<'t, 'i>(table: &'t DeTable<'i>) -> Vec<(&'t str, &'t TomlSpanned<DeValue<'i>>)> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries.into_iter().map(|(key, value)| (key.get_ref().as_ref(), value)).collect()
}

/// Returns a key in TOML, in quotes if it needs them.
fn key_text(key: &str) -> String {
    let is_bare = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '-');
    if !key.is_empty() && key.chars().all(is_bare) {
        key.to_owned()
    } else {
        toml::Value::from(key).to_string()
    }
}

#[cfg(test)]
mod tests;
