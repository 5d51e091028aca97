//! Checks of the stages that draw surfaces.

use std::ops::Bound;

use super::{Ensemble, until};
use crate::contact::topography::random::{Amplitude, RandomSurface};
use crate::contact::topography::shapes::Shape;
use crate::contact::topography::spectrum::Spectrum;
use crate::diagnostics::{Problem, Problems};
use crate::manifest::Form;
use crate::manifest::generate::{
    self, ParaboloidTable, PunchTable, RandomHeights, RandomTable, WaveTable,
};
use crate::stages::generate::{Form as Surface, Heights, Params};
use crate::written::Key;
use crate::written::checks::{Checks, QUANTITY, report_equal_points};
use crate::written::{Point, Section, Table};

/// Meshes, in nodes per side.
pub const NODES: std::ops::RangeInclusive<u32> = 4..=16384;
const WAVENUMBERS: std::ops::RangeInclusive<u32> = 1..=*NODES.end() / 2;

/// The surfaces of a stage, point by point of its grid.
pub fn ensembles<T: Table>(
    section: &Section<T>,
    problems: &mut Problems,
    mut ensemble: impl FnMut(&T, &mut Checks) -> Option<Ensemble>,
) -> Option<Vec<Ensemble>> {
    let mut checked = |point: &Point<T>| {
        let mut checks = Checks::of(section, point, problems);
        ensemble(&point.table, &mut checks)
    };
    let ensembles: Vec<Option<_>> = section.points.iter().map(&mut checked).collect();
    let ensembles: Vec<_> = ensembles.into_iter().collect::<Option<_>>()?;
    let params = ensembles.iter().map(|ensemble| &ensemble.params);
    report_equal_points(section, params, problems);
    Some(ensembles)
}

/// Random surfaces.
pub fn random(
    form: Form,
    section: &Section<RandomTable>,
    study_seed: u64,
    problems: &mut Problems,
) -> Option<Vec<Ensemble>> {
    let amplitude = match form {
        Form::RandomPhase => Amplitude::Deterministic,
        _ => Amplitude::Gaussian,
    };
    ensembles(section, problems, |table, checks| {
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
        let realizations = until::realizations(&table.realizations, checks);
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
        Some(Ensemble {
            params: Params {
                heights: random_heights(&table.heights),
                side: side?,
                form: Surface::Random { nodes, surface },
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
) -> Option<Vec<Ensemble>> {
    ensembles(section, problems, |table, checks| {
        let nodes = checks.whole("nodes", &table.nodes, NODES);
        let side = checks.number_or("side", &table.side, QUANTITY, 1.0);
        let radius = checks.number("radius", &table.radius, QUANTITY);
        let shape = Shape::Paraboloid { radius: radius? };
        Some(single(
            &table.heights,
            side?,
            Surface::Shape {
                nodes: nodes?,
                shape,
            },
        ))
    })
}

/// Waves along one direction or two.
pub fn wave(
    form: Form,
    section: &Section<WaveTable>,
    problems: &mut Problems,
) -> Option<Vec<Ensemble>> {
    ensembles(section, problems, |table, checks| {
        let nodes = checks.whole("nodes", &table.nodes, NODES);
        let side = checks.number_or("side", &table.side, QUANTITY, 1.0);
        let amplitude = checks.number("amplitude", &table.amplitude, QUANTITY);
        let waves = checks.whole_or("waves", &table.waves, WAVENUMBERS, 1);
        let (nodes, amplitude, waves) = (nodes?, amplitude?, waves?);
        check_mesh(("waves", &table.waves), &table.nodes, nodes, true, checks)?;
        let shape = match form {
            Form::WaveProduct => Shape::WaveProduct { amplitude, waves },
            Form::WaveSum => Shape::WaveSum { amplitude, waves },
            _ => Shape::Wave { amplitude, waves },
        };
        Some(single(
            &table.heights,
            side?,
            Surface::Shape { nodes, shape },
        ))
    })
}

/// Flat punches.
pub fn punch(section: &Section<PunchTable>, problems: &mut Problems) -> Option<Vec<Ensemble>> {
    ensembles(section, problems, |table, checks| {
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
            Surface::Shape {
                nodes: nodes?,
                shape,
            },
        ))
    })
}

/// A surface of which there is one.
pub fn single(heights: &Key<generate::Heights>, side: f64, form: Surface) -> Ensemble {
    Ensemble {
        params: Params {
            heights: match heights.written().map(|heights| heights.value) {
                Some(generate::Heights::Redraw) => Heights::Redraw,
                Some(generate::Heights::Keep) | None => Heights::Keep,
            },
            side,
            form,
        },
        realizations: 1,
        growth: None,
    }
}
