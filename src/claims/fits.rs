//! Claims on fitted parameters: κ, the growth of the mean pressure, and the mesh's coefficient.

use std::f64::consts::PI;

use arrow::array::{Array, AsArray};

use super::evidence::{COUNTED, Evidence, OF_2017};
use super::intervals::{Bound, FEWEST_SURFACES, RESAMPLING, widened};
use super::quantities::{data, judged};
use super::{Claim, Expectation, Outcome};
use crate::contact::correction::{PI_OVER_EIGHT, YASTREBOV_2017};
use crate::contact::law::KAPPA_BGT;
use crate::store::table::Table;

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let mut claims = Vec::new();
    for correction in [COUNTED, OF_2017] {
        claims.push(least_convex_kappa(evidence, correction));
        claims.push(pressure_growth(evidence, correction));
    }
    claims.extend(mesh_coefficient(evidence));
    claims
}

fn least_convex_kappa(evidence: &Evidence, correction: &str) -> Claim {
    let asked = |table: &Table, row: usize| {
        text(table, "kappa_is", row) == Some("minimal-convex")
            && text(table, "correction", row).unwrap_or(COUNTED) == correction
    };
    let mut bounds = estimates(evidence, "kappa", 1.0 / KAPPA_BGT, &asked);
    // One κ is common to all curves; the first row has it.
    bounds.truncate(1);
    for (bound, _) in &mut bounds {
        bound.label = "κ/√(2π)".to_owned();
    }
    Claim {
        name: "least-convex-kappa",
        says: "Fitted slopes of all spectra are convex from κ = 1.055 √(2π) on; taken here to two \
               per cent.",
        data: data(correction).to_owned(),
        outcome: outcome(
            bounds,
            Expectation::Within(1.034, 1.076),
            "a `fit` stage with `kappa = \"minimal-convex\"` and `to = \"slope\"`",
        ),
    }
}

fn pressure_growth(evidence: &Evidence, correction: &str) -> Claim {
    let asked =
        |table: &Table, row: usize| text(table, "correction", row).unwrap_or(COUNTED) == correction;
    Claim {
        name: "exponent-of-pressure-growth",
        says: "The mean contact pressure grows as dp̄/dp₀ ∝ a^m, m between −0.9 and −0.7.",
        data: data(correction).to_owned(),
        outcome: outcome(
            estimates(evidence, "exponent", 1.0, &asked),
            Expectation::Within(-0.9, -0.7),
            "a `fit` stage with `law = \"mean-pressure\"`",
        ),
    }
}

fn mesh_coefficient(evidence: &Evidence) -> [Claim; 3] {
    let asked =
        |table: &Table, row: usize| text(table, "pooled", row) == Some("surfaces and loads");
    let needs = "a `fit` stage with `law = \"mesh-convergence\"` over surfaces on several `nodes`";
    let claim = |name, says, scale: f64, expected| Claim {
        name,
        says,
        data: "area on several meshes".to_owned(),
        outcome: outcome(
            estimates(evidence, "mesh_coefficient", scale, &asked),
            expected,
            needs,
        ),
    };
    [
        claim(
            "correction-of-2015-is-right",
            "The area is too large by (π/8) S_d Δx, to 15 % (the share found, over π/8).",
            1.0 / PI_OVER_EIGHT,
            Expectation::Within(0.85, 1.15),
        ),
        claim(
            "correction-of-2015-helps",
            "Corrected by (π/8) S_d Δx, the area is nearer to the truth than counted: the share \
             found is more than half of π/8.",
            8.0 / PI,
            Expectation::Within(0.5, f64::INFINITY),
        ),
        claim(
            "correction-of-2017-is-right",
            "The area is too large by ((π − 1 + ln 2)/24) S_d Δx, to 15 % (the share found, over \
             that).",
            1.0 / YASTREBOV_2017,
            Expectation::Within(0.85, 1.15),
        ),
    ]
}

fn outcome(bounds: Vec<(Bound, f64)>, expected: Expectation, needs: &str) -> Outcome {
    if bounds.is_empty() {
        let enough = format!("with intervals from {FEWEST_SURFACES} surfaces or more");
        return Outcome::NotComputed(format!("{needs}, {enough}"));
    }
    judged(expected, Some(&widened(bounds)))
}

/// A fitted parameter with its interval and the interval's level, of the rows that are asked for;
/// failed fits have none.
fn estimates(
    evidence: &Evidence,
    name: &str,
    scale: f64,
    asked: &impl Fn(&Table, usize) -> bool,
) -> Vec<(Bound, f64)> {
    let mut bounds = Vec::new();
    for stage in evidence.fits.iter().filter(|stage| stage.table.has(name)) {
        let (table, level) = (&stage.table, stage.level.unwrap_or(RESAMPLING.level));
        let real = |name: &str, row: usize| {
            let column = table.reals(name).ok()?;
            column.is_valid(row).then(|| scale * column.value(row))
        };
        let surfaces = table.integers("surfaces").ok();
        let is_enough =
            |row: usize| surfaces.is_none_or(|counts| counts.value(row) >= FEWEST_SURFACES as i64);
        for row in (0..table.rows()).filter(|&row| asked(table, row) && is_enough(row)) {
            let found = real(name, row)
                .zip(real(&format!("{name}_lower"), row))
                .zip(real(&format!("{name}_upper"), row));
            if let Some(((value, lower), upper)) = found {
                let label = cutoffs(table, row);
                let bound = Bound {
                    label,
                    value,
                    lower,
                    upper,
                };
                bounds.push((bound, level));
            }
        }
    }
    bounds
}

fn cutoffs(table: &Table, row: usize) -> String {
    let whole = |name: &str| {
        let column = table.integers(name).ok()?;
        Some(format!("{name} {}", column.value(row)))
    };
    let known = ["k_lower", "k_upper"].into_iter().filter_map(whole);
    known.collect::<Vec<_>>().join(", ")
}

fn text<'a>(table: &'a Table, name: &str, row: usize) -> Option<&'a str> {
    let column = table.batch().column_by_name(name)?.as_string_opt::<i32>()?;
    column.is_valid(row).then(|| column.value(row))
}
