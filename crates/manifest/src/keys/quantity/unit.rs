//! Units of length, pressure and work per area.

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
}

/// A unit of length, pressure or work per area.
#[derive(Debug, PartialEq, Eq)]
pub struct Unit {
    /// Symbol of the unit in tables and messages.
    pub symbol: &'static str,
    pub dimension: Dimension,
    /// The unit is 10^`power` metres, pascals or joules per square metre.
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
    let is_si = power % 3 == 0 && !matches!(symbol.as_bytes(), [b'N', ..] | [b'm', b'N', ..]);
    Unit { symbol, dimension, power, is_si, spellings }
}

/// All units. Messages list the symbols in this order.
pub static UNITS: [Unit; 19] = [
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
];

impl Unit {
    /// Returns the unit with this symbol or spelling.
    pub fn find(text: &str) -> Option<&'static Unit> {
        let text = text.trim();
        UNITS.iter().find(|unit| unit.symbol == text || unit.spellings.contains(&text))
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

impl Dimension {
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
        })
    }
}
