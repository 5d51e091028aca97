//! The one setting that claims rest on.
//!
//! Spectra are compared with each other, and so are meshes and corrections. Whatever else a study
//! varies – tolerance, modulus, slope, method – would put the same surfaces beside themselves, or
//! make one curve of two: claims rest on one such setting and name the rows that they leave out.

use std::cmp::Reverse;
use std::fmt;

use arrow::array::Array;

use asperity_stages::columns::*;
use asperity_stages::ensemble::{Point, grouped};
use asperity_stages::solve::GIVEN_UP;
use asperity_tables::column::{Role, Value};
use asperity_tables::table::Table;

/// Parameters that claims compare.
const COMPARED: [&str; 9] = [
    HURST.name,
    K_LOWER.name,
    K_ROLLOFF.name,
    K_UPPER.name,
    NODES.name,
    NODES_X.name,
    NODES_Y.name,
    CORRECTION.name,
    COEFFICIENT.name,
];

/// Parameters of a grain. A ratio of 1 stands for isotropic surfaces, as null does.
const OF_GRAIN: [&str; 2] = [ANISOTROPY_RATIO.name, ANISOTROPY_ANGLE.name];

/// What tells of surfaces that no claim is about.
const NOT_COMPARED: [&str; 4] =
    [METHOD.name, ANISOTROPY_RATIO.name, ANISOTROPY_ANGLE.name, INTERACTION.name];

/// Columns of properties that surfaces must not have for claims on areas: a grain, and contacts of
/// an asperity model. Null, or a ratio of 1, stands for a surface without the property.
const WITHOUT: [&str; 2] = [ANISOTROPY_RATIO.name, INTERACTION.name];

/// What all rows have in common that claims rest on, and what is left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Setting {
    /// The parameters that claims do not compare.
    pub point: Point,
    /// Rows in other settings.
    pub left_out: Vec<LeftOut>,
}

/// Rows that no claim looks at.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Where they differ from the setting.
    pub differs: Point,
    /// How many there are.
    pub rows: usize,
}

impl Setting {
    /// The setting of most rows of random isotropic surfaces in these tables; of several, the one of the
    /// tightest tolerance, or else the first.
    pub fn of<'a>(tables: impl IntoIterator<Item = &'a Table>) -> Setting {
        let mut settings = Counts::default();
        let mut not_drawn = Counts::default();
        for table in tables {
            let parameters = table.in_role(Role::Parameter);
            for rows in grouped(&parameters) {
                let point = Point::of_row(&parameters, rows[0]);
                let is_meant = WITHOUT.iter().all(|name| is_without(name, point.get(name)));
                match point.get(HURST.name).filter(|_| is_meant) {
                    Some(_) => {
                        let point = point.without(&COMPARED).without(&OF_GRAIN);
                        settings.add(point, rows.len());
                    }
                    None => not_drawn.add(point.only(&NOT_COMPARED), rows.len()),
                }
            }
        }
        let chosen = settings.0.iter().min_by_key(|(point, rows)| {
            let tolerance = point.get(TOLERANCE.name).cloned();
            (Reverse(*rows), tolerance)
        });
        let chosen = chosen.map(|(point, _)| point.clone()).unwrap_or_default();
        let others = settings.0.into_iter().chain(not_drawn.0);
        let others = others.filter(|(point, _)| *point != chosen);
        let left_out = others.map(|(point, rows)| LeftOut { differs: point.beyond(&chosen), rows });
        Setting { left_out: left_out.collect(), point: chosen }
    }

    /// The rows of a table that are in the setting, as far as it has its columns; none of surfaces
    /// with a grain, which no claim is about, or of asperity models ([`of_asperities`]).
    pub fn rows(&self, table: &Table) -> Table {
        self.rows_of_any(table, &WITHOUT)
    }

    /// The rows that are in the setting and are without some properties ([`is_without`]).
    fn rows_of_any(&self, table: &Table, without: &[&str]) -> Table {
        let batch = table.batch();
        let asked = self.point.iter();
        let asked = asked.filter_map(|(name, value)| Some((batch.column_by_name(name)?, value)));
        let mut rows: Vec<usize> = (0..table.rows()).collect();
        for name in without {
            if let Some(column) = batch.column_by_name(name) {
                rows.retain(|&row| is_without(name, Value::of(column, row).as_ref()));
            }
        }
        for (column, value) in asked {
            rows.retain(|&row| Value::of(column, row).as_ref() == Some(value));
        }
        table.pick(&rows)
    }
}

/// Returns whether a value of a column stands for a surface without the property.
fn is_without(name: &str, value: Option<&Value>) -> bool {
    value.is_none_or(|value| name == ANISOTROPY_RATIO.name && *value == Value::Real(1.0))
}

/// The rows of a table that are of asperity models, on surfaces in the setting: how these are solved
/// besides is another matter. Loads that were given up are not among them, for their forces are far from
/// balanced.
pub fn of_asperities(table: &Table, setting: &Setting) -> Table {
    let Some(interactions) = table.batch().column_by_name(INTERACTION.name) else {
        return table.pick(&[]);
    };
    let stops = table.texts(STOP.name).ok();
    let is_given_up = |row| stops.is_some_and(|stops| stops.value(row) == GIVEN_UP);
    let rows: Vec<usize> =
        (0..table.rows()).filter(|&row| interactions.is_valid(row) && !is_given_up(row)).collect();
    let of_surfaces = Setting {
        point: setting.point.clone().without(&[TOLERANCE.name, MAX_PAIRS.name]),
        left_out: Vec::new(),
    };
    of_surfaces.rows_of_any(&table.pick(&rows), &[ANISOTROPY_RATIO.name])
}

/// Points in order of appearance, each with its number of rows.
#[derive(Default)]
struct Counts(Vec<(Point, usize)>);

impl Counts {
    fn add(&mut self, point: Point, rows: usize) {
        match self.0.iter_mut().find(|(known, _)| *known == point) {
            Some((_, count)) => *count += rows,
            None => self.0.push((point, rows)),
        }
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} rows with {}", self.rows, self.differs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_with_a_ratio_of_one_are_isotropic() {
        let surface = |grain: Option<[f64; 2]>| {
            let mut columns = vec![(HURST, Value::Real(0.8))];
            let grain = grain.map(|grain| grain.map(Value::Real)).into_iter();
            columns.extend(
                grain.flat_map(|grain| [ANISOTROPY_RATIO, ANISOTROPY_ANGLE].into_iter().zip(grain)),
            );
            Table::row(&columns)
        };
        let tables = [None, Some([1.0, 0.0]), Some([6.0, 0.0])].map(surface);
        let setting = Setting::of(&tables);
        assert_eq!(tables.each_ref().map(|table| setting.rows(table).rows()), [1, 1, 0]);
        let [left_out] = &setting.left_out[..] else { panic!("{:?}", setting.left_out) };
        assert_eq!(left_out.rows, 1);
    }
}
