//! Labels of axes and legends: names and symbols of the columns of tables, with their units.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use asperity_stages::columns::{CONTENT, LOAD, SPECTRUM_OF, TANGENTIAL_LOAD, UNIT};
use asperity_stages::ensemble::grouped;
use asperity_stages::units::TableUnits;
use asperity_tables::column::{Description, Value};
use asperity_tables::table::{Table, TableError};

use crate::loads;
use crate::points;
use crate::units::{Scaled, Unit, Units, prefixed};

/// Names of the files of measured surfaces, by the hash of their content.
pub type Files = BTreeMap<String, String>;

/// Labels of the axes of columns, and their symbols.
static KNOWN: LazyLock<BTreeMap<String, [String; 2]>> = LazyLock::new(|| {
    toml::from_str(include_str!("labels.toml")).expect("the file is part of the program")
});

/// Returns the label of an axis of a column, without its unit.
pub fn name(column: &str) -> String {
    let column = &*column.replace("_absolute", "");
    if let Some([label, _]) = KNOWN.get(column) {
        return label.clone();
    }
    // A statistic of a column, such as `area_fraction_q05`.
    let starts = column.rmatch_indices('_').map(|(at, _)| (&column[..at], &column[at + 1..]));
    for (base, statistic) in starts {
        if let Some([label, _]) = KNOWN.get(base) {
            return format!("{label}, {}", statistic.replace('_', " "));
        }
    }
    column.replace('_', " ")
}

/// Returns the symbol of a column for legends and titles of panels.
pub fn symbol(column: &str) -> String {
    KNOWN.get(column).map_or(column, |[_, symbol]| symbol).to_owned()
}

/// Returns the unit of a column of a table; empty for pure numbers and texts.
pub fn unit(table: &Table, column: &str) -> String {
    let field = table.batch().schema_ref().field_with_name(column);
    let unit = field.map(|field| Description::from(field).unit).unwrap_or_default();
    if unit == "1" { String::new() } else { unit }
}

/// Labels of the values of the columns of a table.
pub struct Labels {
    /// Units of the columns by name.
    units: BTreeMap<String, String>,
    lengths: Unit,
    /// Unit of length of the surfaces, if all have the same.
    length: Option<String>,
    pressure: Unit,
}

impl Labels {
    /// Creates the labels of a table. `named` are the units that the manifest names for it.
    pub fn new(known: &Units, table: &Table, named: &TableUnits) -> Result<Labels, TableError> {
        let names = table.names().into_iter();
        let of_length = grouped(&table.only(&[UNIT.name, SPECTRUM_OF.name])).into_iter();
        let points = of_length.map(|rows| points::at_row(table, rows[0]));
        let units: BTreeSet<Option<String>> =
            points.map(|point| known.at(&point).map(str::to_owned)).collect();
        let mut lengths = Unit::of_lengths(units.iter().map(Option::as_deref));
        let mut length = units.first().cloned().flatten().filter(|_| units.len() == 1);
        // Rows of several stages are converted to the unit that they share.
        if lengths.name().is_none() || (units.len() > 1 && named.length.is_some()) {
            length.clone_from(&named.length);
            lengths = Unit::of_lengths([length.as_deref()]);
        }
        let mut pressure = loads::unit_of_pressures(table, known)?;
        if pressure.name().is_none() {
            pressure = Unit::of_pressures(named.pressure.as_deref().unwrap_or(""));
        }
        let units = names.map(|name| (name.to_owned(), unit(table, name)));
        Ok(Labels { units: units.collect(), lengths, length, pressure })
    }

    /// Returns whether the values of a column are quantities that another column names.
    pub fn is_unit(&self, column: &str, other: &str) -> bool {
        self.units.get(column).is_some_and(|unit| *unit == format!("as `{other}`"))
    }

    /// Returns the unit in which values of a column are shown.
    pub fn unit(&self, column: &str, values: impl Iterator<Item = f64>) -> Scaled {
        let largest = values.fold(0.0_f64, |most, value| most.max(value.abs()));
        match self.units.get(column).map(String::as_str).unwrap_or_default() {
            "pressure" => self.pressure.scaled(largest),
            "length" => {
                let factor = self.lengths.factor(self.length.as_deref());
                self.lengths.scaled(factor * largest).times(factor)
            }
            // The labels of these loads contain their units.
            _ if column.starts_with(LOAD.name) || column == TANGENTIAL_LOAD.name => {
                Scaled { factor: 1.0, unit: String::new() }
            }
            unit if unit.starts_with("as `") => Scaled { factor: 1.0, unit: String::new() },
            unit @ ("m" | "Pa" | "N" | "Ω" | "Ω m" | "W/(m² K)") => prefixed(largest, unit),
            unit => Scaled { factor: 1.0, unit: self.named().name(unit) },
        }
    }

    /// Returns the names of the units of length and pressure, for units such as `pressure ×
    /// length`.
    fn named(&self) -> TableUnits {
        TableUnits {
            length: self.length.clone().filter(|unit| !unit.is_empty()),
            pressure: self.pressure.name().map(str::to_owned),
        }
    }

    /// Returns text such as `H = 0.8`, `p₀ = 5 MPa` or `correction 2017`.
    pub fn told(&self, column: &str, value: Option<&Value>, files: &Files) -> String {
        let symbol = symbol(column);
        let number = match value {
            None => return format!("no {symbol}"),
            Some(Value::Text(text)) if column == CONTENT.name => {
                return files.get(text).unwrap_or(text).clone();
            }
            Some(Value::Text(text)) => return format!("{symbol} {text}"),
            Some(Value::Integer(number)) => return format!("{symbol} = {number}"),
            Some(Value::Real(number)) => *number,
        };
        format!("{symbol} = {}", self.unit(column, std::iter::once(number)).text(number, 6))
    }
}

#[cfg(test)]
mod tests {
    use resvg::usvg::{Group, Node};

    use super::*;
    use crate::charts::axis::Axis;
    use crate::charts::chart::{Chart, Series};
    use crate::charts::style::{Colour, Dash, Style, marker};
    use crate::charts::svg::{alone, tree};
    use crate::charts::{ColourScale, Figure};

    #[test]
    fn pressures_and_energies_are_shown_in_the_units_that_the_manifest_names() {
        let labels = Labels {
            units: [("pressure", "pressure"), ("energy", "pressure × length")]
                .map(|(column, unit)| (column.to_owned(), unit.to_owned()))
                .into(),
            lengths: Unit::Named("mm".to_owned()),
            length: Some("mm".to_owned()),
            pressure: Unit::of_pressures("MPa"),
        };
        let unit = labels.unit("pressure", [500.0, 2000.0].into_iter());
        assert_eq!(unit.label("mean pressure p₀"), "mean pressure p₀, in MPa");
        assert_eq!(unit.factor, 1.0);
        let energy = labels.unit("energy", [1.0].into_iter());
        assert_eq!(energy.label("energy"), "energy, in kJ/m²");
    }

    /// Returns the boxes [left, top, right, bottom] of the texts of a drawing, with the texts.
    fn boxes(group: &Group, found: &mut Vec<([f32; 4], String)>) {
        for node in group.children() {
            match node {
                Node::Group(group) => boxes(group, found),
                Node::Text(text) => {
                    let place = text.abs_bounding_box();
                    let content = text.chunks().iter().map(|chunk| chunk.text()).collect();
                    let corners = [place.left(), place.top(), place.right(), place.bottom()];
                    found.push((corners, content));
                }
                _ => {}
            }
        }
    }

    #[test]
    fn all_texts_of_a_figure_fit_at_all_sizes_and_none_covers_another() {
        const MILLIMETRE: f64 = 96.0 / 25.4;
        const POINT: f64 = 96.0 / 72.0;
        let mut labels: Vec<String> = KNOWN
            .values()
            .flat_map(|[label, _]| ["kW/(m² K)", "the unit of the side"].map(|u| (label, u)))
            .map(|(label, unit)| format!("{label}, in {unit}"))
            .collect();
        labels.sort_by_key(|label| std::cmp::Reverse(label.chars().count()));
        labels.dedup();
        let columns = [("one", 1), ("two", 2)];
        for (index, label) in labels[..6].iter().enumerate() {
            let other = &labels[(5 * index + 3) % labels.len()];
            for (millimetres, points) in
                [60.0, 86.0, 180.0].into_iter().flat_map(|mm| (6..=12).map(move |pt| (mm, pt)))
            {
                let (name, count) = columns[index % 2];
                let chart = Chart {
                    series: vec![
                        Series::new(
                            [(1.0, 3e4), (52.3, 7.1e5)],
                            Style::marker(Colour::Series(0), marker(0)),
                        )
                        .named(format!("{} · k_upper = 32 · H = 0.8", label)),
                        Series::new([(1.0, 4e4)], Style::line(Colour::Text, Dash::Solid, 1.0))
                            .named("a-very-long-name-of-a-measured-surface.x3p"),
                    ],
                    ..Chart::new(Axis::linear(label), Axis::linear(other))
                };
                let mut figure = Figure::from_charts(vec![vec![chart; count]], [600.0, 410.0]);
                figure.title = format!("{label} against {other}");
                figure.colours = Some(ColourScale {
                    label: label.clone(),
                    lowest: "0.001".to_owned(),
                    highest: "1000".to_owned(),
                });
                figure
                    .fit([Some(MILLIMETRE * millimetres), None], POINT * f64::from(points))
                    .unwrap();
                let drawn = tree(&alone(&figure.to_svg(name))).unwrap();
                let [width, height] = [drawn.size().width(), drawn.size().height()];
                let mut found = Vec::new();
                boxes(drawn.root(), &mut found);
                let case = format!("{label}; {other}; {millimetres} mm, {points} pt");
                for (at, (one, text)) in found.iter().enumerate() {
                    let is_inside = one[0] > -0.5
                        && one[1] > -0.5
                        && one[2] < width + 0.5
                        && one[3] < height + 0.5;
                    assert!(is_inside, "`{text}` at {one:?} of {width} × {height}: {case}");
                    for (other, covered) in &found[at + 1..] {
                        // Boxes hold the ascents and descents of the font, which lie at the sides
                        // of texts that are turned.
                        let room = 0.25 * points as f32;
                        let is_turned = one[3] - one[1] > one[2] - one[0];
                        let [x, y] = if is_turned { [room, 0.5] } else { [0.5, room] };
                        let is_apart = one[2] < other[0] + x
                            || other[2] < one[0] + x
                            || one[3] < other[1] + y
                            || other[3] < one[1] + y;
                        assert!(is_apart, "`{text}` {one:?} covers `{covered}` {other:?}: {case}");
                    }
                }
            }
        }
    }

    #[test]
    fn known_columns_have_symbols_and_others_their_names() {
        assert_eq!(name("hurst"), "Hurst exponent H");
        assert_eq!(name("area_fraction"), "contact area A/A₀");
        assert_eq!(name("area_fraction_q05"), "contact area A/A₀, q05");
        assert_eq!(name("largest_cluster"), "largest cluster");
        assert_eq!(name("electrical_resistance"), name("greenwood_resistance"));
        assert_eq!([symbol("load"), symbol("correction")], ["y", "correction"]);
    }
}
