//! A study in use.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use asperity::cli::terminal::escaped;
use asperity::session;
use asperity::session::{ReportOptions, RunOptions, RunReport, SessionError, Status};
use bytesize::ByteSize;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::claims;
use crate::conversion;
use crate::errors::{session_error, value_error};
use crate::interruption::{interruptible, watched};
use crate::progress::{Advance, Listener, Notices};
use crate::table::Table;

/// A manifest and a folder of data.
#[pyclass(frozen, module = "asperity._asperity")]
pub struct Session {
    manifest: PathBuf,
    data: PathBuf,
}

/// Name, stages, tasks, whether there may be more tasks, and warnings.
type Checked = (String, Vec<String>, usize, bool, Vec<String>);

/// A stage, and name, type, role, unit and meaning of its columns.
type StageColumns = (Option<String>, Vec<[String; 5]>);

/// A table, and what should be known of it.
type TableRead = (Table, Notices);

impl Session {
    /// Asks a session on a thread of its own, which Ctrl-C leaves behind.
    fn ask<T: Send + 'static>(
        &self,
        py: Python<'_>,
        question: impl FnOnce(&session::Session<'_>) -> Result<T, SessionError> + Send + 'static,
    ) -> PyResult<(T, Notices)> {
        let (manifest, data) = (self.manifest.clone(), self.data.clone());
        let listener = Listener::default();
        let heard = listener.clone();
        let answer = interruptible(py, move || {
            let session = session::Session::new(manifest, data);
            question(&session.observed_by(&listener))
        })?;
        match answer {
            Ok(answer) => Ok((answer, heard.notices())),
            Err(error) => Err(session_error(py, &error)),
        }
    }
}

#[pymethods]
impl Session {
    #[new]
    fn new(manifest: PathBuf, data: PathBuf) -> Session {
        Session { manifest, data }
    }

    /// What the manifest amounts to.
    fn check(&self, py: Python<'_>) -> PyResult<Checked> {
        let answer = self.ask(py, |session| {
            let study = session.study()?;
            let plan = asperity::plan::Plan::of(&study);
            let stages = plan.stages.iter().map(|stage| stage.name.clone()).collect();
            let warnings = study.warnings().iter().map(plain).collect();
            Ok((plan.study, stages, plan.tasks.len(), study.grows(), warnings))
        });
        Ok(answer?.0)
    }

    /// What the study has and what it would compute, with reasons.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (status, _) = self.ask(py, |session| session.status())?;
        status_dict(py, &status)
    }

    /// Computes what is missing; `tell` is called with how far it has come, again and again.
    fn run<'py>(
        &self,
        py: Python<'py>,
        jobs: Option<usize>,
        memory: Option<&str>,
        replace: bool,
        tell: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyDict>, Notices)> {
        let memory = memory.map(str::parse::<ByteSize>).transpose();
        let memory = memory.map_err(|reason| value_error(py, format!("`memory`: {reason}")))?;
        let options = RunOptions {
            jobs: conversion::jobs(py, jobs)?,
            memory,
            replace,
            ..RunOptions::default()
        };
        let (manifest, data) = (self.manifest.clone(), self.data.clone());
        let listener = Listener::default();
        let heard = listener.clone();
        let stop: Arc<AtomicBool> = Arc::default();
        let stopped = stop.clone();
        let work = move || {
            let session = session::Session::new(manifest, data);
            session.observed_by(&listener).run(&options, &stopped)
        };
        let report = watched(py, &stop, work, |py| match (&tell, heard.advance()) {
            (Some(tell), Some(advance)) => tell.call1((advance_dict(py, &advance)?,)).map(drop),
            _ => Ok(()),
        })?;
        let report = report.map_err(|error| session_error(py, &error))?;
        Ok((report_dict(py, &report)?, heard.notices()))
    }

    fn table(&self, py: Python<'_>, name: String) -> PyResult<TableRead> {
        let (table, notices) = self.ask(py, move |session| session.table(&name))?;
        Ok((table.into(), notices))
    }

    fn sql(&self, py: Python<'_>, query: String) -> PyResult<TableRead> {
        let (table, notices) = self.ask(py, move |session| session.sql(&query))?;
        Ok((table.into(), notices))
    }

    fn failures(&self, py: Python<'_>) -> PyResult<Table> {
        let (table, _) = self.ask(py, |session| session.failures())?;
        Ok(table.into())
    }

    /// The columns of all stages, or of one.
    fn columns(&self, py: Python<'_>, stage: Option<String>) -> PyResult<Vec<StageColumns>> {
        let (stages, _) = self.ask(py, move |session| session.columns(stage.as_deref()))?;
        let stages = stages.into_iter().map(|stage| {
            let columns = stage.columns.into_iter().map(|column| {
                let kind = column.kind.to_owned();
                [column.name, kind, column.role, column.unit, column.meaning]
            });
            (stage.stage, columns.collect())
        });
        Ok(stages.collect())
    }

    fn claims<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let (found, _) = self.ask(py, |session| session.claims())?;
        claims::all(py, &found)
    }

    /// Writes the report, and says where: page, folder of figures.
    fn report(
        &self,
        py: Python<'_>,
        output: Option<PathBuf>,
        replace: bool,
    ) -> PyResult<(PathBuf, PathBuf)> {
        let options = ReportOptions { output, replace, ..ReportOptions::default() };
        let (report, _) = self.ask(py, move |session| session.report(&options))?;
        Ok((report.page, report.figures))
    }
}

/// Words about a study, with control characters escaped.
fn plain(words: impl ToString) -> String {
    escaped(&words.to_string()).into_owned()
}

fn status_dict<'py>(py: Python<'py>, status: &Status) -> PyResult<Bound<'py, PyDict>> {
    let stages = PyList::empty(py);
    for stage in status.stages() {
        let name = &stage.count.stage.name;
        let reasons = stage.groups.iter().map(|group| {
            let causes = group.causes.iter().map(|cause| plain(status.told(cause, name)));
            (group.tasks.len(), status.seconds(group), causes.collect::<Vec<_>>())
        });
        let dict = PyDict::new(py);
        dict.set_item("name", name)?;
        dict.set_item("kind", stage.count.stage.kind.name())?;
        dict.set_item("cached", stage.count.cached)?;
        dict.set_item("to_run", stage.count.to_run)?;
        dict.set_item("core_hours", stage.seconds / 3600.0)?;
        dict.set_item("reasons", reasons.collect::<Vec<_>>())?;
        stages.append(dict)?;
    }
    let dict = PyDict::new(py);
    dict.set_item("study", &status.plan.study)?;
    dict.set_item("stages", stages)?;
    dict.set_item("core_hours", status.total_seconds() / 3600.0)?;
    dict.set_item("memory", status.least_memory().as_u64())?;
    let warnings = status.warnings.iter().map(plain);
    dict.set_item("warnings", warnings.collect::<Vec<_>>())?;
    Ok(dict)
}

fn advance_dict<'py>(py: Python<'py>, advance: &Advance) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("study", &advance.study)?;
    dict.set_item("doing", advance.doing)?;
    dict.set_item("tasks", advance.tasks)?;
    dict.set_item("tasks_done", advance.tasks_done)?;
    dict.set_item("cached", advance.cached)?;
    dict.set_item("share", advance.share)?;
    dict.set_item("seconds_left", advance.seconds_left)?;
    Ok(dict)
}

fn report_dict<'py>(py: Python<'py>, report: &RunReport) -> PyResult<Bound<'py, PyDict>> {
    let RunReport { sampled, outcome, .. } = report;
    let failed: Vec<usize> = outcome.failed.iter().map(|(task, _)| *task).collect();
    let stages = PyList::empty(py);
    for (place, stage) in sampled.plan.stages.iter().enumerate() {
        let among = |tasks: &[usize]| {
            let own = stage.tasks.iter();
            own.filter(|task| tasks.contains(task)).count()
        };
        let published = report.tables.as_ref().and_then(|tables| tables.get(place));
        let dict = PyDict::new(py);
        dict.set_item("name", &stage.name)?;
        dict.set_item("kind", stage.kind.name())?;
        dict.set_item("tasks", stage.tasks.len())?;
        dict.set_item("computed", among(&outcome.computed))?;
        dict.set_item("failed", among(&failed))?;
        dict.set_item("path", published.map(|table| table.path.clone()))?;
        stages.append(dict)?;
    }
    let dict = PyDict::new(py);
    dict.set_item("study", &sampled.plan.study)?;
    dict.set_item("stages", stages)?;
    dict.set_item("computed", outcome.computed.len())?;
    dict.set_item("failed", outcome.failed.len())?;
    dict.set_item("halted", outcome.halted)?;
    let sampling = sampled.stages.iter().map(ToString::to_string);
    dict.set_item("sampling", sampling.collect::<Vec<_>>())?;
    dict.set_item("failures", report.failures.clone())?;
    Ok(dict)
}
