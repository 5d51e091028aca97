//! Words that people use for keys which have other names, or for physics that is not modelled.

use std::sync::LazyLock;

use serde::Deserialize;

use crate::diagnostics::{Problem, Span};

/// Words for one key, or for one subject that the program does not model.
#[derive(Deserialize)]
struct Synonyms {
    words: Vec<String>,
    /// Keys that do what is wanted; the first one that the table has is suggested.
    keys: Vec<String>,
    help: String,
}

#[derive(Deserialize)]
struct AllSynonyms {
    synonyms: Vec<Synonyms>,
}

static SYNONYMS: LazyLock<Vec<Synonyms>> = LazyLock::new(|| {
    let read = toml::from_str::<AllSynonyms>(include_str!("synonyms.toml"));
    read.expect("the file is valid").synonyms
});

/// Returns the problem of an unknown key that is a known word, and the key that does what is
/// wanted. `has` says whether the table has a key.
pub fn answer(
    message: &str,
    key: &str,
    span: Span,
    has: impl Fn(&str) -> bool,
) -> Option<(Problem, Option<&'static str>)> {
    let folded = key.to_lowercase().replace('-', "_");
    let Synonyms { keys, help, .. } = SYNONYMS.iter().find(|one| one.words.contains(&folded))?;
    let key = keys.iter().map(String::as_str).find(|key| has(key));
    let (label, help) = match key {
        Some(key) => (format!("use `{key}`"), help.clone()),
        None if keys.is_empty() => {
            ("not modelled".to_owned(), format!("{help}; see “What it cannot do” in the guide"))
        }
        None => ("belongs to another table".to_owned(), help.clone()),
    };
    Some((Problem::new(message, span, label).help(help), key))
}

/// Returns all words.
pub fn words() -> impl Iterator<Item = &'static str> {
    SYNONYMS.iter().flat_map(|one| &one.words).map(String::as_str)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_word_has_one_answer() {
        let distinct: BTreeSet<_> = words().collect();
        assert_eq!(distinct.len(), words().count());
    }

    #[test]
    fn the_first_key_that_the_table_has_is_suggested() {
        for (has, expected) in [
            (&["bodies"][..], Some("bodies")),
            (&["poisson_ratio", "bodies"], Some("poisson_ratio")),
            (&["loads"], None),
        ] {
            let found = answer("", "Nu", Span::default(), |key| has.contains(&key));
            assert_eq!(found.unwrap().1, expected);
        }
    }
}
