//! Contents of an earlier report, detection of changes to its files, and checks before the report
//! is replaced.
//!
//! A page contains its [`Basis`] as JSON: the figures and rows that it shows, and digests of the
//! files of the figures. It ends with a digest of the preceding text.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::figures::{self, DrawnFigure};
use crate::finished::FinishedStage;
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

/// Contents of a page. They are compared with a new page before it replaces this page, because the
/// new page may show less.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Basis {
    /// Name of the study, which is empty for pages of earlier versions.
    #[serde(default)]
    study: String,
    figures: BTreeSet<String>,
    rows: BTreeMap<String, usize>,
    /// Name of the first figure of the page, if the page has figures.
    #[serde(default)]
    pub main: Option<String>,
    #[serde(default)]
    files: BTreeMap<String, String>,
}

impl Basis {
    pub fn new(study: &str, figures: &[DrawnFigure], stages: &[FinishedStage]) -> Basis {
        let files = figures.iter().flat_map(DrawnFigure::files);
        let rows = stages.iter().map(|stage| (stage.name.clone(), stage.table.rows()));
        Basis {
            study: study.to_owned(),
            figures: figures.iter().map(|figure| figure.title.clone()).collect(),
            rows: rows.collect(),
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

    /// Lists the figures and rows that the existing page in the file `page` has and this basis
    /// lacks. The list is empty if the file does not exist.
    pub fn lacks_of(&self, page: &Path) -> Vec<String> {
        let page = read_page(page);
        match page.as_deref().map(Basis::from_page) {
            Ok(Some(basis)) => self.lacks(&basis),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Ok(None) | Err(_) => {
                vec!["unknown contents, because the page does not list them".to_owned()]
            }
        }
    }

    fn lacks(&self, other: &Basis) -> Vec<String> {
        let figures = other.figures.difference(&self.figures).map(|title| format!("\"{title}\""));
        let lacked =
            |(stage, rows): (&String, &usize)| match self.rows.get(stage).copied().unwrap_or(0) {
                0 if *rows > 0 => Some(format!("the rows of `{stage}`")),
                own if own < *rows => Some(format!("{} of {rows} rows of `{stage}`", rows - own)),
                _ => None,
            };
        figures.chain(other.rows.iter().filter_map(lacked)).collect()
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

/// Name of the file in the folder of a report that exists while the report is being written.
const UNFINISHED: &str = ".report-unfinished";

/// Notes that a report is being written. A process that is killed leaves the note.
pub fn begin(folder: &Path) {
    // Ignore errors: if the folder cannot be written, the report fails.
    let _ = fs::write(folder.join(UNFINISHED), "");
}

/// Removes the note that a report is being written.
pub fn end(folder: &Path) {
    let _ = fs::remove_file(folder.join(UNFINISHED));
}

/// Returns an error for each page and figure in a folder that differs from what the report wrote:
/// somebody has edited it, or a report was interrupted. Waits while a report is being written.
pub fn problems(folder: &Path) -> Vec<StoreError> {
    let changed = changed_files(folder).into_iter();
    let is_interrupted = folder.join(UNFINISHED).exists();
    let problem = |path: PathBuf| {
        if is_interrupted { StoreError::Interrupted { path } } else { StoreError::Changed { path } }
    };
    changed.map(problem).collect()
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

/// Returns the names of the files that an earlier report may have in the folder of figures: those
/// that the page lists, and those of all figures that every study can have.
pub fn figure_files(page: &Path) -> BTreeSet<String> {
    let basis = read_page(page).ok().and_then(|page| Basis::from_page(&page));
    let listed = basis.unwrap_or_default().files.into_keys();
    let known = figures::names().flat_map(figures::file_names);
    known.chain(listed).collect()
}

/// Checks that a report in a folder chosen by the user only replaces an earlier report of the same
/// study.
///
/// # Errors
/// If the folder contains another page or figure. A page that is not a report is never replaced.
/// Other files are replaced if `replaces` is true.
pub fn check_folder(folder: &Path, study: &Study, replaces: bool) -> Result<(), ReportError> {
    let page = folder.join(PAGE);
    let basis = match read_page(&page) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(source) => return Err(StoreError::reading(page, source).into()),
        Ok(text) => match Basis::from_page(&text) {
            None => return Err(ReportError::NoReport { page }),
            basis => basis,
        },
    };
    if replaces {
        return Ok(());
    }
    let changed = changed_files(folder);
    let taken = |path: PathBuf| Err(ReportError::Taken { path, study: study.name.clone() });
    if basis.as_ref().is_some_and(|basis| basis.study != study.name) || changed.contains(&page) {
        return taken(page);
    }
    let own = basis.unwrap_or_default().files;
    // Automatic figures have the names of their stages.
    let declared = study.figures.iter().map(|figure| &figure.name);
    let names = declared.chain(study.stages.iter().map(|stage| &stage.name));
    let files = names.flat_map(|name| figures::file_names(name));
    for name in figure_files(&page).into_iter().chain(files) {
        let path = folder.join(FIGURES).join(&name);
        let is_own = own.contains_key(&name) && !changed.contains(&path);
        if !is_own && path.symlink_metadata().is_ok() {
            return taken(path);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::thread;
    use std::time::Duration;

    use super::*;
    use asperity_tables::store::files::lock_to_write;

    fn basis(figures: &[&str], rows: &[(&str, usize)]) -> Basis {
        Basis {
            figures: figures.iter().map(|&title| title.to_owned()).collect(),
            rows: rows.iter().map(|&(stage, rows)| (stage.to_owned(), rows)).collect(),
            ..Basis::default()
        }
    }

    #[test]
    fn less_is_told_and_more_is_not() {
        let less = basis(&["Slope"], &[("area", 8)]);
        let more = basis(&["Slope", "Contact maps"], &[("area", 16), ("law", 4)]);
        assert_eq!(more.lacks(&less), [""; 0]);
        let lacks = ["\"Contact maps\"", "8 of 16 rows of `area`", "the rows of `law`"];
        assert_eq!(less.lacks(&more), lacks);
    }

    #[test]
    fn a_page_says_what_it_rests_on_and_others_are_not_trusted_to_be_empty() {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join(PAGE);
        let basis = basis(&["Slope"], &[("area", 8)]);
        assert_eq!(basis.lacks_of(&page), [""; 0], "there is none yet");
        let text = format!("<script {}{}{}", BASIS[0], basis.json(), BASIS[1]);
        fs::write(&page, text).unwrap();
        assert_eq!(Basis::default().lacks_of(&page).len(), 2);
        fs::write(&page, "<html>").unwrap();
        assert_eq!(basis.lacks_of(&page).len(), 1);
    }

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
    fn an_interrupted_report_was_not_edited() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(PAGE), "half a page").unwrap();
        begin(folder.path());
        assert!(matches!(problems(folder.path())[..], [StoreError::Interrupted { .. }]));
        end(folder.path());
        assert!(matches!(problems(folder.path())[..], [StoreError::Changed { .. }]));
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
