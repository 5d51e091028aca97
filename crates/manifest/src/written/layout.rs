//! What is known of a table before one is read: its keys, their meaning, what may be swept.

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// A table of a manifest.
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
