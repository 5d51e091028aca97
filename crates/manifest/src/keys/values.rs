//! TOML values in messages and in comparisons.

use std::collections::BTreeMap;

use serde_spanned::Spanned as TomlSpanned;
use toml::de::DeValue;

use crate::diagnostics::{Problem, Problems};

/// Describes a value for a label: `this is the number 4.5`.
pub fn found(value: &DeValue<'_>) -> String {
    const MAX_LENGTH: usize = 40;
    match value {
        DeValue::String(text) if text.chars().count() <= MAX_LENGTH => {
            format!("this is the text {text:?}")
        }
        DeValue::String(_) => "this is a text".to_owned(),
        DeValue::Integer(_) | DeValue::Float(_) => format!("this is the number {}", shown(value)),
        DeValue::Boolean(truth) => format!("this is `{truth}`"),
        DeValue::Datetime(_) => "this is a date".to_owned(),
        DeValue::Array(_) => "this is a list".to_owned(),
        DeValue::Table(_) => "this is a table".to_owned(),
    }
}

/// Formats a number as in the manifest.
pub(super) fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        _ => String::new(),
    }
}

/// Removes and reports values that a swept list contains twice, because their results would count
/// twice.
pub fn remove_repeats(
    key: &str,
    values: &mut Vec<TomlSpanned<DeValue<'_>>>,
    problems: &mut Problems,
) {
    let mut seen = BTreeMap::new();
    values.retain(|value| {
        let Some(before) = seen.insert(plain(value.get_ref()), value.span()) else {
            return true;
        };
        let message = format!("`{key}` is swept over the same value twice");
        let problem = Problem::new(message, value.span(), "here again");
        problems.push(problem.and(before, "first here"));
        false
    });
}

/// Replaces the scalars of a value. The arguments of `by` are the position of a scalar and the
/// scalar; if it returns `None`, the whole value has no replacement.
pub(super) fn with_scalars<'t>(
    value: TomlSpanned<DeValue<'t>>,
    by: &impl Fn(usize, DeValue<'t>) -> Option<DeValue<'t>>,
) -> Option<TomlSpanned<DeValue<'t>>> {
    let span = value.span();
    let replaced = match value.into_inner() {
        DeValue::Array(items) => {
            let items = items.into_iter().map(|item| with_scalars(item, by));
            DeValue::Array(items.collect::<Option<_>>()?)
        }
        DeValue::Table(table) => {
            let entries = table.into_iter();
            let replaced = entries.map(|(key, value)| Some((key, with_scalars(value, by)?)));
            DeValue::Table(replaced.collect::<Option<_>>()?)
        }
        scalar => by(span.start, scalar)?,
    };
    Some(TomlSpanned::new(span, replaced))
}

/// Formats a value in canonical notation, in which `1`, `1.0` and `1e0` are equal.
pub(super) fn plain(value: &DeValue<'_>) -> String {
    let exact = |number: i128| number.unsigned_abs() <= 1 << f64::MANTISSA_DIGITS;
    match value {
        DeValue::Integer(integer) => {
            match i128::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(number) if exact(number) => format!("{:?}", number as f64),
                _ => integer.to_string(),
            }
        }
        DeValue::Float(float) => match float.as_str().parse::<f64>() {
            Ok(number) => format!("{:?}", number + 0.0),
            Err(_) => float.to_string(),
        },
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Array(list) => {
            let items: Vec<_> = list.iter().map(|item| plain(item.get_ref())).collect();
            format!("[{}]", items.join(", "))
        }
        other => format!("{other:?}"),
    }
}
