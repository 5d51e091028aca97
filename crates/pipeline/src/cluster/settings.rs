//! Settings of cluster jobs: the table `[cluster]` of the [settings file](crate::settings_file).
//!
//! Options of the command line override its keys. No key in the store depends on these settings.

use bytesize::ByteSize;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::de::DeTable;

use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::list;
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::{Key, Section, Spanned, reader, table};

/// Maximum value of the settings `time_limit` and `per_element` in hours, about eleven years.
const MAX_HOURS: f64 = 1e5;
/// Maximum value of the setting `cores`.
const MAX_CORES: u32 = 1024;
/// Maximum value of the setting `at_most`.
const MAX_ELEMENTS: u32 = 1_000_000;
/// Maximum value of the setting `rounds`.
const MAX_ROUNDS: u32 = 100;

/// Declares the settings. For each setting, it defines the key of the file with documentation, type
/// and schema, the value with type and conversion, and the command-line argument.
///
/// `ClusterTable` has the keys of the file, and [`Settings`] the values from a file or from the
/// command line.
macro_rules! settings {
    ($($(#[$declared:meta])* $name:ident: $written:ty => $value:ty, $check:expr, {$($argument:tt)*};)*) => {
        #[derive(Debug, Default, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        struct ClusterTable {
            $($(#[$declared])* $name: Key<$written>,)*
        }

        // A doc comment here would appear in the help of the command.
        #[derive(Debug, Clone, Default, PartialEq, clap::Args)]
        #[command(next_help_heading = "Cluster settings (override `[cluster]` in asperity.toml)")]
        pub struct Settings {
            $(#[arg(long, $($argument)*)] pub $name: Option<$value>,)*
        }

        impl Settings {
            /// Returns these settings, with missing ones taken from `others`.
            pub fn or(self, others: Settings) -> Settings {
                Settings { $($name: self.$name.or(others.$name),)* }
            }
        }

        fn checked(section: &Section<ClusterTable>, problems: &mut Problems) -> Option<Settings> {
            let point = section.points.first()?;
            let (table, checks) = (&point.table, &mut Checks::new(section, point, problems));
            Some(Settings {
                $($name: table.$name.written().and_then(|key| $check(checks, stringify!($name), key)),)*
            })
        }
    };
}

settings! {
    /// Partition of the nodes; the default partition of the cluster when omitted.
    partition: String => String, word(name),
        { value_name = "NAME", value_parser = name, help = "Run on the nodes of this partition" };
    /// Account that is charged for the core-hours.
    account: String => String, word(name),
        { value_name = "NAME", value_parser = name, help = "Charge core-hours to this account" };
    /// Quality of service, if the cluster has several.
    qos: String => String, word(name),
        { value_name = "NAME", value_parser = name, help = "Request this quality of service" };
    /// Cores per array element, each of which works on one surface; 1 when omitted.
    #[schemars(range(min = 1, max = MAX_CORES))]
    cores: u32 => u32, number,
        { value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_CORES)),
          help = "Use this many cores per array element; each works on one surface" };
    /// Memory per array element, such as `"16GB"`; when omitted, enough for the largest task on
    /// each core.
    memory: String => ByteSize, word(size),
        { value_name = "SIZE", help = "Request this memory per array element, such as `16GB`" };
    /// Time limit of an array element in hours; twice the expected time when omitted.
    #[schemars(range(max = MAX_HOURS), extend("exclusiveMinimum" = 0))]
    time_limit: f64 => f64, hours,
        { value_name = "HOURS", value_parser = parsed_hours,
          help = "Set the time limit of an array element, in hours" };
    /// Target duration of an array element in hours; 1 when omitted.
    #[schemars(range(max = MAX_HOURS), extend("exclusiveMinimum" = 0))]
    per_element: f64 => f64, hours,
        { value_name = "HOURS", value_parser = parsed_hours,
          help = "Set the target duration of an array element, in hours" };
    /// Maximum number of array elements; the largest array that Slurm allows when omitted.
    #[schemars(range(min = 1, max = MAX_ELEMENTS))]
    at_most: u32 => u32, number,
        { value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_ELEMENTS)),
          help = "Set the maximum number of array elements" };
    /// Number of times that missing tasks are submitted again; 3 when omitted.
    #[schemars(range(min = 0, max = MAX_ROUNDS))]
    rounds: u32 => u32, number,
        { value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_ROUNDS)),
          help = "Set how many times missing tasks are submitted again" };
    /// Shell commands that run before asperity, such as `["module load rust"]`.
    #[schemars(transform = list)]
    before: Vec<Spanned<String>> => Vec<String>, words(line),
        { value_name = "LINE", value_parser = line,
          help = "Run a shell command before asperity; can be repeated" };
    /// Additional options of `sbatch`, such as `["--constraint=avx2"]`.
    #[schemars(transform = list)]
    directives: Vec<Spanned<String>> => Vec<String>, words(directive),
        { long = "directive", value_name = "OPTION", value_parser = directive,
          allow_hyphen_values = true,
          help = "Add an option of `sbatch`, such as `--directive=--constraint=avx2`; can be \
                  repeated" };
}

table!(ClusterTable);

/// Checks that a word can be passed to `sbatch` as a name.
fn name(word: &str) -> Result<String, String> {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-.,:@/+".contains(letter);
    if !word.is_empty() && word.chars().all(is_plain) {
        Ok(word.to_owned())
    } else {
        Err("must be a name without spaces or quotes".to_owned())
    }
}

/// Checks that a shell command is a single line.
fn line(line: &str) -> Result<String, String> {
    if line.chars().any(char::is_control) {
        Err("must be one line; write several lines as a list".to_owned())
    } else {
        Ok(line.to_owned())
    }
}

/// Checks that a text is one option of `sbatch`.
fn directive(option: &str) -> Result<String, String> {
    if !option.starts_with('-') {
        return Err("must be an option of `sbatch`, such as `--constraint=avx2`".to_owned());
    }
    line(option)
}

fn size(word: &str) -> Result<ByteSize, String> {
    word.parse().map_err(|_| "must be a size such as \"16GB\" or \"512MiB\"".to_owned())
}

fn parsed_hours(word: &str) -> Result<f64, String> {
    let hours = word.parse().ok().filter(|hours: &f64| *hours > 0.0 && *hours <= MAX_HOURS);
    hours.ok_or_else(|| format!("must be a number of hours above 0 and at most {MAX_HOURS}"))
}

/// Reads the table `[cluster]`. Returns `None` and reports problems if it is wrong.
pub(crate) fn read_table(
    table: DeTable<'_>,
    span: Span,
    problems: &mut Problems,
) -> Option<Settings> {
    let expected = ExpectedKeys::of_table("`[cluster]`");
    let section = reader::read::<ClusterTable>(table, span, &expected, problems);
    checked(&section, problems)
}

/// Function that converts a word to a value. Its error says what the word must be.
type Convert<T> = fn(&str) -> Result<T, String>;

fn hours(_: &mut Checks, _: &str, written: &Spanned<f64>) -> Option<f64> {
    Some(decimal::nearest(written.value))
}

fn number(_: &mut Checks, _: &str, written: &Spanned<u32>) -> Option<u32> {
    Some(written.value)
}

fn word<T>(convert: Convert<T>) -> impl Fn(&mut Checks, &str, &Spanned<String>) -> Option<T> {
    move |checks, name, written| {
        let refused = |must| {
            let message = format!("`{name}` is {:?}", written.value);
            checks.report(name, Problem::new(message, written.span.clone(), must));
        };
        convert(&written.value).map_err(refused).ok()
    }
}

type Words = Spanned<Vec<Spanned<String>>>;

fn words(convert: Convert<String>) -> impl Fn(&mut Checks, &str, &Words) -> Option<Vec<String>> {
    let word = word(convert);
    move |checks, name, words| words.value.iter().map(|item| word(checks, name, item)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings_file::{FILE, SettingsFile};

    fn refused(text: &str) -> String {
        SettingsFile::parse(text, FILE).unwrap_err().render(false)
    }

    fn parsed(text: &str) -> Settings {
        SettingsFile::parse(text, FILE).unwrap().cluster
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
        let settings = parsed(text);
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
        assert_eq!(parsed(""), Settings::default());
    }

    #[test]
    fn what_is_said_nearer_counts() {
        let near = parsed("[cluster]\npartition = \"short\"");
        let far = parsed("[cluster]\npartition = \"long\"\naccount = \"rough\"");
        let both = parsed("[cluster]\npartition = \"short\"\naccount = \"rough\"");
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
    fn a_time_is_no_physics_here() {
        let message = refused("[cluster]\ntime = 2");
        assert!(message.contains("did you mean `time_limit`?"), "{message}");
    }

    #[test]
    fn no_job_runs_for_longer_than_eleven_years() {
        for key in ["time_limit", "per_element"] {
            let of = |hours: &str| format!("[cluster]\n{key} = {hours}");
            assert!(SettingsFile::parse(&of("1e5"), FILE).is_ok());
            let message = refused(&of("1e12"));
            assert!(message.contains("at most 100000"), "{message}");
        }
    }
}
