//! The tables of a study as its manifest has them now, whatever has been published.

use std::collections::BTreeMap;

use super::Session;
use super::error::{SessionError, UnknownName};
use super::events::{Event, Notice};
use asperity_manifest::diagnostics::chain;
use asperity_manifest::names;
use asperity_pipeline::forecast::memory::Allowance;
use asperity_pipeline::plan::PlannedStage;
use asperity_pipeline::results::failures;
use asperity_pipeline::results::reading::Reading;
use asperity_stages::StageError;
use asperity_stages::aggregate::sql;
use asperity_stages::aggregate::sql::QueryError;
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// What there is of a study's tables, as it was when it was looked at.
#[derive(Debug)]
pub struct Tables<'a> {
    session: &'a Session<'a>,
    /// The study and what has been computed of it.
    pub reading: Reading,
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
        if name == names::FAILURES {
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
        let names = self.names().into_iter().chain([names::FAILURES]);
        let known: Vec<String> = names.map(str::to_owned).collect();
        for name in known.iter().filter(|name| named.contains(*name)) {
            tables.push((name.clone(), self.open(name)?));
        }
        let room = Allowance::of(None, 1).room();
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
