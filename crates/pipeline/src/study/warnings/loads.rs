//! Warnings about loads and moduli whose units are probably not the ones that the user meant.

use crate::study::summary::{rms_slope, solved};
use crate::study::units::modulus;
use crate::study::{Stage, Study};
use asperity_manifest::decimal;
use asperity_manifest::keys::quantity::{self, Dimension, Unit};
use asperity_mechanics::grid::Boundary;
use asperity_stages::reduced_units::PressureUnit;
use asperity_stages::surface::{Origin, Params};
use asperity_stages::{Recipe, solve};

/// Load in units of E* × rms slope above which loads are probably a mistake for surfaces whose
/// heights are not Gaussian. It is about five times the load of full contact of other surfaces.
const HEAVY: f64 = 10.0;
/// Smallest plausible load in units of E* × rms slope. On a large mesh, a single node can bear it.
const LIGHT: f64 = 1e-7;

/// Smallest and largest plausible rms slope of a surface whose slope is not known.
const SLOPES: [f64; 2] = [1e-4, 10.0];

/// Largest plausible E* in pascals, about twice that of diamond.
const STIFFEST: f64 = 2e12;

impl Study {
    /// Warns of loads without a unit in a stage whose other pressures have one.
    pub(super) fn plain_loads(&self, stage: &Stage) -> Option<String> {
        let mut lacking = stage.work.recipes().iter().filter_map(|recipe| match recipe {
            Recipe::Solve(params) if params.listed.lack_unit => {
                Some((&params.loads, params.effective_modulus, params.pressure_unit?))
            }
            Recipe::Adhesion(params) if params.loads_lack_unit => {
                Some((&params.targets, params.effective_modulus, params.pressure_unit?))
            }
            _ => None,
        });
        let (loads, modulus, unit) = lacking.next()?;
        let load = loads.iter().copied().max_by(|one, other| one.abs().total_cmp(&other.abs()))?;
        let pressures = self.pressed_slopes(stage).and_then(|slopes| {
            let pressures = slopes.map(|slope| load * modulus * slope);
            quantity::range(pressures.into_iter(), Some(unit))
        });
        let pressure = pressures.map_or_else(String::new, |shown| format!(", here {shown},"));
        let number = decimal::written(load);
        Some(format!(
            "`loads` have no unit, but other pressures have one; {number} is read as {number} × E* \
             × rms slope{pressure} and not as {number} {unit}; write \"{number} {unit}\" if it is a \
             pressure, or `load_unit = \"relative\"` if not"
        ))
    }

    /// Warns if all loads of a stage are so large that every node touches, or too small to be
    /// intended.
    pub(super) fn improbable_loads(&self, stage: &Stage) -> Option<String> {
        let mut contacts = stage.work.recipes().iter().filter_map(solved);
        let closing = self.surfaces_read_by(stage).map(full_contact).reduce(f64::max);
        contacts.find_map(|params| {
            improbable(params, self.pressed_slopes(stage), closing.unwrap_or(HEAVY))
        })
    }

    /// Returns the warnings about a contact that is solved without a study, except those that
    /// [`improbable_contact`] gives.
    pub(crate) fn warnings_of_contact(&self, stage: &Stage) -> Vec<String> {
        let messages = [
            self.plain_loads(stage),
            rearranged_loads(stage),
            improbable_modulus(stage),
            self.coarse_for_adhesion(stage),
        ];
        messages.into_iter().flatten().collect()
    }

    /// Returns the smallest and the largest rms slope of the surfaces that a stage presses, if all
    /// are known before the surfaces are drawn.
    fn pressed_slopes(&self, stage: &Stage) -> Option<[f64; 2]> {
        let known = self.surfaces_read_by(stage).map(|params| rms_slope(params, &self.sources));
        let slopes: Vec<f64> = known.collect::<Option<_>>()?;
        let lowest = slopes.iter().copied().reduce(f64::min)?;
        Some([lowest, slopes.into_iter().fold(lowest, f64::max)])
    }
}

/// Returns a load, in units of E* × rms slope, under which every node of a surface touches an
/// elastic half-space.
///
/// In full contact, the pressures of a Gaussian surface have the standard deviation E* h′/2. A node
/// lies z standard deviations below the mean with a probability below exp(−z²/2)/2. With
/// z = √(2 ln(100 N)), this is the case at any of N nodes with a probability below 1/200.
fn full_contact(params: &Params) -> f64 {
    match params.origin {
        Origin::Random { .. } | Origin::Spectrum { .. }
            if params.origin.prescribed_heights().is_none() =>
        {
            let nodes: f64 = params.nodes().iter().map(|nodes| *nodes as f64).product();
            (2.0 * libm::log(100.0 * nodes)).sqrt() / 2.0
        }
        _ => HEAVY,
    }
}

/// Warns if all loads of a contact that is solved without a study are improbable. `full_contact` is
/// its load of full contact in units of E* × rms slope, if it is known.
pub(crate) fn improbable_contact(
    params: &solve::Params,
    rms_slope: f64,
    full_contact: Option<f64>,
) -> Option<String> {
    let slopes = (rms_slope > 0.0).then_some([rms_slope; 2]);
    improbable(params, slopes, full_contact.unwrap_or(HEAVY))
}

/// Warns if all loads of a point are improbable. `slopes` are the rms slopes of its surfaces, if
/// they are known, and `closing` is the load that closes the gap of an elastic half-space.
fn improbable(params: &solve::Params, slopes: Option<[f64; 2]>, closing: f64) -> Option<String> {
    if !params.control.is_load() {
        return None;
    }
    let (lightest, heaviest) = (*params.loads.first()?, *params.loads.last()?);
    let modulus = params.effective_modulus;
    let is_half_space = params.layer.is_none()
        && params.hardness.is_none()
        && params.boundary == Boundary::Periodic
        && params.asperities.is_none();
    let closing = if is_half_space { closing } else { HEAVY.max(closing) };
    let [flattest, steepest] = match params.load_unit {
        PressureUnit::Relative => [1.0; 2],
        PressureUnit::Absolute => slopes.unwrap_or(SLOPES).map(|slope| modulus * slope),
    };
    let (bound, load, effect) = if lightest >= closing * steepest {
        ("at least", lightest, "every node touches")
    } else if heaviest < LIGHT * flattest {
        ("at most", heaviest, "only a node or two touch")
    } else {
        return None;
    };
    let unit = params.pressure_unit;
    let rounded = |number: f64, unit| quantity::range([number].into_iter(), unit);
    Some(match params.load_unit {
        PressureUnit::Relative => {
            let pressures = match unit {
                Some(unit) => format!("write them with their unit, such as \"{load} {unit}\","),
                None => "set `load_unit = \"absolute\"`".to_owned(),
            };
            format!(
                "all loads are {bound} {load} in units of E* × rms slope, so that {effect}; \
                 {pressures} if they are pressures"
            )
        }
        PressureUnit::Absolute => {
            let same_unit = if unit.is_none() { " in the same unit" } else { "" };
            let rounded_slope = slopes.and_then(|[_, steepest]| rounded(steepest, None));
            let slope = rounded_slope.map(|slope| format!(" and the rms slope at most {slope}"));
            format!(
                "all loads are pressures of {bound} {}, and E* is {}{same_unit}{}, so that {effect}; \
                 check the units of the loads and of E*",
                quantity::written(load, unit),
                rounded(modulus, unit)?,
                slope.unwrap_or_default()
            )
        }
    })
}

/// Tells that the list of loads of a stage was sorted, or that repeated loads are solved once.
pub fn rearranged_loads(stage: &Stage) -> Option<String> {
    stage.work.recipes().iter().filter_map(solved).find_map(|params| {
        let sorted = "`loads` is out of order; loads are solved in ascending order".to_owned();
        let sorted = params.listed.is_unsorted.then_some(sorted);
        let repeated = params.listed.repeated.first().map(|load| {
            let load = params.written_load(*load);
            format!("`loads` repeats the load {load}; each load is solved once")
        });
        sorted
            .into_iter()
            .chain(repeated)
            .reduce(|sorted, repeated| format!("{sorted}. {repeated}"))
    })
}

/// Warns that E* with a unit exceeds that of all materials.
pub fn improbable_modulus(stage: &Stage) -> Option<String> {
    let pascal = Unit::si(Dimension::Pressure);
    stage.work.recipes().iter().filter_map(modulus).find_map(|(modulus, unit)| {
        let unit = Unit::find(unit?)?;
        let shown = quantity::range([modulus].into_iter(), Some(unit.symbol))?;
        (modulus * unit.factor_to(pascal) > STIFFEST).then(|| {
            format!(
                "E* is {shown}, which exceeds that of diamond (about 1 TPa). A modulus may lack its \
                 unit: plain numbers are in {}",
                unit.symbol
            )
        })
    })
}
