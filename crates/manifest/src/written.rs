//! What is written, and where: reads one table of a manifest.
//!
//! A table is a type whose fields are [`Key`]s; their comments are what editors show and what messages
//! quote. Lists of some keys are swept: the [`reader`] spreads the table into the points of a
//! [`grid`](Section), each a value of the type. [`checks`] then judge value after value.

pub mod advice;
pub mod checks;
pub mod on_axes;
pub mod reader;

use std::borrow::Cow;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};
use serde_spanned::Spanned;

use crate::diagnostics::Span;

pub use on_axes::OnAxes;
pub use reader::{Point, Section};

/// A value as written, and the place.
#[derive(Debug, Clone)]
pub struct Written<T> {
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

    /// The value that is written, if any.
    pub fn value(&self) -> Option<T>
    where
        T: Copy,
    {
        self.0.as_ref().map(|written| written.value)
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
// The schema of the number; `on_axes::or_a_pair` adds the other way to write it.
schema_of_the_value!(OnAxes);

/// Reads a value that may be written in several ways by what it turns out to be; the methods are
/// those of serde's `Visitor`. Serde's untagged enums would read it too, but lose the places.
#[macro_export]
macro_rules! deserialize_either {
    ($de:lifetime, $value:ty, $expected:literal, $($methods:tt)*) => {
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

/// A table of a manifest: its keys, their meaning, what may be swept.
pub trait Table: DeserializeOwned + JsonSchema {
    /// What is known of it.
    fn layout() -> &'static Layout;
}

/// The keys of a table.
pub struct Layout {
    /// Keys whose lists are swept, in the order of the grid, the last fastest.
    pub swept: &'static [&'static str],
    /// Keys that hold a list, for which a single value may stand.
    pub lists: &'static [&'static str],
    /// Keys that hold a number for both axes or a pair of them, all or none of which are pairs.
    pub pairs: &'static [&'static str],
    /// Keys that hold the same, of which a list of two numbers is always a pair.
    pub always_pairs: &'static [&'static str],
    /// The JSON Schema of the table, without references.
    pub schema: Schema,
}

impl Layout {
    /// Of a type, with the keys whose lists are swept, those that hold lists, those that take pairs
    /// together, and those that always do.
    pub fn of<T: JsonSchema>(
        swept: &'static [&'static str],
        lists: &'static [&'static str],
        pairs: &'static [&'static str],
        always_pairs: &'static [&'static str],
    ) -> Self {
        let settings = SchemaSettings::draft07().with(|settings| {
            settings.inline_subschemas = true;
            settings.meta_schema = None;
            settings.transforms.push(Box::new(RecursiveTransform(tidy)));
        });
        let mut schema = settings.into_generator().into_root_schema_for::<T>();
        schema.remove("title");
        Self { swept, lists, pairs, always_pairs, schema }
    }

    /// The schemas of the keys.
    pub fn properties(&self) -> &Map<String, Value> {
        let properties = self.schema.get("properties").and_then(Value::as_object);
        properties.expect("a table is an object")
    }

    /// The keys, in the order of the alphabet.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.properties().keys().map(String::as_str)
    }

    /// Whether there is such a key.
    pub fn has(&self, key: &str) -> bool {
        self.properties().contains_key(key)
    }

    /// Whether a key holds a number for both axes or a pair of them.
    pub fn takes_pairs(&self, key: &str) -> bool {
        self.pairs.contains(&key) || self.always_pairs.contains(&key)
    }

    /// What a key means.
    pub fn doc(&self, key: &str) -> Option<String> {
        let about = self.properties().get(key)?.get("description")?.as_str()?;
        Some(format!("`{key}`: {about}"))
    }
}

/// Puts what a key means on one line, whatever the width of the source.
fn tidy(schema: &mut Schema) {
    schema.remove("format");
    if let Some(Value::String(about)) = schema.get_mut("description") {
        *about = about.replace('\n', " ");
    }
}

/// Declares a table and what its lists mean.
#[macro_export]
macro_rules! table {
    ($table:ident, swept: [$($swept:literal),*], lists: [$($list:literal),*]) => {
        $crate::written::table!($table, swept: [$($swept),*], lists: [$($list),*], pairs: []);
    };
    (
        $table:ident,
        swept: [$($swept:literal),*],
        lists: [$($list:literal),*],
        pairs: [$($pair:literal),*]
    ) => {
        $crate::written::table!(
            $table,
            swept: [$($swept),*],
            lists: [$($list),*],
            pairs: [$($pair),*],
            always_pairs: []
        );
    };
    (
        $table:ident,
        swept: [$($swept:literal),*],
        lists: [$($list:literal),*],
        pairs: [$($pair:literal),*],
        always_pairs: [$($always:literal),*]
    ) => {
        impl $crate::written::Table for $table {
            fn layout() -> &'static $crate::written::Layout {
                use $crate::written::Layout;
                static LAYOUT: std::sync::LazyLock<Layout> = std::sync::LazyLock::new(|| {
                    Layout::of::<$table>(
                        &[$($swept),*],
                        &[$($list),*],
                        &[$($pair),*],
                        &[$($always),*],
                    )
                });
                &LAYOUT
            }
        }
    };
}
pub use table;
