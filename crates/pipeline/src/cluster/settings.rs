//! Where a study's elements run, and with what: the table `[cluster]` of `asperity.toml`.
//!
//! It is read beside the manifest and from the user's folder of configuration, and each key may be
//! given once more on the command line. No key of a table in the store depends on any of it.

use std::io;
use std::ops::Bound;
use std::path::Path;

use bytesize::ByteSize;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::de::{DeTable, DeValue};

use crate::manifest::report_syntax;
use asperity_manifest::diagnostics::{ManifestErrors, Problem, Problems, did_you_mean};
use asperity_manifest::written::advice::Wanted;
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Section, Written, reader, table};
use asperity_stages::surface_files::read_regular;

/// The name of the file.
pub const FILE: &str = "asperity.toml";

/// Bytes of the file: far more than anybody writes.
const LONGEST: u64 = 1 << 20;
/// Largest `time_limit` and `per_element` in hours: eleven years.
pub const MOST_HOURS: f64 = 1e5;
/// The largest `cores`.
const MOST_CORES: u32 = 1024;
/// The largest `at_most`.
const MOST_ELEMENTS: u32 = 1_000_000;
/// The largest `rounds`.
const MOST_ROUNDS: u32 = 100;

/// Where elements run, and with what.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct ClusterTable {
    /// Partition whose nodes compute; that of the cluster's choice when left out.
    partition: Key<String>,
    /// Account that pays for the core-hours.
    account: Key<String>,
    /// Quality of service, where the cluster has several.
    qos: Key<String>,
    /// Cores of an element, and surfaces that it works on at once; 1 when left out.
    cores: Key<i64>,
    /// Memory of an element, as in `"16GB"`; what the largest task takes on each core when left out.
    memory: Key<String>,
    /// Hours after which Slurm ends an element; twice what it is expected to take when left out.
    time_limit: Key<f64>,
    /// Hours that an element is to take; 1 when left out.
    per_element: Key<f64>,
    /// The most elements at once; as many as Slurm allows in an array when left out.
    at_most: Key<i64>,
    /// How often what is missing is submitted again; 3 when left out.
    rounds: Key<i64>,
    /// Lines of shell before the command, as in `["module load rust"]`.
    before: Key<Vec<Written<String>>>,
    /// More options of `sbatch`, as in `["--constraint=avx2"]`.
    directives: Key<Vec<Written<String>>>,
}

table!(ClusterTable, swept: [], lists: ["before", "directives"]);

/// Where elements run, and with what, as far as somebody has said.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// Partition whose nodes compute.
    pub partition: Option<String>,
    /// Account that pays.
    pub account: Option<String>,
    /// Quality of service.
    pub qos: Option<String>,
    /// Cores of an element.
    pub cores: Option<u32>,
    /// Memory of an element.
    pub memory: Option<ByteSize>,
    /// Hours after which Slurm ends an element.
    pub time_limit: Option<f64>,
    /// Hours that an element is to take.
    pub per_element: Option<f64>,
    /// The most elements at once.
    pub at_most: Option<u32>,
    /// How often what is missing is submitted again.
    pub rounds: Option<u32>,
    /// Lines of shell before the command.
    pub before: Option<Vec<String>>,
    /// More options of `sbatch`.
    pub directives: Option<Vec<String>>,
}

impl Settings {
    /// What the file says; none if there is no such file.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn read(path: &Path) -> Result<Option<Settings>, ManifestErrors> {
        let file = path.display().to_string();
        let unreadable = |why: String| {
            let mut problems = Problems::default();
            problems.push(Problem::without_place(format!("cannot read `{file}`: {why}")));
            problems.into_errors(&file, "")
        };
        let bytes = match read_regular(path, LONGEST) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            bytes => bytes.map_err(|error| unreadable(error.to_string()))?,
        };
        let text =
            String::from_utf8(bytes).map_err(|_| unreadable("it is not UTF-8".to_owned()))?;
        Settings::parse(&text, &file).map(Some)
    }

    /// What the text of a file says; `file` is what messages call it.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn parse(text: &str, file: &str) -> Result<Settings, ManifestErrors> {
        let mut problems = Problems::default();
        let settings = parse(text, &mut problems);
        match settings {
            Some(settings) if problems.is_empty() => Ok(settings),
            _ => Err(problems.into_errors(file, text)),
        }
    }

    /// These, and of others what these leave out.
    pub fn or(self, others: Settings) -> Settings {
        Settings {
            partition: self.partition.or(others.partition),
            account: self.account.or(others.account),
            qos: self.qos.or(others.qos),
            cores: self.cores.or(others.cores),
            memory: self.memory.or(others.memory),
            time_limit: self.time_limit.or(others.time_limit),
            per_element: self.per_element.or(others.per_element),
            at_most: self.at_most.or(others.at_most),
            rounds: self.rounds.or(others.rounds),
            before: self.before.or(others.before),
            directives: self.directives.or(others.directives),
        }
    }
}

/// A word that `sbatch` takes for a name.
///
/// # Errors
/// What is wrong with it.
pub fn name(word: &str) -> Result<String, String> {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-.,:@/+".contains(letter);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => Ok(word.to_owned()),
        false => Err("must be a name without spaces or quotes".to_owned()),
    }
}

/// One line of shell.
///
/// # Errors
/// What is wrong with it.
pub fn line(line: &str) -> Result<String, String> {
    match line.chars().any(char::is_control) {
        true => Err("must be one line; a list has several".to_owned()),
        false => Ok(line.to_owned()),
    }
}

/// One option of `sbatch`, but for those that asperity writes itself.
///
/// # Errors
/// What is wrong with it.
pub fn directive(option: &str) -> Result<String, String> {
    const OWN: [&str; 6] = ["array", "dependency", "job-name", "output", "parsable", "signal"];
    let option = line(option)?;
    if !option.starts_with('-') {
        return Err("must be an option of `sbatch`, as `--constraint=avx2` is one".to_owned());
    }
    let long = option.trim_start_matches('-').split(['=', ' ']).next();
    match long.filter(|name| OWN.contains(name)) {
        Some(name) => Err(format!("must not be `--{name}`, which asperity sets")),
        None => Ok(option),
    }
}

fn parse(text: &str, problems: &mut Problems) -> Option<Settings> {
    let (document, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        report_syntax(text, &errors, problems);
        return None;
    }
    let mut settings = Settings::default();
    for (key, value) in document.into_inner() {
        let (name, place) = (key.get_ref().to_string(), key.span());
        match value.into_inner() {
            DeValue::Table(table) if name == "cluster" => {
                let wanted = Wanted {
                    place: "`[cluster]`".to_owned(),
                    common: Vec::new(),
                    owner: Box::new(|_| None),
                };
                let section = reader::read::<ClusterTable>(table, place, &wanted, problems);
                settings = checked(&section, problems)?;
            }
            _ => {
                let label = match did_you_mean(&name, ["cluster"]) {
                    Some(_) => "did you mean `[cluster]`?",
                    None => "not part of this file",
                };
                let problem = Problem::new(format!("unknown `{name}`"), place, label);
                problems.push(problem.help(format!("`{FILE}` has one table, `[cluster]`")));
            }
        }
    }
    Some(settings)
}

fn checked(section: &Section<ClusterTable>, problems: &mut Problems) -> Option<Settings> {
    let point = section.points.first()?;
    let (table, checks) = (&point.table, &mut Checks::of(section, point, problems));
    Some(Settings {
        partition: word(checks, "partition", &table.partition, name),
        account: word(checks, "account", &table.account, name),
        qos: word(checks, "qos", &table.qos, name),
        cores: whole(checks, "cores", &table.cores, 1, MOST_CORES),
        memory: word(checks, "memory", &table.memory, |size| {
            let size = size.parse::<ByteSize>();
            size.map_err(|_| "must be a size such as \"16GB\" or \"512MiB\"".to_owned())
        }),
        time_limit: hours(checks, "time_limit", &table.time_limit),
        per_element: hours(checks, "per_element", &table.per_element),
        at_most: whole(checks, "at_most", &table.at_most, 1, MOST_ELEMENTS),
        rounds: whole(checks, "rounds", &table.rounds, 0, MOST_ROUNDS),
        before: list(checks, "before", &table.before, line),
        directives: list(checks, "directives", &table.directives, directive),
    })
}

fn whole(checks: &mut Checks, name: &str, key: &Key<i64>, least: u32, most: u32) -> Option<u32> {
    checks.is_whole_in(name, key.written()?, &(least..=most))
}

fn hours(checks: &mut Checks, name: &str, key: &Key<f64>) -> Option<f64> {
    let bounds = (Bound::Excluded(0.0), Bound::Included(MOST_HOURS));
    checks.is_in(name, key.written()?, bounds)
}

type Judge<T> = fn(&str) -> Result<T, String>;

fn word<T>(checks: &mut Checks, name: &str, key: &Key<String>, judge: Judge<T>) -> Option<T> {
    judged(checks, name, key.written()?, judge)
}

fn list(
    checks: &mut Checks,
    name: &str,
    key: &Key<Vec<Written<String>>>,
    judge: Judge<String>,
) -> Option<Vec<String>> {
    let items = key.written()?.value.iter();
    items.map(|item| judged(checks, name, item, judge)).collect()
}

fn judged<T>(
    checks: &mut Checks,
    name: &str,
    written: &Written<String>,
    judge: Judge<T>,
) -> Option<T> {
    let judged = judge(&written.value);
    let refused = |must| {
        let message = format!("`{name}` is {:?}", written.value);
        checks.report(name, Problem::new(message, written.span.clone(), must));
    };
    judged.map_err(refused).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        Settings::parse(text, FILE).unwrap_err().render(false)
    }

    #[test]
    fn what_is_written_is_read() {
        let text = "
            [cluster]
            partition = \"short\"
            cores = 8
            memory = \"16GB\"
            time_limit = 2
            per_element = 0.5
            rounds = 0
            before = [\"module load rust\", \"ulimit -c 0\"]
            directives = \"--constraint=avx2\"
        ";
        let settings = Settings::parse(text, FILE).unwrap();
        let expected = Settings {
            partition: Some("short".to_owned()),
            cores: Some(8),
            memory: Some(ByteSize::gb(16)),
            time_limit: Some(2.0),
            per_element: Some(0.5),
            rounds: Some(0),
            before: Some(vec!["module load rust".to_owned(), "ulimit -c 0".to_owned()]),
            directives: Some(vec!["--constraint=avx2".to_owned()]),
            ..Settings::default()
        };
        assert_eq!(settings, expected);
        assert_eq!(Settings::parse("", FILE).unwrap(), Settings::default());
    }

    #[test]
    fn what_is_said_nearer_counts() {
        let of = |text| Settings::parse(text, FILE).unwrap();
        let near = of("[cluster]\npartition = \"short\"");
        let far = of("[cluster]\npartition = \"long\"\naccount = \"rough\"");
        let both = of("[cluster]\npartition = \"short\"\naccount = \"rough\"");
        assert_eq!(near.or(far), both);
    }

    #[test]
    fn mistakes_are_shown_at_their_places() {
        insta::assert_snapshot!(refused(
            "[cluster]
partitoin = \"short\"
account = \"a b\"
cores = 0
memory = \"much\"
per_element = -1
before = [\"module load x\", \"a\\nb\"]
directives = [\"constraint=avx2\", \"--array=1-4\"]

[clustre]
"
        ));
    }

    #[test]
    fn a_file_that_is_no_toml_or_not_there_is_told_apart() {
        assert!(refused("[cluster").contains("not TOML"));
        assert_eq!(Settings::read(Path::new("/nowhere/asperity.toml")).unwrap(), None);
    }

    #[test]
    fn no_job_runs_for_longer_than_eleven_years() {
        for key in ["time_limit", "per_element"] {
            let of = |hours: &str| format!("[cluster]\n{key} = {hours}");
            assert!(Settings::parse(&of("1e5"), FILE).is_ok());
            let message = refused(&of("1e12"));
            assert!(message.contains("at most 100000"), "{message}");
        }
    }
}
