//! Reads TOML manifests and reports all their mistakes together.
//!
//! Each mistake is shown with file, line and column, a suggestion if a name is misspelt, and the
//! description of the key. The crate knows no stages and no physics: other crates declare their
//! keys with it.
//!
//! | module | content |
//! |---|---|
//! | [`keys`] | tables of declared keys: validation, positions in the text, sweeps, pairs |
//! | [`keys::checks`] | values and defaults of keys; reports of keys that contradict each other |
//! | [`diagnostics`] | collection and display of mistakes; "did you mean", lists, plurals |
//! | [`expression`] | arithmetic expressions in the columns of a table |
//! | [`decimal`] | rounding of computed numbers to twelve digits |
//! | [`names`] | valid names of studies and stages |

pub mod decimal;
pub mod diagnostics;
pub mod expression;
pub mod keys;

/// Valid names of studies and stages. They become names of files, folders and SQL tables.
pub mod names {
    /// Regular expression of valid names.
    pub const PATTERN: &str = "^[A-Za-z_][A-Za-z0-9_-]*$";

    /// Maximum length of a name in bytes.
    pub const MAX_LENGTH: usize = 64;

    /// Name of the table of failed tasks, which cannot be the name of a stage.
    pub const FAILURES: &str = "failures";

    /// Returns whether a name matches [`PATTERN`].
    pub fn is_plain(name: &str) -> bool {
        let is_inner = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '-');
        name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && name.chars().all(is_inner)
    }
}
