//! Numbers for both axes of a map: one for either, or one for each.
//!
//! A list in a manifest is swept: `nodes = [64, 128]` are two squares, and have been from the first. A
//! rectangle wants a list too: `nodes = [1024, 512]` with `side = [2.0, 1.0]`. What tells them apart:
//!
//! - A list within a list, and one within a case, is never swept: it is a pair, along x and y.
//! - A list of two numbers is a pair if another of the keys that take pairs is one, or such a list
//!   too. Otherwise, as all other lists, it is swept, for half of a rectangle is none.
//! - Of a measured map the sides have been a pair from the first: there, and of the nodes that it is
//!   resampled on, a list of two numbers is always one.
//!
//! So nothing changes for a manifest in which one such key alone is a list. Where two of them are lists
//! of two numbers, what used to be a sweep of four squares is one rectangle: a warning says so, and how
//! to write either so that nobody has to ask.

use std::fmt;
use std::marker::PhantomData;

use schemars::Schema;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Layout, Written};

/// What such a key must be, in messages.
pub const NUMBER_OR_PAIR: &str = "a number, or two of them: [along x, along y]";

/// One number for both axes, or one for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OnAxes<T> {
    /// The same along both.
    Both(T),
    /// Along x and along y.
    Each([T; 2]),
}

impl<T: Copy> OnAxes<T> {
    /// Along x and along y.
    pub fn pair(&self) -> [T; 2] {
        match *self {
            OnAxes::Both(value) => [value; 2],
            OnAxes::Each(pair) => pair,
        }
    }
}

impl<T: Copy> Written<OnAxes<T>> {
    /// The number along x and along y, each where it is written.
    pub fn on_either(&self) -> [Written<T>; 2] {
        self.value.pair().map(|value| Written { value, span: self.span.clone() })
    }
}

/// As a manifest has it.
impl<T: fmt::Display> fmt::Display for OnAxes<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OnAxes::Both(value) => write!(formatter, "{value}"),
            OnAxes::Each([x, y]) => write!(formatter, "[{x}, {y}]"),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OnAxes<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Either(PhantomData))
    }
}

struct Either<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
    type Value = OnAxes<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(NUMBER_OR_PAIR)
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<OnAxes<T>, E> {
        T::deserialize(number.into_deserializer()).map(OnAxes::Both)
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<OnAxes<T>, E> {
        T::deserialize(number.into_deserializer()).map(OnAxes::Both)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OnAxes<T>, A::Error> {
        let list = Vec::<T>::deserialize(SeqAccessDeserializer::new(list))?;
        let pair = <[T; 2]>::try_from(list).map(OnAxes::Each);
        pair.map_err(|_| Error::custom("a pair has two numbers: [along x, along y]"))
    }
}

/// Lets a pair of numbers stand for a number, each within the same bounds.
pub fn or_a_pair(schema: &mut Schema) {
    let bounds = ["type", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"];
    let known = bounds.iter().filter_map(|rule| Some((*rule, schema.get(*rule)?.clone())));
    let item: serde_json::Map<String, Value> =
        known.map(|(rule, value)| (rule.to_owned(), value)).collect();
    let plain = item.get("type").cloned().unwrap_or(json!("number"));
    schema.insert("type".to_owned(), json!([plain, "array"]));
    schema.insert("items".to_owned(), item.into());
    schema.insert("minItems".to_owned(), json!(2));
    schema.insert("maxItems".to_owned(), json!(2));
}

/// Which keys of a table hold one pair where others would be swept.
pub struct Pairs {
    keys: Vec<&'static str>,
    /// Whether they might have been meant to be swept, for nothing else says that they are not.
    pub may_be_swept: bool,
}

/// How a key is written for all cases, as far as it matters here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Writing {
    Else,
    /// A list of two numbers, `true` if they differ.
    Two(bool),
    /// A list with a list in it, or a list within a case.
    Pairs,
}

impl Pairs {
    /// Looks at all keys of a table that take pairs.
    pub fn among(table: &DeTable<'_>, layout: &'static Layout) -> Pairs {
        let keys = layout.pairs.iter().copied();
        let writings: Vec<_> = keys.map(|key| (key, Writing::of(table, key))).collect();
        let two: Vec<_> =
            writings.iter().filter(|(_, writing)| matches!(writing, Writing::Two(_))).collect();
        let beside_pairs = writings.iter().any(|(_, writing)| *writing == Writing::Pairs);
        let differ = two.iter().all(|(_, writing)| *writing == Writing::Two(true));
        let are_pairs = two.len() > 1 || beside_pairs;
        let always = layout.always_pairs.iter().copied();
        let always = always.filter(|key| matches!(Writing::of(table, key), Writing::Two(_)));
        let together = two.iter().map(|(key, _)| *key).filter(|_| are_pairs);
        Pairs {
            may_be_swept: are_pairs && two.len() > 1 && differ,
            keys: together.chain(always).collect(),
        }
    }

    /// Whether the list of a key is one pair.
    pub fn has(&self, key: &str) -> bool {
        self.keys.contains(&key)
    }
}

impl Writing {
    fn of(table: &DeTable<'_>, key: &str) -> Writing {
        let in_case = |case: &Spanned<DeValue<'_>>| {
            let value = case.get_ref().as_table().and_then(|case| case.get(key));
            value.is_some_and(|value| value.get_ref().is_array())
        };
        let cases = table.get("cases").and_then(|cases| cases.get_ref().as_array());
        if cases.is_some_and(|cases| cases.iter().any(in_case)) {
            return Writing::Pairs;
        }
        let Some(list) = table.get(key).and_then(|value| value.get_ref().as_array()) else {
            return Writing::Else;
        };
        let numbers = || list.iter().map(|value| number(value.get_ref()));
        if list.iter().any(|value| value.get_ref().is_array()) {
            return Writing::Pairs;
        }
        match numbers().collect::<Option<Vec<f64>>>().as_deref() {
            Some([one, other]) => Writing::Two(one != other),
            _ => Writing::Else,
        }
    }
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(number) => {
            let number = i64::from_str_radix(number.as_str(), number.radix()).ok()?;
            Some(number as f64)
        }
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    }
}
