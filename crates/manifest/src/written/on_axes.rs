//! Numbers that hold for both axes of a map, or one number for each axis.
//!
//! A list in a manifest is swept: `nodes = [64, 128]` are two squares. A rectangle needs a list
//! too: `nodes = [1024, 512]` with `side = [2.0, 1.0]`. These rules tell them apart:
//!
//! - A list within a list, and a list within a case, is a pair along x and y.
//! - A list of two numbers is a pair if another key that takes pairs is a pair or such a list too.
//!   Otherwise it is swept like all other lists.
//! - The sides of a measured map and the nodes that it is resampled on are never swept over a list
//!   of two numbers: it is always a pair.
//!
//! So a manifest in which one such key alone is a list keeps its meaning. Where two keys are lists
//! of two numbers, a sweep of four squares and one rectangle look the same. It is read as one
//! rectangle, and a warning shows how to write either without doubt.

use std::fmt;

use serde::Deserialize;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeTable, DeValue};

use super::Layout;
use super::validation::number;

/// One number for both axes, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum OnAxes<T> {
    /// The same number along both.
    Both(T),
    /// Numbers along x and along y.
    Each([T; 2]),
}

impl<T: Copy> OnAxes<T> {
    /// Returns the numbers along x and along y.
    pub fn pair(&self) -> [T; 2] {
        match *self {
            OnAxes::Both(value) => [value; 2],
            OnAxes::Each(pair) => pair,
        }
    }
}

/// Writes the number or the pair as a manifest has it.
impl<T: fmt::Display> fmt::Display for OnAxes<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OnAxes::Both(value) => write!(formatter, "{value}"),
            OnAxes::Each([x, y]) => write!(formatter, "[{x}, {y}]"),
        }
    }
}

/// The keys of a table whose list of two numbers is one pair and not swept.
pub struct Pairs {
    keys: Vec<&'static str>,
    /// True if the pairs might have been meant to be swept.
    pub may_be_swept: bool,
}

/// The notation of a key that takes pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Notation {
    /// Neither a list of two numbers nor a list of pairs.
    Other,
    /// A list of two numbers; `true` if they differ.
    TwoNumbers(bool),
    /// A list that holds a list, or a list within a case.
    Pairs,
}

impl Pairs {
    /// Finds the pairs of a table.
    pub fn among(table: &DeTable<'_>, layout: &'static Layout) -> Pairs {
        let keys = layout.pairs.iter().copied();
        let notations: Vec<_> = keys.map(|key| (key, Notation::of(table, key))).collect();
        let is_two = |notation: &Notation| matches!(notation, Notation::TwoNumbers(_));
        let two: Vec<_> = notations.iter().filter(|(_, notation)| is_two(notation)).collect();
        let beside_pairs = notations.iter().any(|(_, notation)| *notation == Notation::Pairs);
        let differ = two.iter().all(|(_, notation)| *notation == Notation::TwoNumbers(true));
        let are_pairs = two.len() > 1 || beside_pairs;
        let always = layout.always_pairs.iter().copied();
        let always = always.filter(|key| is_two(&Notation::of(table, key)));
        let together = two.iter().map(|(key, _)| *key).filter(|_| are_pairs);
        Pairs {
            may_be_swept: are_pairs && two.len() > 1 && differ,
            keys: together.chain(always).collect(),
        }
    }

    /// Returns whether the list of a key is one pair.
    pub fn has(&self, key: &str) -> bool {
        self.keys.contains(&key)
    }
}

impl Notation {
    fn of(table: &DeTable<'_>, key: &str) -> Notation {
        let in_case = |case: &TomlSpanned<DeValue<'_>>| {
            let value = case.get_ref().as_table().and_then(|case| case.get(key));
            value.is_some_and(|value| value.get_ref().is_array())
        };
        let cases = table.get("cases").and_then(|cases| cases.get_ref().as_array());
        if cases.is_some_and(|cases| cases.iter().any(in_case)) {
            return Notation::Pairs;
        }
        let Some(list) = table.get(key).and_then(|value| value.get_ref().as_array()) else {
            return Notation::Other;
        };
        let items: Vec<_> = list.iter().map(TomlSpanned::get_ref).collect();
        match items.as_slice() {
            items if items.iter().any(|item| item.is_array()) => Notation::Pairs,
            [x, y] if [x, y].iter().all(|item| item.is_integer() || item.is_float()) => {
                Notation::TwoNumbers(number(x) != number(y))
            }
            _ => Notation::Other,
        }
    }
}
