//! `asperity claims`: what the paper says, what a study found, and whether it holds.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::{Value, json};

use super::{Data, Failure, counted};
use crate::claims::evidence::Finished;
use crate::claims::intervals::RESAMPLING;
use crate::claims::{self, Claim, Evidence, Judgement, Outcome, Verdict};
use crate::plan::{Plan, PlannedStage};
use crate::stages::Recipe;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run.
    manifest: PathBuf,

    /// Print JSON: `{"level", "claims": [{"name", "says", "data", "verdict", …}, …]}`.
    #[arg(long)]
    json: bool,
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
                level: level(plan, stage),
                table,
            });
        }
    }
    let claims = claims::all(&Evidence::of(&finished)?);
    let mut out = stdout().lock();
    if arguments.json {
        let claims: Vec<Value> = claims.iter().map(as_json).collect();
        let level = RESAMPLING.level;
        let json = json!({ "level": level, "missing_tasks": missing, "claims": claims });
        writeln!(out, "{json:#}")?;
    } else {
        for claim in &claims {
            write!(out, "{}", text(claim))?;
        }
        writeln!(out, "{}", closing(&claims, missing))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The level of the intervals of a fit: a stage has one for all its points.
fn level(plan: &Plan, stage: &PlannedStage) -> Option<f64> {
    match &plan.tasks[*stage.tasks.first()?].recipe {
        Recipe::Fit(params) => Some(params.level),
        _ => None,
    }
}

fn verdict(claim: &Claim) -> &'static str {
    match &claim.outcome {
        Outcome::Judged(judgement) => judgement.verdict.name(),
        Outcome::NotComputed(_) => "not computed",
    }
}

/// Name and verdict, what the paper says, what was found.
fn text(claim: &Claim) -> String {
    let found = match &claim.outcome {
        Outcome::Judged(judgement) => found(judgement),
        Outcome::NotComputed(needs) => format!("needs {needs}"),
    };
    format!(
        "{:14}{} · {}\n{}{}\n",
        verdict(claim),
        claim.name,
        claim.data,
        wrapped(claim.says),
        wrapped(&found),
    )
}

/// Lines of a width that is read easily, under the claim's name.
fn wrapped(text: &str) -> String {
    const INDENT: usize = 14;
    const WIDTH: usize = 100;
    let mut lines = String::new();
    let mut column = WIDTH;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if column + 1 + length > WIDTH {
            lines += &format!("\n{:INDENT$}{word}", "");
            column = INDENT + length;
        } else {
            lines += &format!(" {word}");
            column += 1 + length;
        }
    }
    lines.trim_start_matches('\n').to_owned() + "\n"
}

fn found(judgement: &Judgement) -> String {
    let deciding = &judgement.deciding;
    let interval = if deciding.lower == deciding.upper {
        "exact".to_owned()
    } else {
        format!("{} … {}", short(deciding.lower), short(deciding.upper))
    };
    let others = match (
        judgement.quantities,
        judgement.contradicting,
        judgement.undecided,
    ) {
        (1, _, _) => String::new(),
        (all, 0, 0) => format!("; all {all} agree"),
        (all, against, undecided) => {
            format!("; of {all}, {against} contradict and {undecided} are undecided")
        }
    };
    format!(
        "expected {}; decided by {} [{interval}] at {}{others}",
        judgement.expected,
        short(deciding.value),
        deciding.label
    )
}

/// Four significant digits.
fn short(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return format!("{value}");
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 8) as usize)
}

fn closing(claims: &[Claim], missing: usize) -> String {
    let count = |word: &str| claims.iter().filter(|claim| verdict(claim) == word).count();
    let words = [Verdict::Holds, Verdict::DoesNotHold, Verdict::CannotSay].map(Verdict::name);
    let parts = words.into_iter().chain(["not computed"]);
    let parts: Vec<String> = parts
        .map(|word| format!("{} {word}", count(word)))
        .collect();
    let missing = match missing {
        0 => String::new(),
        _ => format!(" · {} of the study not run yet", counted(missing, "task")),
    };
    format!(
        "{}: {}{missing}",
        counted(claims.len(), "claim"),
        parts.join(" · ")
    )
}

fn as_json(claim: &Claim) -> Value {
    let mut json = json!({
        "name": claim.name,
        "says": claim.says,
        "data": claim.data,
        "verdict": verdict(claim),
    });
    match &claim.outcome {
        Outcome::Judged(judgement) => {
            let deciding = &judgement.deciding;
            json["expected"] = json!(judgement.expected.to_string());
            json["found"] = json!({
                "at": deciding.label,
                "value": deciding.value,
                "lower": deciding.lower,
                "upper": deciding.upper,
            });
            json["quantities"] = json!(judgement.quantities);
            json["contradicting"] = json!(judgement.contradicting);
            json["undecided"] = json!(judgement.undecided);
        }
        Outcome::NotComputed(needs) => json["needs"] = json!(needs),
    }
    json
}
