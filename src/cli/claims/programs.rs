//! Claims for programs.

use serde_json::{Value, json};

use super::{Told, verdict};
use asperity_claims::{Claim, ClaimOutcome};
use asperity_stages::ensemble::Point;
use asperity_statistics::intervals::{Bound, LEVEL};
use asperity_tables::column::Value as Cell;

pub fn json(told: &Told, claims: &[Claim]) -> Value {
    let setting = &told.study.evidence.setting;
    let left_out = setting.left_out.iter();
    let left_out = left_out.map(|left| json!({ "rows": left.rows, "with": place(&left.differs) }));
    json!({
        "level": LEVEL,
        "missing_tasks": told.study.missing,
        "rests_on": place(&setting.point),
        "left_out": left_out.collect::<Vec<_>>(),
        "claims": claims.iter().map(|claim| one(told, claim)).collect::<Vec<_>>(),
    })
}

/// Parameters by name.
fn place(point: &Point) -> Value {
    let value = |value: &Cell| match value {
        Cell::Real(number) => json!(number),
        Cell::Integer(number) => json!(number),
        Cell::Text(text) => json!(text),
    };
    let entries = point.iter().map(|(name, of)| (name.to_owned(), value(of)));
    Value::Object(entries.collect())
}

fn one(told: &Told, claim: &Claim) -> Value {
    let statement = &claim.statement;
    let mut json = json!({
        "name": statement.name,
        "kind": statement.origin.name(),
        "says": statement.says,
        "where": statement.place,
        "because": statement.because,
        "data": claim.data,
        "verdict": verdict(claim),
        "quantity": null,
        "expected": null,
        "quantities": [],
        "deciding": null,
        "contradicting": null,
        "undecided": null,
        "without_value": [],
        "needs": null,
        "more_surfaces": null,
        "core_hours": null,
        "figure": statement.figure,
    });
    if !matches!(claim.outcome, ClaimOutcome::Noted) {
        json["expected"] = json!(statement.expected.to_string());
        json["quantity"] = json!(statement.quantity);
    }
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => {
            let all = judgement.bounds.len();
            let quantities = judgement.bounds.iter().map(|bound| quantity(bound, all));
            json["quantities"] = quantities.collect();
            json["deciding"] = json!(judgement.bounds[judgement.deciding].label);
            json["contradicting"] = json!(judgement.contradicting);
            json["undecided"] = json!(judgement.undecided);
            json["without_value"] = json!(judgement.without_value);
            if let Some((more, seconds)) = told.study.more_surfaces(claim, judgement) {
                json["more_surfaces"] = json!(more);
                json["core_hours"] = json!(seconds / 3600.0);
            }
        }
        ClaimOutcome::NotComputed(needs) => json["needs"] = json!(needs),
        ClaimOutcome::Noted => {}
    }
    json
}

fn quantity(bound: &Bound, all: usize) -> Value {
    let ([lower, upper], [least, most]) = (bound.together(all), bound.single());
    json!({
        "label": bound.label,
        "value": bound.value,
        "lower": lower,
        "upper": upper,
        "least": least,
        "most": most,
        "n": bound.surfaces,
    })
}
