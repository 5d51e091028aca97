//! The key `friction`.

use crate::check_context::Surfaces;
use crate::measure::Params as MeasureParams;
use crate::measure::friction::{DISSIPATION_VERSION, FrictionTable, Params, complete, find};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span, listed};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Spanned, quantity};

/// Returns the task of a stage with the key `friction`, or `None` after reporting problems.
pub fn params(
    friction: &Spanned<FrictionTable>,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<MeasureParams> {
    if let Some((stage, physics)) = &surfaces.not_superposable {
        let message = format!("stage `{stage}` has {physics}");
        let label = "needs loads on elastic half-spaces without adhesion";
        return checks.refuse("friction", message, &friction.span, label);
    }
    let FrictionTable { coefficient, loads, poisson_ratio } = &friction.value;
    let mut before = 0.0;
    for load in &loads.value {
        if decimal::is_same(load.value, before) {
            let message = format!("`friction` has the tangential load {} twice", load.value);
            let label = "differs from the load before it by no more than rounding";
            return checks.refuse("friction", message, &load.span, label);
        }
        before = load.value;
    }
    let poisson_ratio = checks.optional_number("poisson_ratio", poisson_ratio)?;
    let params = Params {
        coefficient: decimal::nearest(*coefficient),
        poisson_ratio,
        dissipation_version: poisson_ratio.map(|_| DISSIPATION_VERSION.number()),
        loads: loads.value.iter().map(|load| decimal::nearest(load.value)).collect(),
    };
    check_loads(&params, &loads.span, surfaces, checks)?;
    Some(MeasureParams::Friction(params))
}

/// Refuses a path for which no load has all its shares among the loads of its stage.
fn check_loads(
    params: &Params,
    span: &Span,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<()> {
    let shares = params.shares();
    for (stage, loads, unit) in &surfaces.loads {
        if complete(loads, &shares).next().is_some() {
            continue;
        }
        let Some(largest) = loads.iter().copied().reduce(f64::max) else { continue };
        let missing: Vec<String> = shares
            .iter()
            .map(|share| decimal::nearest(share * largest))
            .filter(|load| find(loads, *load).is_none())
            .map(|load| quantity::written(load, *unit))
            .collect();
        let message = format!("stage `{stage}` lacks loads that partial slip needs");
        let label = "needs the contacts under smaller loads, too";
        let problem = Problem::new(message, span.clone(), label);
        let missing = listed(missing.iter().map(String::as_str), "and");
        return checks.reject(problem.help(format!(
            "add {missing} to `loads` of stage `{stage}` for these tangential loads under {}",
            quantity::written(largest, *unit)
        )));
    }
    Some(())
}
