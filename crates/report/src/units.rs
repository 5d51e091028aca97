//! Units of the numbers on a page: those that the manifest names. Metres and pascals have a
//! suitable prefix.
//!
//! Tables contain lengths in the unit of their surface and pressures in the unit of the modulus.
//! Lengths of surfaces with different units are converted to metres. If the unit of the modulus is
//! not recorded, it is assumed to be the pascal for large numbers. If the unit of length is known,
//! these are E* ≥ 10⁶:
//! no solid has an E* of 10⁶ MPa, and all solids but gels have an E* above 10⁶ Pa. Otherwise they
//! are E* ≥ 10⁸, which no solid has in pounds per square inch.

use std::collections::BTreeMap;

use crate::charts::map_panel::ScaleBar;
use crate::finished::FinishedStages;
use crate::points::{Point, text};
use asperity_stages::Kind;
use asperity_stages::columns::{SPECTRUM_OF, SURFACE, UNIT};
use asperity_stages::units::assumed_pressure_unit;
use asperity_tables::table::TableError;
use asperity_topography_files::length_ratio;

/// Largest length of a scale bar relative to the side of the map along x.
const MOST_OF_SIDE: f64 = 0.35;

/// Units of length of the surfaces of a study.
#[derive(Debug)]
pub struct Units {
    /// Units of measured surfaces by the names of the surfaces.
    by_surface: BTreeMap<String, String>,
}

/// The unit of length of surfaces, or the unit of pressure of tables.
#[derive(Debug, Clone, PartialEq)]
pub enum Unit {
    /// The metre or the pascal, which are shown with a suitable prefix.
    Si(&'static str),
    /// Another unit, which is shown as it is.
    Named(String),
    /// No unit, or several different ones. The text takes the place of its name.
    Unknown(&'static str),
}

/// A unit, and the factor that converts numbers to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaled {
    pub factor: f64,
    pub unit: String,
}

impl Units {
    /// Reads the units of length from the tables of surfaces.
    pub fn from_stages(finished: &FinishedStages) -> Result<Units, TableError> {
        let mut by_surface = BTreeMap::new();
        let columns = [SURFACE.name, UNIT.name];
        let stages = finished.with(&columns);
        for stage in stages.filter(|stage| stage.kind == Kind::Generate) {
            let [surfaces, units] = columns.map(|name| stage.table.texts(name));
            for (surface, unit) in surfaces?.iter().zip(units?) {
                if let (Some(surface), Some(unit)) = (surface, unit) {
                    by_surface.insert(surface.to_owned(), unit.to_owned());
                }
            }
        }
        Ok(Units { by_surface })
    }

    /// Returns the unit of the surfaces at a point. Random surfaces with the spectrum of a measured
    /// surface have the unit of the measured surface.
    pub fn at<'a>(&'a self, point: &'a Point) -> Option<&'a str> {
        let of_model = || self.by_surface.get(text(point, SPECTRUM_OF.name)?).map(String::as_str);
        text(point, UNIT.name).or_else(of_model)
    }
}

impl Default for Unit {
    fn default() -> Unit {
        Unit::NO_LENGTH
    }
}

impl Unit {
    pub const NO_LENGTH: Unit = Unit::Unknown("the unit of the side");
    pub const NO_PRESSURE: Unit = Unit::Unknown("the unit of E*");

    /// Returns the common unit of surfaces with these units of length. All units of length can be
    /// converted to the metre.
    pub fn of_lengths<'a>(units: impl IntoIterator<Item = Option<&'a str>>) -> Unit {
        let known: Option<Vec<&str>> = units.into_iter().collect();
        let Some([first, others @ ..]) = known.as_deref() else { return Unit::NO_LENGTH };
        let is_common = others.iter().all(|other| other == first);
        if is_common && !["", "m"].contains(first) {
            Unit::Named((*first).to_owned())
        } else if known.iter().flatten().all(|unit| in_metres(unit).is_some()) {
            Unit::Si("m")
        } else {
            Unit::NO_LENGTH
        }
    }

    /// Returns the unit of pressure that a table names.
    pub fn of_pressures(unit: &str) -> Unit {
        match unit {
            "Pa" => Unit::Si("Pa"),
            "" => Unit::NO_PRESSURE,
            _ => Unit::Named(unit.to_owned()),
        }
    }

    /// Returns the unit of pressure of the smallest modulus of a table that names no unit.
    pub fn assumed(least_modulus: f64, lengths: &Unit) -> Unit {
        let unit = assumed_pressure_unit(least_modulus, lengths.name());
        unit.map_or(Unit::NO_PRESSURE, Unit::of_pressures)
    }

    /// Returns the common unit of pressure of several tables or parameter points.
    pub fn common(units: impl IntoIterator<Item = Unit>) -> Unit {
        let mut rest = units.into_iter();
        let first = rest.next().unwrap_or(Unit::NO_PRESSURE);
        if rest.all(|other| other == first) { first } else { Unit::NO_PRESSURE }
    }

    /// Returns the name of the unit, if it is known.
    pub fn name(&self) -> Option<&str> {
        match self {
            Unit::Si(unit) => Some(unit),
            Unit::Named(unit) => Some(unit),
            Unit::Unknown(_) => None,
        }
    }

    /// Returns the factor that converts a length in the unit of a surface to this common unit.
    pub fn factor(&self, unit: Option<&str>) -> f64 {
        match self {
            Unit::Si(_) => unit.and_then(in_metres).unwrap_or(1.0),
            Unit::Named(_) | Unit::Unknown(_) => 1.0,
        }
    }

    /// Returns the unit of numbers up to `largest`.
    pub fn scaled(&self, largest: f64) -> Scaled {
        match self {
            Unit::Si(unit) => prefixed(largest, unit),
            Unit::Named(unit) => Scaled::plain(unit),
            Unit::Unknown(words) => Scaled::plain(words),
        }
    }

    /// Returns the name of a power of the unit of length, for axes: `m⁴`.
    pub fn power(&self, superscript: &str) -> String {
        format!("{}{superscript}", self.name().unwrap_or("side"))
    }

    /// Formats a number with this number of digits and its unit, if the unit is known: `10 MPa`.
    pub fn text(&self, value: f64, number: usize) -> String {
        self.scaled(value).text(value, number)
    }
}

impl Scaled {
    fn plain(unit: &str) -> Scaled {
        Scaled { factor: 1.0, unit: unit.to_owned() }
    }

    /// Returns the label of an axis.
    pub fn label(&self, name: &str) -> String {
        if self.unit.is_empty() { name.to_owned() } else { format!("{name}, in {}", self.unit) }
    }

    /// Formats a number with this many digits and its unit. A unit without a name is not repeated
    /// with every number.
    pub fn text(&self, number: f64, number_of_digits: usize) -> String {
        let unit = if self.unit.starts_with("the unit of") { "" } else { &self.unit };
        let text = format!("{} {unit}", digits(self.factor * number, number_of_digits));
        text.trim_end().to_owned()
    }

    /// Returns the unit for numbers that `factor` converts before.
    pub fn times(self, factor: f64) -> Scaled {
        Scaled { factor: factor * self.factor, ..self }
    }
}

/// Formats a pressure with its unit: `10 MPa`. Pascals get a suitable prefix.
pub fn pressure_in_words(pressure: f64, unit: &str) -> String {
    Unit::of_pressures(unit).text(pressure, 4)
}

/// Formats a length with its unit, if it is known: `20 nm`. Metres get a suitable prefix.
pub fn length_in_words(length: f64, unit: Option<&str>) -> String {
    let shared = Unit::of_lengths([unit]);
    shared.text(shared.factor(unit) * length, 4)
}

/// Returns a scale bar for a map with this side along x, or `None` if the unit is unknown. Its
/// length is 1, 2 or 5 times a power of ten.
pub fn scale_bar(side_x: f64, unit: Option<&str>) -> Option<ScaleBar> {
    let shared = Unit::of_lengths([unit]);
    shared.name()?;
    let factor = shared.factor(unit);
    let length = round_down(MOST_OF_SIDE * factor * side_x);
    Some(ScaleBar { length: length / factor, label: shared.text(length, 1) })
}

/// Rounds a positive number down to 1, 2 or 5 times a power of ten.
pub fn round_down(most: f64) -> f64 {
    let power = 10f64.powf(most.log10().floor());
    let step = [5.0, 2.0].into_iter().find(|step| step * power <= most);
    step.unwrap_or(1.0) * power
}

/// Formats a number with this number of significant digits, a true minus sign and no trailing
/// zeros.
pub fn digits(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits.max(1) - 1).parse().unwrap_or(value);
    let text = if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        format!("{}", rounded + 0.0)
    } else {
        format!("{rounded:e}")
    };
    text.replace('-', "−")
}

/// Returns the unit with the prefix for which `largest` is between 1 and 1000.
pub fn prefixed(largest: f64, unit: &str) -> Scaled {
    const PREFIXES: [(f64, &str); 8] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
        (1e-12, "p"),
    ];
    // Tolerate rounding, so 1000 nm is 1 µm.
    let size = largest.abs() * (1.0 + 1e-12);
    let prefix = PREFIXES.into_iter().find(|(value, _)| size >= *value);
    let (value, prefix) =
        if size > 0.0 { prefix.unwrap_or(PREFIXES[PREFIXES.len() - 1]) } else { (1.0, "") };
    Scaled { factor: 1.0 / value, unit: format!("{prefix}{unit}") }
}

/// Returns the length of a unit in metres, or `None` if it is not a unit of length.
fn in_metres(unit: &str) -> Option<f64> {
    (!unit.is_empty()).then(|| length_ratio(unit, "m")).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_the_prefix_that_suits_them() {
        let metre = Unit::Si("m");
        let told = |length: f64| {
            let Scaled { factor, unit } = metre.scaled(length);
            format!("{} {unit}", digits(factor * length, 3))
        };
        let found = [3.2e-9, 1e-6, 999.7e-9, 0.0256, 0.0, -4e-8, 3e-14].map(told);
        let expected = ["3.2 nm", "1 µm", "1000 nm", "25.6 mm", "0 m", "−40 nm", "0.03 pm"];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_scale_bar_is_a_round_length_of_a_fifth_to_a_third_of_the_map() {
        for side in [1e-5, 7.3e-6, 2.04e-4, 0.03, 8e-9] {
            let ScaleBar { length, label } = scale_bar(side, Some("m")).unwrap();
            assert!(length <= 0.35 * side * (1.0 + 1e-12) && 0.13 * side < length);
            assert!(["1", "2", "5"].iter().any(|first| label.starts_with(first)));
        }
        let told = scale_bar(7.5, Some("µm"));
        let told = told.map(|bar| (bar.label, bar.length));
        assert_eq!(told.as_ref().map(|(label, _)| label.as_str()), Some("2 µm"));
        assert!((told.unwrap().1 - 2.0).abs() < 1e-12, "in the unit of the side");
        assert_eq!(scale_bar(7.5, Some("")), None);
        assert_eq!(scale_bar(7.5, None), None);
    }

    #[test]
    fn a_common_unit_stays_and_different_units_of_length_become_metres() {
        let common = |units: &[Option<&'static str>]| Unit::of_lengths(units.iter().copied());
        let mixed = common(&[Some("µm"), Some("m")]);
        assert_eq!((mixed.clone(), common(&[Some("m")])), (Unit::Si("m"), Unit::Si("m")));
        let named = common(&[Some("µm"), Some("µm")]);
        assert_eq!((named.factor(Some("µm")), named.scaled(1e-4)), (1.0, Scaled::plain("µm")));
        assert!((mixed.factor(Some("µm")) * 1e6 - 1.0).abs() < 1e-12);
        let same = Unit::Named("px".to_owned());
        assert_eq!(common(&[Some("px"), Some("px")]), same);
        assert_eq!(same.power("⁴"), "px⁴");
        for units in [&[Some("px"), Some("m")][..], &[Some("m"), None], &[Some("")], &[]] {
            assert_eq!(common(units), Unit::NO_LENGTH);
        }
    }

    #[test]
    fn pressures_are_pascals_where_no_other_unit_can_be_meant() {
        let are_pascals =
            |modulus, lengths: &Unit| Unit::assumed(modulus, lengths) == Unit::Si("Pa");
        let (metre, unknown) = (&Unit::Si("m"), &Unit::NO_LENGTH);
        assert!(are_pascals(5e6, &Unit::Named("µm".to_owned())));
        assert!(!are_pascals(5e6, &Unit::Named("px".to_owned())));
        assert!(are_pascals(2.1e11, metre));
        assert!(!are_pascals(2.1e5, metre), "steel in megapascals");
        assert!(are_pascals(5e6, metre), "rubber in pascals");
        assert!(are_pascals(2.1e11, unknown));
        assert!(!are_pascals(3e7, unknown), "steel in pounds per square inch");
    }

    #[test]
    fn pressures_keep_the_unit_that_the_manifest_names_and_pascals_get_a_prefix() {
        assert_eq!([0.3, 1.0, 4.9, 70.0, 2300.0].map(round_down), [0.2, 1.0, 2.0, 50.0, 2000.0]);
        let text = |pressure, unit| Unit::of_pressures(unit).text(pressure, 3);
        assert_eq!(text(5500.0, "MPa"), "5500 MPa");
        assert_eq!(text(5.5e9, "Pa"), "5.5 GPa");
        assert_eq!(text(5.5, ""), "5.5");
        let common = |units: [&str; 2]| Unit::common(units.map(Unit::of_pressures));
        assert_eq!(common(["MPa", "MPa"]), Unit::Named("MPa".to_owned()));
        assert_eq!(common(["MPa", "GPa"]), Unit::NO_PRESSURE);
    }
}
