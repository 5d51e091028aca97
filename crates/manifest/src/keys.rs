//! Reads one table of a manifest and keeps the position of every value in the text.
//!
//! A table is a struct whose fields are [`Key`]s. The field declares its key completely. Editors
//! show its doc comment, and messages quote it. Its type and its `schemars` attributes give bounds
//! and default. The transforms in [`declare`] mark keys that are required, are swept, hold a list
//! or take a pair.
//!
//! [`Layout`] collects these declarations as a JSON Schema. The [`reader`] validates each value
//! against the schema and combines swept lists into parameter points, a [`Section`]. Numbers may be
//! expressions in other keys and in [`parameters`], which [`derived`] evaluates at each point.
//! [`Checks`](checks::Checks) take defaults from the schema and check keys against each other.

pub mod bounds;
pub mod checks;
pub mod derived;
pub mod expected_keys;
mod expression_syntax;
pub mod layout;
pub mod on_axes;
pub mod parameters;
pub mod quantity;
pub mod reader;
mod schema;
pub mod synonyms;
pub mod validation;
pub mod values;

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};

use crate::diagnostics::Span;

pub use layout::{Layout, declare};
pub use on_axes::OnAxes;
pub use reader::{GridPoint, Section};

/// A value and its position in the text of the manifest.
#[derive(Debug, Clone)]
pub struct Spanned<T> {
    pub value: T,
    pub span: Span,
}

/// A key of a table: its value with its position, or `None` if the manifest does not contain the
/// key.
#[derive(Debug, Clone)]
pub struct Key<T>(pub Option<Spanned<T>>);

impl<T> Default for Key<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Key<T> {
    /// Returns the value with its position, if the manifest contains the key.
    pub fn written(&self) -> Option<&Spanned<T>> {
        self.0.as_ref()
    }

    /// Returns a copy of the value, if the manifest contains the key.
    pub fn value(&self) -> Option<T>
    where
        T: Copy,
    {
        self.0.as_ref().map(|written| written.value)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Spanned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = serde_spanned::Spanned::<T>::deserialize(deserializer)?;
        let span = spanned.span();
        Ok(Self { value: spanned.into_inner(), span })
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Key<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Spanned::deserialize(deserializer).map(|written| Self(Some(written)))
    }
}

/// Implements `JsonSchema` for a wrapper: it has the schema of the wrapped value.
macro_rules! schema_of_the_value {
    ($wrapper:ident) => {
        impl<T: JsonSchema> JsonSchema for $wrapper<T> {
            fn inline_schema() -> bool {
                T::inline_schema()
            }

            fn schema_name() -> Cow<'static, str> {
                T::schema_name()
            }

            fn schema_id() -> Cow<'static, str> {
                T::schema_id()
            }

            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                T::json_schema(generator)
            }
        }
    };
}

schema_of_the_value!(Spanned);
schema_of_the_value!(Key);
// `OnAxes` has the schema of a number; `declare::pair` adds the pair.
schema_of_the_value!(OnAxes);

/// Implements `Deserialize` for an enum whose variants are distinguished by the type of the TOML
/// value: `number`, `whole`, `word`, `list` or `table`. Unlike untagged enums of serde, the result
/// keeps positions in the text.
#[macro_export]
macro_rules! deserialize_either {
    ($value:ident { $($kind:ident => $variant:ident),+ }) => {
        impl<'de> serde::Deserialize<'de> for $value {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Either;
                impl<'de> serde::de::Visitor<'de> for Either {
                    type Value = $value;

                    fn expecting(
                        &self,
                        formatter: &mut std::fmt::Formatter<'_>,
                    ) -> std::fmt::Result {
                        formatter.write_str(concat!("a value of `", stringify!($value), "`"))
                    }

                    $($crate::visit_kind!('de, $kind, $value, $variant);)+
                }
                deserializer.deserialize_any(Either)
            }
        }
    };
}

/// Implements the methods of serde's `Visitor` that read one type of value, for
/// [`deserialize_either`].
#[doc(hidden)]
#[macro_export]
macro_rules! visit_kind {
    ($de:lifetime, number, $value:ident, $variant:ident) => {
        fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<$value, E> {
            Ok($value::$variant(number as f64))
        }

        fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<$value, E> {
            Ok($value::$variant(number))
        }
    };
    ($de:lifetime, whole, $value:ident, $variant:ident) => {
        fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<$value, E> {
            let number = serde::de::value::I64Deserializer::new(number);
            serde::Deserialize::deserialize(number).map($value::$variant)
        }
    };
    ($de:lifetime, word, $value:ident, $variant:ident) => {
        fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<$value, E> {
            let word = serde::de::value::StrDeserializer::new(word);
            serde::Deserialize::deserialize(word).map($value::$variant)
        }
    };
    ($de:lifetime, list, $value:ident, $variant:ident) => {
        fn visit_seq<A: serde::de::SeqAccess<$de>>(self, list: A) -> Result<$value, A::Error> {
            let list = serde::de::value::SeqAccessDeserializer::new(list);
            serde::Deserialize::deserialize(list).map($value::$variant)
        }
    };
    ($de:lifetime, table, $value:ident, $variant:ident) => {
        fn visit_map<A: serde::de::MapAccess<$de>>(self, table: A) -> Result<$value, A::Error> {
            let table = serde::de::value::MapAccessDeserializer::new(table);
            serde::Deserialize::deserialize(table).map($value::$variant)
        }
    };
}

pub use deserialize_either;

/// A table of a manifest with declared keys, implemented by [`table!`](crate::table).
pub trait KeyTable: DeserializeOwned + JsonSchema {
    /// Returns the declarations of the keys.
    fn layout() -> &'static Layout;
}

/// Implements [`KeyTable`] for a struct.
#[macro_export]
macro_rules! table {
    ($table:ident) => {
        impl $crate::keys::KeyTable for $table {
            fn layout() -> &'static $crate::keys::Layout {
                use $crate::keys::Layout;
                static LAYOUT: std::sync::LazyLock<Layout> =
                    std::sync::LazyLock::new(Layout::new::<$table>);
                &LAYOUT
            }
        }
    };
}
pub use table;
