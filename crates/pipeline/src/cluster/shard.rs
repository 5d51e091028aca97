//! Shards: parts of a study's surfaces, each of which is computed by one process.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::plan::Plan;
use asperity_tables::key::TaskKey;

/// Maximum number of parts of a study.
const MAX_COUNT: u32 = 1_000_000;

/// The I-th of N parts of a study's surfaces, 1 ≤ I ≤ N.
///
/// A surface belongs to part I = 1 + ⌊N x / 2⁶⁴⌋, where x is the number in the first eight bytes of
/// its key, most significant byte first. Each surface is in exactly one part, which depends only on
/// the key and on N. Parts 2I − 1 and 2I of 2N together are part I of N.
///
/// ```
/// use asperity_pipeline::cluster::shard::Shard;
///
/// let shard: Shard = "3/16".parse()?;
/// assert_eq!(shard.to_string(), "3/16");
/// assert!("17/16".parse::<Shard>().is_err());
/// # Ok::<(), asperity_pipeline::cluster::shard::InvalidShard>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    number: u32,
    count: u32,
}

/// Error of parsing a text that is not a valid shard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{word}` is not a shard: write `I/N`, such as `3/16`, with I from 1 to N and N at most \
     {MAX_COUNT}"
)]
pub struct InvalidShard {
    word: String,
}

impl Shard {
    /// Shard that contains all surfaces of a study.
    pub const WHOLE: Shard = Shard { number: 1, count: 1 };

    /// Creates part `number` of `count`, counted from 1, or returns `None` if there is no such
    /// part.
    pub fn new(number: u32, count: u32) -> Option<Shard> {
        let is_one = (1..=count).contains(&number) && count <= MAX_COUNT;
        is_one.then_some(Shard { number, count })
    }

    /// Returns the shard that contains a surface if there are `count` shards.
    pub fn containing(surface: TaskKey, count: u32) -> Shard {
        let index = (u128::from(surface.first_word()) * u128::from(count)) >> 64;
        Shard { number: 1 + index as u32, count }
    }

    pub fn number(self) -> u32 {
        self.number
    }

    pub fn count(self) -> u32 {
        self.count
    }

    /// Returns the tasks of `among` that depend on a single surface of this shard, in the order of
    /// `among`.
    pub fn tasks(self, plan: &Plan, among: &[usize]) -> Vec<usize> {
        let surfaces = plan.surfaces();
        let is_in = |surface: TaskKey| Shard::containing(surface, self.count) == self;
        let own = among.iter().copied();
        own.filter(|&task| surfaces[task].is_some_and(is_in)).collect()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.number, self.count)
    }
}

impl FromStr for Shard {
    type Err = InvalidShard;

    fn from_str(word: &str) -> Result<Shard, InvalidShard> {
        let shard = word.split_once('/').and_then(|(number, count)| {
            let whole = |digits: &str| digits.trim().parse().ok();
            Shard::new(whole(number)?, whole(count)?)
        });
        shard.ok_or_else(|| InvalidShard { word: word.to_owned() })
    }
}

impl Serialize for Shard {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Shard {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Shard, D::Error> {
        let word = String::deserialize(deserializer)?;
        word.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::study::Study;
    use asperity_stages::Kind;
    use asperity_tables::key::Digest;

    fn key(number: u64) -> TaskKey {
        TaskKey::new("generate", 1, Digest::from_params(&number), &[])
    }

    fn plan(heights: &str) -> Plan {
        let manifest = format!(
            "
            [study]
            name = \"study\"
            [stage.surfaces]
            kind = \"generate\"
            nodes = 16
            hurst = 0.8
            k_lower = 1
            k_upper = [3, 4]
            realizations = 20
            heights = \"{heights}\"
            [stage.light]
            kind = \"solve\"
            from = \"surfaces\"
            loads = [0.01]
            [stage.heavy]
            kind = \"solve\"
            from = \"surfaces\"
            loads = [0.1]
            [stage.area]
            kind = \"measure\"
            from = [\"light\", \"heavy\"]
            [stage.heights]
            kind = \"measure\"
            from = \"surfaces\"
            pool = true
            [stage.law]
            kind = \"fit\"
            from = \"area\"
            law = \"contact-evolution\"
            kappa = 2.5
            [stage.curves]
            kind = \"aggregate\"
            from = \"area\"
            over = [\"area_fraction\"]
            statistics = [\"mean\"]
            "
        );
        Plan::new(&Study::parse(&manifest, "study.toml", Path::new("")).unwrap())
    }

    #[test]
    fn a_surface_is_in_one_part_however_many_there_are() {
        for count in (1..40).chain([100, 1000, 1001, MAX_COUNT]) {
            for number in 0..200 {
                let part = Shard::containing(key(number), count);
                assert_eq!(Shard::new(part.number, count), Some(part));
            }
        }
    }

    #[test]
    fn twice_as_many_parts_split_each_in_two() {
        for number in 0..200 {
            let [part, half] = [16, 32].map(|count| Shard::containing(key(number), count).number);
            assert_eq!(half.div_ceil(2), part);
        }
    }

    #[test]
    fn parts_are_about_equal() {
        let mut sizes = [0; 8];
        (0..8000)
            .for_each(|number| sizes[Shard::containing(key(number), 8).number as usize - 1] += 1);
        assert!(sizes.iter().all(|size| (900..1100).contains(size)), "{sizes:?}");
    }

    #[test]
    fn shards_are_disjoint_and_together_all_that_hangs_on_one_surface() {
        let plan = plan("keep");
        let all: Vec<usize> = (0..plan.tasks.len()).collect();
        let single = [Kind::Generate, Kind::Solve, Kind::Measure];
        let is_of_one = |task: &usize| {
            let recipe = &plan.tasks[*task].recipe;
            single.contains(&recipe.kind()) && !recipe.pools_surfaces()
        };
        let expected: Vec<usize> = all.iter().copied().filter(is_of_one).collect();
        assert_eq!(expected.len(), 5 * 40);
        for count in (1..=60).chain([1000, MAX_COUNT]) {
            let shards = (1..=count.min(60)).map(|number| Shard::new(number, count).unwrap());
            let mut union: Vec<usize> = shards.flat_map(|shard| shard.tasks(&plan, &all)).collect();
            union.sort_unstable();
            if count <= 60 {
                assert_eq!(union, expected, "{count} shards");
            }
        }
    }

    #[test]
    fn a_surface_is_in_the_same_part_whether_its_heights_are_kept() {
        let part = |plan: &Plan| {
            let all: Vec<usize> = (0..plan.tasks.len()).collect();
            Shard::new(2, 3).unwrap().tasks(plan, &all)
        };
        let (kept, redrawn) = (plan("keep"), plan("redraw"));
        assert_ne!(kept.tasks[0].key, redrawn.tasks[0].key);
        assert_eq!(part(&kept), part(&redrawn));
    }

    #[test]
    fn words_that_are_no_shards_are_refused() {
        for word in ["", "1", "0/4", "5/4", "-1/4", "1/0", "a/b", "1/2/3", "1/1000001"] {
            let refused = word.parse::<Shard>().unwrap_err().to_string();
            assert!(refused.starts_with(&format!("`{word}` is not a shard")), "{refused}");
        }
    }
}
