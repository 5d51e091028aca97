//! Contents of an archive of a study, including its README.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use serde_json::json;

use super::archive::{
    Archive, ArchivePaths, ArchivedFile, CHECKSUMS, FileRole, Source, is_archive,
};
use super::{ShareError, ShareOptions, research_object};
use asperity_manifest::diagnostics::{counted, shell_word};
use asperity_manifest::names;
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::manifest::composition::EffectiveManifest;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::owner::{self, Owner};
use asperity_pipeline::results::{self, StudyResults};
use asperity_pipeline::study::claims::own_files;
use asperity_stages::Kind;
use asperity_tables::store::files::{folder_of, verify_whole, write_with};
use asperity_tables::store::{self, StoreError};

const README: &str = "README.txt";
/// File with the versions of the program and its stages.
const VERSIONS: &str = "versions.json";
/// Name of the data folder.
const DATA: &str = "data";

/// Files of an archive of a study.
#[derive(Debug)]
pub(crate) struct Contents {
    study: String,
    about: String,
    paths: ArchivePaths,
    /// Files by their paths in the archive.
    files: BTreeMap<String, ArchivedFile>,
    /// Number of stages with a table.
    pub(crate) tables: usize,
    /// Numbers of included tables of tasks and of all tasks; `None` without the store.
    pub(crate) stored: Option<(usize, usize)>,
    /// Incomplete stages, with the numbers of finished and of all tasks.
    pub(crate) incomplete: Vec<(String, usize, usize)>,
}

impl Contents {
    /// Collects the files and verifies all tables.
    ///
    /// # Errors
    /// Returns an error if a table is damaged or out of date, or if a file cannot be added to the
    /// archive.
    pub(crate) fn collect(
        reading: &StudyResults,
        manifest: &Path,
        data: &DataFolder,
        options: &ShareOptions,
    ) -> Result<Contents, ShareError> {
        let sources = &reading.study.sources;
        let bases = &reading.study.manifest.bases;
        let claims = own_files(&reading.study.claims);
        let inputs = sources.read_files().iter().chain(bases).chain(&claims);
        let paths = ArchivePaths::new(manifest, inputs)?;
        let mut contents = Contents {
            study: reading.plan.study.clone(),
            about: about(reading),
            paths,
            files: BTreeMap::new(),
            tables: 0,
            stored: None,
            incomplete: Vec::new(),
        };
        contents.add_manifest(manifest, &reading.study.manifest)?;
        let finished = contents.add_results(reading, manifest, data)?;
        if options.store {
            contents.add_store(reading)?;
        }
        contents.add_records(reading, &finished)?;
        Ok(contents)
    }

    /// Checks that the archive can be written to `path`: an existing file there must be an archive,
    /// and must not be one of the files to be added.
    ///
    /// # Errors
    /// Returns an error if the archive would overwrite another file.
    pub(crate) fn check_output(&self, path: &Path) -> Result<(), ShareError> {
        let Ok(output) = fs::canonicalize(path) else { return Ok(()) };
        let is_output = |file: &ArchivedFile| match &file.source {
            Source::File(source) => fs::canonicalize(source).is_ok_and(|source| source == output),
            Source::Bytes(_) => false,
        };
        if self.files.values().any(is_output) {
            return Err(ShareError::Input { path: path.to_owned() });
        }
        if is_archive(path) { Ok(()) } else { Err(ShareError::OtherKind { path: path.to_owned() }) }
    }

    /// Writes the archive, which appears only when it is complete.
    ///
    /// # Errors
    /// Returns an error if the archive cannot be written or a file cannot be read.
    pub(crate) fn write(self, path: &Path, options: &ShareOptions) -> Result<(), StoreError> {
        write_with(path, folder_of(path), |file| {
            let mut archive = Archive::new(file);
            for (path, file) in &self.files {
                archive.add(path, &file.source)?;
            }
            let Contents { study, about, files, .. } = &self;
            let metadata = research_object::metadata(study, about, files, options)?;
            archive.add(research_object::FILE, &Source::Bytes(metadata.into_bytes()))?;
            archive.finish().map(drop)
        })
    }

    /// Adds the manifest, the manifests that it extends and the files of surfaces. If keys were set
    /// on the command line, the manifest in the archive is the effective one.
    fn add_manifest(
        &mut self,
        manifest: &Path,
        effective: &EffectiveManifest,
    ) -> Result<(), ShareError> {
        let folder = manifest.parent().unwrap_or(Path::new(""));
        let files: Vec<_> = self.paths.files.clone().into_iter().collect();
        for (named, path) in files {
            let is_base = effective.bases.contains(&named);
            let base = "manifest that the manifest of the study extends";
            let about = if is_base { base } else { "input file of the manifest" };
            self.add(path, Source::File(folder.join(named)), FileRole::Input, about)?;
        }
        let source = if effective.settings.is_empty() {
            Source::File(manifest.to_owned())
        } else {
            Source::Bytes(effective.text.clone().into_bytes())
        };
        let path = self.paths.manifest.clone();
        self.add(path, source, FileRole::Manifest, "manifest: definition of the study")
    }

    /// Adds the tables of the stages and returns the tasks that have rows in them.
    fn add_results(
        &mut self,
        reading: &StudyResults,
        manifest: &Path,
        data: &DataFolder,
    ) -> Result<BTreeSet<usize>, ShareError> {
        let mut finished = BTreeSet::new();
        for stage in &reading.plan.stages {
            let rows = reading.open(stage)?;
            if rows.tasks.len() < stage.tasks.len() {
                let (some, all) = (rows.tasks.len(), stage.tasks.len());
                self.incomplete.push((stage.name.clone(), some, all));
            }
            if rows.tasks.is_empty() {
                continue;
            }
            if !rows.is_published {
                let (stage, manifest) = (stage.name.clone(), manifest.to_owned());
                return Err(ShareError::Outdated { stage, manifest });
            }
            let what = format!("table of the stage `{}`: {}", stage.name, row_meaning(stage.kind));
            self.add_table(&rows.path, &stage.name, &what)?;
            finished.extend(rows.tasks);
            self.tables += 1;
        }
        if self.tables == 0 {
            let (study, manifest) = (self.study.clone(), manifest.to_owned());
            return Err(ShareError::Nothing { study, manifest });
        }
        let failures = data.table(&self.study, names::FAILURES);
        if failures.is_file() {
            self.add_table(&failures, names::FAILURES, "failed tasks and reasons")?;
        }
        Ok(finished)
    }

    fn add_table(&mut self, path: &Path, name: &str, about: &str) -> Result<(), ShareError> {
        verify_whole(path)?;
        let published = results::path(Path::new("data/results"), &self.study, name);
        let target = published.to_string_lossy().into_owned();
        self.add(target, Source::File(path.to_owned()), FileRole::Table, about)
    }

    fn add_store(&mut self, reading: &StudyResults) -> Result<(), ShareError> {
        let store = reading.reader.store();
        let tasks = &reading.plan.tasks;
        let (mut files, mut there) = (BTreeSet::new(), 0);
        for task in tasks.iter().filter(|task| store.has(&task.table)) {
            files.extend(store.verified_files(&task.table)?);
            there += 1;
        }
        for file in files {
            let source = store.locate(&file);
            let folder = store::path(Path::new("data/store"), file.key);
            let path = folder.with_file_name(file.to_string()).to_string_lossy().into_owned();
            let about = "table of one task, with its maps";
            self.add(path, Source::File(source), FileRole::Other, about)?;
        }
        self.stored = Some((there, tasks.len()));
        Ok(())
    }

    /// Adds the owner of the tables, the record of the study, the versions and the README.
    fn add_records(
        &mut self,
        reading: &StudyResults,
        finished: &BTreeSet<usize>,
    ) -> Result<(), ShareError> {
        let StudyResults { study, plan, .. } = reading;
        let owner = Owner::at(self.paths.manifest_from(3), study, plan);
        let missing = (0..plan.tasks.len()).filter(|task| !finished.contains(task));
        let record = Record::new(study, plan, &missing.collect::<Vec<_>>());
        let kinds: BTreeSet<Kind> = plan.stages.iter().map(|stage| stage.kind).collect();
        let versions: BTreeMap<&str, u32> =
            kinds.into_iter().map(|kind| (kind.name(), kind.version())).collect();
        let versions = json!({ "asperity": env!("CARGO_PKG_VERSION"), "stages": versions });
        let files = [
            (
                format!("{DATA}/results/{}/{}", self.study, owner::FILE),
                owner.bytes(),
                "path of the manifest that the tables belong to",
            ),
            (
                format!("{DATA}/plans/{}.json", self.study),
                record.bytes(),
                "plan: every stage with its parameters, including defaults",
            ),
            (
                VERSIONS.to_owned(),
                format!("{versions:#}\n").into_bytes(),
                "versions of the program and of its kinds of stage",
            ),
            (README.to_owned(), self.readme().into_bytes(), "how to use the archive"),
        ];
        for (path, bytes, about) in files {
            self.add(path, Source::Bytes(bytes), FileRole::Other, about)?;
        }
        Ok(())
    }

    fn add(
        &mut self,
        path: String,
        source: Source,
        role: FileRole,
        about: &str,
    ) -> Result<(), ShareError> {
        let is_own = [CHECKSUMS, research_object::FILE].contains(&&*path);
        let file = ArchivedFile { source, role, about: about.to_owned() };
        if is_own || self.files.insert(path.clone(), file).is_some() {
            return Err(ShareError::Clash { path });
        }
        Ok(())
    }

    /// Returns the text of `README.txt`.
    fn readme(&self) -> String {
        let manifest = &self.paths.manifest;
        let quoted = shell_word(Path::new(manifest));
        let runs = match self.stored {
            Some((there, all)) if there == all => {
                "has nothing to compute: data/store/ contains all tables"
            }
            Some(_) => "computes the tables missing in data/store/ (same bytes)",
            None => "computes everything again (same bytes)",
        };
        let incomplete = self.incomplete.iter().map(|(stage, some, all)| {
            let all = counted(*all, "task");
            format!("\nIncomplete: {some} of {all} of the stage {stage} are computed.\n")
        });
        format!(
            include_str!("readme.txt"),
            study = self.study,
            about = self.about,
            manifest = manifest,
            quoted = quoted,
            runs = runs,
            versions = VERSIONS,
            metadata = research_object::FILE,
            checksums = CHECKSUMS,
            program = env!("CARGO_PKG_VERSION"),
        ) + &incomplete.collect::<String>()
    }
}

/// Describes a study as in `A statistical study of rough contact: 8 surfaces, 6 stages, 35 tasks.`
fn about(reading: &StudyResults) -> String {
    format!(
        "A statistical study of rough contact: {}, {}, {}, made by asperity.",
        counted(reading.study.surfaces() as usize, "surface"),
        counted(reading.plan.stages.len(), "stage"),
        counted(reading.plan.tasks.len(), "task"),
    )
}

/// Describes the rows of a kind of stage.
fn row_meaning(kind: Kind) -> &'static str {
    match kind {
        Kind::Generate => "surfaces and their spectral moments",
        Kind::Solve => "loads, gaps and energies",
        Kind::Measure => "measured quantities of contacts or surfaces",
        Kind::Correct => "corrected contact areas",
        Kind::Fit => "parameters of fitted laws",
        Kind::Aggregate => "statistics over surfaces, or the result of a query",
    }
}
