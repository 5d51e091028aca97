//! Where a page comes from: manifest, program, machine, keys, and how much of the study is done.

use std::collections::BTreeSet;

use serde::Serialize;

use super::Subject;
use super::tables::FinishedStages;
use asperity_pipeline::forecast;
use asperity_stages::columns::STOP;
use asperity_stages::solve::GIVEN_UP;

/// What a page says of its origin.
#[derive(Debug, Serialize)]
pub struct PageProvenance {
    /// The study's name.
    pub study: String,
    /// The program's version.
    pub version: &'static str,
    /// The machine that wrote the page.
    pub machine: String,
    /// How much of the study is done.
    pub completeness: String,
    /// Rows of solved loads.
    pub loads: usize,
    /// How many of them did not converge.
    pub unconverged: usize,
    /// What should be known of the study.
    pub warnings: Vec<String>,
    /// Every stage of the manifest.
    pub stages: Vec<StageOrigin>,
    /// The manifest's text.
    pub manifest: String,
}

/// A stage, and what its table is made of.
#[derive(Debug, Serialize)]
pub struct StageOrigin {
    name: String,
    kind: &'static str,
    version: u32,
    finished: usize,
    planned: usize,
    digest: String,
}

impl PageProvenance {
    /// Of the tables that a report is made of.
    pub fn of(finished: &FinishedStages, subject: &Subject) -> PageProvenance {
        let plan = subject.plan;
        let stages = plan.stages.iter().zip(subject.rows);
        let stages = stages.map(|(stage, rows)| StageOrigin {
            name: stage.name.clone(),
            kind: stage.kind.name(),
            version: stage.kind.version(),
            finished: rows.tasks.len(),
            planned: stage.tasks.len(),
            digest: match rows.table {
                Some(_) => rows.digest.clone(),
                None => "–".to_owned(),
            },
        });
        let (loads, unconverged) = converged(finished);
        PageProvenance {
            study: plan.study.clone(),
            version: env!("CARGO_PKG_VERSION"),
            machine: machine(),
            completeness: completeness(subject),
            loads,
            unconverged,
            warnings: subject.warnings.iter().map(ToString::to_string).collect(),
            stages: stages.collect(),
            manifest: subject.manifest.to_owned(),
        }
    }
}

fn completeness(subject: &Subject) -> String {
    let planned = subject.plan.tasks.len();
    let done: BTreeSet<usize> = subject.rows.iter().flat_map(|rows| rows.tasks.clone()).collect();
    let done = done.len();
    match done == planned {
        true => format!("complete: all {planned} tasks are done"),
        false => {
            format!("unfinished: {done} of {planned} tasks are done, all figures are of these")
        }
    }
}

/// Solved loads, and how many of them did not converge.
fn converged(finished: &FinishedStages) -> (usize, usize) {
    let solved = finished.with(&["pairs", STOP.name]);
    let stops = solved.filter_map(|stage| stage.table.texts(STOP.name).ok());
    stops.fold((0, 0), |(loads, unconverged), stops| {
        let given_up = stops.iter().filter(|stop| *stop == Some(GIVEN_UP)).count();
        (loads + stops.iter().len(), unconverged + given_up)
    })
}

/// Processor, cores and system, as far as the system tells.
fn machine() -> String {
    let model = forecast::processor();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let plural = if cores == 1 { "" } else { "s" };
    format!("{model}, {cores} core{plural}, {}", std::env::consts::OS)
}
