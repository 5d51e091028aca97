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

use bytesize::ByteSize;
use tempfile::TempDir;
use zip::ZipArchive;

use crate::session::index::tables;
use crate::session::output_files::begins_with;
use crate::session::{DataFolder, Observer, Session, SessionError, Setting, StudyResults};
use crate::share::is_archive;
use asperity_manifest::names::FAILURES;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::owner::{self, Owner};
use asperity_tables::source::TableSource;
use asperity_tables::store::{StoreError, listing};
use asperity_tables::table::Table;

/// Name of the folder with the tables of all studies, in a data folder.
const RESULTS: &str = "results";

/// Largest ratio of the size of a table to its size in an archive.
const MAX_RATIO: u64 = 10;

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
    pub(crate) path: PathBuf,
    /// Settings that override keys of the manifest.
    pub(crate) settings: Vec<Setting>,
    pub(crate) name: String,
    /// Versions of the program that published the tables.
    pub(crate) programs: BTreeSet<String>,
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

/// Table of a stage, which may be incomplete.
#[derive(Debug)]
pub(crate) struct StageTable {
    pub(crate) table: Table,
    pub(crate) finished: usize,
    pub(crate) tasks: usize,
}

impl Studies {
    /// Opens the studies at a path: a manifest, a data folder, the folder of the tables of one
    /// study, or an archive. `data` is the data folder of a manifest, and `settings` override its
    /// keys. An archive is unpacked into a folder in `scratch`, or in the folder of the system for
    /// temporary files.
    ///
    /// # Errors
    /// Returns an error if the path has no study, if a manifest is invalid, if a file cannot be
    /// read, or if there are settings and no manifest.
    pub(crate) fn open(
        path: &Path,
        settings: &[Setting],
        data: &DataFolder,
        scratch: Option<&Path>,
        observer: &dyn Observer,
    ) -> Result<Studies, SessionError> {
        let is_archive = is_zip(path);
        if (path.is_dir() || is_archive) && !settings.is_empty() {
            return Err(SessionError::refused(format!(
                "settings override keys of a manifest, and `{}` is not a manifest",
                path.display()
            )));
        }
        if path.is_dir() {
            return Studies::of_folder(path);
        }
        if is_archive {
            return Studies::of_archive(path, scratch);
        }
        let session = Session::with_data(path, data.clone()).with_settings(settings.to_vec());
        session.observed_by(observer).compared()
    }

    /// Opens the studies of a data folder, of an unpacked archive, which contains one, or of a
    /// folder of tables.
    fn of_folder(path: &Path) -> Result<Studies, SessionError> {
        let (own, in_archive) = (path.join(RESULTS), path.join("data").join(RESULTS));
        let results = if own.is_dir() { own } else { in_archive };
        let folders =
            if results.is_dir() { listing::folders(&results)? } else { vec![path.to_owned()] };
        let studies: Vec<_> =
            folders.iter().filter_map(|folder| ComparedStudy::published(folder, path)).collect();
        if studies.is_empty() {
            return Err(SessionError::refused(format!(
                "`{}` has no tables of a study; name a manifest, a data folder or an archive",
                path.display()
            )));
        }
        Ok(Studies { path: path.to_owned(), studies, _unpacked: None })
    }

    fn of_archive(path: &Path, scratch: Option<&Path>) -> Result<Studies, SessionError> {
        if !is_archive(path) {
            return Err(SessionError::refused(format!(
                "`{}` is not an archive of `asperity share`; unpack it and name its data folder",
                path.display()
            )));
        }
        let read = |source: io::Error| StoreError::reading(path, source);
        let folder = scratch.map_or_else(tempfile::tempdir, tempfile::tempdir_in).map_err(read)?;
        unpack_results(path, folder.path()).map_err(read)?;
        let mut studies = Studies::of_folder(&folder.path().join("data"))?;
        studies.studies.iter_mut().for_each(|study| study.path = path.to_owned());
        Ok(Studies { path: path.to_owned(), _unpacked: Some(folder), ..studies })
    }
}

impl Session<'_> {
    /// Opens the study of the manifest with its results.
    pub(super) fn compared(&self) -> Result<Studies, SessionError> {
        let reading = self.reading()?;
        let published = self.data().results_of(&reading.study.name);
        let record = Record::new(&reading.study, &reading.plan, &[]);
        let study = ComparedStudy {
            path: self.manifest().to_owned(),
            settings: self.settings().to_vec(),
            name: reading.study.name.clone(),
            programs: programs(&published),
            stages: record.stages.iter().map(|stage| stage.name.clone()).collect(),
            record: Some(record),
            tables: StageTables::Manifest(Box::new(reading)),
        };
        let path = self.manifest().to_owned();
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
        let name = folder_name.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Some(ComparedStudy {
            path: path.to_owned(),
            settings: Vec::new(),
            name,
            programs: programs(folder),
            record,
            stages,
            tables: StageTables::Published(folder.to_owned()),
        })
    }

    /// Reads the table of a stage. Returns `None` if the stage has no results.
    ///
    /// # Errors
    /// Returns an error if a table is damaged.
    pub(crate) fn table(&self, stage: &str) -> Result<Option<StageTable>, SessionError> {
        match &self.tables {
            StageTables::Manifest(reading) => {
                let found = reading.plan.stages.iter().find(|planned| planned.name == stage);
                let planned = found.expect("the names of the stages come from the plan");
                let rows = reading.rows(planned)?;
                let (finished, tasks) = (rows.tasks.len(), planned.tasks.len());
                Ok(rows.table.map(|table| StageTable { table, finished, tasks }))
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
                Ok(Some(StageTable { table: source.table()?, finished, tasks }))
            }
        }
    }

    /// Returns whether the study is that of a manifest, and not of published tables.
    pub(crate) fn is_of_manifest(&self) -> bool {
        matches!(self.tables, StageTables::Manifest(_))
    }
}

/// Returns the versions of the program that published the tables in a folder. Tables that cannot be
/// read are skipped; reading their rows reports the error.
fn programs(folder: &Path) -> BTreeSet<String> {
    let opened = tables(folder).into_iter().filter_map(|path| TableSource::open(&path).ok());
    opened.filter_map(|(_, metadata)| metadata.get("version").map(str::to_owned)).collect()
}

/// Returns whether a file begins like a ZIP file.
pub(crate) fn is_zip(path: &Path) -> bool {
    begins_with(path, b"PK\x03\x04")
}

/// Unpacks the published tables of an archive and their owner files.
fn unpack_results(archive: &Path, folder: &Path) -> io::Result<()> {
    let mut archive = ZipArchive::new(File::open(archive)?)?;
    for index in 0..archive.len() {
        let file = archive.by_index(index)?;
        // The path is that of the archive, which may be crafted: it must stay inside the folder.
        let Some(path) = file.enclosed_name() else { continue };
        let is_table = path.extension().is_some_and(|ending| ending == "parquet");
        let is_owner = path.file_name().is_some_and(|name| name == owner::FILE);
        if !path.starts_with(Path::new("data").join(RESULTS)) || !(is_table || is_owner) {
            continue;
        }
        // Tables are compressed themselves: `asperity share` stores them as they are.
        let limit = MAX_RATIO * file.compressed_size() + (1 << 20);
        if file.size() > limit {
            let reason = format!(
                "`{}` takes {} in the archive and would take {} on disk",
                path.display(),
                ByteSize(file.compressed_size()).display().si(),
                ByteSize(file.size()).display().si()
            );
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        }
        let target = folder.join(path);
        if let Some(parent) = target.parent() {
            fs::create_dir_all(parent)?;
        }
        io::copy(&mut io::Read::take(file, limit), &mut File::create(target)?)?;
    }
    Ok(())
}
