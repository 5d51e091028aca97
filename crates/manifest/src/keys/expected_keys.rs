//! Reports keys that a table does not have.

use super::derived::Scope;
use super::{Layout, synonyms};
use crate::diagnostics::{Problem, Span, did_you_mean, listed};

/// Function that returns the name of another table that has a key, for messages.
pub type FindOwner = dyn Fn(&str) -> Option<String>;

/// The keys that a table can have, for messages about unknown keys, and the names that its
/// expressions can use.
pub struct ExpectedKeys<'a> {
    /// Name of the table in messages.
    pub table: String,
    /// Keys that the table can have in addition to those of its [`Layout`], such as `kind` and
    /// `from`.
    pub common: Vec<&'static str>,
    /// Function that finds another table that has a key, for messages about a key unknown to this
    /// table.
    pub owner: Box<FindOwner>,
    /// The names that expressions can use, or `None` if numbers cannot be expressions.
    pub scope: Option<&'a Scope<'a>>,
}

impl ExpectedKeys<'_> {
    /// Creates the expected keys of a table that has only the keys of its [`Layout`].
    pub fn of_table(table: &str) -> Self {
        Self { table: table.to_owned(), common: Vec::new(), owner: Box::new(|_| None), scope: None }
    }

    /// Returns the problem of an unknown key, and the key that was probably meant.
    pub fn unknown_key(
        &self,
        layout: &'static Layout,
        key: &str,
        span: Span,
    ) -> (Problem, Option<String>) {
        let message = format!("{} has no key `{key}`", self.table);
        if let Some(owner) = (self.owner)(key) {
            let label = format!("belongs to {owner}");
            return (Problem::new(message, span, label), None);
        }
        let known: Vec<&str> = layout.keys().chain(self.common.iter().copied()).collect();
        let (problem, meant) = unknown_key(&message, key, span, self.scope.is_some(), &known);
        let lacks_advice = meant.is_none() && problem.advice().is_none();
        let problem = if lacks_advice { problem.help(its_keys(&known)) } else { problem };
        (problem, meant.map(str::to_owned))
    }
}

/// Returns the problem of a key that is none of the `known` keys of a table, and the key that was
/// probably meant. Tables that do not describe physics, such as `[cluster]`, have no synonyms.
pub(super) fn unknown_key<'k>(
    message: &str,
    key: &str,
    span: Span,
    has_synonyms: bool,
    known: &[&'k str],
) -> (Problem, Option<&'k str>) {
    let is_known = |one: &str| known.contains(&one);
    if has_synonyms && let Some(answer) = synonyms::answer(message, key, span.clone(), is_known) {
        return answer;
    }
    let meant = did_you_mean(key, known.iter().copied());
    let label = meant.map_or("unknown key".to_owned(), |meant| format!("did you mean `{meant}`?"));
    (Problem::new(message, span, label), meant)
}

pub(super) fn its_keys(known: &[&str]) -> String {
    format!("its keys are {}", listed(known.iter().copied(), "and"))
}
