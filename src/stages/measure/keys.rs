//! Keys of the stages that measure, and what they come to.
//!
//! The comments of the keys are what editors show and what messages quote.

use schemars::JsonSchema;
use serde::Deserialize;

use super::super::Given;
use super::super::{Recipe, Rows};
use super::Params;
use super::statistics::Statistic;
use crate::diagnostics::Problem;
use crate::written::checks::{Checks, POSITIVE};
use crate::written::{Key, Section, table};

/// The largest `bins`.
const MOST_BINS: u32 = 1_000_000;
/// `bins` when left out.
const DEFAULT_BINS: u32 = 1000;
/// `range` when left out.
const DEFAULT_RANGE: f64 = 5.0;

/// Counts contacts, or measures surfaces.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureTable {
    /// What is measured of surfaces: the distribution of their `"heights"`, their power `"spectrum"`
    /// C(q) averaged over all directions, that of profiles along x and y (`"profile-spectrum"`), the
    /// `"autocorrelation"`, slope and curvature by scale (`"scales"`), the `"bearing"` curve, or the
    /// `"roughness"` parameters of ISO 25178.
    #[schemars(extend("default" = "heights"))]
    pub what: Key<What>,
    /// Bins of the histogram of heights, or steps between the planes of the bearing curve; for
    /// surfaces only.
    #[schemars(range(min = 1, max = MOST_BINS), extend("default" = DEFAULT_BINS))]
    pub bins: Key<i64>,
    /// Half width of the histogram of heights, or of the bearing curve, in rms heights; for surfaces
    /// only.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = DEFAULT_RANGE))]
    pub range: Key<f64>,
    /// Whether all surfaces of a parameter point share one histogram, with mean and standard
    /// deviation between them, instead of having one each; for surfaces only.
    #[schemars(extend("default" = false))]
    pub pool: Key<bool>,
}

table!(MeasureTable, swept: [], lists: []);

/// What is measured of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// How their heights are distributed.
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
    let what = section.points.first()?.table.what.written()?.value;
    Some(what.statistic(1, 1.0)?.rows())
}

impl What {
    fn statistic(self, bins: u32, range: f64) -> Option<Statistic> {
        match self {
            What::Heights => None,
            What::Spectrum => Some(Statistic::Spectrum),
            What::ProfileSpectrum => Some(Statistic::ProfileSpectrum),
            What::Autocorrelation => Some(Statistic::Autocorrelation),
            What::Scales => Some(Statistic::Scales),
            What::Bearing => Some(Statistic::Bearing { bins, range }),
            What::Roughness => Some(Statistic::Roughness),
        }
    }
}

/// What is measured, which follows from what the stage reads.
pub fn recipes(section: &Section<MeasureTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let params = params(section, given)?;
    Some(vec![Recipe::Measure(params)])
}

fn params(section: &Section<MeasureTable>, given: &mut Given) -> Option<Params> {
    let point = section.points.first()?;
    let checks = &mut Checks::of(section, point, given.problems);
    let bins = checks.whole_or("bins", &point.table.bins, 1..=MOST_BINS, DEFAULT_BINS);
    let range = checks.number_or("range", &point.table.range, POSITIVE, DEFAULT_RANGE);
    if given.read? == Rows::Surfaces {
        let kept_alone = given.surfaces.kept_alone.as_deref();
        return of_surfaces(&point.table, bins?, range?, kept_alone, checks);
    }
    let why = "for surfaces; this stage reads contacts";
    let what = checks.forbidden("what", &point.table.what, why);
    let bins = checks.forbidden("bins", &point.table.bins, why);
    checks.forbidden("range", &point.table.range, why)?;
    checks.forbidden("pool", &point.table.pool, why)?;
    what.and(bins).map(|()| Params::Contacts)
}

fn of_surfaces(
    table: &MeasureTable,
    bins: u32,
    range: f64,
    kept_alone: Option<&str>,
    checks: &mut Checks,
) -> Option<Params> {
    let what = table.what.written().map(|what| what.value);
    let what = what.unwrap_or(What::Heights);
    let Some(statistic) = what.statistic(bins, range) else {
        let pool = table.pool.written().filter(|pool| pool.value);
        let (Some(written), Some(stage)) = (pool, kept_alone) else {
            return Some(match pool {
                Some(_) => Params::Pool { bins, range },
                None => Params::Heights { bins, range },
            });
        };
        let message = "these surfaces cannot be drawn again to be pooled";
        let label = format!("`{stage}` has their spectrum from another stage");
        let problem = Problem::new(message, written.span.clone(), label);
        checks
            .problems
            .push(problem.help("without `pool` each surface has its own histogram"));
        return None;
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
