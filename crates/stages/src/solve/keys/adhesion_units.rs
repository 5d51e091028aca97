//! Conversion of a work of adhesion, a range and mean gaps with units to the units of the surfaces.

use crate::check_context::Surfaces;
use crate::lengths::{converted, unit_of};
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;

/// Powers of ten that convert numbers of the manifest to the units of the surfaces. They are zero
/// for numbers without a unit, which are in these units already.
#[derive(Debug, Clone, Copy, Default)]
pub struct Conversion {
    length: i32,
    work: i32,
}

impl Conversion {
    /// Compares the units of a table with those of its surfaces and of its modulus, or returns
    /// `None` after reporting problems. `work` is the number of the work of adhesion.
    pub fn new(work: f64, surfaces: &Surfaces, checks: &mut Checks) -> Option<Conversion> {
        let units = checks.units;
        let (lengths, works) = match (&units.length, &units.work) {
            (None, None) => return Some(Conversion::default()),
            (Some(lengths), works) if works.is_some() || work == 0.0 => (lengths, works),
            (Some(lengths), _) => return one_has_none(["range", "work"], &lengths.span, checks),
            (None, Some(works)) => return one_has_none(["work", "range"], &works.span, checks),
        };
        let of_surfaces = unit_of(surfaces, &lengths.span, checks)?;
        let length = lengths.unit.power - of_surfaces.power;
        let Some(works) = works else {
            return Some(Conversion { length, work: 0 });
        };
        let Some(pressures) = &units.pressure else {
            let message = "`adhesion.work` has a unit, but the modulus of the stage has none";
            let problem = Problem::new(message, works.span.clone(), "has a unit");
            return checks.reject(problem.help(
                "give E* with a unit, such as `effective_modulus = \"70 GPa\"`, or the `bodies`",
            ));
        };
        let work = works.unit.power - pressures.unit.power - of_surfaces.power;
        Some(Conversion { length, work })
    }

    /// Compares the unit of the lengths of a table with that of its surfaces, or returns `None`
    /// after reporting a problem.
    pub fn of_lengths(surfaces: &Surfaces, checks: &mut Checks) -> Option<Conversion> {
        let Some(lengths) = &checks.units.length else { return Some(Conversion::default()) };
        let of_surfaces = unit_of(surfaces, &lengths.span, checks)?;
        Some(Conversion { length: lengths.unit.power - of_surfaces.power, work: 0 })
    }

    /// Converts a length of the manifest to the unit of the surfaces.
    pub fn length(self, length: f64) -> f64 {
        converted(length, self.length)
    }

    /// Converts a work per area to the unit of the modulus times the unit of the surfaces.
    pub fn work(self, work: f64) -> f64 {
        converted(work, self.work)
    }
}

/// Reports that the first of two keys of `adhesion` has a unit and the second has none.
fn one_has_none<T>([with, without]: [&str; 2], span: &Span, checks: &mut Checks) -> Option<T> {
    let message = format!("`adhesion.{with}` has a unit, but `adhesion.{without}` has none");
    let problem = Problem::new(message, span.clone(), "has a unit");
    checks.reject(problem.help(
        "write both with units, such as `adhesion = { work = \"50 mJ/m^2\", range = \"2 nm\" }`, \
         or neither",
    ))
}
