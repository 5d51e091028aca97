//! Results in other units of length and pressure.

use crate::bench::{Bench, STUDY};

/// Returns dimensionless columns of a study in other units: Nayak's parameters and loads at full
/// contact, and the areas.
fn without_units(side: &str, rms_slope: &str, effective_modulus: &str) -> (Vec<f64>, Vec<f64>) {
    let units = format!("nodes = 32\nside = {side}\nrms_slope = {rms_slope}");
    let modulus = format!("from = \"surfaces\"\neffective_modulus = {effective_modulus}");
    let study = STUDY.replace("nodes = 32", &units).replace("from = \"surfaces\"", &modulus);
    let bench = Bench::new();
    bench.run(&study);
    let reals = |stage: &str, column: &str| {
        let table = bench.table("small", stage);
        table.reals(column).unwrap().values().to_vec()
    };
    let surfaces = ["nayak", "full_contact_load"].map(|column| reals("surfaces", column));
    (surfaces.concat(), reals("area", "area_fraction"))
}

#[test]
fn what_has_no_unit_is_the_same_at_the_ends_of_the_units_that_may_be_chosen() {
    let (surfaces, areas) = without_units("1", "1", "1");
    for units in [
        ["1e30", "1e-30", "1e30"],
        ["1e-30", "1e30", "1e-30"],
        ["1e-30", "1e-30", "1e-30"],
        ["1e30", "1e30", "1e30"],
    ] {
        let [side, rms_slope, effective_modulus] = units;
        let (scaled_surfaces, scaled_areas) = without_units(side, rms_slope, effective_modulus);
        for (scaled, plain) in scaled_surfaces.iter().zip(&surfaces) {
            // The tolerance covers the rounding of some dozen operations.
            assert!((scaled / plain - 1.0).abs() < 1e-13, "{units:?}");
        }
        assert_eq!(scaled_areas, areas, "{units:?}");
    }
}
