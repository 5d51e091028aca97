//! Tasks as people name them: by their key, or by as many of its digits as tell it from others.

use super::{Data, Failure, Misused};
use crate::diagnostics::listed;
use crate::plan::Plan;
use crate::store::Store;
use crate::store::key::TaskKey;

/// Fewer digits are no name, even where they happen to tell one task from all others.
const FEWEST_DIGITS: usize = 4;

/// The finished task that is meant.
///
/// # Errors
/// When the word is no key, or no finished task has it, or several have.
pub fn finished(word: &str, store: &Store, data: &Data) -> Result<TaskKey, Failure> {
    let digits = digits(word)?;
    let key = only(&digits, store.finished(&digits)?)?;
    key.ok_or_else(|| format!("no task {word} is finished in `{}`", data.store().display()).into())
}

/// The task of a study that is meant, finished or not.
///
/// # Errors
/// When the word is no key, or no task of the study has it, or several have.
pub fn planned(word: &str, plan: &Plan) -> Result<usize, Failure> {
    let key = only(&digits(word)?, plan.keys())?;
    let task = key.and_then(|key| plan.task_of(key));
    task.ok_or_else(|| Misused(format!("`{}` has no task {word}", plan.study)).into())
}

/// A word as digits of a key.
fn digits(word: &str) -> Result<String, Misused> {
    let is_hexadecimal = word.bytes().all(|byte| byte.is_ascii_hexdigit());
    if !is_hexadecimal || word.len() < FEWEST_DIGITS {
        let key = word.parse::<TaskKey>();
        key.map_err(|error| Misused(error.to_string()))?;
    }
    Ok(word.to_ascii_lowercase())
}

/// The one of the keys that begins with these digits, if any does.
fn only(digits: &str, keys: impl IntoIterator<Item = TaskKey>) -> Result<Option<TaskKey>, Misused> {
    let keys = keys.into_iter().map(|key| (key, key.to_string()));
    let meant: Vec<_> = keys.filter(|(_, key)| key.starts_with(digits)).collect();
    match meant.as_slice() {
        [] => Ok(None),
        [(key, _)] => Ok(Some(*key)),
        several => {
            let several = listed(several.iter().map(|(_, key)| key.as_str()), "and");
            let message = format!("`{digits}` begins the keys of several tasks: {several}");
            Err(Misused(message))
        }
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
        assert!(
            refused.contains(KEYS[0]) && refused.contains(KEYS[1]),
            "{refused}"
        );
        assert!(!refused.contains(KEYS[2]), "{refused}");
    }

    #[test]
    fn words_that_are_no_digits_and_too_few_digits_are_no_keys() {
        for word in ["", "fed", "../etc", "fedcx"] {
            let refused = among_keys(word).unwrap_err();
            assert!(
                refused.starts_with(&format!("`{word}` is no key")),
                "{refused}"
            );
        }
    }
}
