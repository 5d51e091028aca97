//! Keys with which a `solve` stage presses two rough surfaces against each other, and the pairs of
//! surfaces that they give.

use crate::check_context::NamedSurfaces;
use crate::per_axis::PerAxis;
use crate::solve::keys::SolveTable;
use crate::surface::pair::Pair;
use crate::surface::planned::PlannedSurfaces;
use crate::surface::{Heights, Origin, Params};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::keys::Section;
use asperity_manifest::keys::checks::Checks;
use asperity_mechanics::grid::Boundary;

/// Returns the shift of a point along x and y, or `Some(None)` if the surfaces are pressed alone.
/// Refuses a shift of maps that are not periodic.
pub(super) fn shift(table: &SolveTable, checks: &mut Checks) -> Option<Option<PerAxis<f64>>> {
    if checks.optional("against", &table.against)?.is_none() {
        return Some(None);
    }
    let Some(written) = checks.optional("shift", &table.shift)? else {
        return Some(Some(PerAxis::same(0.0)));
    };
    let shift = written.value.pair().map(decimal::nearest);
    if table.boundary.value() == Some(Boundary::Free) && shift != [0.0; 2] {
        let message = "an isolated patch cannot be shifted, and `boundary` is \"free\"";
        let problem = Problem::new(message, written.span.clone(), "must be 0");
        return checks.reject(problem.help(
            "a shifted map is continued periodically beyond its edges; crop the two measured maps \
             at different positions instead",
        ));
    }
    Some(Some(PerAxis(shift)))
}

/// Returns the pairs of the surfaces of `from` and `against` at each shift of a stage, or `None`
/// after reporting problems.
pub fn pairs(
    section: &Section<SolveTable>,
    from: &[NamedSurfaces],
    against: NamedSurfaces,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    let [second] = against.surfaces else {
        let points = against.surfaces.len();
        let message = format!("`{}` has {points} parameter points", against.name.value);
        let label = "must have a single parameter point";
        let problem = Problem::new(message, against.name.span.clone(), label);
        problems.push(problem.help(
            "sweep the keys of the stage in `from`, or give each point its own stage with its own \
             `solve` stage",
        ));
        return None;
    };
    let mut placements: Vec<(PerAxis<f64>, _)> = Vec::new();
    for point in &section.points {
        let checks = &mut Checks::new(section, point, problems);
        let written = checks.optional("shift", &point.table.shift)?;
        let shift = written.map_or([0.0; 2], |shift| shift.value.pair().map(decimal::nearest));
        let mirror = checks.optional("mirror", &point.table.mirror)?;
        let placement = (PerAxis(shift), mirror.map(|mirror| mirror.value));
        if !placements.contains(&placement) {
            placements.push(placement);
        }
    }
    let mut pairs = Vec::new();
    for bodies in from {
        for first in bodies.surfaces {
            let Err(problem) = check([*bodies, against], [first, second]) else {
                pairs.extend(placements.iter().map(|(shift, mirror)| {
                    let is_single = [first, second].map(|one| one.at_most() == 1);
                    let bodies = [&first.params, &second.params];
                    let pair = Pair::new(bodies, *shift, *mirror, is_single);
                    PlannedSurfaces {
                        params: Params {
                            heights: Heights::Redraw,
                            side: None,
                            origin: Origin::Pair(Box::new(pair)),
                        },
                        realizations: match first.realizations {
                            0 => 0,
                            own => own.max(second.realizations),
                        },
                        growth: None,
                        sample: None,
                        may_be_swept: false,
                    }
                }));
                continue;
            };
            problems.push(*problem);
            return None;
        }
    }
    Some(pairs)
}

/// Largest relative difference of two sides that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// Checks that two surfaces can be pressed against each other.
fn check(
    [first, second]: [NamedSurfaces; 2],
    [one, other]: [&PlannedSurfaces; 2],
) -> Result<(), Box<Problem>> {
    let [from, against] = [first, second].map(|bodies| bodies.name.value.as_str());
    let problem = |message: String, labels: [String; 2], help: &str| {
        let [label, label_of_other] = labels;
        let problem = Problem::new(message, second.name.span.clone(), label_of_other);
        Err(Box::new(problem.and(first.name.span.clone(), label).help(help)))
    };
    if one.params.origin.reads_stage() {
        return problem(
            format!("the surfaces of `{from}` cannot be drawn again for the pairs"),
            ["its spectrum is measured in this study", "makes the pairs"].map(str::to_owned),
            "write the spectrum to a file and name it by `path` in that stage",
        );
    }
    let both = [one, other];
    let nodes = both.map(|surfaces| surfaces.params.nodes());
    if nodes[0] != nodes[1] {
        return problem(
            format!("`{from}` and `{against}` have different numbers of nodes"),
            nodes.map(|[x, y]| format!("{x} × {y} nodes")),
            "two maps that are pressed against each other need the same nodes and sides; a \
             measured map can be cropped by `crop` and interpolated by `resample`",
        );
    }
    let units = both.map(|surfaces| surfaces.params.origin.unit());
    if units[0] != units[1] {
        let named = |unit: &str| match unit {
            "" => "lengths without a unit".to_owned(),
            unit => format!("lengths in {unit}"),
        };
        return problem(
            format!("`{from}` and `{against}` have different units of length"),
            units.map(named),
            "give the lengths of both stages in the same unit, or name it with `unit`",
        );
    }
    let sides = both.map(|surfaces| surfaces.params.size());
    let differs = |axis: usize| {
        let [one, other] = [sides[0][axis], sides[1][axis]];
        (one - other).abs() > ROUNDING * one
    };
    if differs(0) || differs(1) {
        return problem(
            format!("`{from}` and `{against}` have different sides"),
            sides.map(|[x, y]| format!("{x} × {y}")),
            "two maps that are pressed against each other need the same nodes and sides; a \
             measured map can be cropped by `crop`",
        );
    }
    let counts = both.map(|surfaces| surfaces.realizations);
    let grows = both.map(|surfaces| surfaces.growth.is_some());
    if grows[0] || grows[1] {
        return problem(
            "the number of surfaces that are pressed against each other must be fixed".to_owned(),
            both.map(|one| match &one.growth {
                Some(growth) => format!("draws surfaces until {}", growth.until),
                None => "has a fixed number".to_owned(),
            }),
            "set `realizations` to a number",
        );
    }
    if counts[0] != counts[1] && !counts.contains(&1) {
        return problem(
            format!("`{from}` and `{against}` have different numbers of surfaces"),
            counts.map(|count| format!("{count} surfaces")),
            "surface k of one stage is pressed against surface k of the other; give both the same \
             `realizations`, or one of them a single surface",
        );
    }
    match both.map(|surfaces| surfaces.params.origin.random_numbers()) {
        [Some((seed, _)), Some((same, _))] if seed == same && from != against => problem(
            format!("`{from}` and `{against}` are drawn from the same random numbers"),
            [(); 2].map(|()| format!("drawn with seed {seed}")),
            "set another `seed` in one of the two stages; surfaces with the same random numbers \
             have the same phases and are not independent",
        ),
        _ => Ok(()),
    }
}
