//! Derived values of keys: expressions in other keys of the same parameter point and in parameters
//! of the study, such as `nodes = "8 * k_upper"`.
//!
//! A text in the place of a number is an expression. It is evaluated at each parameter point, and
//! the number replaces the text before the values are validated and deserialised. Cache keys and
//! tables are therefore those of a manifest that contains the numbers.
//!
//! A name in an expression is, in this order: another key that the point contains, a parameter, or
//! a key with a declared default. A key never means itself, so `hurst = "hurst"` uses the
//! parameter.

mod dimensions;
mod point;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeTable, DeValue};

use super::Layout;
use super::expression_syntax::{has_unit, syntax_problem};
use super::parameters::Parameters;
use crate::diagnostics::{Problem, did_you_mean, listed};
use crate::expression::{Expression, ExpressionError};
use crate::keys::quantity::{Declared, Unit};
use crate::keys::schema::{alternatives, is_number, is_of_type, is_type, words};
use crate::keys::values::with_scalars;

pub use point::{Point, replaced};

type Written<'i> = TomlSpanned<DeValue<'i>>;

/// Names that the expressions of a table can use in addition to the keys of the table.
#[derive(Default)]
pub struct Scope<'a> {
    pub parameters: Option<&'a Parameters<'a>>,
    /// The swept parameters that the table uses; filled by the reader of the table.
    pub swept: RefCell<BTreeSet<String>>,
}

/// The expressions of a table: the keys that the table can have, and further names.
#[derive(Clone, Copy)]
pub struct Expressions<'a> {
    pub layout: &'static Layout,
    pub scope: &'a Scope<'a>,
}

impl<'a> Expressions<'a> {
    /// Parses a text in the place of a number. Returns `None` if the value is not a text, or a text
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
        let parsed = Expression::parse_without_pi(text);
        let is_plausible = match &parsed {
            Ok(expression) => expression.columns().into_iter().all(|name| self.knows(name)),
            Err(_) => false,
        };
        // If the key takes words, any other text is probably a misspelt word.
        (words.is_empty() || is_plausible).then_some(parsed)
    }

    /// Checks a text in the place of a number: its syntax and its names. Returns `None` if the
    /// value is not an expression, and otherwise the problems of the expression.
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

    /// Returns the unit of an expression of `table` in which parameters have units; `None` for all
    /// other values. `schema` and `declared` are those of the value.
    ///
    /// # Errors
    /// Returns the problem of an expression whose unit does not belong to the key `path`.
    pub fn unit(
        self,
        table: &DeTable<'_>,
        path: &str,
        written: &Written<'_>,
        schema: &Value,
        declared: Option<Declared>,
    ) -> Result<Option<&'static Unit>, Problem> {
        let Some(Ok(expression)) = self.parse(written.get_ref(), &alternatives(schema)) else {
            return Ok(None);
        };
        let name = path.split('.').next().unwrap_or(path);
        let key = dimensions::Key { table, name, declared };
        dimensions::unit_of(self, &key, &expression).map_err(|reason| {
            let message = format!("the expression of `{path}` has another unit");
            Problem::new(message, written.span(), reason)
        })
    }

    fn knows(self, name: &str) -> bool {
        self.layout.has(name) || self.parameters().contains(&name)
    }

    /// Returns the names of parameters.
    fn parameters(&self) -> Vec<&str> {
        self.scope.parameters.iter().flat_map(|parameters| parameters.names()).collect()
    }

    fn unknown_name(self, path: &str, written: &Written<'_>, name: &str) -> Problem {
        let properties = self.layout.properties().iter();
        let takes_number = |schema: &Value| alternatives(schema).into_iter().any(is_number);
        let keys = properties.filter(|(_, schema)| takes_number(schema));
        let own = path.split('.').next();
        let mut known = self.parameters();
        known.extend(keys.map(|(key, _)| key.as_str()).filter(|key| own != Some(key)));
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

    /// Returns a table in which quantities take the places of the names of parameters that hold
    /// them: `side = "length"` becomes `side = "100 um"`. Expressions only compute with numbers.
    pub fn with_quantities<'t>(self, table: DeTable<'t>) -> DeTable<'t>
    where
        Self: 't,
    {
        let Some(parameters) = self.scope.parameters else {
            return table;
        };
        let mut quantities = BTreeMap::new();
        let mut find = |key: &str, value: &Written<'_>| {
            let Some(schema) = self.layout.properties().get(key) else { return };
            self.for_each(value, schema, &mut |written, _, expression| {
                let Expression::Column(name) = expression else { return };
                let is_key = name != key && table.contains_key(name.as_str());
                let parameter = parameters.get(&name).filter(|known| !known.is_swept && !is_key);
                let value = parameter.and_then(|parameter| parameter.values.first());
                let has_unit =
                    |value: &&Written<'_>| value.get_ref().as_str().is_some_and(has_unit);
                if let Some(value) = value.filter(has_unit) {
                    parameters.use_in(&name, &mut BTreeSet::new());
                    quantities.insert(written.span().start, value.get_ref());
                }
            });
        };
        for (key, value) in &table {
            let key = key.get_ref().as_ref();
            find(key, value);
            for item in value.get_ref().as_array().into_iter().flatten() {
                match item.get_ref() {
                    DeValue::Table(case) if key == "cases" => {
                        case.iter().for_each(|(key, value)| find(key.get_ref(), value));
                    }
                    _ => find(key, item),
                }
            }
        }
        let quantity = |start, old| {
            Some(quantities.get(&start).map_or(old, |value: &&DeValue<'t>| (*value).clone()))
        };
        let entries = table.into_iter();
        entries.filter_map(|(key, value)| Some((key, with_scalars(value, &quantity)?))).collect()
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

#[cfg(test)]
mod tests;
