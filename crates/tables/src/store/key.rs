//! Keys of tasks, and the provenance from which a key is computed.

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};

use crate::parquet::Metadata;

/// Key of a task and its table: a hash of everything that decides the content of the table.
///
/// Tasks with equal keys produce equal tables, so a stored table never becomes outdated.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TaskKey([u8; 16]);

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
        serializer.collect_str(self)
    }
}

/// Everything that decides the content of a table, as recorded in the file of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    pub stage: String,
    /// Version of the stage, which increases when the stage computes other numbers.
    pub version: u32,
    /// Parameters of the task as JSON.
    pub recipe: String,
    pub inputs: Vec<TaskKey>,
    /// Identities of the inputs; see [`TaskKey::new`].
    pub input_identities: Vec<TaskKey>,
}

const STAGE: &str = "stage";
const STAGE_VERSION: &str = "stage_version";
const RECIPE: &str = "recipe";
const INPUTS: &str = "inputs";
/// Name of the metadata entry with the identities of the inputs.
const INPUT_IDENTITIES: &str = "read_as";
const PROGRAM_VERSION: &str = "version";

impl Provenance {
    /// Computes the key of the task.
    pub fn key(&self) -> TaskKey {
        let params = Digest::from_json(&self.recipe);
        TaskKey::new(&self.stage, self.version, params, &self.input_identities)
    }

    /// Returns the metadata to be written into the file.
    pub fn metadata(&self) -> Metadata {
        let entry = |name: &str, value: String| (name.to_owned(), value);
        Metadata {
            key: Some(self.key()),
            entries: vec![
                entry(STAGE, self.stage.clone()),
                entry(STAGE_VERSION, self.version.to_string()),
                entry(RECIPE, self.recipe.clone()),
                entry(INPUTS, words(&self.inputs)),
                entry(INPUT_IDENTITIES, words(&self.input_identities)),
                entry(PROGRAM_VERSION, env!("CARGO_PKG_VERSION").to_owned()),
            ],
        }
    }

    /// Reads the provenance from the metadata of a file; `None` if an entry is missing.
    pub fn from_metadata(metadata: &Metadata) -> Option<Provenance> {
        Some(Provenance {
            stage: metadata.get(STAGE)?.to_owned(),
            version: metadata.get(STAGE_VERSION)?.parse().ok()?,
            recipe: metadata.get(RECIPE)?.to_owned(),
            inputs: keys(metadata.get(INPUTS)?)?,
            input_identities: keys(metadata.get(INPUT_IDENTITIES)?)?,
        })
    }
}

fn words(keys: &[TaskKey]) -> String {
    let words: Vec<String> = keys.iter().map(TaskKey::to_string).collect();
    words.join(" ")
}

fn keys(words: &str) -> Option<Vec<TaskKey>> {
    words.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
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

    fn provenance() -> Provenance {
        let surface = TaskKey::new("generate", 1, Digest::from_params(&"surface"), &[]);
        Provenance {
            stage: "solve".to_owned(),
            version: 3,
            recipe: "{\"loads\":[0.01]}".to_owned(),
            inputs: vec![surface],
            input_identities: vec![surface, surface],
        }
    }

    #[test]
    fn provenance_is_read_back_from_metadata() {
        let told = Provenance::from_metadata(&provenance().metadata());
        assert_eq!(told, Some(provenance()));
    }

    #[test]
    fn the_key_follows_from_stage_version_recipe_and_inputs() {
        let params = Digest::from_params(&serde_json::json!({ "loads": [0.01] }));
        let key = TaskKey::new("solve", 3, params, &provenance().input_identities);
        assert_eq!(provenance().metadata().key, Some(key));
    }

    #[test]
    fn incomplete_metadata_has_no_provenance() {
        let whole = provenance().metadata();
        for missing in [STAGE, STAGE_VERSION, RECIPE, INPUTS, INPUT_IDENTITIES] {
            let mut half = whole.clone();
            half.entries.retain(|(name, _)| name != missing);
            assert_eq!(Provenance::from_metadata(&half), None, "{missing}");
        }
    }
}
