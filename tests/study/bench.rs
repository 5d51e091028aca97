//! Temporary folders in which tests run studies and inspect the files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use asperity::tables::parquet;
use asperity::tables::parquet::Columns;
use asperity::tables::store::Store;
use asperity::tables::store::series::FileName;
use asperity::tables::store::users::Writer;
use asperity::tables::table::Table;
use serde_json::Value;
use tempfile::TempDir;

use crate::manifest::manifest;

/// Study of two spectra × two surfaces × four loads, small enough to run dozens of times.
pub static STUDY: LazyLock<String> = LazyLock::new(|| {
    manifest("small", "seed = 7")
        .generate(
            "surfaces",
            "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = [4, 8]; realizations = 2",
        )
        .solve("light", "loads = { to = 0.1, steps = 4 }")
        .measure("area", "")
        .correct("corrected", "correction = ['none', '2017']")
        .fit("law", "window = [0, 0.1]; to = 'area'; bootstrap = 20")
        .aggregate(
            "curves",
            "from = 'corrected'; over = ['area_corrected']; statistics = ['mean', 'sd']",
        )
        .text()
});

/// Returns a study with the claims of the paper.
pub fn with_claims(study: &str) -> String {
    study.replace("[study]\n", "[study]\nclaims = \"yastrebov-2015\"\n")
}

/// Temporary folder with a manifest and its data folder.
pub struct Bench {
    folder: TempDir,
}

impl Bench {
    pub fn new() -> Bench {
        let folder = tempfile::tempdir().expect("a temporary folder can be created");
        Bench { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn data(&self) -> PathBuf {
        self.path("data")
    }

    pub fn write(&self, manifest: &str) -> PathBuf {
        let path = self.path("study.toml");
        fs::write(&path, manifest).expect("the folder can be written");
        path
    }

    /// Returns the command `asperity` for the data folder of this bench.
    pub fn asperity(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_asperity"));
        command.args(arguments).env("ASPERITY_DATA", self.data()).env("NO_COLOR", "1");
        command
    }

    pub fn output(&self, arguments: &[&str]) -> Output {
        self.asperity(arguments).output().expect("the command starts")
    }

    /// Runs a manifest, which must succeed, and returns the counts of each stage.
    pub fn run(&self, manifest: &str) -> BTreeMap<String, Count> {
        self.run_with(manifest, &[])
    }

    pub fn run_with(&self, manifest: &str, options: &[&str]) -> BTreeMap<String, Count> {
        let path = self.write(manifest);
        let mut arguments = vec!["run", path.to_str().expect("plain path"), "--json"];
        arguments.extend(options);
        let output = self.output(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        counts(&output.stdout)
    }

    pub fn plan(&self, manifest: &str) -> BTreeMap<String, Count> {
        let path = self.write(manifest);
        let output = self.output(&["plan", path.to_str().expect("plain path"), "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        counts(&output.stdout)
    }

    /// Reads the published table of a stage.
    pub fn table(&self, study: &str, stage: &str) -> Table {
        let name = format!("data/results/{study}/{stage}.parquet");
        let file = File::open(self.path(&name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        parquet::decode(file, Columns::All).expect("a table of results").0
    }

    /// Reads everything that the store has under the key of the first task of a stage, with maps.
    pub fn with_maps(&self, study: &str, stage: &str) -> Table {
        let table = self.table(study, stage);
        let key = table.texts("task").expect("tables name their tasks");
        let key = key.value(0).parse().expect("the key of a task");
        let store = Store::open_read_only(&self.data().join("store")).expect("a store");
        store.read_with_provenance(key).expect("a finished task").0
    }

    /// Returns the path of the only file in the store whose name begins with the key of a task.
    pub fn file_of(&self, task: &str) -> PathBuf {
        let folder = self.data().join("store").join(&task[..2]);
        let files = fs::read_dir(&folder).expect("the task has a folder");
        let names = files.map(|file| file.expect("the folder can be listed").file_name());
        let mut own = names.filter(|name| name.to_string_lossy().starts_with(task));
        let name = own.next().expect("the task has a file");
        assert!(own.next().is_none(), "{task} has several files");
        folder.join(name)
    }

    /// Reads every file of the data folder, by its relative path, and all rows of a series
    /// together, by the key of the series: an interrupted task may have stored them in several
    /// files.
    pub fn content(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let root = self.data().join("store");
        let store = Store::open_read_only(&root).expect("a store");
        let merged = self.files().into_iter().map(|(path, bytes)| {
            let name = path.file_name().and_then(|name| name.to_str()?.parse::<FileName>().ok());
            match name.filter(|name| name.rows.is_some()) {
                None => (path, bytes),
                Some(name) => {
                    let (table, _) = store.read_with_provenance(name.key).expect("rows");
                    let path = path.with_file_name(name.key.to_string());
                    (path, parquet::encode(&table, &parquet::Metadata::default()))
                }
            }
        });
        merged.collect()
    }

    /// Reads the published tables of a study, by file name.
    pub fn published(&self, study: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        let folder = self.data().join("results").join(study);
        collect(&folder, &folder, &mut files);
        files.retain(|name, _| name.extension().is_some_and(|ending| ending == "parquet"));
        files
    }

    /// Reads every file of the data folder, by its relative path.
    pub fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        collect(&self.data(), &self.data(), &mut files);
        files
    }
}

/// Asserts that both sets of files are equal; the message names the differences.
#[track_caller]
pub fn assert_same_files(
    found: &BTreeMap<PathBuf, Vec<u8>>,
    expected: &BTreeMap<PathBuf, Vec<u8>>,
) {
    let names = found.keys().chain(expected.keys());
    let differing: BTreeSet<&PathBuf> =
        names.filter(|name| found.get(*name) != expected.get(*name)).collect();
    assert!(differing.is_empty(), "these files differ: {differing:?}");
}

/// Numbers of cached, missing, computed and failed tasks of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Count {
    pub cached: u64,
    pub to_run: u64,
    pub computed: u64,
    pub failed: u64,
}

/// Counts of a stage whose tasks were all cached.
pub fn is_idle(count: &Count) -> bool {
    count.to_run == 0 && count.computed == 0 && count.cached > 0
}

pub fn counts(json: &[u8]) -> BTreeMap<String, Count> {
    let json: Value = serde_json::from_slice(json).expect("the command prints JSON");
    let stages = json["stages"].as_array().expect("a list of stages");
    let number = |stage: &Value, name: &str| stage[name].as_u64().unwrap_or(0);
    stages
        .iter()
        .map(|stage| {
            let name = stage["name"].as_str().expect("a name").to_owned();
            let count = Count {
                cached: number(stage, "cached"),
                to_run: number(stage, "to_run"),
                computed: number(stage, "computed"),
                failed: number(stage, "failed"),
            };
            (name, count)
        })
        .collect()
}

/// Returns the name of an unfinished file of a process that has ended.
pub fn left_behind() -> String {
    let mut process = Command::new("true").spawn().expect("it starts");
    process.wait().expect("it ends");
    let writer = Writer { process: process.id(), ..Writer::own() };
    writer.prefix() + "aB3dEf"
}

/// Returns a study `name` of the periodic map in a file, with further `stages`.
pub fn study_of_map(name: &str, map: &str, stages: &str) -> String {
    manifest(name, "")
        .generate(
            "surface",
            &format!(
                "method = 'file'; path = '{map}'; side = 1.0; level = 'none'; periodic = true; \
                 {stages}"
            ),
        )
        .text()
}

/// Returns a number of a table, which is not null.
pub fn real(table: &Table, column: &str, row: usize) -> f64 {
    table.reals(column).unwrap().value(row)
}

/// Converts the output of a command to text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn collect(root: &Path, folder: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries {
        let path = entry.expect("the folder can be listed").path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).expect("below the root").to_owned();
            match fs::read(&path) {
                Ok(bytes) => drop(files.insert(name, bytes)),
                // A running study has renamed or deleted a temporary file meanwhile.
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => panic!("{}: {error}", path.display()),
            }
        }
    }
}
