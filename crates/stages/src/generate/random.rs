//! Keys and recipes of random self-affine surfaces.
//!
//! Editors show the doc comments of keys, and messages quote them.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::generate::mesh::{self, MAX_NODES, MAX_WAVES, MIN_NODES, Wave, check_waves};
use crate::stage_points::{StagePoints, Work};
use crate::surface::planned::{
    Growing, PlannedSurfaces, Realizations, growing, realizations, surfaces,
};
use crate::surface::spectrum::PrescribedHeights;
use crate::surface::{Heights, Origin, Params};
use crate::{CheckContext, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{length, pair, required, swept, unit_of_lengths};
use asperity_manifest::keys::{GridPoint, Key, OnAxes, Section, Spanned, table};
use asperity_mechanics::grid::Cell;
use asperity_mechanics::topography::johnson::{MAX_KURTOSIS, MAX_SKEWNESS, check_moments};
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::{Anisotropy, Spectrum};

/// Relative tolerance between a side and a whole number of wavelengths. It covers the rounding of a
/// quotient with twelve digits.
const ROUNDING: f64 = 1e-9;

/// Random self-affine surfaces with a plateau up to `k_rolloff` and a power law up to `k_upper`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RandomTable {
    /// Number of nodes per side of the cell; for a rectangle a pair along x and y, such as
    /// `[1024, 512]`, together with a pair for `side`. The shortest wave must span at least two
    /// nodes. The mesh only samples the surface: a finer mesh shows the same one.
    #[schemars(range(min = MIN_NODES, max = MAX_NODES))]
    #[schemars(transform = pair, transform = swept, transform = required)]
    pub nodes: Key<OnAxes<u32>>,
    /// Side length of the periodic cell, as in `"100 um"`, or a number in any unit of length; for a
    /// rectangle a pair along x and y, such as `[2.0, 1.0]`, together with a pair for `nodes`. A
    /// list of pairs is swept.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    #[schemars(transform = pair, transform = swept, transform = length)]
    pub side: Key<OnAxes<f64>>,
    /// Hurst exponent H: beyond the roll-off the power spectral density falls as q^(−2(1 + H)).
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    #[schemars(transform = swept, transform = required)]
    pub hurst: Key<f64>,
    /// Smallest wavenumber of the spectrum, in waves per longer side L (q = 2πk/L). Give either
    /// this key or `longest_wavelength`.
    #[schemars(range(min = 1, max = MAX_WAVES), transform = swept)]
    pub k_lower: Key<u32>,
    /// Longest wavelength of the spectrum, in the unit of `side`. The longer side must be a whole
    /// multiple of it. Give either this key or `k_lower`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept, transform = length)]
    pub longest_wavelength: Key<f64>,
    /// Roll-off wavenumber, in waves per longer side: the spectrum is flat from `k_lower` to
    /// `k_rolloff`. The default is `k_lower`, which gives no plateau.
    #[schemars(range(min = 1, max = MAX_WAVES), transform = swept)]
    pub k_rolloff: Key<u32>,
    /// Largest wavenumber of the spectrum, in waves per longer side, at most half of `nodes`. Give
    /// either this key or `shortest_wavelength`.
    #[schemars(range(min = 1, max = MAX_WAVES), transform = swept)]
    pub k_upper: Key<u32>,
    /// Shortest wavelength of the spectrum, in the unit of `side`. The longer side must be a whole
    /// multiple of it. Give either this key or `k_upper`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept, transform = length)]
    pub shortest_wavelength: Key<f64>,
    /// Anisotropy of the spectrum, `{ ratio = 2.0, angle = 30 }`: wavelengths and correlation
    /// lengths along the direction at `angle` degrees from x are `ratio` times those across it. The
    /// density at (k∥, k⊥) is the isotropic density at √((ratio k∥)² + k⊥²), with k∥ = k_x cos
    /// angle + k_y sin angle. The cutoffs `k_lower`, `k_rolloff` and `k_upper` apply across the
    /// direction. By default surfaces are isotropic.
    #[schemars(transform = swept)]
    pub anisotropy: Key<AnisotropyTable>,
    /// Root mean square slope to which each surface is scaled.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = swept)]
    pub rms_slope: Key<f64>,
    /// Root mean square height to which each surface is scaled, in the unit of `side`, instead of
    /// `rms_slope`. The rms slope then varies between surfaces, unless `method` is
    /// `"random-phase"`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept, transform = length)]
    pub rms_height: Key<f64>,
    /// Skewness of the heights, Ssk of ISO 25178-2: negative for valleys below a plateau, positive
    /// for peaks. Needs `kurtosis`; with `kurtosis` alone, it is 0. Each mode has the same power as
    /// without these keys, but other phases, and the surface is again the same on any mesh. Its own
    /// values are in the columns `skewness` and `excess_kurtosis`.
    #[schemars(range(min = -MAX_SKEWNESS, max = MAX_SKEWNESS), transform = swept)]
    pub skewness: Key<f64>,
    /// Kurtosis of the heights, Sku of ISO 25178-2: 3 for a Gaussian surface, more for rare peaks
    /// or valleys, and always more than skewness² + 1. The column `excess_kurtosis` is the kurtosis
    /// minus 3. By default surfaces are Gaussian.
    #[schemars(range(max = MAX_KURTOSIS), extend("exclusiveMinimum" = 1), transform = swept)]
    pub kurtosis: Key<f64>,
    /// Name of a `generate` stage with one surface, such as a measured map, whose distribution of
    /// heights the surfaces have, in units of the rms height. Excludes `skewness` and `kurtosis`.
    pub height_distribution: Key<String>,
    /// Name of the unit of length. It is a label for lengths that are plain numbers, and converts
    /// nothing. The default is the unit that is written at `side`.
    #[schemars(extend("default" = ""), transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Seed of the random numbers. The default is the `seed` of `[study]`.
    #[schemars(transform = swept)]
    pub seed: Key<u64>,
    /// Number of surfaces for each combination of swept values, or `{ at_least, at_most, until }`
    /// to draw surfaces until a condition holds. Drawing more surfaces does not change the earlier
    /// ones. `cases` can give each mesh its own number, for multilevel means.
    #[schemars(extend("default" = 1), transform = swept)]
    pub realizations: Key<Realizations>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` draws them again when
    /// needed. `"none"` describes surfaces by their modes alone, which is many times faster, but
    /// their contact cannot be solved.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<Heights>,
}

table!(RandomTable);

/// Keys of the anisotropy of a spectrum.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AnisotropyTable {
    /// Correlation length along the direction divided by the correlation length across it.
    #[schemars(range(min = 1, max = 1000))]
    pub ratio: f64,
    /// Angle from the x axis to the direction, in degrees.
    #[serde(default)]
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 180, "default" = 0.0))]
    pub angle: Key<f64>,
}

impl StagePoints for (Amplitude, Section<RandomTable>) {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        random(self.0, &self.1, context).map(Work::Generate)
    }

    fn row_kind(&self) -> Option<RowKind> {
        let lacks_heights =
            |point: &GridPoint<RandomTable>| point.table.heights.value() == Some(Heights::None);
        self.1.points.iter().any(lacks_heights).then_some(RowKind::Spectra)
    }

    fn heights_of(&self) -> Option<&Spanned<String>> {
        self.1.points.first()?.table.height_distribution.written()
    }

    fn growing(&self) -> Option<&Growing> {
        growing(&self.1.points.first()?.table.realizations)
    }
}

/// Returns the random self-affine surfaces of a stage, or `None` after reporting problems.
fn random(
    amplitude: Amplitude,
    section: &Section<RandomTable>,
    context: &mut CheckContext,
) -> Option<Vec<PlannedSurfaces>> {
    let (study_seed, others) = (context.seed, context.heights_of);
    check_scaling(section, |table| &table.rms_height, context.problems)?;
    surfaces(section, context.problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let unit = mesh::unit(&table.unit, &table.side, checks);
        let hurst = checks.number("hurst", &table.hurst);
        let longer_side = mesh.map(|mesh| mesh.cell().longer_side());
        let longest = ("longest_wavelength", &table.longest_wavelength);
        let lower = cutoff(("k_lower", &table.k_lower), longest, longer_side, checks);
        let shortest = ("shortest_wavelength", &table.shortest_wavelength);
        let upper = cutoff(("k_upper", &table.k_upper), shortest, longer_side, checks);
        let k_rolloff = match &lower {
            Some(Cutoff { waves, .. }) => checks.value_or("k_rolloff", &table.k_rolloff, *waves),
            None => None,
        };
        let anisotropy = anisotropy(&table.anisotropy, checks);
        let rms_slope = checks.number("rms_slope", &table.rms_slope);
        let rms_height = rms_height(&table.rms_slope, &table.rms_height, checks);
        let seed = checks.value_or("seed", &table.seed, study_seed);
        let keys = HeightKeys {
            skewness: &table.skewness,
            kurtosis: &table.kurtosis,
            height_distribution: &table.height_distribution,
            heights: &table.heights,
        };
        let height_distribution = keys.read(others, checks);
        let heights = checks.value("heights", &table.heights);
        let realizations = realizations(&table.realizations, checks);
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
        let rms_height = rms_height?;
        let rms_slope = match rms_height {
            Some(rms_height) => expected_slope(&spectrum, mesh.cell(), rms_height),
            None => rms_slope?,
        };
        let surface = RandomSurface { spectrum, amplitude, rms_slope, seed: seed?, realization: 0 };
        let (realizations, growth) = realizations?;
        Some(PlannedSurfaces {
            params: Params {
                heights: heights?,
                side: Some(mesh.side),
                origin: Origin::Random {
                    nodes: mesh.nodes,
                    surface,
                    has_unit_ratio: table.anisotropy.written().is_some() && anisotropy?.is_none(),
                    rms_height,
                    height_distribution: height_distribution?,
                    unit: unit?,
                },
            },
            realizations,
            growth,
            sample: None,
            may_be_swept: section.may_be_swept,
        })
    })
}

/// Returns the rms slope of the expected spectrum with this rms height.
fn expected_slope(spectrum: &Spectrum, cell: Cell, rms_height: f64) -> f64 {
    let moments = spectrum.moments(cell);
    let of_unit_height = moments.rms_slope() / moments.rms_height();
    decimal::nearest(rms_height * of_unit_height)
}

/// Returns the rms height to which surfaces are scaled, or `Some(None)` if the key is left out.
/// Refuses a rms slope beside it.
pub fn rms_height(slope: &Key<f64>, height: &Key<f64>, checks: &mut Checks) -> Option<Option<f64>> {
    if let (Some(slope), Some(height)) = (slope.written(), height.written()) {
        let message = "`rms_slope` and `rms_height` exclude each other";
        let problem = Problem::new(message, height.span.clone(), "gives the rms height")
            .and(slope.span.clone(), "also determines the heights");
        return checks.reject(problem.help("remove one of the two keys"));
    }
    checks.optional_number("rms_height", height)
}

/// Refuses a stage in which only some parameter points have a rms height, because its column would
/// be a parameter of some surfaces and a result of others.
pub fn check_scaling<T>(
    section: &Section<T>,
    rms_height: impl Fn(&T) -> &Key<f64>,
    problems: &mut Problems,
) -> Option<()> {
    let is_given = |point: &&GridPoint<T>| rms_height(&point.table).written().is_some();
    let given = section.points.iter().find(is_given);
    let other = section.points.iter().find(|point| !is_given(point));
    let (Some(given), Some(other)) = (given, other) else {
        return Some(());
    };
    let span = &rms_height(&given.table).written()?.span;
    let message = "only some surfaces of the stage are scaled to a rms height";
    let problem = Problem::new(message, span.clone(), "has `rms_height`")
        .and(other.span.clone(), "lacks `rms_height`");
    problems.push(problem.help("scale the other surfaces in a stage of their own"));
    None
}

/// Refuses cutoffs that violate `k_lower ≤ k_rolloff ≤ k_upper`.
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
            let message = format!("`{}` is above `{}`", low.written, high.written);
            let problem =
                Problem::new(message, low.span.clone(), "larger").and(high.span.clone(), "smaller");
            return checks.reject(problem.help(
                "choose lower cutoff ≤ roll-off ≤ upper cutoff; swept lists are combined with each \
                 other, so list valid combinations as `cases = [{ k_lower = 1, k_upper = 32 }, …]`",
            ));
        }
    }
    Some(())
}

/// A cutoff of the spectrum, in waves along the longer side.
struct Cutoff<'a> {
    waves: u32,
    /// The key and its value as in the manifest: `k_upper = 32`, or `shortest_wavelength = 0.05`.
    written: String,
    span: &'a Span,
}

/// Returns the lower or the upper cutoff, which the manifest gives in waves or as a wavelength.
fn cutoff<'t>(
    (name, key): (&str, &'t Key<u32>),
    (length_name, length): (&str, &'t Key<f64>),
    longer_side: Option<f64>,
    checks: &mut Checks,
) -> Option<Cutoff<'t>> {
    let Some(written) = checks.optional(length_name, length)? else {
        let waves = checks.value(name, key)?;
        let span = &key.written()?.span;
        let written = format!("{name} = {waves}");
        return Some(Cutoff { waves, written, span });
    };
    let wavelength = decimal::nearest(written.value);
    if let Some(key) = key.written() {
        let message = format!("`{name}` and `{length_name}` exclude each other");
        let problem = Problem::new(message, written.span.clone(), "the wavelength")
            .and(key.span.clone(), "follows from the other key");
        checks.report(length_name, problem);
        return None;
    }
    let waves = match waves_along(longer_side?, wavelength) {
        Ok(waves) => waves,
        Err((found, label)) => {
            let message = format!("`{length_name} = {wavelength}` {found}");
            let problem = Problem::new(message, written.span.clone(), label);
            return checks.reject(problem.help(
                "the surface is periodic: the longer side must be a multiple of every wavelength",
            ));
        }
    };
    Some(Cutoff { waves, written: format!("{length_name} = {wavelength}"), span: &written.span })
}

/// Returns the number of wavelengths along the longer side. If it is not a whole number, returns
/// the end of the message and the label of the problem instead.
fn waves_along(longer_side: f64, wavelength: f64) -> Result<u32, (String, String)> {
    let times = longer_side / wavelength;
    let waves = times.round();
    let max = f64::from(MAX_WAVES);
    let found = format!("fits {times:.4} times into the longer side, {longer_side}");
    if waves < 1.0 || waves > max {
        return Err((found, format!("must fit from 1 to {max} times")));
    }
    if (times / waves - 1.0).abs() <= ROUNDING {
        return Ok(waves as u32);
    }
    let around =
        [times.floor(), times.ceil()].into_iter().filter(|waves| *waves >= 1.0).map(|waves| {
            let length = decimal::nearest(longer_side / waves);
            format!("{length} ({waves} times)")
        });
    let nearest: Vec<_> = around.collect();
    Err((found, format!("the nearest are {}", nearest.join(" and "))))
}

/// Returns the anisotropy, or no anisotropy if the key is left out or its ratio is 1.
fn anisotropy(key: &Key<AnisotropyTable>, checks: &mut Checks) -> Option<Option<Anisotropy>> {
    let Some(written) = checks.optional("anisotropy", key)? else {
        return Some(None);
    };
    let angle = checks.number("anisotropy.angle", &written.value.angle)?;
    Some(Anisotropy::new(decimal::nearest(written.value.ratio), angle))
}

/// Refuses an anisotropy for which no wave of the cell lies between the cutoffs.
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
    let message = "with this anisotropy no wave of the cell lies between the cutoffs";
    let label = "needs a wider range of cutoffs";
    checks.refuse("anisotropy", message, &written.span, label)
}

/// Keys of the height distribution of a random surface.
pub struct HeightKeys<'a> {
    pub skewness: &'a Key<f64>,
    pub kurtosis: &'a Key<f64>,
    pub height_distribution: &'a Key<String>,
    pub heights: &'a Key<Heights>,
}

impl HeightKeys<'_> {
    /// Returns the prescribed height distribution, or `Some(None)` for Gaussian surfaces. `others`
    /// are the surfaces of the stage in `height_distribution`.
    pub fn read(
        &self,
        others: Option<&[PlannedSurfaces]>,
        checks: &mut Checks,
    ) -> Option<Option<PrescribedHeights>> {
        let skewness = checks.optional_number("skewness", self.skewness)?;
        let kurtosis = checks.optional_number("kurtosis", self.kurtosis)?;
        let stage = checks.optional("height_distribution", self.height_distribution)?;
        let prescribed = match (skewness, kurtosis, stage) {
            (None, None, None) => return Some(None),
            (None, None, Some(stage)) => from_surface(stage, others?, checks)?,
            (_, _, Some(stage)) => {
                let [skewness, kurtosis] = [self.skewness, self.kurtosis].map(Key::written);
                let moment = skewness.or(kurtosis)?;
                let message = "`height_distribution` excludes `skewness` and `kurtosis`";
                let problem = Problem::new(message, moment.span.clone(), "gives a moment")
                    .and(stage.span.clone(), "gives the whole distribution");
                return checks.reject(problem.help("remove the moments or `height_distribution`"));
            }
            (Some(skewness), None, None) => {
                let span = &self.skewness.written()?.span;
                let gamma = 3.0 + 1.5 * skewness * skewness;
                let message = "`skewness` needs `kurtosis`";
                let label = format!("a gamma distribution with it has `kurtosis = {gamma}`");
                return checks.refuse("kurtosis", message, span, label);
            }
            (written, Some(kurtosis), None) => {
                let skewness = written.unwrap_or(0.0);
                if let Err(error) = check_moments(skewness, kurtosis) {
                    let span = &self.kurtosis.written()?.span;
                    return checks.refuse("kurtosis", error.to_string(), span, "not possible");
                }
                PrescribedHeights::Moments { skewness, kurtosis }
            }
        };
        if let Some(written) = self.heights.written().filter(|one| one.value == Heights::None) {
            let message = "surfaces with a prescribed height distribution need heights";
            let label = "must be \"keep\" or \"redraw\": the phases of their modes depend on it";
            return checks.refuse("heights", message, &written.span, label);
        }
        Some(Some(prescribed))
    }
}

/// Returns the height distribution of the surface of another stage, which must have a single
/// parameter point.
fn from_surface(
    stage: &Spanned<String>,
    others: &[PlannedSurfaces],
    checks: &mut Checks,
) -> Option<PrescribedHeights> {
    let [other] = others else {
        let message = format!("`{}` has {} parameter points", stage.value, others.len());
        let label = "must have a single parameter point";
        return checks.refuse("height_distribution", message, &stage.span, label);
    };
    let from = other.params.realization(0).with(Heights::Redraw);
    Some(PrescribedHeights::Surface { from: Box::new(from) })
}
