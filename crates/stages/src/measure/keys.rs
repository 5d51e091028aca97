//! Keys of the stages that measure, and what they come to.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::ops::Bound;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Params;
use super::distributions::Distribution;
use super::statistics::Statistic;
use crate::form::Surfaces;
use crate::{Given, Recipe, Rows};
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Section, table};

/// The largest `bins`.
const MOST_BINS: u32 = 1_000_000;
/// `bins` when left out.
const DEFAULT_BINS: u32 = 1000;
/// The largest `bins` of clusters.
const MOST_BINS_A_DECADE: u32 = 1000;
/// `bins` of clusters when left out.
const BINS_A_DECADE: u32 = 5;
/// `range` when left out.
const DEFAULT_RANGE: f64 = 5.0;
/// Bounds of `range`. No surface of n nodes is higher than √n rms heights, and bins narrower than
/// the rounding of heights count nothing.
const RANGES: [f64; 2] = [1e-6, 1e6];

/// Counts contacts, or measures surfaces.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureTable {
    /// What is measured. Of solved loads: their `"contacts"`, which is meant when nothing is said, or
    /// how `"pressures"`, `"gaps"` or the areas of `"clusters"` of contact are distributed; the first
    /// two where the `solve` stage has `pressure_bins` or `gap_bins`. Of surfaces: the distribution of
    /// their `"heights"`, which is meant when nothing is said, their power `"spectrum"` C(q) averaged
    /// over all directions, that of profiles along x and y (`"profile-spectrum"`), the
    /// `"autocorrelation"`, slope and curvature by scale (`"scales"`), the `"bearing"` curve, or the
    /// `"roughness"` parameters of ISO 25178.
    #[schemars(extend("default" = "heights"))]
    pub what: Key<What>,
    /// Bins of the histogram of heights, or steps between the planes of the bearing curve; of
    /// clusters, bins for each factor of ten in their area, 5 when left out.
    #[schemars(range(min = 1, max = MOST_BINS), extend("default" = DEFAULT_BINS))]
    pub bins: Key<i64>,
    /// Half width of the histogram of heights, or of the bearing curve, in rms heights; for surfaces
    /// only.
    #[schemars(extend("minimum" = RANGES[0], "maximum" = RANGES[1], "default" = DEFAULT_RANGE))]
    pub range: Key<f64>,
    /// Whether all surfaces of a parameter point share one histogram, with mean and standard
    /// deviation between them, instead of having one each; for surfaces only.
    #[schemars(extend("default" = false))]
    pub pool: Key<bool>,
    /// Whether the incremental stiffness of the interface is measured beside its contacts: how fast
    /// the pressure rises as the bodies approach, as a finite difference between neighbouring loads
    /// of a block that differ by at most a tenth.
    #[schemars(extend("default" = false))]
    pub stiffness: Key<bool>,
}

table!(MeasureTable, swept: [], lists: []);

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// Area, perimeter, clusters and percolation of contact maps.
    Contacts,
    /// How pressures in contact are distributed.
    Pressures,
    /// How gaps out of contact are distributed.
    Gaps,
    /// How the areas of clusters of contact are distributed, and how long their edges are.
    Clusters,
    /// How heights of surfaces are distributed.
    Heights,
    /// Their power spectral density, averaged over all directions.
    Spectrum,
    /// The power spectral density of profiles along x and y.
    ProfileSpectrum,
    /// The mean product of heights at a distance.
    Autocorrelation,
    /// Slope and curvature by the distance over which they are taken.
    Scales,
    /// The share of the surface at or above a height.
    Bearing,
    /// Sq, Sa, Sz, Ssk, Sku and Sdq.
    Roughness,
}

/// What the rows are about, if what is measured is not what is meant when nothing is said.
pub fn makes(section: &Section<MeasureTable>) -> Option<Rows> {
    let what = section.points.first()?.table.what.value()?;
    match what.quantity(1, 1.0) {
        Quantity::Contacts | Quantity::Heights => None,
        Quantity::Distribution(distribution) => Some(distribution.rows()),
        Quantity::Statistic(statistic) => Some(statistic.rows()),
    }
}

/// What the words mean.
enum Quantity {
    Contacts,
    Distribution(Distribution),
    Heights,
    Statistic(Statistic),
}

impl What {
    fn quantity(self, bins: u32, range: f64) -> Quantity {
        let statistic = match self {
            What::Contacts => return Quantity::Contacts,
            What::Pressures => return Quantity::Distribution(Distribution::Pressures),
            What::Gaps => return Quantity::Distribution(Distribution::Gaps),
            What::Clusters => return Quantity::Distribution(Distribution::Clusters { bins }),
            What::Heights => return Quantity::Heights,
            What::Spectrum => Statistic::Spectrum,
            What::ProfileSpectrum => Statistic::ProfileSpectrum,
            What::Autocorrelation => Statistic::Autocorrelation,
            What::Scales => Statistic::Scales,
            What::Bearing => Statistic::Bearing { bins, range },
            What::Roughness => Statistic::Roughness,
        };
        Quantity::Statistic(statistic)
    }

    fn is_of_loads(self) -> bool {
        let quantity = self.quantity(1, 1.0);
        matches!(quantity, Quantity::Contacts | Quantity::Distribution(_))
    }
}

/// What is measured, which follows from what the stage reads.
pub fn recipes(section: &Section<MeasureTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let point = section.points.first()?;
    let checks = &mut Checks::of(section, point, given.problems);
    let reads_surfaces = given.read? == Rows::Surfaces;
    let params = match reads_surfaces {
        true => of_surfaces(&point.table, given.surfaces.kept_alone.as_deref(), checks),
        false => of_loads(&point.table, &given.surfaces, checks),
    };
    Some(vec![Recipe::Measure(params?)])
}

/// The word for what is measured, if there is one and the stage does not read what it is about.
fn misplaced(table: &MeasureTable, of_loads: bool, checks: &mut Checks) -> Option<()> {
    let written = table.what.written();
    let Some(written) = written.filter(|what| what.value.is_of_loads() != of_loads) else {
        return Some(());
    };
    let (reads, words) = match of_loads {
        true => ("loads", r#""contacts", "pressures", "gaps" and "clusters""#),
        false => ("surfaces", r#""heights", "spectrum", "roughness" and the like"#),
    };
    let message = format!("this stage reads {reads}, and `what` asks for something else");
    let label = format!("of {reads} there are {words}");
    checks.refuse("what", message, &written.span, label)
}

fn of_loads(table: &MeasureTable, surfaces: &Surfaces, checks: &mut Checks) -> Option<Params> {
    misplaced(table, true, checks)?;
    let what = table.what.value().unwrap_or(What::Contacts);
    let stiffness = table.stiffness.value() == Some(true);
    let why = "for surfaces; this stage reads loads";
    let range = checks.forbidden("range", &table.range, why);
    let pool = checks.forbidden("pool", &table.pool, why);
    if what != What::Clusters {
        checks.forbidden("bins", &table.bins, "for surfaces and for clusters of contact")?;
    }
    let bins = checks.whole_or("bins", &table.bins, 1..=MOST_BINS_A_DECADE, BINS_A_DECADE)?;
    range.and(pool)?;
    let Quantity::Distribution(distribution) = what.quantity(bins, 1.0) else {
        return Some(Params::Contacts { stiffness });
    };
    let why = "measured beside contacts, `what = \"contacts\"`";
    if stiffness {
        checks.forbidden("stiffness", &table.stiffness, why)?;
    }
    let uncounted = match distribution {
        Distribution::Pressures => surfaces.pressures_uncounted.as_ref().zip(Some("pressure_bins")),
        Distribution::Gaps => surfaces.gaps_uncounted.as_ref().zip(Some("gap_bins")),
        Distribution::Clusters { .. } => None,
    };
    let Some((stage, key)) = uncounted else {
        return Some(Params::Distribution(distribution));
    };
    let place = &table.what.written()?.span;
    let message = format!("stage `{stage}` does not count what is asked for");
    let label = "needs counts of what is no longer there after the solution";
    let problem = Problem::new(message, place.clone(), label);
    let example = format!("`{key} = {{ count = 100, to = 5.0 }}` in stage `{stage}` counts them");
    checks.reject(problem.help(example))
}

fn of_surfaces(
    table: &MeasureTable,
    kept_alone: Option<&str>,
    checks: &mut Checks,
) -> Option<Params> {
    let why = "for loads; this stage reads surfaces";
    if table.stiffness.value() == Some(true) {
        checks.forbidden("stiffness", &table.stiffness, why)?;
    }
    let bins = checks.whole_or("bins", &table.bins, 1..=MOST_BINS, DEFAULT_BINS);
    let ranges = (Bound::Included(RANGES[0]), Bound::Included(RANGES[1]));
    let range = checks.number_or("range", &table.range, ranges, DEFAULT_RANGE);
    misplaced(table, false, checks)?;
    let (bins, range) = (bins?, range?);
    let what = table.what.value().unwrap_or(What::Heights);
    let Quantity::Statistic(statistic) = what.quantity(bins, range) else {
        return heights(table, bins, range, kept_alone, checks);
    };
    let why = "for the distribution of heights, `what = \"heights\"`";
    let pool = checks.forbidden("pool", &table.pool, why);
    if what != What::Bearing {
        let why = "for the distribution of heights and the bearing curve";
        checks.forbidden("bins", &table.bins, why)?;
        checks.forbidden("range", &table.range, why)?;
    }
    pool.map(|()| Params::Surface(statistic))
}

fn heights(
    table: &MeasureTable,
    bins: u32,
    range: f64,
    kept_alone: Option<&str>,
    checks: &mut Checks,
) -> Option<Params> {
    let Some(pool) = table.pool.written().filter(|pool| pool.value) else {
        return Some(Params::Heights { bins, range });
    };
    let Some(stage) = kept_alone else {
        return Some(Params::Pool { bins, range });
    };
    let message = "these surfaces cannot be drawn again to be pooled";
    let label = format!("`{stage}` has their spectrum from another stage");
    let problem = Problem::new(message, pool.span.clone(), label);
    checks.reject(problem.help("without `pool` each surface has its own histogram"))
}
