//! What goes into an archive of a study, and what the archive says of itself to people.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fs, io};

use serde_json::json;

use super::archive::{Archive, CHECKSUMS, Places, Source, is_archive};
use super::research_object::{self, Described, Role, Whole};
use super::{ShareError, ShareOptions};
use asperity_manifest::diagnostics::counted;
use asperity_manifest::names;
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::owner::{self, Owner};
use asperity_pipeline::results::{self, StudyResults};
use asperity_stages::Kind;
use asperity_tables::store::files::{Existing, verify_whole, write_with};
use asperity_tables::store::{self, StoreError};

/// What people are to read first.
const README: &str = "README.txt";
/// What computed the tables.
const VERSIONS: &str = "versions.json";
/// The folder of finished work.
const DATA: &str = "data";

/// A file that goes into an archive.
#[derive(Debug)]
struct File {
    source: Source,
    role: Role,
    about: String,
}

/// What goes into an archive of a study.
#[derive(Debug)]
pub struct Contents {
    study: String,
    about: String,
    places: Places,
    /// By their paths in the archive.
    files: BTreeMap<String, File>,
    /// How many stages have a table.
    pub tables: usize,
    /// How many tasks of the study have a table that goes along, and how many it has.
    pub stored: Option<(usize, usize)>,
    /// Stages of which not all tasks are finished: how many are, and how many there are.
    pub incomplete: Vec<(String, usize, usize)>,
}

impl Contents {
    /// Finds what is to be shared. All tables are read to their ends, and are as they were written.
    ///
    /// # Errors
    /// When a table is damaged, or not that of the study as it is, and when a file has no place.
    pub fn of(
        reading: &StudyResults,
        manifest: &Path,
        data: &DataFolder,
        options: &ShareOptions,
    ) -> Result<Contents, ShareError> {
        let sources = &reading.study.sources;
        let places = Places::of(manifest, sources.read_files())?;
        let mut contents = Contents {
            study: reading.plan.study.clone(),
            about: about(reading),
            places,
            files: BTreeMap::new(),
            tables: 0,
            stored: None,
            incomplete: Vec::new(),
        };
        contents.add_manifest(manifest)?;
        let finished = contents.add_results(reading, manifest, data)?;
        if options.store {
            contents.add_store(reading)?;
        }
        contents.add_records(reading, &finished)?;
        Ok(contents)
    }

    /// Checks that the archive replaces neither a file that goes into it nor a file of another
    /// kind.
    ///
    /// # Errors
    /// When it would.
    pub fn check_place(&self, path: &Path) -> Result<(), ShareError> {
        let Ok(place) = fs::canonicalize(path) else {
            return Ok(());
        };
        let path = path.to_owned();
        let is_place = |file: &File| match &file.source {
            Source::File(source) => fs::canonicalize(source).is_ok_and(|source| source == place),
            Source::Bytes(_) => false,
        };
        if self.files.values().any(is_place) {
            return Err(ShareError::Input { path });
        }
        if !is_archive(&path) {
            return Err(ShareError::OtherKind { path });
        }
        Ok(())
    }

    /// Writes the archive, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written, or a file not be read.
    pub fn write(self, path: &Path, options: &ShareOptions) -> Result<(), StoreError> {
        let folder = path.parent().filter(|folder| *folder != Path::new(""));
        let staging = folder.unwrap_or(Path::new("."));
        write_with(path, Existing::Replace, staging, |file| {
            let mut archive = Archive::new(file);
            for (place, file) in &self.files {
                archive.add(place, &file.source)?;
            }
            let metadata = self.metadata(options)?;
            archive.add(research_object::FILE, &Source::Bytes(metadata.into_bytes()))?;
            archive.finish().map(drop)
        })
    }

    fn metadata(&self, options: &ShareOptions) -> io::Result<String> {
        let files = self.files.iter().map(|(path, file)| {
            Ok(Described {
                path: path.clone(),
                size: file.source.size()?,
                role: file.role,
                about: file.about.clone(),
            })
        });
        let whole = Whole {
            study: &self.study,
            about: self.about.clone(),
            day: options.day,
            license: options.license.as_deref(),
            authors: &options.authors,
        };
        let files = files.collect::<io::Result<Vec<_>>>()?;
        Ok(research_object::metadata(&whole, &files))
    }

    fn add_manifest(&mut self, manifest: &Path) -> Result<(), ShareError> {
        let folder = manifest.parent().unwrap_or(Path::new(""));
        let files: Vec<_> = self.places.files.clone().into_iter().collect();
        for (named, place) in files {
            let source = Source::File(folder.join(named));
            self.add(place, source, Role::Input, "input that the manifest names")?;
        }
        let (place, source) = (self.places.manifest.clone(), Source::File(manifest.to_owned()));
        self.add(place, source, Role::Manifest, "manifest: what was asked for")
    }

    /// The tables of the stages; the tasks that have rows in them.
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
                return Err(ShareError::Outdated {
                    stage: stage.name.clone(),
                    manifest: manifest.to_owned(),
                });
            }
            let what = format!("table of the stage `{}`: {}", stage.name, does(stage.kind));
            self.add_table(&rows.path, &stage.name, &what)?;
            finished.extend(rows.tasks);
            self.tables += 1;
        }
        if self.tables == 0 {
            return Err(ShareError::Nothing {
                study: self.study.clone(),
                manifest: manifest.to_owned(),
            });
        }
        let failures = data.table(&self.study, names::FAILURES);
        if failures.is_file() {
            self.add_table(&failures, names::FAILURES, "what could not be computed, and why")?;
        }
        Ok(finished)
    }

    fn add_table(&mut self, path: &Path, name: &str, about: &str) -> Result<(), ShareError> {
        verify_whole(path)?;
        let place = results::path(Path::new("data/results"), &self.study, name);
        let place = place.to_string_lossy().into_owned();
        self.add(place, Source::File(path.to_owned()), Role::Table, about)
    }

    fn add_store(&mut self, reading: &StudyResults) -> Result<(), ShareError> {
        let store = reading.reader.store();
        let keys: BTreeSet<_> = reading.plan.keys().into_iter().collect();
        let all = keys.len();
        let mut there = 0;
        for key in keys {
            if !store.has(key) {
                continue;
            }
            store.verify(key)?;
            let place = store::path(Path::new("data/store"), key);
            let place = place.to_string_lossy().into_owned();
            let source = Source::File(store.path(key));
            self.add(place, source, Role::Other, "table of one task, with its maps")?;
            there += 1;
        }
        self.stored = Some((there, all));
        Ok(())
    }

    /// What says whose the tables are, what the study is, what computed it, and how to use all this.
    fn add_records(
        &mut self,
        reading: &StudyResults,
        finished: &BTreeSet<usize>,
    ) -> Result<(), ShareError> {
        let StudyResults { study, plan, .. } = reading;
        let owner = Owner::at(self.places.manifest_from(3), study, plan);
        let place = format!("{DATA}/results/{}/{}", self.study, owner::FILE);
        let what = "which manifest the tables are of";
        self.add(place, Source::Bytes(owner.bytes()), Role::Other, what)?;

        let missing = (0..plan.tasks.len()).filter(|task| !finished.contains(task));
        let record = Record::new(study, plan, &missing.collect::<Vec<_>>());
        let place = format!("{DATA}/plans/{}.json", self.study);
        let what = "plan: every stage with its parameters, defaults filled in";
        self.add(place, Source::Bytes(record.bytes()), Role::Other, what)?;

        let kinds: BTreeSet<Kind> = plan.stages.iter().map(|stage| stage.kind).collect();
        let versions = kinds.into_iter().map(|kind| (kind.name(), kind.version()));
        let versions: BTreeMap<&str, u32> = versions.collect();
        let versions = json!({ "asperity": env!("CARGO_PKG_VERSION"), "stages": versions });
        let versions = Source::Bytes(format!("{versions:#}\n").into_bytes());
        let what = "versions of the program and of the numbers of its stages";
        self.add(VERSIONS.to_owned(), versions, Role::Other, what)?;

        let readme = readme(&Facts {
            study: &self.study,
            about: &self.about,
            manifest: &self.places.manifest,
            stored: self.stored,
            incomplete: &self.incomplete,
        });
        let readme = Source::Bytes(readme.into_bytes());
        self.add(README.to_owned(), readme, Role::Other, "how to use the archive")
    }

    fn add(
        &mut self,
        place: String,
        source: Source,
        role: Role,
        about: &str,
    ) -> Result<(), ShareError> {
        let about = about.to_owned();
        let is_own = [CHECKSUMS, research_object::FILE].contains(&&*place);
        let file = File { source, role, about };
        match is_own || self.files.insert(place.clone(), file).is_some() {
            true => Err(ShareError::Clash { place }),
            false => Ok(()),
        }
    }
}

/// What its page for people is about.
struct Facts<'a> {
    study: &'a str,
    /// What the study is, in a sentence or two.
    about: &'a str,
    /// Where the manifest is in the archive.
    manifest: &'a str,
    /// How many tasks' tables go along, and how many tasks the study has; none without the store.
    stored: Option<(usize, usize)>,
    /// Stages of which not all tasks are finished: how many are, and how many there are.
    incomplete: &'a [(String, usize, usize)],
}

/// The page for people.
fn readme(facts: &Facts) -> String {
    let Facts { study, manifest, .. } = facts;
    let runs = match facts.stored {
        Some((there, all)) if there == all => {
            "has nothing to do: all tables of its tasks are in data/store/"
        }
        Some(_) => "computes what data/store/ lacks, to the same bytes",
        None => "computes all of it anew, to the same bytes",
    };
    let incomplete = facts.incomplete.iter().map(|(stage, some, all)| {
        let all = counted(*all, "task");
        format!("\nNot complete: of {stage}, {some} of {all} are computed.\n")
    });
    format!(
        "{study}: {about}\n\
         \n\
         data/results/{study}/*.parquet   a table for each stage; fields say unit and meaning\n\
         {manifest}   what was asked for\n\
         data/plans/{study}.json   the same, with all defaults, as JSON\n\
         {VERSIONS}   what computed it\n\
         {metadata}   what each file is (RO-Crate 1.1)\n\
         \n\
         Whether all is as it was: sha256sum --check {CHECKSUMS}\n\
         In this folder, with asperity {version}:\n\
         \n    asperity columns {manifest}          what the columns mean\
         \n    asperity table {manifest} STAGE      a table\
         \n    asperity run {manifest}              {runs}\n\
         {incomplete}",
        about = facts.about,
        metadata = research_object::FILE,
        version = env!("CARGO_PKG_VERSION"),
        incomplete = incomplete.collect::<String>(),
    )
}

/// `A statistical study of rough contact: 8 surfaces, 6 stages, 35 tasks.`
fn about(reading: &StudyResults) -> String {
    format!(
        "A statistical study of rough contact: {}, {}, {}. Surfaces are generated or measured, \
         pressed by an FFT boundary-element solver, measured, corrected, fitted and aggregated.",
        counted(reading.study.surfaces() as usize, "surface"),
        counted(reading.plan.stages.len(), "stage"),
        counted(reading.plan.tasks.len(), "task"),
    )
}

/// What the rows of a kind of stage are, in a phrase.
fn does(kind: Kind) -> &'static str {
    match kind {
        Kind::Generate => "surfaces and their spectral moments",
        Kind::Solve => "loads, gaps and energies",
        Kind::Measure => "what was measured of contacts or surfaces",
        Kind::Correct => "corrected contact areas",
        Kind::Fit => "parameters of fitted laws",
        Kind::Aggregate => "statistics over surfaces, or the answer to a query",
    }
}
