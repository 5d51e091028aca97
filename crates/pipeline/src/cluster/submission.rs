//! Batch scripts of a submission, and the record of all submissions of a study. Both are stored in
//! the cluster folder of the study.

use std::path::{Path, PathBuf};
use std::{fs, io};

use minijinja::syntax::SyntaxConfig;
use minijinja::{Environment, Value, context};
use serde::{Deserialize, Serialize};

use crate::cluster::settings::Settings;
use crate::cluster::sizing::Sizing;
use crate::cluster::slurm::Job;
use crate::manifest::setting::Setting;
use asperity_manifest::diagnostics::shell_word;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::write_whole;

/// Paths that are written into the batch scripts.
#[derive(Debug, Clone)]
pub struct ScriptPaths {
    /// Absolute path of the program, or a name to be found in `PATH`.
    pub program: PathBuf,
    /// Absolute path of the data folder.
    pub data: PathBuf,
    /// Absolute path of the manifest.
    pub manifest: PathBuf,
    /// Absolute path of the folder of scripts and receipts.
    pub folder: PathBuf,
}

/// Options that the scripts pass on to the commands.
#[derive(Debug, Clone, Default)]
pub struct ScriptOptions {
    /// True if the last job writes the HTML report.
    pub report: bool,
    /// True if the results of another manifest may be overwritten.
    pub replace: bool,
    /// Settings that override keys of the manifest.
    pub settings: Vec<Setting>,
}

/// Batch scripts of one submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scripts {
    /// Script of each array element.
    pub element: String,
    /// Script of the last job, which runs after all array elements.
    pub finish: String,
}

/// A text contains a control character and cannot be written into a script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} is {text:?}, which contains a control character: a batch script would take the text \
     after a line end for an option or a command; remove the control character"
)]
pub struct ControlCharacter {
    /// Name of the text, such as `partition`.
    pub what: &'static str,
    pub text: String,
}

impl Scripts {
    pub fn new(
        study: &str,
        sizing: &Sizing,
        settings: &Settings,
        paths: &ScriptPaths,
        options: ScriptOptions,
    ) -> Result<Scripts, ControlCharacter> {
        for (what, path) in [
            ("the program's path", &paths.program),
            ("the path of the data folder", &paths.data),
            ("the manifest's path", &paths.manifest),
            ("the path of the folder of scripts", &paths.folder),
        ] {
            let text = path.to_string_lossy();
            if text.contains(char::is_control) {
                return Err(ControlCharacter { what, text: text.into_owned() });
            }
        }
        let mebibytes = sizing.memory.0.div_ceil(1 << 20).max(1);
        let values = context! {
            study,
            elements => sizing.elements,
            array => sizing.array(),
            cores => sizing.cores,
            mebibytes,
            memory => format!("{mebibytes}MiB"),
            directives => directives(settings),
            before => settings.before.clone().unwrap_or_default(),
            program => shell_word(&paths.program),
            data => shell_word(&paths.data),
            path => shell_word(&paths.manifest),
            manifest => paths.manifest.display().to_string(),
            // Slurm replaces patterns such as `%j` by numbers.
            logs => shell_word(&paths.folder.join("logs")).replace('%', "%%"),
            report => options.report,
            replace => options.replace,
            // Options of the commands that override keys of the manifest.
            settings => options.settings.iter().map(Setting::option).collect::<String>(),
        };
        let script = |template: &str, minutes: u32| {
            // Minutes as Slurm writes them: `2:05:00`.
            let minutes = format!("{}:{:02}:00", minutes / 60, minutes % 60);
            let values = context! { minutes, ..values.clone() };
            let common = render(include_str!("script/common.sh"), values.clone());
            render(template, context! { common, ..values }) + "\n"
        };
        Ok(Scripts {
            element: script(include_str!("script/element.sh"), sizing.minutes),
            finish: script(include_str!("script/finish.sh"), sizing.minutes_after),
        })
    }
}

fn render(template: &str, values: Value) -> String {
    let mut templates = Environment::new();
    let syntax = SyntaxConfig::builder().trim_blocks(true).build();
    templates.set_syntax(syntax.expect("the usual signs"));
    let render = templates.render_str(template.trim_end(), values);
    render.expect("the template is valid, and its values are there")
}

fn directives(settings: &Settings) -> Vec<String> {
    let Settings { partition, account, qos, .. } = settings;
    let options = [("partition", partition), ("account", account), ("qos", qos)];
    let named = options
        .into_iter()
        .filter_map(|(option, name)| name.as_ref().map(|name| format!("--{option}={name}")));
    named.chain(settings.directives.iter().flatten().cloned()).collect()
}

/// Record of what has been submitted for a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submission {
    /// Number of parts into which the study's surfaces are split.
    pub elements: u32,
    pub cores: u32,
    /// Number of times that missing tasks may be submitted again.
    pub rounds: u32,
    /// Target duration of an array element, in hours.
    pub per_element: f64,
    /// Expected core-hours of the whole submission.
    pub core_hours: f64,
    /// Rounds of submission, the first one first.
    pub submitted: Vec<Round>,
}

/// A job array and the last job after it, submitted together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Round {
    /// The job array, or `None` if only tasks of the last job were missing.
    pub array: Option<Job>,
    pub elements: Vec<u32>,
    pub finish: Job,
}

impl Submission {
    /// Returns the path of the record in the cluster folder of a study.
    fn path(folder: &Path) -> PathBuf {
        folder.join("submission.json")
    }

    /// Returns the path of the script of the array elements in the cluster folder of a study.
    pub fn element_script(folder: &Path) -> PathBuf {
        folder.join("element.sh")
    }

    /// Returns the path of the script of the last job in the cluster folder of a study.
    pub fn finish_script(folder: &Path) -> PathBuf {
        folder.join("finish.sh")
    }

    /// Reads the record from the cluster folder of a study. Returns `None` if nothing has been
    /// submitted.
    pub fn read(folder: &Path) -> Result<Option<Submission>, StoreError> {
        let path = Submission::path(folder);
        let unreadable = |source| StoreError::reading(&path, source);
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            bytes => bytes.map_err(unreadable)?,
        };
        let submission = serde_json::from_slice(&bytes);
        submission.map(Some).map_err(|error| unreadable(error.into()))
    }

    /// Writes the record into the cluster folder of a study.
    pub fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let bytes = serde_json::to_vec_pretty(self).expect("it is plain data");
        write_whole(&Submission::path(folder), &bytes, folder)
    }

    pub fn jobs(&self) -> Vec<Job> {
        let rounds = self.submitted.iter();
        let jobs = rounds.flat_map(|round| [round.array, Some(round.finish)]);
        jobs.flatten().collect()
    }
}

/// Returns the name that an array element writes as
/// [`Receipt::job`](super::receipts::Receipt::job).
pub fn job_name(array: Job, element: u32) -> String {
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
        let paths = ScriptPaths {
            program: "/home/ada/bin/asperity".into(),
            data: format!("{folder}/data").into(),
            manifest: format!("{folder}/quarter.toml").into(),
            folder: format!("{folder}/data/cluster/quarter").into(),
        };
        let options = ScriptOptions { report: true, ..ScriptOptions::default() };
        Scripts::new("quarter", &sizing, &settings, &paths, options)
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
