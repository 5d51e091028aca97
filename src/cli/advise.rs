//! `asperity advise`: where a study of limits should go on.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::{Value, json};

use super::Failure;
use super::counted;
use super::forecast::core_hours;
use super::terminal::stdout;
use crate::session::advice::{AdvisedFit, AdvisedStep, StudyAdvice};
use asperity_pipeline::data_folder::DataFolder;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study with a `fit` stage whose `law` is "limits".
    manifest: PathBuf,

    /// Print JSON: `[{"stage", "what", "forms", "limit", "standard_error", "points", "steps": [{"term",
    /// "doubled", "points", "core_hours", "factor"}, …]}, …]`, where `factor` is by what the standard
    /// error is expected to be multiplied.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let advice = super::session(&arguments.manifest, data).advice()?;
    let mut out = stdout();
    if arguments.json {
        let fits: Vec<Value> = advice.fits.iter().map(as_json).collect();
        writeln!(out, "{:#}", json!(fits))?;
    } else {
        write!(out, "{}", text(&advice))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn as_json(fit: &AdvisedFit) -> Value {
    let step = |step: &AdvisedStep| {
        json!({
            "term": step.term,
            "doubled": step.doubled,
            "points": step.points,
            "core_hours": step.seconds / 3600.0,
            "factor": step.factor,
        })
    };
    json!({
        "stage": fit.stage,
        "what": fit.what,
        "forms": fit.forms,
        "limit": fit.limit,
        "standard_error": fit.standard_error,
        "points": fit.points,
        "steps": fit.steps.iter().map(step).collect::<Vec<_>>(),
    })
}

fn text(advice: &StudyAdvice) -> String {
    let fits: Vec<String> = advice.fits.iter().map(of_fit).collect();
    let mut text = fits.join("\n");
    if advice.without > 0 {
        let many = counted(advice.without, "fit");
        text +=
            &format!("{many} of limits without an answer as yet: run the study, or see `status`\n");
    } else if advice.fits.is_empty() {
        text += "the study fits no limits: a `fit` stage with `law = \"limits\"` does\n";
    }
    text
}

fn of_fit(fit: &AdvisedFit) -> String {
    let error = fit
        .standard_error
        .map_or_else(String::new, |error| format!(" ± {} (standard error)", digits(error)));
    let mut text = format!(
        "{}: {}\n  limit {:.4}{error}, {}; {}\n",
        fit.stage,
        fit.what,
        fit.limit,
        counted(fit.points, "point"),
        fit.forms.join(" · "),
    );
    text += &format!(
        "  {:28}  {:>6}  {:>18}  {:>14}  {}\n",
        "one more octave of", "points", "cost", "standard error", "doubling"
    );
    let best = fit.steps.iter().filter_map(AdvisedStep::gain).fold(0.0, f64::max);
    for step in &fit.steps {
        let after = match (fit.standard_error, step.factor) {
            (Some(error), Some(factor)) => digits(error * factor),
            (None, Some(factor)) => format!("× {factor:.2}"),
            (_, None) => "?".to_owned(),
        };
        let mark = match step.gain() {
            Some(gain) if gain >= best => "  ← most for its time",
            _ => "",
        };
        text += &format!(
            "  {:28}  {:>6}  {:>18}  {after:>14}  {}{mark}\n",
            step.term.as_deref().unwrap_or("(as many surfaces again)"),
            step.points,
            core_hours(step.seconds),
            step.doubled.join(", "),
        );
    }
    text
}

/// Two digits that mean something.
fn digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}
