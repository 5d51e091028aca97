//! Names of studies and stages: they become files, folders and tables of queries.

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
