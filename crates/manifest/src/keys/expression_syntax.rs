//! Texts in the place of numbers: expressions, and numbers with a unit.

use serde_spanned::Spanned as TomlSpanned;
use toml::de::DeValue;

use super::quantity::{Dimension, Unit, split};
use crate::diagnostics::Problem;
use crate::expression::ExpressionError;

/// Returns whether a text is a number alone, or a number followed by a unit: `"2"`, `"10 MPa"`.
pub fn has_unit(text: &str) -> bool {
    let number = text.trim_end_matches(['%', '°', ' ']).trim();
    number.parse().is_ok_and(f64::is_finite) || split(text).is_some()
}

/// Returns the problem of an expression that cannot be parsed, or that uses `slope` if there is no
/// `error`.
pub fn syntax_problem(
    path: &str,
    written: &TomlSpanned<DeValue<'_>>,
    error: Option<&ExpressionError>,
) -> Problem {
    let text = written.get_ref().as_str().unwrap_or_default();
    let message = format!("cannot read the expression of `{path}`");
    let (span, label) = match error {
        Some(error) => (error.span_in(text, &written.span()), error.reason.clone()),
        None => (written.span(), "`slope` needs the loads of a surface".to_owned()),
    };
    let words = text.split(|letter: char| " *+-/^()\"".contains(letter));
    let is_of_number = |letter: char| "0123456789.".contains(letter);
    let unit = words.filter_map(|word| Unit::find(word.trim_start_matches(is_of_number))).next();
    let or_name = |key, unit: &Unit| {
        format!(", or name the unit by `{key} = \"{}\"` and leave it out here", unit.symbol)
    };
    let problem = Problem::new(message, span, label);
    let with_points = text.replace(',', ".");
    if text.contains(',') && has_unit(&with_points) {
        return problem.help(format!("numbers have a decimal point: write \"{with_points}\""));
    }
    problem.help(match unit {
        Some(unit) => format!(
            "expressions take plain numbers; write the result with its unit, such as \"20 {0}\"{1}",
            unit.symbol,
            match unit.dimension {
                Dimension::Length => or_name("unit", unit),
                Dimension::Pressure => or_name("load_unit", unit),
                Dimension::Force
                | Dimension::Work
                | Dimension::Conductivity
                | Dimension::Resistivity => String::new(),
            }
        ),
        None => "an expression has numbers, names of keys and parameters, `+ - * / ^`, \
                 parentheses, and functions such as `ln(…)` and `sqrt(…)`"
            .to_owned(),
    })
}
