//! Stages with multilevel means, and the surfaces on several meshes that they need.

use std::collections::BTreeMap;

use asperity_manifest::diagnostics::{Problem, Span, counted};
use asperity_stages::aggregate::{Multilevel, Params};
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::{Recipe, Work};

/// Surfaces of one parameter point on one mesh.
type OnMesh<'a> = ([usize; 2], &'a PlannedSurfaces);

/// Advice for a stage whose meshes do not have several surfaces each, nested.
const ADVICE: &str = "give coarser meshes more surfaces, and each mesh at least two: `cases = [{ \
                      nodes = 128, realizations = 400 }, { nodes = 256, realizations = 60 }, { \
                      nodes = 512, realizations = 10 }]`";

/// Returns the multilevel means that a recipe computes.
pub fn means(recipe: &Recipe) -> Option<&Multilevel> {
    match recipe {
        Recipe::Aggregate(params) => match &**params {
            Params::Multilevel(means) => Some(means),
            Params::Groups(_) | Params::Sql(_) => None,
        },
        _ => None,
    }
}

/// Returns whether a stage computes multilevel means.
pub fn is_multilevel(work: &Work) -> bool {
    work.recipes().iter().any(|recipe| means(recipe).is_some())
}

/// Groups surfaces that differ only in their mesh, each from the coarsest mesh to the finest.
/// Returns `None` if other meshes cannot show one of the surfaces.
pub fn ladders<'a>(
    surfaces: impl Iterator<Item = &'a PlannedSurfaces>,
) -> Option<Vec<Vec<OnMesh<'a>>>> {
    let mut by_point: BTreeMap<String, Vec<OnMesh>> = BTreeMap::new();
    for planned in surfaces {
        let common = planned.params.without_mesh()?;
        let text = serde_json::to_string(&common).expect("parameters are plain data");
        by_point.entry(text).or_default().push((planned.params.nodes(), planned));
    }
    let mut ladders: Vec<Vec<OnMesh>> = by_point.into_values().collect();
    for ladder in &mut ladders {
        ladder.sort_by_key(|([x, y], _)| x * y);
    }
    Some(ladders)
}

/// Returns the problem of multilevel means whose surfaces are not nested on several meshes.
/// `surfaces` are those of the stages that make them, and `key` asks for the means.
pub fn check<'a>(
    surfaces: impl Iterator<Item = &'a PlannedSurfaces>,
    key: &Span,
) -> Option<Problem> {
    let problem =
        |message: &str, label: String| Some(Problem::new(message, key.clone(), label).help(ADVICE));
    let Some(ladders) = ladders(surfaces) else {
        let message = "multilevel means need random surfaces, which any mesh can show";
        let label = "reads shapes, measured surfaces, pairs or surfaces that have yielded";
        return problem(message, label.to_owned());
    };
    for ladder in ladders {
        let named = |([x, y], surfaces): &OnMesh| {
            let mesh = if x == y { format!("{x}") } else { format!("{x} × {y}") };
            let count = counted(surfaces.at_most() as usize, "surface");
            format!("{count} on a mesh of {mesh}")
        };
        let [.., finest] = &ladder[..] else { continue };
        if ladder.len() == 1 {
            let message = "multilevel means need the same surfaces on several meshes";
            return problem(message, format!("a parameter point has only {}", named(finest)));
        }
        if let Some(single) = ladder.iter().find(|(_, surfaces)| surfaces.at_most() < 2) {
            let message = "the mean difference of a single surface has no standard error";
            return problem(message, format!("a parameter point has {}", named(single)));
        }
        let reversed = ladder.windows(2).find(|pair| pair[0].1.at_most() < pair[1].1.at_most());
        if let Some([coarse, fine]) = reversed {
            let message = "a mesh has more surfaces than a coarser one";
            return problem(message, format!("{}, but {}", named(coarse), named(fine)));
        }
    }
    None
}
