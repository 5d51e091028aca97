//! Values that are one number for both axes of a map, or one number for each axis.
//!
//! A list in a manifest is swept: `nodes = [64, 128]` gives two squares. A rectangle is written as
//! a list too: `nodes = [1024, 512]` with `side = [2.0, 1.0]`. These rules distinguish them:
//!
//! - A list within a list, or within a case, is a pair along x and y.
//! - A list of two numbers is a pair if another key that takes pairs is also a pair or a list of
//!   two numbers. Otherwise it is swept like all other lists.
//! - For the keys `side` and `resample` of measured maps, a list of two numbers is always a pair.
//!
//! A manifest in which only one such key is a list therefore keeps its meaning. If two keys are
//! lists of two numbers, the lists could be a sweep of four squares or one rectangle. They are read
//! as one rectangle, and a warning shows how to write both unambiguously.

use std::fmt;

use serde::Deserialize;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeTable, DeValue};

use super::Layout;
use crate::keys::values::plain;

/// One number for both axes, or one number for each axis.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum OnAxes<T> {
    /// The same number along x and along y.
    Both(T),
    /// One number along x and one along y.
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

/// Formats the number or the pair as in a manifest.
impl<T: fmt::Display> fmt::Display for OnAxes<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OnAxes::Both(value) => write!(formatter, "{value}"),
            OnAxes::Each([x, y]) => write!(formatter, "[{x}, {y}]"),
        }
    }
}

/// The keys of a table for which a list of two numbers is a pair and not swept.
pub struct Pairs {
    keys: Vec<&'static str>,
    /// True if several lists were read as pairs that could also be swept.
    pub may_be_swept: bool,
}

/// The form in which a manifest gives the value of a key that takes pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Notation {
    /// Neither a list of two numbers nor a list of pairs.
    Other,
    /// A list of two numbers, with `true` if the numbers differ.
    TwoNumbers(bool),
    /// A list that contains a list, or a list within a case.
    Pairs,
}

impl Pairs {
    /// Determines which lists of a table are pairs.
    pub fn among(table: &DeTable<'_>, layout: &'static Layout) -> Pairs {
        let keys = layout.pairs.iter().copied();
        let notations: Vec<_> = keys.map(|key| (key, Notation::of(table, key))).collect();
        let is_two = |notation: &Notation| matches!(notation, Notation::TwoNumbers(_));
        let two: Vec<_> = notations.iter().filter(|(_, notation)| is_two(notation)).collect();
        let beside_pairs = notations.iter().any(|(_, notation)| *notation == Notation::Pairs);
        let differ = two.iter().all(|(_, notation)| *notation == Notation::TwoNumbers(true));
        let are_pairs = two.len() > 1 || beside_pairs;
        let listed = layout.always_pairs.iter().copied();
        let always = listed.filter(|key| is_two(&Notation::of(table, key)));
        let together = two.iter().map(|(key, _)| *key).filter(|_| are_pairs);
        Pairs {
            may_be_swept: are_pairs && two.len() > 1 && differ,
            keys: together.chain(always).collect(),
        }
    }

    /// Returns whether the list of a key is a pair.
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
            // A text is an expression.
            [x, y]
                if [x, y]
                    .iter()
                    .all(|item| item.is_integer() || item.is_float() || item.is_str()) =>
            {
                Notation::TwoNumbers(plain(x) != plain(y))
            }
            _ => Notation::Other,
        }
    }
}
