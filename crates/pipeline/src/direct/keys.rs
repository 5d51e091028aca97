//! The keys of one stage, checked as those of a manifest are.

use std::path::Path;

use toml::{Table, Value};

use crate::study::{Study, Work};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_stages::generate::growth::PlannedSurfaces;
use asperity_stages::{Recipe, solve};

/// What is wrong with keys, each with what would do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("\n"))]
pub struct KeyErrors(Vec<String>);

impl From<ManifestErrors> for KeyErrors {
    fn from(errors: ManifestErrors) -> KeyErrors {
        KeyErrors(errors.problems().iter().map(ToString::to_string).collect())
    }
}

/// The surface that these keys of a `generate` stage describe.
pub fn surface(keys: &Table) -> Result<PlannedSurfaces, KeyErrors> {
    let study = study([("surface", stage("generate", keys))])?;
    match &study.stages[0].work {
        Work::Generate(surfaces) => match surfaces.as_slice() {
            [one] => Ok(one.clone()),
            several => Err(not_one(several.len(), "surfaces")),
        },
        Work::Evaluate(_) => unreachable!("a `generate` stage makes surfaces"),
    }
}

/// The block of loads that these keys of a `solve` stage describe, on any surface.
pub fn block(keys: &Table) -> Result<solve::Params, KeyErrors> {
    let mut contact = stage("solve", keys);
    contact.insert("from".to_owned(), "surface".into());
    let study = study([("surface", stage("generate", &anything())), ("contact", contact)])?;
    match study.stages[1].work.recipes() {
        // Its rows would be those of another method than the keys ask for.
        [Recipe::Solve(block)] if block.asperities.is_some() => {
            Err(KeyErrors(vec!["`method = \"asperities\"` is for stages of a manifest".to_owned()]))
        }
        [Recipe::Solve(block)] if block.flow => {
            Err(KeyErrors(vec!["`flow = true` is for stages of a manifest".to_owned()]))
        }
        [Recipe::Solve(block)] => Ok(block.as_ref().clone()),
        several => Err(not_one(several.len(), "blocks of loads")),
    }
}

/// A surface on which no check of loads depends: one whose slope is not known beforehand.
fn anything() -> Table {
    let keys = [("method", Value::from("wave")), ("nodes", 16.into()), ("amplitude", 1.0.into())];
    keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
}

/// The table of a stage of this kind.
fn stage(kind: &str, keys: &Table) -> Table {
    let mut table = keys.clone();
    table.insert("kind".to_owned(), kind.into());
    table
}

fn study<const N: usize>(stages: [(&str, Table); N]) -> Result<Study, KeyErrors> {
    let named = stages.map(|(name, table)| (name.to_owned(), Value::from(table)));
    let name = Table::from_iter([("name".to_owned(), Value::from("direct"))]);
    let manifest = Table::from_iter([
        ("study".to_owned(), Value::from(name)),
        ("stage".to_owned(), Value::from(Table::from_iter(named))),
    ]);
    let text = toml::to_string(&manifest).expect("a table of TOML can be written");
    Ok(Study::parse(&text, "keys", Path::new(""), crate::study::no_claims)?)
}

fn not_one(found: usize, what: &str) -> KeyErrors {
    KeyErrors(vec![format!(
        "the keys describe {found} {what}, one is asked for: lists are swept in a manifest alone"
    )])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        text.parse().unwrap()
    }

    #[test]
    fn what_is_wrong_with_keys_is_told_as_in_a_manifest() {
        let keys = table("nodes = 64\nhurst = 1.7\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("`hurst`") && message.contains("1.7"), "{message}");
        let message = block(&table("loads = [0.2, 0.1]")).unwrap_err().to_string();
        assert!(message.contains("ascend"), "{message}");
    }

    #[test]
    fn several_points_are_not_one() {
        let keys = table("nodes = 64\nhurst = [0.7, 0.8]\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("2 surfaces"), "{message}");
    }

    #[test]
    fn asperities_are_not_pressed_as_if_every_node_were_solved() {
        let keys = table("loads = [0.1]\nmethod = \"asperities\"");
        let message = block(&keys).unwrap_err().to_string();
        assert!(message.contains("`method = \"asperities\"`"), "{message}");
    }

    #[test]
    fn a_hardness_in_either_unit_is_held_against_no_slope() {
        let keys = table("loads = [0.1]\nhardness = 1e-9");
        assert!(block(&keys).unwrap().hardness.is_some());
    }
}
