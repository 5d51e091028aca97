//! Checks of the statistics that are asked for.

use crate::aggregate::{Statistic, level_of_confidence};
use asperity_manifest::diagnostics::{Problem, Span, did_you_mean, listed};
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Written};
use asperity_tables::table::Table;

/// Returns whether a load, reduced or in pascals, tells groups apart, as it does by default.
fn has_load(group_by: Option<&[String]>) -> bool {
    let is_load = |name: &String| ["load", "pressure"].contains(&name.as_str());
    group_by.is_none_or(|names| names.iter().any(is_load))
}

/// What is asked for, each once.
pub fn statistics(
    key: &Key<Vec<Written<String>>>,
    group_by: Option<&[String]>,
    input: Option<&Table>,
    checks: &mut Checks,
) -> Option<Vec<Statistic>> {
    let Some(written) = key.written() else {
        return Some(vec![Statistic::Mean, Statistic::Sd, Statistic::Sem]);
    };
    if written.value.is_empty() {
        let label = "must name at least one statistic";
        let problem = Problem::new("`statistics` is empty", written.span.clone(), label);
        checks.report("statistics", problem);
        return None;
    }
    let mut statistics: Vec<Statistic> = Vec::new();
    let mut complete = true;
    for Written { value, span } in &written.value {
        let Some(statistic) = statistic(value) else {
            checks.problems.push(unknown_statistic(value, span.clone()));
            complete = false;
            continue;
        };
        if let Some((message, label)) = misses_load(value, statistic, group_by, input) {
            checks.problems.push(Problem::new(message, span.clone(), label));
            complete = false;
        }
        if statistics.contains(&statistic) {
            let message = format!("`statistics` asks for {value:?} twice");
            checks.problems.push(Problem::new(message, span.clone(), "here again"));
            complete = false;
        }
        statistics.push(statistic);
    }
    complete.then_some(statistics)
}

/// What keeps a statistic from being taken against the load, if it is one of those: slopes follow the
/// groups of a curve from load to load, lines go through the loads within a group.
fn misses_load(
    word: &str,
    statistic: Statistic,
    group_by: Option<&[String]>,
    input: Option<&Table>,
) -> Option<(String, &'static str)> {
    let names_groups = match statistic {
        Statistic::Slope | Statistic::Secant | Statistic::Approach => true,
        Statistic::RegressionSlope | Statistic::RegressionIntercept => false,
        _ => return None,
    };
    if names_groups && !has_load(group_by) {
        let message = format!("{word:?} is taken against `load`, which names no group");
        return Some((message, "needs `load` in `group_by`"));
    }
    if input.is_some_and(|input| !input.has("load")) {
        let message = format!("{word:?} is taken against `load`, which the input has not");
        return Some((message, "needs rows with a `load`"));
    }
    (!names_groups && has_load(group_by)).then(|| {
        let message =
            format!("{word:?} is of a line through several loads, and `load` names groups");
        (message, "needs a `group_by` without `load`")
    })
}

const WORDS: [(&str, Statistic); 11] = [
    ("mean", Statistic::Mean),
    ("sd", Statistic::Sd),
    ("sem", Statistic::Sem),
    ("min", Statistic::Min),
    ("max", Statistic::Max),
    ("median", Statistic::Quantile(0.5)),
    ("regr_slope", Statistic::RegressionSlope),
    ("regr_intercept", Statistic::RegressionIntercept),
    ("slope", Statistic::Slope),
    ("secant", Statistic::Secant),
    ("approach", Statistic::Approach),
];

/// A statistic by its name. `q05` is the quantile of 5 %, `q975` that of 97.5 %, `ci95` the
/// confidence interval of 95 %: the digits are those after the point.
fn statistic(name: &str) -> Option<Statistic> {
    let known = WORDS.iter().find(|(word, _)| *word == name);
    if let Some((_, statistic)) = known {
        return Some(*statistic);
    }
    if let Some(level) = level_of_confidence(name) {
        return Some(Statistic::Confidence(level));
    }
    let digits = name.strip_prefix('q')?;
    let is_plain = (2..=6).contains(&digits.len()) && digits.bytes().all(|b| b.is_ascii_digit());
    // `q100` would be 10 %, which nobody means.
    let is_shortest = digits.len() == 2 || !digits.ends_with('0');
    let quantile: f64 = format!("0.{digits}").parse().ok()?;
    (is_plain && is_shortest && quantile > 0.0).then_some(Statistic::Quantile(quantile))
}

fn unknown_statistic(name: &str, span: Span) -> Problem {
    let words = || WORDS.iter().map(|(word, _)| *word);
    let label = match did_you_mean(name, words()) {
        Some(meant) => format!("did you mean \"{meant}\"?"),
        None => "unknown statistic".to_owned(),
    };
    let help = format!(
        "one of {}, a quantile such as `q05` (5 %) or `q975` (97.5 %), or a confidence interval of \
         the mean such as `ci95` (95 %)",
        listed(words(), "and")
    );
    Problem::new(format!("there is no statistic {name:?}"), span, label).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_of_a_quantile_are_those_after_the_point() {
        assert_eq!(statistic("q05"), Some(Statistic::Quantile(0.05)));
        assert_eq!(statistic("q975"), Some(Statistic::Quantile(0.975)));
        assert_eq!(statistic("q50"), statistic("median"));
        for name in ["q", "q5", "q00", "q100", "q-5", "q0x", "q1234567", "p05", "quantile"] {
            assert_eq!(statistic(name), None, "{name}");
        }
    }

    #[test]
    fn digits_of_a_confidence_interval_are_its_level() {
        for (word, level) in [("ci90", 0.9), ("ci95", 0.95), ("ci99", 0.99), ("ci999", 0.999)] {
            let found = statistic(word).unwrap();
            assert_eq!(found, Statistic::Confidence(level));
            assert_eq!(found.suffix(), word);
        }
        for name in ["ci", "ci9", "ci00", "ci100", "ci950", "ci-5", "ci1234567"] {
            assert_eq!(statistic(name), None, "{name}");
        }
    }
}
