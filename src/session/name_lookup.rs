//! Search for stages and claims by name, and for tasks by their key or its first digits.

use std::path::PathBuf;

use super::{DataFolder, SessionError};
use asperity_manifest::diagnostics::{did_you_mean, listed, wrapped};
use asperity_pipeline::plan::Plan;
use asperity_tables::key::TaskKey;
use asperity_tables::store::Store;

/// Error about an unknown name, with a suggestion and all known names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}{}\navailable: {}", suggestion(name, known), wrapped(&all_of(known)))]
#[non_exhaustive]
pub struct UnknownName {
    pub message: String,
    pub name: String,
    /// All names that are valid here.
    pub known: Vec<String>,
}

impl UnknownName {
    /// Creates the error with a `message` that states what is unknown.
    pub(crate) fn new(message: String, name: &str, known: &[&str]) -> UnknownName {
        UnknownName {
            message,
            name: name.to_owned(),
            known: known.iter().map(|known| (*known).to_owned()).collect(),
        }
    }
}

/// Returns the index of a stage among the stages of a study.
///
/// # Errors
/// Returns an error if there is no stage of this name.
pub(crate) fn stage(name: &str, stages: &[&str]) -> Result<usize, UnknownName> {
    let found = stages.iter().position(|known| *known == name);
    let message = || format!("the study has no stage `{name}`");
    found.ok_or_else(|| UnknownName::new(message(), name, stages))
}

/// Error in the key of a task.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TaskNameError {
    #[error(
        "`{word}` is not a key; give digits of the column `task` of a table, at least the first {}",
        MIN_DIGITS
    )]
    InvalidKey { word: String },
    #[error("the keys of several tasks begin with `{digits}`: {}; give more digits", all_of(keys))]
    Ambiguous { digits: String, keys: Vec<TaskKey> },
    #[error(
        "`{}` has no finished task {word}; give a key from the column `task` of a table",
        store.display()
    )]
    NotFinished { word: String, store: PathBuf },
    #[error("`{study}` has no task {word}; `asperity plan MANIFEST --tasks` lists all tasks")]
    NotPlanned { word: String, study: String },
}

/// Returns the key of the finished task whose key begins with `word`. `store` is that of the data
/// folder.
///
/// # Errors
/// Returns an error if the word is not hexadecimal, or if not exactly one finished task matches.
pub(crate) fn finished(
    word: &str,
    store: &Store,
    data: &DataFolder,
) -> Result<TaskKey, SessionError> {
    let digits = digits(word)?;
    let key = only(&digits, store.finished(&digits)?)?;
    let none = || TaskNameError::NotFinished { word: word.to_owned(), store: data.store() };
    Ok(key.ok_or_else(none)?)
}

/// Returns the indices of the planned tasks whose tables have the key that begins with `word`,
/// finished or not. Several tasks share a key if they compute rows of the same series.
///
/// # Errors
/// Returns an error if the word is not hexadecimal, or if not exactly one key of the study matches.
pub(crate) fn planned(word: &str, plan: &Plan) -> Result<Vec<usize>, TaskNameError> {
    let key = only(&digits(word)?, plan.keys())?.ok_or_else(|| TaskNameError::NotPlanned {
        word: word.to_owned(),
        study: plan.study.clone(),
    })?;
    Ok((0..plan.tasks.len()).filter(|&task| plan.tasks[task].table.key == key).collect())
}

fn suggestion(name: &str, known: &[String]) -> String {
    let meant = did_you_mean(name, known.iter().map(String::as_str));
    meant.map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"))
}

fn all_of(names: &[impl ToString]) -> String {
    let words: Vec<String> = names.iter().map(ToString::to_string).collect();
    listed(words.iter().map(String::as_str), "and")
}

/// Minimum number of digits that identify a task.
const MIN_DIGITS: usize = 4;

/// Parses a word as the first digits of a key.
fn digits(word: &str) -> Result<String, TaskNameError> {
    let is_hexadecimal = word.bytes().all(|byte| byte.is_ascii_hexdigit());
    if !is_hexadecimal || word.len() < MIN_DIGITS {
        return Err(TaskNameError::InvalidKey { word: word.to_owned() });
    }
    Ok(word.to_ascii_lowercase())
}

/// Returns the only key that begins with these digits, or `None` if there is none.
fn only(
    digits: &str,
    keys: impl IntoIterator<Item = TaskKey>,
) -> Result<Option<TaskKey>, TaskNameError> {
    let is_meant = |key: &TaskKey| key.to_string().starts_with(digits);
    let meant: Vec<_> = keys.into_iter().filter(is_meant).collect();
    match meant.as_slice() {
        [] => Ok(None),
        [key] => Ok(Some(*key)),
        _ => Err(TaskNameError::Ambiguous { digits: digits.to_owned(), keys: meant }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [&str; 3] = [
        "0123456789abcdef0123456789abcdef",
        "0123456789abcdef0123456789abcde0",
        "fedcba9876543210fedcba9876543210",
    ];

    fn among_keys(word: &str) -> Result<Option<String>, String> {
        let keys = KEYS.map(|key| key.parse().unwrap());
        let digits = digits(word).map_err(|error| error.to_string())?;
        let found = only(&digits, keys).map_err(|error| error.to_string())?;
        Ok(found.map(|key| key.to_string()))
    }

    #[test]
    fn a_task_is_known_by_its_key_and_by_digits_that_no_other_begins_with() {
        for word in [KEYS[2], "fedc", "FEDCBA98"] {
            assert_eq!(among_keys(word), Ok(Some(KEYS[2].to_owned())), "{word}");
        }
        assert_eq!(among_keys("abcd"), Ok(None));
    }

    #[test]
    fn digits_that_begin_several_keys_are_refused_with_these_keys() {
        let refused = among_keys("01234567").unwrap_err();
        assert!(refused.contains(KEYS[0]) && refused.contains(KEYS[1]), "{refused}");
        assert!(!refused.contains(KEYS[2]), "{refused}");
    }

    #[test]
    fn words_that_are_no_digits_and_too_few_digits_are_no_keys() {
        for word in ["", "fed", "../etc", "fedcx"] {
            let refused = among_keys(word).unwrap_err();
            assert!(refused.starts_with(&format!("`{word}` is not a key")), "{refused}");
            assert!(refused.ends_with("at least the first 4"), "{refused}");
        }
    }
}
