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

/// A unit of length that several surfaces share.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum LengthUnit {
    /// The metre, which is shown with a suitable prefix. All units can be converted to it.
    Metre,
    /// Another unit that all surfaces share, which is shown as it is.
    Named(String),
    /// No unit, or several unknown ones.
    #[default]
    Unknown,
}

/// A unit of pressure of tables.
#[derive(Debug, Clone, PartialEq)]
pub enum PressureUnit {
    /// The pascal, which is shown with a suitable prefix.
    Pascal,
    /// Another unit, which is shown as it is.
    Named(String),
    /// There is no unit, or several units differ.
    Unknown,
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

impl LengthUnit {
    /// Returns the common unit of surfaces with these units.
    pub fn common<'a>(units: impl IntoIterator<Item = Option<&'a str>>) -> LengthUnit {
        let known: Option<Vec<&str>> = units.into_iter().collect();
        match known.as_deref() {
            Some(["m", others @ ..]) if others.iter().all(|other| *other == "m") => {
                LengthUnit::Metre
            }
            Some([first, others @ ..])
                if !first.is_empty() && others.iter().all(|other| other == first) =>
            {
                LengthUnit::Named((*first).to_owned())
            }
            Some([_, ..]) if known.iter().flatten().all(|unit| in_metres(unit).is_some()) => {
                LengthUnit::Metre
            }
            Some(_) | None => LengthUnit::Unknown,
        }
    }

    /// Returns the factor that converts a length in the unit of a surface to the common unit.
    pub fn factor(&self, unit: Option<&str>) -> f64 {
        match self {
            LengthUnit::Metre => unit.and_then(in_metres).unwrap_or(1.0),
            LengthUnit::Named(_) | LengthUnit::Unknown => 1.0,
        }
    }

    /// Returns the unit of lengths up to `largest`.
    pub fn scaled(&self, largest: f64) -> Scaled {
        match self {
            LengthUnit::Metre => prefixed(largest, "m"),
            LengthUnit::Named(unit) => Scaled::plain(unit),
            LengthUnit::Unknown => Scaled::plain("the unit of the side"),
        }
    }

    /// Returns the name of a power of the unit, for axes: `m⁴`.
    pub fn power(&self, superscript: &str) -> String {
        match self {
            LengthUnit::Metre => format!("m{superscript}"),
            LengthUnit::Named(unit) => format!("{unit}{superscript}"),
            LengthUnit::Unknown => format!("side{superscript}"),
        }
    }
}

impl Scaled {
    fn plain(unit: &str) -> Scaled {
        Scaled { factor: 1.0, unit: unit.to_owned() }
    }

    /// Returns the unit for numbers that `factor` converts before.
    pub fn times(self, factor: f64) -> Scaled {
        Scaled { factor: factor * self.factor, ..self }
    }
}

impl PressureUnit {
    /// Returns the unit that a table names.
    pub fn named(unit: &str) -> PressureUnit {
        match unit {
            "Pa" => PressureUnit::Pascal,
            "" => PressureUnit::Unknown,
            _ => PressureUnit::Named(unit.to_owned()),
        }
    }

    /// Returns the unit of the smallest modulus of a table that names no unit.
    pub fn assumed(least_modulus: f64, lengths: &LengthUnit) -> PressureUnit {
        let lengths = match lengths {
            LengthUnit::Metre => Some("m"),
            LengthUnit::Named(unit) => Some(unit.as_str()),
            LengthUnit::Unknown => None,
        };
        assumed_pressure_unit(least_modulus, lengths).map_or(PressureUnit::Unknown, Self::named)
    }

    /// Returns the common unit of several tables or parameter points.
    pub fn common(units: impl IntoIterator<Item = PressureUnit>) -> PressureUnit {
        let mut rest = units.into_iter();
        let first = rest.next().unwrap_or(PressureUnit::Unknown);
        if rest.all(|other| other == first) { first } else { PressureUnit::Unknown }
    }

    /// Returns the unit of pressures up to `largest`.
    pub fn scaled(&self, largest: f64) -> Scaled {
        match self {
            PressureUnit::Pascal => prefixed(largest, "Pa"),
            PressureUnit::Named(unit) => Scaled::plain(unit),
            PressureUnit::Unknown => Scaled::plain("the unit of E*"),
        }
    }

    /// Formats a pressure with this number of digits and its unit, if the unit is known: `10 MPa`.
    pub fn text(&self, pressure: f64, number: usize) -> String {
        match self {
            PressureUnit::Unknown => digits(pressure, number),
            known => {
                let Scaled { factor, unit } = known.scaled(pressure);
                format!("{} {unit}", digits(factor * pressure, number))
            }
        }
    }
}

/// Formats a pressure with its unit: `10 MPa`. Pascals get a suitable prefix.
pub fn pressure_in_words(pressure: f64, unit: &str) -> String {
    PressureUnit::named(unit).text(pressure, 4)
}

/// Formats a length with its unit, if it is known: `20 nm`. Metres get a suitable prefix.
pub fn length_in_words(length: f64, unit: Option<&str>) -> String {
    let shared = LengthUnit::common([unit]);
    if shared == LengthUnit::Unknown {
        return digits(length, 4);
    }
    let length = shared.factor(unit) * length;
    let Scaled { factor, unit } = shared.scaled(length.abs());
    format!("{} {unit}", digits(factor * length, 4))
}

/// Returns a scale bar for a map with this side along x, or `None` if the unit is unknown. Its
/// length is 1, 2 or 5 times a power of ten.
pub fn scale_bar(side_x: f64, unit: Option<&str>) -> Option<ScaleBar> {
    let shared = LengthUnit::common([unit]);
    if shared == LengthUnit::Unknown {
        return None;
    }
    let factor = shared.factor(unit);
    let most = MOST_OF_SIDE * factor * side_x;
    let power = 10f64.powf(most.log10().floor());
    let step = [5.0, 2.0].into_iter().find(|step| step * power <= most);
    let length = step.unwrap_or(1.0) * power;
    let scaled = shared.scaled(length);
    Some(ScaleBar {
        length: length / factor,
        label: format!("{} {}", digits(scaled.factor * length, 1), scaled.unit),
    })
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
        let metre = LengthUnit::Metre;
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
        let common = |units: &[Option<&'static str>]| LengthUnit::common(units.iter().copied());
        let mixed = common(&[Some("µm"), Some("m")]);
        assert_eq!((mixed.clone(), common(&[Some("m")])), (LengthUnit::Metre, LengthUnit::Metre));
        let named = common(&[Some("µm"), Some("µm")]);
        assert_eq!((named.factor(Some("µm")), named.scaled(1e-4)), (1.0, Scaled::plain("µm")));
        assert!((mixed.factor(Some("µm")) * 1e6 - 1.0).abs() < 1e-12);
        let same = LengthUnit::Named("px".to_owned());
        assert_eq!(common(&[Some("px"), Some("px")]), same);
        assert_eq!(same.power("⁴"), "px⁴");
        for units in [&[Some("px"), Some("m")][..], &[Some("m"), None], &[Some("")], &[]] {
            assert_eq!(common(units), LengthUnit::Unknown);
        }
    }

    #[test]
    fn pressures_are_pascals_where_no_other_unit_can_be_meant() {
        let are_pascals = |modulus, lengths: &LengthUnit| {
            PressureUnit::assumed(modulus, lengths) == PressureUnit::Pascal
        };
        let (metre, unknown) = (&LengthUnit::Metre, &LengthUnit::Unknown);
        assert!(are_pascals(5e6, &LengthUnit::Named("µm".to_owned())));
        assert!(!are_pascals(5e6, &LengthUnit::Named("px".to_owned())));
        assert!(are_pascals(2.1e11, metre));
        assert!(!are_pascals(2.1e5, metre), "steel in megapascals");
        assert!(are_pascals(5e6, metre), "rubber in pascals");
        assert!(are_pascals(2.1e11, unknown));
        assert!(!are_pascals(3e7, unknown), "steel in pounds per square inch");
    }

    #[test]
    fn pressures_keep_the_unit_that_the_manifest_names_and_pascals_get_a_prefix() {
        let text = |pressure, unit| PressureUnit::named(unit).text(pressure, 3);
        assert_eq!(text(5500.0, "MPa"), "5500 MPa");
        assert_eq!(text(5.5e9, "Pa"), "5.5 GPa");
        assert_eq!(text(5.5, ""), "5.5");
        let common = |units: [&str; 2]| PressureUnit::common(units.map(PressureUnit::named));
        assert_eq!(common(["MPa", "MPa"]), PressureUnit::Named("MPa".to_owned()));
        assert_eq!(common(["MPa", "GPa"]), PressureUnit::Unknown);
    }
}
