//! The table `[parameters]`: named numbers and sweeps, which keys of several stages use in
//! [expressions](super::derived).

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::diagnostics::{Problem, Problems, Span, listed, suggestion};
use crate::expression::{Expression, Function};
use crate::keys::expression_syntax::{has_unit, syntax_problem};
use crate::keys::quantity::split;
use crate::keys::values::{found, remove_repeats};

/// The parameters of a study.
#[derive(Debug, Default)]
pub struct Parameters<'i> {
    by_name: BTreeMap<String, Parameter<'i>>,
    used: RefCell<BTreeSet<String>>,
}

/// A parameter with its value, or its values if it is swept.
#[derive(Debug)]
pub struct Parameter<'i> {
    /// Position of the name of the parameter.
    pub span: Span,
    /// The value, or the values of a sweep. Empty if a problem with the parameter has been
    /// reported.
    pub values: Vec<TomlSpanned<DeValue<'i>>>,
    /// True if the value is a list.
    pub is_swept: bool,
    /// Names in the expressions of the values, with the positions of the expressions.
    uses: Vec<(String, Span)>,
}

impl<'i> Parameters<'i> {
    /// Reads the table `[parameters]` and reports problems with it.
    pub fn read(table: DeTable<'i>, problems: &mut Problems) -> Parameters<'i> {
        let mut parameters = Parameters::default();
        for (name, value) in table {
            let parameter = Parameter::read(&name, value, problems);
            parameters.by_name.insert(name.into_inner().into_owned(), parameter);
        }
        parameters.check_names(problems);
        parameters.check_cycles(problems);
        parameters
    }

    /// Returns the parameter of this name.
    pub fn get(&self, name: &str) -> Option<&Parameter<'i>> {
        self.by_name.get(name)
    }

    /// Returns the names of all parameters.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.by_name.keys().map(String::as_str)
    }

    /// Marks a parameter as used. Among it and the parameters on which it depends, adds those that
    /// are swept to `swept`.
    pub fn use_in(&self, name: &str, swept: &mut BTreeSet<String>) {
        for (name, parameter) in self.reached(name) {
            if parameter.is_swept {
                swept.insert(name.to_owned());
            }
            self.used.borrow_mut().insert(name.to_owned());
        }
    }

    /// Returns the first parameter with a unit among `name` and the parameters on which it depends.
    pub fn with_unit<'p>(&'p self, name: &'p str) -> Option<&'p str> {
        let has_unit = |value: &TomlSpanned<DeValue<'_>>| {
            value.get_ref().as_str().is_some_and(|text| split(text).is_some())
        };
        let reached = self.reached(name).into_iter();
        reached.filter(|(_, one)| one.values.iter().any(has_unit)).map(|(name, _)| name).next()
    }

    /// Returns the parameter `name` and those on which it depends.
    fn reached<'p>(&'p self, name: &'p str) -> Vec<(&'p str, &'p Parameter<'i>)> {
        let mut reached: Vec<(&str, &Parameter<'i>)> = Vec::new();
        let mut pending = vec![name];
        while let Some(name) = pending.pop() {
            let is_new = reached.iter().all(|(known, _)| *known != name);
            if let Some(parameter) = self.by_name.get(name).filter(|_| is_new) {
                reached.push((name, parameter));
                pending.extend(parameter.uses.iter().map(|(name, _)| name.as_str()));
            }
        }
        reached
    }

    /// Reports parameters that no stage has used. Parameters before the position `inherited` may be
    /// unused; their names are returned.
    pub fn report_unused(&self, inherited: usize, problems: &mut Problems) -> Vec<String> {
        let used = self.used.borrow();
        let unused = self.by_name.iter().filter(|(name, _)| !used.contains(*name));
        let (allowed, own): (Vec<_>, Vec<_>) =
            unused.partition(|(_, parameter)| parameter.span.start < inherited);
        for (name, parameter) in own {
            let message = format!("no stage uses the parameter `{name}`");
            let problem = Problem::new(message, parameter.span.clone(), "unused");
            problems.push(problem.help(format!(
                "use it in a key, as in `k_upper = \"{name}\"` or `\"2 * {name}\"`, or remove it"
            )));
        }
        allowed.into_iter().map(|(name, _)| name.clone()).collect()
    }

    /// Reports names in expressions of parameters that are not parameters.
    fn check_names(&mut self, problems: &mut Problems) {
        let names: BTreeSet<String> = self.by_name.keys().cloned().collect();
        for (own, parameter) in &mut self.by_name {
            let mut is_valid = true;
            for (name, span) in parameter.uses.iter().filter(|(name, _)| !names.contains(name)) {
                let message = format!("the parameter `{own}` uses `{name}`");
                let known = names.iter().map(String::as_str).filter(|known| known != own);
                let label = suggestion('`', name, known.clone(), "not a parameter");
                let problem = Problem::new(message, span.clone(), label);
                let help = format!(
                    "an expression in `[parameters]` can use the other parameters: {}",
                    listed(known, "and")
                );
                problems.push(problem.help(help));
                is_valid = false;
            }
            if !is_valid {
                parameter.clear();
            }
        }
    }

    /// Reports parameters that depend on themselves.
    fn check_cycles(&mut self, problems: &mut Problems) {
        let names: Vec<String> = self.by_name.keys().cloned().collect();
        // Parameters that are in no cycle, which the search need not visit again.
        let mut free = BTreeSet::new();
        for name in &names {
            let links = self.cycle(name, &free);
            free.insert(name.as_str());
            let problem = match links.as_slice() {
                [] => continue,
                [(_, span)] => {
                    let message = format!("the parameter `{name}` depends on itself");
                    Problem::new(message, span.clone(), "uses itself")
                }
                links => {
                    Problem::cycle("parameters depend on each other in a cycle", "uses", links)
                }
            };
            problems.push(problem.help("write one of these parameters as a number"));
            self.by_name.get_mut(name).expect("it is known").clear();
        }
    }

    /// Returns the parameters through which a parameter depends on itself, beginning with this one.
    /// Each has the position at which it uses the next one. Returns none if there is no cycle.
    fn cycle(&self, name: &str, free: &BTreeSet<&str>) -> Vec<(&str, Span)> {
        // The parameter that uses the key of the map, and the position at which it does.
        let mut users: BTreeMap<&str, (&str, Span)> = BTreeMap::new();
        let mut pending: Vec<&str> =
            self.by_name.get_key_value(name).map_or(vec![], |(own, _)| vec![own]);
        while let Some(user) = pending.pop() {
            for (used, span) in &self.by_name[user].uses {
                if !free.contains(used.as_str()) && !users.contains_key(used.as_str()) {
                    users.insert(used, (user, span.clone()));
                    pending.push(used);
                }
            }
        }
        let mut links: Vec<(&str, Span)> = Vec::new();
        let mut used = name;
        while let Some((user, span)) = users.get(used) {
            links.push((user, span.clone()));
            used = user;
            if used == name {
                links.reverse();
                return links;
            }
        }
        Vec::new()
    }
}

impl<'i> Parameter<'i> {
    fn read(
        name: &TomlSpanned<DeString<'i>>,
        value: TomlSpanned<DeValue<'i>>,
        problems: &mut Problems,
    ) -> Parameter<'i> {
        let is_swept = value.get_ref().is_array();
        let is_valid = is_valid_name(name, problems);
        let mut values = match value.get_ref() {
            DeValue::Array(items) if items.is_empty() => {
                let message = format!("the parameter `{}` is an empty list", name.get_ref());
                let label = "must have at least one value to sweep";
                problems.push(Problem::new(message, value.span(), label));
                Vec::new()
            }
            DeValue::Array(items) => items.iter().cloned().collect(),
            _ => vec![value],
        };
        values.retain(|value| is_valid && is_valid_value(name.get_ref(), value, problems));
        remove_repeats(name.get_ref(), &mut values, problems);
        let uses = values
            .iter()
            .flat_map(|value| references(value).into_iter().map(|name| (name, value.span())));
        Parameter { span: name.span(), uses: uses.collect(), values, is_swept }
    }

    /// Removes all values, because a problem with them has been reported.
    fn clear(&mut self) {
        self.values.clear();
        self.uses.clear();
    }
}

/// Returns the names in an expression; none if the value is a number or a quantity with a unit.
fn references(value: &TomlSpanned<DeValue>) -> BTreeSet<String> {
    let text = value.get_ref().as_str().filter(|text| !has_unit(text));
    let expression = text.and_then(|text| Expression::parse_without_pi(text).ok());
    let names = expression.iter().flat_map(Expression::columns);
    names.map(str::to_owned).collect()
}

fn is_valid_name(name: &TomlSpanned<DeString>, problems: &mut Problems) -> bool {
    let text = name.get_ref().as_ref();
    let is_expression =
        Expression::parse_without_pi(text) == Ok(Expression::Column(text.to_owned()));
    let label = if Function::ALL.iter().any(|function| function.word() == text) {
        "this is the name of a function"
    } else if is_expression {
        return true;
    } else {
        "must be a letter or `_`, then letters, digits and `_`"
    };
    let message = format!("{text:?} is not a valid name of a parameter");
    problems.push(Problem::new(message, name.span(), label));
    false
}

fn is_valid_value(name: &str, value: &TomlSpanned<DeValue>, problems: &mut Problems) -> bool {
    let path = format!("parameters.{name}");
    let problem = match value.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => return true,
        DeValue::String(text) if has_unit(text) => return true,
        DeValue::String(text) => match Expression::parse_without_pi(text) {
            Ok(expression) if !expression.has_slope() => return true,
            read => syntax_problem(&path, value, read.err().as_ref()),
        },
        other => {
            let message =
                format!("the parameter `{name}` must be a number, an expression or a list of them");
            Problem::new(message, value.span(), found(other))
        }
    };
    problems.push(problem);
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(text: &str) -> Vec<String> {
        let mut problems = Problems::default();
        let parameters =
            Parameters::read(DeTable::parse(text).unwrap().into_inner(), &mut problems);
        assert_eq!(parameters.names().count(), text.lines().count());
        let errors = problems.into_errors("study.toml", text);
        errors.problems().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn parameters_are_numbers_sweeps_and_expressions_in_other_parameters() {
        let text = "hurst = [0.3, 0.8]\nk = 32\nnodes = \"8 * k\"\nseeds = [1, \"k / 2\"]";
        assert_eq!(problems(text), [""; 0]);
        let mut none = Problems::default();
        let parameters = Parameters::read(DeTable::parse(text).unwrap().into_inner(), &mut none);
        let mut swept = BTreeSet::new();
        parameters.use_in("seeds", &mut swept);
        assert_eq!(Vec::from_iter(swept), ["seeds"]);
        // The first parameter is inherited.
        assert_eq!(parameters.report_unused(1, &mut none), ["hurst"]);
        parameters.report_unused(0, &mut none);
        let unused = none.into_errors("", text);
        let unused: Vec<_> = unused.problems().iter().map(Problem::message).collect();
        let expected =
            ["no stage uses the parameter `hurst`", "no stage uses the parameter `nodes`"];
        assert_eq!(unused, expected);
    }

    #[test]
    fn mistakes_in_parameters_are_reported_where_they_are() {
        for (text, expected) in [
            ("a-b = 1", "\"a-b\" is not a valid name of a parameter"),
            ("ln = 1", "this is the name of a function"),
            ("a = []", "must have at least one value"),
            ("a = [1, 1.0]", "`a` is swept over the same value twice"),
            ("a = true", "must be a number, an expression or a list of them"),
            ("a = \"2 *\"", "the expression ends where an operand is needed"),
            ("a = \"slope(b)\"\nb = 1", "`slope` needs the loads of a surface"),
            ("first = 1\nb = \"frist\"", "did you mean `first`?"),
            ("a = \"a + 1\"", "the parameter `a` depends on itself"),
            (
                "a = \"b\"\nb = \"2 * a\"",
                "depend on each other in a cycle: a ← b ← a (`a` uses `b`)",
            ),
            ("a = \"b\"\nb = [1, \"c\"]\nc = \"2 * a\"", "in a cycle: a ← b ← c ← a"),
            ("a = \"2 * b\"\nb = \"b\"", "the parameter `b` depends on itself"),
        ] {
            let problems = problems(text);
            assert_eq!(problems.len(), 1, "{text}: {problems:?}");
            assert!(problems[0].contains(expected), "{text}: {problems:?}");
        }
    }
}
