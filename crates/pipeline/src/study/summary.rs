//! One line about each stage of random surfaces and of loads, with units.

use std::fmt;

use serde::Serialize;

use crate::study::{Stage, Study, Work};
use asperity_manifest::diagnostics::counted;
use asperity_manifest::keys::quantity;
use asperity_stages::Recipe;
use asperity_stages::generate::{Origin, Params};
use asperity_stages::solve::{self, PressureUnit};

/// Summary of the surfaces or of the loads of a stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageSummary {
    pub stage: String,
    pub text: String,
}

impl fmt::Display for StageSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.stage, self.text)
    }
}

impl Study {
    /// Returns a summary of each stage of random surfaces, with side, rms height and rms slope, and
    /// of each stage of loads, with modulus and loads.
    pub fn summaries(&self) -> Vec<StageSummary> {
        let summary = |stage: &Stage| {
            let text = match &stage.work {
                Work::Generate(surfaces) => {
                    of_surfaces(surfaces.iter().map(|surfaces| &surfaces.params))
                }
                Work::Evaluate(recipes) => of_loads(recipes),
            }?;
            Some(StageSummary { stage: stage.name.clone(), text })
        };
        self.stages.iter().filter_map(summary).collect()
    }
}

/// Rms height and rms slope of the surfaces of a parameter point.
struct Roughness {
    height: f64,
    slope: f64,
    /// True if every surface has exactly this height or slope. Otherwise it is the value of the
    /// expected spectrum, around which the surfaces scatter.
    is_height_exact: bool,
    is_slope_exact: bool,
}

impl Roughness {
    /// Returns the roughness of a random self-affine surface.
    fn from_params(params: &Params) -> Option<Roughness> {
        let Origin::Random { surface, .. } = &params.origin else {
            return None;
        };
        let moments = surface.spectrum.moments(params.grid().ok()?.cell());
        let height_per_slope = moments.rms_height() / moments.rms_slope();
        let (given_height, slope) = (params.origin.given_rms_height(), surface.rms_slope);
        Some(Roughness {
            height: given_height.unwrap_or(slope * height_per_slope),
            slope,
            is_height_exact: given_height.is_some(),
            is_slope_exact: given_height.is_none(),
        })
    }
}

fn of_surfaces<'a>(params: impl Iterator<Item = &'a Params> + Clone) -> Option<String> {
    let roughness: Option<Vec<Roughness>> = params.clone().map(Roughness::from_params).collect();
    let roughness = roughness.filter(|roughness| !roughness.is_empty())?;
    let unit = params.clone().next()?.origin.unit();
    let sides = params.flat_map(|params| params.size());
    let sign =
        |is_exact: fn(&Roughness) -> bool| if roughness.iter().all(is_exact) { "=" } else { "≈" };
    Some(format!(
        "side {}, rms height Sq {} {}, rms slope Sdq {} {}",
        range(sides, Some(unit)),
        sign(|one| one.is_height_exact),
        range(roughness.iter().map(|one| one.height), Some(unit)),
        sign(|one| one.is_slope_exact),
        range(roughness.iter().map(|one| one.slope), None),
    ))
}

fn of_loads(recipes: &[Recipe]) -> Option<String> {
    let blocks = recipes.iter().map(|recipe| match recipe {
        Recipe::Solve(params) => Some(params.as_ref()),
        _ => None,
    });
    let blocks: Vec<&solve::Params> = blocks.collect::<Option<_>>()?;
    let first = blocks.first()?;
    let loads = || blocks.iter().flat_map(|block| block.loads.iter().copied());
    let number = blocks.iter().map(|block| block.loads.len()).max().unwrap_or(0);
    let unit = match first.load_unit {
        PressureUnit::Relative => " in units of E* × rms slope",
        PressureUnit::Absolute if first.pressure_unit.is_none() => " in the unit of E*",
        PressureUnit::Absolute => "",
    };
    let moduli = blocks.iter().map(|block| block.effective_modulus);
    Some(format!(
        "E* = {}, {} {}{unit}",
        range(moduli, first.pressure_unit),
        counted(number, "load"),
        range(loads(), first.unit_of_loads()),
    ))
}

/// Formats the smallest and the largest of several quantities with three digits: `1 … 100 MPa`.
fn range(values: impl Iterator<Item = f64>, unit: Option<&str>) -> String {
    let rounded = |value: f64| format!("{value:.2e}").parse().unwrap_or(value);
    let (lowest, highest) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    let [low, high] = [lowest, highest].map(|value| quantity::written(rounded(value), unit));
    match (low.rsplit_once(' '), high.rsplit_once(' ')) {
        _ if low == high => low,
        (Some((number, low_unit)), Some((_, high_unit))) if low_unit == high_unit => {
            format!("{number} … {high}")
        }
        _ => format!("{low} … {high}"),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::study::no_claims;

    fn summaries(surface: &str, contact: &str) -> Vec<String> {
        let text = format!(
            "[study]\nname = \"units\"\n[stage.rough]\nkind = \"generate\"\nnodes = 64\nhurst = 0.8\n\
             k_lower = 4\nk_upper = 8\n{surface}\n[stage.contact]\nkind = \"solve\"\n\
             from = \"rough\"\n{contact}"
        );
        let study = Study::parse(&text, "units.toml", Path::new(""), no_claims).unwrap();
        study.summaries().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn surfaces_and_loads_are_told_with_their_units() {
        let surface = "side = \"100 um\"\nrms_slope = 0.1";
        let contact = "effective_modulus = \"70 GPa\"\nloads = [\"10 MPa\", \"0.1 GPa\"]";
        let [rough, pressed] = &summaries(surface, contact)[..] else { panic!("two stages") };
        assert!(rough.starts_with("rough: side 100 µm, rms height Sq ≈ 0.298 µm,"), "{rough}");
        assert!(rough.ends_with(" µm, rms slope Sdq = 0.1"), "{rough}");
        assert_eq!(pressed, "contact: E* = 70 GPa, 2 loads 10 … 100 MPa");
        let plain = summaries("", "loads = [0.1]");
        assert_eq!(plain[1], "contact: E* = 1, 1 load 0.1 in units of E* × rms slope");
    }

    #[test]
    fn the_rms_height_and_the_rms_slope_of_a_spectrum_follow_from_each_other() {
        let slope_of = |line: &str| line.rsplit(' ').next().unwrap().parse::<f64>().unwrap();
        let lines = summaries("side = 2\nrms_height = 0.01\nunit = \"mm\"", "loads = [0.1]");
        assert!(lines[0].contains("side 2 mm, rms height Sq = 0.01 mm, rms slope Sdq ≈ "));
        let slope = slope_of(&lines[0]);
        let lines = summaries(&format!("side = 2\nrms_slope = {slope}"), "loads = [0.1]");
        assert!(lines[0].contains("rms height Sq ≈ 0.01,"), "{lines:?}");
    }
}
