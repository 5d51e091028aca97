//! `asperity diff`: compare the parameters and results of two studies.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use super::terminal::{in_columns, stdout};
use super::{Failure, print_json, print_notice};
use crate::session::diff::columns::ColumnComparison;
use crate::session::diff::rows::{Lacking, UnmatchedRows};
use crate::session::diff::{
    self, Comparison, MeanComparison, Noise, StageComparison, StageSize, Studies, StudyComparison,
    StudyName, TableComparison, Test,
};
use crate::session::formatting::{counted, shell_word, short, significant, wrapped};
use crate::session::{DataFolder, Setting};

/// Maximum number of columns printed per stage without `--all`.
const MAX_COLUMNS: usize = 8;
/// Maximum number of names in a list.
const MAX_NAMES: usize = 6;

#[derive(clap::Args)]
pub(crate) struct DiffArguments {
    /// First study: a manifest, a data folder, the folder of the tables of one study
    /// (`DATA/results/STUDY`), or an archive of `asperity share`.
    ///
    /// A manifest stands for its present parameters and their results in the data folder `--data`.
    /// The others stand for the tables in them, which any version of the program may have written,
    /// with the parameters that the run recorded.
    a: PathBuf,

    /// Second study, given in the same way (default with `--set`: A). Differences are those of B
    /// minus A.
    #[arg(required_unless_present_any = ["settings_a", "settings"])]
    b: Option<PathBuf>,

    /// Override a key of the manifest B, such as `stage.contact.tolerance=0.01`. Can be repeated.
    ///
    /// The value is in TOML; a word needs no quotes.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<Setting>,

    /// Override a key of the manifest A. Can be repeated.
    #[arg(long = "set-a", value_name = "KEY=VALUE")]
    settings_a: Vec<Setting>,

    /// Study to compare (default: all studies that both data folders have).
    #[arg(long, value_name = "NAME")]
    study: Option<String>,

    /// Print the means of every column at every parameter point and load.
    #[arg(long)]
    all: bool,

    /// Write the means of every column at every point and load as a table.
    ///
    /// An existing file is overwritten if this command wrote it.
    #[arg(long, short, value_name = "FILE.parquet")]
    output: Option<PathBuf>,

    /// End with exit code 1 if the studies differ (default: 0).
    #[arg(long)]
    exit_code: bool,

    /// Print the result as JSON.
    ///
    /// Form: `{"equal", "studies": [{"equal", "a", "b", "parameters": [{"stage", "what", …}, …],
    /// "stages": [{"stage", "rows_a", "rows_b", "equal", "identical", "common", "only_in_a",
    /// "only_in_b", "across", "columns": [{"column", "unit", "differing", "means": [{"point",
    /// "load", "test", "values_a", "values_b", "mean_a", "mean_b", "difference", "relative",
    /// "lower", "upper", "p_value", "p_corrected", "is_more_than_noise"}, …]}, …]}, …], "noise"},
    /// …], "only_in_a", "only_in_b"}`.
    #[arg(long, conflicts_with = "all")]
    json: bool,
}

pub(crate) fn diff(arguments: &DiffArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let DiffArguments { a, b, settings, settings_a, .. } = arguments;
    let b = b.as_ref().unwrap_or(a);
    let a = Studies::open(a, settings_a, data, &print_notice)?;
    let b = Studies::open(b, settings, data, &print_notice)?;
    let comparison = Comparison::new(&a, &b, arguments.study.as_deref())?;
    if let Some(path) = &arguments.output {
        diff::write(&comparison, path)?;
    }
    let mut out = stdout();
    if arguments.json {
        print_json(&mut out, &comparison)?;
    } else {
        write!(out, "{}", comparison_text(&comparison, arguments.all))?;
    }
    let differs = arguments.exit_code && !comparison.equal;
    Ok(if differs { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Formats a comparison for users. `all` lists every mean, and not only the largest differences.
pub fn comparison_text(comparison: &Comparison, all: bool) -> String {
    let studies = comparison.studies.iter().map(|study| study_text(study, all));
    let mut text = studies.collect::<Vec<_>>().join("\n");
    for (side, names) in [("A", &comparison.only_in_a), ("B", &comparison.only_in_b)] {
        if !names.is_empty() {
            text += &format!("only in {side}: {}\n", shortened(names));
        }
    }
    text
}

fn study_text(study: &StudyComparison, all: bool) -> String {
    let mut text = format!("A  {}\nB  {}\n", origin(&study.a), origin(&study.b));
    match &study.parameters {
        None => text += "\nparameters: not compared, because a folder does not record them\n",
        Some(differences) if differences.is_empty() => text += "\nparameters: equal\n",
        Some(differences) => {
            text += "\nparameters\n";
            for found in differences {
                text += &format!("  {}: {}\n", found.stage, found.what);
            }
        }
    }
    text += &missing_text(study);
    text += &equal_text(study);
    for stage in &study.stages {
        if let Some(tables) = stage.tables.as_ref().filter(|tables| !tables.equal) {
            text += &format!("\n{}", stage_text(stage, tables, all));
        }
    }
    text += &noise_text(&study.noise);
    text += outcome(study);
    text
}

/// Returns the last line about two studies if their tables are equal.
fn outcome(study: &StudyComparison) -> &'static str {
    let tables: Vec<bool> =
        study.stages.iter().filter_map(|stage| Some(stage.tables.as_ref()?.equal)).collect();
    if study.equal && tables.is_empty() {
        "\nA and B are equal manifests\n"
    } else if study.equal {
        "\nA and B are equal\n"
    } else if !tables.is_empty() && tables.len() == study.stages.len() && !tables.contains(&false) {
        "\nA and B have different parameters and equal results\n"
    } else {
        ""
    }
}

fn origin(study: &StudyName) -> String {
    let programs: Vec<&str> = study.programs.iter().map(String::as_str).collect();
    let programs = match programs[..] {
        [] => String::new(),
        _ => format!(", tables of asperity {}", programs.join(" and ")),
    };
    format!("{}{} (study `{}`{programs})", study.path.display(), study.settings, study.study)
}

/// Lists the stages without results, and says how to compute them.
fn missing_text(study: &StudyComparison) -> String {
    let mut text = String::new();
    for (index, (side, origin)) in [("A", &study.a), ("B", &study.b)].into_iter().enumerate() {
        let is_missing = |stage: &&StageComparison| [stage.rows_a, stage.rows_b][index].is_none();
        let missing = study.stages.iter().filter(is_missing);
        let names: Vec<String> = missing.map(|stage| stage.stage.clone()).collect();
        if names.is_empty() {
            continue;
        }
        let mut missing = format!("{side} has no results of {}", shortened(&names));
        if origin.is_manifest {
            let manifest = format!("{}{}", shell_word(&origin.path), origin.settings);
            missing += &format!(
                " for its parameters; run `asperity run {manifest}`, or name the folder of older \
                 tables, `DATA/results/{}`",
                origin.study
            );
        }
        text += &format!("\n{}\n", wrapped(&missing));
    }
    text
}

/// Lists the stages whose tables are equal.
fn equal_text(study: &StudyComparison) -> String {
    let mut text = String::new();
    for (identical, how) in [(true, "to the last bit"), (false, "to 12 digits")] {
        let equal = study.stages.iter().filter(|stage| {
            let tables = stage.tables.as_ref();
            tables.is_some_and(|tables| tables.equal && tables.identical == identical)
        });
        let name = |stage: &StageComparison| {
            let rows = counted(stage.rows_a.map_or(0, |size| size.rows), "row");
            format!("{} ({rows})", stage_name(stage))
        };
        let names: Vec<String> = equal.map(name).collect();
        if !names.is_empty() {
            text += &format!("\nequal {how}: {}\n", names.join(", "));
        }
    }
    text
}

fn stage_name(stage: &StageComparison) -> String {
    let other = stage.stage_in_b.iter().map(|name| format!(" / {name}")).collect::<String>();
    format!("{}{other}", stage.stage)
}

fn stage_text(stage: &StageComparison, tables: &TableComparison, all: bool) -> String {
    let mut text = format!("{}: {}\n", stage_name(stage), rows_text(tables));
    let sides = [
        ("A", stage.rows_a, &tables.rows.only_in_a, &tables.columns_only_in_a),
        ("B", stage.rows_b, &tables.rows.only_in_b, &tables.columns_only_in_b),
    ];
    for (side, size, only, columns) in sides {
        if let Some(StageSize { finished, tasks, .. }) = size
            && finished < tasks
        {
            text += &format!("  {side} is incomplete: {finished} of {}\n", counted(tasks, "task"));
        }
        if only.rows > 0 {
            text += &indented(&only_text(side, only));
        }
        if !columns.is_empty() {
            text += &format!("  columns only in {side}: {}\n", shortened(columns));
        }
    }
    if let Some(loads) = tables.rows.disjoint_loads {
        let ends = loads.iter().zip(&tables.load_units).map(|([least, most], unit)| {
            let suffix = unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
            let most = if least == most { String::new() } else { format!(" … {}", short(*most)) };
            short(*least) + &most + &suffix
        });
        let named: Vec<String> = ends.collect();
        text += &indented(&format!(
            "no load is in both: `{}` is {} in B",
            tables.rows.load_column,
            named.join(" in A and ")
        ));
    }
    text + &columns_text(tables, all)
}

fn indented(text: &str) -> String {
    format!("  {}\n", wrapped(text).replace('\n', "\n    "))
}

fn rows_text(tables: &TableComparison) -> String {
    let across = match &tables.rows.across[..] {
        [] => String::new(),
        names => format!(" across {}", shortened(names)),
    };
    let has_means = tables.columns.iter().any(|column| !column.means.is_empty());
    let rows = match tables.rows.common {
        0 if has_means => "no surface in both, so means are of independent surfaces".to_owned(),
        0 => "no row in both".to_owned(),
        common => format!("{} in both", counted(common, "row")),
    };
    let columns = counted(tables.columns.len(), "column");
    match tables.columns.iter().filter(|column| !column.is_equal()).count() {
        0 => format!("{rows}{across}; {columns} equal"),
        different => format!("{rows}{across}; {different} of {columns} differ"),
    }
}

fn only_text(side: &str, only: &UnmatchedRows) -> String {
    let reasons = [
        ("at other points", &only.points),
        ("of other surfaces", &only.surfaces),
        ("at other loads", &only.loads),
    ];
    let parts: Vec<(&str, &Lacking)> =
        reasons.into_iter().filter(|(_, lacking)| lacking.rows > 0).collect();
    let first = |lacking: &Lacking| {
        let more = if lacking.more { " …" } else { "" };
        lacking.first.join("; ") + more
    };
    let rows = counted(only.rows, "row");
    match parts[..] {
        [(what, lacking)] => format!("{rows} only in {side}, {what}: {}", first(lacking)),
        _ => {
            let texts = parts
                .iter()
                .map(|(what, lacking)| format!("{} {what} ({})", lacking.rows, first(lacking)));
            format!("{rows} only in {side}: {}", texts.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Prints the columns that differ, those that differ most first.
fn columns_text(tables: &TableComparison, all: bool) -> String {
    let different = || tables.columns.iter().filter(|column| !column.is_equal());
    let mut numbers: Vec<(&ColumnComparison, &MeanComparison)> =
        different().filter_map(|column| Some((column, column.largest()?))).collect();
    numbers.sort_by(|(_, one), (_, other)| other.by_size(one));
    let mut text = String::new();
    let shown = if all { numbers.len() } else { numbers.len().min(MAX_COLUMNS) };
    if shown > 0 {
        let mut rows = Vec::new();
        for (column, largest) in &numbers[..shown] {
            let means = if all { column.means.iter().collect() } else { vec![*largest] };
            rows.extend(means.into_iter().map(|mean| cells(column, mean, tables)));
        }
        text += &format!(
            "  {}\n",
            in_columns(HEADER, rows, |index| (1..5).contains(&index)).replace('\n', "\n  ")
        );
    }
    if numbers.len() > shown {
        let names: Vec<String> =
            numbers[shown..].iter().map(|(column, _)| column.column.clone()).collect();
        text += &format!("  and {} (`--all` prints them)\n", shortened(&names));
    }
    let others = different().filter(|column| column.largest().is_none());
    let named: Vec<String> = others
        .map(|column| format!("{} in {}", column.column, counted(column.differing, "row")))
        .collect();
    if !named.is_empty() {
        text += &format!("  other values: {}\n", shortened(&named));
    }
    text
}

const HEADER: [&str; 9] =
    ["column", "A", "B", "B − A", "relative", "95 % interval", "n", "at", "more than noise"];

/// Returns the cells of a line: one mean comparison of a column.
fn cells(
    column: &ColumnComparison,
    mean: &MeanComparison,
    tables: &TableComparison,
) -> [String; 9] {
    let interval = match mean.lower.zip(mean.upper) {
        Some((lower, upper)) => format!("{} … {}", signed(lower), signed(upper)),
        None => "–".to_owned(),
    };
    let surfaces = match mean.test {
        Test::Paired => mean.values_a.to_string(),
        Test::Welch => format!("{}, {}", mean.values_a, mean.values_b),
    };
    let noise = match mean.is_more_than_noise {
        _ if mean.is_equal() => "equal",
        None => "–",
        Some(true) => "yes",
        Some(false) => "no",
    };
    let load = mean.load.map(|load| match &tables.load_units {
        [Some(unit), Some(other)] if unit == other => format!("{load} {unit}"),
        _ => format!("{} {load}", tables.rows.load_column),
    });
    let row = (mean.row > 1).then(|| format!("row {}", mean.row));
    let varying: Vec<&str> = tables.rows.varying.iter().map(String::as_str).collect();
    let point = mean.point.clone().only(&varying).to_string();
    let point = Some(point).filter(|point| !point.is_empty());
    let place: Vec<String> = [point, load, row].into_iter().flatten().collect();
    let name = match column.has_named_unit {
        true => format!("{} [{}]", column.column, column.unit),
        false => column.column.clone(),
    };
    [
        name,
        short(mean.mean_a).replace('-', "−"),
        short(mean.mean_b).replace('-', "−"),
        signed(mean.difference),
        mean.relative.map_or_else(|| "–".to_owned(), relative),
        interval,
        surfaces,
        place.join(", "),
        noise.to_owned(),
    ]
}

/// Formats a difference with its sign and three significant digits.
fn signed(number: f64) -> String {
    if number == 0.0 {
        return "0".to_owned();
    }
    let sign = if number > 0.0 { "+" } else { "−" };
    format!("{sign}{}", significant(number.abs(), 3))
}

/// Formats a relative difference in percent, or as a factor if B is many times larger than A.
fn relative(relative: f64) -> String {
    if relative >= 10.0 {
        return format!("×{}", significant(1.0 + relative, 3));
    }
    format!("{} %", signed(100.0 * relative))
}

fn noise_text(noise: &Noise) -> String {
    if noise.comparisons == 0 {
        return String::new();
    }
    let text = format!(
        "noise: {} differ; {} of their intervals exclude zero, about {:.0} by chance; {} are \
         more than noise",
        counted(noise.comparisons, "mean"),
        noise.excluding_zero,
        noise.expected_by_chance,
        noise.more_than_noise,
    );
    format!("\n{}\n", wrapped(&text))
}

/// Joins names, and counts those beyond the first few.
fn shortened(names: &[String]) -> String {
    let first = names.iter().take(MAX_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MAX_NAMES) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_have_a_sign_and_three_digits() {
        let texts = [0.0, 0.012345, -1234.5, -1e-9].map(signed);
        assert_eq!(texts, ["0", "+0.0123", "−1230", "−1e-9"]);
        assert_eq!([-0.5, 1599.0].map(relative), ["−50 %", "×1600"]);
    }
}
