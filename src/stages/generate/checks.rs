//! Checks of the stages that draw surfaces.

use std::ops::Bound;

use super::growth::{self, PlannedSurfaces};
use super::keys::{self, ParaboloidTable, PunchTable, RandomHeights, RandomTable, WaveTable};
use super::{Heights, Origin, Params};
use crate::contact::topography::random::{Amplitude, RandomSurface};
use crate::contact::topography::shapes::Shape;
use crate::contact::topography::spectrum::Spectrum;
use crate::diagnostics::{Problem, Problems};
use crate::stages::Given;
use crate::written::Key;
use crate::written::checks::{Checks, QUANTITY, report_equal_points};
use crate::written::{Point, Section, Table};

/// Meshes, in nodes per side.
pub const NODES: std::ops::RangeInclusive<u32> = 4..=16384;
const WAVENUMBERS: std::ops::RangeInclusive<u32> = 1..=*NODES.end() / 2;

/// The surfaces of a stage, point by point of its grid.
pub fn surfaces<T: Table>(
    section: &Section<T>,
    problems: &mut Problems,
    mut surfaces: impl FnMut(&T, &mut Checks) -> Option<PlannedSurfaces>,
) -> Option<Vec<PlannedSurfaces>> {
    let mut checked = |point: &Point<T>| {
        let mut checks = Checks::of(section, point, problems);
        surfaces(&point.table, &mut checks)
    };
    let planned: Vec<Option<_>> = section.points.iter().map(&mut checked).collect();
    let planned: Vec<_> = planned.into_iter().collect::<Option<_>>()?;
    let params = planned.iter().map(|surfaces| &surfaces.params);
    report_equal_points(section, params, problems);
    Some(planned)
}

/// Random surfaces.
pub fn random(
    amplitude: Amplitude,
    section: &Section<RandomTable>,
    given: &mut Given,
) -> Option<Vec<PlannedSurfaces>> {
    let study_seed = given.seed;
    surfaces(section, given.problems, |table, checks| {
        let nodes = checks.whole("nodes", &table.nodes, NODES);
        let side = checks.number_or("side", &table.side, QUANTITY, 1.0);
        let hurst = (Bound::Excluded(0.0), Bound::Included(1.0));
        let hurst = checks.number("hurst", &table.hurst, hurst);
        let k_lower = checks.whole("k_lower", &table.k_lower, WAVENUMBERS);
        let k_upper = checks.whole("k_upper", &table.k_upper, WAVENUMBERS);
        let k_rolloff = match k_lower {
            Some(k_lower) => checks.whole_or("k_rolloff", &table.k_rolloff, WAVENUMBERS, k_lower),
            None => None,
        };
        let rms_slope = checks.number_or("rms_slope", &table.rms_slope, QUANTITY, 1.0);
        let seed = checks.whole_or("seed", &table.seed, 0..=i64::MAX as u64, study_seed);
        let realizations = growth::realizations(&table.realizations, checks);
        let spectrum = Spectrum {
            hurst: hurst?,
            k_lower: k_lower?,
            k_rolloff: k_rolloff?,
            k_upper: k_upper?,
        };
        check_cutoffs(table, &spectrum, checks)?;
        check_mesh(
            ("k_upper", &table.k_upper),
            &table.nodes,
            nodes?,
            false,
            checks,
        )?;
        let surface = RandomSurface {
            spectrum,
            amplitude,
            rms_slope: rms_slope?,
            seed: seed?,
            realization: 0,
        };
        let nodes = nodes?;
        let (realizations, growth) = realizations?;
        Some(PlannedSurfaces {
            params: Params {
                heights: random_heights(&table.heights),
                side: side?,
                origin: Origin::Random { nodes, surface },
            },
            realizations,
            growth,
        })
    })
}

fn random_heights(key: &Key<RandomHeights>) -> Heights {
    match key.written().map(|heights| heights.value) {
        Some(RandomHeights::None) => Heights::None,
        Some(RandomHeights::Redraw) => Heights::Redraw,
        Some(RandomHeights::Keep) | None => Heights::Keep,
    }
}

/// `k_lower ≤ k_rolloff ≤ k_upper`.
fn check_cutoffs(table: &RandomTable, spectrum: &Spectrum, checks: &mut Checks) -> Option<()> {
    let lower = ("k_lower", &table.k_lower, spectrum.k_lower);
    let rolloff = ("k_rolloff", &table.k_rolloff, spectrum.k_rolloff);
    let upper = ("k_upper", &table.k_upper, spectrum.k_upper);
    let pairs = match table.k_rolloff.written() {
        Some(_) if spectrum.k_lower <= spectrum.k_upper => [(lower, rolloff), (rolloff, upper)],
        _ => [(lower, upper); 2],
    };
    for ((low_name, low_key, low), (high_name, high_key, high)) in pairs {
        if low > high {
            let (low_key, high_key) = (low_key.written()?, high_key.written()?);
            let message = format!("`{low_name} = {low}` lies above `{high_name} = {high}`");
            let problem = Problem::new(message, low_key.span.clone(), "larger")
                .and(high_key.span.clone(), "smaller");
            checks.problems.push(problem.help(
                "lists are swept in every combination; to name combinations outright, write \
                 `cases = [{ k_lower = 1, k_upper = 32 }, …]`",
            ));
            return None;
        }
    }
    Some(())
}

/// A mesh shows waves of two nodes or more. Where phases matter, one of two nodes is not enough:
/// its other half falls between them.
fn check_mesh(
    (name, waves): (&str, &Key<i64>),
    key: &Key<i64>,
    nodes: u32,
    phases_matter: bool,
    checks: &mut Checks,
) -> Option<()> {
    let (Some(waves), Some(key)) = (waves.written(), key.written()) else {
        return Some(());
    };
    let needed = 2 * waves.value + i64::from(phases_matter);
    if needed <= i64::from(nodes) {
        return Some(());
    }
    let message = format!(
        "`{name} = {}` needs at least {needed} nodes per side, `nodes` is {nodes}",
        waves.value
    );
    let problem = Problem::new(message, waves.span.clone(), "too fine for the mesh").and(
        key.span.clone(),
        format!(
            "carries wavenumbers up to {}",
            (nodes - u32::from(phases_matter)) / 2
        ),
    );
    checks.problems.push(problem);
    None
}

/// Paraboloids.
pub fn paraboloid(
    section: &Section<ParaboloidTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let nodes = checks.whole("nodes", &table.nodes, NODES);
        let side = checks.number_or("side", &table.side, QUANTITY, 1.0);
        let radius = checks.number("radius", &table.radius, QUANTITY);
        let shape = Shape::Paraboloid { radius: radius? };
        Some(single(
            &table.heights,
            side?,
            Origin::Shape {
                nodes: nodes?,
                shape,
            },
        ))
    })
}

/// How waves along two directions go together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveShape {
    /// There is but one.
    Single,
    /// Their product.
    Product,
    /// Their sum.
    Sum,
}

/// Waves along one direction or two.
pub fn wave(
    shape: WaveShape,
    section: &Section<WaveTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let nodes = checks.whole("nodes", &table.nodes, NODES);
        let side = checks.number_or("side", &table.side, QUANTITY, 1.0);
        let amplitude = checks.number("amplitude", &table.amplitude, QUANTITY);
        let waves = checks.whole_or("waves", &table.waves, WAVENUMBERS, 1);
        let (nodes, amplitude, waves) = (nodes?, amplitude?, waves?);
        check_mesh(("waves", &table.waves), &table.nodes, nodes, true, checks)?;
        let shape = match shape {
            WaveShape::Single => Shape::Wave { amplitude, waves },
            WaveShape::Product => Shape::WaveProduct { amplitude, waves },
            WaveShape::Sum => Shape::WaveSum { amplitude, waves },
        };
        Some(single(
            &table.heights,
            side?,
            Origin::Shape { nodes, shape },
        ))
    })
}

/// Flat punches.
pub fn punch(
    section: &Section<PunchTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let nodes = checks.whole("nodes", &table.nodes, NODES);
        let side = checks.number_or("side", &table.side, QUANTITY, 1.0);
        let half = side.map_or(Bound::Unbounded, |side| Bound::Excluded(side / 2.0));
        let radius = checks.number("radius", &table.radius, (Bound::Excluded(0.0), half));
        let depth = checks.number("depth", &table.depth, QUANTITY);
        let (radius, depth) = (radius?, depth?);
        let shape = Shape::Punch { radius, depth };
        Some(single(
            &table.heights,
            side?,
            Origin::Shape {
                nodes: nodes?,
                shape,
            },
        ))
    })
}

/// A surface of which there is one.
pub fn single(heights: &Key<keys::Heights>, side: f64, origin: Origin) -> PlannedSurfaces {
    PlannedSurfaces {
        params: Params {
            heights: match heights.written().map(|heights| heights.value) {
                Some(keys::Heights::Redraw) => Heights::Redraw,
                Some(keys::Heights::Keep) | None => Heights::Keep,
            },
            side,
            origin,
        },
        realizations: 1,
        growth: None,
    }
}
