//! Conjugate directions of a graph's matrix, whatever the preconditioner made of the step before.

use super::graph::{Graph, Pair};

/// The directions of the last step, and the currents that they make.
pub struct Search {
    pub direction: Vec<Pair>,
    pub image: Vec<Pair>,
    /// Direction times image; zero before the first step.
    curvature: Pair,
}

/// How far a search goes, and what it gains: the square of what is taken off the error, in the norm of
/// the matrix.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub length: Pair,
    pub gain: Pair,
}

impl Search {
    /// None yet, among so many nodes.
    pub fn new(count: usize) -> Search {
        Search {
            direction: vec![[0.0; 2]; count],
            image: vec![[0.0; 2]; count],
            curvature: [0.0; 2],
        }
    }

    /// Forgets the last step.
    pub fn restart(&mut self) {
        self.curvature = [0.0; 2];
    }

    /// Turns to corrections, made conjugate to the last directions, and tells how far to go for the
    /// currents that are left. The preconditioner may be another in each step (flexible conjugate
    /// gradients).
    pub fn turn(&mut self, graph: &Graph, correction: &[Pair], left: &[Pair]) -> Step {
        let common = dot(correction, &self.image);
        let share = [0, 1].map(|of| ratio(common[of], self.curvature[of]));
        for (direction, correction) in self.direction.iter_mut().zip(correction) {
            *direction = [0, 1].map(|of| correction[of] - share[of] * direction[of]);
        }
        graph.currents(&self.direction, &mut self.image);
        self.curvature = dot(&self.direction, &self.image);
        let along = dot(&self.direction, left);
        let length = [0, 1].map(|of| ratio(along[of], self.curvature[of]));
        Step { length, gain: [0, 1].map(|of| length[of] * length[of] * self.curvature[of]) }
    }
}

/// Adds so much of others to values.
pub fn add(values: &mut [Pair], factor: Pair, others: &[Pair]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value = [0, 1].map(|of| value[of] + factor[of] * other[of]);
    }
}

/// Zero where there is nothing to divide by.
fn ratio(of: f64, to: f64) -> f64 {
    if to > 0.0 { of / to } else { 0.0 }
}

/// The sums of products, in order.
fn dot(one: &[Pair], other: &[Pair]) -> Pair {
    let pairs = one.iter().zip(other);
    pairs.fold([0.0; 2], |sum, (one, other)| [0, 1].map(|of| sum[of] + one[of] * other[of]))
}
