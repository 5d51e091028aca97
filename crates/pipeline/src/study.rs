//! Studies: manifests whose values have been checked.
//!
//! In a [`Study`], the cutoffs are in order and resolved by the mesh, loads ascend, each stage can
//! read its inputs, and surface files exist. Later code relies on these checks.

mod adhesion;
pub mod claims;
mod columns;
pub mod figures;
mod graph;
mod means;
mod measured_maps;
pub(crate) mod multilevel;
mod pairs;
mod summary;
#[cfg(test)]
mod tests;
mod units;
mod validate;
mod warnings;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::OnceLock;

use toml::de::{DeTable, DeValue};

use self::claims::ClaimSpec;
use self::figures::FigureSpec;
use crate::manifest::Manifest;
use crate::manifest::composition::{Composition, EffectiveManifest, study_name};
use crate::manifest::setting::Setting;
use asperity_manifest::diagnostics::Problems;
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::quantity;
use asperity_manifest::names;
use asperity_stages::StageError;
use asperity_stages::surface::Params;
use asperity_stages::surface_files::{RecordedFiles, SurfaceFiles};
use asperity_stages::units::TableUnits;
use asperity_tables::table::Table;

pub use means::MeansOfStage;
pub use measured_maps::MeasuredMaps;
pub use summary::StageSummary;
pub use warnings::Warning;
pub(crate) use warnings::improbable_contact;

pub use asperity_manifest::diagnostics::{ManifestErrors, Problem};
pub use asperity_stages::Work;
pub use asperity_stages::surface::planned::{Growth, KnownMean, Limit, Until};

/// A study whose manifest is valid. Two studies are equal if they compute the same, however their
/// manifests are written.
#[derive(Debug, Clone)]
pub struct Study {
    /// Name of the study and of its folder of results.
    pub name: String,
    /// Stages, each after the stages that it reads, otherwise in the order of the manifest. A stage
    /// with `against` follows a stage of its own with the pairs of surfaces that it presses.
    pub stages: Vec<Stage>,
    /// Figures that the manifest declares, in its order.
    pub figures: Vec<FigureSpec>,
    /// Claims of the files that the manifest names, in their order, then those of the manifest.
    pub claims: Vec<ClaimSpec>,
    pub sources: SurfaceFiles,
    /// Units of published tables, figures, maps and pages, where they differ from those in which
    /// surfaces are solved and stored.
    pub output_units: TableUnits,
    /// The manifest after the manifests that it extends and the settings were applied.
    pub manifest: EffectiveManifest,
}

/// Collection of the tables of all stages of a study, without rows. Each table is derived when it
/// is first requested.
#[derive(Debug)]
pub struct EmptyTables(Vec<OnceLock<Table>>);

impl EmptyTables {
    /// Creates the collection without deriving a table.
    pub fn new(study: &Study) -> EmptyTables {
        EmptyTables(study.stages.iter().map(|_| OnceLock::new()).collect())
    }

    /// Returns the table of the stage with index `stage`. It is derived from the tables of the
    /// inputs of that stage.
    ///
    /// # Errors
    /// Returns an error if an SQL query of the study cannot be evaluated.
    pub fn of(&self, study: &Study, stage: usize) -> Result<&Table, StageError> {
        if let Some(table) = self.0[stage].get() {
            return Ok(table);
        }
        let Stage { inputs, work, .. } = &study.stages[stage];
        let read = inputs
            .iter()
            .map(|&input| Ok((study.stages[input].name.clone(), self.of(study, input)?.clone())));
        let table = work.empty_table(&read.collect::<Result<Vec<_>, StageError>>()?)?;
        Ok(self.0[stage].get_or_init(|| table))
    }

    /// Returns the table of the stage with the name `stage`; see [`EmptyTables::of`].
    pub fn named(&self, study: &Study, stage: &str) -> Result<&Table, StageError> {
        self.of(study, study.index_of(stage))
    }
}

/// A stage of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name of the stage and of its file of results.
    pub name: String,
    /// Indices of the stages that this stage reads. They are smaller than the index of this stage.
    pub inputs: Vec<usize>,
    pub work: Work,
}

impl PartialEq for Study {
    fn eq(&self, other: &Study) -> bool {
        self.content() == other.content()
    }
}

impl Study {
    /// Returns what decides tables, figures and verdicts.
    fn content(&self) -> impl PartialEq + '_ {
        let Study { name, stages, figures, claims, sources, output_units, .. } = self;
        (name, stages, figures, claims, sources, output_units)
    }

    /// Reads a manifest, the manifests that it extends and the surface files that it names.
    /// `settings` override keys of the manifest.
    ///
    /// # Errors
    /// Returns all problems of the manifest, or the reason why it cannot be read.
    pub fn read(path: &Path, settings: &[Setting]) -> Result<Study, ManifestErrors> {
        let composition = Composition::read(path, settings)?;
        Study::validated(&composition, SurfaceFiles::new(folder(path)), folder(path))
    }

    /// Reads a manifest whose results exist. If a surface file cannot be read, the properties that
    /// the file had earlier are used; `recall` returns these by the name of the study.
    ///
    /// # Errors
    /// Returns the same errors as [`Study::read`], except for files that `recall` knows.
    pub fn read_recalling(
        path: &Path,
        settings: &[Setting],
        recall: impl FnOnce(&str) -> RecordedFiles,
    ) -> Result<Study, ManifestErrors> {
        let composition = Composition::read(path, settings)?;
        let sources = SurfaceFiles::new(folder(path));
        Study::validated(&composition, sources, folder(path)).or_else(|errors| {
            let document = composition.document(&mut Problems::default());
            let name = document.as_ref().and_then(|document| study_name(document));
            let Some(name) = name.filter(|name| names::is_plain(name)) else {
                return Err(errors);
            };
            let sources = SurfaceFiles::with_records(folder(path), recall(name));
            Study::validated(&composition, sources, folder(path))
        })
    }

    /// Returns the stage with the name `stage`, which must be one of the study.
    pub fn stage(&self, stage: &str) -> &Stage {
        &self.stages[self.index_of(stage)]
    }

    fn index_of(&self, stage: &str) -> usize {
        let index = self.stages.iter().position(|known| known.name == stage);
        index.expect("the stage is one of the study")
    }

    /// Returns the surfaces that a stage reads, by parameter point.
    fn surfaces_read_by(&self, stage: &Stage) -> impl Iterator<Item = &Params> {
        let works = stage.inputs.clone().into_iter().map(|input| &self.stages[input].work);
        works.flat_map(Work::surfaces).map(|surfaces| &surfaces.params)
    }

    /// Returns the number of surfaces that the stages generate or read. For a stage with adaptive
    /// sampling, it is the present number, which is `at_least` at the start.
    pub fn surfaces(&self) -> u64 {
        let ensembles = self.stages.iter().flat_map(|stage| stage.work.surfaces());
        ensembles.map(|ensemble| u64::from(ensemble.realizations)).sum()
    }

    /// Returns the keys of stages whose value is an expression in other keys or parameters. A key
    /// whose value is the name of a parameter has the values of this parameter.
    pub fn derived_keys(&self) -> BTreeSet<String> {
        let (document, _) = DeTable::parse_recoverable(&self.manifest.text);
        let stages = document.get_ref().get("stage").and_then(|stages| stages.get_ref().as_table());
        let tables = stages.into_iter().flat_map(|stages| stages.values());
        let keys = tables.filter_map(|stage| stage.get_ref().as_table()).flatten();
        let is_derived = |value: &DeValue<'_>| {
            let text = value.as_str().filter(|text| quantity::split(text).is_none());
            let expression = text.and_then(|text| Expression::parse(text).ok());
            expression.is_some_and(|expression| !matches!(expression, Expression::Column(_)))
        };
        let derived = keys.filter(|(_, value)| is_derived(value.get_ref()));
        derived.map(|(key, _)| key.get_ref().to_string()).collect()
    }

    /// Returns whether the number of surfaces of any stage is determined adaptively.
    pub fn grows(&self) -> bool {
        let mut ensembles = self.stages.iter().flat_map(|stage| stage.work.surfaces());
        ensembles.any(|ensemble| ensemble.growth.is_some())
    }

    /// Parses and validates the text of a manifest.
    ///
    /// `file` is the name of the manifest in messages. Paths of surface files and of extended
    /// manifests are relative to `folder`.
    ///
    /// # Errors
    /// Returns all problems of the manifest that can be found in one pass.
    pub fn parse(text: &str, file: &str, folder: &Path) -> Result<Study, ManifestErrors> {
        let composition = Composition::new(text.to_owned(), file, folder, None, &[])?;
        Study::validated(&composition, SurfaceFiles::new(folder), folder)
    }

    fn validated(
        composition: &Composition,
        sources: SurfaceFiles,
        folder: &Path,
    ) -> Result<Study, ManifestErrors> {
        let mut problems = Problems::default();
        let Some(document) = composition.document(&mut problems) else {
            return Err(composition.errors(problems));
        };
        let manifest = Manifest::read(document.clone(), composition.inherited(), &mut problems);
        match validate::validate(&manifest, sources, folder, &mut problems) {
            Err(errors) if problems.is_empty() => Err(*errors),
            Ok(Some(study)) if problems.is_empty() => Ok(Study {
                manifest: composition.effective(document, &manifest.unused_parameters),
                ..study
            }),
            _ => Err(composition.errors(problems)),
        }
    }
}

/// Returns the folder of a manifest.
fn folder(manifest: &Path) -> &Path {
    manifest.parent().unwrap_or(Path::new(""))
}
