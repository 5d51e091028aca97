//! Pressures that pass the hardness of the bodies, in stages that do not bound them by it.
//!
//! Bodies in a manifest may name a hardness that decides no result. Whoever reads elastic results
//! should know which of them no such material would show.

use std::collections::{BTreeMap, HashMap};

use crate::plan::{Plan, PlannedStage};
use crate::results::TASK;
use crate::study::{Stage, Study, Warning};
use asperity_manifest::diagnostics::counted;
use asperity_stages::Recipe;
use asperity_stages::columns::{LOAD, PEAK_PRESSURE, PRESSURE};
use asperity_tables::table::{Table, TableError};

/// Peaks are computed, hardnesses given: one that is equal but for rounding passes nothing.
const ROUNDING: f64 = 1e-9;

/// What should be known of the tables of a study, which `read` reads by the number of a stage; none of a
/// stage that has none.
///
/// # Errors
/// When a table cannot be read, or is none of solved loads.
pub fn warnings<E: From<TableError>>(
    study: &Study,
    plan: &Plan,
    read: impl Fn(usize) -> Result<Option<Table>, E>,
) -> Result<Vec<Warning>, E> {
    let mut warnings = Vec::new();
    for (place, (stage, planned)) in study.stages.iter().zip(&plan.stages).enumerate() {
        let hardnesses = of_tasks(stage, planned, plan);
        if hardnesses.is_empty() {
            continue;
        }
        let Some(table) = read(place)? else { continue };
        let messages = messages(&table, &hardnesses)?;
        warnings.extend(
            messages.into_iter().map(|message| Warning { stage: stage.name.clone(), message }),
        );
    }
    Ok(warnings)
}

/// The smallest hardness of the bodies of each task, by its key; of tasks whose bodies have any.
///
/// Stages may share a task and differ in their bodies, so that the study is asked and not the plan.
fn of_tasks(stage: &Stage, planned: &PlannedStage, plan: &Plan) -> HashMap<String, f64> {
    let recipes = stage.work.recipes();
    let tasks_of_each = planned.tasks.len() / recipes.len().max(1);
    let tasks = planned.tasks.chunks(tasks_of_each.max(1));
    let softest = recipes.iter().map(|recipe| match recipe {
        Recipe::Solve(params) => params.softest_body,
        _ => None,
    });
    let known = tasks.zip(softest).filter_map(|(tasks, softest)| {
        let key = |task: &usize| plan.tasks[*task].key.to_string();
        let softest = softest?;
        Some(tasks.iter().map(move |task| (key(task), softest)))
    });
    known.flatten().collect()
}

/// How many loads pass a hardness.
struct Passed {
    loads: usize,
    /// The lightest that does: reduced, and as a mean pressure.
    from: (f64, f64),
    peak: f64,
}

fn messages(table: &Table, hardnesses: &HashMap<String, f64>) -> Result<Vec<String>, TableError> {
    let tasks = table.texts(TASK.name)?;
    let [loads, means, peaks] = [LOAD, PRESSURE, PEAK_PRESSURE].map(|column| column.name);
    let (loads, means, peaks) = (table.reals(loads)?, table.reals(means)?, table.reals(peaks)?);
    let (mut rows, mut passed) = (0, BTreeMap::<u64, Passed>::new());
    for row in 0..table.rows() {
        let Some(&hardness) = hardnesses.get(tasks.value(row)) else {
            continue;
        };
        rows += 1;
        let (load, peak) = ((loads.value(row), means.value(row)), peaks.value(row));
        if peak <= hardness * (1.0 + ROUNDING) {
            continue;
        }
        // Positive numbers are in the order of their bits.
        let passed =
            passed.entry(hardness.to_bits()).or_insert(Passed { loads: 0, from: load, peak });
        passed.loads += 1;
        passed.peak = passed.peak.max(peak);
        if load.0 < passed.from.0 {
            passed.from = load;
        }
    }
    let told = passed.into_iter().map(|(hardness, passed)| {
        let hardness = f64::from_bits(hardness);
        let Passed {
            loads,
            from: (load, mean),
            peak,
        } = passed;
        format!(
            "the peak pressure passes the hardness of the bodies, {hardness:?}, under {loads} of {}, \
             from load {load:?} (a mean pressure of {mean:?}) on, and comes to {peak:.3e}: such a \
             material yields there, and these results are of one that does not; `hardness = \
             {hardness:?}` in the stage bounds the pressure",
            counted(rows, "load"),
        )
    });
    Ok(told.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_tables::column::{reals, texts};

    #[test]
    fn the_lightest_load_that_passes_is_named_and_equal_but_for_rounding_is_not_beyond() {
        let table = Table::new(
            4,
            vec![
                (TASK, texts(["a", "a", "b", "c"])),
                (LOAD, reals([0.2, 0.1, 0.3, 0.4])),
                (PRESSURE, reals([2.0, 1.0, 3.0, 4.0])),
                (PEAK_PRESSURE, reals([7.0, 6.0, 5.0 + 1e-12, 9.0])),
            ],
        );
        let hardnesses = [("a", 5.0), ("b", 5.0)].map(|(task, value)| (task.to_owned(), value));
        let told = messages(&table, &hardnesses.into_iter().collect()).unwrap();
        let [message] = told.as_slice() else { panic!("{told:?}") };
        for part in [
            "under 2 of 3 loads",
            "from load 0.1 (a mean pressure of 1.0) on",
            "comes to 7.000e0",
            "`hardness = 5.0`",
        ] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}
