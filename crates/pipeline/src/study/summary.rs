//! One line about each stage of random surfaces and of loads, with units.

use std::fmt;

use serde::Serialize;

use crate::study::units::of_stages;
use crate::study::{Stage, Study, Work};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::counted;
use asperity_manifest::keys::quantity;
use asperity_mechanics::elasticity::{Base, Support};
use asperity_stages::absolute::StageUnits;
use asperity_stages::generate::files::samples;
use asperity_stages::per_axis::PerAxis;
use asperity_stages::reduced_units::PressureUnit;
use asperity_stages::surface::spectrum::SpectrumSurface;
use asperity_stages::surface::{Origin, Params};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Recipe, solve};

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
    /// Returns a summary of each stage of random surfaces, with side, rms height and rms slope, of
    /// each stage of samples, and of each stage of loads, with modulus and loads.
    pub fn summaries(&self) -> Vec<StageSummary> {
        // Recipes have the units of the store.
        let units = of_stages(&self.stages);
        let summary = |(stage, StageUnits { names: units, .. }): (&Stage, &StageUnits)| {
            let text = match &stage.work {
                Work::Generate(surfaces) => samples::summary(surfaces).or_else(|| {
                    of_surfaces(surfaces.iter().map(|surfaces| &surfaces.params), &self.sources)
                }),
                Work::Evaluate(recipes) => {
                    let length = units.length.as_deref();
                    self.of_loads(recipes, length).or_else(|| self.summary_of_path(stage, units))
                }
            }?;
            Some(StageSummary { stage: stage.name.clone(), text })
        };
        self.stages.iter().zip(&units).filter_map(summary).collect()
    }

    /// Describes the loads of a stage. `length` is the unit of the lengths of its surfaces, if it
    /// is known.
    fn of_loads(&self, recipes: &[Recipe], length: Option<&str>) -> Option<String> {
        let blocks: Vec<&solve::Params> = recipes.iter().map(solved).collect::<Option<_>>()?;
        let first = blocks.first()?;
        let unit = match first.load_unit {
            _ if !first.control.is_load() => "",
            PressureUnit::Relative => " in units of E* × rms slope",
            PressureUnit::Absolute if first.pressure_unit.is_none() => " in the unit of E*",
            PressureUnit::Absolute => "",
        };
        let moduli = blocks.iter().map(|block| block.effective_modulus);
        Some(format!(
            "E* = {}, {}{unit}{}{}{}",
            quantity::range(moduli, first.pressure_unit)?,
            numbers_of_loads(&blocks, length)?,
            self.excluded_start(&blocks).unwrap_or_default(),
            of_shifts(&blocks).unwrap_or_default(),
            of_layers(&blocks, length).unwrap_or_default(),
        ))
    }

    /// Tells that a range of loads excludes its start, unless this is zero or a load that the study
    /// solves.
    fn excluded_start(&self, blocks: &[&solve::Params]) -> Option<String> {
        let all = || self.stages.iter().flat_map(|stage| stage.work.recipes()).filter_map(solved);
        let is_solved = |start: f64, unit: Option<&str>| {
            let mut others = all().filter(|other| other.unit_of_given_loads() == unit);
            others
                .any(|other| other.given_loads().iter().any(|load| decimal::is_same(*load, start)))
        };
        blocks.iter().find_map(|block| {
            let start = block.listed.start.filter(|start| *start > 0.0)?;
            let (given, unit) = (block.given_load(start), block.unit_of_given_loads());
            (!is_solved(given, unit))
                .then(|| format!("; `loads` excludes its `from`, {}", block.written_load(start)))
        })
    }
}

/// Returns the contact that a recipe solves without adhesion.
pub fn solved(recipe: &Recipe) -> Option<&solve::Params> {
    match recipe {
        Recipe::Solve(params) => Some(params.as_ref()),
        _ => None,
    }
}

/// Returns the number of loads with the first and the last one: `4 loads 10 … 40 MPa`.
fn numbers_of_loads(blocks: &[&solve::Params], length: Option<&str>) -> Option<String> {
    let first = blocks.first()?;
    let unit = if first.control.is_load() { first.unit_of_given_loads() } else { length };
    // The states of a path are in several blocks.
    let of_point = |first: &solve::Params| {
        let own = blocks.iter().filter(|block| block.is_same_contact(first));
        own.map(|block| block.loads.len()).sum::<usize>()
    };
    let number = blocks.iter().map(|block| of_point(block)).max().unwrap_or(0);
    let all = quantity::range(blocks.iter().flat_map(|block| block.given_loads()), unit)?;
    Some(format!("{} {all}", counted(number, first.control.value_in_words())))
}

/// A rms height or a rms slope.
#[derive(Debug, Clone, Copy)]
struct Scale {
    value: f64,
    /// True if every surface has exactly this value. Otherwise it is the value of the expected
    /// spectrum, around which the surfaces scatter.
    is_exact: bool,
}

/// Returns rms height and rms slope of a random surface, if they follow from the keys. Returns
/// `None` for other surfaces.
fn roughness(params: &Params, sources: &SurfaceFiles) -> Option<[Option<Scale>; 2]> {
    let grid = params.grid().ok()?;
    let expected = match &params.origin {
        Origin::Random { surface, .. } => {
            let moments = surface.spectrum.moments(grid.cell());
            Some([moments.rms_height(), moments.rms_slope()])
        }
        Origin::Spectrum { surface, .. } => {
            let density = surface.density_from_file(sources).ok();
            density.map(|density| SpectrumSurface::expected_roughness(&density, grid))
        }
        Origin::File(_) | Origin::Shape { .. } | Origin::Pair(_) | Origin::Yielded(_) => {
            return None;
        }
    };
    let given = [params.origin.given_rms_height(), params.origin.given_rms_slope()];
    let factor = expected.and_then(|expected| {
        let mut pairs = given.iter().zip(expected);
        pairs.find_map(|(given, expected)| Some((*given)? / expected))
    });
    let scale = |index: usize| {
        let scattered = || Some(factor.unwrap_or(1.0) * expected?[index]);
        let value = given[index].or_else(scattered)?;
        Some(Scale { value, is_exact: given[index].is_some() })
    };
    Some([scale(0), scale(1)])
}

/// Returns the rms slope of a surface, or the expected one of random surfaces that are not scaled
/// to a slope. Returns `None` if it is not known before the surface is drawn.
pub(super) fn rms_slope(params: &Params, sources: &SurfaceFiles) -> Option<f64> {
    match &params.origin {
        Origin::Random { surface, .. } => Some(surface.rms_slope),
        Origin::Spectrum { .. } => Some(roughness(params, sources)?[1]?.value),
        Origin::File(file) => file.seen.rms_slope,
        Origin::Yielded(yielded) => rms_slope(&yielded.body, sources),
        Origin::Shape { .. } | Origin::Pair(_) => None,
    }
}

fn of_surfaces<'a>(
    params: impl Iterator<Item = &'a Params> + Clone,
    sources: &SurfaceFiles,
) -> Option<String> {
    let known = params.clone().map(|params| roughness(params, sources));
    let roughness: Vec<[Option<Scale>; 2]> = known.collect::<Option<_>>()?;
    let unit = params.clone().next()?.origin.unit();
    let sides = quantity::range(params.flat_map(|params| params.size()), Some(unit))?;
    let text = |name: &str, index: usize, unit: Option<&str>| {
        let scales = roughness.iter().map(|scales| scales[index]);
        let scales: Vec<Scale> = scales.collect::<Option<_>>()?;
        let sign = if scales.iter().all(|scale| scale.is_exact) { "=" } else { "≈" };
        let range = quantity::range(scales.iter().map(|scale| scale.value), unit)?;
        Some(format!(", {name} {sign} {range}"))
    };
    let height = text("rms height Sq", 0, Some(unit)).unwrap_or_default();
    let slope = text("rms slope Sdq", 1, None).unwrap_or_default();
    Some(format!("side {sides}{height}{slope}"))
}

/// Describes the shifts of two rough surfaces; `None` without a shift.
fn of_shifts(blocks: &[&solve::Params]) -> Option<String> {
    let mut shifts: Vec<PerAxis<f64>> = Vec::new();
    for shift in blocks.iter().filter_map(|block| block.shift) {
        if !shifts.contains(&shift) {
            shifts.push(shift);
        }
    }
    match shifts.as_slice() {
        [PerAxis([0.0, 0.0])] | [] => None,
        [PerAxis([x, y])] => Some(format!(", shifted by {x} of the side along x and {y} along y")),
        several => Some(format!(", at {} shifts", several.len())),
    }
}

/// Describes the layers of loads; `None` without a layer.
fn of_layers(blocks: &[&solve::Params], length: Option<&str>) -> Option<String> {
    let layers = || blocks.iter().filter_map(|block| block.layer);
    let first = layers().next()?;
    let thickness = quantity::range(layers().map(|layer| layer.thickness), length)?;
    let ratio = quantity::range(layers().map(|layer| layer.poisson_ratio), None)?;
    let below = match first.support {
        _ if layers().any(|layer| layer.support != first.support) => String::new(),
        Support::Rigid(Base::Bonded) => ", bonded to a rigid base".to_owned(),
        Support::Rigid(Base::Frictionless) => ", on a rigid base without friction".to_owned(),
        Support::HalfSpace { poisson_ratio, modulus_ratio } => format!(
            ", on a half-space with G₁/G₂ = {} and ν = {}",
            decimal::written(modulus_ratio),
            decimal::written(poisson_ratio)
        ),
    };
    Some(format!("; E* is that of a layer of thickness {thickness} with ν = {ratio}{below}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn summaries(surface: &str, contact: &str) -> Vec<String> {
        let text = format!(
            "[study]\nname = \"units\"\n[stage.rough]\nkind = \"generate\"\nnodes = 64\nhurst = 0.8\n\
             k_lower = 4\nk_upper = 8\n{surface}\n[stage.contact]\nkind = \"solve\"\n\
             from = \"rough\"\n{contact}"
        );
        let study = Study::parse(&text, "units.toml", Path::new("")).unwrap();
        study.summaries().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn surfaces_and_loads_are_told_with_their_units() {
        let surface = "side = \"100 um\"\nrms_slope = 0.1";
        let contact = "effective_modulus = \"70 GPa\"\nloads = [\"10 MPa\", \"0.1 GPa\"]";
        let [rough, pressed] = &summaries(surface, contact)[..] else { panic!("two stages") };
        assert!(rough.starts_with("rough: side 100 µm, rms height Sq ≈ 0.298 µm,"), "{rough}");
        assert!(rough.ends_with(" µm, rms slope Sdq = 0.1"), "{rough}");
        assert_eq!(pressed, "contact: E* = 70000 MPa, 2 loads 10 … 100 MPa");
        let plain = summaries("", "loads = [0.1]");
        assert_eq!(plain[1], "contact: E* = 1, 1 load 0.1 in units of E* × rms slope");
    }

    #[test]
    fn ranges_are_told_with_their_first_and_last_load_and_the_start_that_they_exclude() {
        let range = |keys: &str| {
            let range = format!("effective_modulus = \"70 GPa\"\nloads = {{ {keys} }}");
            summaries("side = \"100 um\"", &range).pop().unwrap()
        };
        let from_zero = range("to = \"100 MPa\", steps = 4");
        assert_eq!(from_zero, "contact: E* = 70000 MPa, 4 loads 25 … 100 MPa");
        let from_ten = range("from = \"10 MPa\", to = \"100 MPa\", steps = 9");
        let expected =
            "contact: E* = 70000 MPa, 9 loads 20 … 100 MPa; `loads` excludes its `from`, 10 MPa";
        assert_eq!(from_ten, expected);
        let forces = range("from = \"1 N\", to = \"5 N\", steps = 2");
        assert!(forces.ends_with("2 loads 3 … 5 N; `loads` excludes its `from`, 1 N"), "{forces}");
        let next = "loads = { to = 0.1, steps = 2 }\n[stage.more]\nkind = \"solve\"\n\
                    from = \"rough\"\nloads = { from = 0.1, to = 0.4, steps = 3 }";
        let following = summaries("", next).pop().unwrap();
        assert_eq!(following, "more: E* = 1, 3 loads 0.2 … 0.4 in units of E* × rms slope");
    }

    #[test]
    fn one_number_shifts_along_both_axes() {
        let pressed = |shift: &str| {
            let contact = format!("against = \"rough\"\nshift = {shift}\nloads = [0.1]");
            summaries("", &contact).pop().unwrap()
        };
        let both = ", shifted by 0.5 of the side along x and 0.5 along y";
        assert!(pressed("0.5").ends_with(both), "{}", pressed("0.5"));
        assert!(pressed("[0.5, 0]").ends_with("0.5 of the side along x and 0 along y"));
        assert!(pressed("[[0, 0], [0.5, 0]]").ends_with(", at 2 shifts"));
        assert!(!pressed("[0, 0]").contains("shift"));
    }

    #[test]
    fn surfaces_with_a_given_spectrum_have_its_roughness() {
        let summary = |scale: &str| {
            let text = format!(
                "[study]\nname = \"s\"\n[stage.rough]\nkind = \"generate\"\nmethod = \"spectrum\"\n\
                 path = \"spectrum.csv\"\nnodes = 32\nside = 1\n{scale}"
            );
            let folder = Path::new("../../tests/manifests/maps");
            let study = Study::parse(&text, "spectrum.toml", folder).unwrap();
            study.summaries()[0].to_string()
        };
        let number = |line: &str, name: &str| -> f64 {
            let rest = line.split(name).nth(1).unwrap();
            rest.split([',', ' ']).nth(2).unwrap().parse().unwrap()
        };
        let unscaled = summary("");
        let ratio = number(&unscaled, "Sq") / number(&unscaled, "Sdq");
        let scaled = summary("rms_slope = 0.1");
        assert!(scaled.ends_with(", rms slope Sdq = 0.1"), "{scaled}");
        assert!((number(&scaled, "Sq") / (0.1 * ratio) - 1.0).abs() < 0.01, "{scaled}");
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
