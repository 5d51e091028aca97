//! Claims that a study declares, with their verdicts.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{Session, SessionError, UnknownName};
use asperity_claims::Evidence;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::FIGURES;
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::{Recipe, Stage as _};

pub use asperity_claims::{
    Claim, ClaimOutcome, ClaimSpec, Expectation, Judgement, Origin, Setting, Verdict,
};
pub use asperity_pipeline::adaptive_sampling::{Decisions, Undecided};
pub use asperity_statistics::intervals::{Bound, LEVEL};

/// Returns the claims of all files of the program, without results of a study.
pub(crate) fn shipped() -> Vec<Claim> {
    asperity_claims::without_results(&asperity_pipeline::study::claims::shipped())
}

/// All claims with their verdicts for a study.
#[derive(Debug)]
#[non_exhaustive]
pub struct StudyClaims {
    evidence: Evidence,
    pub claims: Vec<Claim>,
    /// Number of missing tasks of the study.
    pub missing: usize,
    /// Folder of the figures of the report.
    pub figures: PathBuf,
    /// Expected core-seconds of one more surface of each spectrum.
    seconds_of_one_surface: f64,
}

impl StudyClaims {
    pub(super) fn read(session: &Session) -> Result<StudyClaims, SessionError> {
        let reading = session.reading()?;
        let plan = &reading.plan;
        let mut tables = Vec::new();
        let mut missing = 0;
        for (stage, rows) in plan.stages.iter().zip(reading.all()?) {
            missing += stage.tasks.len() - rows.tasks.len();
            tables.push(rows.table);
        }
        let evidence = Evidence::from_study(&reading.study, plan, &tables)?;
        Ok(StudyClaims {
            claims: asperity_claims::all(&reading.study.claims, &evidence)?,
            evidence,
            missing,
            figures: session.data().results_of(&plan.study).join(FIGURES),
            seconds_of_one_surface: seconds_of_one_surface(plan),
        })
    }

    /// Returns the claim with this name.
    ///
    /// # Errors
    /// Returns an error if there is no such claim.
    pub fn named(&self, name: &str) -> Result<&Claim, SessionError> {
        let mut claims = self.claims.iter();
        let named = claims.find(|claim| claim.statement.name == name);
        named.ok_or_else(|| {
            let claims = self.claims.iter();
            let names: Vec<&str> = claims.map(|claim| claim.statement.name.as_str()).collect();
            let shipped = asperity_pipeline::study::claims::shipped().into_iter();
            let file = shipped.filter(|claim| claim.name == name).find_map(|claim| claim.file);
            let advice = file.map_or_else(String::new, |file| {
                format!("; add the line `claims = \"{file}\"` to `[study]`")
            });
            UnknownName::new(format!("there is no claim `{name}`{advice}"), name, &names).into()
        })
    }

    /// Returns the parameters of the rows that the claims use, and the omitted rows.
    pub(crate) fn setting(&self) -> &Setting {
        &self.evidence.setting
    }

    /// Returns the JSON output of `asperity claims` for the given claims.
    pub(crate) fn summary(&self, claims: &[Claim]) -> Value {
        let Setting { point, left_out, .. } = self.setting();
        let others = left_out.iter().map(|left| json!({ "rows": left.rows, "with": left.differs }));
        json!({
            "level": LEVEL,
            "missing_tasks": self.missing,
            "rests_on": point,
            "left_out": others.collect::<Vec<_>>(),
            "claims": claims.iter().map(|claim| self.summary_of(claim)).collect::<Vec<_>>(),
        })
    }

    /// Returns the JSON output of `asperity claims` for all claims, for the Python module.
    #[doc(hidden)]
    pub fn json(&self) -> String {
        self.summary(&self.claims).to_string()
    }

    /// Returns the JSON output for one claim. Values that do not exist for its outcome are null or
    /// empty lists.
    fn summary_of(&self, claim: &Claim) -> Value {
        let statement = &claim.statement;
        let (judgement, needs) = match &claim.outcome {
            ClaimOutcome::Judged(judgement) => (Some(judgement), None),
            ClaimOutcome::NotComputed(needs) => (None, Some(needs)),
            ClaimOutcome::Noted => (None, None),
        };
        let is_tested = claim.outcome != ClaimOutcome::Noted;
        let bounds = judgement.map_or(&[][..], |judgement| &judgement.bounds[..]);
        let quantities = bounds.iter().map(|bound| quantity(bound, bounds.len()));
        let more = judgement.and_then(|judgement| self.more_surfaces(claim, judgement));
        json!({
            "name": statement.name,
            "kind": statement.origin.name(),
            "file": statement.file,
            "says": statement.text,
            "where": statement.source,
            "because": statement.reason,
            "data": claim.data,
            "verdict": verdict(claim),
            "quantity": is_tested.then_some(&statement.quantity),
            "expected": is_tested.then(|| statement.expected.to_string()),
            "quantities": quantities.collect::<Vec<_>>(),
            "deciding": judgement.map(|judgement| &bounds[judgement.deciding].label),
            "contradicting": judgement.map(|judgement| judgement.contradicting),
            "undecided": judgement.map(|judgement| judgement.undecided),
            "without_value": judgement.map_or(&[][..], |judgement| &judgement.without_value[..]),
            "needs": needs,
            "more_surfaces": more.map(|(surfaces, _)| surfaces),
            "core_hours": more.map(|(_, seconds)| seconds / 3600.0),
            "figure": statement.figure,
        })
    }

    /// Returns the number of additional surfaces per spectrum that would decide a claim, and their
    /// expected core-seconds. Returns `None` if no number of surfaces would decide it.
    pub fn more_surfaces(&self, claim: &Claim, judgement: &Judgement) -> Option<(usize, f64)> {
        let more = judgement.more_surfaces(claim.statement.expected)?;
        Some((more, more as f64 * self.seconds_of_one_surface))
    }
}

/// Returns the JSON output for one of `all` quantities: `lower` and `upper` are simultaneous bounds
/// for all quantities of the claim, `least` and `most` bound this one alone.
fn quantity(bound: &Bound, all: usize) -> Value {
    let ([lower, upper], [least, most]) = (bound.simultaneous(all), bound.one_sided());
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

/// Returns the verdict on a claim; `not computed` and `noted` mark claims without a verdict.
pub(crate) fn verdict(claim: &Claim) -> &'static str {
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => judgement.verdict.name(),
        ClaimOutcome::NotComputed(_) => "not computed",
        ClaimOutcome::Noted => "noted",
    }
}

/// Returns the expected core-seconds of one more surface of each spectrum: the cost of all
/// `generate`, `solve`, `measure` and `correct` tasks, divided by the number of surfaces per
/// spectrum.
fn seconds_of_one_surface(plan: &Plan) -> f64 {
    let mut points: Vec<ParameterPoint> = Vec::new();
    let mut surfaces = 0;
    for task in &plan.tasks {
        if let Recipe::Generate(params) = &task.recipe {
            surfaces += 1;
            let point = ParameterPoint::from_cells(params.coordinates());
            if points.last() != Some(&point) && !points.contains(&point) {
                points.push(point);
            }
        }
    }
    let is_own = |&task: &usize| plan.tasks[task].recipe.kind().depends_on_one_surface();
    let own: Vec<usize> = (0..plan.tasks.len()).filter(is_own).collect();
    let surfaces_per_point = surfaces as f64 / points.len().max(1) as f64;
    CostModel::default().seconds_of(plan, &own) / surfaces_per_point.max(1.0)
}
