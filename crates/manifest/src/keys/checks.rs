//! Takes values and defaults from a table, and checks its keys against each other.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::quantity::Units;
use super::{GridPoint, Key, KeyTable, Layout, Section, Spanned};
use crate::decimal;
use crate::diagnostics::{Problem, Problems, Span};

/// Reader of the values at one parameter point. Reports problems with them.
///
/// [`reader::read`](super::reader::read) has validated each value against the declaration of its
/// key. If a method returns `None`, this function or the method has reported a problem.
pub struct Checks<'a> {
    /// Problems of the manifest, to which the methods add further ones.
    pub problems: &'a mut Problems,
    span: &'a Span,
    reported_keys: &'a BTreeSet<String>,
    layout: &'static Layout,
    /// Units of the lengths and pressures of the table.
    pub units: &'a Units,
}

impl<'a> Checks<'a> {
    /// Creates the checks of one point of a section.
    pub fn new<T: KeyTable>(
        section: &'a Section<T>,
        point: &'a GridPoint<T>,
        problems: &'a mut Problems,
    ) -> Self {
        Self {
            problems,
            span: &point.span,
            reported_keys: &section.reported_keys,
            layout: T::layout(),
            units: &section.units,
        }
    }

    /// Returns the value of a required key, or `None` after reporting that the key is missing.
    pub fn required<'k, T>(&mut self, name: &str, key: &'k Key<T>) -> Option<&'k Spanned<T>> {
        key.written().or_else(|| self.missing(name))
    }

    /// Returns the value of an optional key, or `Some(None)` if the manifest does not contain the
    /// key.
    pub fn optional<'k, T>(&self, name: &str, key: &'k Key<T>) -> Option<Option<&'k Spanned<T>>> {
        let written = key.written();
        (written.is_some() || !self.is_reported(name)).then_some(written)
    }

    /// Returns whether a problem with the key has been reported, so that the key must not be
    /// reported as missing.
    pub fn is_reported(&self, name: &str) -> bool {
        self.reported_keys.contains(name)
    }

    /// Returns the number of a key, or the declared default if the manifest does not contain the
    /// key. A key without a declared default is required.
    ///
    /// Numbers are rounded to twelve digits, so that equal numbers have equal keys.
    pub fn number(&mut self, name: &str, key: &Key<f64>) -> Option<f64> {
        self.value_or_default(name, key, |number| decimal::nearest(*number))
    }

    /// Returns the number of an optional key, rounded to twelve digits, or `Some(None)` if the
    /// manifest does not contain the key.
    pub fn optional_number(&mut self, name: &str, key: &Key<f64>) -> Option<Option<f64>> {
        let written = self.optional(name, key)?;
        Some(written.map(|number| decimal::nearest(number.value)))
    }

    /// Returns the value of a key, or the declared default if the manifest does not contain the
    /// key. A key without a declared default is required.
    pub fn value<T: DeserializeOwned + Clone>(&mut self, name: &str, key: &Key<T>) -> Option<T> {
        self.value_or_default(name, key, T::clone)
    }

    /// Returns the value of a key, or `default` if the manifest does not contain the key.
    pub fn value_or<T: Clone>(&self, name: &str, key: &Key<T>, default: T) -> Option<T> {
        let written = self.optional(name, key)?;
        Some(written.map_or(default, |written| written.value.clone()))
    }

    /// Returns the declared default of a key.
    ///
    /// # Panics
    /// If no default is declared.
    pub fn default_of<T: DeserializeOwned>(&self, name: &str) -> T {
        self.layout.default_of(name).expect("the key declares a default")
    }

    fn value_or_default<T, V: DeserializeOwned>(
        &mut self,
        name: &str,
        key: &Key<T>,
        read: impl FnOnce(&T) -> V,
    ) -> Option<V> {
        match key.written() {
            Some(written) => Some(read(&written.value)),
            None if self.is_reported(name) => None,
            None => self.layout.default_of(name).or_else(|| self.missing(name)),
        }
    }

    fn missing<T>(&mut self, name: &str) -> Option<T> {
        if self.is_reported(name) {
            return None;
        }
        let label = format!("`{name}` is missing here");
        self.refuse(name, format!("`{name}` is not given"), self.span, label)
    }

    /// Refuses a key that other keys exclude, if the manifest contains it. `why` is the label of
    /// the problem.
    pub fn forbidden<T>(&mut self, name: &str, key: &Key<T>, why: &str) -> Option<()> {
        let Some(written) = key.written() else {
            return Some(());
        };
        let message = format!("`{name}` cannot be used here");
        self.reject(Problem::new(message, written.span.clone(), why))
    }

    /// Reports a problem with the value of a key, with the description of the key as help, and
    /// returns `None`.
    pub fn refuse<T>(
        &mut self,
        name: &str,
        message: impl Into<String>,
        span: &Span,
        label: impl Into<String>,
    ) -> Option<T> {
        self.report(name, Problem::new(message, span.clone(), label));
        None
    }

    /// Returns the value of a result, or `None` after reporting its problem, given by message and
    /// label.
    pub fn accept<T>(&mut self, result: Result<T, (String, String)>, span: &Span) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err((message, label)) => self.reject(Problem::new(message, span.clone(), label)),
        }
    }

    /// Reports a problem and returns `None`.
    pub fn reject<T>(&mut self, problem: Problem) -> Option<T> {
        self.problems.push(problem);
        None
    }

    /// Reports a problem. If it has no help, the description of the key becomes its help.
    pub fn report(&mut self, name: &str, problem: Problem) {
        let doc = self.layout.doc(name).filter(|_| problem.advice().is_none());
        self.problems.push(problem.help_if(doc));
    }
}

/// Reports parameter points with equal values, because their results would count twice.
pub fn report_equal_points<'p, T, P: Serialize + 'p>(
    section: &Section<T>,
    params: impl IntoIterator<Item = &'p P>,
    problems: &mut Problems,
) {
    let mut seen = BTreeMap::new();
    for (point, params) in section.points.iter().zip(params) {
        let span = &point.span;
        let text = serde_json::to_string(params).expect("parameters are plain data");
        if let Some(before) = seen.insert(text, span) {
            let problem = Problem::new(
                "two cases are identical",
                span.clone(),
                "the same as the first case, after defaults are applied",
            );
            problems.push(problem.and(before.clone(), "first case"));
        }
    }
}
