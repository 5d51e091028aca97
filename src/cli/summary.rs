//! What a study has found, a line per stage.

use std::collections::BTreeSet;

use arrow::array::Array;

use super::{Failure, counted};
use crate::caveats;
use crate::fitting::FitError;
use crate::plan::{Plan, PlannedStage};
use crate::results::PublishedTable;
use crate::stages::Kind;
use crate::stages::fit::rows::{FITTED, STATUS};
use crate::stages::solve::GIVEN_UP;
use crate::store::table::{Table, TableError};

/// One line per stage, and where the tables are; stages with one of the tasks `only`, if some are
/// named: all others have tasks that nobody asked for.
pub fn text(
    plan: &Plan,
    tables: &[PublishedTable],
    only: Option<&[usize]>,
) -> Result<String, Failure> {
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

fn line(stage: &PlannedStage, table: &Table) -> Result<String, Failure> {
    let parts = match stage.kind {
        Kind::Generate => vec![
            Some(counted(table.rows(), "surface")),
            range(table, "nayak", "Nayak α")?,
            range(table, "full_contact_load", "full contact at")?,
            caveat(table)?,
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

/// Of how many parameter points the theories do not speak, and why of the first.
fn caveat(surfaces: &Table) -> Result<Option<String>, Failure> {
    let points = caveats::points(surfaces)?;
    let others: Vec<_> = points
        .iter()
        .filter(|point| !point.departures.is_empty())
        .collect();
    Ok(others.first().map(|first| {
        let number = match points.len() {
            1 => String::new(),
            all => format!("{} of {all} points ", others.len()),
        };
        let why = first.departures.join(", ");
        let such_as = if others.len() > 1 { "such as " } else { "" };
        format!("{number}no isotropic Gaussian roughness: {such_as}{why}")
    }))
}

fn solved(table: &Table) -> Result<Vec<Option<String>>, TableError> {
    let rows = table.rows();
    let pairs: i64 = table.integers("pairs")?.iter().flatten().sum();
    let among = |word: &str| -> Result<usize, TableError> {
        let stops = table.texts("stop")?;
        Ok(stops.iter().filter(|stop| *stop == Some(word)).count())
    };
    let surfaces: BTreeSet<_> = table.texts("surface")?.iter().collect();
    let given_up = among(GIVEN_UP)?;
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
    let status = table.texts(STATUS.name)?;
    let among = |word: &str| status.iter().filter(|status| *status == Some(word)).count();
    let astray = among(&FitError::NotConverged.to_string());
    let failed = table.rows() - among(FITTED) - astray;
    let mut parts = vec![
        Some(counted(table.rows(), "fit")),
        (astray > 0).then(|| format!("{astray} did not converge")),
        (failed > 0).then(|| format!("{failed} failed, see `status`")),
    ];
    for (name, label) in [
        ("kappa", "κ"),
        ("beta", "β"),
        ("mu", "μ"),
        ("exponent", "exponent"),
        ("erf_scale", "scale"),
        ("decay_length", "u₀"),
        ("closing_load", "p_c"),
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
    Ok(
        (column.len() > column.null_count()).then(|| match least == most {
            true => format!("{label} {}", number(least)),
            false => format!("{label} {} … {}", number(least), number(most)),
        }),
    )
}

/// Four decimals, and four digits behind the first where these would be none.
fn number(value: f64) -> String {
    match value != 0.0 && value.abs() < 1e-3 {
        true => format!("{value:.4e}"),
        false => format!("{value:.4}"),
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::theory::law::ContactEvolution;
    use crate::stages::columns::{AREA_FRACTION, LOAD, STOP, SURFACE};
    use crate::stages::fit;
    use crate::store::column::{Column, ColumnKind, reals, texts};

    const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");

    #[test]
    fn a_fit_that_did_not_converge_is_counted_and_enters_no_range() {
        let loads: Vec<f64> = (1..=20).map(|i| 0.003 * f64::from(i)).collect();
        let law = ContactEvolution {
            kappa: 2.75,
            beta: 1.2,
            mu: 0.6,
        };
        let of_a_law = loads.iter().map(|&load| law.area(load));
        // Its slope at first touch is infinite.
        let of_a_power = loads.iter().map(|load| 2.0 * load.powf(0.9));
        let measured = Table::new(
            40,
            vec![
                (SURFACE, texts([["one"; 20], ["two"; 20]].concat())),
                (HURST, reals([[0.3; 20], [0.8; 20]].concat())),
                (LOAD, reals([loads.clone(), loads.clone()].concat())),
                (AREA_FRACTION, reals(of_a_law.chain(of_a_power))),
                (STOP, texts(["converged"; 40])),
            ],
        );
        let free = fit::Params {
            law: fit::Law::ContactEvolution {
                to: fit::Datum::Area,
                kappa: fit::Kappa::Free,
            },
            window: [0.0, 1.0],
            bootstrap: 0,
            level: 0.95,
            seed: 0,
        };
        let table = fit::fitted(&free, &measured).unwrap();
        for name in ["kappa", "beta", "mu", "rms_residual", "r_squared"] {
            assert_eq!(table.reals(name).unwrap().null_count(), 1, "{name}");
        }
        let parts: Vec<String> = fitted(&table).unwrap().into_iter().flatten().collect();
        let told = [
            "2 fits",
            "1 did not converge",
            "κ 2.7500",
            "β 1.2000",
            "μ 0.6000",
        ];
        assert_eq!(parts, told);
    }
}
