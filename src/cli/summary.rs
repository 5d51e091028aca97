//! What a study has found, a line per stage.

use std::collections::BTreeSet;

use arrow::array::Array;

use super::{Failure, counted};
use crate::plan::{Plan, PlannedStage};
use crate::results::StageTable;
use crate::stages::Kind;
use crate::store::table::{Table, TableError};

/// One line per stage, and where the tables are; stages with one of the tasks `only`, if some are
/// named: all others have tasks that nobody asked for.
pub fn text(plan: &Plan, tables: &[StageTable], only: Option<&[usize]>) -> Result<String, Failure> {
    let width = plan
        .stages
        .iter()
        .map(|stage| stage.name.chars().count())
        .max()
        .unwrap_or(0);
    let mut text = String::new();
    let left = match only {
        Some(_) => "left for later",
        None => "missing",
    };
    let is_asked_for = |stage: &PlannedStage| {
        let is_wanted = |only: &[usize]| {
            stage
                .tasks
                .iter()
                .any(|task| only.binary_search(task).is_ok())
        };
        only.is_none_or(is_wanted)
    };
    let stages = plan.stages.iter().zip(tables);
    for (stage, table) in stages.filter(|(stage, _)| is_asked_for(stage)) {
        let line = match table.finished {
            0 => "nothing finished".to_owned(),
            _ => line(stage, &table.read()?)?,
        };
        let missing = stage.tasks.len() - table.finished;
        let missing = match missing {
            0 => String::new(),
            _ => format!(" · {} {left}", counted(missing, "task")),
        };
        text += &format!("{:width$}  {line}{missing}\n", stage.name);
    }
    if let Some(folder) = tables.first().and_then(|table| table.path.parent()) {
        text += &format!("tables: {}\n", folder.join("*.parquet").display());
    }
    Ok(text)
}

fn line(stage: &PlannedStage, table: &Table) -> Result<String, TableError> {
    let parts = match stage.kind {
        Kind::Generate => vec![
            Some(counted(table.rows(), "surface")),
            range(table, "nayak", "Nayak α")?,
            range(table, "full_contact_load", "full contact at")?,
        ],
        Kind::Solve => solved(table)?,
        Kind::Measure => vec![
            Some(counted(table.rows(), "row")),
            range(table, "area_fraction", "contact covers")?,
            range(table, "bin", "heights from")?,
        ],
        Kind::Correct => vec![
            Some(counted(table.rows(), "row")),
            Some(distinct(table, "correction")?.join(", ")),
        ],
        Kind::Fit => fitted(table)?,
        Kind::Aggregate => vec![
            Some(counted(table.rows(), "row")),
            Some(counted(table.names().len(), "column")),
        ],
    };
    Ok(parts.into_iter().flatten().collect::<Vec<_>>().join(" · "))
}

fn solved(table: &Table) -> Result<Vec<Option<String>>, TableError> {
    let rows = table.rows();
    let pairs: i64 = table.integers("pairs")?.iter().flatten().sum();
    let among = |word: &str| -> Result<usize, TableError> {
        let stops = table.texts("stop")?;
        Ok(stops.iter().filter(|stop| *stop == Some(word)).count())
    };
    let surfaces: BTreeSet<_> = table.texts("surface")?.iter().collect();
    let given_up = among("pair-limit")?;
    let full = among("full-contact")?;
    Ok(vec![
        Some(format!(
            "{} on {}",
            counted(rows, "load"),
            counted(surfaces.len(), "surface")
        )),
        Some(match given_up {
            0 => "all converged".to_owned(),
            _ => format!("{} not converged", counted(given_up, "load")),
        }),
        (full > 0).then(|| format!("{full} in full contact")),
        (rows > 0).then(|| format!("{} pairs of transforms a load", pairs / rows as i64)),
    ])
}

fn fitted(table: &Table) -> Result<Vec<Option<String>>, TableError> {
    let status = table.texts("status")?;
    let failed = status
        .iter()
        .filter(|status| *status != Some("fitted"))
        .count();
    let mut parts = vec![
        Some(counted(table.rows(), "fit")),
        (failed > 0).then(|| format!("{failed} failed, see `status`")),
    ];
    for (name, label) in [
        ("kappa", "κ"),
        ("beta", "β"),
        ("mu", "μ"),
        ("exponent", "exponent"),
        ("erf_scale", "scale"),
        ("mesh_coefficient", "c"),
    ] {
        parts.push(range(table, name, label)?);
    }
    Ok(parts)
}

/// Smallest and largest value of a column, if there is one.
fn range(table: &Table, name: &str, label: &str) -> Result<Option<String>, TableError> {
    if !table.has(name) {
        return Ok(None);
    }
    let column = table.reals(name)?;
    let values = || column.iter().flatten();
    let (least, most) = (
        values().fold(f64::INFINITY, f64::min),
        values().fold(f64::NEG_INFINITY, f64::max),
    );
    Ok((column.len() > column.null_count()).then(|| {
        if least == most {
            format!("{label} {least:.4}")
        } else {
            format!("{label} {least:.4} … {most:.4}")
        }
    }))
}

/// A column's texts, each once, in order of appearance.
fn distinct(table: &Table, name: &str) -> Result<Vec<String>, TableError> {
    let mut found: Vec<String> = Vec::new();
    for text in table.texts(name)?.iter().flatten() {
        if !found.iter().any(|known| known == text) {
            found.push(text.to_owned());
        }
    }
    Ok(found)
}
