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
        let known = || layout.keys().chain(self.common.iter().copied());
        let message = format!("{} has no key `{key}`", self.table);
        if let Some(owner) = (self.owner)(key) {
            let label = format!("belongs to {owner}");
            return (Problem::new(message, span, label), None);
        }
        // Tables without expressions, such as `[cluster]`, do not describe physics.
        if self.scope.is_some()
            && let Some((problem, instead)) =
                synonyms::answer(&message, key, span.clone(), |one| layout.has(one))
        {
            return (problem, instead.map(str::to_owned));
        }
        match did_you_mean(key, known()) {
            Some(meant) => {
                let label = format!("did you mean `{meant}`?");
                (Problem::new(message, span, label), Some(meant.to_owned()))
            }
            None => {
                let problem = Problem::new(message, span, "unknown key")
                    .help(format!("its keys are {}", listed(known(), "and")));
                (problem, None)
            }
        }
    }
}
