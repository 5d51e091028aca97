//! Keys that the tables of all laws have.

use std::sync::Arc;

use crate::fit::Params;
use crate::fit::laws::Law;
use crate::{CheckContext, Recipe};
use asperity_manifest::decimal;
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::{Key, KeyTable, Section};

/// Maximum value of the key `bootstrap`.
pub const MAX_RESAMPLINGS: u32 = 1_000_000;
/// Default value of the key `bootstrap`.
pub const DEFAULT_RESAMPLINGS: u32 = 1000;
/// Default value of the key `level`.
pub const DEFAULT_LEVEL: f64 = 0.95;

/// A table with the keys that all laws have.
pub trait FitTable: KeyTable {
    /// Returns the keys that all laws have.
    fn common(&self) -> CommonKeys<'_>;
}

/// The keys that all laws have.
pub struct CommonKeys<'a> {
    pub window: &'a Key<[f64; 2]>,
    pub bootstrap: &'a Key<u32>,
    pub level: &'a Key<f64>,
    pub seed: &'a Key<u64>,
}

/// Returns the recipes of the fits, one for each point of the grid, or `None` after reporting
/// problems. `law` reads the law with its settings at a point. `default_window` is the default of
/// the key `window` for tables that declare no default.
pub fn fits<T: FitTable>(
    section: &Section<T>,
    default_window: Option<[f64; 2]>,
    context: &mut CheckContext,
    law: impl Fn(&T, &mut Checks) -> Option<Law>,
) -> Option<Vec<Recipe>> {
    let mut checked = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let checks = &mut Checks::new(section, point, context.problems);
        let law = law(&point.table, checks);
        checked.push(fit(law, &point.table.common(), default_window, context.seed, checks));
    }
    let fits: Vec<Params> = checked.into_iter().collect::<Option<_>>()?;
    report_equal_points(section, &fits, context.problems);
    Some(fits.into_iter().map(|fit| Recipe::Fit(Arc::new(fit))).collect())
}

/// Returns the fit at one point, or `None` if the law or one of its keys is invalid.
fn fit(
    law: Option<Law>,
    keys: &CommonKeys,
    default_window: Option<[f64; 2]>,
    study_seed: u64,
    checks: &mut Checks,
) -> Option<Params> {
    let window = self::window(keys.window, default_window, checks);
    let bootstrap = checks.value("bootstrap", keys.bootstrap);
    let level = checks.number("level", keys.level);
    let seed = checks.value_or("seed", keys.seed, study_seed);
    Some(Params { law: law?, window: window?, bootstrap: bootstrap?, level: level?, seed: seed? })
}

fn window(key: &Key<[f64; 2]>, default: Option<[f64; 2]>, checks: &mut Checks) -> Option<[f64; 2]> {
    let Some(written) = checks.optional("window", key)? else {
        return Some(default.unwrap_or_else(|| checks.default_of("window")));
    };
    let [low, high] = written.value.map(decimal::nearest);
    if low >= high {
        let message = format!("`window` is empty: {low:?} is not below {high:?}");
        let label = "must be `[smallest, largest]`";
        return checks.refuse("window", message, &written.span, label);
    }
    Some([low, high])
}
