//! Loads without a unit that override pressures of an extended manifest, for a warning.

use toml::de::{DeTable, DeValue};

use super::{Composition, Source, TomlSpanned};
use asperity_manifest::keys::quantity::{self, Dimension, Unit};

/// Numbers without a unit that override the pressures in the loads of a stage.
#[derive(Debug, Clone, PartialEq)]
pub struct PlainLoads {
    pub stage: String,
    /// Overridden key: `loads`, or a parameter that the loads use.
    pub key: String,
    /// File, line and column of the numbers.
    pub place: String,
    /// The first number, as the manifest writes it.
    pub number: String,
    /// The first overridden pressure, as its manifest writes it.
    pub pressure: String,
    /// Unit of the overridden pressure.
    pub unit: &'static str,
    /// Name of the manifest with the overridden pressure.
    pub overridden: String,
}

type Value<'i> = TomlSpanned<DeValue<'i>>;

impl Composition {
    /// Returns the loads without a unit that override pressures, of stages without `load_unit`.
    /// `document` is the result of [`Composition::document`].
    pub(super) fn plain_loads(&self, document: &DeTable<'_>) -> Vec<PlainLoads> {
        let stages = document.get("stage").and_then(|stages| stages.get_ref().as_table());
        let mut found = Vec::new();
        for (key, stage) in stages.into_iter().flatten() {
            let keys = stage.get_ref().as_table();
            let Some(stage) = keys.filter(|keys| !keys.contains_key("load_unit")) else {
                continue;
            };
            let Some(loads) = stage.get("loads") else { continue };
            let name = key.get_ref().as_ref();
            found.extend(self.overriding(name, &["stage", name, "loads"]));
            for word in scalars(loads).into_iter().filter_map(|value| value.get_ref().as_str()) {
                found.extend(self.overriding(name, &["parameters", word.trim()]));
            }
        }
        found
    }

    /// Returns the plain numbers at a path of keys if they override pressures.
    fn overriding(&self, stage: &str, path: &[&str]) -> Option<PlainLoads> {
        let documents = self.sources.iter().rev();
        let parsed = documents.map(|source| (source, DeTable::parse_recoverable(&source.padded).0));
        let documents: Vec<_> = parsed.collect();
        let mut values = documents.iter().filter_map(|(source, document)| {
            let mut table = document.get_ref();
            let (last, tables) = path.split_last()?;
            for key in tables {
                table = table.get(*key)?.get_ref().as_table()?;
            }
            Some((*source, scalars(table.get(*last)?)))
        });
        let (own, numbers) = values.next()?;
        let is_number =
            |value: &&&Value| value.get_ref().is_integer() || value.get_ref().is_float();
        let number = numbers.iter().find(is_number)?;
        if numbers.iter().any(|value| pressure(value).is_some()) {
            return None;
        }
        let (overridden, pressure, unit) = values.find_map(|(source, values)| {
            let (text, unit) = values.into_iter().find_map(pressure)?;
            Some((source, text, unit))
        })?;
        Some(PlainLoads {
            stage: stage.to_owned(),
            key: path[path.len() - 1].to_owned(),
            place: own.place(number),
            number: own.padded.get(number.span())?.to_owned(),
            pressure: pressure.to_owned(),
            unit: unit.symbol,
            overridden: overridden.name.clone(),
        })
    }
}

impl Source {
    /// Returns file, line and column of a value: `study.toml:12:9`.
    fn place(&self, value: &Value) -> String {
        let [line, column] = self.in_messages().line_and_column(value.span().start);
        format!("{}:{line}:{column}", self.name)
    }
}

/// Returns a pressure with its unit, if the value is one.
fn pressure<'v>(value: &'v Value) -> Option<(&'v str, &'static Unit)> {
    let text = value.get_ref().as_str()?;
    let unit = Unit::find(quantity::split(text)?.1)?;
    (unit.dimension == Dimension::Pressure).then_some((text, unit))
}

/// Returns all scalars in a value.
fn scalars<'v, 'i>(value: &'v Value<'i>) -> Vec<&'v Value<'i>> {
    match value.get_ref() {
        DeValue::Array(items) => items.iter().flat_map(scalars).collect(),
        DeValue::Table(table) => table.values().flat_map(scalars).collect(),
        _ => vec![value],
    }
}
