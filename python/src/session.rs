//! The class `Session` of the extension module.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use asperity::internal::{comparison_text, escaped, user_settings};
use asperity::session::{
    self, ChosenLoad, Coordinate, Map, MapKind, ReportOptions, RunOptions, RunReport, SessionError,
    Setting, Status, diff,
};
use asperity::study::Study;
use bytesize::ByteSize;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::conversion;
use crate::errors::{manifest_error, session_error, value_error};
use crate::interruption::watched;
use crate::progress::{Listener, Notices};
use crate::table::Table;

/// Manifest of a study with its data folder and settings.
#[pyclass(frozen, module = "asperity._asperity")]
pub struct Session {
    manifest: PathBuf,
    data: session::DataFolder,
    settings: Vec<Setting>,
}

/// Name of a study, names of its stages, number of tasks, true if that number can grow, and
/// warnings.
type Checked = (String, Vec<String>, usize, bool, Vec<String>);

/// Name of a stage, and name, type, role, unit and meaning of its columns.
type StageColumns = (Option<String>, Vec<[String; 5]>);

/// Means of two studies, and their comparison as text and as JSON.
type Compared = (Table, String, String);

/// Table with notices about it.
type TableRead = (Table, Notices);

/// Conditions on columns, as pairs of a name and a value.
type Conditions = Vec<(String, String)>;

/// Heights, sides, unit, whether the surface is periodic, and its rms slope.
type Heights<'py> = (Bound<'py, PyArray2<f64>>, [f64; 2], Option<String>, bool, f64);

impl Session {
    fn session(&self) -> session::Session<'static> {
        let session = session::Session::with_data(&self.manifest, self.data.clone());
        session.with_settings(self.settings.iter().cloned())
    }

    /// Calls a method of a session in another thread; on Ctrl-C, the thread is abandoned.
    fn call<T: Send + 'static>(
        &self,
        py: Python<'_>,
        method: impl FnOnce(&session::Session<'_>) -> Result<T, SessionError> + Send + 'static,
    ) -> PyResult<(T, Notices)> {
        self.call_until(py, None, |session, _| method(session))
    }

    /// Calls a method of a session in another thread, and `on_progress` periodically; Ctrl-C sets
    /// the flag that the method receives.
    fn call_until<T: Send + 'static>(
        &self,
        py: Python<'_>,
        on_progress: Option<&Bound<'_, PyAny>>,
        method: impl FnOnce(&session::Session<'_>, &AtomicBool) -> Result<T, SessionError>
        + Send
        + 'static,
    ) -> PyResult<(T, Notices)> {
        let session = self.session();
        let listener = Listener::default();
        let events = listener.clone();
        let stop: Arc<AtomicBool> = Arc::default();
        let stopped = stop.clone();
        let work = move || method(&session.observed_by(&listener), &stopped);
        let show = |_: Python<'_>| match (on_progress, events.advance()) {
            (Some(on_progress), Some(advance)) => on_progress.call1((advance,)).map(drop),
            _ => Ok(()),
        };
        let answer = watched(py, &stop, work, show)?;
        show(py)?;
        match answer {
            Ok(answer) => Ok((answer, events.take_notices())),
            Err(error) => Err(session_error(py, &error)),
        }
    }
}

#[pymethods]
impl Session {
    #[new]
    fn new(
        py: Python<'_>,
        manifest: PathBuf,
        data: PathBuf,
        settings: &Bound<'_, PyDict>,
    ) -> PyResult<Session> {
        let settings = conversion::keys(settings)?.into_iter().map(|(key, value)| {
            let setting = format!("{key}={value}").parse::<Setting>();
            setting.map_err(|error| value_error(py, format!("`set` with the key `{key}`: {error}")))
        });
        let data = session::DataFolder::new(data).with_settings(user_settings());
        Ok(Session { manifest, data, settings: settings.collect::<PyResult<_>>()? })
    }

    /// Validates the manifest and summarizes it.
    fn check(&self, py: Python<'_>) -> PyResult<Checked> {
        let answer = self.call(py, |session| {
            let study = session.study()?;
            let plan = session::Plan::new(&study);
            let stages = plan.stages.iter().map(|stage| stage.name.clone()).collect();
            let warnings = study.warnings().iter().map(plain).collect();
            Ok((plan.study, stages, plan.tasks.len(), study.grows(), warnings))
        });
        Ok(answer?.0)
    }

    /// Returns finished and missing tasks with reasons.
    fn status(&self, py: Python<'_>) -> PyResult<StudyStatus> {
        let (status, _) = self.call(py, |session| session.status())?;
        Ok(StudyStatus::new(&status))
    }

    /// Computes missing tasks and calls `on_progress` periodically.
    fn run(
        &self,
        py: Python<'_>,
        jobs: Option<usize>,
        memory: Option<&str>,
        replace: bool,
        on_progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<(Run, Notices)> {
        let parsed = memory.map(str::parse::<ByteSize>).transpose();
        let memory = parsed.map_err(|reason| value_error(py, format!("`memory`: {reason}")))?;
        let mut options = RunOptions::default();
        options.jobs = conversion::jobs(py, jobs)?;
        options.memory = memory;
        options.replace = replace;
        let (report, notices) =
            self.call_until(py, on_progress.as_ref(), move |session, stop| {
                session.run(&options, stop)
            })?;
        Ok((Run::new(&report), notices))
    }

    fn table(&self, py: Python<'_>, name: String) -> PyResult<TableRead> {
        let (table, notices) = self.call(py, move |session| session.table(&name))?;
        Ok((table.into(), notices))
    }

    fn sql(&self, py: Python<'_>, query: String) -> PyResult<TableRead> {
        let (table, notices) = self.call(py, move |session| session.sql(&query))?;
        Ok((table.into(), notices))
    }

    /// Returns the heights of the only surface that fulfils the conditions.
    fn heights<'py>(
        &self,
        py: Python<'py>,
        stage: String,
        conditions: Conditions,
    ) -> PyResult<(Heights<'py>, Notices)> {
        let (surface, notices) =
            self.call(py, move |session| session.surface(&stage, &coordinates(conditions)))?;
        let grid = surface.surface.grid();
        let heights = conversion::map(py, surface.surface.into_heights(), grid.nodes())?;
        let size = grid.cell().size();
        Ok(((heights, size, surface.unit, surface.is_periodic, surface.rms_slope), notices))
    }

    /// Returns a map of the only surface that fulfils the conditions, as arguments of `Map`.
    fn map<'py>(
        &self,
        py: Python<'py>,
        stage: String,
        conditions: Conditions,
        quantity: &str,
        load: Option<&str>,
    ) -> PyResult<(MapArguments<'py>, Notices)> {
        let kind = match quantity {
            "contact" => MapKind::Contact,
            "pressure" => MapKind::Pressures,
            "gap" => MapKind::Gap,
            _ => MapKind::Displacement,
        };
        let chosen = load.map(ChosenLoad::prescribed).transpose();
        let load = chosen.map_err(|error| value_error(py, error.to_string()))?;
        let (map, notices) = self.call_until(py, None, move |session, stop| {
            session.map(&stage, &coordinates(conditions), kind, load, stop)
        })?;
        Ok((MapArguments::new(py, map)?, notices))
    }

    fn failures(&self, py: Python<'_>) -> PyResult<Table> {
        let (table, _) = self.call(py, |session| session.failures())?;
        Ok(table.into())
    }

    /// Describes the columns of all stages or of one.
    fn columns(&self, py: Python<'_>, stage: Option<String>) -> PyResult<Vec<StageColumns>> {
        let (stages, _) = self.call(py, move |session| session.columns(stage.as_deref()))?;
        let described = stages.into_iter().map(|stage| {
            let columns = stage.columns.into_iter().map(|column| {
                let kind = column.kind.to_owned();
                [column.name, kind, column.role, column.unit, column.meaning]
            });
            (stage.stage, columns.collect())
        });
        Ok(described.collect())
    }

    /// Compares the study with another one. Returns all means as a table, and the text and the JSON
    /// of the command `diff`.
    fn diff(&self, py: Python<'_>, other: &Session) -> PyResult<(Compared, Notices)> {
        let other = other.session();
        self.call(py, move |session| {
            let comparison = session.diff(&other)?;
            let text = plain(comparison_text(&comparison, false));
            Ok((diff::table(&comparison).into(), text, comparison.json()))
        })
    }

    /// Returns the JSON of the command `errors`.
    fn errors(
        &self,
        py: Python<'_>,
        stage: Option<String>,
        column: Option<String>,
    ) -> PyResult<(String, Notices)> {
        self.call(py, move |session| {
            Ok(session.errors(stage.as_deref(), column.as_deref())?.json())
        })
    }

    /// Returns the JSON of the command `claims`.
    fn claims(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.call(py, |session| Ok(session.claims()?.json()))?.0)
    }

    /// Writes the report and returns the paths of the page and of the folder of figures.
    fn report(
        &self,
        py: Python<'_>,
        output: Option<PathBuf>,
        replace: bool,
    ) -> PyResult<(PathBuf, PathBuf)> {
        let mut options = ReportOptions::default();
        (options.output, options.replace) = (output, replace);
        let (report, _) = self.call(py, move |session| session.report(&options))?;
        Ok((report.page, report.figures))
    }
}

/// Converts tables to the text of a manifest.
#[pyfunction]
pub fn toml(py: Python<'_>, tables: &Bound<'_, PyDict>) -> PyResult<String> {
    let tables = conversion::keys(tables)?;
    ::toml::to_string(&tables).map_err(|error| value_error(py, error.to_string()))
}

/// Validates the text of a manifest and returns the name of the study; `folder` is the base of
/// relative paths of surface files.
#[pyfunction]
pub fn study_name(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<String> {
    let study = Study::parse(text, "manifest", &folder);
    study.map(|study| study.name).map_err(|errors| manifest_error(py, &errors))
}

fn coordinates(conditions: Conditions) -> Vec<Coordinate> {
    conditions.into_iter().map(|(column, value)| Coordinate::new(column, value)).collect()
}

/// Escapes control characters in a text.
fn plain(words: impl ToString) -> String {
    escaped(&words.to_string()).into_owned()
}

/// Finished and missing tasks of a study, converted to a dictionary.
#[derive(IntoPyObject)]
struct StudyStatus {
    study: String,
    stages: Vec<StageStatus>,
    core_hours: f64,
    memory: u64,
    warnings: Vec<String>,
}

#[derive(IntoPyObject)]
struct StageStatus {
    name: String,
    kind: &'static str,
    cached: usize,
    to_run: usize,
    core_hours: f64,
    /// Number of tasks, expected core-seconds, and causes.
    reasons: Vec<(usize, f64, Vec<String>)>,
}

impl StudyStatus {
    fn new(status: &Status) -> StudyStatus {
        let stages = status.stages().into_iter().map(|stage| {
            let reasons = stage.reasons.iter().map(|reason| {
                let causes = reason.phrases().into_iter().map(plain).collect();
                (reason.tasks, reason.seconds, causes)
            });
            StageStatus {
                name: stage.count.name.to_owned(),
                kind: stage.count.kind.name(),
                cached: stage.count.cached,
                to_run: stage.count.to_run,
                core_hours: stage.seconds / 3600.0,
                reasons: reasons.collect(),
            }
        });
        StudyStatus {
            study: status.plan.study.clone(),
            stages: stages.collect(),
            core_hours: status.total_seconds() / 3600.0,
            memory: status.least_memory().as_u64(),
            warnings: status.warnings.iter().map(plain).collect(),
        }
    }
}

/// Result of a run, converted to a dictionary.
#[derive(IntoPyObject)]
struct Run {
    study: String,
    stages: Vec<StageRun>,
    computed: usize,
    failed: usize,
    halted: bool,
    sampling: Vec<String>,
    failures: Option<PathBuf>,
}

#[derive(IntoPyObject)]
struct StageRun {
    name: String,
    kind: &'static str,
    tasks: usize,
    computed: usize,
    failed: usize,
    path: Option<PathBuf>,
}

impl Run {
    fn new(report: &RunReport) -> Run {
        let RunReport { sampled, outcome, .. } = report;
        let stages = report.stages().into_iter().enumerate().map(|(index, stage)| {
            let published = report.tables.as_ref().and_then(|tables| tables.get(index));
            StageRun {
                name: stage.before.name.to_owned(),
                kind: stage.before.kind.name(),
                tasks: stage.before.tasks.len(),
                computed: stage.computed,
                failed: stage.failed,
                path: published.map(|table| table.path.clone()),
            }
        });
        Run {
            study: sampled.plan.study.clone(),
            stages: stages.collect(),
            computed: outcome.computed.len(),
            failed: outcome.failed.len(),
            halted: outcome.halted,
            sampling: sampled.stages.iter().map(ToString::to_string).collect(),
            failures: report.failures.clone(),
        }
    }
}

/// Arguments of the class `Map`, converted to a dictionary.
#[derive(IntoPyObject)]
struct MapArguments<'py> {
    values: Bound<'py, PyAny>,
    size: (f64, f64),
    unit: Option<String>,
    length_unit: Option<String>,
    load: Option<f64>,
    load_unit: Option<String>,
}

impl<'py> MapArguments<'py> {
    fn new(py: Python<'py>, map: Map) -> PyResult<MapArguments<'py>> {
        let nodes = map.grid.nodes();
        let values = if map.kind.is_set() {
            let belongs: Vec<bool> = map.values.iter().map(|value| *value > 0.0).collect();
            conversion::map(py, belongs, nodes)?.into_any()
        } else {
            conversion::map(py, map.values, nodes)?.into_any()
        };
        Ok(MapArguments {
            values,
            size: map.grid.cell().size().into(),
            unit: map.unit,
            length_unit: map.length_unit,
            load: map.load,
            load_unit: map.load_unit,
        })
    }
}
