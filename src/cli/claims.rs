//! `asperity claims`: what the paper says, what a study found, and whether it holds.

mod list;
mod one;
mod programs;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::slice;

use super::Failure;
use super::terminal::stdout;
use crate::session::StudyClaims;
use asperity_claims::{Claim, ClaimOutcome};
use asperity_pipeline::data_folder::DataFolder;

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
    study: &'a StudyClaims,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let study = super::session(&arguments.manifest, data).claims()?;
    let told = Told { manifest: &arguments.manifest, study: &study };
    let claims = match &arguments.name {
        Some(name) => slice::from_ref(study.named(name)?),
        None => &study.claims,
    };
    let mut out = stdout();
    match (arguments.json, &arguments.name) {
        (true, _) => writeln!(out, "{:#}", programs::json(&told, claims))?,
        (false, Some(_)) => {
            for claim in claims {
                write!(out, "{}", one::text(&told, claim))?;
            }
        }
        (false, None) => write!(out, "{}", list::text(&told, claims))?,
    }
    Ok(ExitCode::SUCCESS)
}

fn verdict(claim: &Claim) -> &'static str {
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => judgement.verdict.name(),
        ClaimOutcome::NotComputed(_) => "not computed",
        ClaimOutcome::Noted => "noted",
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
