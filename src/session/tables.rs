//! The tables of a study as its manifest has them now, whatever has been published.

use std::collections::BTreeMap;

use super::Session;
use super::error::{SessionError, UnknownName};
use super::events::{Event, Notice};
use crate::diagnostics::chain;
use crate::failures;
use crate::names;
use crate::plan::PlannedStage;
use crate::results::reading::Reading;
use crate::stages::StageError;
use crate::stages::aggregate::Sql;
use crate::stages::aggregate::sql::{self, QueryError};
use crate::store::table::Table;

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
        let plan = &self.reading.plan;
        if name == names::FAILURES {
            return Ok(failures::read(&self.session.data().results(), &plan.study)?);
        }
        let names = self.names();
        let place = names.iter().position(|stage| *stage == name);
        let place = place.ok_or_else(|| UnknownName::stage(name, &names))?;
        self.read(&plan.stages[place])?
            .ok_or_else(|| SessionError::NotComputed {
                stage: name.to_owned(),
                manifest: self.session.manifest().to_owned(),
            })
    }

    /// The answer to a query in which every stage is a table, and so are the failures. Only tables
    /// that it names are read.
    ///
    /// # Errors
    /// When it is no query, names what is not there, or a table cannot be had.
    pub fn sql(&self, query: &str) -> Result<Table, SessionError> {
        let named = sql::tables_of(query).map_err(refused)?;
        let mut tables = Vec::new();
        let mut known = Vec::new();
        for name in self.names().into_iter().chain([names::FAILURES]) {
            let is_read = named.contains(name);
            known.push((name.to_owned(), usize::from(is_read)));
            if is_read {
                tables.push(self.table(name)?);
            }
        }
        let sql = Sql {
            query: query.to_owned(),
            tables: known,
            columns: BTreeMap::new(),
        };
        sql::query(&tables, &sql).map_err(|error| match error {
            StageError::Query(error) => refused(error),
            other => SessionError::Query(chain(&other)),
        })
    }

    /// The names of the study's stages, in the order of its plan.
    pub fn names(&self) -> Vec<&str> {
        let stages = self.reading.plan.stages.iter();
        stages.map(|stage| stage.name.as_str()).collect()
    }

    /// A stage's table; `None` if nothing of it is computed.
    fn read(&self, stage: &PlannedStage) -> Result<Option<Table>, SessionError> {
        let rows = self.reading.rows(stage)?;
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
        QueryError::Unknown {
            message,
            name,
            known,
        } => SessionError::Unknown(UnknownName {
            message,
            name,
            known,
        }),
    }
}
