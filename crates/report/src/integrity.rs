//! Detection of changes to the files of a report, and a check before a report is replaced.
//!
//! A page contains its [`Basis`] as JSON, with digests of the files of the figures. It ends with a
//! digest of the preceding text.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::figures::DrawnFigure;
use crate::{FIGURES, PAGE, ReportError};
use asperity_pipeline::study::Study;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::lock_to_read;
use asperity_tables::store::regular::read_below;

/// Text before and after the basis on a page.
const BASIS: [&str; 2] = ["id=\"basis\">", "</script>"];
/// Text before and after the digest at the end of a page.
const SEAL: [&str; 2] = ["<!-- blake3 ", " -->\n"];
/// Maximum size in bytes of a page or figure that is read.
const MAX_BYTES: u64 = 1 << 30;

/// Study, main figure and files of a page.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Basis {
    study: String,
    /// Name of the first figure of the page, if the page has figures.
    pub main: Option<String>,
    /// Digests of the files of the figures, by their names.
    pub files: BTreeMap<String, String>,
}

impl Basis {
    pub fn new(study: &str, figures: &[DrawnFigure]) -> Basis {
        let files = figures.iter().flat_map(DrawnFigure::files);
        Basis {
            study: study.to_owned(),
            // The page shows the groups in this order.
            main: figures.iter().min_by_key(|one| one.group).map(|one| one.name.clone()),
            files: files.map(|(name, bytes)| (name, digest(bytes))).collect(),
        }
    }

    /// Returns the basis as JSON for the block of a page. A title could contain the tag that ends
    /// the block, so the JSON has no `<`.
    pub fn json(&self) -> String {
        let json = serde_json::to_string(self).expect("it is plain data");
        json.replace('<', "\\u003c")
    }

    /// Reads the basis of a page. A page is a text that somebody may have edited, so files outside
    /// of the folder of figures are left out.
    pub fn from_page(page: &str) -> Option<Basis> {
        let (_, rest) = page.split_once(BASIS[0])?;
        let (json, _) = rest.split_once(BASIS[1])?;
        let mut basis: Basis = serde_json::from_str(json).ok()?;
        let is_inside = |name: &String| Path::new(name).file_name() == Some(name.as_ref());
        basis.files.retain(|name, _| is_inside(name));
        basis.main = basis.main.filter(is_inside);
        Some(basis)
    }
}

/// Appends the digest that detects changes of a page.
pub fn sealed(page: String) -> String {
    let digest = digest(page.as_bytes());
    page + SEAL[0] + &digest + SEAL[1]
}

fn is_sealed(page: &str) -> bool {
    page.rsplit_once(SEAL[0])
        .and_then(|(page, end)| Some((page, end.strip_suffix(SEAL[1])?)))
        .is_some_and(|(page, written)| digest(page.as_bytes()) == written)
}

/// Reads a page. Bytes that are not UTF-8 are replaced; its seal is then broken.
///
/// # Errors
/// Returns an error if the page is a link to another folder, no regular file, or too large.
pub fn read_page(page: &Path) -> io::Result<String> {
    let folder = page.parent().filter(|folder| *folder != Path::new(""));
    let bytes = read_below(folder.unwrap_or(Path::new(".")), page, MAX_BYTES)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn digest(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_string()
}

/// Returns an error for each page and figure in a folder that differs from what the report wrote.
/// Waits while a report is being written.
pub fn problems(folder: &Path) -> Vec<StoreError> {
    changed_files(folder).into_iter().map(|path| StoreError::Changed { path }).collect()
}

/// Returns the page and the figures in a folder that differ from what the report wrote.
fn changed_files(folder: &Path) -> Vec<PathBuf> {
    let _unchanging = lock_to_read(folder);
    let page = folder.join(PAGE);
    let text = match read_page(&page) {
        Ok(text) => text,
        // A link, a device or another kind of file stands where the page was.
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => return vec![page],
        Err(_) => return Vec::new(),
    };
    let listed = Basis::from_page(&text).unwrap_or_default().files;
    let figures = listed.into_iter().filter_map(|(name, written)| {
        let figure = folder.join(FIGURES).join(name);
        let is_changed = match read_below(folder, &figure, MAX_BYTES) {
            Ok(bytes) => digest(&bytes) != written,
            Err(error) => error.kind() == io::ErrorKind::InvalidInput,
        };
        is_changed.then_some(figure)
    });
    let changed_page = (!is_sealed(&text)).then_some(page);
    changed_page.into_iter().chain(figures).collect()
}

/// Checks that a folder chosen by the user has neither a page nor figures, or an unchanged report
/// of the same study.
///
/// # Errors
/// If the page in the folder is not a report, which is never replaced. Unless `replaces` is true,
/// also if there are figures without a page, or the report belongs to another study or was changed.
pub fn check_folder(folder: &Path, study: &Study, replaces: bool) -> Result<(), ReportError> {
    let page = folder.join(PAGE);
    let taken = match read_page(&page) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Some(folder.join(FIGURES)).filter(|figures| figures.exists())
        }
        Err(source) => return Err(StoreError::reading(page, source).into()),
        Ok(text) => match Basis::from_page(&text) {
            None => return Err(ReportError::NoReport { page }),
            Some(basis) if basis.study != study.name => Some(page),
            Some(_) => changed_files(folder).into_iter().next(),
        },
    };
    match taken {
        Some(path) if !replaces => Err(ReportError::Taken { path, study: study.name.clone() }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::thread;
    use std::time::Duration;

    use super::*;
    use asperity_tables::store::files::lock_to_write;

    #[test]
    fn a_report_that_is_being_written_is_looked_at_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join(PAGE);
        let written = lock_to_write(folder.path()).expect("this disk can lock folders");
        fs::write(&page, "half a page").unwrap();
        let found = thread::scope(|scope| {
            let look = scope.spawn(|| changed_files(folder.path()));
            thread::sleep(Duration::from_millis(200));
            fs::write(&page, sealed("a page".to_owned())).unwrap();
            drop(written);
            look.join().unwrap()
        });
        assert_eq!(found, Vec::<PathBuf>::new());
        fs::write(&page, "half a page").unwrap();
        assert_eq!(changed_files(folder.path()), [page]);
    }

    #[test]
    fn a_page_is_sealed_until_a_byte_of_it_changes() {
        let page = sealed("<html></html>\n".to_owned());
        assert!(is_sealed(&page));
        for (position, _) in page.char_indices() {
            let mut other = page.clone();
            other.replace_range(position..=position, "#");
            assert!(!is_sealed(&other), "{position}");
        }
        assert!(!is_sealed("<html></html>\n"));
    }
}
