//! Adhesion of the surfaces of a stage: its resolution by the mesh, and its Tabor parameter.

use crate::study::{Stage, Study};
use asperity_manifest::diagnostics::counted;
use asperity_manifest::keys::quantity;
use asperity_mechanics::adhesion::BISTABLE;
use asperity_mechanics::topography::shapes::Shape;
use asperity_stages::Recipe;
use asperity_stages::columns::WORK_OF_ADHESION;
use asperity_stages::solve::Control;
use asperity_stages::solve::adhesion;
use asperity_stages::solve::keys::adhesion as keys;
use asperity_stages::surface::{Origin, Params};
use asperity_stages::units::TableUnits;

impl Study {
    /// Warns that a mesh resolves the adhesion of a stage poorly.
    pub(crate) fn coarse_for_adhesion(&self, stage: &Stage) -> Option<String> {
        let grids = self.surfaces_read_by(stage).filter_map(|params| params.grid().ok());
        let step = grids.flat_map(|grid| grid.spacing()).reduce(f64::max)?;
        let number = |params: &adhesion::Params| {
            keys::mesh_number(step, params.work, params.range, params.effective_modulus)
        };
        let number = of_adhesion(stage).map(number).reduce(f64::max)?;
        (number > keys::RESOLVED).then(|| {
            let error = if number > BISTABLE {
                "single nodes jump into contact, and the hysteresis is an artefact of the mesh"
                    .to_owned()
            } else {
                let percent = 2.0 * number;
                format!("expect errors of about {percent:.1} % of the pressure")
            };
            format!(
                "the mesh is coarse for the adhesion: mesh step × work/(E* × range²) is {} and \
                 should be at most {}; {error}; use {}",
                keys::short(number),
                keys::RESOLVED,
                keys::resolution(number)
            )
        })
    }

    /// Returns a summary of the path of a stage with adhesion. `units` are those of its recipes.
    pub(super) fn summary_of_path(&self, stage: &Stage, units: &TableUnits) -> Option<String> {
        let params = of_adhesion(stage).next()?;
        let length_unit = units.length.as_deref();
        let has_units = length_unit.is_some() && units.pressure.is_some();
        let work_unit = has_units.then(|| units.name(WORK_OF_ADHESION.unit));
        let (prescribed, unit) = match params.control {
            Control::Load => ("load", params.unit_of_given_loads()),
            control => (control.value_in_words(), length_unit),
        };
        let range = |of: fn(&adhesion::Params) -> f64, unit| {
            quantity::range(of_adhesion(stage).map(of), unit)
        };
        let path = format!(
            "E* = {}, work of adhesion {}, range {}, {} with {prescribed} {}",
            range(|params| params.effective_modulus, params.pressure_unit)?,
            range(|params| params.work, work_unit.as_deref())?,
            range(|params| params.range, length_unit)?,
            counted(params.targets.len(), "state"),
            ends(&params.given_targets(), unit)?,
        );
        Some([Some(path), self.tabor(stage)].into_iter().flatten().collect::<Vec<_>>().join("; "))
    }

    /// Describes the range of the adhesion of a stage beside its elastic deformation, by the Tabor
    /// parameter. Returns `None` if the curvature of the surfaces is not known beforehand.
    fn tabor(&self, stage: &Stage) -> Option<String> {
        let all: Option<Vec<f64>> = self.surfaces_read_by(stage).map(curvature).collect();
        let curvatures = all.filter(|known| !known.is_empty())?;
        let numbers = of_adhesion(stage)
            .flat_map(|params| curvatures.iter().filter_map(|curvature| params.tabor(*curvature)));
        let (least, most) = numbers.fold((f64::INFINITY, 0.0_f64), |(least, most), number| {
            (least.min(number), most.max(number))
        });
        if most == 0.0 {
            return None;
        }
        let nearest = match (least, most) {
            (_, most) if most < DMT => "near the limit of Derjaguin, Muller & Toporov",
            (least, _) if least > JKR => "near the limit of Johnson, Kendall & Roberts",
            _ => "between the limits of Derjaguin, Muller & Toporov and Johnson, Kendall & Roberts",
        };
        let numbers = quantity::range([least, most].into_iter(), None)?;
        Some(format!("Tabor parameter {numbers}, {nearest}"))
    }
}

/// Formats the first state of a path, the states where it turns and the last one:
/// `100 nm … 5 nm … 100 nm`.
fn ends(states: &[f64], unit: Option<&str>) -> Option<String> {
    let (first, last) = (*states.first()?, *states.last()?);
    let [least, most] = [f64::min, f64::max].map(|of| states.iter().copied().fold(first, of));
    let inner = [least, most].into_iter().filter(|state| ![first, last].contains(state));
    let mut shown: Vec<f64> = [first].into_iter().chain(inner).chain([last]).collect();
    shown.dedup();
    let texts = shown.iter().map(|state| quantity::range([*state].into_iter(), unit));
    Some(texts.collect::<Option<Vec<_>>>()?.join(" … "))
}

/// Tabor parameter below which spheres are near the limit of Derjaguin, Muller & Toporov.
const DMT: f64 = 0.1;
/// Tabor parameter above which spheres are near the limit of Johnson, Kendall & Roberts.
const JKR: f64 = 5.0;

fn of_adhesion(stage: &Stage) -> impl Iterator<Item = &adhesion::Params> + '_ {
    stage.work.recipes().iter().filter_map(|recipe| match recipe {
        Recipe::Adhesion(params) => Some(params.as_ref()),
        _ => None,
    })
}

/// Returns the rms curvature √m₄ that surfaces have by their parameters.
fn curvature(params: &Params) -> Option<f64> {
    match &params.origin {
        Origin::Random { surface, .. } => {
            let moments = surface.spectrum.moments(params.grid().ok()?.cell());
            let scale = match params.origin.given_rms_height() {
                Some(height) => height / moments.rms_height(),
                None => surface.rms_slope / moments.rms_slope(),
            };
            Some(scale * moments.fourth().sqrt())
        }
        Origin::Shape { shape: Shape::Paraboloid { radius }, .. } => Some(1.0 / radius),
        _ => None,
    }
}
