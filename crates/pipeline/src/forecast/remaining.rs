//! Rows that remain to be computed for tasks whose tables are stored in part.

use std::collections::{BTreeMap, HashMap};

use super::{effort, extent};
use crate::plan::Plan;
use crate::plan::missing_rows::{RowGroup, missing_groups};
use asperity_manifest::diagnostics::{counted, listed};
use asperity_stages::{Effort, Extent, Kind};
use asperity_tables::store::Store;
use asperity_tables::store::series::Listing;

/// Rows that the store lacks, for the missing tasks that are stored in part.
#[derive(Debug, Default)]
pub struct Remaining {
    /// Missing rows of the tasks whose rows are independent.
    groups: HashMap<usize, Vec<RowGroup>>,
    /// Number of stored rows of the tasks that continue from a stored beginning of their table.
    beginnings: HashMap<usize, usize>,
}

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
        let beginnings =
            missing.iter().filter_map(|&task| Some((task, plan.stored_beginning(task, store)?.0)));
        Remaining { groups: groups.collect(), beginnings: beginnings.collect() }
    }

    /// Returns the expected cost of what remains of a task. If nothing is known about its rows, it
    /// is the cost of the whole task.
    pub fn effort(&self, plan: &Plan, task: usize) -> Effort {
        let planned = &plan.tasks[task];
        let whole = &planned.recipe;
        let beginning = self.beginnings.get(&task).and_then(|rows| whole.beginning(*rows));
        if let Some(beginning) = beginning {
            let effort = effort(planned, planned.nodes);
            let extent = Extent { tables: 1, ..extent(planned) };
            return Effort { pairs: effort.pairs - beginning.effort(extent).pairs, ..effort };
        }
        let groups = self.groups.get(&task).into_iter().flatten();
        let efforts = groups.map(|group| {
            let extent = Extent { rows: group.values.len(), ..extent(planned) };
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

    /// Returns the number of rows that remain of some tasks, or `None` if one of them computes a
    /// whole table.
    pub fn rows(&self, plan: &Plan, tasks: &[usize]) -> Option<usize> {
        let rows = |task: &usize| {
            if let Some(stored) = self.beginnings.get(task) {
                return Some(plan.tasks[*task].rows - stored);
            }
            let groups = self.groups.get(task)?;
            Some(groups.iter().map(|group| group.values.len()).sum::<usize>())
        };
        tasks.iter().map(rows).sum()
    }

    /// Describes what remains of some tasks of one kind, one phrase for each way in which rows are
    /// computed.
    pub fn phrases(&self, plan: &Plan, kind: Kind, tasks: &[usize]) -> Vec<String> {
        let mut counts: BTreeMap<(bool, bool, Vec<String>), usize> = BTreeMap::new();
        for group in tasks.iter().filter_map(|task| self.groups.get(task)).flatten() {
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
        let continued = tasks.iter().filter_map(|task| {
            let stored = *self.beginnings.get(task)?;
            Some([plan.tasks[*task].rows - stored, stored])
        });
        let [left, stored] =
            continued.fold([0; 2], |sum, rows| [sum[0] + rows[0], sum[1] + rows[1]]);
        let after = format!("{} to {verb} after {stored} stored", counted(left, "state"));
        phrases.chain((stored > 0).then_some(after)).collect()
    }
}
