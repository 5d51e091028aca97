//! Conversion of tables from the units in which they are stored to those that the manifest names
//! for output.
//!
//! A conversion moves the decimal point. Coordinates are rounded to twelve digits, as in all
//! tables, so that equal coordinates stay equal. The tables of the store are never converted.

use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray, LargeListArray};
use arrow::datatypes::{DataType, Float64Type, Schema};

use crate::columns::{PRESSURE_UNIT, UNIT};
use crate::units::TableUnits;
use crate::{Kind, columns_of};
use asperity_manifest::decimal;
use asperity_manifest::keys::quantity::Unit;
use asperity_tables::column::{Description, Role, optional_reals, optional_texts};
use asperity_tables::table::Table;

/// Units of a stored table, and those in which it is shown.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Conversion {
    pub from: TableUnits,
    pub to: TableUnits,
}

/// Powers of ten by which numbers of length and pressure grow; `None` for unknown units.
type Shifts = [Option<i32>; 2];

impl TableUnits {
    /// Returns these units with `wanted` in the place of those that can be converted to it.
    pub fn in_output(self, wanted: &TableUnits) -> TableUnits {
        let shown = |from: Option<String>, to: &Option<String>| match shift(&from, to) {
            Some(_) => to.clone(),
            None => from,
        };
        TableUnits {
            length: shown(self.length, &wanted.length),
            pressure: shown(self.pressure, &wanted.pressure),
        }
    }
}

impl Conversion {
    /// Returns whether nothing is converted.
    pub fn is_none(&self) -> bool {
        let is_same = |from: &Option<String>, to: &Option<String>| to.is_none() || from == to;
        is_same(&self.from.length, &self.to.length)
            && is_same(&self.from.pressure, &self.to.pressure)
    }

    /// Names a declared unit of the converted table as [`TableUnits::name`] does. A unit that is
    /// not converted keeps its name.
    pub fn name(&self, unit: &str) -> String {
        match exponents(unit) {
            Some(_) => self.from.clone().in_output(&self.to).name(unit),
            None => self.from.name(unit),
        }
    }

    /// Returns the opposite conversion.
    pub fn reversed(&self) -> Conversion {
        if self.is_none() {
            return Conversion::default();
        }
        let from = self.from.clone().in_output(&self.to);
        Conversion { from, to: self.from.clone() }
    }

    /// Converts a table with declared units, and names the units of its columns anew where it names
    /// them. Rows that name their own unit are converted from it.
    pub fn table(&self, table: &Table) -> Table {
        if self.is_none() {
            return table.clone();
        }
        let lengths = self.by_row(table, UNIT.name, &self.from.length, &self.to.length);
        let pressures =
            self.by_row(table, PRESSURE_UNIT.name, &self.from.pressure, &self.to.pressure);
        let schema = table.batch().schema();
        let columns = schema.fields().iter().zip(table.batch().columns());
        let converted = columns.map(|(field, values)| -> ArrayRef {
            let shown = match field.name().as_str() {
                name if name == UNIT.name => Some((&lengths, &self.to.length)),
                name if name == PRESSURE_UNIT.name => Some((&pressures, &self.to.pressure)),
                _ => None,
            };
            if let (Some((shifts, unit)), Some(texts)) = (shown, values.as_string_opt::<i32>()) {
                let rows = texts.iter().zip(shifts);
                let named =
                    rows.map(
                        |(own, shift)| {
                            if shift.is_some() { unit.clone() } else { own.map(str::to_owned) }
                        },
                    );
                return optional_texts(named);
            }
            let unit = Description::from(&**field).unit;
            let by = |row: usize| [lengths[row], pressures[row]];
            if let (Some(exponents), Some(lists)) = (exponents(&unit), values.as_list_opt::<i64>())
            {
                return shifted_lists(lists, exponents, by);
            }
            let (Some(exponents), Some(numbers)) =
                (exponents(&unit), values.as_primitive_opt::<Float64Type>())
            else {
                return values.clone();
            };
            let is_coordinate = Role::from_field(field).is_some_and(Role::is_coordinate);
            let rows = numbers.iter().enumerate();
            optional_reals(
                rows.map(|(row, number)| Some(shifted(number?, exponents, by(row), is_coordinate))),
            )
        });
        let numbers = Table::from_arrays(table.rows(), Schema::clone(&schema), converted.collect());
        numbers.with_fields(|field| {
            let declared = Description::from(&field).unit;
            if Description::in_units(&field).unit == declared || exponents(&declared).is_none() {
                return field;
            }
            let metadata = field.metadata().clone().with("unit", self.name(&declared));
            field.with_metadata(metadata)
        })
    }

    /// Converts a table of the store, whose columns declare no units. `kind` is that of its stage.
    pub fn stored_table(&self, table: &Table, kind: Kind) -> Table {
        // Rows keep the coordinates of their surfaces.
        let columns = [columns_of(Kind::Generate), columns_of(kind)].concat();
        self.table(&table.described_by(&Table::empty(&columns)))
    }

    /// Converts a number of a column with this declared unit.
    pub fn number(&self, number: f64, unit: &str, is_coordinate: bool) -> f64 {
        let shifts = [
            shift(&self.from.length, &self.to.length),
            shift(&self.from.pressure, &self.to.pressure),
        ];
        exponents(unit)
            .map_or(number, |exponents| shifted(number, exponents, shifts, is_coordinate))
    }

    /// Returns the power of ten of each row, from the unit in the column `name` or `from`.
    fn by_row(
        &self,
        table: &Table,
        name: &str,
        from: &Option<String>,
        to: &Option<String>,
    ) -> Vec<Option<i32>> {
        match table.texts(name) {
            Ok(units) => {
                let own = units.iter().map(|unit| unit.map(str::to_owned));
                own.map(|unit| shift(&unit, to)).collect()
            }
            Err(_) => vec![shift(from, to); table.rows()],
        }
    }
}

/// Returns the power of ten by which numbers grow in another unit; `None` if one of the units is
/// not known, or if they have different dimensions.
fn shift(from: &Option<String>, to: &Option<String>) -> Option<i32> {
    let [from, to] = [from, to].map(|unit| unit.as_deref().and_then(Unit::find));
    let (from, to) = (from?, to?);
    (from.dimension == to.dimension).then_some(from.power - to.power)
}

/// Returns the exponents of length and pressure in a declared unit: [−2, 0] for `1/length²`.
/// Returns `None` for units with other parts, and for pure numbers.
fn exponents(unit: &str) -> Option<[i32; 2]> {
    const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    // Such quantities are derivatives with respect to a reduced load.
    let quantity = unit.strip_suffix(" per load").unwrap_or(unit);
    let (above, below) = quantity.split_once('/').unwrap_or((quantity, ""));
    let mut exponents = [0, 0];
    for (part, sign) in [(above, 1), (below, -1)] {
        for factor in part.split(" × ").filter(|factor| !["", "1"].contains(factor)) {
            let words = ["length", "pressure"];
            let of = words.iter().position(|word| factor.starts_with(word))?;
            let raised = factor.trim_start_matches(words[of]);
            let exponent = match raised.chars().next() {
                None => 1,
                Some(letter) => RAISED.chars().position(|digit| digit == letter)? as i32,
            };
            exponents[of] += sign * exponent;
        }
    }
    (exponents != [0, 0]).then_some(exponents)
}

/// Converts the numbers of lists, of which each belongs to a row.
fn shifted_lists(
    lists: &LargeListArray,
    exponents: [i32; 2],
    by: impl Fn(usize) -> Shifts,
) -> ArrayRef {
    let DataType::LargeList(element) = lists.data_type() else { return Arc::new(lists.clone()) };
    let Some(numbers) = lists.values().as_primitive_opt::<Float64Type>() else {
        return Arc::new(lists.clone());
    };
    let mut shown: Vec<Option<f64>> = numbers.iter().collect();
    for (row, ends) in lists.offsets().windows(2).enumerate() {
        for number in shown[ends[0] as usize..ends[1] as usize].iter_mut().flatten() {
            *number = shifted(*number, exponents, by(row), false);
        }
    }
    let (offsets, nulls) = (lists.offsets().clone(), lists.nulls().cloned());
    Arc::new(LargeListArray::new(element.clone(), offsets, optional_reals(shown), nulls))
}

/// Converts a number. A number whose unit is not known stays as it is.
fn shifted(number: f64, exponents: [i32; 2], by: Shifts, is_coordinate: bool) -> f64 {
    let powers = exponents.iter().zip(by).map(|(exponent, shift)| match (exponent, shift) {
        (0, _) => Some(0),
        (exponent, shift) => shift.map(|shift| exponent * shift),
    });
    let converted = match powers.sum::<Option<i32>>() {
        None | Some(0) => return number,
        // Powers of ten up to 10²² are exact, so one operation rounds once.
        Some(power) if power > 0 => number * decimal::shifted("1", power),
        Some(power) => number / decimal::shifted("1", -power),
    };
    if is_coordinate { decimal::nearest(converted) } else { converted }
}

#[cfg(test)]
mod tests {
    use asperity_tables::column::{Column, ColumnKind, reals, texts};

    use super::*;

    fn units(length: Option<&str>, pressure: Option<&str>) -> TableUnits {
        TableUnits { length: length.map(str::to_owned), pressure: pressure.map(str::to_owned) }
    }

    #[test]
    fn lengths_pressures_and_their_products_are_converted_row_by_row() {
        let column = |name, unit| Column::result(name, ColumnKind::Real, unit, "");
        let names = [
            ("rms_height", "length"),
            ("area", "length²"),
            ("density", "1/length²"),
            ("peak", "pressure"),
            ("energy", "pressure × length"),
            ("load", "E* × rms slope"),
            ("hurst", "1"),
        ];
        let numbers = names.map(|(name, unit)| (column(name, unit), reals([2.0, 2.0])));
        let mut columns = vec![(UNIT, texts(["m", "nm"])), (PRESSURE_UNIT, texts(["GPa", "Pa"]))];
        columns.extend(numbers);
        let conversion =
            Conversion { from: units(None, None), to: units(Some("µm"), Some("MPa")) };
        let table = conversion.table(&Table::new(2, columns));
        let values = |name: &str| [0, 1].map(|row| table.reals(name).unwrap().value(row));
        assert_eq!(values("rms_height"), [2e6, 2e-3]);
        assert_eq!(values("area"), [2e12, 2e-6]);
        assert_eq!(values("density"), [2e-12, 2e6]);
        assert_eq!(values("peak"), [2e3, 2e-6]);
        assert_eq!(values("energy"), [2e9, 2e-9]);
        assert_eq!([values("load"), values("hurst")], [[2.0; 2]; 2]);
        let named = TableUnits::from_table(&table);
        assert_eq!(named, units(Some("µm"), Some("MPa")));
    }

    #[test]
    fn unknown_units_stay_and_a_conversion_can_be_reversed() {
        let conversion = Conversion {
            from: units(Some("px"), Some("GPa")),
            to: units(Some("µm"), Some("MPa")),
        };
        assert_eq!(conversion.number(2.0, "length", false), 2.0);
        assert_eq!(conversion.number(0.07, "pressure", true), 70.0);
        let back = conversion.reversed();
        assert_eq!(back.number(70.0, "pressure", true), 0.07);
        assert_eq!(back.number(2.0, "length", true), 2.0);
        let shown = units(Some("px"), Some("GPa")).in_output(&conversion.to);
        assert_eq!(shown, units(Some("px"), Some("MPa")));
    }
}
