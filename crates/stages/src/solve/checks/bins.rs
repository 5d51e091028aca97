//! Checks of the bins in which pressures and gaps are counted.

use super::super::keys::{Bins, MOST_BINS};
use asperity_contact::distribution::EqualBins;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::{Key, Written};

/// Bins of all loads of a block together: as many numbers as a map of 4096² nodes has.
const MOST_BINS_OF_A_BLOCK: usize = 1 << 24;

/// The bins of a key, if they are asked for.
pub fn checked(
    name: &str,
    key: &Key<Bins>,
    loads: Option<&[f64]>,
    checks: &mut Checks,
) -> Option<Option<EqualBins>> {
    let Some(written) = key.written() else {
        return (!checks.is_excused(name)).then_some(None);
    };
    let Bins { count, to } = &written.value;
    let count = part(name, "count", count.written(), written, checks)
        .and_then(|count| checks.is_whole_in("count", count, &(1..=MOST_BINS)));
    let to = part(name, "to", to.written(), written, checks)
        .and_then(|to| checks.is_in("to", to, QUANTITY));
    let bins = EqualBins { count: count?, to: to? };
    let loads = loads.map_or(0, <[f64]>::len);
    if loads.saturating_mul(bins.count as usize) > MOST_BINS_OF_A_BLOCK {
        let message = format!("`{name}` asks for {} bins under each of {loads} loads", bins.count);
        let label = format!("at most {MOST_BINS_OF_A_BLOCK} bins fit in a block");
        checks.report(name, Problem::new(message, written.span.clone(), label));
        return None;
    }
    Some(Some(bins))
}

fn part<'k, T>(
    name: &str,
    part: &str,
    value: Option<&'k Written<T>>,
    written: &Written<Bins>,
    checks: &mut Checks,
) -> Option<&'k Written<T>> {
    if value.is_none() {
        let problem = Problem::new(
            format!("`{name}` lacks `{part}`"),
            written.span.clone(),
            "`{ count, to }` says how many bins there are and where the last one ends",
        );
        checks.report(name, problem);
    }
    value
}
