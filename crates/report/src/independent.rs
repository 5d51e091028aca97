//! Parameters that a study varies independently of each other.

use std::collections::BTreeSet;

use asperity_stages::columns::{CONTENT, HURST, K_LOWER, K_UPPER, RMS_SLOPE};
use asperity_stages::ensemble::grouped;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

use crate::plotted::rank;

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
        let values = if table.rows() == 0 { 0 } else { groups(&[name]) };
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
