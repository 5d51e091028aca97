//! Checks of single values: is it there, is it finite, is it in range.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::ops::{Bound, RangeBounds, RangeInclusive};

use serde::Serialize;

use super::{Key, Layout, Point, Section, Table, Written};
use crate::decimal;
use crate::diagnostics::{Problem, Problems, Span};

/// Bounds of numbers.
pub type Bounds = (Bound<f64>, Bound<f64>);

/// Largest number in a manifest: its fourth power, and products of several such numbers, are
/// finite.
const LARGEST: f64 = 1e30;
/// Greater than zero.
pub const POSITIVE: Bounds = (Bound::Excluded(0.0), Bound::Included(LARGEST));
/// Lengths, slopes and pressures: positive, and so far from the ends of floating-point numbers that
/// fourth powers and products of several keep away from them too.
pub const QUANTITY: Bounds = (Bound::Included(1e-30), Bound::Included(LARGEST));
/// Zero or greater.
pub const NOT_NEGATIVE: Bounds = (Bound::Included(0.0), Bound::Included(LARGEST));
/// Between zero and one, neither included.
pub const SHARE: Bounds = (Bound::Excluded(0.0), Bound::Excluded(1.0));

/// Judges the values of one point of a grid. A value that will not do is reported, and `None`.
pub struct Checks<'a> {
    /// Where it is reported.
    pub problems: &'a mut Problems,
    place: &'a Span,
    excused: &'a BTreeSet<String>,
    layout: &'static Layout,
}

impl<'a> Checks<'a> {
    /// Checks of a point.
    pub fn of<T: Table>(
        section: &'a Section<T>,
        point: &'a Point<T>,
        problems: &'a mut Problems,
    ) -> Self {
        Self { problems, place: &point.place, excused: &section.excused, layout: T::layout() }
    }

    /// A value that must be there.
    pub fn required<'k, T>(&mut self, name: &str, key: &'k Key<T>) -> Option<&'k Written<T>> {
        if key.written().is_none() && !self.is_excused(name) {
            let label = format!("`{name}` is missing here");
            return self.refuse(name, format!("`{name}` is not given"), self.place, label);
        }
        key.written()
    }

    /// Whether a key is missing because what is written for it cannot be read, which is reported.
    pub fn is_excused(&self, name: &str) -> bool {
        self.excused.contains(name)
    }

    /// A number that must be there.
    pub fn number(&mut self, name: &str, key: &Key<f64>, bounds: Bounds) -> Option<f64> {
        let written = self.required(name, key)?;
        self.is_in(name, written, bounds)
    }

    /// A number, or what it is when left out.
    pub fn number_or(
        &mut self,
        name: &str,
        key: &Key<f64>,
        bounds: Bounds,
        default: f64,
    ) -> Option<f64> {
        match key.written() {
            Some(written) => self.is_in(name, written, bounds),
            None => Some(default),
        }
    }

    /// A whole number that must be there.
    pub fn whole<T>(&mut self, name: &str, key: &Key<i64>, range: RangeInclusive<T>) -> Option<T>
    where
        T: TryFrom<i64> + PartialOrd + Display + Copy,
    {
        let written = self.required(name, key)?;
        self.is_whole_in(name, written, &range)
    }

    /// A whole number, or what it is when left out.
    pub fn whole_or<T>(
        &mut self,
        name: &str,
        key: &Key<i64>,
        range: RangeInclusive<T>,
        default: T,
    ) -> Option<T>
    where
        T: TryFrom<i64> + PartialOrd + Display + Copy,
    {
        match key.written() {
            Some(written) => self.is_whole_in(name, written, &range),
            None => Some(default),
        }
    }

    /// A finite number within bounds, as a person would write it: equal numbers have equal keys.
    pub fn is_in(&mut self, name: &str, written: &Written<f64>, bounds: Bounds) -> Option<f64> {
        self.finite(&format!("`{name}` is"), name, written, bounds)
    }

    /// The same for an item of a list.
    pub fn holds(&mut self, name: &str, written: &Written<f64>, bounds: Bounds) -> Option<f64> {
        self.finite(&format!("`{name}` holds"), name, written, bounds)
    }

    fn finite(
        &mut self,
        what: &str,
        name: &str,
        written: &Written<f64>,
        bounds: Bounds,
    ) -> Option<f64> {
        let value = decimal::nearest(written.value);
        if value.is_finite() && bounds.contains(&value) {
            return Some(value);
        }
        let value = written.value;
        let must = format!("must be {}", described(bounds, value));
        self.refuse(name, format!("{what} {value:?}"), &written.span, must)
    }

    /// A whole number within a range.
    pub fn is_whole_in<T>(
        &mut self,
        name: &str,
        written: &Written<i64>,
        range: &RangeInclusive<T>,
    ) -> Option<T>
    where
        T: TryFrom<i64> + PartialOrd + Display + Copy,
    {
        let value = T::try_from(written.value).ok();
        if let Some(value) = value.filter(|value| range.contains(value)) {
            return Some(value);
        }
        let message = format!("`{name}` is {}", written.value);
        let must = format!("must be from {} to {}", range.start(), range.end());
        self.refuse(name, message, &written.span, must)
    }

    /// A key that has no place beside what else is said.
    pub fn forbidden<T>(&mut self, name: &str, key: &Key<T>, why: &str) -> Option<()> {
        let Some(written) = key.written() else {
            return Some(());
        };
        let message = format!("`{name}` has no meaning here");
        self.reject(Problem::new(message, written.span.clone(), why))
    }

    /// A value that must be there in the table that is written for a key at a place.
    pub fn required_in<'k, T>(
        &mut self,
        (name, place): (&str, &Span),
        part: &str,
        key: &'k Key<T>,
    ) -> Option<&'k Written<T>> {
        if key.written().is_none() {
            let label = format!("`{part}` is missing here");
            return self.refuse(name, format!("`{name}` lacks `{part}`"), place, label);
        }
        key.written()
    }

    /// Reports what is wrong with the value of a key at a place, so that there is none.
    pub fn refuse<T>(
        &mut self,
        name: &str,
        message: impl Into<String>,
        place: &Span,
        label: impl Into<String>,
    ) -> Option<T> {
        self.report(name, Problem::new(message, place.clone(), label));
        None
    }

    /// Reports a problem, so that there is no value.
    pub fn reject<T>(&mut self, problem: Problem) -> Option<T> {
        self.problems.push(problem);
        None
    }

    /// Reports a problem with a key, and says what the key means.
    pub fn report(&mut self, name: &str, problem: Problem) {
        let problem = match self.layout.doc(name) {
            Some(doc) => problem.help(doc),
            None => problem,
        };
        self.problems.push(problem);
    }
}

/// `above 0 and at most 1`, as far as it is not clear for the value.
fn described(bounds: Bounds, value: f64) -> String {
    if bounds == QUANTITY && value > 0.0 {
        return "from 1e-30 to 1e30; another unit may help".to_owned();
    }
    let bounds = if bounds == QUANTITY { POSITIVE } else { bounds };
    let lower = match bounds.0 {
        Bound::Included(lower) => Some(format!("at least {lower}")),
        Bound::Excluded(lower) => Some(format!("above {lower}")),
        Bound::Unbounded => None,
    };
    let upper = match bounds.1 {
        Bound::Included(LARGEST) if value.is_nan() || value.is_infinite() => {
            Some("finite".to_owned())
        }
        Bound::Included(LARGEST) if value <= LARGEST => None,
        Bound::Included(LARGEST) => Some(format!("at most {LARGEST:e}")),
        Bound::Included(upper) => Some(format!("at most {upper}")),
        Bound::Excluded(upper) => Some(format!("below {upper}")),
        Bound::Unbounded if value.is_finite() => None,
        Bound::Unbounded => Some("finite".to_owned()),
    };
    let parts: Vec<_> = lower.into_iter().chain(upper).collect();
    parts.join(" and ")
}

/// Reports points of a grid that come to the same: they would count the same results twice.
pub fn report_equal_points<'p, T, P: Serialize + 'p>(
    section: &Section<T>,
    params: impl IntoIterator<Item = &'p P>,
    problems: &mut Problems,
) {
    let mut seen = BTreeMap::new();
    for (point, params) in section.points.iter().zip(params) {
        let place = &point.place;
        let text = serde_json::to_string(params).expect("parameters are plain data");
        if let Some(before) = seen.insert(text, place) {
            let problem = Problem::new("two cases come to the same", place.clone(), "this case");
            problems.push(problem.and(before.clone(), "is equal to this one"));
        }
    }
}
