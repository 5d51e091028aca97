//! What the paper says, put to the tables of a study.

use std::path::PathBuf;

use serde::Serialize;

use super::{Session, SessionError, UnknownName};
use asperity_claims::Evidence;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::FIGURES;
use asperity_stages::ensemble::Point;
use asperity_stages::{Kind, Recipe, Stage as _};

pub use asperity_claims::{
    Claim, ClaimOutcome, Expectation, Judgement, Origin, Setting, Statement, Verdict,
};
pub use asperity_pipeline::adaptive_sampling::{Decisions, Undecided};
pub use asperity_statistics::intervals::{Bound, LEVEL};

/// All claims, judged by what a study has found.
#[derive(Debug)]
pub struct StudyClaims {
    /// What they rest on.
    evidence: Evidence,
    pub claims: Vec<Claim>,
    /// How many tasks of the study have not run.
    pub missing: usize,
    /// Where the report puts its figures.
    pub figures: PathBuf,
    /// Seconds of one core that one more surface of each spectrum is expected to take.
    seconds_of_one_surface: f64,
}

/// What programs read of claims.
#[derive(Debug, Serialize)]
pub struct ClaimsSummary<'a> {
    /// The level of confidence of intervals.
    pub level: f64,
    /// Tasks of the study that have not run.
    pub missing_tasks: usize,
    /// The parameters that all claims rest on.
    pub rests_on: &'a Point,
    /// Rows of other parameters, which no claim looks at.
    pub left_out: Vec<OtherRows<'a>>,
    pub claims: Vec<ClaimSummary<'a>>,
}

/// Rows that no claim looks at.
#[derive(Debug, Serialize)]
pub struct OtherRows<'a> {
    pub rows: usize,
    /// Their parameters that differ from those of the claims.
    pub with: &'a Point,
}

/// What programs read of one claim. What its outcome has not is null, or an empty list.
#[derive(Debug, Default, Serialize)]
pub struct ClaimSummary<'a> {
    pub name: &'a str,
    pub kind: &'a str,
    pub says: &'a str,
    #[serde(rename = "where")]
    pub place: &'a str,
    pub because: &'a str,
    pub data: &'a str,
    pub verdict: &'a str,
    pub quantity: Option<&'a str>,
    pub expected: Option<String>,
    pub quantities: Vec<QuantitySummary<'a>>,
    /// The label of the quantity that decides.
    pub deciding: Option<&'a str>,
    /// How many quantities contradict the claim.
    pub contradicting: Option<usize>,
    /// How many say neither.
    pub undecided: Option<usize>,
    pub without_value: &'a [String],
    /// What the study lacks.
    pub needs: Option<&'a str>,
    /// Surfaces of each spectrum that would decide it, and what they take.
    pub more_surfaces: Option<usize>,
    pub core_hours: Option<f64>,
    pub figure: Option<&'a str>,
}

/// A quantity of a claim and its intervals.
#[derive(Debug, Serialize)]
pub struct QuantitySummary<'a> {
    pub label: &'a str,
    pub value: f64,
    /// The interval that holds together with those of all others.
    pub lower: f64,
    pub upper: f64,
    /// The interval that holds by itself.
    pub least: f64,
    pub most: f64,
    /// How many surfaces it is of.
    pub n: Option<usize>,
}

impl StudyClaims {
    pub(super) fn of(session: &Session) -> Result<StudyClaims, SessionError> {
        let reading = session.reading()?;
        let plan = &reading.plan;
        let mut tables = Vec::new();
        let mut missing = 0;
        for (stage, rows) in plan.stages.iter().zip(reading.all()?) {
            missing += stage.tasks.len() - rows.tasks.len();
            tables.push(rows.table);
        }
        let evidence = Evidence::of_study(&reading.study, plan, &tables)?;
        Ok(StudyClaims {
            claims: asperity_claims::all(&evidence),
            evidence,
            missing,
            figures: session.data().results_of(&plan.study).join(FIGURES),
            seconds_of_one_surface: seconds_of_one_surface(plan),
        })
    }

    /// The claim of this name.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(&self, name: &str) -> Result<&Claim, SessionError> {
        let mut claims = self.claims.iter();
        let named = claims.find(|claim| claim.statement.name == name);
        named.ok_or_else(|| {
            let claims = self.claims.iter();
            let names: Vec<&str> = claims.map(|claim| claim.statement.name).collect();
            UnknownName::new(format!("there is no claim `{name}`"), name, &names).into()
        })
    }

    /// The parameters that claims rest on, and what they do not look at.
    pub fn setting(&self) -> &Setting {
        &self.evidence.setting
    }

    /// What programs read of some of the claims.
    pub fn summary<'a>(&'a self, claims: &'a [Claim]) -> ClaimsSummary<'a> {
        let Setting { point, left_out, .. } = self.setting();
        let left_out = left_out.iter();
        ClaimsSummary {
            level: LEVEL,
            missing_tasks: self.missing,
            rests_on: point,
            left_out: left_out
                .map(|left| OtherRows { rows: left.rows, with: &left.differs })
                .collect(),
            claims: claims.iter().map(|claim| self.summary_of(claim)).collect(),
        }
    }

    fn summary_of<'a>(&self, claim: &'a Claim) -> ClaimSummary<'a> {
        let statement = &claim.statement;
        let mut summary = ClaimSummary {
            name: statement.name,
            kind: statement.origin.name(),
            says: statement.says,
            place: statement.place,
            because: statement.because,
            data: claim.data,
            verdict: verdict(claim),
            figure: statement.figure,
            ..ClaimSummary::default()
        };
        if claim.outcome != ClaimOutcome::Noted {
            summary.expected = Some(statement.expected.to_string());
            summary.quantity = Some(statement.quantity);
        }
        match &claim.outcome {
            ClaimOutcome::Judged(judgement) => {
                let all = judgement.bounds.len();
                let bounds = judgement.bounds.iter();
                summary.quantities = bounds.map(|bound| QuantitySummary::of(bound, all)).collect();
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

    /// How many more surfaces of each spectrum would decide a claim, and the seconds of one core
    /// that they take; `None` if no number would.
    pub fn more_surfaces(&self, claim: &Claim, judgement: &Judgement) -> Option<(usize, f64)> {
        let more = judgement.more_surfaces(claim.statement.expected)?;
        Some((more, more as f64 * self.seconds_of_one_surface))
    }
}

impl QuantitySummary<'_> {
    fn of(bound: &Bound, all: usize) -> QuantitySummary<'_> {
        let ([lower, upper], [least, most]) = (bound.together(all), bound.single());
        let (label, value, n) = (&bound.label, bound.value, bound.surfaces);
        QuantitySummary { label, value, lower, upper, least, most, n }
    }
}

/// The verdict on a claim in a word or two, or why there is none.
pub fn verdict(claim: &Claim) -> &'static str {
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => judgement.verdict.name(),
        ClaimOutcome::NotComputed(_) => "not computed",
        ClaimOutcome::Noted => "noted",
    }
}

/// What one more surface of each spectrum costs: what hangs on surfaces, over how many of them an
/// ensemble has.
fn seconds_of_one_surface(plan: &Plan) -> f64 {
    let mut points: Vec<Point> = Vec::new();
    let mut surfaces = 0;
    for task in &plan.tasks {
        if let Recipe::Generate(params) = &task.recipe {
            surfaces += 1;
            let point = Point::of(params.coordinates());
            if points.last() != Some(&point) && !points.contains(&point) {
                points.push(point);
            }
        }
    }
    let hangs_on_surfaces =
        |kind: Kind| matches!(kind, Kind::Generate | Kind::Solve | Kind::Measure | Kind::Correct);
    let own = plan.tasks.iter().enumerate();
    let own = own.filter(|(_, task)| hangs_on_surfaces(task.recipe.kind()));
    let own: Vec<usize> = own.map(|(task, _)| task).collect();
    let of_a_point = surfaces as f64 / points.len().max(1) as f64;
    CostModel::default().seconds_of(plan, &own) / of_a_point.max(1.0)
}
