//! Formatting of the cells of a table: numbers have aligned decimals, and keys and long texts are
//! shortened.

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type};
use arrow::util::display::array_value_to_string;

/// Maximum length of a text in characters. [`cells`] shortens longer texts.
const MAX_LETTERS: usize = 40;
/// Number of printed digits of a key. The commands `show` and `view` accept a key of this length.
const KEY_DIGITS: usize = 8;

/// Formats the first `rows` cells of a column and shortens long texts.
pub fn cells(array: &dyn Array, rows: usize) -> Vec<String> {
    formatted(array, rows, MAX_LETTERS)
}

/// Formats the first `rows` cells of a column. Keys are shortened, but no other texts.
pub fn whole_cells(array: &dyn Array, rows: usize) -> Vec<String> {
    formatted(array, rows, usize::MAX)
}

fn formatted(array: &dyn Array, rows: usize, max_letters: usize) -> Vec<String> {
    let text = |row| {
        if array.is_valid(row) {
            array_value_to_string(array, row).unwrap_or_default()
        } else {
            "–".to_owned()
        }
    };
    match array.data_type() {
        DataType::Float64 => {
            reals(&(array.as_primitive::<Float64Type>().iter()).take(rows).collect::<Vec<_>>())
        }
        DataType::Utf8 => (0..rows).map(|row| shortened(&text(row), max_letters)).collect(),
        _ => (0..rows).map(text).collect(),
    }
}

fn shortened(text: &str, max_letters: usize) -> String {
    let is_key = text.len() == 32 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    if is_key {
        return text[..KEY_DIGITS].to_owned();
    }
    if text.chars().count() > max_letters {
        text.chars().take(max_letters - 1).chain(['…']).collect()
    } else {
        text.to_owned()
    }
}

/// Formats numbers with a common number of decimals.
///
/// The smallest number has at least three significant digits, the largest at least five. Decimals
/// that are zero in all numbers are omitted.
fn reals(values: &[Option<f64>]) -> Vec<String> {
    /// Maximum number of decimals. If more are needed, numbers have scientific notation.
    const MAX_DECIMALS: i32 = 8;
    let finite = || values.iter().flatten().filter(|value| value.is_finite());
    let nonzero = finite().filter(|value| **value != 0.0);
    #[expect(clippy::disallowed_methods, reason = "only the number of shown digits depends on it")]
    let exponents = nonzero.map(|value| value.abs().log10().floor() as i32);
    let (smallest, largest) = exponents
        .fold((i32::MAX, i32::MIN), |(small, large), next| (small.min(next), large.max(next)));
    let wanted = (4i32.saturating_sub(largest)).max(2i32.saturating_sub(smallest));
    let is_plain = smallest == i32::MAX || (wanted <= MAX_DECIMALS && largest < 9);
    let decimals = match smallest {
        i32::MAX => 0,
        _ => finite()
            .map(|value| needed(*value, wanted.clamp(0, MAX_DECIMALS) as usize))
            .max()
            .unwrap_or(0),
    };
    let text = |value: &Option<f64>| match value {
        None => "–".to_owned(),
        Some(value) if is_plain || !value.is_finite() => format!("{value:.decimals$}"),
        Some(value) => format!("{value:.4e}"),
    };
    values.iter().map(text).collect()
}

/// Returns the number of decimals, not counting trailing zeros, of a value rounded to `most`
/// decimals.
fn needed(value: f64, most: usize) -> usize {
    let text = format!("{value:.most$}");
    match text.split_once('.') {
        Some((_, decimals)) => decimals.trim_end_matches('0').len(),
        None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_keep_three_digits_beside_large_ones() {
        let formatted =
            |values: &[f64]| reals(&values.iter().copied().map(Some).collect::<Vec<_>>());
        assert_eq!(formatted(&[0.001234567, 1.5]), ["0.00123", "1.50000"]);
        assert_eq!(formatted(&[2.0, 4.0]), ["2", "4"]);
        assert_eq!(formatted(&[0.0, 0.0]), ["0", "0"]);
        assert_eq!(formatted(&[1e-12, 1.0]), ["1.0000e-12", "1.0000e0"]);
        assert_eq!(reals(&[None, Some(0.25), Some(f64::NAN)]), ["–", "0.25", "NaN"]);
    }
}
