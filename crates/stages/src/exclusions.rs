//! Keys that cannot be written beside others, declared as a list of condition, keys and reason.

use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;

/// A key of a table that is excluded if a condition holds.
#[derive(Debug, Clone, Copy)]
pub struct Exclusion<'a> {
    /// Whether the other keys exclude the key.
    pub applies: bool,
    /// Name of the key.
    pub key: &'static str,
    /// Position of the key, if the manifest contains it.
    pub written: Option<&'a Span>,
    /// Reason, the label of the problem.
    pub why: &'static str,
}

/// Refuses the keys of a table that a condition excludes:
/// `exclude! { table, checks, condition => key, other_key: "reason"; … }`. All excluded keys are
/// reported. The result is `None` if there is one.
macro_rules! exclude {
    ($table:expr, $checks:expr, $($condition:expr => $($key:ident),+ : $why:expr;)+) => {{
        let table = $table;
        let exclusions = [$($($crate::exclusions::Exclusion {
            applies: $condition,
            key: stringify!($key),
            written: table.$key.written().map(|written| &written.span),
            why: $why,
        }),+),+];
        $crate::exclusions::refuse(&exclusions, $checks)
    }};
}
pub(crate) use exclude;

/// Reports every excluded key that the manifest contains.
pub fn refuse(exclusions: &[Exclusion], checks: &mut Checks) -> Option<()> {
    let mut clear = Some(());
    for Exclusion { key, written, why, .. } in exclusions.iter().filter(|one| one.applies) {
        if let Some(span) = written {
            let message = format!("`{key}` cannot be used here");
            clear = checks.reject(Problem::new(message, (*span).clone(), *why));
        }
    }
    clear
}
