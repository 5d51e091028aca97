//! `asperity claims`, which tests the claims of a study.

use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::slice;

use super::plan::core_hours;
use super::terminal::{in_columns, stdout};
use super::{Failure, SetArguments, print_answer};
use crate::session::claims::{
    Bound, Claim, ClaimOutcome, ClaimSpec, Judgement, LEVEL, Origin, Setting, Verdict, shipped,
    verdict,
};
use crate::session::formatting::{counted, shell_word, significant, wrapped};
use crate::session::{DataFolder, StudyClaims};

#[derive(clap::Args)]
pub(crate) struct ClaimsArguments {
    /// Path of the manifest of the study (default: list the claims of the program).
    manifest: Option<PathBuf>,

    #[command(flatten)]
    set: SetArguments,

    /// Claim to explain in detail (default: list all claims).
    name: Option<String>,

    /// Print the result as JSON.
    ///
    /// Form: `{"level", "rests_on", "left_out": [{"rows", "with"}, …], "missing_tasks", "claims":
    /// [{"name", "kind": "paper" | "misprint" | "ours" | "study", "file", "says", "where",
    /// "quantity", "because", "data", "verdict", "expected", "quantities": [{"label", "value",
    /// "lower", "upper", "least", "most", "n"}, …], "needs", "more_surfaces", "core_hours",
    /// "figure"}, …]}`.
    ///
    /// `lower` and `upper` are simultaneous bounds for all quantities of a claim; `least` and
    /// `most` bound each quantity alone.
    #[arg(long, requires = "manifest")]
    json: bool,
}

pub(crate) fn claims(arguments: &ClaimsArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let Some(manifest) = &arguments.manifest else {
        write!(stdout(), "{}", list_without_study())?;
        return Ok(ExitCode::SUCCESS);
    };
    let study = super::session(manifest, &arguments.set, data).claims()?;
    let claims = match &arguments.name {
        Some(name) => slice::from_ref(study.named(name)?),
        None => &study.claims,
    };
    print_answer(arguments.json, &study.summary(claims), || match arguments.name {
        Some(_) => claims.iter().map(|claim| claim_details(manifest, &study, claim)).collect(),
        None => list(manifest, &study, claims),
    })
}

/// Breaks a text into lines and indents them.
fn indented(indent: usize, text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let margin = " ".repeat(indent);
    format!("{margin}{}\n", wrapped(&words.join(" ")).replace('\n', &format!("\n{margin}")))
}

/// Formats a number with four significant digits.
fn short(value: f64) -> String {
    significant(value, 4)
}

/// Indentation of the text about a claim, in characters.
const INDENT: usize = 14;

fn list(manifest: &Path, study: &StudyClaims, claims: &[Claim]) -> String {
    if claims.is_empty() {
        return "the manifest has no claims; add `[claim.NAME]`, or `claims = \"yastrebov-2015\"` \
                to `[study]`\n"
            .to_owned();
    }
    let missing = match study.missing {
        0 => String::new(),
        missing => format!("{} of the study not computed yet\n\n", counted(missing, "task")),
    };
    let claims_of_all = by_origin(claims, |claim| few_lines(study, claim));
    missing + &claims_of_all + &closing(claims, manifest) + &left_out(study.setting())
}

/// Lists the claims of the program with their texts, without a study.
fn list_without_study() -> String {
    let lines = |claim: &Claim| {
        let name = &claim.statement.name;
        format!("{name} · {}\n{}", claim.data, indented(4, &said(&claim.statement)))
    };
    by_origin(&shipped(), lines)
        + "A manifest names the file of these claims in `[study]`: `claims = \"yastrebov-2015\"`.\n\
           `asperity claims MANIFEST` tests the claims with the results of a study.\n\
           `until = \"decided(CLAIM, …)\"` of a `generate` stage can name all claims but those on \
           closed forms and misprints.\n"
}

/// Returns the text of a claim with its source.
fn said(statement: &ClaimSpec) -> String {
    match statement.source.as_str() {
        "" => statement.text.clone(),
        source => format!("{} ({source})", statement.text),
    }
}

/// Lists claims by their file and origin, each with the lines that `lines` returns.
fn by_origin(claims: &[Claim], lines: impl Fn(&Claim) -> String) -> String {
    let headings = [
        (Origin::Paper, "Statements of the paper"),
        (Origin::Ours, "Statements of asperity"),
        (Origin::Study, "Claims of the study"),
        (Origin::Misprint, "Misprints (notes without a verdict)"),
    ];
    let mut files: Vec<Option<&str>> =
        claims.iter().map(|claim| claim.statement.file.as_deref()).collect();
    let mut known = HashSet::new();
    files.retain(|file| known.insert(*file));
    let mut text = String::new();
    for file in files {
        for (origin, heading) in headings {
            let is_own = |claim: &&Claim| {
                claim.statement.origin == origin && claim.statement.file.as_deref() == file
            };
            let listed: String = claims.iter().filter(is_own).map(&lines).collect();
            let of_file = file.map_or_else(String::new, |file| format!(" · {file}"));
            if !listed.is_empty() {
                text += &format!("{heading}{of_file}\n\n{listed}\n");
            }
        }
    }
    text
}

fn few_lines(study: &StudyClaims, claim: &Claim) -> String {
    let statement = &claim.statement;
    let said = said(statement);
    let found = match &claim.outcome {
        ClaimOutcome::Judged(judgement) => finding(study, claim, judgement),
        ClaimOutcome::NotComputed(needs) => format!("needs {needs}"),
        ClaimOutcome::Noted => statement.reason.clone(),
    };
    format!(
        "{:INDENT$}{} · {}\n{}{}",
        verdict(claim),
        statement.name,
        claim.data,
        indented(INDENT, &said),
        indented(INDENT, &found),
    )
}

fn finding(study: &StudyClaims, claim: &Claim, judgement: &Judgement) -> String {
    let all = judgement.bounds.len();
    let deciding = &judgement.bounds[judgement.deciding];
    // This interval decides the verdict.
    let ends = match judgement.verdict {
        Verdict::DoesNotHold => deciding.simultaneous(all),
        Verdict::Holds | Verdict::CannotSay => deciding.one_sided(),
    };
    let interval = interval(deciding, ends);
    let others = others(all, judgement);
    let more = what_would_decide(study, claim, judgement);
    let without = match judgement.without_value.as_slice() {
        [] => String::new(),
        [one] => format!("; no value for {one}"),
        [one, more @ ..] => format!("; no value for {one} and {} more", more.len()),
    };
    format!(
        "{}: expected {}, found {} [{interval}] at {}{others}{without}{more}",
        beginning(&claim.statement.quantity),
        claim.statement.expected,
        short(deciding.value),
        deciding.label
    )
}

/// Formats an interval of a quantity, which is a point if the quantity is exact.
fn interval(bound: &Bound, [low, high]: [f64; 2]) -> String {
    if bound.is_exact() {
        return "exact".to_owned();
    }
    format!("{} … {}", short(low), short(high))
}

/// Returns the description of a quantity up to its first comma.
fn beginning(quantity: &str) -> String {
    match quantity.split_once(", ") {
        Some((beginning, _)) => format!("{beginning} …"),
        None => quantity.to_owned(),
    }
}

/// Returns a text that counts the quantities that contradict a claim and the undecided ones.
fn others(all: usize, judgement: &Judgement) -> String {
    let (against, undecided) = (judgement.contradicting, judgement.undecided);
    let contradict = if against == 1 { "contradicts" } else { "contradict" };
    let undecided = (undecided > 0).then(|| format!("{undecided} undecided"));
    let against = (against > 0).then(|| format!("{against} {contradict} the claim"));
    let found: Vec<String> = against.into_iter().chain(undecided).collect();
    match found.as_slice() {
        _ if all == 1 => String::new(),
        [] => format!("; all {all} quantities agree"),
        found => format!("; of {all} quantities {}", found.join(", ")),
    }
}

fn closing(claims: &[Claim], manifest: &Path) -> String {
    // The names of the verdicts, and their forms after other numbers than 1.
    let words = [
        (Verdict::Holds.name(), "hold"),
        (Verdict::DoesNotHold.name(), "do not hold"),
        (Verdict::CannotSay.name(), Verdict::CannotSay.name()),
        ("not computed", "not computed"),
    ];
    let origins = [
        (Origin::Paper, "of the paper"),
        (Origin::Ours, "of asperity"),
        (Origin::Study, "of the study"),
    ];
    let mut text = String::new();
    for (origin, whose) in origins {
        let own: Vec<&Claim> =
            claims.iter().filter(|claim| claim.statement.origin == origin).collect();
        if own.is_empty() {
            continue;
        }
        let count = |word: &str| own.iter().filter(|claim| verdict(claim) == word).count();
        let parts = words.map(|(one, several)| match count(one) {
            1 => format!("1 {one}"),
            number => format!("{number} {several}"),
        });
        text += &format!("{} {whose}: {}\n", counted(own.len(), "claim"), parts.join(", "));
    }
    let path = shell_word(manifest);
    text + &format!("`asperity claims {path} NAME` explains one claim in detail\n")
}

/// Lists the rows that the claims omit, and the parameter values that they use instead.
fn left_out(setting: &Setting) -> String {
    let lines = setting.left_out.iter().map(|left| {
        let instead = setting.point.clone().beyond(&left.differs);
        let names: Vec<&str> = left.differs.iter().map(|(name, _)| name).collect();
        format!("omitted: {left}; the claims use {}\n", instead.only(&names))
    });
    lines.collect()
}

fn claim_details(manifest: &Path, study: &StudyClaims, claim: &Claim) -> String {
    let statement = &claim.statement;
    let whose = match statement.origin {
        Origin::Paper => "paper",
        Origin::Ours => "asperity",
        Origin::Study => "claim",
        Origin::Misprint => "misprint",
    };
    let mut lines = vec![
        (whose, said(statement)),
        ("quantity", statement.quantity.clone()),
        ("data", claim.data.clone()),
        ("expected", statement.expected.to_string()),
        ("because", statement.reason.clone()),
    ];
    lines.retain(|(_, text)| !text.is_empty());
    if statement.origin == Origin::Misprint {
        lines.retain(|(name, _)| [whose, "because"].contains(name));
    }
    let figure = statement.figure.as_deref();
    lines.extend(figure.map(|figure| ("figure", figure_path(manifest, study, figure))));
    let mut table = String::new();
    match &claim.outcome {
        ClaimOutcome::Judged(judgement) => {
            let decided_by = what_would_decide(study, claim, judgement);
            lines.push(("verdict", format!("{}{decided_by}", verdict(claim))));
            if !judgement.without_value.is_empty() {
                lines.push(("no value", judgement.without_value.join("; ")));
            }
            table = quantities(claim, judgement);
        }
        ClaimOutcome::NotComputed(needs) => lines.push(("needs", needs.clone())),
        ClaimOutcome::Noted => {}
    }
    let line =
        |(name, text): &(&str, String)| format!("{name:<12}{}", indented(12, text).trim_start());
    format!("{}\n{}{table}\n", statement.name, lines.iter().map(line).collect::<String>())
}

/// Returns the path of the figure, and the command that draws it if it does not exist.
fn figure_path(manifest: &Path, study: &StudyClaims, figure: &str) -> String {
    let path = study.figures.join(format!("{figure}.svg"));
    if path.exists() {
        path.display().to_string()
    } else {
        format!("{} (run `asperity report {}`)", path.display(), shell_word(manifest))
    }
}

/// Returns the number of further surfaces that would decide an undecided claim.
fn what_would_decide(study: &StudyClaims, claim: &Claim, judgement: &Judgement) -> String {
    match (judgement.verdict, study.more_surfaces(claim, judgement)) {
        (Verdict::CannotSay, Some((more, seconds))) => format!(
            "; at the present scatter, {} per spectrum would decide it, {}",
            counted(more, "more surface"),
            core_hours(seconds)
        ),
        (Verdict::CannotSay, None) if judgement.undecided + judgement.contradicting > 0 => {
            "; no number of surfaces would decide it".to_owned()
        }
        _ => String::new(),
    }
}

/// Returns the table of all quantities, with their individual and their simultaneous intervals.
fn quantities(claim: &Claim, judgement: &Judgement) -> String {
    let all = judgement.bounds.len();
    let rows = judgement.bounds.iter().map(|bound| {
        [
            bound.label.clone(),
            short(bound.value),
            interval(bound, bound.one_sided()),
            interval(bound, bound.simultaneous(all)),
            claim.statement.expected.verdict(bound, all).name().to_owned(),
        ]
    });
    let percent = 100.0 * LEVEL;
    let [alone, together] =
        [format!("alone, {percent} % per end"), format!("all together, {percent} %")];
    let header = ["quantity", "value", &alone, &together, "alone"];
    format!("\n{}\n", in_columns(header, rows, |_| false))
}
