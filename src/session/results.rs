//! Results of a study: tables, descriptions of columns, and the HTML report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::output_files::begins_with;
use super::{
    DataFolder, Event, Notice, Observer, Session, SessionError, UnknownName, name_lookup,
    open_read_only,
};
use asperity_manifest::diagnostics::chain;
use asperity_manifest::names::FAILURES;
use asperity_pipeline::forecast::memory::MemoryLimit;
use asperity_pipeline::results::{self, StudyResults, failures, owner, warnings};
use asperity_pipeline::study::Study;
use asperity_report::{Subject, check_folder};
use asperity_stages::aggregate::sql;
use asperity_stages::error::QueryError;
use asperity_stages::units::TableUnits;
use asperity_stages::{Kind, StageError, columns_of};
use asperity_tables::parquet::{Columns, Metadata};
use asperity_tables::store::files::read_whole;
use asperity_tables::store::series::FileName;

pub use asperity_pipeline::results::PublishedTable;
pub use asperity_report::{Bars, NotDrawn, Reason, Report};
pub use asperity_tables::column::Description;
pub use asperity_tables::source::TableSource;
pub use asperity_tables::table::Table;

/// Tables of a study at the time of reading.
#[derive(Debug)]
pub struct Tables<'a> {
    pub(super) session: &'a Session<'a>,
    /// Existing results of the study.
    pub(crate) reading: StudyResults,
}

impl Tables<'_> {
    /// Reads the table of a stage, or the table of failures.
    ///
    /// If the stage is incomplete, the observer receives a notice.
    ///
    /// # Errors
    /// Returns an error if the stage does not exist or has no results, or if a table is damaged.
    pub fn table(&self, name: &str) -> Result<Table, SessionError> {
        Ok(self.open(name)?.table()?)
    }

    /// Opens the table of a stage, or the table of failures, for reading in parts.
    ///
    /// # Errors
    /// Returns an error if the stage does not exist or has no results, or if a table is known to be
    /// damaged.
    pub(crate) fn open(&self, name: &str) -> Result<TableSource, SessionError> {
        let plan = &self.reading.plan;
        if name == FAILURES {
            return Ok(failures::read(&self.session.data().results(), &plan.study)?.into());
        }
        let stage = &plan.stages[name_lookup::stage(name, &self.names())?];
        let rows = self.reading.open(stage)?;
        let (finished, tasks) = (rows.tasks.len(), stage.tasks.len());
        let manifest = self.session.manifest();
        if (1..tasks).contains(&finished) {
            let notice = Notice::Incomplete { stage: name, finished, tasks, manifest };
            self.session.notify(Event::Notice(notice));
        }
        let (name, manifest) = (name.to_owned(), manifest.to_owned());
        rows.table.ok_or(SessionError::NotComputed { name, manifest })
    }

    /// Runs an SQL query in which every stage and `failures` are tables. Also returns the units of
    /// length and pressure that these tables share, which the columns of the answer name.
    ///
    /// Only the tables and columns of the query are read.
    ///
    /// # Errors
    /// Returns an error if the query is invalid or contains unknown names, or if a table cannot be
    /// read.
    pub fn sql(&self, query: &str) -> Result<(Table, TableUnits), SessionError> {
        let named = asperity_queries::tables_of(query).map_err(refused)?;
        let mut tables = Vec::new();
        let names = self.names().into_iter().chain([FAILURES]);
        let known: Vec<String> = names.map(str::to_owned).collect();
        for name in known.iter().filter(|name| named.contains(*name)) {
            tables.push((name.clone(), self.open(name)?));
        }
        let room = MemoryLimit::new(None, 1).room();
        let answer = sql::ask(query, tables, &known, &BTreeMap::new(), room);
        let table = answer.map_err(|error| match error {
            StageError::Query(error) => refused(error),
            StageError::Store(error) => SessionError::Store(error),
            other => SessionError::Query(chain(&other)),
        })?;
        let units = self.units_of(|name| named.contains(name));
        Ok((table.with_named_units(|unit| units.name(unit)), units))
    }

    /// Returns the units of length and pressure of the table of a stage, as the manifest names
    /// them. The tables of `aggregate` stages do not name them.
    pub(crate) fn units(&self, stage: &str) -> TableUnits {
        self.units_of(|name| name == stage)
    }

    fn units_of(&self, is_read: impl Fn(&str) -> bool) -> TableUnits {
        let study = &self.reading.study;
        let units = study.units();
        let stages = study.stages.iter().zip(&units).filter(|(stage, _)| is_read(&stage.name));
        TableUnits::common(stages.map(|(_, units)| units))
    }

    /// Returns the names of the stages in the order of the plan.
    pub(crate) fn names(&self) -> Vec<&str> {
        let stages = self.reading.plan.stages.iter();
        stages.map(|stage| stage.name.as_str()).collect()
    }
}

fn refused(error: QueryError) -> SessionError {
    match error {
        QueryError::Refused(reason) => SessionError::Query(reason),
        QueryError::Unknown { message, name, known } => {
            SessionError::Unknown(UnknownName { message, name, known })
        }
    }
}

/// Columns of the table of a stage, or of all tables of a kind of stage.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct DescribedColumns {
    /// Name of the stage, or `None` for a kind of stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    pub kind: Kind,
    pub columns: Vec<Description>,
}

impl DescribedColumns {
    /// Returns the columns of every kind of stage.
    pub fn for_all_kinds() -> Vec<DescribedColumns> {
        let of_kind = |kind| DescribedColumns {
            stage: None,
            kind,
            columns: Table::empty(&columns_of(kind)).descriptions(),
        };
        Kind::ALL.into_iter().map(of_kind).collect()
    }

    /// Returns the columns of all stages of a study, or only of the stage `wanted`.
    pub(super) fn for_study(
        study: &Study,
        wanted: Option<&str>,
    ) -> Result<Vec<DescribedColumns>, SessionError> {
        let stages = study.stages.iter().zip(results::published_columns(study)?);
        let mut described: Vec<_> = stages
            .map(|(stage, columns)| DescribedColumns {
                stage: Some(stage.name.clone()),
                kind: stage.work.kind(),
                columns,
            })
            .collect();
        if let Some(wanted) = wanted {
            let names: Vec<&str> = study.stages.iter().map(|stage| &*stage.name).collect();
            described = vec![described.swap_remove(name_lookup::stage(wanted, &names)?)];
        }
        Ok(described)
    }
}

/// Options of the method [`Session::report`].
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct ReportOptions {
    /// Folder to write into (default: the folder of the study's tables).
    pub output: Option<PathBuf>,
    /// Overwrite a page that shows more or belongs to another manifest and, in `output`, edited
    /// files.
    pub replace: bool,
    /// Meaning of the error bars.
    pub bars: Bars,
}

/// Writes the page and its figures.
pub(super) fn write_report(
    session: &Session,
    options: &ReportOptions,
) -> Result<Report, SessionError> {
    let reading = session.reading()?;
    if !options.replace && options.output.is_none() {
        let folder = &session.data().results_of(&reading.study.name);
        let former = owner::check(session.manifest(), &reading.study, &reading.plan, folder)?;
        if let Some(manifest) = &former {
            session.notify(Event::Notice(Notice::FormerOwner { manifest, folder }));
        }
    }
    if let Some(folder) = &options.output {
        check_folder(folder, &reading.study, options.replace)?;
    }
    let rows = reading.all()?;
    if rows.iter().all(|stage| stage.tasks.is_empty()) {
        return Err(SessionError::NotComputed {
            name: reading.plan.study.clone(),
            manifest: session.manifest().to_owned(),
        });
    }
    let mut warnings = reading.study.warnings();
    warnings.extend(warnings::warnings(&reading.study, &reading.plan, |stage| {
        Ok::<_, SessionError>(rows[stage].table.clone())
    })?);
    let subject = Subject {
        study: &reading.study,
        plan: &reading.plan,
        rows: &rows,
        archive: &reading.reader,
        sources: &reading.study.sources,
        manifest: &reading.study.manifest.text,
        warnings: &warnings,
    };
    let default = || session.data().results_of(&reading.plan.study);
    let folder = options.output.clone().unwrap_or_else(default);
    Ok(asperity_report::write(&subject, options.bars, &folder, options.replace)?)
}

/// Reads a Parquet file of asperity by its path, or the table of a finished task by the first
/// digits of its key. Returns the path of the file with the table and the provenance. The observer
/// receives a notice about each listed store that cannot be used.
///
/// # Errors
/// Returns an error if no file and no task matches, if several tasks match, or if the file is
/// damaged.
pub(crate) fn read_file(
    what: &Path,
    data: &DataFolder,
    observer: &dyn Observer,
) -> Result<(PathBuf, Table, Metadata), SessionError> {
    let path = if what.is_file() {
        if !begins_with(what, b"PAR1") {
            let message = format!("`{}` is not a Parquet file", what.display());
            return Err(SessionError::refused(message));
        }
        what.to_owned()
    } else {
        let store = open_read_only(data, observer)?;
        let key = name_lookup::finished(&what.to_string_lossy(), &store, data)?;
        // Rows of a series may be in several files, of which the first is shown.
        let mut files = store.files_of(key)?;
        files.sort_by_key(|file| file.rows.as_ref().is_some_and(|rows| rows.part.is_some()));
        let whole = FileName { key, rows: None };
        store.locate(files.first().unwrap_or(&whole))
    };
    let (table, metadata) = read_whole(&path, Columns::All)?;
    Ok((path, table, metadata))
}
