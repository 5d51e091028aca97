//! What a study has found, a line per stage.

use super::{Failure, counted};
use asperity_pipeline::plan::{Plan, PlannedStage};
use asperity_pipeline::results::PublishedTable;
use asperity_tables::source::TableSource;

/// One line per stage, and where the tables are; stages with one of the tasks `only`, if some are
/// named: all others have tasks that nobody asked for.
pub fn text(
    plan: &Plan,
    tables: &[PublishedTable],
    only: Option<&[usize]>,
) -> Result<String, Failure> {
    let width = plan.stages.iter().map(|stage| stage.name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let left = match only {
        Some(_) => "left for later",
        None => "missing",
    };
    let is_asked_for = |stage: &PlannedStage| {
        let is_wanted =
            |only: &[usize]| stage.tasks.iter().any(|task| only.binary_search(task).is_ok());
        only.is_none_or(is_wanted)
    };
    let stages = plan.stages.iter().zip(tables);
    for (stage, table) in stages.filter(|(stage, _)| is_asked_for(stage)) {
        let line = match table.finished {
            0 => "nothing finished".to_owned(),
            _ => line(stage, &table.open()?)?,
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

fn line(stage: &PlannedStage, table: &TableSource) -> Result<String, Failure> {
    Ok((stage.kind.definition().summary)(table)?.join(" · "))
}
