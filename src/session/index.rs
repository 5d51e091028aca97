//! The page of all studies of a data folder.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::formatting::minute;
use super::results::TableSource;
use super::{DataFolder, SessionError};
use asperity_manifest::diagnostics::chain;
use asperity_pipeline::plan::Kind;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::owner;
use asperity_report::index::{self, StageEntry, StudyEntry, StudyState, write_index};
use asperity_tables::store::listing;

/// Path of the page of all studies of a data folder, and the studies.
#[derive(Debug, Serialize)]
pub(crate) struct StudyIndex {
    pub(crate) page: PathBuf,
    pub(crate) studies: Vec<StudyEntry>,
}

impl StudyIndex {
    /// Writes `results/index.html`. Another file of this name is overwritten only with `replace`.
    ///
    /// # Errors
    /// Returns an error if the folder has no studies or cannot be listed, or if the page cannot be
    /// written.
    pub(crate) fn write(data: &DataFolder, replace: bool) -> Result<StudyIndex, SessionError> {
        let names = names(data)?;
        if names.is_empty() {
            return Err(SessionError::NoStudies { data: data.path().to_owned() });
        }
        let studies: Vec<StudyEntry> = names.iter().map(|name| entry(data, name)).collect();
        let page = write_index(&data.results(), &studies, replace)?;
        Ok(StudyIndex { page, studies })
    }
}

/// Returns the names of the studies that have results or the record of a run, in alphabetical
/// order.
fn names(data: &DataFolder) -> Result<BTreeSet<String>, SessionError> {
    let folders = listing::folders(&data.results())?.into_iter();
    let mut names = BTreeSet::new();
    for folder in folders.filter(|folder| is_of_a_study(folder)) {
        names.extend(folder.file_name().map(|name| name.to_string_lossy().into_owned()));
    }
    for file in Record::files(&data.records())? {
        if let listing::FileKind::Record { study } = file.what {
            names.insert(study);
        }
    }
    Ok(names)
}

fn is_of_a_study(folder: &Path) -> bool {
    folder.join(owner::FILE).exists() || !tables(folder).is_empty()
}

/// Returns the paths of the tables in a folder of results.
pub(crate) fn tables(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = files.map(|file| file.path());
    let is_table = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "parquet");
    let mut tables: Vec<PathBuf> = paths.filter(is_table).collect();
    tables.sort();
    tables
}

fn entry(data: &DataFolder, name: &str) -> StudyEntry {
    let folder = data.results_of(name);
    let record = Record::read(&data.records(), name);
    let (manifest, description) = owner::manifest_of(&folder).unzip();
    let [page, picture] = index::report_of(&data.results(), name);
    let tables = tables(&folder);
    let record_file = Record::path(&data.records(), name);
    let modified = |path: &PathBuf| fs::metadata(path).ok()?.modified().ok();
    let written = tables.iter().chain([&record_file]).filter_map(modified).max();
    let recorded = record.iter().flat_map(|record| &record.stages);
    let stages: Vec<StageEntry> = recorded
        .map(|stage| StageEntry {
            name: stage.name.clone(),
            kind: stage.kind.name(),
            finished: stage.finished,
            tasks: stage.tasks,
        })
        .collect();
    StudyEntry {
        name: name.to_owned(),
        description: description.flatten(),
        manifest: manifest.map(|path| path.display().to_string()),
        written: written.map(minute),
        surfaces: record.as_ref().map(surfaces),
        state: match &record {
            None => StudyState::Unknown,
            Some(_) if stages.iter().all(|stage| stage.finished == stage.tasks) => {
                StudyState::Finished
            }
            Some(_) => StudyState::Incomplete,
        },
        problems: problems(data, name, &tables, record.is_some()),
        stages,
        page,
        picture,
    }
}

fn surfaces(record: &Record) -> u64 {
    let generated = record.stages.iter().filter(|stage| stage.kind == Kind::Generate);
    let points = generated.flat_map(|stage| &stage.points);
    points.map(|point| u64::from(point.realizations)).sum()
}

/// Returns what is wrong with the files of a study.
fn problems(data: &DataFolder, name: &str, tables: &[PathBuf], has_record: bool) -> Vec<String> {
    let missing = |path: PathBuf| {
        format!("`{}` is missing or damaged; run the study again to write it", path.display())
    };
    let mut problems = Vec::new();
    if !has_record {
        problems.push(missing(Record::path(&data.records(), name)));
    }
    let folder = data.results_of(name);
    if tables.is_empty() {
        problems.push(format!("`{}` has no tables; run the study again", folder.display()));
    } else if owner::manifest_of(&folder).is_none() {
        problems.push(missing(folder.join(owner::FILE)));
    }
    for table in tables {
        if let Err(error) = TableSource::open(table) {
            problems.push(format!("{}; run the study again", chain(&error)));
        }
    }
    problems.extend(index::problems_of_report(&data.results(), name));
    problems
}
