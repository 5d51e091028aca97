//! Units of length, pressure, work per area, conductivity and resistivity.

use std::fmt;

use crate::decimal;
use crate::diagnostics::did_you_mean;

/// A physical quantity whose numbers may have a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    Length,
    Pressure,
    /// Energy per area, a pressure times a length.
    Work,
    /// Thermal conductivity. Numbers without a unit are in W/(m K).
    Conductivity,
    /// Electrical resistivity. Numbers without a unit are in Ω m.
    Resistivity,
}

/// A unit of a physical quantity.
#[derive(Debug, PartialEq, Eq)]
pub struct Unit {
    /// Symbol of the unit in tables and messages.
    pub symbol: &'static str,
    pub dimension: Dimension,
    /// The unit is 10^`power` units of the SI: metres, pascals, J/m², W/(m K) or Ω m.
    pub power: i32,
    /// True for the metre, the pascal and the joule per square metre, and for their multiples by
    /// 1000.
    pub(super) is_si: bool,
    /// Further spellings of the unit.
    spellings: &'static [&'static str],
}

const fn unit(
    symbol: &'static str,
    dimension: Dimension,
    power: i32,
    spellings: &'static [&'static str],
) -> Unit {
    let is_prefixed =
        matches!(dimension, Dimension::Length | Dimension::Pressure | Dimension::Work);
    let is_newton = matches!(symbol.as_bytes(), [b'N', ..] | [b'm', b'N', ..]);
    let is_si = is_prefixed && power % 3 == 0 && !is_newton;
    Unit { symbol, dimension, power, is_si, spellings }
}

/// All units. Messages list the symbols in this order.
pub static UNITS: [Unit; 27] = [
    unit("m", Dimension::Length, 0, &[]),
    unit("cm", Dimension::Length, -2, &[]),
    unit("mm", Dimension::Length, -3, &[]),
    // The Greek letter mu stands for the micro sign.
    unit("µm", Dimension::Length, -6, &["um", "μm", "micron", "microns"]),
    unit("nm", Dimension::Length, -9, &[]),
    unit("Å", Dimension::Length, -10, &["\u{212b}", "angstrom"]),
    unit("pm", Dimension::Length, -12, &[]),
    unit("Pa", Dimension::Pressure, 0, &["N/m²", "N/m^2", "N/m2"]),
    unit("kPa", Dimension::Pressure, 3, &[]),
    unit("MPa", Dimension::Pressure, 6, &[]),
    unit("GPa", Dimension::Pressure, 9, &[]),
    unit("N/mm²", Dimension::Pressure, 6, &["N/mm^2", "N/mm2"]),
    unit("bar", Dimension::Pressure, 5, &[]),
    unit("J/m²", Dimension::Work, 0, &["J/m^2", "J/m2", "Pa·m"]),
    unit("mJ/m²", Dimension::Work, -3, &["mJ/m^2", "mJ/m2"]),
    unit("µJ/m²", Dimension::Work, -6, &["uJ/m^2", "uJ/m2", "uJ/m²", "μJ/m²"]),
    unit("kJ/m²", Dimension::Work, 3, &["kJ/m^2", "kJ/m2"]),
    unit("N/m", Dimension::Work, 0, &[]),
    unit("mN/m", Dimension::Work, -3, &[]),
    unit("W/(m K)", Dimension::Conductivity, 0, &["W/m/K", "W/mK", "W/(mK)"]),
    unit("mW/(m K)", Dimension::Conductivity, -3, &["mW/m/K", "mW/mK", "mW/(mK)"]),
    unit("W/(cm K)", Dimension::Conductivity, 2, &["W/cm/K", "W/cmK", "W/(cmK)"]),
    unit("Ω m", Dimension::Resistivity, 0, &["ohm m", "Ωm"]),
    unit("Ω cm", Dimension::Resistivity, -2, &["ohm cm", "Ωcm"]),
    unit("µΩ m", Dimension::Resistivity, -6, &["uohm m", "µΩm"]),
    unit("µΩ cm", Dimension::Resistivity, -8, &["uohm cm", "µΩcm"]),
    unit("nΩ m", Dimension::Resistivity, -9, &["nohm m", "nΩm"]),
];

impl Unit {
    /// Returns the unit with this symbol or spelling.
    pub fn find(text: &str) -> Option<&'static Unit> {
        let has = |text: &str| {
            UNITS.iter().find(|unit| unit.symbol == text || unit.spellings.contains(&text))
        };
        has(text.trim()).or_else(|| has(&respelt(text)))
    }

    /// Returns the unit of the SI of the dimension.
    pub fn si(dimension: Dimension) -> &'static Unit {
        let mut units = UNITS.iter();
        let unit = units.find(|unit| unit.dimension == dimension && unit.power == 0);
        unit.expect("each dimension has a unit of the SI")
    }

    /// Returns the unit of the product of a pressure and a length in these units: J/m² for MPa and
    /// µm. Returns `None` if no unit is this power of ten.
    pub fn of_product(pressure: &Unit, length: &Unit) -> Option<&'static Unit> {
        let power = pressure.power + length.power;
        let mut works = UNITS.iter().filter(|unit| unit.dimension == Dimension::Work);
        works.find(|unit| unit.power == power)
    }

    /// Returns the factor that converts numbers in this unit to numbers in the unit `to`.
    pub fn factor_to(&self, to: &Unit) -> f64 {
        decimal::shifted("1", self.power - to.power)
    }
}

/// Returns a product of units in the spelling of the list: `µΩ cm` for `uOhm·cm`.
fn respelt(text: &str) -> String {
    let text = text.replace(['·', '⋅'], " ").replace(['\u{2126}'], "Ω").replace(['μ'], "µ");
    let text = text.replace("ohm", "Ω").replace("Ohm", "Ω").replace("uΩ", "µΩ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Dimension {
    /// Returns whether plain numbers are always in the unit of the SI, even if other numbers of
    /// this dimension have a unit.
    pub fn has_fixed_unit(self) -> bool {
        matches!(self, Dimension::Conductivity | Dimension::Resistivity)
    }

    /// Returns the symbol of the unit that a text probably means.
    pub fn did_you_mean(self, text: &str) -> Option<&'static str> {
        let of_dimension = || UNITS.iter().filter(move |unit| unit.dimension == self);
        let names = |unit: &'static Unit| unit.spellings.iter().copied().chain([unit.symbol]);
        let sorted = |text: &str| {
            let mut letters: Vec<char> = text.chars().collect();
            letters.sort_unstable();
            letters
        };
        let has_same_letters = |name: &&str| sorted(name) == sorted(text);
        let meant = of_dimension().flat_map(names).find(has_same_letters);
        let meant = meant.or_else(|| did_you_mean(text, of_dimension().flat_map(names)));
        meant.and_then(Unit::find).map(|unit| unit.symbol)
    }

    /// Returns a unit that manifests often use, for examples in messages.
    pub fn common_unit(self) -> &'static str {
        match self {
            Dimension::Length => "nm",
            Dimension::Pressure => "MPa",
            Dimension::Work => "mJ/m²",
            Dimension::Conductivity => "W/(m K)",
            Dimension::Resistivity => "nΩ m",
        }
    }

    /// Returns the names of the units of the dimension: the symbols, and after a symbol that some
    /// keyboards lack another spelling.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let units = UNITS.iter().filter(move |unit| unit.dimension == self);
        units.flat_map(|unit| {
            let plain = unit.spellings.iter().copied().find(|name| name.is_ascii());
            [unit.symbol].into_iter().chain(plain.filter(|_| !unit.symbol.is_ascii()))
        })
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Dimension::Length => "length",
            Dimension::Pressure => "pressure",
            Dimension::Work => "work per area",
            Dimension::Conductivity => "conductivity",
            Dimension::Resistivity => "resistivity",
        })
    }
}
