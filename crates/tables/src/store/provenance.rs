//! Provenance of a table, from which its key is computed.

use crate::key::{Digest, TaskKey};
use crate::parquet::Metadata;

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
