//! What a study has finished: its stages' tables.

use std::path::PathBuf;

use super::Subject;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::archive::Archive;
use asperity_stages::Kind;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::table::Table;

/// A stage with at least one finished task.
#[derive(Debug)]
pub struct FinishedStage {
    /// Its name in the manifest.
    pub name: String,
    /// What it does.
    pub kind: Kind,
    /// Its rows.
    pub table: Table,
    /// Its file, if that holds just these rows.
    pub path: Option<PathBuf>,
}

/// Everything that figures are drawn from.
pub struct FinishedStages<'a> {
    /// The stages, in the order of the plan.
    pub stages: Vec<FinishedStage>,
    /// The tasks of the study.
    pub plan: &'a Plan,
    /// Their tables, and where the maps are.
    pub archive: &'a Archive,
    /// Where measured surfaces are.
    pub sources: &'a SurfaceFiles,
}

impl<'a> FinishedStages<'a> {
    /// What has been read of a study.
    pub fn of(subject: &Subject<'a>) -> FinishedStages<'a> {
        let stages = subject.plan.stages.iter().zip(subject.rows);
        let stages = stages.filter_map(|(stage, rows)| {
            Some(FinishedStage {
                name: stage.name.clone(),
                kind: stage.kind,
                table: rows.table.clone()?,
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

    /// The stages whose tables have all of these columns.
    pub fn with<'b>(&'b self, columns: &'b [&str]) -> impl Iterator<Item = &'b FinishedStage> {
        let has_all = |stage: &&FinishedStage| columns.iter().all(|column| stage.table.has(column));
        self.stages.iter().filter(has_all)
    }

    /// The name of a stage of a kind, finished or not, for advice on what to add.
    pub fn name_of(&self, kind: Kind) -> Option<&str> {
        let mut stages = self.plan.stages.iter();
        let found = stages.find(|stage| stage.kind == kind)?;
        Some(&found.name)
    }
}
