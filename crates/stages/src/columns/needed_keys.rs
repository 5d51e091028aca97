//! Keys of `solve` stages that add columns to the tables of contacts.

use super::*;

/// Keys of a `solve` stage, and the columns that its table and those of `measure` stages after it
/// have only with these keys.
const ADDED: [(&str, &[Column]); 7] = [
    ("`stiffness = true`", &CONDUCTANCE),
    ("`flow = true`", &FLOW),
    ("a `hardness`", &[SATURATED_NODES, SATURATED_FRACTION, MEAN_YIELDED_DEPTH]),
    ("`stiffness = true` and a `hardness`", &[UNLOADING_STIFFNESS]),
    ("`stiffness = true` and the `conductivity` of the `bodies` or of a `layer`", &THERMAL),
    ("`stiffness = true` and the `resistivity` of the `bodies` or of a `layer`", &ELECTRICAL),
    ("a `layer` on a rigid base", &LAYER_RESULTS),
];

/// Returns the label of a missing column that a key of a `solve` stage adds. Returns `None` if the
/// column needs no key, or if the study has columns of this key, so that the column is missing for
/// another reason. `is_known` tells which columns the study has.
pub fn needed_key(column: &str, is_known: impl Fn(&str) -> bool) -> Option<String> {
    let is_added = |columns: &[Column]| columns.iter().any(|added| added.name == column);
    let (key, added) = ADDED.iter().find(|(_, columns)| is_added(columns))?;
    // `stiffness` was the name of the finite difference, which is suggested if the study has it.
    let is_old_name = column == FROZEN_STIFFNESS.name && is_known(STIFFNESS.name);
    let is_missing = !is_old_name && !added.iter().any(|column| is_known(column.name));
    is_missing.then(|| format!("needs {key} in the `solve` stage"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_name_the_key_that_adds_them_unless_the_study_has_the_key() {
        let solved = |known: &'static [&str]| move |column: &str| known.contains(&column);
        let key = needed_key("contact_conductance", solved(&["contact_nodes"]));
        assert_eq!(key.as_deref(), Some("needs `stiffness = true` in the `solve` stage"));
        assert_eq!(needed_key("contact_conductance", solved(&["stiffness"])), None);
        assert_eq!(needed_key("stiffness", solved(&["stiffness_finite_difference"])), None);
        assert_eq!(needed_key("contact_nodes", solved(&[])), None);
        let key = needed_key("thermal_conductance", solved(&["stiffness"])).unwrap();
        assert!(key.contains("`conductivity` of the `bodies`"), "{key}");
    }
}
