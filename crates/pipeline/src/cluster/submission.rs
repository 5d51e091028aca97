//! The scripts of a submission, as a person would write them, and what has been submitted, as the
//! folder of a study keeps it.

use std::path::{Path, PathBuf};
use std::{fs, io};

use minijinja::Environment;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use serde::{Deserialize, Serialize};

use crate::cluster::settings::Settings;
use crate::cluster::sizing::Sizing;
use crate::cluster::slurm::Job;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, write_whole};

/// What scripts say besides sizes and settings.
#[derive(Debug, Clone)]
pub struct Places {
    /// The program, by an absolute path or a name for `PATH`.
    pub program: PathBuf,
    /// The folder of data; absolute.
    pub data: PathBuf,
    /// The manifest; absolute.
    pub manifest: PathBuf,
    /// The folder of scripts and receipts; absolute.
    pub folder: PathBuf,
}

/// What else the commands are told.
#[derive(Debug, Clone, Copy, Default)]
pub struct Extras {
    /// Whether the last job writes the page.
    pub report: bool,
    /// Whether another manifest's tables may be lost.
    pub replace: bool,
}

/// The scripts of one submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scripts {
    /// What each element of the array runs.
    pub element: String,
    /// What runs after all of them.
    pub finish: String,
}

/// A text has a control character and cannot be written into a script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} is {text:?}, which has a control character: in a batch script, the text after a line \
     end would be an option of `sbatch` or a command; use one without control characters"
)]
pub struct ControlCharacter {
    /// Which text it is.
    pub what: &'static str,
    pub text: String,
}

#[derive(Serialize)]
struct Values<'a> {
    /// What both scripts say.
    common: String,
    study: &'a str,
    elements: u32,
    array: String,
    cores: u32,
    mebibytes: u64,
    memory: String,
    minutes: String,
    directives: Vec<String>,
    before: &'a [String],
    program: String,
    data: String,
    path: String,
    manifest: String,
    logs: String,
    report: bool,
    replace: bool,
}

impl Scripts {
    /// Writes the scripts of a study.
    pub fn of(
        study: &str,
        sizing: &Sizing,
        settings: &Settings,
        places: &Places,
        extras: Extras,
    ) -> Result<Scripts, ControlCharacter> {
        check(settings, places)?;
        let mebibytes = sizing.memory.0.div_ceil(1 << 20).max(1);
        let mut values = Values {
            common: String::new(),
            study,
            elements: sizing.elements,
            array: sizing.array(),
            cores: sizing.cores,
            mebibytes,
            memory: format!("{mebibytes}MiB"),
            minutes: duration(sizing.minutes),
            directives: directives(settings),
            before: settings.before.as_deref().unwrap_or_default(),
            program: quoted(&places.program),
            data: quoted(&places.data),
            path: quoted(&places.manifest),
            manifest: places.manifest.display().to_string(),
            // A percent sign would stand for a number of Slurm's.
            logs: quoted(&places.folder.join("logs")).replace('%', "%%"),
            report: extras.report,
            replace: extras.replace,
        };
        values.common = rendered(include_str!("script/common.sh"), &values);
        let element = rendered(include_str!("script/element.sh"), &values) + "\n";
        values.minutes = duration(sizing.minutes_after);
        values.common = rendered(include_str!("script/common.sh"), &values);
        let finish = rendered(include_str!("script/finish.sh"), &values) + "\n";
        Ok(Scripts { element, finish })
    }
}

/// Checks every text that a script takes from outside.
fn check(settings: &Settings, places: &Places) -> Result<(), ControlCharacter> {
    let paths = [
        ("the program's path", &places.program),
        ("the path of the data folder", &places.data),
        ("the manifest's path", &places.manifest),
        ("the path of the folder of scripts", &places.folder),
    ];
    let paths = paths.map(|(what, path)| (what, path.to_string_lossy()));
    let words = [
        ("`partition`", settings.partition.as_slice()),
        ("`account`", settings.account.as_slice()),
        ("`qos`", settings.qos.as_slice()),
        ("`before`", settings.before.as_deref().unwrap_or_default()),
        ("`directives`", settings.directives.as_deref().unwrap_or_default()),
    ];
    let words = words.into_iter().flat_map(|(what, words)| {
        let words = words.iter();
        words.map(move |word| (what, word.as_str().into()))
    });
    let mut texts = paths.into_iter().chain(words);
    match texts.find(|(_, text)| text.contains(char::is_control)) {
        None => Ok(()),
        Some((what, text)) => Err(ControlCharacter { what, text: text.into_owned() }),
    }
}

fn rendered(template: &str, values: &Values) -> String {
    let mut templates = Environment::new();
    let syntax = SyntaxConfig::builder().trim_blocks(true).build();
    templates.set_syntax(syntax.expect("the usual signs"));
    let rendered = templates.render_str(template.trim_end(), Serde(values));
    rendered.expect("the template is valid, and its values are there")
}

fn directives(settings: &Settings) -> Vec<String> {
    let Settings { partition, account, qos, .. } = settings;
    let named = [("partition", partition), ("account", account), ("qos", qos)];
    let named = named.into_iter().filter_map(|(option, name)| {
        let name = name.as_ref()?;
        Some(format!("--{option}={name}"))
    });
    named.chain(settings.directives.iter().flatten().cloned()).collect()
}

/// Minutes as Slurm has them: `2:05:00`.
fn duration(minutes: u32) -> String {
    format!("{}:{:02}:00", minutes / 60, minutes % 60)
}

/// A path as one word of shell.
fn quoted(path: &Path) -> String {
    let path = path.to_string_lossy();
    let word = shlex::try_quote(&path).map(|word| word.into_owned());
    word.unwrap_or_else(|_| path.replace('\0', ""))
}

/// What has been submitted of a study, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submission {
    /// Parts that its surfaces are shared out into.
    pub elements: u32,
    pub cores: u32,
    /// How often what is missing may be submitted again.
    pub rounds: u32,
    /// Hours that an element was to take.
    pub per_element: f64,
    /// Core-hours that all was expected to take.
    pub core_hours: f64,
    /// What was submitted, the first time and again.
    pub submitted: Vec<Round>,
}

/// An array of elements, and the job after it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Round {
    /// The array; none where only what comes after the elements was left to do.
    pub array: Option<Job>,
    pub elements: Vec<u32>,
    /// The job that finishes.
    pub finish: Job,
}

impl Submission {
    /// Where it is kept.
    fn path(folder: &Path) -> PathBuf {
        folder.join("submission.json")
    }

    /// The script of its elements.
    pub fn element_script(folder: &Path) -> PathBuf {
        folder.join("element.sh")
    }

    /// The script of the job after them.
    pub fn finish_script(folder: &Path) -> PathBuf {
        folder.join("finish.sh")
    }

    /// What the folder of a study keeps; none if nothing has been submitted.
    pub fn read(folder: &Path) -> Result<Option<Submission>, StoreError> {
        let path = Submission::path(folder);
        let unreadable = |source| StoreError::Read { path: path.clone(), source };
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            bytes => bytes.map_err(unreadable)?,
        };
        let submission = serde_json::from_slice(&bytes);
        submission.map(Some).map_err(|error| unreadable(error.into()))
    }

    /// Keeps it in the folder of a study.
    pub fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let bytes = serde_json::to_vec_pretty(self).expect("it is plain data");
        write_whole(&Submission::path(folder), &bytes, Existing::Replace, folder)
    }

    /// All jobs that were submitted.
    pub fn jobs(&self) -> Vec<Job> {
        let rounds = self.submitted.iter();
        let jobs = rounds.flat_map(|round| [round.array, Some(round.finish)]);
        jobs.flatten().collect()
    }
}

/// What the receipt of an element names as its job.
pub fn name_of(array: Job, element: u32) -> String {
    format!("{array}_{element}")
}

#[cfg(test)]
mod tests {
    use bytesize::ByteSize;

    use super::*;

    fn scripts(folder: &str) -> Result<Scripts, ControlCharacter> {
        let sizing = Sizing {
            elements: 16,
            hours: (1..=16).map(|element| (element, 0.9)).collect(),
            core_hours: 57.6,
            core_hours_after: 0.1,
            cores: 4,
            memory: ByteSize::gib(4),
            minutes: 125,
            minutes_after: 140,
        };
        let settings = Settings {
            partition: Some("short".to_owned()),
            before: Some(vec!["module load rust".to_owned()]),
            directives: Some(vec!["--constraint=avx2".to_owned()]),
            ..Settings::default()
        };
        let places = Places {
            program: "/home/ada/bin/asperity".into(),
            data: format!("{folder}/data").into(),
            manifest: format!("{folder}/quarter.toml").into(),
            folder: format!("{folder}/data/cluster/quarter").into(),
        };
        let extras = Extras { report: true, replace: false };
        Scripts::of("quarter", &sizing, &settings, &places, extras)
    }

    #[test]
    fn scripts_are_short_and_say_what_they_do() {
        let Scripts { element, finish } = scripts("/scratch/ada").unwrap();
        assert!(element.lines().count() < 60 && finish.lines().count() < 60);
        insta::assert_snapshot!("element", element);
        insta::assert_snapshot!("finish", finish);
    }

    #[test]
    fn paths_are_one_word_each() {
        let element = scripts("/scratch/a da's 100%").unwrap().element;
        let manifest = "manifest=\"/scratch/a da's 100%/quarter.toml\"";
        assert!(element.contains(manifest), "{element}");
        assert!(element.contains("100%%/data/cluster/quarter/logs\"/%A_%a.txt"), "{element}");
        assert!(element.contains("logs\"/%A_%a.txt"), "{element}");
    }

    #[test]
    fn a_path_of_two_lines_is_refused() {
        let error = scripts("/scratch/ada\n#SBATCH --uid=0").unwrap_err();
        assert_eq!(error.what, "the path of the data folder");
        assert!(!error.to_string().contains('\n'), "{error}");
    }
}
