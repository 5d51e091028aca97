//! The declarations of the keys of a table, as a JSON Schema with additions.

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde::de::value::Error;
use serde::de::{DeserializeOwned, Visitor};
use serde::{Deserializer, forward_to_deserialize_any};
use serde_json::{Map, Value};

use crate::keys::schema::alternatives;

/// Transforms for `#[schemars(transform = …)]`, which declare that a key is required, how lists are
/// read, and that a number is a length, a pressure or a work per area.
pub mod declare {
    use schemars::Schema;
    use serde_json::{Value, json};

    pub(super) const REQUIRED: &str = "x-required";
    pub(super) const SWEPT: &str = "x-swept";
    pub(super) const LIST: &str = "x-list";
    pub(super) const PAIR: &str = "x-pair";
    pub(super) const ALWAYS_PAIR: &str = "x-always-pair";
    pub(super) const UNIT_OF_LENGTHS: &str = "x-unit-of-lengths";
    pub(super) const UNIT_OF_PRESSURES: &str = "x-unit-of-pressures";
    /// Dimension of the numbers of a key. Unlike the other markers it stays in the schema.
    pub const QUANTITY: &str = "x-quantity";

    /// Declares that the key is required. The attribute `required` has no effect on a struct whose
    /// fields have defaults.
    pub fn required(schema: &mut Schema) {
        schema.insert(REQUIRED.to_owned(), true.into());
    }

    /// Declares that a list of values is swept: each value gives further parameter points.
    pub fn swept(schema: &mut Schema) {
        schema.insert(SWEPT.to_owned(), true.into());
    }

    /// Declares that a single value stands for a list of one value.
    pub fn list(schema: &mut Schema) {
        schema.insert(LIST.to_owned(), true.into());
    }

    /// Declares that the key takes a number, or a pair of numbers along x and y. Whether a list of
    /// two numbers is a pair or swept depends on the other keys that take pairs.
    pub fn pair(schema: &mut Schema) {
        or_a_pair(schema);
        schema.insert(PAIR.to_owned(), true.into());
    }

    /// Declares that the key takes a number or a pair, as [`pair`] does, but a list of two numbers
    /// is always a pair.
    pub fn always_pair(schema: &mut Schema) {
        or_a_pair(schema);
        schema.insert(ALWAYS_PAIR.to_owned(), true.into());
    }

    /// Declares that the numbers of the key are lengths. They may be written with a unit; see
    /// [`quantity`](crate::keys::quantity).
    pub fn length(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "length".into());
    }

    /// Declares that the numbers of the key are pressures, which may be written with a unit.
    pub fn pressure(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "pressure".into());
    }

    /// Declares that the numbers of the key are pressures with a unit, or pure numbers without one.
    pub fn pressure_or_ratio(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "pressure or ratio".into());
    }

    /// Declares that the numbers of the key are lengths with a unit, or pure numbers without one.
    pub fn length_or_ratio(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "length or ratio".into());
    }

    /// Declares that the numbers of the key are pressures or forces with a unit, or pure numbers
    /// without one.
    pub fn load(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "pressure, force or ratio".into());
    }

    /// Declares that the numbers of the key are works per area, which may be written with a unit.
    pub fn work(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "work".into());
    }

    /// Declares that the number of the key is a thermal conductivity, which may be written with a
    /// unit.
    pub fn conductivity(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "conductivity".into());
    }

    /// Declares that the number of the key is an electrical resistivity, which may be written with
    /// a unit.
    pub fn resistivity(schema: &mut Schema) {
        schema.insert(QUANTITY.to_owned(), "resistivity".into());
    }

    /// Declares that the key names the unit of the lengths of the table.
    pub fn unit_of_lengths(schema: &mut Schema) {
        schema.insert(UNIT_OF_LENGTHS.to_owned(), true.into());
    }

    /// Declares that the key may name the unit of the pressures of the table.
    pub fn unit_of_pressures(schema: &mut Schema) {
        schema.insert(UNIT_OF_PRESSURES.to_owned(), true.into());
    }

    /// Declares that the numbers of a list are positive.
    pub fn positive_items(schema: &mut Schema) {
        if let Some(items) = schema.get_mut("items").and_then(Value::as_object_mut) {
            items.insert("exclusiveMinimum".to_owned(), 0.into());
        }
    }

    /// Adds a pair to the schema of a number. Both numbers of the pair have the bounds of the
    /// number.
    fn or_a_pair(schema: &mut Schema) {
        let bounds = ["type", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"];
        let known = bounds.iter().filter_map(|rule| Some((*rule, schema.get(*rule)?.clone())));
        let item: serde_json::Map<String, Value> =
            known.map(|(rule, value)| (rule.to_owned(), value)).collect();
        let number = item.get("type").cloned().unwrap_or(json!("number"));
        schema.insert("type".to_owned(), json!([number, "array"]));
        schema.insert("items".to_owned(), item.into());
        schema.insert("minItems".to_owned(), json!(2));
        schema.insert("maxItems".to_owned(), json!(2));
    }
}

/// The declarations of the keys of a table.
pub struct Layout {
    /// Keys whose lists are swept, in the order of their declaration. The last key varies fastest.
    pub swept: Vec<&'static str>,
    /// Keys that hold a list, for which a single value stands for a list of one.
    pub lists: Vec<&'static str>,
    /// Keys that take a number or a pair. The module [`on_axes`](super::on_axes) tells when a list
    /// of two numbers is a pair.
    pub pairs: Vec<&'static str>,
    /// Keys that take a number or a pair, for which a list of two numbers is always a pair.
    pub always_pairs: Vec<&'static str>,
    /// Key that names the unit of the lengths of the table.
    pub unit_of_lengths: Option<&'static str>,
    /// Key that may name the unit of the pressures of the table.
    pub unit_of_pressures: Option<&'static str>,
    /// Names of all keys in the order of their declaration.
    pub names: &'static [&'static str],
    /// JSON Schema of the table, without references.
    pub schema: Schema,
}

impl Layout {
    /// Collects the declarations of the fields of a struct.
    pub fn new<T: DeserializeOwned + JsonSchema>() -> Self {
        let settings = SchemaSettings::draft07().with(|settings| {
            settings.inline_subschemas = true;
            settings.meta_schema = None;
            settings.transforms.push(Box::new(RecursiveTransform(tidy)));
        });
        let mut schema = settings.into_generator().into_root_schema_for::<T>();
        schema.remove("title");
        let mut take_marked = |marker: &str| {
            let object = schema.get_mut("properties").and_then(Value::as_object_mut);
            let properties = object.expect("a table is an object");
            let mut is_marked = |name: &str| {
                let key = properties.get_mut(name).and_then(Value::as_object_mut);
                key.is_some_and(|key| key.remove(marker).is_some())
            };
            let marked = fields::<T>().iter().copied().filter(|name| is_marked(name));
            marked.collect::<Vec<_>>()
        };
        let [required, swept, lists, pairs, always_pairs] =
            [declare::REQUIRED, declare::SWEPT, declare::LIST, declare::PAIR, declare::ALWAYS_PAIR]
                .map(&mut take_marked);
        let [unit_of_lengths, unit_of_pressures] =
            [declare::UNIT_OF_LENGTHS, declare::UNIT_OF_PRESSURES]
                .map(|marker| take_marked(marker).first().copied());
        if !required.is_empty() {
            schema.insert("required".to_owned(), required.into());
        }
        Self {
            swept,
            lists,
            pairs,
            always_pairs,
            unit_of_lengths,
            unit_of_pressures,
            names: fields::<T>(),
            schema,
        }
    }

    /// Returns the schemas of the keys by name.
    pub fn properties(&self) -> &Map<String, Value> {
        let properties = self.schema.get("properties").and_then(Value::as_object);
        properties.expect("a table is an object")
    }

    /// Returns the names of the keys in alphabetical order.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.properties().keys().map(String::as_str)
    }

    /// Returns whether the table has a key of this name.
    pub fn has(&self, key: &str) -> bool {
        self.properties().contains_key(key)
    }

    /// Returns whether a key takes a number or a pair.
    pub fn takes_pairs(&self, key: &str) -> bool {
        self.pairs.contains(&key) || self.always_pairs.contains(&key)
    }

    /// Returns the description of a key, such as `hurst` or `loads.from`, for messages.
    pub fn doc(&self, path: &str) -> Option<String> {
        let about = self.declared(path)?.get("description")?.as_str()?;
        Some(format!("`{path}`: {about}"))
    }

    /// Returns the declared default of a key, if it has one.
    ///
    /// # Panics
    /// If the default does not have the type `T`, which is a mistake in the declaration.
    pub fn default_of<T: DeserializeOwned>(&self, path: &str) -> Option<T> {
        let default = self.declared(path)?.get("default")?.clone();
        Some(serde_json::from_value(default).expect("a declared default has the type of its key"))
    }

    /// Returns the declared default of a key, if it has one that is a number.
    pub fn default_number(&self, path: &str) -> Option<f64> {
        self.declared(path)?.get("default")?.as_f64()
    }

    /// Returns the schema of a key, or of a key of an inner table, such as `loads.from`.
    fn declared(&self, path: &str) -> Option<&Value> {
        let mut names = path.split('.');
        let first = self.properties().get(names.next()?)?;
        names.try_fold(first, |schema, name| {
            let tables = alternatives(schema).into_iter().flat_map(|one| match one.get("items") {
                Some(items) => alternatives(items),
                None => vec![one],
            });
            tables.into_iter().find_map(|table| table["properties"].get(name))
        })
    }
}

/// Removes the number format from a schema and puts its description on one line.
fn tidy(schema: &mut Schema) {
    schema.remove("format");
    if let Some(Value::String(about)) = schema.get_mut("description") {
        *about = about.replace('\n', " ");
    }
}

/// Returns the names of the fields of a struct in the order of their declaration, which a schema
/// does not keep.
fn fields<T: DeserializeOwned>() -> &'static [&'static str] {
    struct Fields<'a>(&'a mut &'static [&'static str]);

    impl<'de> Deserializer<'de> for Fields<'_> {
        type Error = Error;

        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
            Err(serde::de::Error::custom("only the names of fields are needed"))
        }

        fn deserialize_struct<V: Visitor<'de>>(
            self,
            _: &'static str,
            fields: &'static [&'static str],
            visitor: V,
        ) -> Result<V::Value, Error> {
            *self.0 = fields;
            self.deserialize_any(visitor)
        }

        forward_to_deserialize_any! {
            bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf
            option unit unit_struct newtype_struct seq tuple tuple_struct map enum identifier
            ignored_any
        }
    }

    let mut fields: &'static [&'static str] = &[];
    let names_only = T::deserialize(Fields(&mut fields));
    debug_assert!(names_only.is_err());
    fields
}
