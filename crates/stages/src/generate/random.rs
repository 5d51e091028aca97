//! Random self-affine surfaces: their keys and the checks of these.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::ops::Bound;

use schemars::JsonSchema;
use serde::Deserialize;

use super::growth::{self, PlannedSurfaces, Realizations};
use super::mesh::{self, FEWEST_NODES, MOST_NODES, MOST_WAVES, WAVENUMBERS, Wave, check_waves};
use super::method::surfaces;
use super::{Heights, Origin, Params};
use crate::Given;
use asperity_contact::grid::Cell;
use asperity_contact::topography::random::{Amplitude, RandomSurface};
use asperity_contact::topography::spectrum::Anisotropy;
use asperity_contact::topography::spectrum::Spectrum;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::written::checks::{Bounds, Checks, QUANTITY};
use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, Section, table};

/// How far a side may be from a whole number of wavelengths, as a share of it: what twelve digits of
/// a quotient that a person writes out leave.
const ROUNDING: f64 = 1e-9;

const RATIOS: Bounds = (Bound::Included(1.0), Bound::Included(1000.0));
const ANGLES: Bounds = (Bound::Included(0.0), Bound::Excluded(180.0));

/// Random self-affine surfaces: a plateau up to `k_rolloff`, then a power law up to `k_upper`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RandomTable {
    /// Nodes per side of the mesh, at least two to the shortest wave; of a rectangle those along x
    /// and along y, `[1024, 512]`, beside a pair for `side`. The mesh samples the surface and does
    /// not change it.
    #[schemars(required, range(min = FEWEST_NODES, max = MOST_NODES), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y,
    /// `[2.0, 1.0]`, beside a pair for `nodes`. Rectangles are swept as lists of pairs.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Hurst exponent, above 0 and at most 1.
    #[schemars(required, range(max = 1), extend("exclusiveMinimum" = 0))]
    pub hurst: Key<f64>,
    /// Lower cutoff wavenumber, in units of 2π / side, of a rectangle the longer one; included.
    /// `longest_wavelength` may stand instead.
    #[schemars(range(min = 1, max = MOST_WAVES))]
    pub k_lower: Key<i64>,
    /// The longest wavelength, in the unit of `side`, which it fits a whole number of times, of a
    /// rectangle the longer one; instead of `k_lower`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub longest_wavelength: Key<f64>,
    /// Wavenumber up to which the spectrum is flat, from `k_lower` to `k_upper`; `k_lower`, that
    /// is no plateau, when left out.
    #[schemars(range(min = 1, max = MOST_WAVES))]
    pub k_rolloff: Key<i64>,
    /// Upper cutoff wavenumber, in units of 2π / side, of a rectangle the longer one; included, at
    /// most half of `nodes`. `shortest_wavelength` may stand instead.
    #[schemars(range(min = 1, max = MOST_WAVES))]
    pub k_upper: Key<i64>,
    /// The shortest wavelength, in the unit of `side`, which it fits a whole number of times, of a
    /// rectangle the longer one; instead of `k_upper`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shortest_wavelength: Key<f64>,
    /// A grain, `{ ratio = 2.0, angle = 30 }`: wavelengths and correlation lengths along it, at the
    /// angle in degrees from x, are `ratio` times those across. The density at (k∥, k⊥) is the
    /// isotropic one at √((ratio k∥)² + k⊥²), with k∥ = k_x cos angle + k_y sin angle; cutoffs are
    /// those across. A ratio of 1 is isotropic.
    pub anisotropy: Key<AnisotropyTable>,
    /// Root mean square slope that each surface is scaled to.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    pub rms_slope: Key<f64>,
    /// Seed of the draws; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
    /// Number of surfaces drawn for each point of the grid, or until when more are drawn:
    /// `{ at_least, at_most, until }`. More of them change none before.
    #[schemars(extend("default" = 1))]
    pub realizations: Key<Realizations>,
    /// Whether heights are stored, drawn again when needed, or left out: `"none"` describes
    /// surfaces by their modes alone, many times faster, for statistics and not for contact.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<Heights>,
}

table!(
    RandomTable,
    swept: [
        "nodes", "side", "hurst", "k_lower", "longest_wavelength", "k_rolloff", "k_upper",
        "shortest_wavelength", "anisotropy", "rms_slope", "seed"
    ],
    lists: [],
    pairs: ["nodes", "side"]
);

/// A grain.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AnisotropyTable {
    /// Correlation length along the grain over that across, from 1 to 1000.
    #[schemars(required, range(min = 1, max = 1000))]
    pub ratio: Key<f64>,
    /// Direction of the grain, in degrees from the x axis, from 0 up to but not with 180.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 180, "default" = 0.0))]
    pub angle: Key<f64>,
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
        let longest = ("longest_wavelength", &table.longest_wavelength);
        let lower = cutoff(("k_lower", &table.k_lower), longest, longer_side, checks);
        let shortest = ("shortest_wavelength", &table.shortest_wavelength);
        let upper = cutoff(("k_upper", &table.k_upper), shortest, longer_side, checks);
        let k_rolloff = match &lower {
            Some(Cutoff { waves, .. }) => {
                checks.whole_or("k_rolloff", &table.k_rolloff, WAVENUMBERS, *waves)
            }
            None => None,
        };
        let anisotropy = anisotropy(&table.anisotropy, checks);
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
            waves: spectrum.max_waves(mesh.cell()),
        };
        check_waves(&wave, &table.nodes, &mesh, false, checks)?;
        check_modes(&table.anisotropy, &spectrum, mesh.cell(), checks)?;
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
                heights: table.heights.value().unwrap_or(Heights::Keep),
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
            return checks.reject(problem.help(
                "lists are swept in every combination; to name combinations outright, write \
                 `cases = [{ k_lower = 1, k_upper = 32 }, …]`",
            ));
        }
    }
    Some(())
}

/// A cutoff, in waves along the longer side, and what it is written as.
struct Cutoff<'a> {
    waves: u32,
    /// `k_upper = 32`, or `shortest_wavelength = 0.05`.
    written: String,
    span: &'a Span,
}

/// The lower or the upper cutoff, in waves or by its wavelength, on a cell with this longer side.
fn cutoff<'t>(
    (name, key): (&str, &'t Key<i64>),
    (length_name, length): (&str, &'t Key<f64>),
    longer_side: Option<f64>,
    checks: &mut Checks,
) -> Option<Cutoff<'t>> {
    let Some(written) = length.written() else {
        if key.written().is_none() && checks.is_excused(length_name) {
            return None;
        }
        let waves = checks.whole(name, key, WAVENUMBERS)?;
        let span = &key.written()?.span;
        let written = format!("{name} = {waves}");
        return Some(Cutoff { waves, written, span });
    };
    let wavelength = checks.is_in(length_name, written, QUANTITY)?;
    if let Some(key) = key.written() {
        let message = format!("`{name}` and `{length_name}` exclude each other");
        let problem = Problem::new(message, written.span.clone(), "the wavelength")
            .and(key.span.clone(), "follows from it");
        checks.report(length_name, problem);
        return None;
    }
    let waves = match waves_along(longer_side?, wavelength) {
        Ok(waves) => waves,
        Err((found, wanted)) => {
            let message = format!("`{length_name} = {wavelength}` {found}");
            let problem = Problem::new(message, written.span.clone(), wanted);
            return checks.reject(problem.help(
                "the surface repeats itself, so that all its waves fit the side a whole number of \
                 times",
            ));
        }
    };
    Some(Cutoff { waves, written: format!("{length_name} = {wavelength}"), span: &written.span })
}

/// How often a wavelength fits the longer side, or else what was found and what would do.
fn waves_along(longer_side: f64, wavelength: f64) -> Result<u32, (String, String)> {
    let times = longer_side / wavelength;
    let waves = times.round();
    let [fewest, most] = [*WAVENUMBERS.start(), *WAVENUMBERS.end()].map(f64::from);
    let found = format!("fits {times:.4} times into the longer side, {longer_side}");
    if waves < fewest || waves > most {
        return Err((found, format!("must fit from {fewest} to {most} times")));
    }
    if (times / waves - 1.0).abs() <= ROUNDING {
        return Ok(waves as u32);
    }
    let around = [times.floor(), times.ceil()].into_iter();
    let around = around.filter(|waves| *waves >= fewest).map(|waves| {
        let length = decimal::nearest(longer_side / waves);
        format!("{length} ({waves} times)")
    });
    let nearest: Vec<_> = around.collect();
    Err((found, format!("nearest are {}", nearest.join(" and "))))
}

/// The grain, if there is any; `None` if what is written is none.
fn anisotropy(key: &Key<AnisotropyTable>, checks: &mut Checks) -> Option<Option<Anisotropy>> {
    let Some(written) = key.written() else {
        return Some(None);
    };
    let ratio = checks.required_in(("anisotropy", &written.span), "ratio", &written.value.ratio);
    let ratio = ratio.and_then(|ratio| checks.is_in("ratio", ratio, RATIOS));
    let angle = checks.number_or("angle", &written.value.angle, ANGLES, 0.0);
    Some(Anisotropy::new(ratio?, angle?))
}

/// Between cutoffs that are close, a grain may leave no wave that fits the cell.
fn check_modes(
    key: &Key<AnisotropyTable>,
    spectrum: &Spectrum,
    cell: Cell,
    checks: &mut Checks,
) -> Option<()> {
    let Some(written) = key.written() else {
        return Some(());
    };
    if spectrum.rows(cell).next().is_some() {
        return Some(());
    }
    let message = "with this grain no wave that fits the cell lies between the cutoffs";
    let label = "too close to each other for it";
    checks.refuse("anisotropy", message, &written.span, label)
}
