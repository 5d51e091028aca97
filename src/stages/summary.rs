//! Words for what a stage has found.

use arrow::array::Array;

use crate::store::table::{Table, TableError};

/// Smallest and largest value of a column, if there is one.
///
/// # Errors
/// When it holds no numbers.
pub fn range(table: &Table, name: &str, label: &str) -> Result<Option<String>, TableError> {
    if !table.has(name) {
        return Ok(None);
    }
    let column = table.reals(name)?;
    let values = || column.iter().flatten();
    let (least, most) = (
        values().fold(f64::INFINITY, f64::min),
        values().fold(f64::NEG_INFINITY, f64::max),
    );
    Ok(
        (column.len() > column.null_count()).then(|| match least == most {
            true => format!("{label} {}", number(least)),
            false => format!("{label} {} … {}", number(least), number(most)),
        }),
    )
}

/// Four decimals, and four digits behind the first where these would be none.
fn number(value: f64) -> String {
    match value != 0.0 && value.abs() < 1e-3 {
        true => format!("{value:.4e}"),
        false => format!("{value:.4}"),
    }
}

/// A column's texts, each once, in order of appearance.
///
/// # Errors
/// When there is no such column of texts.
pub fn distinct(table: &Table, name: &str) -> Result<Vec<String>, TableError> {
    let mut found: Vec<String> = Vec::new();
    for text in table.texts(name)?.iter().flatten() {
        if !found.iter().any(|known| known == text) {
            found.push(text.to_owned());
        }
    }
    Ok(found)
}
