//! Columns of published tables with reduced numbers in the units of the study:
//! `percolation_pressure` in MPa beside `percolation_load` in multiples of E* × rms slope.
//!
//! The tables of tasks hold the numbers of the theory. A reduced number that already has another
//! column in absolute units, such as `load`, gets no second one.

use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray, Float64Array};
use arrow::datatypes::{DataType, Field, Float64Type, Schema};

use crate::aggregate::Statistic;
use crate::columns::{
    EFFECTIVE_MODULUS, RESIDUAL, RMS_SLOPE, SIDE, SIDE_X, SIDE_Y, TOLERANCE,
    YIELDED_HARDNESS_REDUCED, YIELDED_LOAD,
};
use crate::fit::limits::columns::AS_QUANTITY;
use crate::units::TableUnits;
use asperity_manifest::decimal;
use asperity_tables::column::{Description, REDUCED, Role, described};
use asperity_tables::table::Table;

/// Units of the columns of a stage, and the modulus of its surfaces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageUnits {
    pub names: TableUnits,
    /// Effective modulus of all contacts of the surfaces of the stage, for tables of surfaces,
    /// which have no column of it.
    pub modulus: Option<f64>,
    /// Unit of the observable whose limit the stage fits, if it is a column.
    pub quantity: Option<String>,
}

/// Columns that publishing adds to a table, because its study names the units.
#[derive(Debug)]
pub struct AbsoluteColumns {
    columns: Vec<AbsoluteColumn>,
    modulus: Option<f64>,
}

#[derive(Debug)]
struct AbsoluteColumn {
    /// Name of the column with the reduced numbers.
    reduced: String,
    field: Field,
    scale: &'static Scale,
}

/// A unit of reduced numbers, and the absolute unit to which a factor converts them.
#[derive(Debug)]
struct Scale {
    reduced: &'static str,
    absolute: &'static str,
    factor: Factor,
    is_inverse: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Factor {
    /// E* × rms slope.
    Pressure,
    /// E* over the longer side.
    Stiffness,
}

static SCALES: [Scale; 3] = [
    Scale {
        reduced: "E* × rms slope",
        absolute: "pressure",
        factor: Factor::Pressure,
        is_inverse: false,
    },
    Scale {
        reduced: "1/(E* × rms slope)",
        absolute: "1/pressure",
        factor: Factor::Pressure,
        is_inverse: true,
    },
    Scale {
        reduced: "E*/side",
        absolute: "pressure/length",
        factor: Factor::Stiffness,
        is_inverse: false,
    },
];

/// Columns that stay reduced: settings and errors of the solver, and pressures that are divided by
/// the rms slope of another surface than that of the row.
const REDUCED_ONLY: [&str; 4] =
    [TOLERANCE.name, RESIDUAL.name, YIELDED_LOAD.name, YIELDED_HARDNESS_REDUCED.name];

impl AbsoluteColumns {
    /// Finds the columns to add to a table, which may be empty and whose columns have units.
    pub fn new(table: &Table, units: &StageUnits) -> AbsoluteColumns {
        let modulus = units.modulus.filter(|_| !table.has(EFFECTIVE_MODULUS.name));
        let has_modulus = modulus.is_some() || table.has(EFFECTIVE_MODULUS.name);
        let is_known = |factor: Factor| {
            has_modulus
                && units.names.pressure.is_some()
                && match factor {
                    Factor::Pressure => table.has(RMS_SLOPE.name),
                    Factor::Stiffness => {
                        units.names.length.is_some()
                            && (table.has(SIDE.name) || table.has(SIDE_X.name))
                    }
                }
        };
        let fields = table.batch().schema_ref().fields().iter();
        let columns = fields.filter_map(|field| {
            let Description { name, unit: declared, .. } = Description::from(field.as_ref());
            let quantity = units.quantity.as_ref().filter(|_| declared == AS_QUANTITY);
            let unit = quantity.unwrap_or(&declared);
            let mut scales = SCALES.iter().filter(|scale| is_known(scale.factor));
            let scale = scales.find(|scale| scale.reduced == *unit)?;
            let is_real = *field.data_type() == DataType::Float64;
            let absolute = absolute_name(&name);
            if !is_real || REDUCED_ONLY.contains(&&*name) || table.has(&absolute) {
                return None;
            }
            let role = match Role::from_field(field) {
                Some(role) if role.is_coordinate() => Role::Derived,
                _ => Role::Result,
            };
            let words = described(role, scale.absolute, &scale.meaning(&name));
            let field = Field::new(absolute, DataType::Float64, true)
                .with_metadata(words.with(REDUCED, &*name));
            Some(AbsoluteColumn { reduced: name, field, scale })
        });
        AbsoluteColumns { columns: columns.collect(), modulus }
    }

    /// Returns the modulus from which columns are computed if the table has no column with it.
    pub fn modulus(&self) -> Option<f64> {
        self.modulus
    }

    /// Returns a table with the added columns, each after the column with the reduced numbers.
    pub fn beside(&self, table: &Table) -> Table {
        if self.columns.is_empty() {
            return table.clone();
        }
        let (mut fields, mut arrays) = (Vec::new(), Vec::new());
        for (field, array) in
            table.batch().schema_ref().fields().iter().zip(table.batch().columns())
        {
            fields.push(field.clone());
            arrays.push(array.clone());
            let added = self.columns.iter().find(|column| column.reduced == *field.name());
            if let (Some(added), Some(reduced)) = (added, array.as_primitive_opt::<Float64Type>()) {
                fields.push(Arc::new(added.field.clone()));
                arrays.push(self.absolute(added.scale, reduced, table));
            }
        }
        Table::from_arrays(table.rows(), Schema::new(fields), arrays)
    }

    fn absolute(&self, scale: &Scale, reduced: &Float64Array, table: &Table) -> ArrayRef {
        let reals = |name: &str| table.reals(name).ok();
        let [moduli, slopes] = [EFFECTIVE_MODULUS.name, RMS_SLOPE.name].map(reals);
        let sides = [SIDE.name, SIDE_X.name, SIDE_Y.name].map(reals);
        let value = |column: Option<&Float64Array>, row: usize| {
            column.filter(|column| column.is_valid(row)).map(|column| column.value(row))
        };
        let factor = |row: usize| {
            let modulus = value(moduli, row).or(self.modulus)?;
            let factor = match scale.factor {
                // The pressures of a flat surface are in units of E*.
                Factor::Pressure => match value(slopes, row)? {
                    slope if slope > 0.0 => modulus * slope,
                    _ => modulus,
                },
                Factor::Stiffness => {
                    modulus / sides.iter().filter_map(|side| value(*side, row)).reduce(f64::max)?
                }
            };
            Some(if scale.is_inverse { 1.0 / factor } else { factor })
        };
        let numbers = reduced.iter().enumerate();
        // Rounded like the mean pressure, so that limits of loads come back as they were written.
        let rounded =
            |(row, number): (usize, Option<f64>)| Some(decimal::nearest(number? * factor(row)?));
        Arc::new(Float64Array::from_iter(numbers.map(rounded)))
    }
}

impl Scale {
    fn meaning(&self, reduced: &str) -> String {
        if self.is_inverse {
            format!("`{reduced}` divided by {}", self.reduced.trim_start_matches("1/"))
        } else {
            format!("`{reduced}` × {}", self.reduced)
        }
    }
}

/// Returns the name of the column with the absolute numbers: `percolation_pressure`, `hardness` and
/// `stiffness_absolute_mean` for `percolation_load`, `hardness_reduced` and `stiffness_mean`.
fn absolute_name(reduced: &str) -> String {
    let words: Vec<&str> = reduced.split('_').collect();
    if words.contains(&"load") {
        let named = words.iter().map(|word| if *word == "load" { "pressure" } else { word });
        return named.collect::<Vec<_>>().join("_");
    }
    let ends = reduced.match_indices('_').map(|(at, _)| reduced.split_at(at));
    let is_statistic = |(_, end): &(&str, &str)| {
        let word = end[1..].trim_end_matches("_lower").trim_end_matches("_upper");
        // Multilevel means have statistics of each mesh and of differences.
        let of = ["plain_", "difference_"].iter().find_map(|of| word.strip_prefix(of));
        Statistic::named(of.unwrap_or(word)).is_some()
    };
    let (base, statistic) = ends.into_iter().find(is_statistic).unwrap_or((reduced, ""));
    match base.strip_suffix("_reduced") {
        Some(absolute) => format!("{absolute}{statistic}"),
        None => format!("{base}_absolute{statistic}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{FROZEN_STIFFNESS, FULL_CONTACT_LOAD, LOAD, PRESSURE, PRESSURE_DENSITY};
    use asperity_tables::column::{Column, optional_reals, reals};

    fn units(modulus: Option<f64>) -> StageUnits {
        let [length, pressure] = ["µm", "MPa"].map(|unit| Some(unit.to_owned()));
        StageUnits { names: TableUnits { length, pressure }, modulus, quantity: None }
    }

    fn with(extra: Vec<(Column, ArrayRef)>) -> Table {
        let rows = [
            (RMS_SLOPE, reals([0.1, 0.0])),
            (FULL_CONTACT_LOAD, optional_reals([Some(2.0), None])),
            (PRESSURE_DENSITY, reals([3.0, 3.0])),
            (FROZEN_STIFFNESS, reals([5.0, 5.0])),
        ];
        Table::new(2, extra.into_iter().chain(rows).collect())
    }

    fn added(table: &Table, units: &StageUnits) -> Vec<(String, Vec<Option<f64>>)> {
        let columns = AbsoluteColumns::new(table, units);
        let all = columns.beside(table);
        let names = all.names().into_iter().filter(|name| !table.has(name));
        names.map(|name| (name.to_owned(), all.reals(name).unwrap().iter().collect())).collect()
    }

    #[test]
    fn reduced_numbers_are_multiplied_by_the_scales_of_their_rows() {
        let table = with(vec![
            (EFFECTIVE_MODULUS, reals([1000.0, 2000.0])),
            (SIDE, optional_reals([Some(50.0), None])),
            (SIDE_X, optional_reals([None, Some(10.0)])),
            (SIDE_Y, optional_reals([None, Some(20.0)])),
        ]);
        let expected = [
            ("full_contact_pressure", [Some(200.0), None]),
            ("pressure_density_absolute", [Some(0.03), Some(0.0015)]),
            ("stiffness_absolute", [Some(100.0), Some(500.0)]),
        ];
        let expected = expected.map(|(name, values)| (name.to_owned(), values.to_vec()));
        assert_eq!(added(&table, &units(None)), expected);
        assert_eq!(added(&table, &StageUnits::default()), []);
    }

    #[test]
    fn tables_of_surfaces_use_the_modulus_of_their_contacts() {
        let names = |table: &Table, units: &StageUnits| -> Vec<String> {
            added(table, units).into_iter().map(|(name, _)| name).collect()
        };
        let expected = ["full_contact_pressure", "pressure_density_absolute"];
        assert_eq!(names(&with(vec![]), &units(Some(1000.0))), expected);
        assert!(names(&with(vec![]), &units(None)).is_empty());
    }

    #[test]
    fn a_load_that_is_given_as_a_pressure_too_gets_no_second_one() {
        let loads = vec![(LOAD, reals([1.0, 2.0])), (PRESSURE, reals([9.0, 9.0]))];
        let names = added(&with(loads), &units(Some(1.0)));
        assert!(names.iter().all(|(name, _)| name.starts_with("full") || name.ends_with("lute")));
    }

    #[test]
    fn statistics_stand_at_the_end_of_names() {
        for (reduced, absolute) in [
            ("percolation_load_x_lower", "percolation_pressure_x_lower"),
            ("hardness_reduced", "hardness"),
            ("stiffness", "stiffness_absolute"),
            ("stiffness_mean", "stiffness_absolute_mean"),
            ("stiffness_plain_mean", "stiffness_absolute_plain_mean"),
            ("stiffness_ci95_lower", "stiffness_absolute_ci95_lower"),
            ("window_lower", "window_lower_absolute"),
        ] {
            assert_eq!(absolute_name(reduced), absolute);
        }
    }
}
