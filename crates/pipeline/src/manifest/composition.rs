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
use toml::de::{DeTable, DeValue, Error};

use super::setting::Setting;
use super::syntax::report_syntax;
use asperity_manifest::diagnostics::{
    ManifestErrors, Problem, Problems, SourceText, Span, listed, suggestion,
};
use asperity_manifest::keys::values::found;
use asperity_tables::store::regular::read_regular;

/// Maximum size of a manifest in bytes.
const MAX_BYTES: u64 = 4 << 20;

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

impl Composition {
    /// Reads a manifest and the manifests that it extends.
    ///
    /// # Errors
    /// Returns an error if one of the manifests cannot be read, or if manifests extend each other.
    pub fn read(path: &Path, settings: &[Setting]) -> Result<Composition, ManifestErrors> {
        let file = path.display().to_string();
        let text = read_text(path).map_err(|reason| {
            let message = format!("cannot read manifest `{file}`: {reason}");
            let mut problems = Problems::default();
            problems.push(Problem::without_position(message));
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
        let mut texts = vec![(file.to_owned(), text)];
        let mut bases: Vec<PathBuf> = Vec::new();
        let mut seen: BTreeSet<PathBuf> =
            own.and_then(|path| fs::canonicalize(path).ok()).into_iter().collect();
        let mut unread = None;
        while let Some((base, span)) = extended_by(&texts[bases.len()].1) {
            let extending = bases.last().and_then(|path| path.parent()).unwrap_or(Path::new(""));
            let path = normalized(&extending.join(&base));
            let full = folder.join(&path);
            let is_new = fs::canonicalize(&full).is_ok_and(|canonical| seen.insert(canonical));
            match read_text(&full) {
                Ok(text) if is_new => texts.push((full.display().to_string(), text)),
                Ok(_) => {
                    let message = format!("`{base}` is extended by itself");
                    let label = "leads back to a manifest that extends this one";
                    unread = Some(Problem::new(message, span, label));
                    break;
                }
                Err(reason) => {
                    let message = format!("cannot read manifest `{}`: {reason}", full.display());
                    unread = Some(Problem::new(message, span, "extended here"));
                    break;
                }
            }
            bases.push(path);
        }
        let mut sources: Vec<Source> = Vec::new();
        for (name, text) in texts.into_iter().rev() {
            sources.push(Source::after(sources.last(), name, &text, false));
        }
        let unread = unread.map(|problem| problem.shifted(sources[0].start));
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
                    if let Some(path) = removed.first() {
                        let message = "`remove` needs `extends`";
                        let label = "there is nothing to remove it from";
                        problems.push(Problem::new(message, path.span(), label));
                    }
                    merged = Some(document);
                }
                Some(merged) if source.is_setting => merge(merged, document),
                Some(merged) => {
                    removed.iter().for_each(|path| remove(merged, path, problems));
                    extend(merged, document);
                }
            }
        }
        let mut document = merged.filter(|_| is_valid)?;
        if self.sources.len() > 1 {
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
    String::from_utf8(bytes).map_err(|error| error.to_string())
}

/// Returns the name of the study of a manifest, if it has one.
pub fn study_name<'t>(document: &'t DeTable<'_>) -> Option<&'t str> {
    document.get("study")?.get_ref().get("name")?.get_ref().as_str()
}

/// Returns whether a file is a manifest with a study of this name.
pub fn names_study(manifest: &Path, name: &str) -> bool {
    let text = read_text(manifest).unwrap_or_default();
    study_name(DeTable::parse_recoverable(&text).0.get_ref()) == Some(name)
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
    let Some(DeValue::Table(study)) = document.get_mut("study").map(TomlSpanned::get_mut) else {
        return Vec::new();
    };
    let [extends, removed] = ["extends", "remove"].map(|key| study.remove(key));
    if let Some(value) = extends.iter().chain(&removed).next().filter(|_| is_setting) {
        let message = "`extends` and `remove` cannot be set";
        problems.push(Problem::new(message, value.span(), "belongs into a manifest"));
        return Vec::new();
    }
    let mut text = |what: &str, value: TomlSpanned<DeValue>| match value.get_ref().as_str() {
        Some(text) => Some(TomlSpanned::new(value.span(), text.to_owned())),
        None => {
            problems.push(Problem::new(what, value.span(), found(value.get_ref())));
            None
        }
    };
    if let Some(value) = extends {
        text("`extends` must be the path of a manifest in quotes", value);
    }
    let items = match removed.map(|removed| (removed.span(), removed.into_inner())) {
        Some((_, DeValue::Array(items))) => items.into_iter().collect(),
        Some((span, item)) => vec![TomlSpanned::new(span, item)],
        None => Vec::new(),
    };
    let texts = items.into_iter();
    texts.filter_map(|item| text("`remove` must be a list of keys in quotes", item)).collect()
}

/// Removes a value from the extended manifests, given its path, such as `stage.surfaces.hurst`.
fn remove(merged: &mut DeTable<'_>, path: &TomlSpanned<String>, problems: &mut Problems) {
    let mut parts: Vec<&str> = path.get_ref().split('.').map(str::trim).collect();
    let last = parts.pop().unwrap_or_default();
    let mut table = merged;
    for part in parts {
        // The table is looked up twice, because the borrow would last otherwise.
        if table.get(part).is_none_or(|inner| !inner.get_ref().is_table()) {
            return problems.push(nothing_at(path, part, table));
        }
        let inner = table.get_mut(part).map(TomlSpanned::get_mut);
        let Some(DeValue::Table(inner)) = inner else { unreachable!("it is a table") };
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

/// Removes stages without a `kind` after reporting them: they override a stage that no extended
/// manifest has.
fn remove_unknown_stages(merged: &mut DeTable<'_>, problems: &mut Problems) {
    let Some(DeValue::Table(stages)) = merged.get_mut("stage").map(TomlSpanned::get_mut) else {
        return;
    };
    let is_defined = |stage: &TomlSpanned<DeValue>| {
        stage.get_ref().as_table().is_none_or(|keys| keys.contains_key("kind"))
    };
    let defined = stages.iter().filter(|(_, stage)| is_defined(stage));
    let known: Vec<String> = defined.map(|(name, _)| name.get_ref().to_string()).collect();
    let known = || known.iter().map(String::as_str);
    for (name, _) in stages.clone().into_iter().filter(|(_, stage)| !is_defined(stage)) {
        stages.remove(name.get_ref().as_ref());
        let message = format!("no extended manifest has a stage `{}`", name.get_ref());
        let label = suggestion('`', name.get_ref(), known(), "has no `kind`");
        let help = format!("the stages are {}; a new stage needs a `kind`", listed(known(), "and"));
        problems.push(Problem::new(message, name.span(), label).help(help));
    }
}

/// Merges a manifest into the manifests that it extends. The name of a study is not inherited,
/// because the tables of two studies with the same name would be in the same folder.
fn extend<'i>(merged: &mut DeTable<'i>, mut document: DeTable<'i>) {
    let inherited = merged.remove("study").map(TomlSpanned::into_inner);
    let own = document.get_mut("study").map(TomlSpanned::get_mut);
    if let (Some(DeValue::Table(mut study)), Some(DeValue::Table(own))) = (inherited, own) {
        study.remove("name");
        merge(&mut study, std::mem::take(own));
        *own = study;
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
