//! Numbers with units: `side = "100 um"`, `youngs_modulus = "210 GPa"`, `work = "50 mJ/m^2"`.
//!
//! A key whose numbers are declared as lengths, pressures or works per area also accepts texts of a
//! number and a unit. All lengths of a table are read in one unit, and so are its pressures and its
//! works. This is the unit that a key of the table names (`unit = "um"`), otherwise the unit of the
//! first quantity, in the order in which the keys are declared. Forces, conductivities and
//! resistivities are always read in N, W/(m K) and Ω m. A load is a pressure or a force. A key of a
//! pure number accepts the ratio of two quantities: `modulus_ratio = "2 GPa / 210 GPa"`.
//! [`Units::read`] finds the units and the number of each quantity, and [`replace`] puts these
//! numbers into the table. All later steps read plain numbers. Expressions, which are evaluated
//! later, compute with numbers in these units.
//!
//! Every unit is a power of ten of a unit of the SI. A conversion only moves the decimal point and
//! is exact.

#[cfg(test)]
mod tests;
mod unit;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeTable, DeValue};

use super::Layout;
use super::declare::QUANTITY;
use crate::decimal;
use crate::diagnostics::{Problem, Problems, Span, listed};
use crate::keys::bounds::number;
use crate::keys::schema::{alternatives, is_number};
use crate::keys::values::with_scalars;

use unit::UNITS;
pub use unit::{Dimension, Unit};

/// Regular expression of a number with a unit, for editors.
pub const PATTERN: &str =
    concat!(r"^\s*[+-]?[0-9.]+([eE][+-]?[0-9]+)?", r"\s*[^\s0-9.+*-]\S*(\s[^\s0-9.+*-]\S*)*\s*$",);

/// The declaration that the numbers of a key are quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Declared {
    pub dimension: Dimension,
    /// True if numbers without a unit may be pure numbers.
    pub or_ratio: bool,
    /// True if a pressure may be written as a force.
    pub or_force: bool,
}

impl Declared {
    pub fn from_schema(schema: &Value) -> Option<Declared> {
        let quantity = schema.get(QUANTITY)?.as_str()?;
        let (dimension, or_ratio) = match quantity {
            "length" => (Dimension::Length, false),
            "pressure" => (Dimension::Pressure, false),
            "work" => (Dimension::Work, false),
            "conductivity" => (Dimension::Conductivity, false),
            "resistivity" => (Dimension::Resistivity, false),
            "length or ratio" => (Dimension::Length, true),
            _ => (Dimension::Pressure, true),
        };
        Some(Declared { dimension, or_ratio, or_force: quantity.contains("force") })
    }

    /// Returns the dimensions of which the numbers of the key may have a unit.
    pub fn dimensions(self) -> impl Iterator<Item = Dimension> {
        [self.dimension].into_iter().chain(self.or_force.then_some(Dimension::Force))
    }
}

/// Splits a text into a number and a unit. Returns `None` for all other texts, such as words and
/// arithmetic expressions.
pub fn split(text: &str) -> Option<(&str, &str)> {
    let text = text.trim();
    let mut end = 0;
    for (index, letter) in text.char_indices() {
        let rest = &text[index..];
        let is_exponent = matches!(letter, 'e' | 'E')
            && rest[1..]
                .trim_start_matches(['+', '-'])
                .starts_with(|next: char| next.is_ascii_digit());
        let is_sign =
            matches!(letter, '+' | '-') && (index == 0 || text[..index].ends_with(['e', 'E']));
        if !(letter.is_ascii_digit() || letter == '.' || is_exponent || is_sign) {
            break;
        }
        end = index + letter.len_utf8();
    }
    let (number, unit) = (&text[..end], text[end..].trim_start());
    let is_unit = unit.starts_with(char::is_alphabetic)
        && unit.chars().all(|letter| letter.is_alphanumeric() || "_/^*-⁻·⋅ ()".contains(letter));
    (is_unit && number.parse::<f64>().is_ok()).then_some((number, unit))
}

/// Returns the ratio of two quantities of one dimension: 0.01 for `"2 GPa / 200 GPa"`. Returns
/// `None` for all other texts.
pub fn ratio(text: &str) -> Option<f64> {
    let of_texts = |above: &str, below: &str| {
        let [(above, of_above), (below, of_below)] = [split(above)?, split(below)?];
        let [of_above, of_below] = [Unit::find(of_above)?, Unit::find(of_below)?];
        let power = of_above.power - of_below.power;
        let is_ratio = of_above.dimension == of_below.dimension;
        is_ratio
            .then(|| decimal::nearest(decimal::shifted(above, power) / decimal::shifted(below, 0)))
    };
    // Units contain slashes, too: `N/mm²`.
    let slashes = text.match_indices('/');
    slashes.filter_map(|(at, _)| of_texts(&text[..at], &text[at + 1..])).next()
}

/// Reads a number, or converts a quantity to the unit `to`.
///
/// # Errors
/// Returns message and label of the problem of a text that is neither, or whose unit is not one of
/// the same dimension. Without `to`, no quantity can be converted.
pub fn in_unit(text: &str, to: Option<&Unit>) -> Result<f64, (String, String)> {
    if let Ok(number) = text.trim().parse::<f64>() {
        return Ok(number);
    }
    Err(match (split(text), to) {
        (Some((number, unit)), Some(to)) => match Unit::find(unit) {
            Some(unit) if unit.dimension == to.dimension => {
                return Ok(decimal::shifted(number, unit.power - to.power));
            }
            Some(_) => (
                format!("the quantity cannot have the unit {unit}"),
                format!("the unit of the column is {}", to.symbol),
            ),
            None => (format!("{unit:?} is not a unit"), "unknown unit".to_owned()),
        },
        (Some(_), None) => (
            "the quantity has no unit that could be converted".to_owned(),
            "write a number in the unit of the column".to_owned(),
        ),
        (None, _) => (format!("{text:?} is not a number"), "must be a number".to_owned()),
    })
}

/// The unit of the lengths, pressures or works of a table, and the position that determines it.
#[derive(Debug, Clone)]
pub struct NamedUnit {
    pub unit: &'static Unit,
    /// Position of the key that names the unit, or of the first quantity.
    pub span: Span,
    /// True if a key names the unit. Numbers without a unit then have this unit, too.
    pub by_key: bool,
}

/// Function that returns the unit of an expression in which parameters have units; `None` for all
/// other values. The arguments are the path of the key, the value, its schema and its declaration.
///
/// Returns the problem of an expression whose unit does not belong to the key.
pub type UnitOfExpression<'a> = dyn Fn(
        &str,
        &TomlSpanned<DeValue<'_>>,
        &Value,
        Option<Declared>,
    ) -> Result<Option<&'static Unit>, Problem>
    + 'a;

/// The units of a table, and its quantities.
#[derive(Debug, Clone, Default)]
pub struct Units {
    /// Unit of the lengths; `None` if no length has a unit and no key names a known unit.
    pub length: Option<NamedUnit>,
    /// Unit of the pressures; `None` if no pressure has a unit and no key names one.
    pub pressure: Option<NamedUnit>,
    /// Unit of the works per area; `None` if none has a unit.
    pub work: Option<NamedUnit>,
    /// Dimension of each quantity, by its start and end in the text of the manifest.
    quantities: BTreeMap<(usize, usize), Dimension>,
}

/// Units and numbers that [`Units::read`] found in a table.
#[derive(Default)]
pub struct ReadUnits {
    pub units: Units,
    /// Numbers of quantities, and ratios of two, by their positions.
    pub numbers: BTreeMap<usize, String>,
    /// Keys with a reported problem.
    pub reported_keys: BTreeSet<String>,
}

/// A scalar of a table.
struct Scalar<'v> {
    /// Key of the table, or of one of its cases.
    key: &'v str,
    /// Key in messages, with the keys of inner tables: `loads.from`.
    path: String,
    declared: Option<Declared>,
    /// True if the value can be a number.
    takes_number: bool,
    value: &'v TomlSpanned<DeValue<'v>>,
    /// Unit of an expression in which parameters have units.
    unit_of_expression: Option<&'static Unit>,
    /// Problem of an expression whose unit does not belong to the key.
    problem_of_expression: Option<Problem>,
}

impl<'v> Scalar<'v> {
    /// Returns the unit of a quantity of this dimension, which may be an expression.
    fn unit(&self, dimension: Dimension) -> Option<&'static Unit> {
        let written = self.quantity(dimension).map(|(_, unit)| unit);
        written.or_else(|| self.unit_of_expression.filter(|unit| unit.dimension == dimension))
    }

    /// Returns the number and the unit if the scalar is a quantity of a known unit.
    fn quantity(&self, dimension: Dimension) -> Option<(&'v str, &'static Unit)> {
        let (number, unit) = split(self.value.get_ref().as_str()?)?;
        let unit = Unit::find(unit).filter(|unit| unit.dimension == dimension)?;
        let is_declared = self.declared?.dimensions().any(|declared| declared == dimension);
        is_declared.then_some((number, unit))
    }

    /// Returns the ratio of two quantities in the place of a pure number.
    fn ratio(&self) -> Option<f64> {
        let is_pure = self.takes_number && self.declared.is_none();
        self.value.get_ref().as_str().filter(|_| is_pure).and_then(ratio)
    }

    /// Returns the problem of a text whose unit is unknown or belongs to another dimension.
    fn problem(&self) -> Option<Problem> {
        if self.problem_of_expression.is_some() {
            return self.problem_of_expression.clone();
        }
        let declared = self.declared?;
        let (_, unit) = split(self.value.get_ref().as_str()?)?;
        let path = &self.path;
        let any = |article: &str| {
            let names: Vec<String> =
                declared.dimensions().map(|one| format!("{article}{one}")).collect();
            names.join(" or ")
        };
        let (message, label) = match Unit::find(unit) {
            Some(known) if declared.dimensions().any(|one| one == known.dimension) => return None,
            Some(known) => (
                format!("`{path}` is {}, but `{unit}` is a unit of {}", any("a "), known.dimension),
                format!("needs a unit of {}", any("")),
            ),
            None => (
                format!("unknown unit `{unit}`"),
                match declared.dimensions().find_map(|one| one.did_you_mean(unit)) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => "unknown unit".to_owned(),
                },
            ),
        };
        let units = |one: Dimension| format!("units of {one} are {}", listed(one.names(), "and"));
        let help = declared.dimensions().map(units).collect::<Vec<_>>().join(", and ");
        Some(Problem::new(message, self.value.span(), label).help(help))
    }

    /// Returns the problem of a number without a unit in a table whose quantities have units.
    fn mixed(&self, first: &Scalar, named: &NamedUnit, key: Option<&str>) -> Problem {
        /// Number from which on a pressure is probably in pascals: 1 TPa in megapascals.
        const PASCALS: f64 = 1e6;
        let value = self.value.get_ref();
        let is_in_pascals = named.unit.dimension == Dimension::Pressure && number(value) >= PASCALS;
        let symbol = if is_in_pascals { "Pa" } else { named.unit.symbol };
        let number = decimal::written(number(value));
        let message = format!("`{}` has no unit, but `{}` has one", self.path, first.path);
        let label = format!("write \"{number} {symbol}\" if it is in {symbol}");
        let help = key.map(|key| {
            format!(
                "or set `{key} = \"{symbol}\"`, which is then the unit of all numbers without a unit"
            )
        });
        let problem = Problem::new(message, self.value.span(), label);
        problem.and(named.span.clone(), "has a unit").help_if(help)
    }
}

impl Units {
    /// Finds the units of a table and converts its quantities. Reports unknown units, and numbers
    /// without a unit beside quantities.
    pub fn read(
        table: &DeTable<'_>,
        layout: &Layout,
        of_expression: &UnitOfExpression<'_>,
        problems: &mut Problems,
    ) -> ReadUnits {
        let scalars = scalars(table, layout, of_expression);
        let mut read = ReadUnits::default();
        for scalar in &scalars {
            let ratio = scalar.ratio().map(decimal::written);
            read.numbers.extend(ratio.map(|ratio| (scalar.value.span().start, ratio)));
            if let Some(problem) = scalar.problem() {
                problems.push(problem);
                read.reported_keys.insert(scalar.key.to_owned());
            }
        }
        let mut convert =
            |dimension, key| read.convert(dimension, key, table, &scalars, layout, problems);
        let length = convert(Dimension::Length, layout.unit_of_lengths);
        let pressure = convert(Dimension::Pressure, layout.unit_of_pressures);
        convert(Dimension::Force, None);
        let work = convert(Dimension::Work, None);
        convert(Dimension::Conductivity, None);
        convert(Dimension::Resistivity, None);
        read.units = Units { length, pressure, work, quantities: read.units.quantities };
        read
    }

    /// Converts a quantity to the number with which expressions compute.
    pub fn computed(&self, number: &str, unit: &Unit) -> f64 {
        decimal::shifted(number, unit.power - self.power(unit.dimension))
    }

    /// Converts the result of an expression to the unit of the key at this position. The unit
    /// differs only for quantities that are neither lengths nor pressures.
    pub fn in_unit_of_key(&self, result: f64, span: &Span) -> f64 {
        let Some(dimension) = self.dimension_of(span) else { return result };
        let own = match dimension {
            Dimension::Length => &self.length,
            Dimension::Pressure => &self.pressure,
            Dimension::Work => &self.work,
            _ => &None,
        };
        result * decimal::shifted("1", self.power(dimension) - power(own))
    }

    /// Returns the power of ten of the unit in which expressions compute, relative to the SI: the
    /// units of length and pressure of the table, and products of these.
    fn power(&self, dimension: Dimension) -> i32 {
        let [length, pressure] = [&self.length, &self.pressure].map(power);
        let [metres, newtons, ..] = dimension.exponents();
        metres * length + newtons * (pressure + 2 * length)
    }

    /// Returns whether no length or pressure of the table has a unit, although plain numbers of
    /// this dimension would have it. All other dimensions have a unit.
    pub fn lacks(&self, dimension: Dimension) -> bool {
        match dimension {
            Dimension::Length => self.length.is_none(),
            Dimension::Pressure => self.pressure.is_none(),
            _ => false,
        }
    }

    /// Returns whether the value at this position was written with a unit.
    pub fn is_quantity(&self, span: &Span) -> bool {
        self.dimension_of(span).is_some()
    }

    /// Returns the dimension of the value at this position; `None` if it has no unit.
    pub fn dimension_of(&self, span: &Span) -> Option<Dimension> {
        self.quantities.get(&(span.start, span.end)).copied()
    }
}

fn power(named: &Option<NamedUnit>) -> i32 {
    named.as_ref().map_or(0, |named| named.unit.power)
}

impl ReadUnits {
    /// Converts the quantities of one dimension. Returns their unit, if they have any.
    fn convert(
        &mut self,
        dimension: Dimension,
        key: Option<&'static str>,
        table: &DeTable<'_>,
        scalars: &[Scalar],
        layout: &Layout,
        problems: &mut Problems,
    ) -> Option<NamedUnit> {
        let order = |scalar: &&Scalar| layout.names.iter().position(|name| *name == scalar.key);
        let quantities = scalars.iter().filter(|scalar| scalar.unit(dimension).is_some());
        let first = quantities.min_by_key(order);
        // The unit must be the same at all parameter points, so a swept unit names none.
        let common = key.and_then(|key| table.get(key));
        let of_case = || scalars.iter().find(|scalar| Some(scalar.key) == key);
        let written = common.or_else(|| of_case().map(|scalar| scalar.value));
        let text = common.and_then(|written| written.get_ref().as_str());
        let unit = text.and_then(Unit::find).filter(|unit| unit.dimension == dimension);
        let named = match (unit, written) {
            _ if dimension.has_fixed_unit() => {
                NamedUnit { unit: Unit::si(dimension), span: first?.value.span(), by_key: true }
            }
            (Some(unit), Some(written)) => NamedUnit { unit, span: written.span(), by_key: true },
            _ => {
                let unit = first?.unit(dimension)?;
                NamedUnit { unit, span: first?.value.span(), by_key: false }
            }
        };
        let words = key.and_then(|key| layout.properties().get(key)).map(alternatives);
        let is_label = words.is_some_and(|words| {
            words.iter().all(|one| one.get("const").or(one.get("enum")).is_none())
        });
        if let (false, true, Some(written), Some(first), Some(key)) =
            (named.by_key, is_label, written, first, key)
        {
            let message = format!("`{key}` does not name one unit of {dimension}");
            let problem = Problem::new(message, written.span(), "must be one of these units")
                .and(first.value.span(), "cannot be converted");
            let units = listed(dimension.names(), "and");
            problems.push(problem.help(format!("units of {dimension} are {units}")));
            self.reported_keys.extend([key.to_owned(), first.key.to_owned()]);
            return None;
        }
        for scalar in scalars {
            let is_number = |value: &DeValue| value.is_integer() || value.is_float();
            let span = scalar.value.span();
            if let Some((digits, unit)) = scalar.quantity(dimension) {
                let value = decimal::shifted(digits, unit.power - named.unit.power);
                self.numbers.insert(span.start, decimal::written(value));
            }
            if scalar.unit(dimension).is_some() {
                self.units.quantities.insert((span.start, span.end), dimension);
            } else if let (false, Some(first)) = (named.by_key, first)
                && is_number(scalar.value.get_ref())
                && scalar.declared.is_some_and(|one| one.dimension == dimension && !one.or_ratio)
            {
                problems.push(scalar.mixed(first, &named, key));
                self.reported_keys.insert(scalar.key.to_owned());
            }
        }
        Some(named)
    }
}

/// Returns all scalars of a table.
fn scalars<'v>(
    table: &'v DeTable<'v>,
    layout: &Layout,
    of_expression: &UnitOfExpression<'_>,
) -> Vec<Scalar<'v>> {
    let mut visitor = Visitor { of_expression, found: Vec::new() };
    for (key, value) in table {
        let key = key.get_ref().as_ref();
        let cases = value.get_ref().as_array().filter(|_| key == "cases" && !layout.has(key));
        match cases {
            Some(cases) => cases.iter().for_each(|case| match case.get_ref().as_table() {
                Some(case) => visitor.found.extend(scalars(case, layout, of_expression)),
                None => visitor.visit(key, key.to_owned(), case, &Value::Null, None),
            }),
            None => {
                let schema = layout.properties().get(key).unwrap_or(&Value::Null);
                visitor.visit(key, key.to_owned(), value, schema, None);
            }
        }
    }
    visitor.found
}

/// Collects the scalars of a table.
struct Visitor<'a, 'v> {
    of_expression: &'a UnitOfExpression<'a>,
    found: Vec<Scalar<'v>>,
}

impl<'v> Visitor<'_, 'v> {
    fn visit(
        &mut self,
        key: &'v str,
        path: String,
        value: &'v TomlSpanned<DeValue<'v>>,
        schema: &Value,
        outer: Option<Declared>,
    ) {
        let declared = Declared::from_schema(schema).or(outer);
        match value.get_ref() {
            DeValue::Array(items) => {
                // A swept list has the schema of its items.
                let of_items = alternatives(schema).into_iter().find_map(|one| one.get("items"));
                for item in items.iter() {
                    self.visit(key, path.clone(), item, of_items.unwrap_or(schema), declared);
                }
            }
            DeValue::Table(table) => {
                for (name, value) in table {
                    let name = name.get_ref().as_ref();
                    let mut schemas = alternatives(schema).into_iter();
                    let own = schemas.find_map(|one| one.get("properties")?.get(name));
                    let path = format!("{path}.{name}");
                    self.visit(key, path, value, own.unwrap_or(&Value::Null), None);
                }
            }
            _ => {
                // A key that takes only lists keeps the text that a message quotes.
                let takes_number = alternatives(schema).into_iter().any(is_number);
                let declared = declared.filter(|_| takes_number);
                let unit = (self.of_expression)(&path, value, schema, declared);
                self.found.push(Scalar {
                    key,
                    path,
                    declared,
                    takes_number,
                    value,
                    unit_of_expression: unit.as_ref().ok().copied().flatten(),
                    problem_of_expression: unit.err(),
                });
            }
        }
    }
}

/// Replaces the quantities of a table and their ratios by their numbers, and removes keys with a
/// reported problem.
pub fn replace<'n>(table: DeTable<'n>, read: &'n ReadUnits) -> DeTable<'n> {
    let number = |start, old| match read.numbers.get(&start).map(|number| DeValue::parse(number)) {
        Some(Ok(number)) => Some(number.into_inner()),
        _ => Some(old),
    };
    let entries = table.into_iter();
    let numbers = entries.filter_map(|(key, value)| Some((key, with_scalars(value, &number)?)));
    let mut table: DeTable<'n> = numbers.collect();
    for key in &read.reported_keys {
        table.remove(key.as_str());
        if let Some(DeValue::Array(cases)) = table.get_mut("cases").map(TomlSpanned::get_mut) {
            for case in cases.iter_mut() {
                if let DeValue::Table(case) = case.get_mut() {
                    case.remove(key.as_str());
                }
            }
        }
    }
    table
}

/// Formats a quantity in its unit: `10 MPa`, `5500 MPa`. Metres and pascals get a prefix if the
/// number is below 0.001 or at least 10,000: `5.5 GPa`. Without a unit, the number alone is
/// formatted.
pub fn written(value: f64, unit: Option<&str>) -> String {
    let Some(unit) = unit.filter(|unit| !unit.is_empty()) else {
        return decimal::written(value);
    };
    let is_plain = value == 0.0 || (1e-3..1e4).contains(&value.abs());
    let base = Unit::find(unit).filter(|unit| unit.power == 0 && !is_plain);
    let better = base.and_then(|known| {
        let converted = |to: &Unit| decimal::nearest(value * known.factor_to(to));
        // `N/mm²` and `N/m` come after the multiples of the unit of the SI by 1000.
        let family = UNITS.iter().filter(|to| to.dimension == known.dimension && to.power % 3 == 0);
        let suitable = family.filter(|to| (1.0..1e3).contains(&converted(to).abs()));
        suitable.map(|to| format!("{} {}", decimal::written(converted(to)), to.symbol)).next()
    });
    better.unwrap_or_else(|| format!("{} {unit}", decimal::written(value)))
}

/// Formats the smallest and the largest of several quantities with three digits: `1 … 100 MPa`.
/// Returns `None` if there are none.
pub fn range(values: impl Iterator<Item = f64>, unit: Option<&str>) -> Option<String> {
    let rounded = |value: f64| format!("{value:.2e}").parse().unwrap_or(value);
    let (lowest, highest) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    let [low, high] = [lowest, highest].map(|value| written(rounded(value), unit));
    (lowest <= highest).then(|| match (low.rsplit_once(' '), high.rsplit_once(' ')) {
        _ if low == high => low,
        (Some((number, low_unit)), Some((_, high_unit))) if low_unit == high_unit => {
            format!("{number} … {high}")
        }
        _ => format!("{low} … {high}"),
    })
}
