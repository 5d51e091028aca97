//! Checks of the stages that draw surfaces.

use std::ops::Bound;

use super::cutoffs::{self, Cutoff, WAVENUMBERS};
use super::grain;
use super::growth::{self, PlannedSurfaces};
use super::keys::{self, ParaboloidTable, PunchTable, RandomHeights, RandomTable, WaveTable};
use super::mesh::{self, Mesh, Wave, check_waves};
use super::{Heights, Origin, Params, PerAxis};
use crate::Given;
use asperity_contact::topography::random::{Amplitude, RandomSurface};
use asperity_contact::topography::shapes::Shape;
use asperity_contact::topography::spectrum::Spectrum;
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_manifest::written::Key;
use asperity_manifest::written::checks::{Checks, QUANTITY, report_equal_points};
use asperity_manifest::written::{Point, Section, Table};

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
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let hurst = (Bound::Excluded(0.0), Bound::Included(1.0));
        let hurst = checks.number("hurst", &table.hurst, hurst);
        let longer_side = mesh.map(|mesh| mesh.cell().longer_side());
        let lower = cutoffs::lower(table, longer_side, checks);
        let upper = cutoffs::upper(table, longer_side, checks);
        let k_rolloff = match &lower {
            Some(Cutoff { waves, .. }) => {
                checks.whole_or("k_rolloff", &table.k_rolloff, WAVENUMBERS, *waves)
            }
            None => None,
        };
        let anisotropy = grain::anisotropy(&table.anisotropy, checks);
        let rms_slope = checks.number_or("rms_slope", &table.rms_slope, QUANTITY, 1.0);
        let seed = checks.whole_or("seed", &table.seed, 0..=i64::MAX as u64, study_seed);
        let realizations = growth::realizations(&table.realizations, checks);
        let (hurst, lower, upper, k_rolloff) = (hurst?, lower?, upper?, k_rolloff?);
        let spectrum = Spectrum {
            hurst,
            k_lower: lower.waves,
            k_rolloff,
            k_upper: upper.waves,
            anisotropy: anisotropy?,
        };
        check_cutoffs(table, [&lower, &upper], k_rolloff, checks)?;
        let mesh = mesh?;
        let wave = Wave {
            written: upper.written,
            span: upper.span,
            waves: spectrum.most_waves(mesh.cell()),
        };
        check_waves(&wave, &table.nodes, &mesh, false, checks)?;
        grain::check_modes(&table.anisotropy, &spectrum, mesh.cell(), checks)?;
        let surface = RandomSurface {
            spectrum,
            amplitude,
            rms_slope: rms_slope?,
            seed: seed?,
            realization: 0,
        };
        let (realizations, growth) = realizations?;
        Some(PlannedSurfaces {
            params: Params {
                heights: random_heights(&table.heights),
                side: Some(mesh.side),
                origin: Origin::Random {
                    nodes: mesh.nodes,
                    surface,
                    has_unit_ratio: table.anisotropy.written().is_some() && anisotropy?.is_none(),
                },
            },
            realizations,
            growth,
            may_be_swept: section.may_be_swept,
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
fn check_cutoffs(
    table: &RandomTable,
    [lower, upper]: [&Cutoff; 2],
    k_rolloff: u32,
    checks: &mut Checks,
) -> Option<()> {
    let rolloff = table.k_rolloff.written().map(|written| Cutoff {
        waves: k_rolloff,
        written: format!("k_rolloff = {k_rolloff}"),
        span: &written.span,
    });
    let pairs = match &rolloff {
        Some(rolloff) if lower.waves <= upper.waves => [(lower, rolloff), (rolloff, upper)],
        _ => [(lower, upper); 2],
    };
    for (low, high) in pairs {
        if low.waves > high.waves {
            let message = format!("`{}` lies above `{}`", low.written, high.written);
            let problem =
                Problem::new(message, low.span.clone(), "larger").and(high.span.clone(), "smaller");
            checks.problems.push(problem.help(
                "lists are swept in every combination; to name combinations outright, write \
                 `cases = [{ k_lower = 1, k_upper = 32 }, …]`",
            ));
            return None;
        }
    }
    Some(())
}

/// Paraboloids.
pub fn paraboloid(
    section: &Section<ParaboloidTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let radius = checks.number("radius", &table.radius, QUANTITY);
        let shape = Shape::Paraboloid { radius: radius? };
        Some(on_mesh(mesh?, shape, &table.heights, section.may_be_swept))
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
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let amplitude = checks.number("amplitude", &table.amplitude, QUANTITY);
        let waves = checks.whole_or("waves", &table.waves, WAVENUMBERS, 1);
        let (mesh, amplitude, waves) = (mesh?, amplitude?, waves?);
        if let Some(written) = table.waves.written() {
            let along_y = if shape == WaveShape::Single { 0 } else { waves };
            let wave = Wave {
                written: format!("waves = {waves}"),
                span: &written.span,
                waves: [waves, along_y],
            };
            check_waves(&wave, &table.nodes, &mesh, true, checks)?;
        }
        let shape = match shape {
            WaveShape::Single => Shape::Wave { amplitude, waves },
            WaveShape::Product => Shape::WaveProduct { amplitude, waves },
            WaveShape::Sum => Shape::WaveSum { amplitude, waves },
        };
        Some(on_mesh(mesh, shape, &table.heights, section.may_be_swept))
    })
}

/// Flat punches.
pub fn punch(
    section: &Section<PunchTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let half = mesh.map_or(Bound::Unbounded, |mesh| {
            let PerAxis([side_x, side_y]) = mesh.side;
            Bound::Excluded(side_x.min(side_y) / 2.0)
        });
        let radius = checks.number("radius", &table.radius, (Bound::Excluded(0.0), half));
        let depth = checks.number("depth", &table.depth, QUANTITY);
        let (radius, depth) = (radius?, depth?);
        let shape = Shape::Punch { radius, depth };
        Some(on_mesh(mesh?, shape, &table.heights, section.may_be_swept))
    })
}

fn on_mesh(
    mesh: Mesh,
    shape: Shape,
    heights: &Key<keys::Heights>,
    may_be_swept: bool,
) -> PlannedSurfaces {
    let nodes = mesh.nodes;
    PlannedSurfaces {
        may_be_swept,
        ..single(heights, Some(mesh.side), Origin::Shape { nodes, shape })
    }
}

/// A surface of which there is one.
pub fn single(
    heights: &Key<keys::Heights>,
    side: Option<PerAxis<f64>>,
    origin: Origin,
) -> PlannedSurfaces {
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
        may_be_swept: false,
    }
}
