//! All claims, a few lines each.

use super::super::counted;
use super::super::forecast::core_hours;
use super::{Told, short, verdict, wrapped};
use asperity_claims::{Claim, ClaimOutcome, Judgement, Origin, Setting, Verdict};

/// Letters before what is said of a claim.
const INDENT: usize = 14;

pub fn text(told: &Told, claims: &[Claim]) -> String {
    let headings = [
        (Origin::Paper, "What the paper says"),
        (Origin::Ours, "What is ours"),
        (Origin::Misprint, "Misprints: notes without a verdict"),
    ];
    let mut text = String::new();
    for (origin, heading) in headings {
        text += &format!("{heading}\n\n");
        let own = claims.iter().filter(|claim| claim.statement.origin == origin);
        text.extend(own.map(|claim| few_lines(told, claim)));
        text += "\n";
    }
    text + &closing(claims, told) + &left_out(&told.study.evidence.setting)
}

fn few_lines(told: &Told, claim: &Claim) -> String {
    let statement = &claim.statement;
    let said = format!("{} ({})", statement.says, statement.place);
    let found = match &claim.outcome {
        ClaimOutcome::Judged(judgement) => found(told, claim, judgement),
        ClaimOutcome::NotComputed(needs) => format!("needs {needs}"),
        ClaimOutcome::Noted => statement.because.to_owned(),
    };
    format!(
        "{:INDENT$}{} · {}\n{}{}",
        verdict(claim),
        statement.name,
        claim.data,
        wrapped(INDENT, &said),
        wrapped(INDENT, &found),
    )
}

fn found(told: &Told, claim: &Claim, judgement: &Judgement) -> String {
    let all = judgement.bounds.len();
    let deciding = &judgement.bounds[judgement.deciding];
    let interval = match deciding.is_exact() {
        true => "exact".to_owned(),
        false => {
            // The interval that the verdict rests on.
            let [low, high] = match judgement.verdict {
                Verdict::DoesNotHold => deciding.together(all),
                Verdict::Holds | Verdict::CannotSay => deciding.single(),
            };
            format!("{} … {}", short(low), short(high))
        }
    };
    let others = match (all, judgement.contradicting, judgement.undecided) {
        (1, _, _) => String::new(),
        (all, 0, 0) => format!("; all {all} agree"),
        (all, against, undecided) => {
            format!("; of {all}, {against} contradict and {undecided} are undecided")
        }
    };
    let more = match (judgement.verdict, told.study.more_surfaces(claim, judgement)) {
        (Verdict::CannotSay, Some((more, seconds))) => format!(
            "; {} of each spectrum would decide it, {}",
            counted(more, "more surface"),
            core_hours(seconds)
        ),
        (Verdict::CannotSay, None) if judgement.undecided + judgement.contradicting > 0 => {
            "; no number of surfaces would decide it".to_owned()
        }
        _ => String::new(),
    };
    let without = match judgement.without_value.as_slice() {
        [] => String::new(),
        [one] => format!("; no value for {one}"),
        [one, more @ ..] => format!("; no value for {one}, nor {} more", more.len()),
    };
    format!(
        "expected {}; decided by {} [{interval}] at {}{others}{without}{more}",
        claim.statement.expected,
        short(deciding.value),
        deciding.label
    )
}

fn closing(claims: &[Claim], told: &Told) -> String {
    let words = [Verdict::Holds, Verdict::DoesNotHold, Verdict::CannotSay].map(Verdict::name);
    let words: Vec<&str> = words.into_iter().chain(["not computed"]).collect();
    let origins = [(Origin::Paper, "of the paper"), (Origin::Ours, "of ours")];
    let mut text = String::new();
    for (origin, whose) in origins {
        let own: Vec<&Claim> =
            claims.iter().filter(|claim| claim.statement.origin == origin).collect();
        let count = |word: &str| own.iter().filter(|claim| verdict(claim) == word).count();
        let parts = words.iter().map(|word| format!("{} {word}", count(word)));
        let parts: Vec<String> = parts.collect();
        text += &format!("{} {whose}: {}\n", counted(own.len(), "claim"), parts.join(" · "));
    }
    if told.study.missing > 0 {
        text += &format!("{} of the study not run yet\n", counted(told.study.missing, "task"));
    }
    let manifest = told.manifest.display();
    text + &format!("`asperity claims {manifest} NAME` explains one at length\n")
}

/// What claims do not look at, and what they look at instead.
fn left_out(setting: &Setting) -> String {
    let lines = setting.left_out.iter().map(|left| {
        let instead = setting.point.clone().beyond(&left.differs);
        let names: Vec<&str> = left.differs.iter().map(|(name, _)| name).collect();
        format!("left out: {left}; the claims rest on {}\n", instead.only(&names))
    });
    lines.collect()
}
