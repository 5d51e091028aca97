//! Reads one table: every key is judged by itself, and what is swept goes to the grid.
//!
//! The grid is spread before anything is read into types: a value that is swept, a value of a case and
//! a plain value are then one and the same thing, a value with a place.

use std::collections::{BTreeMap, BTreeSet};
use std::marker::PhantomData;

use serde::de::DeserializeOwned;
use serde_spanned::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::diagnostics::{Problem, Problems, Span, listed};
use crate::written::advice::Wanted;
use crate::written::on_axes::Pairs;
use crate::written::{Layout, Table, advice};

type Entry<'i> = (Spanned<DeString<'i>>, Spanned<DeValue<'i>>);

/// Points of one grid. More is a slip, and would take long to find out.
const MOST_POINTS: usize = 10_000;
/// Values of all points of one grid together: a long list in each of many points fills memory.
const MOST_VALUES: usize = 1_000_000;

/// A table as written, spread into the points of its grid.
#[derive(Debug)]
pub struct Section<T> {
    /// Where the table begins.
    pub place: Span,
    /// The points, in the order of the cases, then of the swept keys, the last fastest.
    pub points: Vec<Point<T>>,
    /// Keys that are missing because what stands for them cannot be read, which is reported.
    pub excused: BTreeSet<String>,
    /// Whether lists that are read as pairs might have been meant to be swept.
    pub may_be_swept: bool,
}

/// One point of a grid.
#[derive(Debug)]
pub struct Point<T> {
    /// What is said there.
    pub table: T,
    /// Where: the case, or else the table.
    pub place: Span,
}

impl<T> Section<T> {
    /// A table that cannot be read, which is reported.
    pub fn unreadable(place: Span) -> Self {
        Self { place, points: Vec::new(), excused: BTreeSet::new(), may_be_swept: false }
    }
}

/// Reads a table whose common keys have been taken out.
pub fn read<T: Table>(
    table: DeTable<'_>,
    place: Span,
    wanted: &Wanted,
    problems: &mut Problems,
) -> Section<T> {
    let mut reader = Reader::<T> {
        layout: T::layout(),
        pairs: Pairs::among(&table, T::layout()),
        wanted,
        problems,
        grid: Grid::default(),
        excused: BTreeSet::new(),
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
    let (grid, excused, pairs) = (reader.grid, reader.excused, reader.pairs);
    let points = grid.spread(&place).unwrap_or_else(|problem| {
        problems.push(problem);
        Vec::new()
    });
    Section { place, points, excused, may_be_swept: pairs.may_be_swept }
}

struct Reader<'a, 'i, T> {
    layout: &'static Layout,
    pairs: Pairs,
    wanted: &'a Wanted,
    problems: &'a mut Problems,
    grid: Grid<'i>,
    excused: BTreeSet<String>,
    table: PhantomData<T>,
}

impl<'i, T: Table> Reader<'_, 'i, T> {
    fn entry(&mut self, key: Spanned<DeString<'i>>, value: Spanned<DeValue<'i>>) {
        let name = key.get_ref().as_ref();
        if !self.layout.has(name) {
            let (problem, meant) = self.wanted.unknown_key(self.layout, name, key.span());
            self.problems.push(problem);
            self.excused.extend(meant);
            return;
        }
        let axis = self.layout.swept.iter().position(|swept| *swept == name);
        match (axis, value.get_ref()) {
            (Some(axis), DeValue::Array(_)) if !self.pairs.has(name) => {
                self.axis(axis, key, value);
            }
            _ if self.layout.lists.contains(&name) => self.list(key, as_list(value)),
            _ => self.share(key, value),
        }
    }

    fn share(&mut self, key: Spanned<DeString<'i>>, value: Spanned<DeValue<'i>>) {
        if self.is_readable(&key, &value) {
            self.grid.shared.insert(key, value);
        }
    }

    /// A list whose items are tried one by one.
    fn list(&mut self, key: Spanned<DeString<'i>>, list: Spanned<DeValue<'i>>) {
        let items: Vec<_> = list.get_ref().as_array().into_iter().flatten().collect();
        let is_readable = |item: &&Spanned<DeValue<'i>>| {
            let alone = DeValue::Array([(*item).clone()].into_iter().collect());
            self.is_readable(&key, &Spanned::new(item.span(), alone))
        };
        let readable: Vec<_> = items.iter().copied().filter(is_readable).cloned().collect();
        if items.is_empty() || !readable.is_empty() {
            let list = Spanned::new(list.span(), DeValue::Array(readable.into_iter().collect()));
            self.grid.shared.insert(key, list);
        }
    }

    fn axis(&mut self, axis: usize, key: Spanned<DeString<'i>>, value: Spanned<DeValue<'i>>) {
        let span = value.span();
        let DeValue::Array(values) = value.into_inner() else {
            return;
        };
        if values.is_empty() {
            let message = format!("`{}` is an empty list", key.get_ref());
            let label = "a list is swept, and here is nothing to sweep";
            self.problems.push(Problem::new(message, span, label));
            self.excused.insert(key.get_ref().to_string());
            return;
        }
        let mut values: Vec<_> = values.into_iter().collect();
        values.retain(|value| self.is_readable(&key, value));
        self.remove_repeats(key.get_ref(), &mut values);
        if !values.is_empty() {
            self.grid.axes.insert(axis, Axis { key, values });
        }
    }

    /// The same value twice in a swept list would count the same surfaces twice.
    fn remove_repeats(&mut self, key: &str, values: &mut Vec<Spanned<DeValue<'i>>>) {
        let mut seen = BTreeMap::new();
        values.retain(|value| {
            let Some(before) = seen.insert(plain(value.get_ref()), value.span()) else {
                return true;
            };
            let message = format!("`{key}` is swept over the same value twice");
            let problem = Problem::new(message, value.span(), "here again");
            self.problems.push(problem.and(before, "first here"));
            false
        });
    }

    fn cases(&mut self, value: Spanned<DeValue<'i>>) {
        let span = value.span();
        let help = "a list of tables, each a point of the grid: `cases = [{ … }, { … }]`";
        match value.into_inner() {
            DeValue::Array(cases) if !cases.is_empty() => {
                let cases: Vec<_> = cases.into_iter().filter_map(|case| self.case(case)).collect();
                self.grid.cases = Some(cases);
            }
            other => {
                let label = match &other {
                    DeValue::Array(_) => "this is an empty list".to_owned(),
                    other => advice::found(other),
                };
                let problem = Problem::new("`cases` must be a list of tables", span, label);
                self.problems.push(problem.help(help));
            }
        }
    }

    fn case(&mut self, case: Spanned<DeValue<'i>>) -> Option<(Span, DeTable<'i>)> {
        let span = case.span();
        match case.into_inner() {
            DeValue::Table(table) => {
                let mut entries = DeTable::new();
                for (key, value) in table {
                    if self.is_case_key(&key) && self.is_readable(&key, &value) {
                        entries.insert(key, value);
                    }
                }
                Some((span, entries))
            }
            other => {
                let label = advice::found(&other);
                self.problems.push(Problem::new("a case must be a table", span, label));
                None
            }
        }
    }

    fn is_case_key(&mut self, key: &Spanned<DeString<'i>>) -> bool {
        let name = key.get_ref().as_ref();
        let position = self.layout.swept.iter().position(|swept| *swept == name);
        if let Some(other) = self.grid.common_key(position, name) {
            let message = format!("`{name}` is given both by a case and for all cases");
            let problem = Problem::new(message, key.span(), "here for one case");
            self.problems.push(problem.and(other, "here for all of them"));
            return false;
        }
        if position.is_some() {
            return true;
        }
        let help = format!("cases may name {}", listed(self.layout.swept.iter().copied(), "and"));
        if self.layout.has(name) {
            let message = format!("`{name}` cannot differ from case to case");
            let problem = Problem::new(message, key.span(), "say it once for the stage");
            self.problems.push(problem.help(help));
        } else {
            let (problem, meant) = self.wanted.unknown_key(self.layout, name, key.span());
            self.problems.push(problem);
            self.excused.extend(meant);
        }
        false
    }

    /// Tries a value by itself, so that one that is wrong hides no other.
    fn is_readable(&mut self, key: &Spanned<DeString<'i>>, value: &Spanned<DeValue<'i>>) -> bool {
        let name = key.get_ref().as_ref();
        if value.get_ref().is_datetime() {
            let message = format!("`{name}` cannot be a date");
            let problem = Problem::new(message, value.span(), advice::found(value.get_ref()));
            self.problems.push(problem);
            self.excused.insert(name.to_owned());
            return false;
        }
        let alone = DeTable::from_iter([(key.clone(), value.clone())]);
        let alone = Spanned::new(value.span(), DeValue::Table(alone));
        let Err(error) = advice::deserialize::<T>(alone) else {
            return true;
        };
        let is_list = value.get_ref().is_array() && error.span() == Some(value.span());
        let is_sweep = is_list && !self.layout.takes_pairs(name);
        let help = if is_sweep && !self.layout.swept.is_empty() {
            let swept = listed(self.layout.swept.iter().copied(), "and");
            Some(format!("lists are swept for {swept} only"))
        } else {
            self.layout.doc(name)
        };
        let problem = advice::unusable(name, value, &error, help);
        self.problems.push(problem);
        self.excused.insert(name.to_owned());
        false
    }
}

/// A list, or a single value as a list of one.
pub fn as_list(value: Spanned<DeValue<'_>>) -> Spanned<DeValue<'_>> {
    match value.get_ref() {
        DeValue::Array(_) => value,
        _ => {
            let span = value.span();
            Spanned::new(span, DeValue::Array([value].into_iter().collect()))
        }
    }
}

/// A value in one notation: `1`, `1.0` and `1e0` are the same number.
fn plain(value: &DeValue<'_>) -> String {
    let exact = |number: i128| number.unsigned_abs() <= 1 << f64::MANTISSA_DIGITS;
    match value {
        DeValue::Integer(integer) => {
            match i128::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(number) if exact(number) => format!("{:?}", number as f64),
                _ => integer.to_string(),
            }
        }
        DeValue::Float(float) => match float.as_str().parse::<f64>() {
            Ok(number) => format!("{:?}", number + 0.0),
            Err(_) => float.to_string(),
        },
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Array(list) => {
            let items: Vec<_> = list.iter().map(|item| plain(item.get_ref())).collect();
            format!("[{}]", items.join(", "))
        }
        other => format!("{other:?}"),
    }
}

/// What all points share, what is swept, and what cases say.
#[derive(Default)]
struct Grid<'i> {
    shared: DeTable<'i>,
    /// By the key's position among the swept keys.
    axes: BTreeMap<usize, Axis<'i>>,
    cases: Option<Vec<(Span, DeTable<'i>)>>,
}

struct Axis<'i> {
    key: Spanned<DeString<'i>>,
    values: Vec<Spanned<DeValue<'i>>>,
}

impl<'i> Grid<'i> {
    /// The value that all cases share for a key, or its list, if there is any.
    fn common_key(&self, axis: Option<usize>, name: &str) -> Option<Span> {
        let axis = axis.and_then(|axis| self.axes.get(&axis)).map(|axis| &axis.key);
        let shared = || self.shared.get_key_value(name).map(|(key, _)| key);
        axis.or_else(shared).map(Spanned::span)
    }

    /// Every point of the grid.
    ///
    /// # Errors
    /// When there are too many.
    fn spread<T: DeserializeOwned>(self, place: &Span) -> Result<Vec<Point<T>>, Problem> {
        let cases = self.cases.unwrap_or_else(|| vec![(place.clone(), DeTable::new())]);
        let axes: Vec<Axis> = self.axes.into_values().collect();
        let lengths = axes.iter().map(|axis| axis.values.len());
        let combinations = lengths.fold(1, usize::saturating_mul);
        let points = combinations.saturating_mul(cases.len());
        let shared = self.shared.values().map(|value| size(value.get_ref()));
        let values = points.saturating_mul(shared.sum::<usize>() + axes.len());
        if points > 1 && (points > MOST_POINTS || values > MOST_VALUES) {
            return Err(too_many(points, values, place));
        }
        let mut spread = Vec::with_capacity(points);
        for (place, case) in &cases {
            for combination in 0..combinations {
                let mut table = self.shared.clone();
                table.extend(choose(&axes, combination));
                table.extend(case.clone());
                let value = Spanned::new(place.clone(), DeValue::Table(table));
                let place = place.clone();
                match advice::deserialize(value) {
                    Ok(table) => spread.push(Point { table, place }),
                    // Every value has been tried by itself, so that this is not to be expected.
                    Err(error) => return Err(Problem::new(error.message(), place, "here")),
                }
            }
        }
        Ok(spread)
    }
}

fn too_many(points: usize, values: usize, place: &Span) -> Problem {
    let message = if points > MOST_POINTS {
        format!("the grid has {points} points, {MOST_POINTS} is the most")
    } else {
        format!("the grid has {values} values, {MOST_VALUES} is the most")
    };
    Problem::new(message, place.clone(), "the lists of this stage multiply")
        .help("name the combinations that you want: `cases = [{ … }, { … }]`")
}

/// The values of one combination: a number in the mixed radix of the axes' lengths.
fn choose<'i>(axes: &[Axis<'i>], mut combination: usize) -> Vec<Entry<'i>> {
    let choice = axes.iter().rev().map(|axis| {
        let index = combination % axis.values.len();
        combination /= axis.values.len();
        (axis.key.clone(), axis.values[index].clone())
    });
    choice.collect()
}

/// Number of plain values in a value.
fn size(value: &DeValue<'_>) -> usize {
    match value {
        DeValue::Array(list) => list.iter().map(|value| size(value.get_ref())).sum(),
        DeValue::Table(table) => table.values().map(|value| size(value.get_ref())).sum(),
        _ => 1,
    }
}
