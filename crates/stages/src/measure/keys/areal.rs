//! Keys of `what = "roughness"`.

use super::MeasureTable;
use crate::check_context::Surfaces;
use crate::lengths::in_unit_of_surfaces;
use crate::measure::areal::{
    Areal, DECAY, DEFAULT, PEAKS, Parameter, ParameterSet, Settings, VERSION, VOLUMES,
};
use crate::measure::profile::{self, Profile};
use crate::measure::statistics::Statistic;
use asperity_manifest::diagnostics::{Problem, listed};
use asperity_manifest::keys::Key;
use asperity_manifest::keys::checks::Checks;

/// Returns the statistic of `what = "roughness"`, or `None` after reporting problems.
pub fn statistic(
    table: &MeasureTable,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<Statistic> {
    let names = checks.optional("parameters", &table.parameters)?;
    let parameters: ParameterSet = match names {
        Some(names) => names.value.iter().copied().collect(),
        None => DEFAULT.into_iter().collect(),
    };
    let smr_height = match checks.optional("smr_height", &table.smr_height)? {
        Some(height) => Some(in_unit_of_surfaces(height, surfaces, checks)?),
        None => None,
    };
    let settings = Settings {
        smr_height,
        smc_ratio: checks.optional_number("smc_ratio", &table.smc_ratio)?,
        peak_ratio: checks.optional_number("peak_ratio", &table.peak_ratio)?,
        dale_ratio: checks.optional_number("dale_ratio", &table.dale_ratio)?,
        correlation_threshold: checks
            .optional_number("correlation_threshold", &table.correlation_threshold)?,
        pruning: checks.optional_number("pruning", &table.pruning)?,
    };
    for (name, key, users) in [
        ("peak_ratio", &table.peak_ratio, &VOLUMES[..]),
        ("dale_ratio", &table.dale_ratio, &VOLUMES),
        ("correlation_threshold", &table.correlation_threshold, &DECAY),
        ("pruning", &table.pruning, &PEAKS),
    ] {
        check_is_used(name, key, users, parameters, checks)?;
    }
    let [p, q] = settings.volume_ratios();
    if p >= q {
        let (name, key) = match table.peak_ratio.written() {
            Some(_) => ("peak_ratio", &table.peak_ratio),
            None => ("dale_ratio", &table.dale_ratio),
        };
        let message = format!("`peak_ratio` is {p} and `dale_ratio` is {q}");
        let label = "`peak_ratio` must be below `dale_ratio`";
        return checks.refuse(name, message, &key.written()?.span, label);
    }
    let is_default = parameters == DEFAULT.into_iter().collect();
    Some(if is_default && settings == Settings::default() {
        Statistic::Roughness
    } else {
        Statistic::Areal(Areal { parameters, settings, version: VERSION.number() })
    })
}

/// Returns the statistic of `what = "roughness"` of profiles, or `None` after reporting problems.
pub fn of_profile(
    table: &MeasureTable,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<Statistic> {
    let mut length = |name: &str, key: &Key<f64>| match checks.optional(name, key)? {
        Some(length) => Some(Some(in_unit_of_surfaces(length, surfaces, checks)?)),
        None => Some(None),
    };
    let section_length = length("section_length", &table.section_length);
    let smr_height = length("smr_height", &table.smr_height);
    Some(Statistic::Profile(Profile {
        section_length: section_length?,
        smr_height: smr_height?,
        smc_ratio: checks.optional_number("smc_ratio", &table.smc_ratio)?,
        version: profile::VERSION.number(),
    }))
}

/// Refuses a setting if none of the parameters that depend on it is computed.
fn check_is_used(
    name: &str,
    key: &Key<f64>,
    users: &[Parameter],
    parameters: ParameterSet,
    checks: &mut Checks,
) -> Option<()> {
    let Some(written) = key.written().filter(|_| !parameters.has_any(users)) else {
        return Some(());
    };
    let names: Vec<&str> = users.iter().map(|user| user.column().name).collect();
    let users = listed(names.iter().copied(), "and");
    let message = format!("`{name}` has no effect here");
    let label = format!("applies only to {users}");
    let problem = Problem::new(message, written.span.clone(), label);
    checks.reject(problem.help("add one of them to `parameters`, or remove this key"))
}
