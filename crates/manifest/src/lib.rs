//! Reads TOML manifests and reports all their mistakes together.
//!
//! Each mistake is shown with file, line and column, a suggestion if a name is misspelt, and the
//! description of the key. The crate knows no stage and no physics; the crates above declare their
//! keys with it.
//!
//! | module | content |
//! |---|---|
//! | [`written`] | tables of declared keys, validated and with positions; sweeps, grids, pairs |
//! | [`written::checks`] | takes values and defaults; reports keys that do not fit together |
//! | [`diagnostics`] | collects and renders mistakes; "did you mean", lists, plurals |
//! | [`expression`] | arithmetic in column names: parsed, checked and evaluated |
//! | [`decimal`] | rounds computed numbers to short decimals |
//! | [`names`] | valid names of studies and stages |

pub mod decimal;
pub mod diagnostics;
pub mod expression;
pub mod written;

/// Names of studies and stages, which become files, folders and tables of queries.
pub mod names {
    /// Regular expression of valid names.
    pub const PATTERN: &str = "^[A-Za-z_][A-Za-z0-9_-]*$";

    /// Maximum length of a name in bytes.
    pub const LONGEST: usize = 64;

    /// Name of the table of failed tasks, which no stage can have.
    pub const FAILURES: &str = "failures";

    /// Returns whether a name matches [`PATTERN`].
    pub fn is_plain(name: &str) -> bool {
        let is_inner = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '-');
        name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && name.chars().all(is_inner)
    }
}
