//! Messages about keys that a table does not have.

use super::Layout;
use crate::diagnostics::{Problem, Span, did_you_mean, listed};

/// Keys that have been renamed: the old name, the new one, and what the new one holds.
const RENAMED: [(&str, &str, &str); 1] = [(
    "youngs_modulus",
    "effective_modulus",
    "it holds E*, the effective modulus of the two bodies together; write their own moduli in \
     `bodies = [{ youngs_modulus, poisson_ratio }]`",
)];

/// Finds another table that has a key, and returns its name for messages.
pub type FindOwner = dyn Fn(&str) -> Option<String>;

/// The keys that a table can have, for messages about other ones.
pub struct ExpectedKeys {
    /// Name of the table in messages.
    pub table: String,
    /// Keys that are read before those of the [`Layout`].
    pub common: Vec<&'static str>,
    /// Finds another table that has the key.
    pub owner: Box<FindOwner>,
}

impl ExpectedKeys {
    /// Expects the keys of a [`Layout`] alone.
    pub fn of_table(table: &str) -> Self {
        Self { table: table.to_owned(), common: Vec::new(), owner: Box::new(|_| None) }
    }

    /// Reports a key that the table does not have, and returns the key that was probably meant.
    pub fn unknown_key(
        &self,
        layout: &'static Layout,
        key: &str,
        span: Span,
    ) -> (Problem, Option<String>) {
        let known = || layout.keys().chain(self.common.iter().copied());
        let message = format!("{} has no key `{key}`", self.table);
        if let Some((_, now, help)) = RENAMED.iter().find(|(was, ..)| *was == key)
            && layout.has(now)
        {
            let label = format!("renamed: `{now} = …`");
            let problem = Problem::new(message, span, label).help(*help);
            return (problem, Some((*now).to_owned()));
        }
        if let Some(owner) = (self.owner)(key) {
            let label = format!("belongs to {owner}");
            return (Problem::new(message, span, label), None);
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
