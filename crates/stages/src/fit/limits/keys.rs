//! Keys of the fits of limits.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::{SeqAccessDeserializer, StrDeserializer};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::fit::keys::{DEFAULT_LEVEL, DEFAULT_RESAMPLINGS, MOST_RESAMPLINGS};
use asperity_manifest::written::{Key, Written, deserialize_either, table};

/// Fits Q = Q₀ + Σ cⱼ fⱼ(xⱼ): what an observable tends to where small numbers vanish.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LimitTable {
    /// The observable Q, a column or an expression in columns, of one surface under one load:
    /// `"mean_gap"`, `"area_corrected / load"`, `"-1 / slope(mean_gap)"` (by neighbouring loads), or a
    /// parameter that another stage has fitted, with its standard error.
    #[schemars(required)]
    pub of: Key<String>,
    /// What is to vanish, and how the observable depends on it:
    /// `[{ of = "1 / k_lower", exponent = 1 }, …]`.
    #[schemars(required, length(min = 1, max = 4))]
    pub terms: Key<Vec<Written<TermTable>>>,
    /// The loads at which the observable is looked at, in units of E* × rms slope; all loads of the
    /// window when left out.
    #[schemars(inner(range(min = 0)))]
    pub loads: Key<Vec<Written<f64>>>,
    /// Parameters that vary among the points of one fit; those that the terms name when left out.
    /// A plateau that ends at the same multiple of `k_lower` goes along with it.
    pub over: Key<Vec<Written<String>>>,
    /// Smallest and largest load that count where no `loads` are given, in units of E* × rms slope.
    #[schemars(length(equal = 2), inner(range(min = 0)), extend("default" = [0.0, 10.0]))]
    pub window: Key<Vec<Written<f64>>>,
    /// Resamplings of whole surfaces for the intervals, the same realizations in all points; 0 for
    /// none.
    #[schemars(range(min = 0, max = MOST_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<i64>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the resampling; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
}

table!(LimitTable, swept: ["of"], lists: ["terms", "loads", "over"]);

/// One small number.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermTable {
    /// The small number, an expression in parameters: `"k_lower / k_upper"`.
    pub of: Written<String>,
    /// `"power"` or `"logarithm"`; with both in a list, both are fitted and compared.
    #[serde(default)]
    #[schemars(extend("default" = "power"))]
    pub form: Key<OneOrMore<FormWord>>,
    /// The exponent of the power: a number, `"free"`, or a list of which each is fitted and compared.
    #[serde(default)]
    #[schemars(extend("default" = "free"))]
    pub exponent: Key<OneOrMore<WrittenExponent>>,
}

/// A value, or a list of which each is tried.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum OneOrMore<T> {
    /// One.
    One(T),
    /// Several.
    More(Vec<T>),
}

impl<T: Copy> OneOrMore<T> {
    /// All of them.
    pub fn all(&self) -> Vec<T> {
        match self {
            OneOrMore::One(one) => vec![*one],
            OneOrMore::More(more) => more.clone(),
        }
    }
}

/// How an observable depends on a small number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormWord {
    /// c xᵉ.
    Power,
    /// c ln x: then there is no limit, and `limit` is the value at x = 1.
    Logarithm,
}

/// An exponent.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenExponent {
    /// Its value.
    Given(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// It is fitted.
    Word(ExponentWord),
}

/// How an exponent is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ExponentWord {
    /// It is fitted like the coefficients.
    Free,
}

deserialize_either! {
    'de, WrittenExponent, "a number or `\"free\"`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<WrittenExponent, E> {
        Ok(WrittenExponent::Given(number as f64))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<WrittenExponent, E> {
        Ok(WrittenExponent::Given(number))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<WrittenExponent, E> {
        ExponentWord::deserialize(StrDeserializer::new(word)).map(WrittenExponent::Word)
    }
}

deserialize_either! {
    'de, OneOrMoreWords, "`\"power\"`, `\"logarithm\"` or a list of both",

    fn visit_str<E: Error>(self, word: &str) -> Result<OneOrMoreWords, E> {
        let word = FormWord::deserialize(StrDeserializer::new(word))?;
        Ok(OneOrMoreWords(OneOrMore::One(word)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMoreWords, A::Error> {
        let words = Vec::deserialize(SeqAccessDeserializer::new(list))?;
        Ok(OneOrMoreWords(OneOrMore::More(words)))
    }
}

deserialize_either! {
    'de, OneOrMoreExponents, "a number, `\"free\"` or a list of them",

    fn visit_i64<E: Error>(self, number: i64) -> Result<OneOrMoreExponents, E> {
        Ok(OneOrMoreExponents(OneOrMore::One(WrittenExponent::Given(number as f64))))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<OneOrMoreExponents, E> {
        Ok(OneOrMoreExponents(OneOrMore::One(WrittenExponent::Given(number))))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<OneOrMoreExponents, E> {
        let word = ExponentWord::deserialize(StrDeserializer::new(word))?;
        Ok(OneOrMoreExponents(OneOrMore::One(WrittenExponent::Word(word))))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMoreExponents, A::Error> {
        let exponents = Vec::deserialize(SeqAccessDeserializer::new(list))?;
        Ok(OneOrMoreExponents(OneOrMore::More(exponents)))
    }
}

/// Forms as they are read.
struct OneOrMoreWords(OneOrMore<FormWord>);

impl<'de> Deserialize<'de> for OneOrMore<FormWord> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrMoreWords::deserialize(deserializer).map(|read| read.0)
    }
}

/// Exponents as they are read.
struct OneOrMoreExponents(OneOrMore<WrittenExponent>);

impl<'de> Deserialize<'de> for OneOrMore<WrittenExponent> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrMoreExponents::deserialize(deserializer).map(|read| read.0)
    }
}
