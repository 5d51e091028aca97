//! Reads one table of a manifest: validates each value and combines swept lists into a parameter
//! grid.
//!
//! The grid is computed from TOML values, and only its points are deserialised. Swept values,
//! values of cases and other values are therefore treated alike, each with its position in the
//! text.

use std::collections::{BTreeMap, BTreeSet};
use std::marker::PhantomData;

use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable, DeValue, Error, ValueDeserializer};

use super::derived::{Expressions, Point, replaced};
use super::expected_keys::ExpectedKeys;
use super::on_axes::Pairs;
use super::parameters::Parameters;
use super::quantity::{self, Declared, Units};
use super::validation::validate;
use super::values::remove_repeats;
use super::{KeyTable, Layout};
use crate::diagnostics::{Problem, Problems, Span, listed};
use crate::keys::values::found;

/// Maximum number of points of a parameter grid. A larger grid is probably a mistake, and checking
/// it would take long.
const MAX_POINTS: usize = 10_000;
/// Maximum number of values in all points of a parameter grid. A long list that each of many points
/// contains would fill the memory.
const MAX_VALUES: usize = 1_000_000;

/// A table of the manifest, expanded to the points of a parameter grid.
#[derive(Debug)]
pub struct Section<T> {
    /// Position of the name of the table.
    pub span: Span,
    /// The points in the order of the cases, then of the swept keys. The last key varies fastest.
    pub points: Vec<GridPoint<T>>,
    /// Keys that must not be reported as missing, because a problem with their value or name has
    /// been reported.
    pub reported_keys: BTreeSet<String>,
    /// True if several lists were read as pairs that could also be swept.
    pub may_be_swept: bool,
    /// Units of the lengths and pressures of the table.
    pub units: Units,
}

/// One point of a parameter grid: one value of each key of a table.
#[derive(Debug)]
pub struct GridPoint<T> {
    /// The values of the keys at this point.
    pub table: T,
    /// Position of the case, or of the name of the table if there are no cases.
    pub span: Span,
}

impl<T> Section<T> {
    /// Creates a section without points, for a table that cannot be read.
    pub fn unreadable(span: Span) -> Self {
        Self {
            span,
            points: Vec::new(),
            reported_keys: BTreeSet::new(),
            may_be_swept: false,
            units: Units::default(),
        }
    }
}

/// Deserialises a value of the parsed manifest. Positions in the result refer to the text of the
/// manifest.
pub fn deserialize<T: DeserializeOwned>(value: TomlSpanned<DeValue<'_>>) -> Result<T, Error> {
    T::deserialize(ValueDeserializer::from(value))
}

/// Reads a table, reports problems, and returns the parameter points that the table describes. Keys
/// that are not in the [`Layout`] of `T`, except `cases`, must have been removed from the table.
pub fn read<T: KeyTable>(
    table: DeTable<'_>,
    span: Span,
    expected: &ExpectedKeys<'_>,
    problems: &mut Problems,
) -> Section<T> {
    let layout = T::layout();
    let expressions = expected.scope.map(|scope| Expressions { layout, scope });
    let table = match expressions {
        Some(expressions) => expressions.with_quantities(table),
        None => table,
    };
    let of_expression = |path: &str,
                         value: &TomlSpanned<DeValue<'_>>,
                         schema: &Value,
                         declared: Option<Declared>| {
        match expressions {
            Some(expressions) => expressions.unit(&table, path, value, schema, declared),
            None => Ok(None),
        }
    };
    let mut read = Units::read(&table, layout, &of_expression, problems);
    let units = std::mem::take(&mut read.units);
    let table = quantity::replace(table, &read);
    let mut reader = Reader::<T> {
        layout,
        pairs: Pairs::among(&table, layout),
        expressions,
        units: &units,
        expected,
        problems,
        grid: Grid::default(),
        reported_keys: read.reported_keys.clone(),
        table: PhantomData,
    };
    let mut cases = None;
    for (key, value) in table {
        if key.get_ref() == "cases" && !T::layout().swept.is_empty() {
            cases = Some(value);
        } else {
            reader.entry(key, value);
        }
    }
    if let Some(cases) = cases {
        reader.cases(cases);
    }
    reader.sweep_parameters();
    let points = reader.spread(&span).unwrap_or_else(|problem| {
        reader.problems.push(problem);
        Vec::new()
    });
    let (reported_keys, pairs) = (reader.reported_keys, reader.pairs);
    Section { span, points, reported_keys, may_be_swept: pairs.may_be_swept, units }
}

struct Reader<'a, 'i, T> {
    layout: &'static Layout,
    pairs: Pairs,
    expressions: Option<Expressions<'a>>,
    units: &'a Units,
    expected: &'a ExpectedKeys<'a>,
    problems: &'a mut Problems,
    grid: Grid<'i>,
    reported_keys: BTreeSet<String>,
    table: PhantomData<T>,
}

impl<'i, T: KeyTable> Reader<'_, 'i, T> {
    fn entry(&mut self, key: TomlSpanned<DeString<'i>>, value: TomlSpanned<DeValue<'i>>) {
        let name = key.get_ref().as_ref();
        if !self.layout.has(name) {
            self.report_unknown(name, key.span());
            return;
        }
        let axis = self.layout.swept.iter().position(|swept| *swept == name);
        match (axis, value.get_ref()) {
            (Some(axis), DeValue::Array(_)) if !self.pairs.has(name) => {
                self.axis(axis, key, value);
            }
            _ if self.layout.lists.contains(&name) => self.share(key, as_list(value)),
            _ => self.share(key, value),
        }
    }

    /// Adds a value to those that all points share.
    fn share(&mut self, key: TomlSpanned<DeString<'i>>, value: TomlSpanned<DeValue<'i>>) {
        if self.is_valid(&key, &value) {
            self.grid.shared.insert(key, value);
        }
    }

    fn axis(
        &mut self,
        axis: usize,
        key: TomlSpanned<DeString<'i>>,
        value: TomlSpanned<DeValue<'i>>,
    ) {
        let span = value.span();
        let DeValue::Array(values) = value.into_inner() else {
            return;
        };
        if values.is_empty() {
            let message = format!("`{}` is an empty list", key.get_ref());
            let label = "must have at least one value to sweep";
            self.problems.push(Problem::new(message, span, label));
            self.reported_keys.insert(key.get_ref().to_string());
            return;
        }
        let mut valid: Vec<_> =
            values.into_iter().filter(|value| self.is_valid(&key, value)).collect();
        remove_repeats(key.get_ref(), &mut valid, self.problems);
        if !valid.is_empty() {
            self.grid.axes.insert(axis, Axis { key, values: valid });
        }
    }

    fn cases(&mut self, value: TomlSpanned<DeValue<'i>>) {
        let span = value.span();
        let help = "each table is one parameter point: `cases = [{ … }, { … }]`";
        match value.into_inner() {
            DeValue::Array(cases) if !cases.is_empty() => {
                let read: Vec<_> = cases.into_iter().filter_map(|case| self.case(case)).collect();
                self.grid.cases = Some(read);
            }
            other => {
                let label = match &other {
                    DeValue::Array(_) => "this is an empty list".to_owned(),
                    other => found(other),
                };
                let problem = Problem::new("`cases` must be a list of tables", span, label);
                self.problems.push(problem.help(help));
            }
        }
    }

    fn case(&mut self, case: TomlSpanned<DeValue<'i>>) -> Option<(Span, DeTable<'i>)> {
        let span = case.span();
        match case.into_inner() {
            DeValue::Table(table) => {
                let mut entries = DeTable::new();
                for (key, value) in table {
                    if self.is_case_key(&key) && self.is_valid(&key, &value) {
                        entries.insert(key, value);
                    }
                }
                Some((span, entries))
            }
            other => {
                let label = found(&other);
                self.problems.push(Problem::new("a case must be a table", span, label));
                None
            }
        }
    }

    fn is_case_key(&mut self, key: &TomlSpanned<DeString<'i>>) -> bool {
        let name = key.get_ref().as_ref();
        let position = self.layout.swept.iter().position(|swept| *swept == name);
        if let Some(other) = self.grid.common_key(position, name) {
            let message = format!("`{name}` is given both in a case and for all cases");
            let problem = Problem::new(message, key.span(), "given in this case");
            self.problems.push(problem.and(other, "given for all cases"));
            return false;
        }
        if position.is_some() {
            return true;
        }
        let help = format!("cases may name {}", listed(self.layout.swept.iter().copied(), "and"));
        if self.layout.has(name) {
            let message = format!("`{name}` cannot differ from case to case");
            let problem = Problem::new(message, key.span(), "write it once for the stage");
            self.problems.push(problem.help(help));
        } else {
            self.report_unknown(name, key.span());
        }
        false
    }

    fn report_unknown(&mut self, name: &str, span: Span) {
        let (problem, meant) = self.expected.unknown_key(self.layout, name, span);
        self.problems.push(problem);
        self.reported_keys.extend(meant);
    }

    /// Adds an axis for each swept parameter that the table uses, at the place of the first swept
    /// key that uses it.
    fn sweep_parameters(&mut self) {
        let Some(expressions) = self.expressions else {
            return;
        };
        let Grid { shared, axes, cases, .. } = &self.grid;
        let in_all_cases = |name: &str| {
            let all = cases.as_deref().unwrap_or_default();
            !all.is_empty() && all.iter().all(|(_, case)| case.contains_key(name))
        };
        let is_given = |name: &str| {
            shared.contains_key(name)
                || axes.values().any(|axis| axis.key.get_ref() == name)
                || in_all_cases(name)
        };
        let axis_values =
            axes.values().flat_map(|axis| axis.values.iter().map(|value| (&axis.key, value)));
        let case_values = cases.iter().flatten().flat_map(|(_, case)| case);
        let mut first_keys = BTreeMap::<String, (usize, Span)>::new();
        for (key, value) in shared.iter().chain(axis_values).chain(case_values) {
            let key = key.get_ref().as_ref();
            let swept = self.layout.swept.iter().position(|swept| *swept == key);
            for name in expressions.swept_in(key, value, is_given) {
                let user = (swept.unwrap_or(usize::MAX), value.span());
                let first = first_keys.entry(name).or_insert(user.clone());
                if user.0 < first.0 {
                    *first = user;
                }
            }
        }
        for (name, (axis, span)) in first_keys {
            expressions.scope.swept.borrow_mut().insert(name.clone());
            if axis == usize::MAX {
                let swept = self.layout.swept.iter().copied();
                let message =
                    format!("the parameter `{name}` is a list, and this key is not swept");
                let help = format!("the swept keys are {}", listed(swept, "and"));
                self.problems.push(Problem::new(message, span, "must be one number").help(help));
            } else {
                self.grid.parameters.push((axis, name));
            }
        }
        self.grid.parameters.sort();
    }

    /// Deserialises every parameter point, or returns a problem if there are too many points.
    fn spread(&mut self, span: &Span) -> Result<Vec<GridPoint<T>>, Problem> {
        let mut grid = std::mem::take(&mut self.grid);
        let cases = grid.cases.take().unwrap_or_else(|| vec![(span.clone(), DeTable::new())]);
        let axes = grid.axes(self.expressions.and_then(|own| own.scope.parameters));
        let lengths = axes.iter().map(|axis| axis.values.len());
        let combinations = lengths.fold(1, usize::saturating_mul);
        let points = combinations.saturating_mul(cases.len());
        let shared = grid.shared.values().map(|value| size(value.get_ref()));
        let values = points.saturating_mul(shared.sum::<usize>() + axes.len());
        if points > 1 && (points > MAX_POINTS || values > MAX_VALUES) {
            return Err(too_many(points, values, span));
        }
        let mut spread = Vec::with_capacity(points);
        for (span, case) in &cases {
            for combination in 0..combinations {
                let mut table = grid.shared.clone();
                let mut parameters = BTreeMap::new();
                // The indices of the values are the digits of the combination in the mixed radix of
                // the numbers of values; the index of the last axis is the lowest digit.
                let mut rest = combination;
                for Values { name, key, values } in axes.iter().rev() {
                    let value = &values[rest % values.len()];
                    rest /= values.len();
                    if let Some(key) = key {
                        table.insert((*key).clone(), value.clone());
                    } else {
                        parameters.insert(*name, value);
                    }
                }
                table.extend(case.clone());
                let span = span.clone();
                match self.point(table, &parameters, &span) {
                    Ok(table) => spread.push(GridPoint { table, span }),
                    // Values that satisfy the schema can be deserialised; this is a safeguard.
                    Err(error) => return Err(Problem::new(error.message(), span, "here")),
                }
            }
        }
        Ok(spread)
    }

    /// Evaluates the expressions of a point and deserialises it. A key without a valid result is
    /// left out.
    fn point(
        &mut self,
        table: DeTable<'_>,
        parameters: &BTreeMap<&str, &TomlSpanned<DeValue<'_>>>,
        span: &Span,
    ) -> Result<T, Error> {
        let deserialized =
            |table| deserialize(TomlSpanned::new(span.clone(), DeValue::Table(table)));
        let Some(expressions) = self.expressions else {
            return deserialized(table);
        };
        let reported = &self.reported_keys;
        let (numbers, problems) =
            Point::evaluate(expressions, self.units, &table, parameters, reported);
        if numbers.is_empty() {
            return deserialized(table);
        }
        // One problem of each key is enough, because other points often have similar ones.
        let is_new = |(key, _): &(String, Problem)| !self.reported_keys.contains(key);
        let new = problems.into_iter().filter(is_new);
        new.for_each(|(_, problem)| self.problems.push(problem));
        let mut plain = DeTable::new();
        for (key, value) in table {
            let name = key.get_ref().to_string();
            let value = replaced(value, &numbers);
            let validated = |value| validate(self.layout, &name, value, None);
            let mistakes: Vec<_> = value.iter().flat_map(validated).collect();
            match value {
                Some(value) if mistakes.is_empty() => {
                    plain.insert(key, value);
                }
                _ if !self.reported_keys.insert(name) => {}
                _ => mistakes.into_iter().for_each(|mistake| self.problems.push(mistake)),
            }
        }
        deserialized(plain)
    }

    /// Validates a value and reports all mistakes in it. Returns whether the value is valid.
    fn is_valid(
        &mut self,
        key: &TomlSpanned<DeString<'i>>,
        value: &TomlSpanned<DeValue<'i>>,
    ) -> bool {
        let name = key.get_ref().as_ref();
        let mistakes = validate(self.layout, name, value, self.expressions);
        let is_valid = mistakes.is_empty();
        if !is_valid {
            self.reported_keys.insert(name.to_owned());
        }
        mistakes.into_iter().for_each(|mistake| self.problems.push(mistake));
        is_valid
    }
}

/// Returns a list unchanged, and any other value as a list of one value.
pub fn as_list(value: TomlSpanned<DeValue<'_>>) -> TomlSpanned<DeValue<'_>> {
    match value.get_ref() {
        DeValue::Array(_) => value,
        _ => {
            let span = value.span();
            TomlSpanned::new(span, DeValue::Array([value].into_iter().collect()))
        }
    }
}

/// The values of a table: common to all points, swept, or in cases.
#[derive(Default)]
struct Grid<'i> {
    shared: DeTable<'i>,
    /// Swept lists by the index of their keys in [`Layout::swept`].
    axes: BTreeMap<usize, Axis<'i>>,
    /// Swept parameters, each with the index of the first swept key that uses it.
    parameters: Vec<(usize, String)>,
    cases: Option<Vec<(Span, DeTable<'i>)>>,
}

struct Axis<'i> {
    key: TomlSpanned<DeString<'i>>,
    values: Vec<TomlSpanned<DeValue<'i>>>,
}

/// The values of an axis of the grid.
struct Values<'g> {
    /// Name of the key or parameter.
    name: &'g str,
    /// Key, or `None` for a parameter.
    key: Option<&'g TomlSpanned<DeString<'g>>>,
    values: &'g [TomlSpanned<DeValue<'g>>],
}

impl<'i> Grid<'i> {
    /// Returns the position of a key that is given for all cases: a swept key, with its index
    /// `axis`, or any other key. Returns `None` if the table does not contain the key outside its
    /// cases.
    fn common_key(&self, axis: Option<usize>, name: &str) -> Option<Span> {
        let swept = axis.and_then(|axis| self.axes.get(&axis)).map(|axis| &axis.key);
        let shared = || self.shared.get_key_value(name).map(|(key, _)| key);
        swept.or_else(shared).map(TomlSpanned::span)
    }

    /// Returns the axes in the order of their keys. The axis of a parameter precedes that of the
    /// key that uses it.
    fn axes<'g>(&'g self, parameters: Option<&'g Parameters<'g>>) -> Vec<Values<'g>> {
        let of_parameters = self.parameters.iter().filter_map(|(index, name)| {
            let values = parameters?.get(name)?.values.as_slice();
            Some((*index, Values { name, key: None, values }))
        });
        let of_keys = self.axes.iter().map(|(&index, Axis { key, values })| {
            (index, Values { name: key.get_ref(), key: Some(key), values })
        });
        let mut axes: Vec<_> = of_parameters.chain(of_keys).collect();
        // The sort is stable.
        axes.sort_by_key(|(index, _)| *index);
        axes.into_iter().map(|(_, values)| values).collect()
    }
}

fn too_many(points: usize, values: usize, span: &Span) -> Problem {
    let message = if points > MAX_POINTS {
        format!("the swept keys give {points} parameter points; the maximum is {MAX_POINTS}")
    } else {
        format!("the parameter points hold {values} values; the maximum is {MAX_VALUES}")
    };
    Problem::new(message, span.clone(), "swept lists are combined with each other")
        .help("to list only the combinations that you need, write `cases = [{ … }, { … }]`")
}

/// Returns the number of scalars in a value.
fn size(value: &DeValue<'_>) -> usize {
    match value {
        DeValue::Array(list) => list.iter().map(|value| size(value.get_ref())).sum(),
        DeValue::Table(table) => table.values().map(|value| size(value.get_ref())).sum(),
        _ => 1,
    }
}
