//! The stages of a study with finished tasks, and the units of their tables.

use std::path::PathBuf;

use crate::Subject;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::reader::ResultReader;
use asperity_stages::Kind;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::units::{TableUnits, pressure_unit};
use asperity_tables::table::Table;

/// A stage with at least one finished task.
#[derive(Debug)]
pub struct FinishedStage {
    pub name: String,
    pub kind: Kind,
    pub table: Table,
    /// Units of length and pressure of the table. The manifest names them where the table does not,
    /// as that of an `aggregate` stage.
    pub units: TableUnits,
    /// Path of the published table, or `None` if it does not contain exactly these rows.
    pub path: Option<PathBuf>,
}

pub struct FinishedStages<'a> {
    /// Stages in the order of the plan.
    pub stages: Vec<FinishedStage>,
    pub plan: &'a Plan,
    /// Reader of tables and maps.
    pub archive: &'a ResultReader,
    pub sources: &'a SurfaceFiles,
}

impl<'a> FinishedStages<'a> {
    /// Collects the finished stages of a study.
    pub fn new(subject: &Subject<'a>) -> FinishedStages<'a> {
        let all = subject.plan.stages.iter().zip(subject.rows).zip(units_of_stages(subject));
        let stages = all.filter_map(|((stage, rows), units)| {
            Some(FinishedStage {
                name: stage.name.clone(),
                kind: stage.kind,
                table: rows.table.clone()?,
                units,
                path: rows.is_published.then(|| rows.path.clone()),
            })
        });
        FinishedStages {
            stages: stages.collect(),
            plan: subject.plan,
            archive: subject.archive,
            sources: subject.sources,
        }
    }

    /// Returns the stages whose tables have all of these columns.
    pub fn with<'b>(&'b self, columns: &'b [&str]) -> impl Iterator<Item = &'b FinishedStage> {
        let has_all = |stage: &&FinishedStage| columns.iter().all(|column| stage.table.has(column));
        self.stages.iter().filter(has_all)
    }

    /// Returns the name of a stage of this kind, finished or not, for proposed lines.
    pub fn name_of(&self, kind: Kind) -> Option<&str> {
        let mut stages = self.plan.stages.iter();
        let found = stages.find(|stage| stage.kind == kind)?;
        Some(&found.name)
    }
}

/// Returns the units of the table of each stage. If the manifest names no unit of pressure, the
/// unit is the one that is assumed for the moduli of the stage or of the stages that it reads.
fn units_of_stages(subject: &Subject) -> Vec<TableUnits> {
    let mut units = subject.study.units();
    for (index, (stage, rows)) in subject.study.stages.iter().zip(subject.rows).enumerate() {
        if units[index].pressure.is_none() {
            let own = rows.table.as_ref().and_then(pressure_unit);
            let read = TableUnits::common(stage.inputs.iter().map(|&input| &units[input]));
            units[index].pressure = own.or(read.pressure);
        }
    }
    units
}
