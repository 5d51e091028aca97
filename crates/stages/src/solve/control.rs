//! The quantity that a contact prescribes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The quantity that a contact prescribes, the value of `control`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// The mean pressure is prescribed, and the mean gap follows.
    Load,
    /// The mean gap is prescribed, and the mean pressure follows.
    Gap,
    /// The rigid approach of the bodies since first touch is prescribed, and the mean pressure
    /// follows.
    Displacement,
}

impl Control {
    /// Returns the word in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Control::Load => "load",
            Control::Gap => "gap",
            Control::Displacement => "displacement",
        }
    }

    /// Returns whether loads are prescribed. Recipes omit this control, so that existing keys stay
    /// valid.
    pub fn is_load(&self) -> bool {
        *self == Control::Load
    }

    /// Returns the key with the prescribed values.
    pub fn key(self) -> &'static str {
        match self {
            Control::Load => "loads",
            Control::Gap => "gaps",
            Control::Displacement => "displacements",
        }
    }

    /// Returns the name of a prescribed value in texts.
    pub fn value_in_words(self) -> &'static str {
        match self {
            Control::Load => "load",
            Control::Gap => "mean gap",
            Control::Displacement => "displacement",
        }
    }
}
