//! Values along x and y in recipes.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Two values, one along x and one along y.
///
/// Equal values are serialised as a single value, so that the keys of squares stay as they were
/// before there were rectangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PerAxis<T>(pub [T; 2]);

impl<T: Copy> PerAxis<T> {
    /// Creates a pair of equal values.
    pub fn same(value: T) -> Self {
        Self([value; 2])
    }
}

impl<T: Serialize + PartialEq> Serialize for PerAxis<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            [x, y] if x == y => x.serialize(serializer),
            both => both.serialize(serializer),
        }
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrTwo<T> {
    One(T),
    Two([T; 2]),
}

impl<'de, T: Deserialize<'de> + Copy> Deserialize<'de> for PerAxis<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOrTwo::deserialize(deserializer)? {
            OneOrTwo::One(value) => Self::same(value),
            OneOrTwo::Two(both) => Self(both),
        })
    }
}
