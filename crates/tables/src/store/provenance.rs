//! How a table came about, as its file tells it: enough to work out its key again.

use super::key::{Digest, TaskKey};
use crate::parquet::Metadata;

/// What decided a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// The stage's kind.
    pub stage: String,
    /// The version of the stage's numbers.
    pub version: u32,
    /// The stage's parameters, as JSON.
    pub recipe: String,
    /// The tables that were read.
    pub inputs: Vec<TaskKey>,
    /// What the key says of them: the keys of their identities, without what no later stage reads.
    pub input_identities: Vec<TaskKey>,
}

const STAGE: &str = "stage";
const STAGE_VERSION: &str = "stage_version";
const RECIPE: &str = "recipe";
const INPUTS: &str = "inputs";
/// Files have their own word for the identities of inputs.
const INPUT_IDENTITIES: &str = "read_as";
const PROGRAM_VERSION: &str = "version";

impl Provenance {
    /// The key that follows from it.
    pub fn key(&self) -> TaskKey {
        let params = Digest::of_json(&self.recipe);
        TaskKey::of(&self.stage, self.version, params, &self.input_identities)
    }

    /// What is written into the file.
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

    /// What a file tells; nothing if it does not tell all of it.
    pub fn of(metadata: &Metadata) -> Option<Provenance> {
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
    let words = words.split_ascii_whitespace();
    words.map(|word| word.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn provenance() -> Provenance {
        let surface = TaskKey::of("generate", 1, Digest::of(&"surface"), &[]);
        Provenance {
            stage: "solve".to_owned(),
            version: 3,
            recipe: "{\"loads\":[0.01]}".to_owned(),
            inputs: vec![surface],
            input_identities: vec![surface, surface],
        }
    }

    #[test]
    fn a_file_tells_what_was_written_into_it() {
        let told = Provenance::of(&provenance().metadata());
        assert_eq!(told, Some(provenance()));
    }

    #[test]
    fn the_key_follows_from_stage_version_recipe_and_what_was_read() {
        let params = Digest::of(&serde_json::json!({ "loads": [0.01] }));
        let key = TaskKey::of("solve", 3, params, &provenance().input_identities);
        assert_eq!(provenance().metadata().key, Some(key));
    }

    #[test]
    fn nothing_follows_from_half_the_story() {
        let whole = provenance().metadata();
        for missing in [STAGE, STAGE_VERSION, RECIPE, INPUTS, INPUT_IDENTITIES] {
            let mut half = whole.clone();
            half.entries.retain(|(name, _)| name != missing);
            assert_eq!(Provenance::of(&half), None, "{missing}");
        }
    }
}
