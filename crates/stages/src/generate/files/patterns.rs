//! Patterns of paths: `*`, `?`, and `{name}`, whose text in the path of a file is a label.

use std::path::Path;

use regex::Regex;

use crate::surface_files::SurfaceFiles;

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
