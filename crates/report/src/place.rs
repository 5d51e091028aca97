//! Checks a folder that the user names as the place of a report: files of others stay.

use std::fs;
use std::io;
use std::path::Path;

use super::basis::Basis;
use super::{FIGURES, PAGE, ReportError, figures, seal};
use asperity_tables::store::StoreError;
use asperity_tables::store::files::Existing;

/// Checks that a report in this folder replaces nothing but an earlier report of the same study.
///
/// # Errors
/// When another page or figure is there. A page that no report wrote is never replaced, others are
/// if that is asked for.
pub fn check(folder: &Path, study: &str, existing: Existing) -> Result<(), ReportError> {
    let page = folder.join(PAGE);
    let basis = match fs::read(&page) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(source) => return Err(StoreError::Read { path: page, source }.into()),
        Ok(bytes) => match Basis::told(&String::from_utf8_lossy(&bytes)) {
            None => return Err(ReportError::NoReport { page }),
            basis => basis,
        },
    };
    if existing == Existing::Replace {
        return Ok(());
    }
    let changed = seal::changed(folder);
    if let Some(basis) = &basis
        && (basis.study != study || changed.contains(&page))
    {
        return Err(taken(&page, study));
    }
    let own = basis.unwrap_or_default().files;
    for name in figures::ALL.iter().flat_map(|figure| figure.file_names()) {
        let path = folder.join(FIGURES).join(&name);
        let is_own = own.contains_key(&name) && !changed.contains(&path);
        if !is_own && path.symlink_metadata().is_ok() {
            return Err(taken(&path, study));
        }
    }
    Ok(())
}

fn taken(path: &Path, study: &str) -> ReportError {
    ReportError::Taken { path: path.to_owned(), study: study.to_owned() }
}
