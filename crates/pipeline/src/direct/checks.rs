//! Checks of the keys of single stages, as in a manifest.

use std::path::Path;
use std::sync::Arc;

use toml::Table as Keys;

use crate::study::Study;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{ManifestErrors, listed};
use asperity_manifest::keys::quantity::{self, Dimension, Unit};
use asperity_mechanics::grid::Grid;
use asperity_stages::measure::{self, friction};
use asperity_stages::nominal_area::NominalArea;
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::{Recipe, solve};

/// Problems with the keys of a stage, each with what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("\n"))]
pub struct KeyErrors(Vec<String>);

impl From<ManifestErrors> for KeyErrors {
    fn from(errors: ManifestErrors) -> KeyErrors {
        KeyErrors(errors.problems().iter().map(ToString::to_string).collect())
    }
}

/// Returns the parameters of the single surface that these keys of a `generate` stage describe, and
/// the warnings about it.
pub fn surface(keys: &Keys) -> Result<(PlannedSurfaces, Vec<String>), KeyErrors> {
    let study = study(vec![("surface", stage("generate", keys))])?;
    let warnings = study.warnings().into_iter().map(|warning| warning.message).collect();
    match study.stages[0].work.surfaces() {
        [one] => Ok((one.clone(), warnings)),
        several => Err(expected_one(several.len(), "surfaces")),
    }
}

/// Parameters whose keys have been checked: those of a `solve` stage, and those of a `measure`
/// stage with `friction` that reads it.
#[derive(Debug)]
pub struct Checked {
    pub contact: CheckedContact,
    pub friction: Option<friction::Params>,
    pub warnings: Vec<String>,
}

/// Parameters of a contact whose keys have been checked.
#[derive(Debug)]
pub enum CheckedContact {
    /// Parameters of the branches of a path of loads; a single one without a path.
    Branches(Vec<Arc<solve::Params>>),
    /// Parameters of a path with adhesion.
    Path(Arc<solve::adhesion::Params>),
}

/// Checks the keys of a `solve` stage for a surface on this grid. `unit` is the unit of its heights
/// and sides, or empty.
pub fn checked(keys: &Keys, grid: Grid, unit: &str) -> Result<Checked, KeyErrors> {
    let mut contact = stage("solve", keys);
    contact.insert("from".to_owned(), "surface".into());
    let slip = contact.remove("friction").map(|friction| {
        let keys = [("from", "contact".into()), ("friction", friction)];
        stage("measure", &keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect())
    });
    let surface = stage("generate", &placeholder_surface(grid, unit));
    let stages = [("surface", surface), ("contact", contact)];
    let study = study(stages.into_iter().chain(slip.map(|slip| ("slip", slip))).collect())?;
    let recipes = study.stages[1].work.recipes();
    // The placeholder has another nominal area than the surface.
    let area = NominalArea::new(grid, unit);
    let contact = match recipes {
        // `Pressing` solves for pressures of nodes and knows no asperity models.
        [Recipe::Solve(params), ..] if params.asperities.is_some() => {
            return Err(KeyErrors(vec![
                "`method = \"asperities\"` is available only in a stage of a manifest; write a \
                 manifest and run it"
                    .to_owned(),
            ]));
        }
        [Recipe::Adhesion(params)] => CheckedContact::Path(Arc::new(params.on_area(&area))),
        _ => match branches(recipes) {
            Some(branches) => CheckedContact::Branches(
                branches.iter().map(|branch| Arc::new(branch.on_area(&area))).collect(),
            ),
            None => return Err(expected_one(recipes.len(), "parameter points")),
        },
    };
    let friction = match study.stages.get(2).map(|slip| slip.work.recipes()) {
        None => None,
        Some([Recipe::Measure(measure::Params::Friction(friction))]) => Some(friction.clone()),
        Some(several) => return Err(expected_one(several.len(), "values of `friction`")),
    };
    let mut warnings = study.warnings_of_contact(&study.stages[1]);
    warnings.extend(study.stages.get(2).and_then(|slip| study.dissimilar_bodies(slip)));
    Ok(Checked { contact, friction, warnings })
}

/// Returns the branches of a path, or the only contact. Returns `None` if the recipes are several
/// parameter points.
fn branches(recipes: &[Recipe]) -> Option<Vec<Arc<solve::Params>>> {
    let params = recipes.iter().map(|recipe| match recipe {
        Recipe::Solve(params) => Some(params.clone()),
        _ => None,
    });
    let branches = params.collect::<Option<Vec<_>>>()?;
    let first = branches.first()?;
    let is_path = first.branch.is_some();
    let are_one = branches.iter().all(|branch| branch.is_same_contact(first));
    (branches.len() == 1 || is_path && are_one).then_some(branches)
}

/// Returns the keys of a surface with the spacing of `grid`, which the check of a `solve` stage
/// requires. The rms slope of this surface is unknown until the surface is generated. The mesh of
/// an adhesive contact is therefore checked, but no check depends on the heights.
pub fn placeholder_surface(grid: Grid, unit: &str) -> Keys {
    const NODES: u8 = 16;
    let [along_x, along_y] = grid.spacing();
    let keys = [
        ("method", toml::Value::from("wave")),
        ("nodes", NODES.into()),
        ("side", (f64::from(NODES) * along_x.max(along_y)).into()),
        ("amplitude", 1.0.into()),
        ("unit", unit.into()),
    ];
    keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
}

/// Reads a length with a unit, as [`length`](super::length).
pub fn length(text: &str, unit: Option<&str>) -> Result<(f64, String), KeyErrors> {
    let wrong = |message: String| KeyErrors(vec![message]);
    let of_length = |name: &str| {
        let unit = Unit::find(name).filter(|unit| unit.dimension == Dimension::Length);
        let units = listed(Dimension::Length.names(), "and");
        unit.ok_or_else(|| wrong(format!("`{name}` is no unit of length; these are {units}")))
    };
    let (number, own) = quantity::split(text).ok_or_else(|| {
        wrong(format!("{text:?} is no length; give a number, or a text such as \"100 um\""))
    })?;
    let own = of_length(own)?;
    let (wanted, name) = match unit {
        Some(unit) => (of_length(unit)?, unit),
        None => (own, own.symbol),
    };
    Ok((decimal::shifted(number, own.power - wanted.power), name.to_owned()))
}

/// Returns the keys of a stage with its kind added.
pub fn stage(kind: &str, keys: &Keys) -> Keys {
    let mut table = keys.clone();
    table.insert("kind".to_owned(), kind.into());
    table
}

/// Returns the study of these stages, if their keys are valid.
pub fn study(stages: Vec<(&str, Keys)>) -> Result<Study, KeyErrors> {
    let named = stages.into_iter().map(|(name, table)| (name.to_owned(), toml::Value::from(table)));
    let name = Keys::from_iter([("name".to_owned(), toml::Value::from("direct"))]);
    let manifest = Keys::from_iter([
        ("study".to_owned(), toml::Value::from(name)),
        ("stage".to_owned(), toml::Value::from(Keys::from_iter(named))),
    ]);
    let text = toml::to_string(&manifest).expect("a table of TOML can be written");
    Ok(Study::parse(&text, "keys", Path::new(""))?)
}

/// Returns the error that the keys describe several things instead of one.
pub fn expected_one(found: usize, what: &str) -> KeyErrors {
    KeyErrors(vec![format!(
        "the keys describe {found} {what}, but exactly one is expected; only manifests sweep lists"
    )])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Keys {
        text.parse().unwrap()
    }

    /// Checks the keys of a `solve` stage for a mesh of 64 × 64 nodes.
    fn checked(text: &str) -> Result<Checked, KeyErrors> {
        super::checked(&table(text), Grid::square(64, 2.0).unwrap(), "µm")
    }

    #[test]
    fn what_is_wrong_with_keys_is_told_as_in_a_manifest() {
        let keys = table("nodes = 64\nhurst = 1.7\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("`hurst`") && message.contains("1.7"), "{message}");
        let message = checked("loads = [0.1, -0.2]").unwrap_err().to_string();
        assert!(message.contains("`loads`") && message.contains("-0.2"), "{message}");
    }

    #[test]
    fn several_points_are_not_one() {
        let keys = table("nodes = 64\nhurst = [0.7, 0.8]\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("2 surfaces"), "{message}");
    }

    #[test]
    fn asperities_are_not_pressed_as_if_every_node_were_solved() {
        let keys = "loads = [0.1]\nmethod = \"asperities\"";
        let message = checked(keys).unwrap_err().to_string();
        assert!(message.contains("`method = \"asperities\"`"), "{message}");
    }

    #[test]
    fn a_hardness_in_either_unit_is_held_against_no_slope() {
        let checked = checked("loads = [0.1]\nhardness = 1e-9").unwrap();
        let CheckedContact::Branches(branches) = &checked.contact else { panic!("loads") };
        assert!(branches.len() == 1 && branches[0].hardness.is_some());
    }

    #[test]
    fn branches_of_a_path_are_one_contact_and_swept_values_are_several() {
        let keys = "loads = [0.1, 0.2, 0.1]\nhardness = 0.5\npath = \"as-given\"";
        let CheckedContact::Branches(branches) = checked(keys).unwrap().contact else {
            panic!("loads")
        };
        assert_eq!(branches.len(), 2);
        for keys in [&keys.replace("0.5", "[0.5, 0.6]"), "loads = [0.1]\nhardness = [0.5, 0.6]"] {
            let message = checked(keys).unwrap_err().to_string();
            assert!(message.contains("parameter points"), "{message}");
        }
    }

    #[test]
    fn lengths_have_their_unit_or_that_of_the_map() {
        assert_eq!(length("100 um", None), Ok((100.0, "µm".to_owned())));
        assert_eq!(length("100 um", Some("m")), Ok((1e-4, "m".to_owned())));
        assert_eq!(length("0.1 mm", Some("um")), Ok((100.0, "um".to_owned())));
        for (text, unit, part) in [
            ("100", None, "is no length"),
            ("100 MPa", None, "`MPa` is no unit of length"),
            ("1 m", Some("px"), "`px` is no unit of length"),
        ] {
            let message = length(text, unit).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn pressures_with_and_without_units_are_treated_as_in_a_manifest() {
        let steel = "bodies = [{ youngs_modulus = \"210 GPa\", poisson_ratio = 0.3 }]";
        let with = |loads: &str| checked(&format!("{steel}\n{loads}"));
        let plain = with("load_unit = \"absolute\"\nloads = [50]").unwrap_err().to_string();
        assert!(plain.contains("the load 50 has no unit, but another pressure has one"), "{plain}");
        assert!(with("loads = [50, \"50 MPa\"]").is_err());
        let given = with("loads = [\"50 MPa\"]").unwrap();
        assert!(given.warnings.is_empty(), "{:?}", given.warnings);
        let unsorted = with("loads = [\"50 MPa\", \"1 MPa\"]").unwrap().warnings;
        assert!(unsorted[0].contains("`loads` is out of order"), "{unsorted:?}");
        let CheckedContact::Path(params) = with(
            "adhesion = { work = \"50 mJ/m^2\", range = \"20 nm\" }\ncontrol = \"gap\"\n\
                  gaps = [\"100 nm\"]",
        )
        .unwrap()
        .contact
        else {
            panic!("a path")
        };
        assert_eq!((params.range, params.targets[0]), (0.02, 0.1));
    }

    #[test]
    fn forces_are_borne_by_the_area_of_the_map_and_not_of_another() {
        let pressed = |nodes: usize, loads: &str| {
            let grid = Grid::square(nodes, 100.0).unwrap();
            let keys = format!("effective_modulus = \"70 GPa\"\n{loads}").parse().unwrap();
            let CheckedContact::Branches(branches) =
                super::checked(&keys, grid, "um").unwrap().contact
            else {
                panic!("a contact without adhesion")
            };
            (branches[0].loads.clone(), branches[0].newtons)
        };
        // 1 N on (100 µm)² is 100 MPa.
        for nodes in [32, 100] {
            let expected = (vec![0.1, 0.2], Some(10.0));
            assert_eq!(pressed(nodes, "loads = [\"1 N\", \"2 N\"]"), expected);
            assert_eq!(pressed(nodes, "control = \"gap\"\ngaps = [\"1 um\"]").1, Some(10.0));
        }
    }

    #[test]
    fn the_mesh_of_the_surface_and_not_another_is_checked_for_adhesion() {
        let rho =
            |range: f64| format!("adhesion = {{ work = 3e-4, range = {range} }}\nloads = [0.1]");
        // Δx w/(E* ρ²) = 1/32 · 3e-4/ρ².
        assert!(checked(&rho(0.006)).unwrap().warnings.is_empty());
        let warnings = checked(&rho(0.005)).unwrap().warnings;
        assert!(warnings[0].contains("mesh step × work/(E* × range²) is 0.37"), "{warnings:?}");
        let message = checked(&rho(0.002)).unwrap_err().to_string();
        assert!(message.contains("too coarse for the adhesion"), "{message}");
    }
}
