//! Checks of cutoffs: in waves along the longer side, or by their wavelengths.

use std::ops::RangeInclusive;

use super::keys::RandomTable;
use super::mesh::NODES;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::written::Key;
use asperity_manifest::written::checks::{Checks, QUANTITY};

/// Cutoffs, in waves along the longer side.
pub const WAVENUMBERS: RangeInclusive<u32> = 1..=*NODES.end() / 2;

/// How far a side may be from a whole number of wavelengths, as a share of it: what twelve digits of
/// a quotient that a person writes out leave.
const ROUNDING: f64 = 1e-9;

/// A cutoff, in waves along the longer side, and what it is written as.
pub struct Cutoff<'a> {
    pub waves: u32,
    /// `k_upper = 32`, or `shortest_wavelength = 0.05`.
    pub written: String,
    pub span: &'a Span,
}

/// The lower cutoff on a cell, if its longer side is known.
pub fn lower<'t>(
    table: &'t RandomTable,
    longer_side: Option<f64>,
    checks: &mut Checks,
) -> Option<Cutoff<'t>> {
    let by_length = ("longest_wavelength", &table.longest_wavelength);
    cutoff(("k_lower", &table.k_lower), by_length, longer_side, checks)
}

/// The upper one.
pub fn upper<'t>(
    table: &'t RandomTable,
    longer_side: Option<f64>,
    checks: &mut Checks,
) -> Option<Cutoff<'t>> {
    let by_length = ("shortest_wavelength", &table.shortest_wavelength);
    cutoff(("k_upper", &table.k_upper), by_length, longer_side, checks)
}

fn cutoff<'t>(
    (name, key): (&str, &'t Key<i64>),
    (length_name, length): (&str, &'t Key<f64>),
    longer_side: Option<f64>,
    checks: &mut Checks,
) -> Option<Cutoff<'t>> {
    let Some(written) = length.written() else {
        if key.written().is_none() && checks.is_excused(length_name) {
            return None;
        }
        let waves = checks.whole(name, key, WAVENUMBERS)?;
        let span = &key.written()?.span;
        let written = format!("{name} = {waves}");
        return Some(Cutoff { waves, written, span });
    };
    let wavelength = checks.is_in(length_name, written, QUANTITY)?;
    if let Some(key) = key.written() {
        let message = format!("`{name}` and `{length_name}` exclude each other");
        let problem = Problem::new(message, written.span.clone(), "the wavelength")
            .and(key.span.clone(), "follows from it");
        checks.report(length_name, problem);
        return None;
    }
    let waves = match waves_along(longer_side?, wavelength) {
        Ok(waves) => waves,
        Err(misfit) => {
            let message = format!("`{length_name} = {wavelength}` {}", misfit.found);
            let problem = Problem::new(message, written.span.clone(), misfit.wanted);
            checks.problems.push(problem.help(
                "the surface repeats itself, so that all its waves fit the side a whole number of \
                 times",
            ));
            return None;
        }
    };
    Some(Cutoff { waves, written: format!("{length_name} = {wavelength}"), span: &written.span })
}

/// Why a wavelength is none of a surface.
struct Misfit {
    found: String,
    wanted: String,
}

/// How often a wavelength fits the longer side.
fn waves_along(longer_side: f64, wavelength: f64) -> Result<u32, Misfit> {
    let times = longer_side / wavelength;
    let waves = times.round();
    let [fewest, most] = [*WAVENUMBERS.start(), *WAVENUMBERS.end()].map(f64::from);
    let misfit = |wanted: String| Misfit {
        found: format!("fits {times:.4} times into the longer side, {longer_side}"),
        wanted,
    };
    if waves < fewest || waves > most {
        return Err(misfit(format!("must fit from {fewest} to {most} times")));
    }
    if (times / waves - 1.0).abs() <= ROUNDING {
        return Ok(waves as u32);
    }
    let around = [times.floor(), times.ceil()].into_iter();
    let around = around.filter(|waves| *waves >= fewest).map(|waves| {
        let length = decimal::nearest(longer_side / waves);
        format!("{length} ({waves} times)")
    });
    let nearest: Vec<_> = around.collect();
    Err(misfit(format!("nearest are {}", nearest.join(" and "))))
}
