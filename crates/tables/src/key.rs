//! Keys of tasks.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};

/// Key of a task and its table: a hash of everything that decides the content of the table.
///
/// Tasks with equal keys produce equal tables, so a stored table never becomes outdated.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TaskKey([u8; 16]);

/// Map from keys, in the order of the keys.
pub type KeyMap<V> = BTreeMap<TaskKey, V>;

/// Error of parsing a [`TaskKey`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{word}` is not a key; a key has 32 hexadecimal digits, as in the column `task` of a table"
)]
pub struct InvalidKey {
    word: String,
}

/// Hash of the parameters of a task. It is computed once for all tasks with the same parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(blake3::Hash);

impl Digest {
    /// Hashes parameters, serialized as JSON. Their JSON text is the same in all builds.
    pub fn from_params(params: &impl Serialize) -> Digest {
        // Hashing the JSON word by word as it is written would be several times slower.
        let json = serde_json::to_vec(params)
            .expect("parameters are plain numbers, strings and lists of them");
        Digest(blake3::hash(&json))
    }

    /// Hashes parameters that are already serialized as JSON.
    pub(crate) fn from_json(params: &str) -> Digest {
        Digest(blake3::hash(params.as_bytes()))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, formatter)
    }
}

impl TaskKey {
    /// Computes the key of a task from the name and version of its stage, its parameters and its
    /// inputs.
    ///
    /// `inputs` are the identities of the input tasks. The identity of a task is the key that it
    /// would have without the parameters that later stages do not read.
    pub fn new(stage: &str, version: u32, params: Digest, inputs: &[TaskKey]) -> TaskKey {
        let mut hasher = blake3::Hasher::new();
        // Hash the length too, so that different arguments never give the same bytes.
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

    /// Returns the first two hexadecimal digits as a number.
    pub(crate) fn first_byte(self) -> u8 {
        self.0[0]
    }

    /// Returns the first sixteen hexadecimal digits as a number.
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
    type Err = InvalidKey;

    fn from_str(word: &str) -> Result<TaskKey, InvalidKey> {
        let digits = word.len() == 32 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
        match u128::from_str_radix(word, 16) {
            Ok(number) if digits => Ok(TaskKey(number.to_be_bytes())),
            _ => Err(InvalidKey { word: word.to_owned() }),
        }
    }
}

impl Serialize for TaskKey {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> TaskKey {
        TaskKey::new("solve", 1, Digest::from_params(&[0.01, 0.02]), &[])
    }

    #[test]
    fn equal_provenance_gives_equal_keys() {
        assert_eq!(key(), TaskKey::new("solve", 1, Digest::from_params(&[0.01, 0.02]), &[]));
    }

    #[test]
    fn stage_version_and_parameters_change_the_key() {
        let of = |stage, version, loads: [f64; 2]| {
            TaskKey::new(stage, version, Digest::from_params(&loads), &[])
        };
        assert_ne!(key(), of("measure", 1, [0.01, 0.02]));
        assert_ne!(key(), of("solve", 2, [0.01, 0.02]));
        assert_ne!(key(), of("solve", 1, [0.01, 0.03]));
    }

    #[test]
    fn inputs_and_their_order_change_the_key() {
        let (a, b) = (key(), TaskKey::new("solve", 2, Digest::from_params(&[0.01, 0.02]), &[]));
        let of = |inputs: &[TaskKey]| TaskKey::new("fit", 1, Digest::from_params(&()), inputs);
        assert_ne!(of(&[]), of(&[a]));
        assert_ne!(of(&[a]), of(&[b]));
        assert_ne!(of(&[a, b]), of(&[b, a]));
    }

    #[test]
    fn a_key_is_read_back_from_its_digits() {
        assert_eq!(key().to_string().parse(), Ok(key()));
    }

    #[test]
    fn other_words_are_not_keys() {
        for word in ["", "12", "../../../../etc/passwd__________", &"+".repeat(32)] {
            assert!(word.parse::<TaskKey>().is_err(), "{word}");
        }
    }
}
