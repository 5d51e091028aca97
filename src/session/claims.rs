//! Claims that a study declares, with their verdicts.

use std::path::PathBuf;

use serde::Serialize;

use super::{Session, SessionError, UnknownName};
use asperity_claims::Evidence;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::FIGURES;
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::{Kind, Recipe, Stage as _};

pub use asperity_claims::{
    Claim, ClaimOutcome, ClaimSpec, Expectation, Judgement, Origin, Setting, Verdict,
};
pub use asperity_pipeline::adaptive_sampling::{Decisions, Undecided};
pub use asperity_statistics::intervals::{Bound, LEVEL};

/// Returns the claims of all files of the program, without results of a study.
pub fn shipped() -> Vec<Claim> {
    asperity_claims::without_results(&asperity_pipeline::study::claims::shipped())
}

/// All claims with their verdicts for a study.
#[derive(Debug)]
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

/// JSON output of `asperity claims`.
#[derive(Debug, Serialize)]
pub struct ClaimsSummary<'a> {
    /// Confidence level of the intervals.
    pub level: f64,
    /// Number of missing tasks of the study.
    pub missing_tasks: usize,
    /// Parameters of the rows that the claims use.
    pub rests_on: &'a ParameterPoint,
    /// Rows with other parameters, which the claims omit.
    pub left_out: Vec<OtherRows<'a>>,
    pub claims: Vec<ClaimSummary<'a>>,
}

/// Rows that the claims omit.
#[derive(Debug, Serialize)]
pub struct OtherRows<'a> {
    pub rows: usize,
    /// Parameters in which these rows differ from the rows that the claims use, with their values.
    pub with: &'a ParameterPoint,
}

/// JSON output for one claim. Values that do not exist for its outcome are null or empty lists.
#[derive(Debug, Default, Serialize)]
pub struct ClaimSummary<'a> {
    pub name: &'a str,
    pub kind: &'a str,
    /// File of claims that has the claim, or null for a claim of the manifest.
    pub file: Option<&'a str>,
    pub says: &'a str,
    #[serde(rename = "where")]
    pub source: &'a str,
    pub because: &'a str,
    pub data: &'a str,
    pub verdict: &'a str,
    pub quantity: Option<&'a str>,
    pub expected: Option<String>,
    pub quantities: Vec<QuantitySummary<'a>>,
    /// Label of the quantity that decides the verdict.
    pub deciding: Option<&'a str>,
    /// Number of quantities that contradict the claim.
    pub contradicting: Option<usize>,
    /// Number of quantities that neither support nor contradict the claim.
    pub undecided: Option<usize>,
    pub without_value: &'a [String],
    /// Data that the study does not contain yet.
    pub needs: Option<&'a str>,
    /// Number of additional surfaces per spectrum that would decide the claim.
    pub more_surfaces: Option<usize>,
    /// Expected cost of these surfaces.
    pub core_hours: Option<f64>,
    pub figure: Option<&'a str>,
}

/// Quantity of a claim with its intervals.
#[derive(Debug, Serialize)]
pub struct QuantitySummary<'a> {
    pub label: &'a str,
    pub value: f64,
    /// Lower end of the interval of this quantity, simultaneous with those of the other quantities
    /// of the claim.
    pub lower: f64,
    /// Upper end of the interval of this quantity, simultaneous with those of the other quantities
    /// of the claim.
    pub upper: f64,
    /// Lower end of the interval for this quantity alone.
    pub least: f64,
    /// Upper end of the interval for this quantity alone.
    pub most: f64,
    /// Number of surfaces that the quantity is computed from.
    pub n: Option<usize>,
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
    pub fn setting(&self) -> &Setting {
        &self.evidence.setting
    }

    /// Summarizes the given claims for JSON output.
    pub fn summary<'a>(&'a self, claims: &'a [Claim]) -> ClaimsSummary<'a> {
        let Setting { point, left_out, .. } = self.setting();
        let others = left_out.iter().map(|left| OtherRows { rows: left.rows, with: &left.differs });
        ClaimsSummary {
            level: LEVEL,
            missing_tasks: self.missing,
            rests_on: point,
            left_out: others.collect(),
            claims: claims.iter().map(|claim| self.summary_of(claim)).collect(),
        }
    }

    fn summary_of<'a>(&self, claim: &'a Claim) -> ClaimSummary<'a> {
        let statement = &claim.statement;
        let mut summary = ClaimSummary {
            name: &statement.name,
            kind: statement.origin.name(),
            file: statement.file.as_deref(),
            says: &statement.text,
            source: &statement.source,
            because: &statement.reason,
            data: &claim.data,
            verdict: verdict(claim),
            figure: statement.figure.as_deref(),
            ..ClaimSummary::default()
        };
        if claim.outcome != ClaimOutcome::Noted {
            summary.expected = Some(statement.expected.to_string());
            summary.quantity = Some(&statement.quantity);
        }
        match &claim.outcome {
            ClaimOutcome::Judged(judgement) => {
                let all = judgement.bounds.len();
                let bounds = judgement.bounds.iter();
                summary.quantities = bounds.map(|bound| QuantitySummary::new(bound, all)).collect();
                summary.deciding = Some(&judgement.bounds[judgement.deciding].label);
                summary.contradicting = Some(judgement.contradicting);
                summary.undecided = Some(judgement.undecided);
                summary.without_value = &judgement.without_value;
                let more = self.more_surfaces(claim, judgement);
                (summary.more_surfaces, summary.core_hours) =
                    more.map(|(more, seconds)| (more, seconds / 3600.0)).unzip();
            }
            ClaimOutcome::NotComputed(needs) => summary.needs = Some(needs),
            ClaimOutcome::Noted => {}
        }
        summary
    }

    /// Returns the number of additional surfaces per spectrum that would decide a claim, and their
    /// expected core-seconds. Returns `None` if no number of surfaces would decide it.
    pub fn more_surfaces(&self, claim: &Claim, judgement: &Judgement) -> Option<(usize, f64)> {
        let more = judgement.more_surfaces(claim.statement.expected)?;
        Some((more, more as f64 * self.seconds_of_one_surface))
    }
}

impl QuantitySummary<'_> {
    fn new(bound: &Bound, all: usize) -> QuantitySummary<'_> {
        let ([lower, upper], [least, most]) = (bound.simultaneous(all), bound.one_sided());
        let (label, value, n) = (&bound.label, bound.value, bound.surfaces);
        QuantitySummary { label, value, lower, upper, least, most, n }
    }
}

/// Returns the verdict on a claim; `not computed` and `noted` mark claims without a verdict.
pub fn verdict(claim: &Claim) -> &'static str {
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
    let depends_on_one_surface =
        |kind: Kind| matches!(kind, Kind::Generate | Kind::Solve | Kind::Measure | Kind::Correct);
    let is_own = |&task: &usize| depends_on_one_surface(plan.tasks[task].recipe.kind());
    let own: Vec<usize> = (0..plan.tasks.len()).filter(is_own).collect();
    let surfaces_per_point = surfaces as f64 / points.len().max(1) as f64;
    CostModel::default().seconds_of(plan, &own) / surfaces_per_point.max(1.0)
}
