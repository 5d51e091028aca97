//! Evaluation of the expressions of a parameter point.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use toml::de::{DeTable, DeValue};

use super::{Expressions, Written};
use crate::decimal;
use crate::diagnostics::{Problem, Span};
use crate::expression::Expression;
use crate::keys::bounds::number;
use crate::keys::expression_syntax::has_unit;
use crate::keys::parameters::Parameters;
use crate::keys::quantity::{Declared, Unit, Units, split};
use crate::keys::schema::{alternatives, is_type};
use crate::keys::values::with_scalars;

/// A parameter point whose keys may be expressions.
pub struct Point<'a> {
    expressions: Expressions<'a>,
    units: &'a Units,
    table: &'a DeTable<'a>,
    /// The values of the swept parameters at this point.
    chosen: &'a BTreeMap<&'a str, &'a Written<'a>>,
    /// Keys with a problem that has been reported.
    reported_keys: &'a BTreeSet<String>,
    /// Results by the position of the expression.
    results: RefCell<BTreeMap<usize, Evaluation>>,
    /// Numbers of the parameters that have been evaluated.
    known_parameters: RefCell<BTreeMap<String, f64>>,
    /// Expressions whose evaluation has begun, each with its key. The evaluation of one expression
    /// needs the result of the next one.
    under_way: RefCell<Vec<(String, Span)>>,
    /// Problems with expressions, each with the key that contains the expression.
    problems: RefCell<Vec<(String, Problem)>>,
}

/// The outcome of the evaluation of an expression.
#[derive(Clone, Copy)]
enum Evaluation {
    Done(f64),
    /// The expression has no result, and a problem was reported.
    Failed,
}

/// The numbers of a parameter point as TOML texts, by the positions of their expressions. `None` if
/// an expression has no valid result.
pub type Numbers = BTreeMap<usize, Option<String>>;

/// A reason why an expression has no result.
enum Failure {
    /// A problem with one of its names has been reported.
    Reported,
    Reason(String),
}

impl<'a> Point<'a> {
    /// Evaluates all expressions of a point. Returns the numbers, and problems with the keys of
    /// expressions.
    pub fn evaluate(
        expressions: Expressions<'a>,
        units: &'a Units,
        table: &'a DeTable<'a>,
        chosen: &'a BTreeMap<&'a str, &'a Written<'a>>,
        reported_keys: &'a BTreeSet<String>,
    ) -> (Numbers, Vec<(String, Problem)>) {
        let (results, known_parameters, under_way, problems) = Default::default();
        let point = Point {
            expressions,
            units,
            table,
            chosen,
            reported_keys,
            results,
            known_parameters,
            under_way,
            problems,
        };
        let mut numbers = Numbers::new();
        for (key, value) in table {
            let key = key.get_ref().as_ref();
            let schema = &expressions.layout.properties()[key];
            expressions.for_each(value, schema, &mut |written, alternatives, expression| {
                let number = point.result(key, written, &expression);
                let text = number.ok().map(|number| match point.exact_integer(key, &expression) {
                    Some(integer) => integer,
                    None => {
                        let number = units.in_unit_of_key(number, &written.span());
                        toml_number(number, alternatives)
                    }
                });
                numbers.insert(written.span().start, text);
            });
        }
        (numbers, point.problems.into_inner())
    }

    /// Returns the result of the expression `written` in the value of a key. Reports a problem if
    /// there is none.
    fn result(
        &self,
        key: &str,
        written: &Written<'_>,
        expression: &Expression,
    ) -> Result<f64, Failure> {
        let span = written.span();
        match self.results.borrow().get(&span.start) {
            Some(Evaluation::Done(result)) => return Ok(*result),
            Some(Evaluation::Failed) => return Err(Failure::Reported),
            None => {}
        }
        let begun = self.under_way.borrow().iter().position(|(_, other)| *other == span);
        if let Some(first) = begun {
            let message = "keys depend on each other in a cycle";
            let problem = Problem::cycle(message, "uses", &self.under_way.borrow()[first..])
                .help("write one of these keys as a number");
            self.problems.borrow_mut().push((key.to_owned(), problem));
            return Err(Failure::Reported);
        }
        self.under_way.borrow_mut().push((key.to_owned(), span.clone()));
        let result = self.computed(key, expression);
        self.under_way.borrow_mut().pop();
        let progress =
            result.as_ref().map_or(Evaluation::Failed, |result| Evaluation::Done(*result));
        self.results.borrow_mut().insert(span.start, progress);
        result.map_err(|failure| {
            if let Failure::Reason(reason) = failure {
                let text = written.get_ref().as_str().unwrap_or_default();
                let message = format!("`{key}`: cannot compute `{text}`");
                let problem = Problem::new(message, span, reason);
                self.problems.borrow_mut().push((key.to_owned(), problem));
            }
            Failure::Reported
        })
    }

    fn computed(&self, key: &str, expression: &Expression) -> Result<f64, Failure> {
        let names = expression.columns().into_iter();
        let values: BTreeMap<&str, f64> =
            names.map(|name| Ok((name, self.name(name, key)?))).collect::<Result<_, Failure>>()?;
        if let Some(reason) = self.lacks_unit(values.keys().copied(), key) {
            return Err(Failure::Reason(reason));
        }
        let result = expression.value(&|name| values[name]);
        if result.is_finite() {
            return Ok(result);
        }
        let told = values.iter().map(|(name, value)| format!("`{name}` is {value}, "));
        Err(Failure::Reason(format!("{}the result is {result}", told.collect::<String>())))
    }

    /// Returns the reason why an expression in the value of `key` cannot be computed if one of its
    /// names is a key whose number has no unit, and another one is a parameter with a unit.
    fn lacks_unit<'n>(
        &self,
        names: impl Iterator<Item = &'n str> + Clone,
        key: &str,
    ) -> Option<String> {
        let Expressions { layout, scope } = self.expressions;
        let parameters = scope.parameters?;
        let is_key = |name: &str| name != key && self.table.contains_key(name);
        let is_parameter = |name: &str| parameters.get(name).is_some() && !is_key(name);
        let has_no_unit = |name: &&str| {
            let schema = layout.properties().get(*name).filter(|_| !is_parameter(name));
            let declared = schema.and_then(Declared::from_schema);
            declared.is_some_and(|one| !one.or_ratio && self.units.lacks(one.dimension))
        };
        let plain = names.clone().find(has_no_unit)?;
        let mut of_parameters = names.filter(|name| is_parameter(name));
        let with_unit = of_parameters.find_map(|name| parameters.with_unit(name))?;
        Some(format!("`{plain}` has no unit, but `{with_unit}` has one"))
    }

    /// Returns the number that a name means in the value of `key`.
    fn name(&self, name: &str, key: &str) -> Result<f64, Failure> {
        let Expressions { layout, scope } = self.expressions;
        if name != key && self.table.contains_key(name) {
            return self.key(name);
        }
        if name != key && self.reported_keys.contains(name) {
            return Err(Failure::Reported);
        }
        if let Some(parameters) = scope.parameters.filter(|known| known.get(name).is_some()) {
            return self.parameter(parameters, name);
        }
        let reason = if name == key {
            format!("`{key}` depends on itself, and there is no parameter `{key}`")
        } else if let Some(default) = layout.default_number(name) {
            return Ok(default);
        } else {
            format!("`{name}` is not given")
        };
        Err(Failure::Reason(reason))
    }

    /// Returns the number of another key of the point.
    fn key(&self, name: &str) -> Result<f64, Failure> {
        let no_number = || Failure::Reason(format!("`{name}` is not a single number here"));
        let written = self.table.get(name).ok_or(Failure::Reported)?;
        match written.get_ref() {
            value @ (DeValue::Integer(_) | DeValue::Float(_)) => Ok(number(value)),
            value @ DeValue::String(_) => {
                let schema = &self.expressions.layout.properties()[name];
                match self.expressions.parse(value, &alternatives(schema)) {
                    Some(Ok(expression)) => self.result(name, written, &expression),
                    _ => Err(no_number()),
                }
            }
            _ => Err(no_number()),
        }
    }

    /// Returns the number of a parameter at this point. Each parameter on which it depends is
    /// evaluated once. Cycles have been reported before.
    fn parameter(&self, parameters: &Parameters<'_>, name: &str) -> Result<f64, Failure> {
        let mut known = self.known_parameters.borrow_mut();
        let mut pending = vec![name.to_owned()];
        while let Some(name) = pending.last() {
            let first = || parameters.get(name).and_then(|parameter| parameter.values.first());
            let value =
                self.chosen.get(name.as_str()).copied().or_else(first).ok_or(Failure::Reported)?;
            let number = match value.get_ref() {
                DeValue::String(text) if has_unit(text) => {
                    let read = |(number, unit)| Some((number, Unit::find(unit)?));
                    let Some((number, unit)) = split(text).and_then(read) else {
                        let reason = format!("`{name}` is {text:?}, which has no known unit");
                        return Err(Failure::Reason(reason));
                    };
                    self.units.computed(number, unit)
                }
                DeValue::String(text) => {
                    let expression =
                        Expression::parse_without_pi(text).map_err(|_| Failure::Reported)?;
                    let names = expression.columns().into_iter();
                    let unknown: Vec<String> = names
                        .filter(|name| !known.contains_key(*name))
                        .map(str::to_owned)
                        .collect();
                    if !unknown.is_empty() {
                        pending.extend(unknown);
                        continue;
                    }
                    expression.value(&|name| known[name])
                }
                plain => number(plain),
            };
            known.insert(name.clone(), number);
            pending.pop();
        }
        Ok(known[name])
    }

    /// Returns the integer of an expression that only names a parameter. Integers above 2⁵³, such
    /// as seeds, are not rounded.
    fn exact_integer(&self, key: &str, expression: &Expression) -> Option<String> {
        let Expression::Column(name) = expression else {
            return None;
        };
        if name != key && self.table.contains_key(name.as_str()) {
            return None;
        }
        let parameter = self.expressions.scope.parameters?.get(name)?;
        let value = self.chosen.get(name.as_str()).copied().or(parameter.values.first())?;
        value.get_ref().as_integer().map(ToString::to_string)
    }
}

/// Returns a value in which numbers take the places of their expressions, or `None` if one of the
/// expressions has no valid result.
pub fn replaced<'p>(value: Written<'p>, numbers: &'p Numbers) -> Option<Written<'p>> {
    with_scalars(value, &|start, old| match numbers.get(&start) {
        Some(number) => {
            let number = DeValue::parse(number.as_ref()?);
            Some(number.expect("a number is valid TOML").into_inner())
        }
        None => Some(old),
    })
}

/// Formats a computed number for a key: whole numbers as integers if the key takes integers.
fn toml_number(number: f64, alternatives: &[&Value]) -> String {
    /// Largest number up to which all integers are exact in double precision.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    let number = decimal::nearest(number);
    let takes_integer = alternatives.iter().any(|one| is_type(one, "integer"));
    if takes_integer && number.fract() == 0.0 && number.abs() <= EXACT {
        format!("{}", number as i64)
    } else {
        format!("{number:?}")
    }
}
