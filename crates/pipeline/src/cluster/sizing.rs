//! How many elements a study is shared out into, and what each is expected to take.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use bytesize::ByteSize;

use super::settings::Settings;
use super::shard::Shard;
use crate::forecast::CostModel;
use crate::forecast::memory;
use crate::plan::Plan;
use asperity_tables::store::key::TaskKey;

/// Hours that an element is to take, unless somebody says otherwise.
pub const PER_ELEMENT: f64 = 1.0;

/// The time limit over what an element is expected to take: expectations are good to a quarter, and
/// nodes that are shared are slower.
const MARGIN: f64 = 2.0;

/// The shortest time limit, in minutes: a program starts, a file system is slow.
const SHORTEST: f64 = 10.0;

/// The shortest time limit of the job after them, in minutes: it computes what is little, too.
const SHORTEST_AFTER: f64 = 60.0;

/// Elements of one array, and what they are expected to take.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizing {
    /// Parts that the study's surfaces are shared out into.
    pub elements: u32,
    /// Those of them that have something to do, with the hours that each is expected to take.
    pub hours: BTreeMap<u32, f64>,
    /// Core-hours of all elements.
    pub core_hours: f64,
    /// Core-hours of what comes after them: fits, aggregates and all that reads several surfaces.
    pub core_hours_after: f64,
    pub cores: u32,
    pub memory: ByteSize,
    /// Minutes after which Slurm ends one.
    pub minutes: u32,
    /// Minutes after which it ends the job after them.
    pub minutes_after: u32,
}

impl Sizing {
    /// Of these missing tasks, in an array of at most so many elements.
    pub fn of(
        plan: &Plan,
        missing: &[usize],
        cost: &CostModel,
        settings: &Settings,
        largest_array: u32,
    ) -> Sizing {
        let cores = settings.cores.unwrap_or(1);
        let (by_surface, after) = seconds_by_surface(plan, missing, cost);
        let seconds: f64 = by_surface.values().sum();
        let per_element = 3600.0 * settings.per_element.unwrap_or(PER_ELEMENT);
        let most = largest_array.min(settings.at_most.unwrap_or(u32::MAX));
        let most = most.min(u32::try_from(by_surface.len()).unwrap_or(u32::MAX));
        let elements = (seconds / f64::from(cores) / per_element).ceil() as u32;
        let elements = elements.clamp(1, most.max(1));
        let hours = hours_of_shards(&by_surface, elements, cores);
        let longest = hours.values().copied().fold(0.0, f64::max);
        let limit = settings.time_limit.map(|hours| 60.0 * hours);
        let limit = limit.unwrap_or(SHORTEST.max(60.0 * MARGIN * longest));
        let minutes = limit.ceil().max(1.0) as u32;
        let hours_after = after / 3600.0 / f64::from(cores);
        let minutes_after = match settings.time_limit {
            Some(_) => minutes,
            None => minutes.max((SHORTEST_AFTER + 60.0 * MARGIN * hours_after).ceil() as u32),
        };
        Sizing {
            elements,
            hours,
            core_hours: seconds / 3600.0,
            core_hours_after: after / 3600.0,
            cores,
            memory: settings.memory.unwrap_or_else(|| enough(plan, missing, cores)),
            minutes,
            minutes_after,
        }
    }

    /// Hours that the longest element is expected to take.
    pub fn longest(&self) -> f64 {
        self.hours.values().copied().fold(0.0, f64::max)
    }

    /// The elements that have something to do, as `sbatch --array` takes them: `1-4,7`.
    pub fn array(&self) -> String {
        ranges(self.hours.keys().copied())
    }
}

/// The shards, of so many, that these tasks fall to, and the seconds of one core that they are
/// expected to take together.
pub fn shards_of(plan: &Plan, tasks: &[usize], cost: &CostModel, elements: u32) -> (Vec<u32>, f64) {
    let (by_surface, _) = seconds_by_surface(plan, tasks, cost);
    let surfaces = by_surface.keys();
    let shards = surfaces.map(|&surface| Shard::of(surface, elements).number());
    let shards: BTreeSet<u32> = shards.collect();
    (shards.into_iter().collect(), by_surface.values().sum())
}

/// Whole numbers in ascending order as ranges: `1-4,7`.
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

/// Seconds of one core that the missing tasks of each surface are expected to take, and all others
/// together.
fn seconds_by_surface(
    plan: &Plan,
    missing: &[usize],
    cost: &CostModel,
) -> (HashMap<TaskKey, f64>, f64) {
    let (surfaces, mut after) = (plan.surfaces(), 0.0);
    let mut by_surface: HashMap<TaskKey, f64> = HashMap::new();
    for &task in missing {
        let seconds = cost.seconds(&plan.tasks[task]);
        match surfaces[task] {
            Some(surface) => *by_surface.entry(surface).or_default() += seconds,
            None => after += seconds,
        }
    }
    (by_surface, after)
}

fn hours_of_shards(
    by_surface: &HashMap<TaskKey, f64>,
    elements: u32,
    cores: u32,
) -> BTreeMap<u32, f64> {
    #[derive(Default)]
    struct Load {
        seconds: f64,
        longest: f64,
    }
    let mut loads: BTreeMap<u32, Load> = BTreeMap::new();
    for (&surface, &seconds) in by_surface {
        let load = loads.entry(Shard::of(surface, elements).number()).or_default();
        load.seconds += seconds;
        load.longest = load.longest.max(seconds);
    }
    // No surface is faster than its own tasks, one after the other.
    let hours = |load: Load| (load.seconds / f64::from(cores)).max(load.longest) / 3600.0;
    let loads = loads.into_iter();
    loads.map(|(shard, load)| (shard, hours(load))).collect()
}

/// Memory for the largest task on each core, in whole gibibytes.
fn enough(plan: &Plan, missing: &[usize], cores: u32) -> ByteSize {
    let largest = memory::of_largest(plan, missing).0;
    let bytes = memory::PROGRAM.0 + largest.saturating_mul(u64::from(cores));
    // An eighth is for what the allocator keeps.
    ByteSize::gib((bytes / 8 * 9).div_ceil(1 << 30))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast::memory::tests::{all, plan};

    fn sizing(settings: Settings) -> Sizing {
        let plan = plan(64, "loads = [0.1, 0.2]");
        let plan = crate::plan::Plan::of(&many(&plan.study));
        let cost = CostModel::measured([([64; 2], 3.0)].into());
        Sizing::of(&plan, &all(&plan), &cost, &settings, 1000)
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
        crate::study::Study::parse(&manifest, "study.toml", folder, crate::study::no_claims)
            .unwrap()
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
