//! The page of all studies of a data folder, `index.html`.

use std::path::{Path, PathBuf};

use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;

use crate::charts::style;
use crate::integrity::{self, Basis};
use crate::{FIGURES, PAGE, ReportError, page};
use asperity_tables::store::StoreError;
use asperity_tables::store::files::write_whole;

/// Name of the page in the folder of results.
const INDEX: &str = "index.html";
const TEMPLATE: &str = include_str!("page/index.html");
/// Text by which a page of this program is recognized.
const MARK: &str = "<meta name=\"generator\" content=\"asperity report --index\">";

/// A study of a data folder.
#[derive(Debug, Clone, Serialize)]
pub struct StudyEntry {
    pub name: String,
    /// First paragraph of the comment at the beginning of the manifest, as the last run recorded
    /// it.
    pub description: Option<String>,
    /// Path of the manifest, if it is known.
    pub manifest: Option<String>,
    /// Time of the last run in UTC.
    pub written: Option<String>,
    /// Number of surfaces, if it is known.
    pub surfaces: Option<u64>,
    pub stages: Vec<StageEntry>,
    pub state: StudyState,
    /// Damaged and missing files, one text for each.
    pub problems: Vec<String>,
    /// Path of the report relative to the folder of results.
    pub page: Option<String>,
    /// Path of the main figure relative to the folder of results.
    pub picture: Option<String>,
}

/// A stage of a study with its numbers of tasks.
#[derive(Debug, Clone, Serialize)]
pub struct StageEntry {
    pub name: String,
    pub kind: &'static str,
    pub finished: usize,
    pub tasks: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StudyState {
    Finished,
    Incomplete,
    /// The record of the last run is missing or damaged.
    Unknown,
}

/// Returns the paths of the report of a study and of its main figure, relative to the folder of
/// results, as far as the files exist.
pub fn report_of(results: &Path, study: &str) -> [Option<String>; 2] {
    let folder = results.join(study);
    let path = folder.join(PAGE);
    let Ok(text) = integrity::read_page(&path) else { return [None, None] };
    let main = Basis::from_page(&text).and_then(|basis| basis.main);
    let picture = main
        .map(|name| format!("{FIGURES}/{name}.svg"))
        .filter(|picture| folder.join(picture).is_file());
    [Some(format!("{study}/{PAGE}")), picture.map(|picture| format!("{study}/{picture}"))]
}

/// Returns which files of the report of a study were changed by hand.
pub fn problems_of_report(results: &Path, study: &str) -> Vec<String> {
    integrity::problems(&results.join(study)).iter().map(ToString::to_string).collect()
}

/// Writes the page of these studies into the folder of results and returns its path.
///
/// # Errors
/// If the file cannot be written, or a file of this name was not written by this function.
pub fn write_index(
    results: &Path,
    studies: &[StudyEntry],
    replaces: bool,
) -> Result<PathBuf, ReportError> {
    let path = results.join(INDEX);
    match integrity::read_page(&path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(source) => return Err(StoreError::reading(path, source).into()),
        Ok(text) if !replaces && !text.contains(MARK) => {
            return Err(ReportError::NoIndex { page: path });
        }
        Ok(_) => {}
    }
    let text = html(results, studies);
    write_whole(&path, text.as_bytes(), results)?;
    Ok(path)
}

fn html(results: &Path, studies: &[StudyEntry]) -> String {
    let [light, dark] = style::declarations();
    let folder = results.display().to_string();
    let studies = Serde(studies);
    let contents = context! { folder, studies, style => page::STYLE, light, dark };
    let page = page::environment().render_named_str("index.html", TEMPLATE, contents);
    page.expect("the template only uses these contents")
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn study(name: &str) -> StudyEntry {
        let stage =
            |name: &str, kind| StageEntry { name: name.to_owned(), kind, finished: 3, tasks: 4 };
        StudyEntry {
            name: name.to_owned(),
            description: Some("Area < 1 with `k_upper`.".to_owned()),
            manifest: None,
            written: None,
            surfaces: Some(1),
            stages: vec![stage("surfaces", "generate"), stage("contact", "solve")],
            state: StudyState::Incomplete,
            problems: vec!["`area.parquet` is damaged".to_owned()],
            page: Some(format!("{name}/report.html")),
            picture: None,
        }
    }

    #[test]
    fn a_study_is_listed_with_its_state_and_its_problems() {
        let folder = tempfile::tempdir().unwrap();
        let path = write_index(folder.path(), &[study("small")], false).unwrap();
        let page = fs::read_to_string(&path).unwrap();
        for part in [
            "href=\"small&#x2f;report.html\"",
            "Area &lt; 1 with <code>k_upper</code>.",
            "incomplete",
            "1 surface ",
            "6 of 8 tasks",
            "<code>area.parquet</code> is damaged",
        ] {
            assert!(page.contains(part), "{part} in {page}");
        }
        assert!(!page.contains('`') && !page.contains("http"));
        // It replaces its own page, but no other file.
        write_index(folder.path(), &[], false).unwrap();
        fs::write(&path, "<html>").unwrap();
        let refused = write_index(folder.path(), &[], false);
        assert!(matches!(refused, Err(ReportError::NoIndex { .. })));
        write_index(folder.path(), &[], true).unwrap();
    }
}
