//! The points of a grid: each a table without lists.
//!
//! The grid is spread before anything is read into types: a value that is swept, a value of a
//! case and a plain value are then one and the same thing, a value with a place.

use std::collections::{BTreeMap, BTreeSet};

use serde::de::DeserializeOwned;
use serde_spanned::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::advice;
use crate::diagnostics::{Problem, Span};

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

/// What all points share, what is swept, and what cases say.
#[derive(Default)]
pub struct Grid<'i> {
    pub shared: DeTable<'i>,
    /// By the key's position among the swept keys.
    pub axes: BTreeMap<usize, Axis<'i>>,
    pub cases: Option<Vec<(Span, DeTable<'i>)>>,
}

pub struct Axis<'i> {
    pub key: Spanned<DeString<'i>>,
    pub values: Vec<Spanned<DeValue<'i>>>,
}

impl<'i> Grid<'i> {
    /// The value that all cases share for a key, or its list, if there is any.
    pub fn common_key(&self, axis: Option<usize>, name: &str) -> Option<Span> {
        let axis = axis.and_then(|axis| self.axes.get(&axis)).map(|axis| &axis.key);
        let shared = || self.shared.get_key_value(name).map(|(key, _)| key);
        axis.or_else(shared).map(Spanned::span)
    }

    /// Every point of the grid.
    ///
    /// # Errors
    /// When there are too many.
    pub fn spread<T: DeserializeOwned>(self, place: &Span) -> Result<Vec<Point<T>>, Problem> {
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
    let message = match points > MOST_POINTS {
        true => format!("the grid has {points} points, {MOST_POINTS} is the most"),
        false => format!("the grid has {values} values, {MOST_VALUES} is the most"),
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
