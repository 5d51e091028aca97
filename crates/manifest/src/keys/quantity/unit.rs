//! Units of length, pressure, force, work per area, conductivity and resistivity.

use std::fmt;

use crate::decimal;
use crate::diagnostics::did_you_mean;

/// A physical quantity whose numbers may have a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    Length,
    Pressure,
    /// Force. Forces are always read in newtons.
    Force,
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
    /// The unit is 10^`power` units of the SI: metres, pascals, newtons, J/m², W/(m K) or Ω m.
    pub power: i32,
    /// Spelling in ASCII for keyboards that lack a letter of the symbol.
    plain: Option<&'static str>,
}

const fn unit(symbol: &'static str, dimension: Dimension, power: i32) -> Unit {
    Unit { symbol, dimension, power, plain: None }
}

const fn unit_or(
    symbol: &'static str,
    plain: &'static str,
    dimension: Dimension,
    power: i32,
) -> Unit {
    Unit { plain: Some(plain), ..unit(symbol, dimension, power) }
}

/// All units. Messages list the symbols in this order.
pub static UNITS: [Unit; 33] = [
    unit("m", Dimension::Length, 0),
    unit("cm", Dimension::Length, -2),
    unit("mm", Dimension::Length, -3),
    unit_or("µm", "um", Dimension::Length, -6),
    unit("nm", Dimension::Length, -9),
    unit_or("Å", "angstrom", Dimension::Length, -10),
    unit("pm", Dimension::Length, -12),
    unit("Pa", Dimension::Pressure, 0),
    unit("kPa", Dimension::Pressure, 3),
    unit("MPa", Dimension::Pressure, 6),
    unit("GPa", Dimension::Pressure, 9),
    unit_or("N/mm²", "N/mm^2", Dimension::Pressure, 6),
    unit("bar", Dimension::Pressure, 5),
    unit("N", Dimension::Force, 0),
    unit("kN", Dimension::Force, 3),
    unit("MN", Dimension::Force, 6),
    unit("mN", Dimension::Force, -3),
    unit_or("µN", "uN", Dimension::Force, -6),
    unit("nN", Dimension::Force, -9),
    unit_or("J/m²", "J/m^2", Dimension::Work, 0),
    unit_or("mJ/m²", "mJ/m^2", Dimension::Work, -3),
    unit_or("µJ/m²", "uJ/m^2", Dimension::Work, -6),
    unit_or("kJ/m²", "kJ/m^2", Dimension::Work, 3),
    unit("N/m", Dimension::Work, 0),
    unit("mN/m", Dimension::Work, -3),
    unit("W/(m K)", Dimension::Conductivity, 0),
    unit("mW/(m K)", Dimension::Conductivity, -3),
    unit("W/(cm K)", Dimension::Conductivity, 2),
    unit_or("Ω m", "ohm m", Dimension::Resistivity, 0),
    unit_or("Ω cm", "ohm cm", Dimension::Resistivity, -2),
    unit_or("µΩ m", "uohm m", Dimension::Resistivity, -6),
    unit_or("µΩ cm", "uohm cm", Dimension::Resistivity, -8),
    unit_or("nΩ m", "nohm m", Dimension::Resistivity, -9),
];

impl Unit {
    /// Returns the unit with this symbol or plain spelling, or the unit that a product of units
    /// equals: `W/(m K)` for `W m^-1 K⁻¹`, and `Pa` for `N/m²`.
    pub fn find(text: &str) -> Option<&'static Unit> {
        let symbol = text.trim();
        let named = UNITS.iter().find(|unit| unit.symbol == symbol || unit.plain == Some(symbol));
        named.or_else(|| {
            let Product { power, exponents } = Product::parse(&respelt(symbol))?;
            let is_it =
                |unit: &&Unit| unit.power == power && unit.dimension.exponents() == exponents;
            UNITS.iter().find(is_it)
        })
    }

    /// Returns the unit of the SI of the dimension.
    pub fn si(dimension: Dimension) -> &'static Unit {
        let mut units = UNITS.iter();
        let unit = units.find(|unit| unit.dimension == dimension && unit.power == 0);
        unit.expect("each dimension has a unit of the SI")
    }

    /// Returns the unit of the SI with these exponents of m, N, W, K and Ω.
    pub fn si_of(exponents: [i32; 5]) -> Option<&'static Unit> {
        let is_it = |unit: &&Unit| unit.power == 0 && unit.dimension.exponents() == exponents;
        UNITS.iter().find(is_it)
    }

    /// Returns the unit of the product of a pressure and a length in these units: J/m² for MPa and
    /// µm. Returns `None` if no unit is this power of ten.
    pub fn of_product(pressure: &Unit, length: &Unit) -> Option<&'static Unit> {
        let power = pressure.power + length.power;
        let mut works = UNITS.iter().filter(|unit| unit.dimension == Dimension::Work);
        works.find(|unit| unit.power == power)
    }

    /// Returns the factor that converts numbers from one product of units to another: 1e6 for
    /// `MPa/µm` to `Pa/µm`. Returns `None` if one is no such product, or if they differ in
    /// dimension.
    pub fn factor(from: &str, to: &str) -> Option<f64> {
        let product = |text: &str| match text.strip_prefix("1/") {
            Some(inverse) => Some(Product::default().times(Product::parse(&respelt(inverse))?, -1)),
            None => Product::parse(&respelt(text)),
        };
        let (from, to) = (product(from)?, product(to)?);
        let has_dimension = from.exponents == to.exponents;
        has_dimension.then(|| decimal::shifted("1", from.power - to.power))
    }

    /// Returns the factor that converts numbers in this unit to numbers in the unit `to`.
    pub fn factor_to(&self, to: &Unit) -> f64 {
        decimal::shifted("1", self.power - to.power)
    }
}

/// Returns a text with one spelling of each letter and digit: `µΩ cm` for `uOhm cm`, and `K-1` for
/// `K⁻¹`.
fn respelt(text: &str) -> String {
    const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻";
    let plain = |letter: char| match letter {
        '\u{2126}' => 'Ω',
        'μ' => 'µ',
        '\u{212b}' => 'Å',
        other => {
            let mut digits = RAISED.chars().zip("0123456789-".chars());
            digits.find(|(raised, _)| *raised == other).map_or(other, |(_, digit)| digit)
        }
    };
    text.chars().map(plain).collect::<String>().replace("ohm", "Ω").replace("Ohm", "Ω")
}

/// Units of which all others are products, and products with names: power of ten, and exponents of
/// m, N, W, K and Ω.
const NAMED: [(&str, Product); 12] = [
    ("m", Product { power: 0, exponents: [1, 0, 0, 0, 0] }),
    ("N", Product { power: 0, exponents: [0, 1, 0, 0, 0] }),
    ("W", Product { power: 0, exponents: [0, 0, 1, 0, 0] }),
    ("K", Product { power: 0, exponents: [0, 0, 0, 1, 0] }),
    ("Ω", Product { power: 0, exponents: [0, 0, 0, 0, 1] }),
    ("Pa", Product { power: 0, exponents: [-2, 1, 0, 0, 0] }),
    ("J", Product { power: 0, exponents: [1, 1, 0, 0, 0] }),
    ("bar", Product { power: 5, exponents: [-2, 1, 0, 0, 0] }),
    ("Å", Product { power: -10, exponents: [1, 0, 0, 0, 0] }),
    ("angstrom", Product { power: -10, exponents: [1, 0, 0, 0, 0] }),
    ("micron", Product { power: -6, exponents: [1, 0, 0, 0, 0] }),
    ("microns", Product { power: -6, exponents: [1, 0, 0, 0, 0] }),
];

const PREFIXES: [(char, i32); 9] = [
    ('p', -12),
    ('n', -9),
    ('µ', -6),
    ('u', -6),
    ('m', -3),
    ('c', -2),
    ('k', 3),
    ('M', 6),
    ('G', 9),
];

/// Product of powers of units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Product {
    /// Power of ten.
    power: i32,
    /// Exponents of m, N, W, K and Ω.
    exponents: [i32; 5],
}

impl Product {
    /// Parses a product such as `W/(m K)`, `W m^-1 K⁻¹` or `N*mm-2`. A slash applies to the unit or
    /// the parenthesis after it. Returns `None` for all other texts.
    fn parse(text: &str) -> Option<Product> {
        let (mut product, mut sign, mut rest) = (Product::default(), 1, text.trim());
        loop {
            let (factor, after) = match rest.strip_prefix('(') {
                Some(inner) => {
                    let (inside, after) = inner.split_once(')')?;
                    (Product::parse(inside)?, after)
                }
                None => {
                    let end = rest.find(|letter: char| !letter.is_alphabetic());
                    let (word, after) = rest.split_at(end.unwrap_or(rest.len()));
                    let (exponent, after) = exponent(after)?;
                    (Product::of_word(word, exponent)?, after)
                }
            };
            product = product.times(factor, sign);
            let next = after.trim_start();
            if next.is_empty() {
                return Some(product);
            }
            let divisor = next.strip_prefix('/');
            sign = if divisor.is_some() { -1 } else { 1 };
            let factor = divisor.or_else(|| next.strip_prefix(['*', '·', '⋅'])).unwrap_or(next);
            rest = factor.trim_start();
        }
    }

    /// Returns a power of a unit, or the product of two units that are written without a space:
    /// `mK`. An exponent of such a word would be ambiguous.
    fn of_word(word: &str, exponent: i32) -> Option<Product> {
        let one = Product::default();
        if let Some(unit) = Product::of_unit(word) {
            return Some(one.times(unit, exponent));
        }
        let mut splits = word.char_indices().skip(1).map(|(at, _)| word.split_at(at));
        let units = splits.find_map(|(a, b)| Some([Product::of_unit(a)?, Product::of_unit(b)?]));
        units.filter(|_| exponent == 1).map(|[a, b]| a.times(b, 1))
    }

    /// Returns a unit with or without a prefix. The kelvin takes none: `mK` is a metre kelvin.
    fn of_unit(word: &str) -> Option<Product> {
        let named =
            |word: &str| NAMED.iter().find(|(name, _)| *name == word).map(|(_, unit)| *unit);
        named(word).or_else(|| {
            let mut letters = word.chars();
            let first = letters.next()?;
            let (_, power) = PREFIXES.iter().find(|(prefix, _)| *prefix == first)?;
            let unit = named(letters.as_str()).filter(|_| letters.as_str() != "K")?;
            Some(Product { power: unit.power + power, ..unit })
        })
    }

    /// Returns the product with a power of another one.
    fn times(self, other: Product, exponent: i32) -> Product {
        let mut exponents = self.exponents;
        for (own, other) in exponents.iter_mut().zip(other.exponents) {
            *own += exponent * other;
        }
        Product { power: self.power + exponent * other.power, exponents }
    }
}

/// Splits off the exponent at the start of a text: 2 for `^2/s` and `2/s`, and 1 for `/s`.
fn exponent(text: &str) -> Option<(i32, &str)> {
    let (text, is_required) = text.strip_prefix('^').map_or((text, false), |rest| (rest, true));
    let unsigned = text.strip_prefix('-').unwrap_or(text);
    let rest = unsigned.trim_start_matches(|letter: char| letter.is_ascii_digit());
    let digits = &text[..text.len() - rest.len()];
    if digits.is_empty() && !is_required {
        return Some((1, text));
    }
    // Larger exponents than those of units could overflow.
    let exponent: i8 = digits.parse().ok()?;
    Some((exponent.into(), rest))
}

impl Dimension {
    /// Returns whether plain numbers are always in the unit of the SI, even if other numbers of
    /// this dimension have a unit.
    pub fn has_fixed_unit(self) -> bool {
        matches!(self, Dimension::Force | Dimension::Conductivity | Dimension::Resistivity)
    }

    /// Returns the name, the exponents of m, N, W, K and Ω, and a unit that manifests often use.
    fn properties(self) -> (&'static str, [i32; 5], &'static str) {
        match self {
            Dimension::Length => ("length", [1, 0, 0, 0, 0], "nm"),
            Dimension::Pressure => ("pressure", [-2, 1, 0, 0, 0], "MPa"),
            Dimension::Force => ("force", [0, 1, 0, 0, 0], "N"),
            Dimension::Work => ("work per area", [-1, 1, 0, 0, 0], "mJ/m²"),
            Dimension::Conductivity => ("conductivity", [-1, 0, 1, -1, 0], "W/(m K)"),
            Dimension::Resistivity => ("resistivity", [1, 0, 0, 0, 1], "nΩ m"),
        }
    }

    /// Returns the exponents of m, N, W, K and Ω.
    pub fn exponents(self) -> [i32; 5] {
        self.properties().1
    }

    /// Returns a unit that manifests often use, for examples in messages.
    pub fn common_unit(self) -> &'static str {
        self.properties().2
    }

    /// Returns the symbol of the unit that a text probably means.
    pub fn did_you_mean(self, text: &str) -> Option<&'static str> {
        let words = NAMED.iter().map(|(word, _)| *word);
        let is_its = |word: &&str| Unit::find(word).is_some_and(|unit| unit.dimension == self);
        let names: Vec<&str> = self.names().chain(words.filter(is_its)).collect();
        let sorted = |text: &str| {
            let mut letters: Vec<char> = text.chars().collect();
            letters.sort_unstable();
            letters
        };
        let has_same_letters = |name: &&str| sorted(name) == sorted(text);
        let transposed = names.iter().copied().find(has_same_letters);
        let meant = transposed.or_else(|| did_you_mean(text, names.iter().copied()));
        meant.and_then(Unit::find).map(|unit| unit.symbol)
    }

    /// Returns the names of the units of the dimension: the symbols, and after a symbol that some
    /// keyboards lack another spelling.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let units = UNITS.iter().filter(move |unit| unit.dimension == self);
        units.flat_map(|unit| [unit.symbol].into_iter().chain(unit.plain))
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.properties().0)
    }
}
