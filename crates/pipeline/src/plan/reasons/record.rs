//! What a study was when it last ran: enough to say what an edit changed, and read for nothing else.
//!
//! One small file per study, beside the store: its stages, the points of their grids with defaults
//! filled in, and how much was finished. It grows with the grid, not with the tasks, and losing it
//! loses explanations only.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::plan::Plan;
use crate::study::Study;
use asperity_stages::{Kind, Recipe, Work};
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, write_whole};
use asperity_tables::store::key::Digest;
use asperity_tables::store::listing;
use asperity_tables::store::listing::{Found, What};

/// Files are not read beyond this: tens of thousands of points.
const LARGEST: u64 = 64 << 20;

/// A study as it was planned, and how far it came.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub stages: Vec<StageRecord>,
}

/// One stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageRecord {
    pub name: String,
    pub kind: Kind,
    /// The version of its numbers.
    pub version: u32,
    /// The names of the stages that it reads.
    pub reads: Vec<String>,
    pub points: Vec<PointRecord>,
    pub tasks: usize,
    /// How many of them were in the store.
    pub finished: usize,
}

/// One point of a stage's grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// Every parameter by name, as JSON, defaults filled in.
    pub fields: BTreeMap<String, String>,
    /// Surfaces that differ in nothing else; 1 for stages that make none.
    pub realizations: u32,
    /// Hash of what later stages see of the parameters.
    #[serde(rename = "essence")]
    pub identity: String,
}

impl Record {
    /// A study and its plan, of which some tasks are missing from the store.
    pub fn of(study: &Study, plan: &Plan, missing: &[usize]) -> Record {
        let mut is_missing = vec![false; plan.tasks.len()];
        missing.iter().for_each(|&task| is_missing[task] = true);
        let stages = study.stages.iter().zip(&plan.stages);
        let record = |(stage, planned): (&crate::study::Stage, &crate::plan::PlannedStage)| {
            let reads = stage.inputs.iter();
            let finished = planned.tasks.iter().filter(|&&task| !is_missing[task]);
            StageRecord {
                name: stage.name.clone(),
                kind: planned.kind,
                version: planned.kind.version(),
                reads: reads.map(|&input| study.stages[input].name.clone()).collect(),
                points: points(&stage.work),
                tasks: planned.tasks.len(),
                finished: finished.count(),
            }
        };
        Record { stages: stages.map(record).collect() }
    }

    /// The positions of the stages with these names.
    pub fn positions<'a>(&'a self, names: &'a [String]) -> impl Iterator<Item = usize> + 'a {
        let position = |name: &String| self.stages.iter().position(|stage| stage.name == *name);
        names.iter().filter_map(position)
    }

    /// Where a study's record is, or would be.
    pub fn path(folder: &Path, study: &str) -> PathBuf {
        folder.join(format!("{study}.json"))
    }

    /// The record of a study that ran before, if it can be read: nothing depends on it.
    pub fn read(folder: &Path, study: &str) -> Option<Record> {
        let bytes =
            asperity_stages::surface_files::read_regular(&Record::path(folder, study), LARGEST)
                .ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Every file that this program has put into the folder of records.
    pub fn files(folder: &Path) -> Result<Vec<Found>, StoreError> {
        listing::known(folder, |name| {
            let study = name.strip_suffix(".json")?.to_owned();
            Some(What::Record { study })
        })
    }

    /// What the file says.
    pub fn bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("a record is plain data")
    }

    /// Writes the record, unless it is there already.
    pub fn write(&self, folder: &Path, study: &str) -> Result<(), StoreError> {
        let path = Record::path(folder, study);
        let bytes = self.bytes();
        match fs::read(&path) {
            Ok(written) if written == bytes => Ok(()),
            _ => write_whole(&path, &bytes, Existing::Replace, folder),
        }
    }
}

impl StageRecord {
    /// The point and realization of every task, in the order of the stage's tasks.
    pub fn places(&self) -> Vec<Place> {
        if self.kind == Kind::Generate {
            let points = self.points.iter().enumerate();
            let places = points.flat_map(|(point, record)| {
                (0..record.realizations).map(move |realization| Place { point, realization })
            });
            return places.collect();
        }
        let tasks_of_point = (self.tasks / self.points.len().max(1)).max(1);
        let place = |task| Place { point: task / tasks_of_point, realization: 0 };
        (0..self.tasks).map(place).collect()
    }
}

/// Which task of a stage.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// The point of the stage's grid.
    pub point: usize,
    /// Which of its surfaces.
    pub realization: u32,
}

/// The points of a stage's grid, in order.
fn points(work: &Work) -> Vec<PointRecord> {
    match work {
        Work::Generate(surfaces) => surfaces
            .iter()
            .map(|surfaces| {
                let recipe = Recipe::Generate(surfaces.params.realization(0));
                PointRecord::of(&recipe, surfaces.realizations)
            })
            .collect(),
        Work::Evaluate(recipes) => recipes.iter().map(PointRecord::evaluating).collect(),
    }
}

impl PointRecord {
    /// Of a query nothing but its text is recorded: its tables are known from what the stage reads.
    fn evaluating(recipe: &Recipe) -> PointRecord {
        let Some(query) = recipe.query() else {
            return PointRecord::of(recipe, 1);
        };
        let text = Value::from(query).to_string();
        PointRecord {
            fields: BTreeMap::from([("sql".to_owned(), text)]),
            realizations: 1,
            identity: Digest::of(&query).to_string(),
        }
    }

    fn of(recipe: &Recipe, realizations: u32) -> PointRecord {
        let json = serde_json::to_value(recipe).expect("parameters are plain data");
        let mut fields = fields_of(json);
        // It tells surfaces of one point apart.
        fields.remove("realization");
        PointRecord { fields, realizations, identity: Digest::of(&recipe.identity()).to_string() }
    }
}

/// The names and values of an object; of the only object in it, if there is nothing else.
fn fields_of(json: Value) -> BTreeMap<String, String> {
    let Value::Object(object) = json else {
        return BTreeMap::new();
    };
    if object.len() == 1 && object.values().all(Value::is_object) {
        return object
            .into_iter()
            .map(|(_, inner)| inner)
            .map(fields_of)
            .next()
            .unwrap_or_default();
    }
    object.into_iter().map(|(name, value)| (name, value.to_string())).collect()
}
