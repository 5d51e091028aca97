//! Words for what a stage has found.

use super::StageError;
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// Passes one column to `with` part by part, for tables that do not fit into memory. Returns
/// whether there is such a column.
fn each_part(
    source: &TableSource,
    name: &str,
    mut with: impl FnMut(&Table) -> Result<(), StageError>,
) -> Result<bool, StageError> {
    let Some(column) = source.names().iter().position(|known| known == name) else {
        return Ok(false);
    };
    for part in source.parts(&[column]) {
        with(&part.map_err(StageError::Store)?)?;
    }
    Ok(true)
}

/// Smallest and largest value of a column, if there is one.
///
/// # Errors
/// When it holds no numbers, or is damaged.
pub fn range(source: &TableSource, name: &str, label: &str) -> Result<Option<String>, StageError> {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    each_part(source, name, |part| {
        let values = || Ok::<_, StageError>(part.reals(name)?.iter().flatten());
        least = values()?.fold(least, f64::min);
        most = values()?.fold(most, f64::max);
        Ok(())
    })?;
    Ok((least <= most).then(|| match least == most {
        true => format!("{label} {}", number(least)),
        false => format!("{label} {} … {}", number(least), number(most)),
    }))
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
/// When it holds no texts, or is damaged.
pub fn distinct(source: &TableSource, name: &str) -> Result<Vec<String>, StageError> {
    let mut found: Vec<String> = Vec::new();
    each_part(source, name, |part| {
        for text in part.texts(name)?.iter().flatten() {
            if !found.iter().any(|known| known == text) {
                found.push(text.to_owned());
            }
        }
        Ok(())
    })?;
    Ok(found)
}
