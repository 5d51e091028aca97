//! Conversion of claims to Python dictionaries.

use asperity::session::StudyClaims;
use asperity::session::claims::{Bound as Quantity, Claim, ClaimOutcome};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Returns a dictionary for each claim, with keys as in `asperity claims --json`.
pub fn claims_list<'py>(py: Python<'py>, study: &StudyClaims) -> PyResult<Bound<'py, PyList>> {
    let claims = study.claims.iter().map(|claim| claim_dict(py, study, claim));
    PyList::new(py, claims.collect::<PyResult<Vec<_>>>()?)
}

fn claim_dict<'py>(
    py: Python<'py>,
    study: &StudyClaims,
    claim: &Claim,
) -> PyResult<Bound<'py, PyDict>> {
    let statement = &claim.statement;
    let dict = PyDict::new(py);
    dict.set_item("name", &statement.name)?;
    dict.set_item("kind", statement.origin.name())?;
    dict.set_item("says", &statement.text)?;
    dict.set_item("where", &statement.source)?;
    dict.set_item("quantity", &statement.quantity)?;
    dict.set_item("because", &statement.reason)?;
    dict.set_item("data", &claim.data)?;
    dict.set_item("expected", statement.expected.to_string())?;
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => {
            let all = judgement.bounds.len();
            let bounds = judgement.bounds.iter().map(|bound| quantity_dict(py, bound, all));
            dict.set_item("verdict", judgement.verdict.name())?;
            dict.set_item("quantities", bounds.collect::<PyResult<Vec<_>>>()?)?;
            let more = study.more_surfaces(claim, judgement);
            dict.set_item("more_surfaces", more.map(|(surfaces, _)| surfaces))?;
        }
        ClaimOutcome::NotComputed(needs) => {
            dict.set_item("verdict", "not computed")?;
            dict.set_item("needs", needs)?;
        }
        ClaimOutcome::Noted => dict.set_item("verdict", "noted")?,
    }
    Ok(dict)
}

fn quantity_dict<'py>(
    py: Python<'py>,
    bound: &Quantity,
    all: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let [lower, upper] = bound.simultaneous(all);
    let dict = PyDict::new(py);
    dict.set_item("label", &bound.label)?;
    dict.set_item("value", bound.value)?;
    dict.set_item("lower", lower)?;
    dict.set_item("upper", upper)?;
    dict.set_item("n", bound.surfaces)?;
    Ok(dict)
}
