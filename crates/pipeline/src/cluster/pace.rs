//! How fast work is done where it is done: seconds of one core for each pair of transforms that was
//! expected, by processor model and mesh.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Work on one mesh: what was expected, and what it took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// Nodes along x and y.
    pub nodes: [usize; 2],
    /// Pairs of transforms that the tasks were expected to take.
    pub pairs: f64,
    /// Seconds of one core that they took.
    pub seconds: f64,
}

/// Work of many tasks, added up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Paces(BTreeMap<[usize; 2], (f64, f64)>);

impl Paces {
    /// Adds work. What was expected to take no transforms tells no pace.
    pub fn add(&mut self, Pace { nodes, pairs, seconds }: Pace) {
        if pairs > 0.0 {
            let sums = self.0.entry(nodes).or_default();
            sums.0 += pairs;
            sums.1 += seconds;
        }
    }

    /// The sums, by mesh.
    pub fn all(&self) -> Vec<Pace> {
        let sums = self.0.iter();
        sums.map(|(&nodes, &(pairs, seconds))| Pace { nodes, pairs, seconds }).collect()
    }

    /// Seconds of one core for each expected pair, by mesh.
    pub fn seconds_per_pair(&self) -> BTreeMap<[usize; 2], f64> {
        let sums = self.0.iter();
        sums.map(|(&nodes, &(pairs, seconds))| (nodes, seconds / pairs)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pace_of_several_is_all_seconds_over_all_pairs() {
        let mut paces = Paces::default();
        for (pairs, seconds) in [(100.0, 1.0), (300.0, 7.0), (0.0, 5.0)] {
            let nodes = [64, 32];
            paces.add(Pace { nodes, pairs, seconds });
        }
        assert_eq!(paces.seconds_per_pair(), BTreeMap::from([([64, 32], 0.02)]));
    }
}
