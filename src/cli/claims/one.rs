//! One claim at length.

use super::super::counted;
use super::super::forecast::core_hours;
use super::{Told, short, verdict, wrapped};
use asperity_claims::{Claim, ClaimOutcome, Judgement, Origin, Verdict};
use asperity_statistics::intervals::LEVEL;

pub fn text(told: &Told, claim: &Claim) -> String {
    let statement = &claim.statement;
    let whose = match statement.origin {
        Origin::Paper => "the paper",
        Origin::Ours => "ours",
        Origin::Misprint => "a misprint",
    };
    let mut lines = vec![
        (whose, format!("{} ({})", statement.says, statement.place)),
        ("quantity", statement.quantity.to_owned()),
        ("data", claim.data.to_owned()),
        ("expected", statement.expected.to_string()),
        ("because", statement.because.to_owned()),
    ];
    if statement.origin == Origin::Misprint {
        lines.retain(|(name, _)| [whose, "because"].contains(name));
    }
    lines.extend(statement.figure.map(|figure| ("figure", place_of(told, figure))));
    let mut table = String::new();
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => {
            lines.push(("verdict", verdict_of(told, claim, judgement)));
            if !judgement.without_value.is_empty() {
                lines.push(("no value", judgement.without_value.join("; ")));
            }
            table = quantities(claim, judgement);
        }
        ClaimOutcome::NotComputed(needs) => lines.push(("needs", needs.clone())),
        ClaimOutcome::Noted => {}
    }
    let lines = lines.iter().map(|(name, text)| {
        let text = wrapped(12, text);
        format!("{name:<12}{}", text.trim_start())
    });
    format!("{}\n{}{table}\n", statement.name, lines.collect::<String>())
}

/// The figure's file, if it is drawn.
fn place_of(told: &Told, figure: &str) -> String {
    let path = told.study.figures.join(format!("{figure}.svg"));
    match path.exists() {
        true => path.display().to_string(),
        false => {
            format!("{}, which `asperity report {}` draws", path.display(), told.manifest.display())
        }
    }
}

fn verdict_of(told: &Told, claim: &Claim, judgement: &Judgement) -> String {
    let more = match (judgement.verdict, told.study.more_surfaces(claim, judgement)) {
        (Verdict::CannotSay, Some((more, seconds))) => format!(
            "; at the present spread, {} of each spectrum would decide it, {}",
            counted(more, "more surface"),
            core_hours(seconds)
        ),
        (Verdict::CannotSay, None) if judgement.undecided > 0 => {
            "; no number of surfaces would decide it".to_owned()
        }
        _ => String::new(),
    };
    format!("{}{more}", verdict(claim))
}

/// Every quantity, with the interval that holds by itself and the one that holds with all others.
fn quantities(claim: &Claim, judgement: &Judgement) -> String {
    let all = judgement.bounds.len();
    let rows: Vec<[String; 5]> = judgement
        .bounds
        .iter()
        .map(|bound| {
            let range = |[low, high]: [f64; 2]| match bound.is_exact() {
                true => "exact".to_owned(),
                false => format!("{} … {}", short(low), short(high)),
            };
            [
                bound.label.clone(),
                short(bound.value),
                range(bound.single()),
                range(bound.together(all)),
                claim.statement.expected.verdict(bound, all).name().to_owned(),
            ]
        })
        .collect();
    let percent = 100.0 * LEVEL;
    let head = [
        "quantity".to_owned(),
        "value".to_owned(),
        format!("each end at {percent} %"),
        format!("all at {percent} %"),
        "by itself".to_owned(),
    ];
    let all_rows: Vec<&[String; 5]> = [&head].into_iter().chain(&rows).collect();
    let width = |column: usize| {
        let lengths = all_rows.iter().map(|row| row[column].chars().count());
        lengths.max().unwrap_or(0)
    };
    let widths: [usize; 5] = std::array::from_fn(width);
    let line = |row: &&[String; 5]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:<width$}"));
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    format!("\n{}", all_rows.iter().map(line).collect::<String>())
}
