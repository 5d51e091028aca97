//! What the paper says, put to the tables of a study.

use std::path::PathBuf;

use super::Session;
use super::error::{SessionError, UnknownName};
use asperity_claims::Evidence;
use asperity_claims::study_evidence;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::FIGURES;
use asperity_stages::ensemble::Point;
use asperity_stages::{Kind, Recipe, Stage as _};

pub use asperity_claims::{
    Claim, ClaimOutcome, Expectation, Judgement, Origin, Statement, Verdict,
};
pub use asperity_pipeline::adaptive_sampling::{Decisions, Undecided};
pub use asperity_statistics::intervals::Bound;

/// All claims, judged by what a study has found.
#[derive(Debug)]
pub struct StudyClaims {
    /// What they rest on.
    pub(crate) evidence: Evidence,
    /// The claims.
    pub claims: Vec<Claim>,
    /// How many tasks of the study have not run.
    pub missing: usize,
    /// Where the report puts its figures.
    pub figures: PathBuf,
    /// Seconds of one core that one more surface of each spectrum is expected to take.
    seconds_of_one_surface: f64,
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
        let evidence = study_evidence::of(&reading.study, plan, &tables)?;
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

    /// How many more surfaces of each spectrum would decide a claim, and the seconds of one core
    /// that they take; `None` if no number would.
    pub fn more_surfaces(&self, claim: &Claim, judgement: &Judgement) -> Option<(usize, f64)> {
        let more = judgement.more_surfaces(claim.statement.expected)?;
        Some((more, more as f64 * self.seconds_of_one_surface))
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
