//! Record of a study at its last run, used only to explain why tasks run.
//!
//! Each study has one small file beside the store. It lists the stages, their parameter points with
//! all defaults, and the number of finished tasks. Its size grows with the number of points, not
//! with the number of tasks. If the file is lost, only explanations are lost.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::plan::Plan;
use crate::plan::sources::{Sources, TasksFromStore};
use crate::study::Study;
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::surface::{Origin, Params};
use asperity_stages::version::PartVersion;
use asperity_stages::{Kind, Recipe, Work};
use asperity_tables::key::Digest;
use asperity_tables::store::files::write_if_changed;
use asperity_tables::store::listing::{FileKind, StoredFile};
use asperity_tables::store::regular::read_regular;
use asperity_tables::store::series::Part;
use asperity_tables::store::{StoreError, listing};

/// Maximum size in bytes of a record that is read, enough for tens of thousands of points.
const MAX_BYTES: u64 = 64 << 20;

/// Stages of a study with their parameter points and numbers of finished tasks.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Record {
    pub stages: Vec<StageRecord>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StageRecord {
    pub name: String,
    pub kind: Kind,
    /// Version of the stage's computation.
    pub version: u32,
    /// Names of the stages that this stage reads.
    pub reads: Vec<String>,
    pub points: Vec<PointRecord>,
    pub tasks: usize,
    /// Number of tasks whose tables were in the store.
    pub finished: usize,
    /// Read-only stores from which finished tasks were read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stores: Vec<TasksFromStore>,
}

/// Record of one parameter point of a stage.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PointRecord {
    /// Values of all parameters as JSON texts, by name, including defaults.
    pub fields: BTreeMap<String, String>,
    /// Number of surfaces at this point; 1 for stages that do not generate surfaces.
    pub realizations: u32,
    /// Hash of the parameters that later stages depend on.
    #[serde(rename = "essence")]
    pub identity: String,
    /// Versions of parts of the numbers, with their reasons. Only the record of the present study
    /// has them, and only if it is not read from a file.
    #[serde(skip)]
    pub versions: Vec<PartVersion>,
}

impl Record {
    /// Creates the record of a study; the tasks in `missing` have no table in the store.
    pub fn new(study: &Study, plan: &Plan, missing: &[usize]) -> Record {
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
                stores: Vec::new(),
            }
        };
        Record { stages: stages.map(record).collect() }
    }

    /// Records the read-only stores from which the stages of the plan were read.
    #[must_use]
    pub fn with_sources(mut self, plan: &Plan, sources: &Sources) -> Record {
        for (stage, planned) in self.stages.iter_mut().zip(&plan.stages) {
            stage.stores = sources.of_stage(planned);
        }
        self
    }

    /// Returns the path of a study's record, which need not exist.
    pub fn path(folder: &Path, study: &str) -> PathBuf {
        folder.join(format!("{study}.json"))
    }

    /// Reads the record of a study. Returns `None` if it cannot be read, because no result depends
    /// on it.
    pub fn read(folder: &Path, study: &str) -> Option<Record> {
        let bytes = read_regular(&Record::path(folder, study), MAX_BYTES).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Lists the files that this program has written to the folder of records.
    pub fn files(folder: &Path) -> Result<Vec<StoredFile>, StoreError> {
        listing::known(folder, |name| {
            let study = name.strip_suffix(".json")?.to_owned();
            Some(FileKind::Record { study })
        })
    }

    /// Returns the record as the bytes of its file.
    pub fn bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("a record is plain data")
    }

    /// Writes the record to its file, unless the file already has the same content.
    pub fn write(&self, folder: &Path, study: &str) -> Result<(), StoreError> {
        write_if_changed(&Record::path(folder, study), &self.bytes(), folder)
    }
}

/// Returns a record of each parameter point of a stage, in the order of its tasks.
fn points(work: &Work) -> Vec<PointRecord> {
    match work {
        Work::Generate(surfaces) => {
            let recipe = |point: &PlannedSurfaces| Recipe::Generate(point.params.realization(0));
            let record = |point| PointRecord::new(&recipe(point), point.realizations);
            surfaces.iter().map(record).collect()
        }
        Work::Evaluate(recipes) => recipes.iter().map(PointRecord::evaluating).collect(),
    }
}

impl PointRecord {
    /// Creates the record of a recipe that reads other stages.
    ///
    /// Of an SQL query, only the text and the version are recorded, because [`StageRecord::reads`]
    /// names the tables.
    fn evaluating(recipe: &Recipe) -> PointRecord {
        let Some(query) = recipe.query() else {
            return PointRecord::new(recipe, 1);
        };
        let versions = recipe.part_versions();
        let numbers = versions
            .iter()
            .map(|part| (part.parameter.to_owned(), part.version.number().to_string()));
        let text = Value::from(query).to_string();
        let fields = BTreeMap::from_iter(numbers.chain([("sql".to_owned(), text)]));
        let identity = Digest::from_params(&fields).to_string();
        PointRecord { fields, realizations: 1, identity, versions }
    }

    fn new(recipe: &Recipe, realizations: u32) -> PointRecord {
        let json = serde_json::to_value(recipe).expect("parameters are plain data");
        let mut fields = fields_of(json);
        // The realization distinguishes surfaces of the same point.
        fields.remove("realization");
        if let Recipe::Generate(Params { origin, .. }) = recipe {
            let recipes: &[&str] = match origin {
                Origin::Pair(_) | Origin::Yielded(_) => &["from", "against"],
                _ => &["height_distribution"],
            };
            fields = with_single_fields_of(recipes, fields);
        }
        PointRecord {
            fields,
            realizations,
            identity: Digest::from_params(&read_by_some_stage(recipe)).to_string(),
            versions: recipe.part_versions(),
        }
    }
}

/// Replaces each of these members, the recipes of other surfaces, by its own members: `against` by
/// `against hurst` and others.
fn with_single_fields_of(
    recipes: &[&str],
    mut fields: BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    for name in recipes {
        let recipe = fields.remove(*name).and_then(|json| serde_json::from_str(&json).ok());
        let all = recipe.map(fields_of).unwrap_or_default().into_iter();
        let members = all.filter(|(name, _)| name != "realization" && name != "heights");
        fields.extend(members.map(|(member, value)| (format!("{name} {member}"), value)));
    }
    fields
}

/// Returns the recipe without the parameters that no later stage reads. Parts of rows that some
/// later stages read remain, so that a change of them is a cause for these stages.
fn read_by_some_stage(recipe: &Recipe) -> Recipe {
    let source = recipe.source_part();
    let series = recipe.series(None).filter(|_| source.is_some());
    let values = series.map(|series| series.rows.values);
    let wanted = |part: &Part| Some(part) != source.as_ref();
    let restricted = values.and_then(|values| recipe.restricted(&values, &wanted));
    restricted.unwrap_or_else(|| recipe.identity().into_owned())
}

/// Returns the members of a JSON object, with values as JSON texts. If the only value is itself an
/// object, returns the members of that inner object.
fn fields_of(json: Value) -> BTreeMap<String, String> {
    let Value::Object(object) = json else {
        return BTreeMap::new();
    };
    if object.len() == 1 && object.values().all(Value::is_object) {
        return object.into_iter().next().map_or_else(BTreeMap::new, |(_, inner)| fields_of(inner));
    }
    object.into_iter().map(|(name, value)| (name, value.to_string())).collect()
}
