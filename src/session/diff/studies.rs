//! Studies to be compared: a manifest with its data folder, the studies of a data folder, the
//! tables of one study, or an archive.
//!
//! A manifest stands for its present parameters, and for the results that were computed with them.
//! Folders and archives stand for the tables in them, with the parameters that the run recorded in
//! `owner.json`. They can therefore come from another version of the program.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::{fs, io};

use tempfile::TempDir;
use zip::ZipArchive;

use super::{StageSize, StudyName};
use crate::session::index::tables;
use crate::session::output_files::begins_with;
use crate::session::{DataFolder, Observer, Session, SessionError, Setting, StudyResults};
use asperity_manifest::names::FAILURES;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::owner::Owner;
use asperity_tables::source::TableSource;
use asperity_tables::store::files::folder_of;
use asperity_tables::store::{StoreError, listing};
use asperity_tables::table::Table;

/// Name of the folder with the tables of all studies, in a data folder.
const RESULTS: &str = "results";

/// One side of a comparison: the studies at a path.
#[derive(Debug)]
pub(crate) struct Studies {
    pub(crate) path: PathBuf,
    pub(crate) studies: Vec<ComparedStudy>,
    /// Folder into which an archive is unpacked while it is compared.
    _unpacked: Option<TempDir>,
}

/// Study with the tables of its stages.
#[derive(Debug)]
pub(crate) struct ComparedStudy {
    pub(crate) origin: StudyName,
    /// Parameters of the study; `None` if a results folder does not record them.
    pub(crate) record: Option<Record>,
    /// Names of the stages, in the order of the study.
    pub(crate) stages: Vec<String>,
    tables: StageTables,
}

#[derive(Debug)]
enum StageTables {
    Manifest(Box<StudyResults>),
    /// Folder of the tables of one study.
    Published(PathBuf),
}

impl Studies {
    /// Opens the studies at a path: a manifest, a data folder, the folder of the tables of one
    /// study, or an archive. `data` is the data folder of a manifest, and `settings` override its
    /// keys. An archive is unpacked into a temporary folder.
    ///
    /// # Errors
    /// Returns an error if the path has no study, if a manifest is invalid, if a file cannot be
    /// read, or if there are settings and no manifest.
    pub(crate) fn open(
        path: &Path,
        settings: &[Setting],
        data: &DataFolder,
        observer: &dyn Observer,
    ) -> Result<Studies, SessionError> {
        let is_archive = begins_with(path, b"PK\x03\x04");
        if !path.is_dir() && !is_archive {
            let session = Session::with_data(path, data.clone()).with_settings(settings.to_vec());
            return session.observed_by(observer).compared();
        }
        if !settings.is_empty() {
            return Err(SessionError::refused(format!(
                "settings override keys of a manifest, and `{}` is not a manifest",
                path.display()
            )));
        }
        let tables = is_archive.then(|| unpacked(path)).transpose();
        let unpacked = tables.map_err(|source| StoreError::reading(path, source))?;
        let folder = unpacked.as_ref().map_or(path, TempDir::path);
        // An archive, unpacked or not, contains a data folder.
        let (own, in_archive) = (folder.join(RESULTS), folder.join("data").join(RESULTS));
        let results = if own.is_dir() { own } else { in_archive };
        let folders =
            if results.is_dir() { listing::folders(&results)? } else { vec![folder.to_owned()] };
        let studies: Vec<_> =
            folders.iter().filter_map(|folder| ComparedStudy::published(folder, path)).collect();
        if studies.is_empty() {
            return Err(SessionError::refused(format!(
                "`{}` has no tables of a study; name a manifest, a data folder or an archive",
                path.display()
            )));
        }
        Ok(Studies { path: path.to_owned(), studies, _unpacked: unpacked })
    }
}

impl Session<'_> {
    /// Opens the study of the manifest with its results.
    pub(super) fn compared(&self) -> Result<Studies, SessionError> {
        let reading = self.reading()?;
        let record = Record::new(&reading.study, &reading.plan, &[]);
        let path = self.manifest().to_owned();
        let origin = StudyName {
            path: path.clone(),
            settings: self.settings().iter().map(Setting::option).collect(),
            study: reading.study.name.clone(),
            is_manifest: true,
            programs: programs(&self.data().results_of(&reading.study.name)),
        };
        let study = ComparedStudy {
            origin,
            stages: record.stages.iter().map(|stage| stage.name.clone()).collect(),
            record: Some(record),
            tables: StageTables::Manifest(Box::new(reading)),
        };
        Ok(Studies { path, studies: vec![study], _unpacked: None })
    }
}

impl ComparedStudy {
    /// Opens the published tables of a study. Returns `None` if the folder has none.
    fn published(folder: &Path, path: &Path) -> Option<ComparedStudy> {
        let files = tables(folder);
        if files.is_empty() {
            return None;
        }
        let record = Owner::read(folder).map(Owner::into_study);
        let stages = match &record {
            Some(record) => record.stages.iter().map(|stage| stage.name.clone()).collect(),
            None => {
                let names = files.iter().filter_map(|path| path.file_stem()?.to_str());
                names.filter(|name| *name != FAILURES).map(str::to_owned).collect()
            }
        };
        let folder_name = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        let study = folder_name.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (path, programs) = (path.to_owned(), programs(folder));
        let origin =
            StudyName { path, settings: String::new(), study, is_manifest: false, programs };
        Some(ComparedStudy {
            origin,
            record,
            stages,
            tables: StageTables::Published(folder.to_owned()),
        })
    }

    /// Reads the table of a stage. Returns `None` if the stage has no results.
    ///
    /// # Errors
    /// Returns an error if a table is damaged.
    pub(crate) fn table(&self, stage: &str) -> Result<Option<(Table, StageSize)>, SessionError> {
        let sized = |table: Table, finished, tasks| {
            let rows = table.rows();
            (table, StageSize { rows, finished, tasks })
        };
        match &self.tables {
            StageTables::Manifest(reading) => {
                let found = reading.plan.stages.iter().find(|planned| planned.name == stage);
                let planned = found.expect("the names of the stages come from the plan");
                let rows = reading.rows(planned)?;
                let (finished, tasks) = (rows.tasks.len(), planned.tasks.len());
                Ok(rows.table.map(|table| sized(table, finished, tasks)))
            }
            StageTables::Published(folder) => {
                let path = folder.join(format!("{stage}.parquet"));
                if !path.is_file() {
                    return Ok(None);
                }
                let (source, metadata) = TableSource::open(&path)?;
                let number = |name: &str| metadata.get(name).and_then(|text| text.parse().ok());
                let tasks = number("tasks").unwrap_or(0);
                let finished = number("finished").unwrap_or(tasks);
                Ok(Some(sized(source.table()?, finished, tasks)))
            }
        }
    }
}

/// Returns the versions of the program that published the tables in a folder. Tables that cannot be
/// read are skipped; reading their rows reports the error.
fn programs(folder: &Path) -> BTreeSet<String> {
    let opened = tables(folder).into_iter().filter_map(|path| TableSource::open(&path).ok());
    opened.filter_map(|(_, metadata)| metadata.get("version").map(str::to_owned)).collect()
}

/// Unpacks the published tables of an archive and their owner files into a temporary folder.
fn unpacked(archive: &Path) -> io::Result<TempDir> {
    let mut archive = ZipArchive::new(File::open(archive)?)?;
    let folder = tempfile::tempdir()?;
    for index in 0..archive.len() {
        let mut file = archive.by_index(index)?;
        // The path is that of the archive, which may be crafted: it must stay inside the folder.
        let Some(path) = file.enclosed_name().filter(|_| file.is_file()) else { continue };
        if path.starts_with(Path::new("data").join(RESULTS)) {
            let target = folder.path().join(path);
            fs::create_dir_all(folder_of(&target))?;
            io::copy(&mut file, &mut File::create(target)?)?;
        }
    }
    Ok(folder)
}
