//! Units of expressions in which parameters have units: `2 * length` is a length.

use std::array;
use std::collections::{BTreeMap, BTreeSet};

use toml::de::{DeTable, DeValue};

use super::{Expressions, Written};
use crate::expression::{Expression, Function, Operator};
use crate::keys::quantity::{Declared, Dimension, Unit, split};

/// Exponents of m, N, W, K and Ω in a unit.
type Exponents = [i32; 5];

/// Exponents of a pure number.
const PURE: Exponents = [0; 5];

/// Key whose value an expression is.
pub struct Key<'a> {
    pub table: &'a DeTable<'a>,
    pub name: &'a str,
    /// Declaration of the value.
    pub declared: Option<Declared>,
}

/// Search for the unit of an expression.
struct Search<'a> {
    expressions: Expressions<'a>,
    key: &'a Key<'a>,
    /// Units of the parameters on which the expression depends.
    units: Vec<&'static Unit>,
    /// Exponents of these parameters.
    known: BTreeMap<String, Result<Option<Exponents>, String>>,
}

/// Returns the unit of the result of an expression in the value of `key`: that of the first
/// parameter with the same dimension or, without one, that of the SI. Returns `None` for a pure
/// number, and for expressions in which nothing has a unit.
///
/// # Errors
/// Returns the reason why the expression is not a quantity of the declared dimension.
pub fn unit_of(
    expressions: Expressions<'_>,
    key: &Key<'_>,
    expression: &Expression,
) -> Result<Option<&'static Unit>, String> {
    let mut search = Search { expressions, key, units: Vec::new(), known: BTreeMap::new() };
    let names = expression.columns().into_iter().filter(|name| !search.is_key(name));
    search.find_parameters(names.map(str::to_owned).collect());
    let found = search.exponents(expression, false);
    if search.units.is_empty() {
        return Ok(None);
    }
    let declared = key.declared;
    let dimensions = declared.into_iter().flat_map(Declared::dimensions);
    let mut wanted: Vec<Exponents> = dimensions.map(Dimension::exponents).collect();
    if wanted.is_empty() {
        wanted.push(PURE);
    }
    let exponents = found?.unwrap_or(wanted[0]);
    let may_be_pure = declared.is_some_and(|declared| declared.or_ratio);
    let is_accepted = wanted.contains(&exponents) || exponents == PURE && may_be_pure;
    if !is_accepted {
        let accepted: Vec<String> = wanted.into_iter().map(named).collect();
        return Err(format!("must be {}, but this is {}", accepted.join(" or "), named(exponents)));
    }
    let own = search.units.iter().find(|unit| unit.dimension.exponents() == exponents);
    Ok(own.copied().or_else(|| Unit::si_of(exponents)))
}

impl Search<'_> {
    /// Returns the exponents of the result, or `None` if it can have any unit. `is_parameter` tells
    /// that the expression is the value of a parameter.
    fn exponents(
        &self,
        expression: &Expression,
        is_parameter: bool,
    ) -> Result<Option<Exponents>, String> {
        match expression {
            Expression::Number(_) => Ok(Some(PURE)),
            Expression::Column(name) => self.of_name(name, is_parameter),
            Expression::Negative(one) => self.exponents(one, is_parameter),
            Expression::Operation(Operator::Power, one, power) => {
                let base = self.exponents(one, is_parameter)?;
                if self.exponents(power, is_parameter)?.is_some_and(|power| power != PURE) {
                    return Err("an exponent must be a pure number".to_owned());
                }
                match (base, whole(power)) {
                    (None | Some(PURE), _) => Ok(base),
                    (Some(base), Some(power)) => {
                        Ok(Some(base.map(|one| one.saturating_mul(power))))
                    }
                    (Some(_), None) => {
                        Err("a quantity with a unit needs a whole exponent".to_owned())
                    }
                }
            }
            Expression::Operation(operator, one, other) => {
                let one = self.exponents(one, is_parameter)?;
                let other = self.exponents(other, is_parameter)?;
                let (Some(left), Some(right)) = (one, other) else {
                    let is_sum = matches!(operator, Operator::Sum | Operator::Difference);
                    return Ok(one.or(other).filter(|_| is_sum));
                };
                let combined = |sign: i32| {
                    array::from_fn(|i| left[i].saturating_add(right[i].saturating_mul(sign)))
                };
                match operator {
                    Operator::Product => Ok(Some(combined(1))),
                    Operator::Quotient => Ok(Some(combined(-1))),
                    _ if left == right => Ok(one),
                    _ => Err(format!("this adds {} to {}", named(right), named(left))),
                }
            }
            Expression::Call(function, one) => match (self.exponents(one, is_parameter)?, function)
            {
                (exponents @ (None | Some(PURE)), _) => Ok(exponents),
                (exponents, Function::Absolute) => Ok(exponents),
                (Some(exponents), Function::SquareRoot)
                    if exponents.iter().all(|one| one % 2 == 0) =>
                {
                    Ok(Some(exponents.map(|one| one / 2)))
                }
                (Some(exponents), function) => {
                    Err(format!("`{}` of {}", function.word(), named(exponents)))
                }
            },
        }
    }

    fn of_name(&self, name: &str, is_parameter: bool) -> Result<Option<Exponents>, String> {
        if let Some(known) = self.known.get(name).filter(|_| is_parameter || !self.is_key(name)) {
            return known.clone();
        }
        let schema = self.expressions.layout.properties().get(name);
        let declared = schema.and_then(Declared::from_schema);
        Ok(match declared {
            Some(declared) if declared.or_ratio => None,
            Some(declared) => Some(declared.dimension.exponents()),
            None => schema.map(|_| PURE),
        })
    }

    /// Returns whether a name in the expression is another key. A key never means itself, and a
    /// parameter shadows keys that the table does not contain.
    fn is_key(&self, name: &str) -> bool {
        let Expressions { layout, scope } = self.expressions;
        let cases = self.key.table.get("cases").and_then(|cases| cases.get_ref().as_array());
        let mut points = cases.into_iter().flatten().filter_map(|case| case.get_ref().as_table());
        let is_parameter =
            || scope.parameters.is_some_and(|parameters| parameters.get(name).is_some());
        name != self.key.name
            && layout.has(name)
            && (self.key.table.contains_key(name)
                || points.any(|case| case.contains_key(name))
                || !is_parameter())
    }

    /// Finds the exponents of parameters and of those on which they depend, each once.
    fn find_parameters(&mut self, names: Vec<String>) {
        let Some(parameters) = self.expressions.scope.parameters else { return };
        let mut pending = names;
        while let Some(name) = pending.last() {
            let Some(parameter) = parameters.get(name).filter(|_| !self.known.contains_key(name))
            else {
                pending.pop();
                continue;
            };
            let texts = parameter.values.iter().filter_map(|value| value.get_ref().as_str());
            let plain = texts.filter(|text| split(text).is_none());
            let expressions = plain.filter_map(|text| Expression::parse_without_pi(text).ok());
            let used: BTreeSet<String> = expressions
                .flat_map(|used| used.columns().into_iter().map(str::to_owned).collect::<Vec<_>>())
                .filter(|used| parameters.get(used).is_some() && !self.known.contains_key(used))
                .collect();
            if !used.is_empty() {
                pending.extend(used);
                continue;
            }
            let exponents = self.of_parameter(name, &parameter.values);
            self.known.insert(name.clone(), exponents);
            pending.pop();
        }
    }

    /// Returns the exponents that all values of a parameter have.
    fn of_parameter(
        &mut self,
        name: &str,
        values: &[Written<'_>],
    ) -> Result<Option<Exponents>, String> {
        let mut common = None;
        for value in values {
            let exponents = match value.get_ref() {
                DeValue::String(text) => match split(text).and_then(|(_, unit)| Unit::find(unit)) {
                    Some(unit) => {
                        self.units.push(unit);
                        Some(unit.dimension.exponents())
                    }
                    None => match Expression::parse_without_pi(text) {
                        Ok(expression) => self.exponents(&expression, true)?,
                        Err(_) => None,
                    },
                },
                _ => Some(PURE),
            };
            if common.is_some_and(|common| common != exponents) {
                return Err(format!("the values of `{name}` are different quantities"));
            }
            common = Some(exponents);
        }
        Ok(common.flatten())
    }
}

/// Returns the integer that an expression is.
fn whole(expression: &Expression) -> Option<i32> {
    let number = match expression {
        Expression::Negative(one) => -whole(one)?,
        Expression::Number(number) if number.fract() == 0.0 && number.abs() < 10.0 => {
            *number as i32
        }
        _ => return None,
    };
    Some(number)
}

/// Names the quantity with these exponents, with its article.
fn named(exponents: Exponents) -> String {
    match Unit::si_of(exponents) {
        Some(unit) => format!("a {}", unit.dimension),
        None if exponents == PURE => "a pure number".to_owned(),
        None => "another quantity".to_owned(),
    }
}
