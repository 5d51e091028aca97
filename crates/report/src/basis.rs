//! What a page rests on, so that no page takes the place of one that shows more.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::figure::DrawnFigure;
use super::tables::FinishedStage;

/// How a page begins and ends to say it.
const OPENING: &str = "id=\"basis\">";
const CLOSING: &str = "</script>";

/// Digests of the files of figures, by their names.
pub type Digests = BTreeMap<String, String>;

/// The figures of a page, and the rows that they are drawn from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Basis {
    /// The study's name; pages of earlier programs have none.
    #[serde(default)]
    pub study: String,
    figures: BTreeSet<String>,
    /// By stage.
    rows: BTreeMap<String, usize>,
    /// The figures' files.
    #[serde(default)]
    pub files: Digests,
}

impl Basis {
    /// Of a page with these figures, of these stages.
    pub fn of(
        study: &str,
        figures: &[DrawnFigure],
        files: Digests,
        stages: &[FinishedStage],
    ) -> Basis {
        let rows = stages.iter();
        let rows = rows.map(|stage| (stage.name.clone(), stage.table.rows()));
        Basis {
            study: study.to_owned(),
            figures: figures.iter().map(|figure| figure.title.to_owned()).collect(),
            rows: rows.collect(),
            files,
        }
    }

    /// As a page says it.
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("it is plain data")
    }

    /// What the page in a file shows and this does not, in words.
    pub fn lacks_of(&self, page: &Path) -> Vec<String> {
        let page = fs::read_to_string(page);
        match page.as_deref().map(Basis::told) {
            Ok(Some(basis)) => self.lacks(&basis),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Ok(None) | Err(_) => vec!["what it rests on, which it does not say".to_owned()],
        }
    }

    /// What a page says.
    pub fn told(page: &str) -> Option<Basis> {
        let (_, rest) = page.split_once(OPENING)?;
        let (json, _) = rest.split_once(CLOSING)?;
        serde_json::from_str(json).ok()
    }

    fn lacks(&self, other: &Basis) -> Vec<String> {
        let figures = other.figures.difference(&self.figures);
        let figures = figures.map(|title| format!("\"{title}\""));
        let own = |stage: &String| self.rows.get(stage).copied().unwrap_or(0);
        let rows = other.rows.iter().filter(|(stage, rows)| own(stage) < **rows);
        let rows = rows.map(|(stage, rows)| match own(stage) {
            0 => format!("the rows of `{stage}`"),
            own => format!("{} of {rows} rows of `{stage}`", rows - own),
        });
        figures.chain(rows).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let page = folder.path().join("report.html");
        let basis = basis(&["Slope"], &[("area", 8)]);
        assert_eq!(basis.lacks_of(&page), [""; 0], "there is none yet");
        let text = format!("<script {OPENING}{}{CLOSING}", basis.json());
        fs::write(&page, text).unwrap();
        assert_eq!(Basis::default().lacks_of(&page).len(), 2);
        fs::write(&page, "<html>").unwrap();
        assert_eq!(basis.lacks_of(&page).len(), 1);
    }
}
