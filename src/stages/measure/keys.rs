//! Keys of the stages that measure, and what they come to.
//!
//! The comments of the keys are what editors show and what messages quote.

use schemars::JsonSchema;
use serde::Deserialize;

use super::super::Given;
use super::super::{Recipe, Rows};
use super::Params;
use crate::written::checks::{Checks, POSITIVE};
use crate::written::{Key, Section, table};

/// The largest `bins`.
const MOST_BINS: u32 = 1_000_000;
/// `bins` when left out.
const DEFAULT_BINS: u32 = 1000;
/// `range` when left out.
const DEFAULT_RANGE: f64 = 5.0;

/// Counts contacts, or the heights of surfaces.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureTable {
    /// Bins of the histogram of heights; for surfaces only.
    #[schemars(range(min = 1, max = MOST_BINS), extend("default" = DEFAULT_BINS))]
    pub bins: Key<i64>,
    /// Half width of the histogram of heights, in rms heights; for surfaces only.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = DEFAULT_RANGE))]
    pub range: Key<f64>,
    /// Whether all surfaces of a parameter point share one histogram, with mean and standard
    /// deviation between them, instead of having one each; for surfaces only.
    #[schemars(extend("default" = false))]
    pub pool: Key<bool>,
}

table!(MeasureTable, swept: [], lists: []);

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
        let (bins, range) = (bins?, range?);
        let pool = point.table.pool.written().is_some_and(|pool| pool.value);
        return Some(match pool {
            true => Params::Pool { bins, range },
            false => Params::Heights { bins, range },
        });
    }
    let why = "for the heights of surfaces; this stage reads contacts";
    let bins = checks.forbidden("bins", &point.table.bins, why);
    checks.forbidden("range", &point.table.range, why)?;
    checks.forbidden("pool", &point.table.pool, why)?;
    bins.map(|()| Params::Contacts)
}
