//! Rows that remain to be computed for tasks whose tables are stored in part.

use std::collections::{BTreeMap, HashMap};

use super::effort;
use crate::plan::Plan;
use crate::plan::missing_rows::{RowGroup, missing_groups};
use asperity_manifest::diagnostics::{counted, listed};
use asperity_stages::{Effort, Extent, Kind};
use asperity_tables::store::Store;
use asperity_tables::store::series::Listing;

/// Rows that the store lacks, for the missing tasks whose rows are independent.
#[derive(Debug, Default)]
pub struct Remaining(HashMap<usize, Vec<RowGroup>>);

impl Remaining {
    /// Finds the rows that the missing tasks of a plan have to compute. If the store cannot be
    /// listed, all rows of a task count as missing.
    pub fn new(plan: &Plan, missing: &[usize], store: &Store) -> Remaining {
        let listing = Listing::new(store);
        let groups = missing.iter().filter_map(|&task| {
            let planned = &plan.tasks[task];
            let series = planned.table.series.as_deref()?;
            let groups = missing_groups(planned, series, &|table| listing.missing_rows(table));
            Some((task, groups.ok()?))
        });
        Remaining(groups.collect())
    }

    /// Returns the expected cost of what remains of a task. If nothing is known about its rows, it
    /// is the cost of the whole task.
    pub fn effort(&self, plan: &Plan, task: usize) -> Effort {
        let planned = &plan.tasks[task];
        let whole = &planned.recipe;
        let groups = self.0.get(&task).into_iter().flatten();
        let efforts = groups.map(|group| {
            let (nodes, tables) = (planned.nodes, planned.inputs.len());
            let extent = Extent { nodes, rows: group.values.len(), tables };
            let effort = group.recipe(whole).effort(extent).and_reading(extent.tables);
            if !group.from_stored {
                return effort;
            }
            // Only the parts are computed.
            let rows = RowGroup { parts: Vec::new(), ..group.clone() }.recipe(whole);
            Effort { pairs: effort.pairs - rows.effort(extent).pairs, ..effort }
        });
        let sum = efforts.reduce(|one, other| Effort {
            pairs: one.pairs + other.pairs,
            seconds: one.seconds + other.seconds,
        });
        sum.unwrap_or_else(|| effort(planned, planned.nodes))
    }

    /// Returns the number of rows that remain of some tasks, or `None` if one of them is stored as
    /// a whole table.
    pub fn rows(&self, tasks: &[usize]) -> Option<usize> {
        let rows = |task: &usize| {
            let groups = self.0.get(task)?;
            Some(groups.iter().map(|group| group.values.len()).sum::<usize>())
        };
        tasks.iter().map(rows).sum()
    }

    /// Describes what remains of some tasks of one kind, one phrase for each way in which rows are
    /// computed.
    pub fn phrases(&self, kind: Kind, tasks: &[usize]) -> Vec<String> {
        let mut counts: BTreeMap<(bool, bool, Vec<String>), usize> = BTreeMap::new();
        for group in tasks.iter().filter_map(|task| self.0.get(task)).flatten() {
            let mut columns: Vec<String> = Vec::new();
            if !group.is_new {
                let parts = group.parts.iter().map(|part| match part.columns[..] {
                    [column] => column,
                    _ => &part.name,
                });
                columns.extend(parts.map(str::to_owned));
            }
            *counts.entry((!group.is_new, group.from_stored, columns)).or_default() +=
                group.values.len();
        }
        let verb = if kind == Kind::Solve { "solve" } else { "measure" };
        let phrases = counts.into_iter().map(|((is_stored, from_stored, columns), rows)| {
            let loads = counted(rows, "load");
            let columns = listed(columns.iter().map(String::as_str), "and");
            match (is_stored, from_stored) {
                (false, _) => format!("{loads} to {verb}"),
                (true, true) => format!("{columns} of {loads}, from stored pressures"),
                (true, false) => {
                    format!("{columns} of {loads}, solved again because no pressures are stored")
                }
            }
        });
        phrases.collect()
    }
}
