//! The quantity that a path prescribes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The quantity that a path prescribes, the value of `control`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// The mean pressure is prescribed, and the mean gap follows.
    Load,
    /// The mean gap is prescribed, and the mean pressure follows.
    Gap,
}

impl Control {
    /// Returns the word in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Control::Load => "load",
            Control::Gap => "gap",
        }
    }
}
