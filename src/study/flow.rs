//! What flows between stages, and who can read it.

use crate::diagnostics::{Problem, Problems};
use crate::manifest::generate::RandomHeights;
use crate::manifest::{Form, Points, StageTable, a_stage};
use crate::stages::Kind;

/// What the rows of a stage's table are about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows {
    Surfaces,
    Spectra,
    Loads,
    Contacts,
    Heights,
    Corrections,
    Fits,
    Statistics,
}

impl Rows {
    fn name(self) -> &'static str {
        match self {
            Rows::Surfaces => "surfaces",
            Rows::Spectra => "surfaces without heights",
            Rows::Loads => "solved loads",
            Rows::Contacts => "measured contacts",
            Rows::Heights => "measured heights",
            Rows::Corrections => "corrected areas",
            Rows::Fits => "fits",
            Rows::Statistics => "statistics",
        }
    }
}

/// What a stage can read; each alone, never one beside the other.
fn readable(stage: &StageTable, kind: Kind) -> (&'static [Rows], &'static str) {
    if let Some(Points::Law(Form::LoadSeparation, _)) = &stage.points {
        // A correction is one of the area: it knows no gap.
        let words = "`measure` stages that read contacts, where its law is `load-separation`";
        return (&[Rows::Contacts], words);
    }
    match kind {
        Kind::Generate => (&[], "nothing"),
        Kind::Solve => (&[Rows::Surfaces], "`generate` stages"),
        Kind::Measure => (
            &[Rows::Loads, Rows::Surfaces],
            "either `solve` or `generate` stages",
        ),
        Kind::Correct => (&[Rows::Contacts], "`measure` stages that read contacts"),
        Kind::Fit => (
            &[Rows::Contacts, Rows::Corrections],
            "either `measure` stages that read contacts or `correct` stages",
        ),
        Kind::Aggregate => (
            &[
                Rows::Surfaces,
                Rows::Spectra,
                Rows::Loads,
                Rows::Contacts,
                Rows::Heights,
                Rows::Corrections,
                Rows::Fits,
                Rows::Statistics,
            ],
            "stages of any one kind, or with `sql` any stages",
        ),
    }
}

/// What a stage makes of what it reads.
fn made(stage: &StageTable, kind: Kind, read: Option<Rows>) -> Option<Rows> {
    match kind {
        Kind::Generate if has_no_heights(stage) => Some(Rows::Spectra),
        Kind::Generate => Some(Rows::Surfaces),
        Kind::Solve => Some(Rows::Loads),
        Kind::Measure if read? == Rows::Surfaces => Some(Rows::Heights),
        Kind::Measure => Some(Rows::Contacts),
        Kind::Correct => Some(Rows::Corrections),
        Kind::Fit => Some(Rows::Fits),
        Kind::Aggregate => Some(Rows::Statistics),
    }
}

/// Whether a stage draws surfaces that cannot be pressed.
fn has_no_heights(stage: &StageTable) -> bool {
    let Some(Points::Random(_, section)) = &stage.points else {
        return false;
    };
    let mut heights = section.points.iter().map(|point| &point.table.heights);
    heights.any(|key| key.written().map(|heights| heights.value) == Some(RandomHeights::None))
}

/// Checks what a stage reads, and says what it reads and makes, as far as that can be told.
pub fn check(
    stage: &StageTable,
    inputs: &[(&str, Option<Rows>)],
    mixes: bool,
    problems: &mut Problems,
) -> (Option<Rows>, Option<Rows>) {
    let Some(kind) = stage.kind else {
        return (None, None);
    };
    let (readable, help) = readable(stage, kind);
    let mut read: Option<(&str, Rows)> = None;
    for (name, rows) in inputs {
        let from = stage.from.iter().flatten().find(|from| from.value == *name);
        let (Some(from), Some(rows)) = (from, *rows) else {
            continue;
        };
        let problem = |message| {
            let label = format!("this stage gives {}", rows.name());
            let help = match rows {
                Rows::Spectra => "with `heights = \"redraw\"` it gives surfaces".to_owned(),
                _ => format!("{} reads {help}", a_stage(kind)),
            };
            Problem::new(message, from.span.clone(), label).help(help)
        };
        match read {
            _ if !readable.contains(&rows) => {
                problems.push(problem(format!(
                    "{} cannot read {}",
                    a_stage(kind),
                    rows.name()
                )));
            }
            Some((other, before)) if before != rows && !mixes => {
                problems.push(problem(format!(
                    "the columns of `{other}` and `{name}` clash: {} and {}",
                    before.name(),
                    rows.name()
                )));
            }
            _ => read = Some((name, rows)),
        }
    }
    let read = read.map(|(_, rows)| rows);
    (read, made(stage, kind, read))
}
