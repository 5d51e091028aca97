//! Studies: manifests whose values have been checked.
//!
//! In a [`Study`], the cutoffs are in order and resolved by the mesh, loads ascend, each stage can
//! read its inputs, and surface files exist. Later code relies on these checks.

pub mod figures;
mod graph;
#[cfg(test)]
mod tests;
mod validate;
mod warnings;

use std::path::Path;
use std::sync::OnceLock;

use self::figures::FigureSpec;
use crate::manifest::Manifest;
use asperity_manifest::diagnostics::Problems;
use asperity_manifest::names;
use asperity_stages::StageError;
use asperity_stages::surface_files::{RecordedFiles, SurfaceFiles, read_regular};
use asperity_tables::table::Table;

pub use warnings::Warning;

pub use asperity_manifest::diagnostics::{ManifestErrors, Problem};
pub use asperity_stages::Work;
pub use asperity_stages::generate::growth::{Growth, KnownMean, Limit, Until};

/// Function that returns the names of all claims that a manifest can name in `until = "claims …"`.
///
/// The crate `claims` provides the function. [`no_claims`] can be used for manifests without such a
/// condition.
pub type ClaimNames = fn() -> Vec<&'static str>;

/// Returns an empty list, with which a manifest with a condition on claims is invalid.
pub fn no_claims() -> Vec<&'static str> {
    Vec::new()
}

/// Maximum size of a manifest in bytes.
const MAX_MANIFEST_BYTES: u64 = 4 << 20;

/// A study whose manifest is valid.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// Name of the study and of its folder of results.
    pub name: String,
    /// Stages, each after the stages that it reads, otherwise in the order of the manifest.
    pub stages: Vec<Stage>,
    /// Figures that the manifest declares, in its order.
    pub figures: Vec<FigureSpec>,
    pub sources: SurfaceFiles,
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
        let position = study.stages.iter().position(|known| known.name == stage);
        self.of(study, position.expect("the stage is one of the study"))
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

impl Study {
    /// Reads a manifest and the surface files that it names.
    ///
    /// # Errors
    /// Returns all problems of the manifest, or the reason why it cannot be read.
    pub fn read(path: &Path, claims: ClaimNames) -> Result<Study, ManifestErrors> {
        let file = path.display().to_string();
        Study::parse(&read_text(path)?, &file, folder(path), claims)
    }

    /// Reads a manifest whose results exist. If a surface file cannot be read, the properties that
    /// the file had earlier are used; `recall` returns these by the name of the study.
    ///
    /// # Errors
    /// Returns the same errors as [`Study::read`], except for files that `recall` knows.
    pub fn read_recalling(
        path: &Path,
        claims: ClaimNames,
        recall: impl FnOnce(&str) -> RecordedFiles,
    ) -> Result<Study, ManifestErrors> {
        let (text, file) = (read_text(path)?, path.display().to_string());
        Study::parse(&text, &file, folder(path), claims).or_else(|errors| {
            let manifest = Manifest::parse(&text, &mut Problems::default());
            let name = manifest.as_ref().and_then(Manifest::study_name);
            let Some(name) = name.filter(|name| names::is_plain(name)) else {
                return Err(errors);
            };
            let sources = SurfaceFiles::with_records(folder(path), recall(name));
            Study::validated(&text, &file, sources, claims)
        })
    }

    /// Returns the number of surfaces that the stages generate or read. For a stage with adaptive
    /// sampling, it is the present number, which is `at_least` at the start.
    pub fn surfaces(&self) -> u64 {
        let ensembles = self.stages.iter().flat_map(|stage| match &stage.work {
            Work::Generate(ensembles) => ensembles.as_slice(),
            Work::Evaluate(_) => &[],
        });
        let surfaces = ensembles.map(|ensemble| u64::from(ensemble.realizations));
        surfaces.sum()
    }

    /// Returns whether the number of surfaces of any stage is determined adaptively.
    pub fn grows(&self) -> bool {
        self.stages.iter().any(|stage| match &stage.work {
            Work::Generate(ensembles) => ensembles.iter().any(|ensemble| ensemble.growth.is_some()),
            _ => false,
        })
    }

    /// Returns a table without rows for each stage, with the names, types, units and meanings of
    /// the columns.
    ///
    /// # Errors
    /// Returns an error if an SQL query of the study cannot be evaluated.
    pub fn empty_tables(&self) -> Result<Vec<Table>, StageError> {
        let tables = EmptyTables::new(self);
        (0..self.stages.len()).map(|stage| tables.of(self, stage).cloned()).collect()
    }

    /// Parses and validates the text of a manifest.
    ///
    /// `file` is the name of the manifest in messages. Paths of surface files are relative to
    /// `folder`. `claims` returns the names of the claims that the manifest can name.
    ///
    /// # Errors
    /// Returns all problems of the manifest that can be found in one pass.
    pub fn parse(
        text: &str,
        file: &str,
        folder: &Path,
        claims: ClaimNames,
    ) -> Result<Study, ManifestErrors> {
        Study::validated(text, file, SurfaceFiles::new(folder), claims)
    }

    fn validated(
        text: &str,
        file: &str,
        sources: SurfaceFiles,
        claims: ClaimNames,
    ) -> Result<Study, ManifestErrors> {
        let mut problems = Problems::default();
        let study = Manifest::parse(text, &mut problems)
            .and_then(|manifest| validate::validate(&manifest, sources, claims, &mut problems));
        match study {
            Some(study) if problems.is_empty() => Ok(study),
            _ => Err(problems.into_errors(file, text)),
        }
    }
}

/// Returns the folder of a manifest.
fn folder(manifest: &Path) -> &Path {
    manifest.parent().unwrap_or(Path::new(""))
}

/// Reads the text of a manifest.
fn read_text(path: &Path) -> Result<String, ManifestErrors> {
    let file = path.display().to_string();
    let unreadable = |reason: String| {
        let mut problems = Problems::default();
        let problem = Problem::without_position(format!("cannot read manifest `{file}`: {reason}"));
        let with_ending = path.with_extension("toml");
        let meant = path.extension().is_none() && with_ending.is_file();
        problems.push(if meant {
            problem.help(format!("did you mean `{}`?", with_ending.display()))
        } else {
            problem
        });
        problems.into_errors(&file, "")
    };
    let bytes = read_regular(path, MAX_MANIFEST_BYTES);
    let bytes = bytes.map_err(|error| unreadable(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count();
        unreadable(format!("line {line} is not UTF-8"))
    })
}
