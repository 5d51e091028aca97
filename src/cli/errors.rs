//! `asperity errors`: the errors of the means and of the fitted limits of a study.

use std::collections::BTreeMap;
use std::process::ExitCode;

use super::plan::core_hours;
use super::terminal::in_columns;
use super::{Failure, StudyArguments, print_answer};
use crate::session::DataFolder;
use crate::session::advice::{AdvisedFit, AdvisedStep};
use crate::session::errors::{Addition, LoadErrors, MeanErrors, StudyErrors, TermError};
use crate::session::formatting::{counted, listed, significant};

/// Largest number of loads that are printed; `--json` prints all.
const MOST_LOADS: usize = 6;

#[derive(clap::Args)]
pub(crate) struct ErrorsArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Stage with the means: an `aggregate` stage, a `solve`, `measure` or `correct` stage, or a
    /// fit of limits (default: all `aggregate` stages and fits of limits).
    stage: Option<String>,

    /// Column whose means to judge (default: all of the stage).
    #[arg(requires = "stage")]
    column: Option<String>,

    /// Print the result as JSON, with all loads.
    ///
    /// Form: `{"means": [{"stage", "column", "unit", "point", "nodes", "load_column", "loads":
    /// [{"load", "surfaces", "value", "largest", "terms": [{"term": "sampling" | "mesh" | "cell" |
    /// "solver", "bias", "standard_error", "interval", "order", "order_is_shown", "sizes",
    /// "surfaces", "on_nodes"}, …]}, …], "halving": [{"term", "change", "core_hours"}, …],
    /// "unknown"}, …], "additions": [{"stage", "terms", "replaced", "unused", "lines",
    /// "core_hours"}, …], "limits": [{"stage", "what", "forms", "limit", "unit", "standard_error",
    /// "points", "steps": [{"term", "doubled", "points", "core_hours", "factor"}, …]}, …],
    /// "limits_without_result"}`.
    ///
    /// `bias` is the mean minus its limit, and `interval` its 95 % confidence interval. `factor` is
    /// the expected ratio of the new standard error to the present one.
    #[arg(long)]
    json: bool,
}

pub(crate) fn errors(arguments: &ErrorsArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = arguments.study.session(data);
    let errors = session.errors(arguments.stage.as_deref(), arguments.column.as_deref())?;
    print_answer(arguments.json, &errors, || text(&errors))
}

fn text(errors: &StudyErrors) -> String {
    let means = errors.means.iter().map(mean_text);
    let additions = errors.additions.iter().map(addition_text);
    let limits = errors.limits.iter().map(fit_text);
    let mut parts: Vec<String> = means.chain(additions).chain(limits).collect();
    if errors.limits_without_result > 0 {
        let many = counted(errors.limits_without_result, "fit");
        let advice = "run the study, or see `asperity status`";
        parts.push(format!("{many} of limits without a result: {advice}\n"));
    }
    if parts.is_empty() {
        return "no means over surfaces under loads: run the study, or name a stage\n".to_owned();
    }
    parts.join("\n")
}

fn mean_text(mean: &MeanErrors) -> String {
    let MeanErrors { stage, column, point, loads, .. } = mean;
    let unit = mean.unit.as_ref().map_or_else(String::new, |unit| format!(" [{unit}]"));
    let mesh = mean.nodes.map_or_else(String::new, |nodes| format!(", {nodes} nodes per side"));
    let place = if point.is_empty() { String::new() } else { format!(", {point}") };
    let mut text = format!("{stage}: mean of {column}{unit}{place}{mesh}\n");
    let header =
        [mean.load_column, "mean", "surfaces", "sampling", "mesh", "cell", "solver", "largest"];
    let shown = shown(loads.len());
    let rows = shown.iter().map(|&index| row(&loads[index]));
    for line in in_columns(header, rows, |index| (0..3).contains(&index)).lines() {
        text += &format!("  {line}\n");
    }
    if shown.len() < loads.len() {
        text += &format!("  {} more loads: `--json`\n", loads.len() - shown.len());
    }
    for (term, basis) in bases(loads) {
        text += &format!("  {term}: {basis}\n");
    }
    for halving in &mean.halving {
        let cost = core_hours(halving.seconds);
        text += &format!("  to halve {}: {}, {cost}\n", halving.term, halving.change);
    }
    if !mean.unknown.is_empty() {
        text += &format!("  unknown: {}\n", mean.unknown.join(", "));
    }
    text
}

/// Returns the indices of the loads that are printed, evenly spaced.
fn shown(loads: usize) -> Vec<usize> {
    let count = loads.min(MOST_LOADS);
    (0..count).map(|index| index * (loads - 1) / (count - 1).max(1)).collect()
}

fn row(load: &LoadErrors) -> [String; 8] {
    let percent = |value: f64| significant(100.0 * value / load.value.abs(), 2);
    let term = |name: &str| {
        let Some(term) = load.terms.iter().find(|term| term.term == name) else {
            return "?".to_owned();
        };
        if load.value == 0.0 {
            return "–".to_owned();
        }
        let [lower, upper] = term.interval;
        match term.bias {
            Some(bias) => {
                format!("{} % [{}, {}]", signed(&percent(bias)), percent(lower), percent(upper))
            }
            None => format!("± {} %", percent(upper)),
        }
    };
    [
        significant(load.load, 4),
        significant(load.value, 5),
        load.surfaces.to_string(),
        term("sampling"),
        term("mesh"),
        term("cell"),
        term("solver"),
        load.largest.unwrap_or_default().to_owned(),
    ]
}

fn signed(number: &str) -> String {
    if number.starts_with('-') { number.to_owned() } else { format!("+{number}") }
}

/// Describes the surfaces behind the terms of all loads.
fn bases(loads: &[LoadErrors]) -> BTreeMap<&'static str, String> {
    let mut bases: BTreeMap<&str, String> = BTreeMap::new();
    for (name, what) in [("mesh", "nodes per side"), ("cell", "k_lower"), ("solver", "tolerance")] {
        let all = loads.iter().flat_map(|load| &load.terms);
        let terms: Vec<&TermError> =
            all.filter(|term| term.term == name && !term.sizes.is_empty()).collect();
        let Some(first) = terms.first() else { continue };
        let sizes: Vec<String> = first.sizes.iter().map(|&size| significant(size, 6)).collect();
        let mut basis = format!("{what} {}", sizes.join(", "));
        if let [count, ..] = first.surfaces[..] {
            let equal = first.surfaces.iter().all(|other| *other == count);
            let counts: Vec<String> = first.surfaces.iter().map(usize::to_string).collect();
            let counts = if equal { count.to_string() } else { counts.join(", ") };
            basis += &format!(" ({counts} surfaces)");
        }
        if let Some(nodes) = first.on_nodes {
            basis += &format!(", with {nodes} nodes per side");
        }
        let shown = terms.iter().filter(|term| term.order_is_shown == Some(true));
        let orders: Vec<f64> = shown.filter_map(|term| term.order).collect();
        let assumed = terms.iter().filter(|term| term.order_is_shown == Some(false)).count();
        let [least, most] = [f64::min, f64::max].map(|end| orders.iter().copied().reduce(end));
        if let (Some(least), Some(most)) = (least, most) {
            let [least, most] = [least, most].map(|order| format!("{order:.2}"));
            let most = if least == most { String::new() } else { format!(" … {most}") };
            basis += &format!(", order {least}{most}");
        }
        match assumed {
            0 => {}
            _ if orders.is_empty() => basis += ", order 1 assumed",
            _ => basis += &format!(", order 1 assumed at {}", counted(assumed, "load")),
        }
        bases.insert(first.term, basis);
    }
    bases
}

fn addition_text(addition: &Addition) -> String {
    let cost = addition.seconds.map(|seconds| format!(" ({})", core_hours(seconds)));
    let unused = match &addition.unused[..] {
        [] => String::new(),
        names => format!(
            "remove {} from [parameters], and ",
            listed(names.iter().map(String::as_str), "and")
        ),
    };
    let stage = &addition.stage;
    let change = match &addition.replaced[..] {
        [] => format!("add to [stage.{stage}]"),
        keys => format!("replace in [stage.{stage}]\n{} by", listed(keys.iter().copied(), "and")),
    };
    let terms = addition.terms.join(" and ");
    let intro =
        format!("to show the error of {terms}{}, {unused}{change}", cost.unwrap_or_default());
    let indented = addition.lines.lines().map(|line| format!("    {line}\n"));
    format!("{intro}\n{}", indented.collect::<String>())
}

fn fit_text(fit: &AdvisedFit) -> String {
    let error = fit
        .standard_error
        .map_or_else(String::new, |error| format!(" ± {} (standard error)", significant(error, 2)));
    let unit = fit.unit.as_ref().map_or_else(String::new, |unit| format!(" [{unit}]"));
    let mut text = format!(
        "{}: {}\n  limit{unit} {:.4}{error}, {}; {}\n",
        fit.stage,
        fit.what,
        fit.limit,
        counted(fit.points, "point"),
        fit.forms.join(" · "),
    );
    text += &format!(
        "  {:28}  {:>6}  {:>18}  {:>14}  {}\n",
        "small parameter halved", "points", "cost", "standard error", "by doubling"
    );
    let best = fit.steps.iter().filter_map(AdvisedStep::gain).fold(0.0, f64::max);
    for step in &fit.steps {
        let after = match (fit.standard_error, step.factor) {
            (Some(error), Some(factor)) => significant(error * factor, 2),
            (None, Some(factor)) => format!("× {factor:.2}"),
            (_, None) => "?".to_owned(),
        };
        let mark = match step.gain() {
            Some(gain) if gain >= best => "  ← best gain for its cost",
            _ => "",
        };
        text += &format!(
            "  {:28}  {:>6}  {:>18}  {after:>14}  {}{mark}\n",
            step.term.as_deref().unwrap_or("(twice the surfaces)"),
            step.points,
            core_hours(step.seconds),
            step.doubled.join(", "),
        );
    }
    text
}
