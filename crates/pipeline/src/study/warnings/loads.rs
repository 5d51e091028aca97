//! Loads that no surface of the world needs, as those in another unit come out.

use super::super::Stage;
use asperity_stages::Recipe;
use asperity_stages::solve::{Params, PressureUnit};

/// In units of E* × rms slope: every surface is in full contact under a third of it.
const HEAVY: f64 = 10.0;
/// In the same: a single node of a great mesh bears as much.
const LIGHT: f64 = 1e-7;

/// Between which multiples of E* a mean pressure is probable, whatever the rms slope; slopes of
/// surfaces are between 1e-4 and 10.
const PRESSURES: [f64; 2] = [1e-4 * LIGHT, 10.0 * HEAVY];

/// That all loads of a stage are too heavy or too light to be meant.
pub fn improbable(stage: &Stage) -> Option<String> {
    stage.work.recipes().iter().find_map(|recipe| match recipe {
        Recipe::Solve(params) => of_block(params),
        _ => None,
    })
}

fn of_block(params: &Params) -> Option<String> {
    let (lightest, heaviest) = (*params.loads.first()?, *params.loads.last()?);
    let modulus = params.effective_modulus;
    match params.load_unit {
        PressureUnit::Relative if lightest > HEAVY => Some(format!(
            "loads are in units of E* × rms slope, and from about 2 on every node touches: {lightest} and \
             more tell nothing; `load_unit = \"absolute\"` takes them as pressures"
        )),
        PressureUnit::Relative if heaviest < LIGHT => Some(format!(
            "loads are in units of E* × rms slope, and under {heaviest} and less a node or two touch; \
             `load_unit = \"absolute\"` takes them as pressures"
        )),
        PressureUnit::Absolute if lightest > PRESSURES[1] * modulus => Some(format!(
            "all loads are pressures of {lightest} and more, and E* is {modulus}, in the same unit: every \
             node touches from less on"
        )),
        PressureUnit::Absolute if heaviest < PRESSURES[0] * modulus => Some(format!(
            "all loads are pressures of {heaviest} and less, and E* is {modulus}, in the same unit: a node \
             or two touch"
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::study::Study;

    /// What is warned of pressing by these keys.
    fn warned(keys: &str) -> Vec<String> {
        let text = format!(
            "[study]\nname = \"units\"\n[stage.rough]\nkind = \"generate\"\nnodes = 64\nhurst = 0.8\n\
             k_lower = 2\nk_upper = 8\n[stage.pressed]\nkind = \"solve\"\nfrom = \"rough\"\n{keys}"
        );
        let study =
            Study::parse(&text, "units.toml", Path::new(""), crate::study::no_claims).unwrap();
        let warnings = study.warnings().into_iter();
        let pressed = warnings.filter(|warning| warning.stage == "pressed");
        pressed.map(|warning| warning.message).collect()
    }

    #[test]
    fn pascals_taken_for_loads_are_told_and_so_are_loads_taken_for_pascals() {
        let pascals = warned("loads = { to = 5e7, steps = 4 }");
        assert!(pascals[0].contains("every node touches"), "{pascals:?}");
        let megapascals =
            "loads = [20e6, 40e6]\nload_unit = \"absolute\"\neffective_modulus = 57.0";
        assert!(warned(megapascals)[0].contains("E* is 57"));
        let reduced = "loads = [0.01, 0.1]\nload_unit = \"absolute\"\neffective_modulus = 1e11";
        assert!(warned(reduced)[0].contains("a node or two"));
        assert!(warned("loads = [1e-9, 1e-8]")[0].contains("a node or two"));
    }

    #[test]
    fn loads_from_first_touch_to_full_contact_are_no_mistake() {
        for keys in [
            "loads = [1e-9, 0.01]",
            "loads = [1.0, 30.0]",
            "loads = [1e5, 1e7]\nload_unit = \"absolute\"\neffective_modulus = 1e11",
        ] {
            assert_eq!(warned(keys), Vec::<String>::new(), "{keys}");
        }
    }
}
