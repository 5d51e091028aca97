//! Names of the units of length and pressure of a table, for headers, axes and messages.
//!
//! Columns declare their units in terms of `length` and `pressure`: `1/length²`. A table names the
//! units that these words stand for in the columns `unit` and `pressure_unit`.

use arrow::datatypes::{Field, Schema};

use crate::columns::{EFFECTIVE_MODULUS, PRESSURE_UNIT, UNIT};
use asperity_manifest::keys::quantity::Unit;
use asperity_tables::column::Description;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;
use asperity_tables::table::Table;
use asperity_topography_files::length_ratio;

/// Units of columns that do not follow from the units of length and pressure of a table.
const ABSOLUTE: [&str; 7] = ["N", "K/W", "W/(m K)", "W/(m² K)", "Ω", "Ω m", "Ω m²"];

/// Unit of an energy per area in the declarations of columns.
const WORK: &str = "pressure × length";

/// Parameters of recipes that are lengths in the unit of the surface.
const LENGTHS: [&str; 6] = ["side", "rms_height", "radius", "amplitude", "depth", "high_pass"];
/// Parameters of recipes that are loads in the unit of the manifest.
const LOADS: [&str; 2] = ["loads", "pressures"];

/// Returns the unit of a parameter of a recipe, if the manifest names one. `text` returns the text
/// that another parameter of the recipe is.
pub fn unit_of_parameter(name: &str, text: impl Fn(&str) -> Option<String>) -> Option<String> {
    let is_absolute = || text("load_unit").is_some_and(|unit| unit == "absolute");
    let are_lengths = || text("control").is_some_and(|control| control != "load");
    match name {
        _ if LENGTHS.contains(&name) => text("unit"),
        "effective_modulus" => text("pressure_unit"),
        "loads" if are_lengths() => text("unit"),
        _ if LOADS.contains(&name) && is_absolute() => text("pressure_unit"),
        _ => None,
    }
}

/// The units of length and pressure that all rows of a table share.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableUnits {
    /// Unit of length; `None` if the table names none, or several.
    pub length: Option<String>,
    /// Unit of pressure; `None` if the table names none, or several.
    pub pressure: Option<String>,
}

impl TableUnits {
    /// Reads the units of a table: those of its rows or, if no column holds them, those that the
    /// descriptions of its columns name.
    pub fn from_table(table: &Table) -> TableUnits {
        let schema = table.batch().schema();
        let unit = |column: &str, dimension: &str| {
            if table.has(column) { common(table, column) } else { named_in(&schema, dimension) }
        };
        TableUnits {
            length: unit(UNIT.name, "length"),
            pressure: unit(PRESSURE_UNIT.name, "pressure"),
        }
    }

    /// Reads the units of a table that is read in parts.
    ///
    /// # Errors
    /// If the table cannot be read.
    pub fn from_source(source: &TableSource) -> Result<TableUnits, StoreError> {
        let schema = source.schema();
        let unit = |column: &str, dimension: &str| -> Result<Option<String>, StoreError> {
            let Ok(index) = schema.index_of(column) else {
                return Ok(named_in(&schema, dimension));
            };
            Ok(common(&source.first(&[index], source.rows())?, column))
        };
        Ok(TableUnits {
            length: unit(UNIT.name, "length")?,
            pressure: unit(PRESSURE_UNIT.name, "pressure")?,
        })
    }

    /// Returns whether a unit of length or of pressure is known.
    pub fn has_any(&self) -> bool {
        self.length.is_some() || self.pressure.is_some()
    }

    /// Returns these units, and those of `other` where the table names none.
    pub fn or(self, other: &TableUnits) -> TableUnits {
        TableUnits {
            length: self.length.or_else(|| other.length.clone()),
            pressure: self.pressure.or_else(|| other.pressure.clone()),
        }
    }

    /// Returns the units that all tables share.
    pub fn common<'a>(tables: impl IntoIterator<Item = &'a TableUnits>) -> TableUnits {
        let all: Vec<&TableUnits> = tables.into_iter().collect();
        TableUnits {
            length: shared(all.iter().map(|units| units.length.as_deref())),
            pressure: shared(all.iter().map(|units| units.pressure.as_deref())),
        }
    }

    /// Returns the unit of a column with the names of the units of length and pressure:
    /// `1/length²` becomes `1/µm²`, and `pressure × length` becomes `J/m²`.
    pub fn name(&self, unit: &str) -> String {
        let unit = match self.work() {
            Some(work) => unit.replace(WORK, work),
            None => unit.to_owned(),
        };
        let named = [("length", &self.length), ("pressure", &self.pressure)];
        named.into_iter().fold(unit, |unit, (word, name)| match name {
            Some(name) => {
                let below = if name.contains('/') { format!("({name})") } else { name.clone() };
                unit.replace(&format!("/{word}"), &format!("/{below}")).replace(word, name)
            }
            None => unit,
        })
    }

    /// Returns the name of the unit that the head of a printed column shows. Returns `None` if the
    /// table does not name the unit of length or pressure on which it depends.
    ///
    /// A table in µm or MPa shows all units, because reduced numbers would be read as such.
    pub fn shown(&self, unit: &str) -> Option<String> {
        let named = self.name(unit);
        let has_unit = !["", "1"].contains(&unit);
        let is_shown = named != unit || ABSOLUTE.contains(&unit) || (has_unit && self.has_any());
        is_shown.then_some(named)
    }

    /// Returns the unit that the head of a column shows: the one that its table has named, or that
    /// of [`TableUnits::shown`].
    pub fn shown_of(&self, field: &Field) -> Option<String> {
        let declared = Description::from(field).unit;
        let named = Some(Description::in_units(field).unit).filter(|unit| *unit != declared);
        let is_number = named.as_deref() == Some("1");
        if is_number { None } else { named.or_else(|| self.shown(&declared)) }
    }

    /// Returns the unit of a column of `table`, if it is one that quantities can be converted to.
    pub fn of_column(&self, table: &Table, column: &str) -> Option<&'static Unit> {
        let field = table.batch().schema_ref().field_with_name(column).ok()?;
        Unit::find(&self.shown_of(field)?)
    }

    /// Returns the unit of the product of a pressure and a length, if it has a name of its own.
    fn work(&self) -> Option<&'static str> {
        let pressure = Unit::find(self.pressure.as_deref()?)?;
        let length = Unit::find(self.length.as_deref()?)?;
        Unit::of_product(pressure, length).map(|unit| unit.symbol)
    }
}

/// Smallest E* that is assumed to be in pascals, with a known unit of length and without.
const LEAST_MODULUS_IN_PASCALS: [f64; 2] = [1e6, 1e8];

/// Returns the unit of the pressures in the first row of a table, if it is named or assumed.
pub fn pressure_unit(table: &Table) -> Option<String> {
    if let Ok(units) = table.texts(PRESSURE_UNIT.name) {
        return units.iter().next().flatten().map(str::to_owned);
    }
    let modulus = table.reals(EFFECTIVE_MODULUS.name).ok()?.iter().next()??;
    assumed_pressure_unit(modulus, length_unit(table).as_deref()).map(str::to_owned)
}

/// Returns the unit of length in the first row of a table.
pub fn length_unit(table: &Table) -> Option<String> {
    let unit = table.texts(UNIT.name).ok()?.iter().next()?;
    unit.filter(|unit| !unit.is_empty()).map(str::to_owned)
}

/// Returns the pascal if a modulus without a unit is assumed to be in pascals, because it is large.
pub fn assumed_pressure_unit(modulus: f64, length_unit: Option<&str>) -> Option<&'static str> {
    let is_known = length_unit.is_some_and(|unit| length_ratio(unit, "m").is_some());
    (modulus >= LEAST_MODULUS_IN_PASCALS[usize::from(!is_known)]).then_some("Pa")
}

/// Returns the unit that a column of this dimension has in the descriptions of a table.
fn named_in(schema: &Schema, dimension: &str) -> Option<String> {
    let mut fields = schema.fields().iter();
    let field = fields.find(|field| Description::from(field.as_ref()).unit == dimension)?;
    Some(Description::in_units(field).unit).filter(|unit| unit != dimension)
}

/// Returns the text that all rows of a column have, if it is not empty.
fn common(table: &Table, column: &str) -> Option<String> {
    shared(table.texts(column).ok()?.iter())
}

/// Returns the text that all have, if it is not empty.
pub fn shared<'a>(texts: impl IntoIterator<Item = Option<&'a str>>) -> Option<String> {
    let mut known = texts.into_iter().map(|text| text.filter(|text| !text.is_empty()));
    let first = known.next().flatten()?;
    known.all(|other| other == Some(first)).then(|| first.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{LOAD, PRESSURE};
    use crate::output_units::Conversion;
    use asperity_tables::column::{reals, texts};

    #[test]
    fn units_are_named_if_all_rows_share_them() {
        let table = |units: [&str; 2]| {
            Table::new(2, vec![(UNIT, texts(units)), (PRESSURE_UNIT, texts(["MPa", "MPa"]))])
        };
        let units = TableUnits::from_table(&table(["µm", "µm"]));
        assert_eq!(units.name("1/length²"), "1/µm²");
        assert_eq!(units.name("pressure × length"), "J/m²");
        let [length, pressure] = ["cm", "MPa"].map(|unit| Some(unit.to_owned()));
        assert_eq!(TableUnits { length, pressure }.name("pressure × length"), "MPa × cm");
        let [length, pressure] = ["µm", "N/mm²"].map(|unit| Some(unit.to_owned()));
        assert_eq!(TableUnits { length, pressure }.name("1/pressure"), "1/(N/mm²)");
        assert_eq!(units.name("E* × rms slope"), "E* × rms slope");
        assert_eq!(units.shown("E* × rms slope").as_deref(), Some("E* × rms slope"));
        assert_eq!(TableUnits::default().shown("E* × rms slope"), None);
        let load = Table::new(1, vec![(PRESSURE, reals([2.0])), (LOAD, reals([0.1]))]);
        let in_gigapascals = TableUnits { pressure: Some("GPa".to_owned()), ..units.clone() };
        let converted = Conversion { from: in_gigapascals, to: units.clone() }.table(&load);
        assert_eq!(converted.reals("pressure").unwrap().values(), &[2000.0]);
        assert_eq!(converted.reals("load").unwrap().values(), &[0.1]);
        let mixed = TableUnits::from_source(&table(["µm", "nm"]).into()).unwrap();
        assert_eq!((mixed.length, mixed.pressure.as_deref()), (None, Some("MPa")));
    }
}
