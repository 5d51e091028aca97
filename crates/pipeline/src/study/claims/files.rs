//! Files of claims: those that are shipped with the program, and those of users.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use toml::de::DeTable;

use super::ClaimSpec;
use super::check::{ClaimContext, check};
use crate::manifest::claim::WrittenClaims;
use crate::manifest::read_claims;
use crate::manifest::syntax::report_syntax;
use crate::study::columns::StageTables;
use asperity_manifest::diagnostics::{ManifestErrors, Problem, Problems, Span};
use asperity_tables::store::regular::read_regular;

/// Name of the file of claims that the program contains.
const SHIPPED: &str = "yastrebov-2015";
const SHIPPED_TEXT: &str = include_str!("../../../claims/yastrebov-2015.toml");
/// Tables of reference values of the file, by name.
const SHIPPED_TABLES: [(&str, &str); 2] = [
    ("yastrebov-2015-nayak.csv", include_str!("../../../claims/yastrebov-2015-nayak.csv")),
    (
        "yastrebov-2015-summit-density.csv",
        include_str!("../../../claims/yastrebov-2015-summit-density.csv"),
    ),
];

/// Maximum size of a file of claims or of reference values in bytes.
const MAX_BYTES: u64 = 4 << 20;

/// Returns the claims of the shipped file.
///
/// # Panics
/// If the shipped file is invalid.
pub fn shipped() -> Vec<ClaimSpec> {
    let claims = read(SHIPPED, 0..0, Path::new(""), StageTables::NONE);
    claims.expect("the file of the program is valid")
}

/// Reason why the claims of a file cannot be used.
#[derive(Debug)]
pub enum FileError {
    /// The file cannot be read.
    Unreadable(Problem),
    /// The file has mistakes.
    Invalid(Box<ManifestErrors>),
}

/// Reads the claims of a file, which is shipped or at a path relative to `folder`. `span` is the
/// position of its name in the manifest.
///
/// # Errors
/// Returns the problem of a file that cannot be read, or the errors of its claims.
pub fn read(
    name: &str,
    span: Span,
    folder: &Path,
    tables: StageTables,
) -> Result<Vec<ClaimSpec>, FileError> {
    let own = folder.join(name);
    let (file, text) = if name == SHIPPED {
        (format!("{name}.toml"), SHIPPED_TEXT.to_owned())
    } else {
        let text = read_text(&own).map_err(|reason| {
            let message = format!("cannot read the claims in `{}`: {reason}", own.display());
            let help = format!(
                "write the path of a file, relative to the manifest, or the name of the file of \
                 the program: `{SHIPPED}`"
            );
            FileError::Unreadable(Problem::new(message, span, "named here").help(help))
        })?;
        (own.display().to_string(), text)
    };
    let reference = |table: &str| {
        let shipped = SHIPPED_TABLES.iter().find(|(known, _)| name == SHIPPED && *known == table);
        shipped
            .map_or_else(|| read_text(&own.with_file_name(table)), |(_, text)| Ok(text.to_string()))
    };
    let mut problems = Problems::default();
    let context = ClaimContext { file: Some(name), tables, reference: &reference };
    let claims =
        parsed(&text, &mut problems).and_then(|written| check(&written, context, &mut problems));
    match claims {
        Some(claims) if problems.is_empty() => Ok(claims),
        _ => Err(FileError::Invalid(Box::new(problems.into_errors(&file, &text)))),
    }
}

/// Returns the files that claims of a study are in and that they name, without those of the
/// program, as paths relative to the manifest.
pub fn own_files(claims: &[ClaimSpec]) -> BTreeSet<PathBuf> {
    let mut files = BTreeSet::new();
    for claim in claims.iter().filter(|claim| claim.file.as_deref() != Some(SHIPPED)) {
        let file = claim.file.as_deref().map(Path::new);
        files.extend(file.map(Path::to_owned));
        let reference = claim.test.as_ref().and_then(|test| test.reference_file.as_ref());
        files.extend(reference.map(|name| file.unwrap_or(Path::new("")).with_file_name(name)));
    }
    files
}

/// Reads a text file.
///
/// # Errors
/// Returns the reason why the file cannot be read.
pub fn read_text(path: &Path) -> Result<String, String> {
    let bytes = read_regular(path, MAX_BYTES).map_err(|error| error.to_string())?;
    String::from_utf8(bytes).map_err(|error| error.to_string())
}

fn parsed(text: &str, problems: &mut Problems) -> Option<WrittenClaims> {
    let (document, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        report_syntax(text, &errors, problems);
        return None;
    }
    let mut written = WrittenClaims::default();
    for entry in document.into_inner() {
        match entry.0.get_ref().as_ref() {
            "claim" | "data" => read_claims(entry, &mut written, problems),
            _ => {
                let message = format!("unknown table `{}` in a file of claims", entry.0.get_ref());
                let problem = Problem::new(message, entry.0.span(), "not allowed here");
                let help = "a file of claims has tables `[claim.NAME]` and `[data.NAME]`";
                problems.push(problem.help(help));
            }
        }
    }
    Some(written)
}
