//! What a study has, what it would compute, why, and at what cost: what `plan` and `explain` tell.

use std::thread::available_parallelism;
use std::time::Duration;

use serde_json::{Value, json};

use super::counted;
use super::counts::{Count, Counts};
use super::progress::duration;
use crate::growth::{GrowingStage, Grown};
use crate::pace::Pace;
use crate::plan::Plan;
use crate::reasons::cause::Cause;
use crate::reasons::record::Record;
use crate::reasons::{Group, Reasons};
use crate::store::Store;
use crate::store::table::{Table, TableError};
use crate::study::Warning;
use crate::{runner, worklist};

/// A plan beside the store and the last run.
pub struct Outlook {
    /// What should be known of the study before it is run.
    pub warnings: Vec<Warning>,
    plan: Plan,
    growing: Vec<GrowingStage>,
    missing: Vec<usize>,
    reasons: Reasons,
    pace: Pace,
}

/// How much of a stage there is, and why the rest would run.
pub struct StageOutlook<'a> {
    /// The stage, and how many of its tasks are in the store.
    pub count: Count<'a>,
    /// Its missing tasks, by what makes them run.
    pub groups: &'a [Group],
    /// What they are expected to take of one core.
    pub seconds: f64,
}

impl Outlook {
    /// Looks at the store and the study's record, and writes nothing.
    pub fn of(grown: Grown, store: &Store, record: Option<&Record>) -> Outlook {
        let Grown {
            study,
            plan,
            stages,
        } = grown;
        let missing = runner::missing(&plan, store);
        let now = Record::of(&study, &plan, &missing);
        Outlook {
            warnings: study.warnings(),
            reasons: Reasons::of(&plan, &now, record, &missing, store),
            plan,
            growing: stages,
            missing,
            pace: Pace::default(),
        }
    }

    /// Every stage, in the order of the plan.
    pub fn stages(&self) -> Vec<StageOutlook<'_>> {
        let counts = Counts::of(&self.plan, &self.missing).0.into_iter();
        let stages = counts.zip(&self.reasons.stages);
        stages
            .map(|(count, groups)| StageOutlook {
                count,
                groups,
                seconds: groups.iter().map(|group| self.seconds(group)).sum(),
            })
            .collect()
    }

    /// What a group of tasks is expected to take of one core.
    pub fn seconds(&self, group: &Group) -> f64 {
        self.pace.seconds_of(&self.plan, &group.tasks)
    }

    /// What everything missing is expected to take of one core: a task of two stages counts once.
    fn total_seconds(&self) -> f64 {
        self.pace.seconds_of(&self.plan, &self.missing)
    }

    /// A cause in a phrase, as one of this stage reads it.
    pub fn told(&self, cause: &Cause, stage: &str) -> String {
        let origin = &self.plan.stages[cause.stage].name;
        match origin == stage {
            true => cause.why.to_string(),
            false => format!("upstream `{origin}`: {}", cause.why),
        }
    }

    /// Its tasks one by one.
    pub fn tasks(&self) -> impl Iterator<Item = Result<Table, TableError>> {
        worklist::tables(&self.plan, &self.missing, &self.pace)
    }

    /// The name of the stage where something happened.
    pub fn origin(&self, cause: &Cause) -> &str {
        &self.plan.stages[cause.stage].name
    }

    /// What is told of stages, and of the study, for programs.
    pub fn json(&self, stages: impl Iterator<Item = Value>) -> Value {
        json!({
            "stages": stages.collect::<Value>(),
            "core_hours": self.total_seconds() / 3600.0,
            "growing": growing(&self.growing),
        })
    }

    /// What is to come, in time of this machine, and where more may come.
    pub fn forecast(&self) -> String {
        let growing = self.growing.iter().map(|stage| format!("{stage}\n"));
        growing.collect::<String>() + &self.cost()
    }

    fn cost(&self) -> String {
        if self.missing.is_empty() {
            return "nothing to do".to_owned();
        }
        let seconds = self.total_seconds();
        let cores = available_parallelism().map_or(1, usize::from);
        let cores = cores.min(self.missing.len());
        let wall = duration(Duration::from_secs_f64((seconds / cores as f64).ceil()));
        let cost = core_hours(seconds);
        format!("{cost} expected: {wall} on {}", counted(cores, "core"))
    }
}

/// Stages whose number of surfaces is not given, for programs.
pub fn growing(stages: &[GrowingStage]) -> Value {
    let stages = stages.iter().map(|stage| {
        json!({
            "name": stage.name,
            "surfaces": stage.surfaces,
            "at_most": stage.growth.at_most,
            "until": stage.growth.until.to_string(),
            "holds": stage.holds(),
        })
    });
    stages.collect()
}

/// Time of one core, with two digits that mean something.
pub fn core_hours(seconds: f64) -> String {
    let hours = seconds / 3600.0;
    let decimals = (1.0 - hours.max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{hours:.decimals$} core-hours")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn core_hours_have_two_digits() {
        let told = |hours: f64| core_hours(3600.0 * hours);
        assert_eq!(told(0.0), "0.000000 core-hours");
        assert_eq!(told(0.000_123), "0.00012 core-hours");
        assert_eq!(told(0.27), "0.27 core-hours");
        assert_eq!(told(3.07), "3.1 core-hours");
        assert_eq!(told(412.0), "412 core-hours");
    }
}
