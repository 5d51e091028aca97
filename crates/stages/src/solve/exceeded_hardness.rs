//! Warnings about elastic results with pressures above the hardness of the bodies.
//!
//! A manifest can give the hardness of a body to a stage that does not limit the pressure. The
//! hardness then has no effect on the results, but the warning lists the loads under which the
//! material would yield.

use std::collections::BTreeMap;

use crate::Recipe;
use crate::columns::{LOAD, PEAK_PRESSURE, PRESSURE, PRESSURE_UNIT};
use crate::ensemble::load_column;
use crate::units::pressure_unit;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::counted;
use asperity_manifest::keys::quantity;
use asperity_tables::table::{Table, TableError};

/// Relative rounding error that is tolerated when a peak pressure is compared with a hardness.
const ROUNDING: f64 = 1e-9;

/// Returns the smallest hardness among the bodies of a recipe that does not limit the pressure.
pub fn unused_hardness(recipe: &Recipe) -> Option<f64> {
    match recipe {
        Recipe::Solve(params) => params.bodies.softest,
        _ => None,
    }
}

/// Loads whose peak pressure exceeds a hardness.
struct Passed {
    loads: usize,
    /// Row of the smallest of these loads.
    lightest: usize,
    peak: f64,
}

/// Returns the warnings about a table of solved loads, one for each hardness that pressures exceed.
/// `hardness_of` returns the hardness of the bodies of a row, if it is known.
///
/// # Errors
/// Returns an error if the table is not one of solved loads.
pub fn warnings(
    table: &Table,
    hardness_of: impl Fn(usize) -> Option<f64>,
) -> Result<Vec<String>, TableError> {
    let symbol = pressure_unit(table);
    let unit = symbol.as_deref();
    // A manifest without units takes plain numbers, also if they are assumed to be pascals.
    let takes_unit = table.has(PRESSURE_UNIT.name);
    let [loads, means, peaks] = [LOAD, PRESSURE, PEAK_PRESSURE].map(|column| column.name);
    let (loads, means, peaks) = (table.reals(loads)?, table.reals(means)?, table.reals(peaks)?);
    let are_pressures = load_column(table) == PRESSURE.name;
    let given = if are_pressures { means } else { loads };
    let (mut rows, mut passed) = (0, BTreeMap::<u64, Passed>::new());
    for row in 0..table.rows() {
        let Some(hardness) = hardness_of(row) else { continue };
        rows += 1;
        let peak = peaks.value(row);
        if peak <= hardness * (1.0 + ROUNDING) {
            continue;
        }
        // Positive numbers are ordered like their bits, which serve as keys.
        let exceeded =
            passed.entry(hardness.to_bits()).or_insert(Passed { loads: 0, lightest: row, peak });
        exceeded.loads += 1;
        exceeded.peak = exceeded.peak.max(peak);
        if given.value(row) < given.value(exceeded.lightest) {
            exceeded.lightest = row;
        }
    }
    let lines = passed.into_iter().map(|(hardness, passed)| {
        let hardness = f64::from_bits(hardness);
        let Passed { loads: number, lightest, peak } = passed;
        let mean = quantity::written(rounded(means.value(lightest)), unit);
        let load = if are_pressures {
            mean
        } else {
            let load = decimal::written(rounded(loads.value(lightest)));
            format!("{load} (mean pressure {mean})")
        };
        format!(
            "the peak pressure exceeds the hardness of the bodies, {}, under {number} of {} \
             and reaches {}; the lightest of these loads is {load}; a real material would yield \
             there, but these results are elastic: set `hardness = {}` in the stage to limit the \
             pressure",
            quantity::written(hardness, unit),
            counted(rows, "load"),
            quantity::written(rounded(peak), unit),
            match takes_unit {
                true => format!("{:?}", quantity::written(hardness, unit)),
                false => decimal::written(hardness),
            },
        )
    });
    Ok(lines.collect())
}

/// Rounds a number to four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::EFFECTIVE_MODULUS;
    use crate::reduced_units::PressureUnit;
    use asperity_tables::column::{reals, texts};

    #[test]
    fn the_lightest_load_that_passes_is_named_and_equal_but_for_rounding_is_not_beyond() {
        let table = |unit: PressureUnit| {
            let [load, pressure] = unit.load_columns();
            Table::new(
                4,
                vec![
                    (load, reals([0.2, 0.1, 0.3, 0.4])),
                    (pressure, reals([2.0, 1.0, 3.0, 4.0])),
                    (PEAK_PRESSURE, reals([7.0, 6.0, 5.0 + 1e-12, 9.0])),
                ],
            )
        };
        let hardness = |row: usize| (row < 3).then_some(5.0);
        let absolute = table(PressureUnit::Absolute);
        let named = absolute.with(vec![(PRESSURE_UNIT, texts(["MPa"; 4]))]);
        let in_unit = warnings(&named, hardness).unwrap();
        assert!(in_unit[0].contains("the lightest of these loads is 1 MPa;"), "{in_unit:?}");
        assert!(in_unit[0].contains("`hardness = \"5 MPa\"`"), "{in_unit:?}");
        let assumed = absolute.with(vec![(EFFECTIVE_MODULUS, reals([2e11; 4]))]);
        let in_pascals = warnings(&assumed, hardness).unwrap();
        assert!(in_pascals[0].contains("the lightest of these loads is 1 Pa;"), "{in_pascals:?}");
        assert!(in_pascals[0].contains("`hardness = 5`"), "{in_pascals:?}");
        let reduced = table(PressureUnit::Relative);
        let lines = warnings(&reduced, hardness).unwrap();
        let [message] = lines.as_slice() else { panic!("{lines:?}") };
        for part in [
            "under 2 of 3 loads",
            "the lightest of these loads is 0.1 (mean pressure 1)",
            "reaches 7;",
            "`hardness = 5`",
        ] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}
