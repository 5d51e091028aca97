//! Sets of causes, each kept once: a hundred thousand tasks share a handful of them.

use std::collections::HashMap;

use super::cause::Cause;

/// The set of no causes.
pub const EMPTY: usize = 0;

/// Every set so far, by number.
#[derive(Debug)]
pub struct Sets {
    causes: Vec<Cause>,
    /// Positions of causes, ascending.
    sets: Vec<Vec<usize>>,
    known_causes: HashMap<Cause, usize>,
    known: HashMap<Vec<usize>, usize>,
    unions: HashMap<(usize, usize), usize>,
}

impl Default for Sets {
    fn default() -> Sets {
        Sets {
            causes: Vec::new(),
            sets: vec![Vec::new()],
            known_causes: HashMap::new(),
            known: HashMap::from([(Vec::new(), EMPTY)]),
            unions: HashMap::new(),
        }
    }
}

impl Sets {
    /// The set of one cause.
    pub fn one(&mut self, cause: Cause) -> usize {
        let next = self.causes.len();
        let position = *self.known_causes.entry(cause.clone()).or_insert(next);
        if position == next {
            self.causes.push(cause);
        }
        self.number(vec![position])
    }

    /// The set of several causes.
    pub fn all(&mut self, causes: impl IntoIterator<Item = Cause>) -> usize {
        causes.into_iter().fold(EMPTY, |set, cause| {
            let one = self.one(cause);
            self.union(set, one)
        })
    }

    /// The causes of either set.
    pub fn union(&mut self, one: usize, other: usize) -> usize {
        match (one.min(other), one.max(other)) {
            (EMPTY, set) => set,
            (same, set) if same == set => set,
            pair => match self.unions.get(&pair) {
                Some(&known) => known,
                None => {
                    let mut both = [&self.sets[pair.0][..], &self.sets[pair.1]].concat();
                    both.sort_unstable();
                    both.dedup();
                    let number = self.number(both);
                    self.unions.insert(pair, number);
                    number
                }
            },
        }
    }

    /// What is in a set, in the order in which it was met.
    pub fn causes(&self, set: usize) -> Vec<Cause> {
        self.sets[set].iter().map(|&cause| self.causes[cause].clone()).collect()
    }

    fn number(&mut self, set: Vec<usize>) -> usize {
        let next = self.sets.len();
        let number = *self.known.entry(set.clone()).or_insert(next);
        if number == next {
            self.sets.push(set);
        }
        number
    }
}
