//! Parameter points as figures name them, and the parameters that a study varies.

use std::collections::BTreeSet;

use asperity_stages::columns::{
    COEFFICIENT, CONTENT, CORRECTION, HURST, K_LOWER, K_ROLLOFF, K_UPPER, RMS_SLOPE,
};
pub use asperity_stages::ensemble::ParameterPoint as Point;
use asperity_stages::ensemble::grouped;
use asperity_tables::column::{Role, Value};
use asperity_tables::table::Table;

/// Returns the parameter point of a row.
pub fn at_row(table: &Table, row: usize) -> Point {
    as_named(&Point::from_row(table, row))
}

/// Beginning of the names of columns with the forms of terms, and of the columns with these terms.
pub const FORM: &str = "form_";
const TERM: &str = "term_";

/// Removes the correction of the area and, of a spectrum without a plateau, the roll-off: two
/// wavenumbers name such a spectrum. Forms of terms get the names of their terms.
pub fn as_named(point: &Point) -> Point {
    let of_term = |name: &str, form: &Value| {
        let term = point.get(&format!("{TERM}{}", name.strip_prefix(FORM)?))?;
        Some(Value::Text(format!("{term}: {form}")))
    };
    let named = point.map(|name, value| of_term(name, value).unwrap_or_else(|| value.clone()));
    let terms = point.iter().map(|(name, _)| name).filter(|name| name.starts_with(TERM));
    let removed: Vec<&str> = terms.chain([CORRECTION.name, COEFFICIENT.name]).collect();
    let named = named.without(&removed);
    match named.get(K_ROLLOFF.name) == named.get(K_LOWER.name) {
        true => named.without(&[K_ROLLOFF.name]),
        false => named,
    }
}

/// Returns the value of a parameter that is a text.
pub fn text<'a>(point: &'a Point, name: &str) -> Option<&'a str> {
    match point.get(name)? {
        Value::Text(text) => Some(text),
        Value::Real(_) | Value::Integer(_) => None,
    }
}

/// Returns a value that is a number.
pub fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Real(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        Value::Text(_) => None,
    }
}

/// Returns whether a point has all values of another point.
pub fn holds(point: &Point, other: &Point) -> bool {
    other.iter().all(|(name, value)| point.get(name) == Some(value))
}

/// Returns the rank of a coordinate among those that can distinguish series.
pub fn rank(name: &str) -> usize {
    const FIRST: [&str; 6] =
        [CONTENT.name, HURST.name, K_LOWER.name, K_UPPER.name, K_ROLLOFF.name, CORRECTION.name];
    const LAST: [&str; 7] =
        ["nodes", "nodes_x", "nodes_y", "side", "side_x", "side_y", "coefficient"];
    let first = FIRST.iter().position(|first| *first == name);
    let last = LAST.iter().position(|last| *last == name).map(|at| FIRST.len() + 1 + at);
    first.or(last).unwrap_or(FIRST.len())
}

/// Returns the number of different values in a column.
pub fn distinct(table: &Table, name: &str) -> usize {
    if table.rows() == 0 { 0 } else { grouped(&table.only(&[name])).len() }
}

/// Parameters that define a spectrum or a surface. They are listed even if a list of cases ties one
/// to another.
const DEFINING: [&str; 4] = [CONTENT.name, HURST.name, K_LOWER.name, K_UPPER.name];

/// Returns the parameters with several values that do not follow from others, and the numbers of
/// their values. Those that usually define a study come first. `derived` are keys that the manifest
/// computes from other keys.
pub fn independent(table: &Table, derived: &BTreeSet<String>) -> Vec<(String, usize)> {
    let parameters = table.in_role(Role::Parameter);
    let mut names = parameters.names();
    let is_free = |name: &str| DEFINING.contains(&name) && !derived.contains(name);
    // The rms slope of a measured surface is a result of its preparation.
    let is_late = |name: &str| name == RMS_SLOPE.name || derived.contains(name);
    names.sort_by_key(|name| (!is_free(name), is_late(name), rank(name)));
    let groups = |names: &[&str]| grouped(&table.only(names)).len();
    let mut known: Vec<&str> = Vec::new();
    let mut found = Vec::new();
    for name in names {
        let values = distinct(table, name);
        if values < 2 {
            continue;
        }
        let with: Vec<&str> = known.iter().copied().chain([name]).collect();
        if is_free(name) || known.is_empty() || groups(&with) > groups(&known) {
            known = with;
            found.push((name.to_owned(), values));
        }
    }
    found.sort_by_key(|(name, _)| rank(name));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::columns::NODES;
    use asperity_tables::column::{integers, reals};

    fn table(rows: &[(f64, i64, i64)]) -> Table {
        Table::new(
            rows.len(),
            vec![
                (NODES, integers(rows.iter().map(|row| row.2))),
                (HURST, reals(rows.iter().map(|row| row.0))),
                (K_UPPER, integers(rows.iter().map(|row| row.1))),
            ],
        )
    }

    fn names(rows: &[(f64, i64, i64)], derived: &[&str]) -> Vec<String> {
        let derived = derived.iter().map(|name| (*name).to_owned()).collect();
        independent(&table(rows), &derived).into_iter().map(|(name, _)| name).collect()
    }

    #[test]
    fn a_mesh_that_follows_from_the_cutoff_is_not_varied() {
        let follows = [(0.8, 8, 64), (0.8, 16, 128), (0.8, 32, 256)];
        assert_eq!(names(&follows, &["nodes"]), ["k_upper"]);
        assert_eq!(names(&follows, &[]), ["k_upper"], "tied by cases");
        assert_eq!(names(&[(0.8, 8, 64), (0.8, 8, 128)], &[]), ["nodes"]);
        assert_eq!(
            names(&[(0.8, 8, 64), (0.8, 8, 128), (0.8, 16, 128)], &[]),
            ["k_upper", "nodes"]
        );
    }

    #[test]
    fn tied_parameters_of_a_spectrum_are_both_varied_unless_one_is_derived() {
        let tied = [(0.3, 8, 64), (0.8, 16, 64)];
        assert_eq!(names(&tied, &[]), ["hurst", "k_upper"]);
        assert_eq!(names(&tied, &["k_upper"]), ["hurst"]);
    }
}
