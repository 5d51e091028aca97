//! Stages that make the pairs of surfaces which `solve` stages with `against` press against each
//! other.
//!
//! A manifest has no table for such a stage. Its surfaces are the sums of the heights of two
//! surfaces, and its table describes them. The `solve` stage reads it in place of the stages in
//! `from`.

use crate::manifest::StageTable;
use crate::study::Work;
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::keys::Spanned;
use asperity_stages::check_context::NamedSurfaces;
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::surface::{Origin, Params};

/// Returns the name of the stage with the pairs of surfaces of a `solve` stage.
pub fn name_of(solve: &str) -> String {
    format!("{solve}_pairs")
}

/// Returns the work of the stage with the pairs of a `solve` stage, or `None` after reporting
/// problems. `surfaces` returns the surfaces of a stage by its name, if they are valid.
pub fn work<'a>(
    stage: &'a StageTable,
    second: &'a Spanned<String>,
    stages: &[StageTable],
    surfaces: impl Fn(&str) -> Option<&'a [PlannedSurfaces]>,
    problems: &mut Problems,
) -> Option<Work> {
    let points = stage.points.as_ref()?;
    let name = name_of(&stage.name.value);
    // Names that differ only in case are one file on some file systems.
    let is_same = |other: &&StageTable| other.name.value.eq_ignore_ascii_case(&name);
    if let Some(other) = stages.iter().find(is_same) {
        let message = format!("a stage cannot be called `{}`", other.name.value);
        let label = format!("this is the name of the pairs of surfaces of `{}`", stage.name.value);
        let problem = Problem::new(message, other.name.span.clone(), label);
        problems.push(problem.and(second.span.clone(), "makes the pairs").help("rename the stage"));
        return None;
    }
    let bodies =
        |name: &'a Spanned<String>| Some(NamedSurfaces { name, surfaces: surfaces(&name.value)? });
    let first: Vec<NamedSurfaces> =
        stage.from.iter().flatten().map(bodies).collect::<Option<_>>()?;
    points.pairs(&first, bodies(second)?, problems).map(Work::Generate)
}

/// Returns the number of pairs that a `solve` stage presses at each of its shifts.
pub fn at_one_shift(pairs: &Work) -> usize {
    let surfaces = pairs.surfaces();
    let shift = |params: &Params| match &params.origin {
        Origin::Pair(pair) => Some(pair.shift),
        _ => None,
    };
    let first = surfaces.first().map(|surfaces| shift(&surfaces.params));
    let at_first = surfaces.iter().filter(|surfaces| Some(shift(&surfaces.params)) == first);
    at_first.map(|surfaces| surfaces.realizations as usize).sum()
}

/// Returns a warning about pairs whose two bodies are the same surface.
pub fn of_equal_bodies(work: &Work) -> Option<String> {
    let is_equal = |surfaces: &PlannedSurfaces| match &surfaces.params.origin {
        Origin::Pair(pair) => pair.body == pair.against,
        _ => false,
    };
    work.surfaces().iter().any(is_equal).then(|| {
        "both bodies of a pair are the same surface, because `against` names the stage in `from`; \
         for independent surfaces add a stage with another `seed`"
            .to_owned()
    })
}
