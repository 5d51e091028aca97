//! Reads manifests: TOML whose keys know where they are written.
//!
//! All mistakes of a manifest are collected and shown at once, each with file, line and column, what
//! was meant, and what to write instead. The crate knows no stage and no physics; the crates above
//! declare their keys with it.
//!
//! | module | what it does |
//! |---|---|
//! | [`written`] | reads a table of keys and keeps the place of each value; sweeps, grids, axes |
//! | [`written::checks`] | checks values: required, in range, one of a list |
//! | [`diagnostics`] | collects mistakes and renders them; "did you mean", lists, plurals |
//! | [`expression`] | arithmetic in column names: parsed, checked and evaluated |
//! | [`decimal`] | rounds computed numbers to the decimals that were meant |
//! | [`names`] | which names studies and stages may have |

pub mod decimal;
pub mod diagnostics;
pub mod expression;
pub mod written;

/// Names of studies and stages: they become files, folders and tables of queries.
pub mod names {
    /// What a name looks like, as a regular expression.
    pub const PATTERN: &str = "^[A-Za-z_][A-Za-z0-9_-]*$";

    /// Bytes of a name.
    pub const LONGEST: usize = 64;

    /// The table of what failed; no stage is called so.
    pub const FAILURES: &str = "failures";

    /// Whether a name matches [`PATTERN`].
    pub fn is_plain(name: &str) -> bool {
        let is_inner = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '-');
        name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && name.chars().all(is_inner)
    }
}
