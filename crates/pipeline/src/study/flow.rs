//! What flows between stages, and who can read it.

use crate::manifest::StageTable;
use asperity_manifest::diagnostics::{Problem, Problems};
use asperity_stages::Rows;
use asperity_stages::form::{Points, a_stage};

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
    let points = stage.points.as_ref();
    let reads = points.and_then(Points::reads);
    let reads = reads.unwrap_or_else(|| kind.definition().reads.clone());
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
                _ => format!("{} reads {}", a_stage(kind), reads.from),
            };
            Problem::new(message, from.span.clone(), label).help(help)
        };
        match read {
            _ if !reads.rows.contains(&rows) => {
                problems.push(problem(format!("{} cannot read {}", a_stage(kind), rows.name())));
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
    let made = points.and_then(Points::makes);
    (read, made.or_else(|| (kind.definition().makes)(read)))
}
