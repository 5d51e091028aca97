//! Whether claims are decided, and how many surfaces would decide them.
//!
//! Claims compare spectra, so that a condition on them looks at every table of the study that is about
//! single surfaces, and at no other: fits and means of numbers of surfaces on the way are never computed.
//! Each step adds half as many surfaces or more, at most as many again: so many looks at most there can be
//! on the way, and each has its share of the 5 % ([`ClaimRule`]). At the most surfaces there is
//! nothing left to decide, and claims are judged as `asperity claims` judges them.

use std::num::NonZeroU32;

use super::condition::{Condition, Finding};
use super::error::SamplingError;
use super::rule::{ClaimRule, Decisions};
use super::tables::read;
use crate::plan::Plan;
use crate::study::{Growth, Study};
use asperity_stages::measure;
use asperity_stages::measure::Distribution;
use asperity_stages::{Recipe, solve};
use asperity_tables::store::TaskTables;
use asperity_tables::table::Table;

/// Whether claims are decided, those of some names or all.
///
/// # Errors
/// When a table cannot be read, or lacks a column.
pub fn condition(
    (study, plan): (&Study, &Plan),
    (surfaces, growth): (u32, &Growth),
    (rule, names): (&dyn ClaimRule, &[String]),
    there: &impl TaskTables,
) -> Result<Condition, SamplingError> {
    let tables = match all_tables(plan, there)? {
        Ok(tables) => tables,
        Err(open) => return Ok(open),
    };
    let looks = match surfaces >= growth.at_most {
        true => NonZeroU32::MIN,
        false => looks(growth),
    };
    let decisions = rule.decide(study, plan, &tables, names, looks)?;
    Ok(match decisions.wanted(surfaces) {
        None => Condition::Holds(Finding::Claims(decisions)),
        Some(_) => Condition::Fails(Finding::Claims(decisions)),
    })
}

/// Every task that a condition on claims looks at.
pub fn tasks(plan: &Plan) -> Vec<usize> {
    let tasks = 0..plan.tasks.len();
    tasks.filter(|&task| is_looked_at(&plan.tasks[task].recipe)).collect()
}

/// Whether claims rest on a table, and it is of one surface.
fn is_looked_at(recipe: &Recipe) -> bool {
    match recipe {
        Recipe::Generate(_) | Recipe::Correct(_) => true,
        Recipe::Measure(params) => matches!(
            params,
            measure::Params::Contacts { .. }
                | measure::Params::Distribution(Distribution::Pressures)
        ),
        // What is solved is measured.
        Recipe::Solve(params) => {
            let solve::Params { asperities, .. } = params.as_ref();
            asperities.is_some()
        }
        Recipe::Fit(_) | Recipe::Aggregate(_) => false,
    }
}

/// The tables of the stages that are looked at, stage by stage; or the condition as it stands.
fn all_tables(
    plan: &Plan,
    there: &impl TaskTables,
) -> Result<Result<Vec<Option<Table>>, Condition>, SamplingError> {
    let mut read = match read(plan, &tasks(plan), there)? {
        Ok(tables) => tables.into_iter(),
        Err(open) => return Ok(Err(open)),
    };
    let mut of_tasks: Vec<Option<Table>> = (0..plan.tasks.len()).map(|_| None).collect();
    for task in tasks(plan) {
        of_tasks[task] = read.next();
    }
    let stages = plan.stages.iter().map(|stage| {
        let own = stage.tasks.iter().filter_map(|&task| of_tasks[task].clone());
        let own: Vec<Table> = own.collect();
        (!own.is_empty()).then(|| Table::stack(&own)).transpose()
    });
    Ok(Ok(stages.collect::<Result<_, _>>()?))
}

/// The next number of surfaces: as many as would decide what some number decides, from half as many more
/// to as many again.
pub fn wanted(surfaces: u32, decisions: &Decisions, at_most: u32) -> u32 {
    let [least, most] = [least_step(surfaces), 2 * surfaces];
    let wanted = decisions.wanted(surfaces).unwrap_or(0);
    let next = u32::try_from(wanted).unwrap_or(most).clamp(least, most);
    next.min(at_most)
}

/// Returns the least number of surfaces of the next look.
pub fn least_step(surfaces: u32) -> u32 {
    surfaces + surfaces.div_ceil(2)
}

/// Returns how often claims are looked at, at most, before there are the most surfaces.
pub fn looks(growth: &Growth) -> NonZeroU32 {
    let steps =
        std::iter::successors(Some(growth.at_least), |&surfaces| Some(least_step(surfaces)));
    let looks = steps.take_while(|&surfaces| surfaces < growth.at_most);
    let looks = u32::try_from(looks.count()).unwrap_or(u32::MAX);
    NonZeroU32::new(looks).unwrap_or(NonZeroU32::MIN)
}

#[cfg(test)]
mod tests {
    use super::super::rule::Undecided;
    use super::*;
    use crate::study::Until;

    fn growth(at_least: u32, at_most: u32) -> Growth {
        Growth { at_least, at_most, until: Until::Claims(Vec::new()) }
    }

    /// A claim that this many of ten surfaces would decide.
    fn needs(needed: Option<usize>) -> Undecided {
        Undecided { name: "area-above-persson", surfaces: needed.map(|needed| [10, needed]) }
    }

    #[test]
    fn as_many_are_drawn_as_the_most_demanding_claim_needs_within_a_step() {
        let next = |needed: &[Option<usize>]| {
            let undecided = needed.iter().map(|&needed| needs(needed)).collect();
            let decisions = Decisions { undecided, ..Decisions::default() };
            wanted(10, &decisions, 60)
        };
        assert_eq!(next(&[Some(17), Some(13), None]), 17);
        assert_eq!(next(&[Some(11)]), 15);
        assert_eq!(next(&[Some(900_000)]), 20);
        assert_eq!(wanted(40, &Decisions::default(), 60), 60);
    }

    #[test]
    fn no_way_from_the_least_to_the_most_surfaces_has_more_looks_than_are_counted() {
        for (least, most) in [(5, 6), (10, 10), (10, 60), (7, 1000), (13, 999_999)] {
            let mut surfaces = least;
            let mut seen = 0;
            while surfaces < most {
                seen += 1;
                surfaces = wanted(surfaces, &Decisions::default(), most);
            }
            let counted = looks(&growth(least, most)).get();
            assert!(seen <= counted && counted <= seen.max(1), "{least} to {most}");
        }
        assert_eq!(looks(&growth(10, 60)).get(), 5);
    }
}
