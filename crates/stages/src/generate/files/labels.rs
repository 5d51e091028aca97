//! The files that `path` names, and the labels of each.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use regex::Regex;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::generate::files::FileTable;
use crate::surface::labels;
use crate::surface::planned::PlannedSurfaces;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, columns_of};
use asperity_manifest::diagnostics::{Problem, Problems, Span, counted};
use asperity_manifest::keys::{GridPoint, KeyTable, Section, Spanned, deserialize_either};
use asperity_tables::column::{ColumnKind, Value};

/// Labels of files, the value of `labels`.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenLabels {
    /// The value of each label.
    Table(BTreeMap<String, Spanned<LabelValue>>),
    /// A CSV file with a line for each file.
    File(String),
}

deserialize_either!(WrittenLabels { table => Table, word => File });

/// Value of a label.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LabelValue {
    Integer(i64),
    Real(f64),
    Text(String),
}

impl LabelValue {
    fn value(&self) -> Value {
        match self {
            LabelValue::Integer(number) => Value::Integer(*number),
            LabelValue::Real(number) => Value::Real(*number),
            LabelValue::Text(text) => Value::Text(text.clone()),
        }
    }
}

/// Moves the keys of cases that are no slips of keys of the stage into the `labels` of the case.
pub fn with_labels_of_cases(mut table: DeTable<'_>) -> DeTable<'_> {
    let Some((_, value)) = table.iter_mut().find(|(key, _)| key.get_ref() == "cases") else {
        return table;
    };
    let DeValue::Array(cases) = value.get_mut() else { return table };
    for case in cases.iter_mut() {
        let span = case.span();
        let DeValue::Table(entries) = case.get_mut() else { continue };
        let layout = FileTable::layout();
        let is_own = |name: &str| layout.has(name) || layout.keys().any(|key| is_slip(name, key));
        let (mut own, mut labels) = (DeTable::new(), DeTable::new());
        for (key, value) in std::mem::take(entries) {
            let is_plain = !matches!(value.get_ref(), DeValue::Table(_) | DeValue::Array(_));
            let is_own = is_own(key.get_ref()) || !is_plain || !is_label(key.get_ref());
            if is_own {
                own.insert(key, value)
            } else {
                labels.insert(key, value)
            };
        }
        let given = own.iter_mut().find(|(key, _)| key.get_ref() == "labels");
        match given.map(|(_, value)| value.get_mut()) {
            _ if labels.is_empty() => {}
            Some(DeValue::Table(given)) => given.extend(labels),
            // The keys are then reported as unknown.
            Some(_) => own.extend(labels),
            None => {
                let name = TomlSpanned::new(span.clone(), DeString::from("labels"));
                own.insert(name, TomlSpanned::new(span, DeValue::Table(labels)));
            }
        }
        *entries = own;
    }
    table
}

/// Refuses labels with the names of columns, because two columns of a table cannot have one name.
pub fn check_names(
    section: &Section<FileTable>,
    surfaces: &[PlannedSurfaces],
    problems: &mut Problems,
) -> Option<()> {
    let mut labels = surfaces.iter().filter_map(|one| one.params.origin.labels());
    let columns = || Kind::ALL.into_iter().flat_map(columns_of);
    let is_taken = |name: &str| {
        labels::parameter_of_random_surfaces(name).is_none()
            && (["path", "task"].contains(&name) || columns().any(|column| column.name == name))
    };
    let taken = labels.find_map(|labels| labels.values.keys().find(|name| is_taken(name)));
    let Some(taken) = taken else { return Some(()) };
    let written = || section.points.iter().filter_map(|point| point.table.labels.written());
    let of_name = written().find_map(|labels| match &labels.value {
        WrittenLabels::Table(values) => values.get(taken).map(|value| &value.span),
        WrittenLabels::File(_) => Some(&labels.span),
    });
    let path = || section.points.first()?.table.path.written().map(|path| &path.span);
    let span = of_name.or_else(path).unwrap_or(&section.span).clone();
    let message = format!("a label cannot be called `{taken}`");
    let label = "name of another column of the tables";
    problems.push(Problem::new(message, span, label).help("choose another word"));
    None
}

/// Returns whether a word is a key in other letters, or with one letter too many, too few, swapped
/// or wrong. A short word with another letter is another word: `site` is not `side`.
fn is_slip(word: &str, key: &str) -> bool {
    let letters = |text: &str| text.to_lowercase().replace('-', "_").chars().collect::<Vec<_>>();
    let (word, key) = (letters(word), letters(key));
    let common = word.iter().zip(&key).take_while(|(one, other)| one == other).count();
    match (&word[common..], &key[common..]) {
        ([], []) => true,
        ([_, rest @ ..], other) if rest == other => true,
        (other, [_, rest @ ..]) if rest == other => true,
        ([a, b, rest @ ..], [c, d, more @ ..]) if (a, b) == (d, c) => rest == more,
        ([_, rest @ ..], [_, more @ ..]) => rest == more && word.len() > 4,
        _ => false,
    }
}

/// Points of a stage with one file each, and the labels of each file.
pub struct LabelledFiles {
    pub section: Section<FileTable>,
    pub labels: Vec<BTreeMap<String, Value>>,
}

/// A label before its type is known: labels from paths and from CSV files are words.
enum Word {
    Value(Value),
    Text(String),
}

impl LabelledFiles {
    /// Replaces patterns of paths by the files that match them, and collects the labels of each
    /// file. Returns `None` after reporting problems.
    pub fn new(
        section: &Section<FileTable>,
        sources: &mut SurfaceFiles,
        problems: &mut Problems,
    ) -> Option<LabelledFiles> {
        let mut lists: BTreeMap<&str, List> = BTreeMap::new();
        let (mut points, mut labels) = (Vec::new(), Vec::new());
        let mut is_clear = true;
        for point in &section.points {
            let Some(path) = point.table.path.written() else {
                points.push(GridPoint { table: point.table.clone(), span: point.span.clone() });
                labels.push((BTreeMap::new(), point.span.clone()));
                continue;
            };
            let files = match files(path, sources) {
                Ok(files) => files,
                Err(problem) => {
                    problems.push(problem);
                    is_clear = false;
                    continue;
                }
            };
            for (file, of_path) in files {
                let words = of_path.into_iter().map(|(name, text)| (name, Word::Text(text)));
                let mut own: BTreeMap<String, Word> = words.collect();
                let written = point.table.labels.written();
                let more = match written.map(|labels| (&labels.value, &labels.span)) {
                    None => Ok(Vec::new()),
                    Some((WrittenLabels::Table(table), _)) => Ok(table
                        .iter()
                        .map(|(name, value)| (name.clone(), Word::Value(value.value.value())))
                        .collect()),
                    Some((WrittenLabels::File(list), span)) => lists
                        .entry(list)
                        .or_insert_with(|| List::read(list, sources))
                        .of_file(&file)
                        .map_err(|reason| Problem::new(reason, span.clone(), "list of labels")),
                };
                for (name, word) in more.unwrap_or_else(|problem| {
                    problems.push(problem);
                    is_clear = false;
                    Vec::new()
                }) {
                    if own.insert(name.clone(), word).is_some() {
                        let message = format!("the label `{name}` is given twice");
                        let label = "a placeholder has this name";
                        problems.push(Problem::new(message, path.span.clone(), label));
                        is_clear = false;
                    }
                }
                let mut table = point.table.clone();
                let span = path.span.clone();
                table.path.0 = Some(Spanned { value: file, span: span.clone() });
                points.push(GridPoint { table, span: point.span.clone() });
                labels.push((own, span));
            }
            if problems.is_full() {
                return None;
            }
        }
        let labels = typed(labels, problems).filter(|_| is_clear)?;
        let section = Section {
            span: section.span.clone(),
            points,
            reported_keys: section.reported_keys.clone(),
            may_be_swept: section.may_be_swept,
            units: section.units.clone(),
        };
        Some(LabelledFiles { section, labels })
    }
}

/// Returns the files that a path names, each with the labels in its path.
#[expect(clippy::type_complexity, reason = "a path with its labels")]
fn files(
    path: &Spanned<String>,
    sources: &SurfaceFiles,
) -> Result<Vec<(String, Vec<(String, String)>)>, Problem> {
    let Spanned { value, span } = path;
    if !is_pattern(value) || sources.has(Path::new(value)) {
        return Ok(vec![(value.clone(), Vec::new())]);
    }
    if let Some(mistake) = mistake(value) {
        let message = format!("cannot use the pattern {value:?}: {mistake}");
        let help = "a placeholder such as `{specimen}` is a word of letters, digits and `_`";
        return Err(Problem::new(message, span.clone(), "pattern of files").help(help));
    }
    let found = matching(value, sources);
    if found.is_empty() {
        let message = format!("no file matches {value:?}");
        let help = "the pattern is relative to the manifest; `*` stands for any text, `?` for one \
                    character, and `{specimen}` for text that becomes a label";
        return Err(Problem::new(message, span.clone(), "pattern of files").help(help));
    }
    Ok(found.into_iter().map(|file| (file.path, file.labels)).collect())
}

/// Returns the labels of all files with their types. The words of a label become integers or real
/// numbers if all of them are such numbers as they would be written.
fn typed(
    labels: Vec<(BTreeMap<String, Word>, Span)>,
    problems: &mut Problems,
) -> Option<Vec<BTreeMap<String, Value>>> {
    let names: BTreeSet<&String> = labels.iter().flat_map(|(own, _)| own.keys()).collect();
    let mut kinds: BTreeMap<String, ColumnKind> = BTreeMap::new();
    for name in names {
        let own = || labels.iter().filter_map(|(own, span)| Some((own.get(name)?, span)));
        let texts = own().filter_map(|(word, _)| match word {
            Word::Text(text) => Some(text.as_str()),
            Word::Value(_) => None,
        });
        let words: Vec<&str> = texts.collect();
        let of_words = (!words.is_empty()).then(|| Some(kind_of(&words)));
        let of_values = own().filter_map(|(word, _)| match word {
            Word::Text(_) => None,
            Word::Value(Value::Integer(_)) => Some(Some(ColumnKind::Integer)),
            Word::Value(Value::Real(_)) => Some(Some(ColumnKind::Real)),
            Word::Value(Value::Text(_)) => Some(Some(ColumnKind::Text)),
        });
        let kind = of_values.chain(of_words).reduce(|one, other| common(one?, other?)).flatten();
        let parameter = labels::parameter_of_random_surfaces(name).map(|parameter| parameter.kind);
        let message = match (kind, parameter) {
            (None, _) => format!("the label `{name}` is a number in one place and text in another"),
            (Some(kind), Some(parameter)) if common(kind, parameter) != Some(parameter) => {
                format!("the label `{name}` must be a number like the parameter of random surfaces")
            }
            (Some(kind), parameter) => {
                kinds.insert(name.clone(), parameter.unwrap_or(kind));
                continue;
            }
        };
        let (_, span) = own().next_back()?;
        problems.push(Problem::new(message, span.clone(), "has this label"));
    }
    let value = |name: &str, word: Word| {
        Some(match (word, kinds.get(name)?) {
            (Word::Value(Value::Integer(number)), ColumnKind::Real) => Value::Real(number as f64),
            (Word::Value(value), _) => value,
            (Word::Text(text), ColumnKind::Integer) => {
                text.parse().map_or(Value::Text(text), Value::Integer)
            }
            (Word::Text(text), ColumnKind::Real) => {
                text.parse().map_or(Value::Text(text), Value::Real)
            }
            (Word::Text(text), _) => Value::Text(text),
        })
    };
    let of_file = |(own, _): (BTreeMap<String, Word>, Span)| {
        let typed = own.into_iter().map(|(name, word)| {
            let value = value(&name, word)?;
            Some((name, value))
        });
        typed.collect()
    };
    labels.into_iter().map(of_file).collect()
}

/// Returns the type that holds values of two types, if there is one.
fn common(one: ColumnKind, other: ColumnKind) -> Option<ColumnKind> {
    match (one, other) {
        _ if one == other => Some(one),
        (ColumnKind::Integer, ColumnKind::Real) | (ColumnKind::Real, ColumnKind::Integer) => {
            Some(ColumnKind::Real)
        }
        _ => None,
    }
}

/// Returns the type of words. Numbers with leading zeros, such as `007`, are text.
fn kind_of(words: &[&str]) -> ColumnKind {
    let is_padded = |word: &&str| {
        let digits = word.strip_prefix('-').unwrap_or(word);
        let mut letters = digits.chars();
        letters.next() == Some('0') && letters.next().is_some_and(|next| next.is_ascii_digit())
    };
    let is_real = |word: &&str| {
        word.starts_with(|first: char| first.is_ascii_digit() || first == '-')
            && word.parse::<f64>().is_ok_and(f64::is_finite)
    };
    if words.iter().any(is_padded) || !words.iter().all(is_real) {
        ColumnKind::Text
    } else if words.iter().all(|word| word.parse::<i64>().is_ok()) {
        ColumnKind::Integer
    } else {
        ColumnKind::Real
    }
}

/// A CSV file with the labels of files, or the reason why it cannot be used.
struct List(Result<Vec<BTreeMap<String, String>>, String>);

/// Names of the column with the path or the name of the file.
const FILE_COLUMNS: [&str; 2] = ["path", "file"];

impl List {
    fn read(path: &str, sources: &mut SurfaceFiles) -> List {
        let read = sources.add(Path::new(path)).map_err(|error| error.to_string());
        let text = read.and_then(|(_, bytes)| {
            String::from_utf8(bytes).map_err(|_| "it is not a text in UTF-8".to_owned())
        });
        let lines = text.and_then(|text| lines(&text));
        List(lines.map_err(|reason| format!("cannot read the labels in {path:?}: {reason}")))
    }

    /// Returns the labels of a file: those of the line with its path, or with its name.
    fn of_file(&self, file: &str) -> Result<Vec<(String, Word)>, String> {
        let lines = self.0.as_ref().map_err(Clone::clone)?;
        let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy();
        let of = |wanted: &str| -> Vec<_> {
            let is_wanted = |line: &&BTreeMap<String, String>| {
                FILE_COLUMNS.iter().any(|column| line.get(*column).is_some_and(|own| own == wanted))
            };
            lines.iter().filter(is_wanted).collect()
        };
        let by_path = of(file);
        let found = if by_path.is_empty() { of(&name) } else { by_path };
        let [line] = found[..] else {
            let count = if found.is_empty() { "no line" } else { "several lines" };
            return Err(format!("the list of labels has {count} for {file:?}"));
        };
        let own = line
            .iter()
            .filter(|(name, text)| !FILE_COLUMNS.contains(&name.as_str()) && !text.is_empty());
        Ok(own.map(|(name, text)| (name.clone(), Word::Text(text.clone()))).collect())
    }
}

/// Reads the lines of a CSV file with a header, by the names of the columns.
fn lines(text: &str) -> Result<Vec<BTreeMap<String, String>>, String> {
    let plain = text.trim_start_matches('\u{feff}');
    let mut written =
        plain.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let header = written.next().ok_or("it is empty")?;
    let separator = [';', '\t'].into_iter().find(|&one| header.contains(one)).unwrap_or(',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator as u8)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(plain.as_bytes());
    let names = reader.headers().map_err(|error| error.to_string())?.clone();
    if !names.iter().any(|name| FILE_COLUMNS.contains(&name)) {
        return Err("it has no column `path` or `file`".to_owned());
    }
    for (index, name) in names.iter().enumerate() {
        if names.iter().take(index).any(|other| other == name) {
            return Err(format!("the column `{name}` exists twice"));
        }
        if !FILE_COLUMNS.contains(&name) && !is_label(name) {
            return Err(format!("`{name}` is no name of a label: use letters, digits and `_`"));
        }
    }
    // Programs that separate by semicolons write decimal commas.
    let number = |cell: &str| {
        let pointed = cell.replace(',', ".");
        let is_number = separator == ';' && pointed.parse::<f64>().is_ok();
        if is_number { pointed } else { cell.to_owned() }
    };
    let line = |record: Result<csv::StringRecord, csv::Error>| {
        let cells = record.map_err(|error| error.to_string())?;
        if cells.len() != names.len() {
            let line = cells.iter().collect::<Vec<_>>().join(&separator.to_string());
            let (found, wanted) = (counted(cells.len(), "cell"), names.len());
            return Err(format!("the line {line:?} has {found}, not {wanted}"));
        }
        Ok(names.iter().map(str::to_owned).zip(cells.iter().map(number)).collect())
    };
    reader.records().map(line).collect()
}

/// File that a pattern matches.
#[derive(Debug, PartialEq)]
pub struct MatchedFile {
    /// Path relative to the manifest.
    pub path: String,
    /// Text of each placeholder, by name.
    pub labels: Vec<(String, String)>,
}

/// Returns whether a path is a pattern.
pub fn is_pattern(path: &str) -> bool {
    path.contains(['*', '?', '{'])
}

/// Returns what is wrong with a pattern, if anything is.
pub fn mistake(pattern: &str) -> Option<String> {
    let mut names = Vec::new();
    let mut rest = pattern;
    while let Some((before, after)) = rest.split_once('{') {
        let closed = after.split_once('}');
        let Some((name, next)) = closed.filter(|_| !before.contains('}')) else {
            return Some("a `{` lacks its `}`".to_owned());
        };
        if !is_label(name) {
            return Some(format!("`{{{name}}}` does not have the name of a label"));
        }
        if names.contains(&name) {
            return Some(format!("`{{{name}}}` is there twice"));
        }
        names.push(name);
        rest = next;
    }
    rest.contains('}').then(|| "a `}` lacks its `{`".to_owned())
}

/// Returns whether a word can be the name of a label: letters, digits and `_`, with a letter first.
pub fn is_label(name: &str) -> bool {
    let rest = name.strip_prefix(|first: char| first.is_ascii_alphabetic());
    rest.is_some_and(|rest| {
        rest.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
    })
}

/// Returns the files that a pattern matches, sorted by path.
///
/// `*` stands for any text within a folder or file, `{name}` for any text that is not empty, and
/// `?` for one character. A placeholder takes the shortest text with which the rest matches. Hidden
/// files match only patterns that start with a dot.
pub fn matching(pattern: &str, sources: &SurfaceFiles) -> Vec<MatchedFile> {
    let start = if pattern.starts_with('/') { "/" } else { "" };
    let mut found = vec![MatchedFile { path: start.to_owned(), labels: Vec::new() }];
    for part in pattern.split('/').filter(|part| !part.is_empty()) {
        let expression = expression(part);
        let below = |folder: MatchedFile| {
            let inside = |name: &str| match folder.path.as_str() {
                "" | "/" => format!("{}{name}", folder.path),
                path => format!("{path}/{name}"),
            };
            if !is_pattern(part) {
                return vec![MatchedFile { path: inside(part), labels: folder.labels }];
            }
            let names = sources.names_in(Path::new(&folder.path)).into_iter();
            let entry = |name: String| {
                let is_hidden = name.starts_with('.') && !part.starts_with('.');
                let own = labels(&expression, &name).filter(|_| !is_hidden)?;
                let labels = [folder.labels.clone(), own].concat();
                Some(MatchedFile { path: inside(&name), labels })
            };
            names.filter_map(entry).collect()
        };
        found = found.into_iter().flat_map(below).collect();
    }
    found.retain(|file| sources.has(Path::new(&file.path)));
    found.sort_by(|one, other| one.path.cmp(&other.path));
    found
}

/// Returns the regular expression of a part of a pattern without mistakes. Each placeholder is a
/// group.
fn expression(pattern: &str) -> Regex {
    let mut text = "(?s)^".to_owned();
    let mut letters = pattern.chars();
    while let Some(letter) = letters.next() {
        match (letter, letters.as_str().split_once('}')) {
            ('*', _) => text += ".*?",
            ('?', _) => text += ".",
            ('{', Some((name, rest))) => {
                text += &format!("(?<{name}>.+?)");
                letters = rest.chars();
            }
            _ => text += &regex::escape(&letter.to_string()),
        }
    }
    Regex::new(&(text + "$")).expect("names of labels are names of groups")
}

/// Returns the texts of the placeholders if a name matches.
fn labels(expression: &Regex, name: &str) -> Option<Vec<(String, String)>> {
    let found = expression.captures(name)?;
    let groups = expression.capture_names().flatten();
    Some(groups.map(|group| (group.to_owned(), found[group].to_owned())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_told_from_other_words() {
        for word in ["levl", "Level", "leevl", "levvel", "lebel", "tip-radius"] {
            assert!(["level", "tip_radius"].iter().any(|key| is_slip(word, key)), "{word}");
        }
        for (word, key) in [("site", "side"), ("part", "path"), ("state", "side"), ("", "side")] {
            assert!(!is_slip(word, key), "{word}");
        }
    }

    #[test]
    fn a_list_has_one_line_for_a_file_and_one_column_for_a_label() {
        let list = |text: &str| List(lines(text));
        let of = |text: &str| list(text).of_file("scans/a.x3p").map(|labels| labels.len());
        assert_eq!(of("file;wear;note\na.x3p;0,5;\nb.x3p;1,5;x"), Ok(1));
        let found = lines("file;wear\na.x3p;0,5").unwrap();
        assert_eq!(found[0]["wear"], "0.5");
        for (text, reason) in [
            ("file,part\na.x3p,1\na.x3p,2", "several lines"),
            ("file,part\nb.x3p,1", "no line"),
            ("file,part,part\na.x3p,1,2", "`part` exists twice"),
        ] {
            assert!(of(text).unwrap_err().contains(reason), "{text}");
        }
    }

    #[test]
    fn cells_in_quotes_may_contain_separators() {
        let found = lines("# a list\nfile, note\na.x3p ,\"c, \"\"d\"\"\"\n\nb.x3p,\n").unwrap();
        assert_eq!(found.iter().map(|line| &line["note"]).collect::<Vec<_>>(), ["c, \"d\"", ""]);
    }

    #[test]
    fn words_are_numbers_only_if_all_are_written_as_such() {
        assert_eq!(kind_of(&["1", "-2"]), ColumnKind::Integer);
        assert_eq!(kind_of(&["1", "2.5e-3"]), ColumnKind::Real);
        assert_eq!(kind_of(&["0.5", "0"]), ColumnKind::Real);
        for words in [["01", "2"], ["1", "b"], ["nan", "1"], ["1", ""]] {
            assert_eq!(kind_of(&words), ColumnKind::Text, "{words:?}");
        }
    }

    #[test]
    fn a_list_of_labels_has_a_header_with_the_column_of_files() {
        let read = lines("file;specimen\na.npy;A\n\nb.npy;\"B;2\"\n").unwrap();
        assert_eq!(read[1]["specimen"], "B;2");
        assert!(lines("name,specimen\na,A").unwrap_err().contains("`path` or `file`"));
        assert!(lines("path,my label\na,A").unwrap_err().contains("`my label`"));
        assert_eq!(lines("path,b\na,A\nb").unwrap_err(), "the line \"b\" has 1 cell, not 2");
    }
}

#[cfg(test)]
mod tests_of_patterns {
    use super::*;

    #[test]
    fn placeholders_take_the_shortest_text_with_which_the_rest_matches() {
        let labels = |pattern: &str, name: &str| labels(&expression(pattern), name);
        let own = |name: &str, text: &str| (name.to_owned(), text.to_owned());
        let found = labels("{specimen}-{state}-*.x3p", "A-run-in-3.x3p").unwrap();
        assert_eq!(found, [own("specimen", "A"), own("state", "run")]);
        assert_eq!(labels("s?_{n}.npy", "s1_07.npy").unwrap(), [own("n", "07")]);
        assert_eq!(labels("*µ*", "3 µm").unwrap(), []);
        assert_eq!(labels("{a}.npy", ".npy"), None);
        assert_eq!(labels("*.npy", "a.npz"), None);
    }

    #[test]
    fn files_in_folders_are_found_in_the_order_of_their_paths() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b/2.npy", "a/10.npy", "a/1.npy", "a/.hidden.npy", "a/notes.txt"] {
            let file = folder.path().join(name);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, name).unwrap();
        }
        let sources = SurfaceFiles::new(folder.path());
        let paths = |pattern: &str| {
            let files = matching(pattern, &sources).into_iter();
            files.map(|file| file.path).collect::<Vec<_>>()
        };
        assert_eq!(paths("{specimen}/*.npy"), ["a/1.npy", "a/10.npy", "b/2.npy"]);
        assert_eq!(paths("a/?.npy"), ["a/1.npy"]);
        assert_eq!(paths("?/2.npy"), ["b/2.npy"]);
        assert!(paths("c*/1.npy").is_empty());
    }

    #[test]
    fn mistakes_in_patterns_are_named() {
        assert_eq!(mistake("a/{specimen}_*.npy"), None);
        assert_eq!(mistake("a*").as_deref(), None);
        for pattern in ["{a", "a}", "{a}{a}", "{}", "{a b}", "}{"] {
            assert!(mistake(pattern).is_some(), "{pattern}");
        }
    }
}
