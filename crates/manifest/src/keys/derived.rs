//! Derived values of keys: expressions in other keys of the same parameter point and in parameters
//! of the study, such as `nodes = "8 * k_upper"`.
//!
//! A text in the place of a number is an expression. It is evaluated at each parameter point, and
//! the number replaces the text before the values are validated and deserialised. Cache keys and
//! tables are therefore those of a manifest that contains the numbers.
//!
//! A name in an expression is, in this order: another key that the point contains, a parameter, a
//! [`KnownNumber`], or a key with a declared default. A key never means itself, so
//! `hurst = "hurst"` uses the parameter.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeTable, DeValue};

use super::Layout;
use super::bounds::number;
use super::parameters::Parameters;
use super::validation::{alternatives, is_of_type, is_type, words};
use crate::decimal;
use crate::diagnostics::{Problem, did_you_mean, listed};
use crate::expression::{Expression, ExpressionError};

type Written<'i> = TomlSpanned<DeValue<'i>>;

/// Names that the expressions of a table can use in addition to the keys of the table.
#[derive(Default)]
pub struct Scope<'a> {
    pub parameters: Option<&'a Parameters<'a>>,
    pub known: Option<KnownNumber<'a>>,
    /// The swept parameters that the table uses; filled by the reader of the table.
    pub swept: RefCell<BTreeSet<String>>,
}

/// A number that expressions can use although it is neither a key nor a parameter.
pub struct KnownNumber<'a> {
    pub name: &'static str,
    /// Returns the number at a parameter point, or the reason why it is not known. The first
    /// argument is the key whose expression uses the number.
    pub value: Box<FindNumber<'a>>,
}

/// Function that returns the number for a key at a parameter point, or the reason why it is not
/// known.
pub type FindNumber<'a> = dyn Fn(&str, &Point<'_>) -> Result<f64, String> + 'a;

/// The expressions of a table: the keys that the table can have, and further names.
#[derive(Clone, Copy)]
pub struct Expressions<'a> {
    pub layout: &'static Layout,
    pub scope: &'a Scope<'a>,
}

impl Expressions<'_> {
    /// Parses a text in the place of a number. Returns `None` if the value is no text, or is a text
    /// that the key takes as it is.
    fn parse(
        self,
        value: &DeValue<'_>,
        alternatives: &[&Value],
    ) -> Option<Result<Expression, ExpressionError>> {
        let text = value.as_str()?;
        let words = words(alternatives);
        let takes_text = alternatives.iter().any(|one| is_type(one, "string"));
        let takes_number = alternatives.iter().any(|one| is_number(one));
        let is_own = if words.is_empty() { takes_text } else { words.contains(&text) };
        if !takes_number || is_own || has_unit(text) {
            return None;
        }
        let parsed = Expression::parse(text);
        let is_plausible = match &parsed {
            Ok(expression) => expression.columns().into_iter().all(|name| self.knows(name)),
            Err(_) => false,
        };
        // If the key takes words, any other text is probably a misspelt word.
        (words.is_empty() || is_plausible).then_some(parsed)
    }

    /// Checks a text in the place of a number: its syntax and its names. Returns `None` if the
    /// value is no expression, and otherwise the problems of the expression.
    pub fn check(
        self,
        path: &str,
        written: &Written<'_>,
        alternatives: &[&Value],
    ) -> Option<Vec<Problem>> {
        let expression = match self.parse(written.get_ref(), alternatives)? {
            Ok(expression) if !expression.has_slope() => expression,
            read => return Some(vec![syntax_problem(path, written, read.err().as_ref())]),
        };
        let unknown = expression.columns().into_iter().filter(|name| !self.knows(name));
        Some(unknown.map(|name| self.unknown_name(path, written, name)).collect())
    }

    fn knows(self, name: &str) -> bool {
        self.layout.has(name) || self.further_names().contains(&name)
    }

    /// Returns the names of parameters and known numbers.
    fn further_names(&self) -> Vec<&str> {
        let parameters = self.scope.parameters.iter().flat_map(|parameters| parameters.names());
        parameters.chain(self.scope.known.iter().map(|known| known.name)).collect()
    }

    fn unknown_name(self, path: &str, written: &Written<'_>, name: &str) -> Problem {
        let properties = self.layout.properties().iter();
        let takes_number = |schema: &Value| alternatives(schema).into_iter().any(is_number);
        let keys = properties.filter(|(_, schema)| takes_number(schema));
        let mut known: Vec<&str> = self.further_names();
        known.extend(keys.map(|(key, _)| key.as_str()));
        let whole = written.get_ref().as_str() == Some(name);
        let message = if whole {
            format!("`{path}` must be a number or an expression")
        } else {
            format!("the expression of `{path}` uses an unknown name, `{name}`")
        };
        let label = match did_you_mean(name, known.iter().copied()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("no key of the stage and no parameter is called `{name}`"),
        };
        let help = format!("an expression here can use {}", listed(known, "and"));
        Problem::new(message, written.span(), label).help(help)
    }

    /// Calls `visit` with each expression in a value, with the schemas that its number must
    /// satisfy.
    fn for_each<'t>(
        self,
        value: &'t Written<'_>,
        schema: &Value,
        visit: &mut impl FnMut(&'t Written<'_>, &[&Value], Expression),
    ) {
        let alternatives = alternatives(schema);
        let fitting = alternatives.iter().find(|one| is_of_type(value.get_ref(), one));
        match value.get_ref() {
            DeValue::String(_) => {
                if let Some(Ok(expression)) = self.parse(value.get_ref(), &alternatives) {
                    visit(value, &alternatives, expression);
                }
            }
            DeValue::Array(items) => {
                if let Some(schema) = fitting.and_then(|schema| schema.get("items")) {
                    items.iter().for_each(|item| self.for_each(item, schema, visit));
                }
            }
            DeValue::Table(table) => {
                let Some(schema) = fitting else { return };
                for (key, value) in table {
                    let rules =
                        schema.get("properties").and_then(|keys| keys.get(key.get_ref().as_ref()));
                    if let Some(rules) = rules.or_else(|| schema.get("additionalProperties")) {
                        self.for_each(value, rules, visit);
                    }
                }
            }
            _ => {}
        }
    }

    /// Returns the swept parameters on which the value of a key depends, and marks the parameters
    /// as used. `is_given` tells which other keys every point of the table contains.
    pub fn swept_in(
        self,
        key: &str,
        value: &Written<'_>,
        is_given: impl Fn(&str) -> bool,
    ) -> BTreeSet<String> {
        let mut swept = BTreeSet::new();
        self.for_each(value, &self.layout.properties()[key], &mut |_, _, expression| {
            let names = expression.columns().into_iter();
            for name in names.filter(|name| *name == key || !is_given(name)) {
                if let Some(parameters) = self.scope.parameters {
                    parameters.use_in(name, &mut swept);
                }
            }
        });
        swept
    }
}

/// A parameter point whose keys may be expressions.
pub struct Point<'a> {
    expressions: Expressions<'a>,
    table: &'a DeTable<'a>,
    /// The values of the swept parameters at this point.
    chosen: &'a BTreeMap<&'a str, &'a Written<'a>>,
    /// Keys with a problem that has been reported.
    reported_keys: &'a BTreeSet<String>,
    /// Results by the position of the expression.
    results: RefCell<BTreeMap<usize, Progress>>,
    /// Problems with expressions, each with the key that contains the expression.
    problems: RefCell<Vec<(String, Problem)>>,
}

/// The progress of the evaluation of an expression.
#[derive(Clone, Copy)]
enum Progress {
    UnderWay,
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
        table: &'a DeTable<'a>,
        chosen: &'a BTreeMap<&'a str, &'a Written<'a>>,
        reported_keys: &'a BTreeSet<String>,
    ) -> (Numbers, Vec<(String, Problem)>) {
        let (results, problems) = Default::default();
        let point = Point { expressions, table, chosen, reported_keys, results, problems };
        let mut numbers = Numbers::new();
        for (key, value) in table {
            let key = key.get_ref().as_ref();
            let schema = &expressions.layout.properties()[key];
            expressions.for_each(value, schema, &mut |written, alternatives, expression| {
                let number = point.result(key, written, &expression);
                let text = number.ok().map(|number| match point.exact_integer(key, &expression) {
                    Some(integer) => integer,
                    None => toml_number(number, alternatives),
                });
                numbers.insert(written.span().start, text);
            });
        }
        (numbers, point.problems.into_inner())
    }

    /// Returns the value of a key as written, if the point contains the key.
    pub fn value(&self, key: &str) -> Option<&DeValue<'_>> {
        self.table.get(key).map(TomlSpanned::get_ref)
    }

    /// Returns the number of a key, or its declared default. Returns `None` if the key holds no
    /// single number.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.key(key).ok().or_else(|| self.expressions.layout.default_number(key))
    }

    /// Returns the result of the expression `written` in the value of a key. Reports a problem if
    /// there is none.
    fn result(
        &self,
        key: &str,
        written: &Written<'_>,
        expression: &Expression,
    ) -> Result<f64, Failure> {
        let position = written.span().start;
        let known = self.results.borrow().get(&position).copied();
        match known {
            Some(Progress::Done(result)) => return Ok(result),
            Some(Progress::Failed) => return Err(Failure::Reported),
            Some(Progress::UnderWay) => {
                return Err(Failure::Reason(format!("`{key}` depends on this key")));
            }
            None => self.results.borrow_mut().insert(position, Progress::UnderWay),
        };
        let result = self.computed(key, expression);
        let progress = result.as_ref().map_or(Progress::Failed, |result| Progress::Done(*result));
        self.results.borrow_mut().insert(position, progress);
        result.map_err(|failure| {
            if let Failure::Reason(reason) = failure {
                let text = written.get_ref().as_str().unwrap_or_default();
                let message = format!("`{key}`: cannot compute `{text}`");
                let problem = Problem::new(message, written.span(), reason);
                self.problems.borrow_mut().push((key.to_owned(), problem));
            }
            Failure::Reported
        })
    }

    fn computed(&self, key: &str, expression: &Expression) -> Result<f64, Failure> {
        let names = expression.columns().into_iter();
        let values = names.map(|name| Ok((name, self.name(name, key)?)));
        let values = values.collect::<Result<BTreeMap<&str, f64>, Failure>>()?;
        let result = expression.value(&|name| values[name]);
        if result.is_finite() {
            return Ok(result);
        }
        let values = values.iter().map(|(name, value)| format!("`{name}` is {value}, "));
        Err(Failure::Reason(format!("{}the result is {result}", values.collect::<String>())))
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
        if let Some(known) = scope.known.as_ref().filter(|known| known.name == name) {
            return (known.value)(key, self).map_err(Failure::Reason);
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

    /// Returns the number of a parameter at this point.
    fn parameter(&self, parameters: &Parameters<'_>, name: &str) -> Result<f64, Failure> {
        let first = || parameters.get(name).and_then(|parameter| parameter.values.first());
        let value = self.chosen.get(name).copied().or_else(first).ok_or(Failure::Reported)?;
        let text = match value.get_ref() {
            DeValue::String(text) => text.as_ref(),
            plain => return Ok(number(plain)),
        };
        if has_unit(text) {
            let reason = format!("`{name}` is {text:?}, and expressions take plain numbers");
            return Err(Failure::Reason(reason));
        }
        let expression = Expression::parse(text).map_err(|_| Failure::Reported)?;
        let names = expression.columns().into_iter();
        let values = names.map(|name| Ok((name, self.parameter(parameters, name)?)));
        let values = values.collect::<Result<BTreeMap<&str, f64>, Failure>>()?;
        Ok(expression.value(&|name| values[name]))
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
    let span = value.span();
    let plain = match value.into_inner() {
        DeValue::Array(items) => {
            let items = items.into_iter().map(|item| replaced(item, numbers));
            DeValue::Array(items.collect::<Option<_>>()?)
        }
        DeValue::Table(table) => {
            let entries = table.into_iter();
            let entries = entries.map(|(key, value)| Some((key, replaced(value, numbers)?)));
            DeValue::Table(entries.collect::<Option<_>>()?)
        }
        other => match numbers.get(&span.start) {
            Some(number) => {
                let number = DeValue::parse(number.as_ref()?);
                number.expect("a number is valid TOML").into_inner()
            }
            None => other,
        },
    };
    Some(TomlSpanned::new(span, plain))
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

fn is_number(schema: &Value) -> bool {
    is_type(schema, "number") || is_type(schema, "integer")
}

/// Returns whether a text is a number alone, or a number followed by a unit: `"2"`, `"10 MPa"`.
pub fn has_unit(text: &str) -> bool {
    let text = text.trim().trim_start_matches(['+', '-']);
    let rest = text.trim_start_matches(|letter: char| letter.is_ascii_digit() || letter == '.');
    if rest.len() == text.len() {
        return false;
    }
    let exponent = rest.strip_prefix(['e', 'E']).map(|power| power.trim_start_matches(['+', '-']));
    let power = exponent.filter(|power| power.starts_with(|digit: char| digit.is_ascii_digit()));
    let rest = match power {
        Some(power) => power.trim_start_matches(|digit: char| digit.is_ascii_digit()),
        None => rest,
    };
    let is_unit = |letter: char| letter.is_alphabetic() || matches!(letter, '%' | '°' | 'µ');
    rest.trim_start().chars().next().is_none_or(is_unit)
}

/// Returns the problem of an expression that cannot be parsed, or that uses `slope` if there is no
/// `error`.
pub fn syntax_problem(
    path: &str,
    written: &Written<'_>,
    error: Option<&ExpressionError>,
) -> Problem {
    let text = written.get_ref().as_str().unwrap_or_default();
    let message = format!("cannot read the expression of `{path}`");
    let (span, label) = match error {
        Some(error) => (error.span_in(text, &written.span()), error.reason.clone()),
        None => (written.span(), "`slope` needs the loads of a surface".to_owned()),
    };
    Problem::new(message, span, label).help(
        "an expression has numbers, names of keys and parameters, `+ - * / ^`, parentheses, `ln(…)` \
         and `sqrt(…)`",
    )
}

#[cfg(test)]
mod tests;
