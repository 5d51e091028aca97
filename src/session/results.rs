//! What a study has found: its tables as its manifest has them now, whatever has been published,
//! the meaning of their columns, and the page of figures.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{DataFolder, Event, Notice, Session, SessionError, UnknownName, names};
use asperity_manifest::diagnostics::chain;
use asperity_manifest::names::FAILURES;
use asperity_pipeline::forecast::memory::MemoryLimit;
use asperity_pipeline::plan::PlannedStage;
use asperity_pipeline::results::StudyResults;
use asperity_pipeline::results::owner;
use asperity_pipeline::results::{self, exceeded_hardness, failures};
use asperity_pipeline::study::Study;
use asperity_report::{Subject, check_folder};
use asperity_stages::aggregate::sql::{self, QueryError};
use asperity_stages::{Kind, StageError, columns_of};
use asperity_tables::parquet::{Columns, Metadata};
use asperity_tables::store::files::{Existing, read_whole};

pub use asperity_pipeline::results::PublishedTable;
pub use asperity_report::{Bars, NotDrawn, Report};
pub use asperity_tables::column::Description;
pub use asperity_tables::source::TableSource;
pub use asperity_tables::table::Table;

/// What there is of a study's tables, as it was when it was looked at.
#[derive(Debug)]
pub struct Tables<'a> {
    session: &'a Session<'a>,
    /// The study and what has been computed of it.
    pub reading: StudyResults,
}

impl<'a> Tables<'a> {
    pub(super) fn of(session: &'a Session<'a>) -> Result<Tables<'a>, SessionError> {
        let reading = session.reading()?;
        Ok(Tables { session, reading })
    }

    /// A stage's table, by the stage's name, or that of failures. The observer hears how much of
    /// a stage is missing that is not complete.
    ///
    /// # Errors
    /// When there is no such stage, nothing of it is computed, or a table is damaged.
    pub fn table(&self, name: &str) -> Result<Table, SessionError> {
        Ok(self.open(name)?.table()?)
    }

    /// The same table, to be read as far as it is needed.
    ///
    /// # Errors
    /// When there is no such stage, nothing of it is computed, or a table is known to be damaged.
    pub fn open(&self, name: &str) -> Result<TableSource, SessionError> {
        let plan = &self.reading.plan;
        if name == FAILURES {
            return Ok(failures::read(&self.session.data().results(), &plan.study)?.into());
        }
        let names = self.names();
        let place = names.iter().position(|stage| *stage == name);
        let place = place.ok_or_else(|| UnknownName::stage(name, &names))?;
        self.read(&plan.stages[place])?.ok_or_else(|| SessionError::NotComputed {
            stage: name.to_owned(),
            manifest: self.session.manifest().to_owned(),
        })
    }

    /// The answer to a query in which every stage is a table, and so are the failures. Only columns
    /// that it names are read, of tables that it names.
    ///
    /// # Errors
    /// When it is no query, names what is not there, or a table cannot be had.
    pub fn sql(&self, query: &str) -> Result<Table, SessionError> {
        let named = sql::tables_of(query).map_err(refused)?;
        let mut tables = Vec::new();
        let names = self.names().into_iter().chain([FAILURES]);
        let known: Vec<String> = names.map(str::to_owned).collect();
        for name in known.iter().filter(|name| named.contains(*name)) {
            tables.push((name.clone(), self.open(name)?));
        }
        let room = MemoryLimit::new(None, 1).room();
        sql::ask(query, tables, &known, &BTreeMap::new(), room).map_err(|error| match error {
            StageError::Query(error) => refused(error),
            StageError::Store(error) => SessionError::Store(error),
            other => SessionError::Query(chain(&other)),
        })
    }

    /// The names of the study's stages, in the order of its plan.
    pub fn names(&self) -> Vec<&str> {
        let stages = self.reading.plan.stages.iter();
        stages.map(|stage| stage.name.as_str()).collect()
    }

    /// A stage's table; `None` if nothing of it is computed.
    fn read(&self, stage: &PlannedStage) -> Result<Option<TableSource>, SessionError> {
        let rows = self.reading.open(stage)?;
        let (finished, tasks) = (rows.tasks.len(), stage.tasks.len());
        if (1..tasks).contains(&finished) {
            self.session.tell(Event::Notice(Notice::Incomplete {
                stage: &stage.name,
                finished,
                tasks,
                manifest: self.session.manifest(),
            }));
        }
        Ok(rows.table)
    }
}

/// What is wrong with a query, and what it may name.
fn refused(error: QueryError) -> SessionError {
    match error {
        QueryError::Refused(reason) => SessionError::Query(reason),
        QueryError::Unknown { message, name, known } => {
            SessionError::Unknown(UnknownName { message, name, known })
        }
    }
}

/// The columns of a stage's table, or those that a kind of stage may have.
#[derive(Debug, Clone, Serialize)]
pub struct DescribedColumns {
    /// The stage, if they are those of a study.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    pub kind: Kind,
    pub columns: Vec<Description>,
}

impl DescribedColumns {
    /// All that any study may have, by kind of stage.
    pub fn of_kinds() -> Vec<DescribedColumns> {
        let of_kind = |kind| DescribedColumns {
            stage: None,
            kind,
            columns: Table::empty(&columns_of(kind)).descriptions(),
        };
        Kind::ALL.into_iter().map(of_kind).collect()
    }

    /// The stages of a study, or the one of this name.
    pub(super) fn of_study(
        study: &Study,
        wanted: Option<&str>,
    ) -> Result<Vec<DescribedColumns>, SessionError> {
        let tables = study.empty_tables()?;
        let stages = study.stages.iter().zip(tables);
        let mut described: Vec<_> = stages
            .map(|(stage, table)| DescribedColumns {
                stage: Some(stage.name.clone()),
                kind: stage.work.kind(),
                columns: results::with_own_columns(table).descriptions(),
            })
            .collect();
        if let Some(wanted) = wanted {
            let names: Vec<&str> = study.stages.iter().map(|stage| &*stage.name).collect();
            let place = names.iter().position(|name| *name == wanted);
            let place = place.ok_or_else(|| UnknownName::stage(wanted, &names))?;
            described = vec![described.swap_remove(place)];
        }
        Ok(described)
    }
}

/// What page shall be written, and where.
#[derive(Debug, Clone, Default)]
pub struct ReportOptions {
    /// The folder to write into; that of the study's tables when left out.
    pub output: Option<PathBuf>,
    /// Whether to replace a page that shows more, or files of another manifest or of other
    /// programs.
    pub replace: bool,
    pub bars: Bars,
}

/// Writes the page and the figures beside it.
pub(super) fn write_report(
    session: &Session,
    options: &ReportOptions,
) -> Result<Report, SessionError> {
    let reading = session.reading()?;
    if !options.replace && options.output.is_none() {
        let (study, plan) = (&reading.study, &reading.plan);
        owner::check(session.manifest(), study, plan, &reading.reader)?;
    }
    let existing = match options.replace {
        true => Existing::Replace,
        false => Existing::Keep,
    };
    if let Some(folder) = &options.output {
        check_folder(folder, &reading.plan.study, existing)?;
    }
    let manifest = fs::read_to_string(session.manifest()).map_err(SessionError::Text)?;
    let rows = reading.all()?;
    let mut warnings = reading.study.warnings();
    warnings.extend(exceeded_hardness::warnings(&reading.study, &reading.plan, |stage| {
        Ok::<_, SessionError>(rows[stage].table.clone())
    })?);
    let subject = Subject {
        plan: &reading.plan,
        rows: &rows,
        archive: &reading.reader,
        sources: &reading.study.sources,
        manifest: &manifest,
        warnings: &warnings,
    };
    let beside = || session.data().results_of(&reading.plan.study);
    let folder = options.output.clone().unwrap_or_else(beside);
    Ok(asperity_report::write(&subject, options.bars, &folder, existing)?)
}

/// A file of a table: that of a finished task, of a stage, or another.
#[derive(Debug)]
pub struct TableFile {
    pub path: PathBuf,
    pub table: Table,
    /// How it was made.
    pub metadata: Metadata,
}

impl TableFile {
    /// Reads a file by its path, or a finished task's by its key or the first digits of it.
    ///
    /// # Errors
    /// When there is none, several tasks are meant, or the file is damaged.
    pub fn read(what: &Path, data: &DataFolder) -> Result<TableFile, SessionError> {
        let path = match what.is_file() {
            true => what.to_owned(),
            false => data.open_read_only()?.path(names::finished(&what.to_string_lossy(), data)?),
        };
        let (table, metadata) = read_whole(&path, Columns::All)?;
        Ok(TableFile { path, table, metadata })
    }
}
