//! `asperity claims`: what the paper says, what a study found, and whether it holds.

mod list;
mod one;
mod programs;

use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::{Data, Failure, unknown};
use crate::claims::evidence::Finished;
use crate::claims::{self, Claim, Evidence, Judgement, Outcome};
use crate::ensemble::Point;
use crate::pace::Pace;
use crate::plan::Plan;
use crate::stages::{Kind, Recipe, Stage as _};

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run.
    manifest: PathBuf,

    /// Explain one claim at length: what is said where, what is computed, every quantity.
    name: Option<String>,

    /// Print JSON: `{"level", "rests_on", "left_out": [{"rows", "with"}, …], "missing_tasks",
    /// "claims": [{"name", "kind": "paper" | "misprint" | "ours", "says", "where", "quantity",
    /// "because", "data", "verdict", "expected", "quantities": [{"label", "value", "lower", "upper",
    /// "least", "most", "n"}, …], "needs", "more_surfaces", "core_hours", "figure"}, …]}`. `lower` and
    /// `upper` cover all quantities of a claim together, `least` and `most` hold one by one.
    #[arg(long)]
    json: bool,
}

/// What all claims of a study share.
struct Told<'a> {
    manifest: &'a Path,
    evidence: &'a Evidence,
    /// Tasks of the study that have not run.
    missing: usize,
    /// What one more surface of each spectrum is expected to take of one core.
    seconds: f64,
    /// Where the report puts its figures.
    figures: PathBuf,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let reading = data.reading(&arguments.manifest)?;
    let plan = &reading.plan;
    let mut finished: Vec<Finished> = Vec::new();
    let mut missing = 0;
    for (stage, rows) in plan.stages.iter().zip(reading.all()?) {
        missing += stage.tasks.len() - rows.tasks.len();
        if let Some(table) = rows.table {
            finished.push(Finished {
                kind: stage.kind,
                table,
            });
        }
    }
    let evidence = Evidence::of(&finished)?;
    let told = Told {
        manifest: &arguments.manifest,
        evidence: &evidence,
        missing,
        seconds: seconds_of_one_surface(plan),
        figures: data.results().join(&plan.study).join("figures"),
    };
    let mut claims = claims::all(&evidence);
    if let Some(name) = &arguments.name {
        let names: Vec<&str> = claims.iter().map(|claim| claim.statement.name).collect();
        if !names.contains(&name.as_str()) {
            let message = format!("there is no claim `{name}`");
            return Err(unknown(&message, name, &names));
        }
        claims.retain(|claim| claim.statement.name == name);
    }
    let mut out = stdout().lock();
    match (arguments.json, &arguments.name) {
        (true, _) => writeln!(out, "{:#}", programs::json(&told, &claims))?,
        (false, Some(_)) => {
            for claim in &claims {
                write!(out, "{}", one::text(&told, claim))?;
            }
        }
        (false, None) => write!(out, "{}", list::text(&told, &claims))?,
    }
    Ok(ExitCode::SUCCESS)
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
    let hangs_on_surfaces = |kind: Kind| {
        matches!(
            kind,
            Kind::Generate | Kind::Solve | Kind::Measure | Kind::Correct
        )
    };
    let own = plan.tasks.iter().enumerate();
    let own = own.filter(|(_, task)| hangs_on_surfaces(task.recipe.kind()));
    let own: Vec<usize> = own.map(|(task, _)| task).collect();
    let of_a_point = surfaces as f64 / points.len().max(1) as f64;
    Pace::default().seconds_of(plan, &own) / of_a_point.max(1.0)
}

fn verdict(claim: &Claim) -> &'static str {
    match &claim.outcome {
        Outcome::Judged(judgement) => judgement.verdict.name(),
        Outcome::NotComputed(_) => "not computed",
        Outcome::Noted => "noted",
    }
}

impl Told<'_> {
    /// How many more surfaces of each spectrum would decide a claim, and the time of one core that
    /// they take.
    fn power(&self, claim: &Claim, judgement: &Judgement) -> Option<(usize, f64)> {
        let more = judgement.more_surfaces(claim.statement.expected)?;
        Some((more, more as f64 * self.seconds))
    }
}

/// Lines of a width that is read easily, all of them indented.
fn wrapped(indent: usize, text: &str) -> String {
    const WIDTH: usize = 100;
    let mut lines = String::new();
    let mut column = WIDTH;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if column + 1 + length > WIDTH {
            lines += &format!("\n{:indent$}{word}", "");
            column = indent + length;
        } else {
            lines += &format!(" {word}");
            column += 1 + length;
        }
    }
    lines.trim_start_matches('\n').to_owned() + "\n"
}

/// Four significant digits.
fn short(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return format!("{value}");
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 8) as usize)
}
