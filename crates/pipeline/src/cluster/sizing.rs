//! Number of elements of a job array for a study, with their expected time and memory.

use std::collections::{BTreeMap, BTreeSet};

use bytesize::ByteSize;

use super::settings::Settings;
use super::shard::Shard;
use crate::forecast::{CostModel, memory};
use crate::plan::Plan;
use asperity_tables::key::KeyMap;

/// Default target duration of an array element, in hours.
pub const DEFAULT_HOURS: f64 = 1.0;

/// Ratio of the time limit to the expected time of an array element. Forecasts can be wrong by a
/// quarter, and shared nodes are slower.
const TIME_MARGIN: f64 = 2.0;

/// Lower bound of the time limit of an array element in minutes. Programs start slowly on slow file
/// systems.
const MIN_MINUTES: f64 = 10.0;

/// Lower bound of the time limit of the last job in minutes. This job also computes the missing
/// tasks of the array if these are few.
const MIN_FINISH_MINUTES: f64 = 60.0;

/// Array elements of a submission, with their expected cost and resources.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizing {
    /// Number of parts into which the study's surfaces are split.
    pub elements: u32,
    /// Expected hours of each array element that has missing tasks, by the number of the element.
    pub hours: BTreeMap<u32, f64>,
    /// Expected core-hours of all array elements.
    pub core_hours: f64,
    /// Expected core-hours of the last job, which computes the tasks that read several surfaces.
    pub core_hours_after: f64,
    pub cores: u32,
    pub memory: ByteSize,
    /// Time limit of an array element, in minutes.
    pub minutes: u32,
    /// Time limit of the last job, in minutes.
    pub minutes_after: u32,
}

impl Sizing {
    /// Plans an array of at most `largest_array` array elements for the missing tasks.
    pub fn new(
        plan: &Plan,
        missing: &[usize],
        cost: &CostModel,
        settings: &Settings,
        largest_array: u32,
    ) -> Sizing {
        let cores = settings.cores.unwrap_or(1);
        let (by_surface, after) = seconds_by_surface(plan, missing, cost);
        let seconds: f64 = by_surface.values().sum();
        let per_element = 3600.0 * settings.per_element.unwrap_or(DEFAULT_HOURS);
        let allowed = largest_array.min(settings.at_most.unwrap_or(u32::MAX));
        let most = allowed.min(u32::try_from(by_surface.len()).unwrap_or(u32::MAX));
        let wanted = (seconds / f64::from(cores) / per_element).ceil() as u32;
        let elements = wanted.clamp(1, most.max(1));
        let hours = hours_of_shards(&by_surface, elements, cores);
        let longest = hours.values().copied().fold(0.0, f64::max);
        let given = settings.time_limit.map(|hours| 60.0 * hours);
        let limit = given.unwrap_or(MIN_MINUTES.max(60.0 * TIME_MARGIN * longest));
        let minutes = limit.ceil().max(1.0) as u32;
        let hours_after = after / 3600.0 / f64::from(cores);
        let minutes_after = match settings.time_limit {
            Some(_) => minutes,
            None => {
                minutes.max((MIN_FINISH_MINUTES + 60.0 * TIME_MARGIN * hours_after).ceil() as u32)
            }
        };
        Sizing {
            elements,
            hours,
            core_hours: seconds / 3600.0,
            core_hours_after: after / 3600.0,
            cores,
            memory: settings.memory.unwrap_or_else(|| memory_for(plan, missing, cores)),
            minutes,
            minutes_after,
        }
    }

    /// Returns the expected hours of the longest array element.
    pub fn longest(&self) -> f64 {
        self.hours.values().copied().fold(0.0, f64::max)
    }

    /// Returns the numbers of the array elements that have missing tasks, in the format of
    /// `sbatch --array`: `1-4,7`.
    pub fn array(&self) -> String {
        ranges(self.hours.keys().copied())
    }
}

/// Returns the numbers of the shards that contain the given tasks if there are `elements` shards,
/// and the expected core-seconds of these tasks in total.
pub fn shards_of(plan: &Plan, tasks: &[usize], cost: &CostModel, elements: u32) -> (Vec<u32>, f64) {
    let (by_surface, _) = seconds_by_surface(plan, tasks, cost);
    let surfaces = by_surface.keys();
    let shards: BTreeSet<u32> =
        surfaces.map(|&surface| Shard::containing(surface, elements).number()).collect();
    (shards.into_iter().collect(), by_surface.values().sum())
}

/// Formats whole numbers in ascending order as ranges: `1-4,7`.
pub fn ranges(numbers: impl IntoIterator<Item = u32>) -> String {
    let mut ranges: Vec<(u32, u32)> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let words = ranges.iter().map(|(first, last)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    });
    words.collect::<Vec<_>>().join(",")
}

/// Estimates the core-seconds of the missing tasks. Returns them per surface, and in total for the
/// tasks that read several surfaces.
fn seconds_by_surface(plan: &Plan, missing: &[usize], cost: &CostModel) -> (KeyMap<f64>, f64) {
    let (surfaces, mut after) = (plan.surfaces(), 0.0);
    let mut by_surface: KeyMap<f64> = KeyMap::default();
    for &task in missing {
        let seconds = cost.seconds(plan, task);
        match surfaces[task] {
            Some(surface) => *by_surface.entry(surface).or_default() += seconds,
            None => after += seconds,
        }
    }
    (by_surface, after)
}

fn hours_of_shards(by_surface: &KeyMap<f64>, elements: u32, cores: u32) -> BTreeMap<u32, f64> {
    #[derive(Default)]
    struct Load {
        seconds: f64,
        longest: f64,
    }
    let mut loads: BTreeMap<u32, Load> = BTreeMap::new();
    for (&surface, &seconds) in by_surface {
        let load = loads.entry(Shard::containing(surface, elements).number()).or_default();
        load.seconds += seconds;
        load.longest = load.longest.max(seconds);
    }
    // The tasks of one surface run one after the other.
    let hours = |load: Load| (load.seconds / f64::from(cores)).max(load.longest) / 3600.0;
    loads.into_iter().map(|(shard, load)| (shard, hours(load))).collect()
}

/// Returns the memory in whole GiB that suffices if every core computes the largest task.
fn memory_for(plan: &Plan, missing: &[usize], cores: u32) -> ByteSize {
    let largest = memory::of_largest(plan, missing).0;
    let bytes = memory::PROGRAM.0 + largest.saturating_mul(u64::from(cores));
    // The allocator reserves up to an eighth more.
    ByteSize::gib((bytes / 8 * 9).div_ceil(1 << 30))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast::memory::tests::{all, plan};

    fn sizing(settings: Settings) -> Sizing {
        let plan = plan(64, "loads = [0.1, 0.2]");
        let plan = crate::plan::Plan::new(&many(&plan.study));
        let cost = CostModel::measured([([64; 2], 3.0)].into());
        Sizing::new(&plan, &all(&plan), &cost, &settings, 1000)
    }

    fn many(name: &str) -> crate::study::Study {
        let manifest = format!(
            "
            [study]
            name = \"{name}\"
            [stage.surfaces]
            kind = \"generate\"
            nodes = 64
            hurst = 0.8
            k_lower = 2
            k_upper = 8
            realizations = 200
            heights = \"redraw\"
            [stage.contact]
            kind = \"solve\"
            from = \"surfaces\"
            loads = [0.1, 0.2]
            [stage.area]
            kind = \"measure\"
            from = \"contact\"
            [stage.curves]
            kind = \"aggregate\"
            from = \"area\"
            over = [\"area_fraction\"]
            statistics = [\"mean\"]
            "
        );
        let folder = std::path::Path::new("");
        crate::study::Study::parse(&manifest, "study.toml", folder).unwrap()
    }

    #[test]
    fn elements_take_about_as_long_as_asked_for() {
        let half = sizing(Settings { per_element: Some(0.5), ..Settings::default() });
        let quarter = sizing(Settings { per_element: Some(0.25), ..Settings::default() });
        assert!(half.core_hours > 5.0, "{half:?}");
        assert_eq!(half.elements, (half.core_hours / 0.5).ceil() as u32);
        assert_eq!(quarter.elements, (half.core_hours / 0.25).ceil() as u32);
        let sum: f64 = half.hours.values().sum();
        assert!((sum / half.core_hours - 1.0).abs() < 1e-9);
        assert!(half.core_hours_after > 0.0);
        assert!(f64::from(half.minutes) >= 120.0 * half.longest());
    }

    #[test]
    fn there_are_no_more_elements_than_allowed_or_than_surfaces() {
        let elements = |settings| sizing(settings).elements;
        let short = || Settings { per_element: Some(1e-6), ..Settings::default() };
        assert_eq!(elements(short()), 200);
        assert_eq!(elements(Settings { at_most: Some(7), ..short() }), 7);
        assert_eq!(elements(Settings { per_element: Some(1e6), ..short() }), 1);
    }

    #[test]
    fn numbers_are_written_as_ranges() {
        assert_eq!(ranges([1, 2, 3, 5, 8, 9]), "1-3,5,8-9");
        assert_eq!(ranges([]), "");
    }
}
