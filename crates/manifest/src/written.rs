//! What is written, and where: reads one table of a manifest.
//!
//! A table is a type whose fields are [`Key`]s; their comments are what editors show and what messages
//! quote. Lists of some keys are swept: the [`reader`] spreads the table into the points of a
//! [`grid`](Section), each a value of the type. [`checks`] then judge value after value.

pub mod advice;
pub mod checks;
mod grid;
mod layout;
pub mod on_axes;
pub mod reader;

pub use grid::{Point, Section};
pub use layout::table;
pub use layout::{Layout, Table};
pub use on_axes::OnAxes;

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer};
use serde_spanned::Spanned;

use crate::diagnostics::Span;

/// A value as written, and the place.
#[derive(Debug, Clone)]
pub struct Written<T> {
    /// The value.
    pub value: T,
    /// Its place in the manifest's text.
    pub span: Span,
}

/// What a table says for one of its keys, if anything.
#[derive(Debug, Clone)]
pub struct Key<T>(pub Option<Written<T>>);

impl<T> Default for Key<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Key<T> {
    /// What is written, if anything.
    pub fn written(&self) -> Option<&Written<T>> {
        self.0.as_ref()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Written<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<T>::deserialize(deserializer)?;
        let span = spanned.span();
        Ok(Self { value: spanned.into_inner(), span })
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Key<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Written::deserialize(deserializer).map(|written| Self(Some(written)))
    }
}

/// The place of a value is no concern of editors: its schema is that of the value.
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

schema_of_the_value!(Written);
schema_of_the_value!(Key);

/// Reads a value that may be written in several ways by what it turns out to be; the methods are
/// those of serde's `Visitor`. Serde's untagged enums would read it too, but lose the places.
#[macro_export]
macro_rules! deserialize_either {
    ($de:lifetime, $value:ident, $expected:literal, $($methods:tt)*) => {
        impl<$de> Deserialize<$de> for $value {
            fn deserialize<D: Deserializer<$de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Either;
                impl<$de> Visitor<$de> for Either {
                    type Value = $value;

                    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                        formatter.write_str($expected)
                    }

                    $($methods)*
                }
                deserializer.deserialize_any(Either)
            }
        }
    };
}
pub use deserialize_either;
