//! Numbers along x and y, as recipes hold them.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One number along x and one along y.
///
/// Written as one number where both are equal: the recipe of a square, and so its key, is what it was
/// before there were rectangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PerAxis<T>(pub [T; 2]);

impl<T: Copy> PerAxis<T> {
    /// The same number along both.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_numbers_are_written_as_one_and_different_ones_as_two() {
        for (numbers, text) in [([64, 64], "64"), ([64, 32], "[64,32]")] {
            let written = serde_json::to_string(&PerAxis(numbers)).unwrap();
            assert_eq!(written, text);
            assert_eq!(serde_json::from_str::<PerAxis<u32>>(text).unwrap().0, numbers);
        }
        assert_eq!(serde_json::to_string(&PerAxis([1.0, 1.0])).unwrap(), "1.0");
    }
}
