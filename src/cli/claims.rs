//! `asperity claims`: what the paper says, what a study found, and whether it holds.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::{Value, json};

use super::{Data, Failure, counted};
use crate::claims::evidence::Finished;
use crate::claims::intervals::RESAMPLING;
use crate::claims::{self, Claim, Evidence, Judgement, Outcome, Setting, Verdict};
use crate::ensemble::Point;
use crate::growth::Grown;
use crate::plan::{Plan, PlannedStage};
use crate::results;
use crate::stages::Recipe;
use crate::store::column::Value as Cell;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run.
    manifest: PathBuf,

    /// Print JSON: `{"level", "rests_on", "left_out": [{"rows", "with"}, …], "claims": [{"name",
    /// "says", "data", "verdict", …}, …]}`.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let Grown { study, plan, .. } = data.grown(&arguments.manifest)?;
    // The tables are brought up to the manifest first: a claim rests on what it says now.
    let published = results::publish(&plan, &data.look()?, &study.sources, &data.results())?;
    let mut finished: Vec<Finished> = Vec::new();
    for (stage, table) in plan.stages.iter().zip(&published) {
        if table.finished > 0 {
            finished.push(Finished {
                kind: stage.kind,
                level: level(&plan, stage),
                table: table.read()?,
            });
        }
    }
    let evidence = Evidence::of(&finished)?;
    let claims = claims::all(&evidence);
    let missing = published
        .iter()
        .zip(&plan.stages)
        .map(|(table, stage)| stage.tasks.len() - table.finished)
        .sum();
    let mut out = stdout().lock();
    if arguments.json {
        let claims: Vec<Value> = claims.iter().map(as_json).collect();
        let level = RESAMPLING.level;
        let left_out = evidence.setting.left_out.iter();
        let left_out =
            left_out.map(|left| json!({ "rows": left.rows, "with": place(&left.differs) }));
        let json = json!({
            "level": level,
            "missing_tasks": missing,
            "rests_on": place(&evidence.setting.point),
            "left_out": left_out.collect::<Vec<_>>(),
            "claims": claims,
        });
        writeln!(out, "{json:#}")?;
    } else {
        for claim in &claims {
            write!(out, "{}", text(claim))?;
        }
        writeln!(out, "{}", closing(&claims, missing))?;
        write!(out, "{}", left_out(&evidence.setting))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Parameters for programs.
fn place(point: &Point) -> Value {
    let value = |value: &Cell| match value {
        Cell::Real(number) => json!(number),
        Cell::Integer(number) => json!(number),
        Cell::Text(text) => json!(text),
    };
    let entries = point.iter().map(|(name, of)| (name.to_owned(), value(of)));
    Value::Object(entries.collect())
}

/// What claims do not look at, and what they look at instead.
fn left_out(setting: &Setting) -> String {
    let lines = setting.left_out.iter().map(|left| {
        let instead = setting.point.clone().beyond(&left.differs);
        let names: Vec<&str> = left.differs.iter().map(|(name, _)| name).collect();
        format!(
            "left out: {left}; the claims rest on {}\n",
            instead.only(&names)
        )
    });
    lines.collect()
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
