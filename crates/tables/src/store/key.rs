//! Names for results.

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};

/// The name of a result: a hash of everything that decides its value.
///
/// Two tasks with equal keys produce equal tables, so a stored table never goes stale.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TaskKey([u8; 16]);

/// A word that is no key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is no key: a key is 32 hexadecimal digits, as in the `task` column of a table")]
pub struct NoKey {
    word: String,
}

/// A hash of parameters, taken once however many tasks share them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(blake3::Hash);

impl Digest {
    /// Hashes parameters as JSON, which is stable between builds and readable.
    pub fn of(params: &impl Serialize) -> Digest {
        // At once: a hasher that hears each word by itself takes several times as long.
        let json = serde_json::to_vec(params)
            .expect("parameters are plain numbers, strings and lists of them");
        Digest(blake3::hash(&json))
    }

    /// The digest of parameters that are JSON already.
    pub fn of_json(params: &str) -> Digest {
        Digest(blake3::hash(params.as_bytes()))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, formatter)
    }
}

impl TaskKey {
    /// The key of a task of `stage` at `version` that reads `params` and tables with these
    /// identities: their keys, but for what no later stage reads of them.
    pub fn of(stage: &str, version: u32, params: Digest, inputs: &[TaskKey]) -> TaskKey {
        let mut hasher = blake3::Hasher::new();
        // The length comes first, so that no two lists of ingredients run together.
        hasher.update(&(stage.len() as u64).to_le_bytes());
        hasher.update(stage.as_bytes());
        hasher.update(&version.to_le_bytes());
        hasher.update(params.0.as_bytes());
        for input in inputs {
            hasher.update(&input.0);
        }
        let mut key = [0; 16];
        key.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
        TaskKey(key)
    }
}

impl TaskKey {
    /// What its first two digits say.
    pub fn first_byte(self) -> u8 {
        self.0[0]
    }

    /// What its first sixteen digits say.
    pub fn first_word(self) -> u64 {
        (u128::from_be_bytes(self.0) >> 64) as u64
    }
}

impl fmt::Display for TaskKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:032x}", u128::from_be_bytes(self.0))
    }
}

impl fmt::Debug for TaskKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

impl FromStr for TaskKey {
    type Err = NoKey;

    fn from_str(word: &str) -> Result<TaskKey, NoKey> {
        let digits = word.len() == 32 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
        match u128::from_str_radix(word, 16) {
            Ok(number) if digits => Ok(TaskKey(number.to_be_bytes())),
            _ => Err(NoKey { word: word.to_owned() }),
        }
    }
}

impl Serialize for TaskKey {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> TaskKey {
        TaskKey::of("solve", 1, Digest::of(&[0.01, 0.02]), &[])
    }

    #[test]
    fn equal_ingredients_have_equal_keys() {
        assert_eq!(key(), TaskKey::of("solve", 1, Digest::of(&[0.01, 0.02]), &[]));
    }

    #[test]
    fn stage_changes_the_key() {
        assert_ne!(key(), TaskKey::of("measure", 1, Digest::of(&[0.01, 0.02]), &[]));
    }

    #[test]
    fn version_changes_the_key() {
        assert_ne!(key(), TaskKey::of("solve", 2, Digest::of(&[0.01, 0.02]), &[]));
    }

    #[test]
    fn parameters_change_the_key() {
        assert_ne!(key(), TaskKey::of("solve", 1, Digest::of(&[0.01, 0.03]), &[]));
    }

    #[test]
    fn inputs_and_their_order_change_the_key() {
        let (a, b) = (key(), TaskKey::of("solve", 2, Digest::of(&[0.01, 0.02]), &[]));
        let of = |inputs: &[TaskKey]| TaskKey::of("fit", 1, Digest::of(&()), inputs);
        assert_ne!(of(&[]), of(&[a]));
        assert_ne!(of(&[a]), of(&[b]));
        assert_ne!(of(&[a, b]), of(&[b, a]));
    }

    #[test]
    fn a_key_is_read_back_from_its_digits() {
        assert_eq!(key().to_string().parse(), Ok(key()));
    }

    #[test]
    fn other_words_are_no_keys() {
        for word in ["", "12", "../../../../etc/passwd__________", &"+".repeat(32)] {
            assert!(word.parse::<TaskKey>().is_err(), "{word}");
        }
    }
}
