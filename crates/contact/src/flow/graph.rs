//! A graph of resistors and its matrix: the currents that leave the nodes under given potentials.
//!
//! One node of each channel is linked to the ground, of potential zero, so that the matrix is
//! regular: no current flows there once those that are given sum to zero. Potentials and currents
//! are pairs, one of the flow along x and one of that along y: both are found at once, since the
//! matrix is what takes time.
//!
//! [`Factors`] solves a small graph directly, [`Search`] has the conjugate directions of a large
//! one.

/// One number of the flow along x, and one of that along y.
pub type Pair = [f64; 2];

/// Nodes and the conductances between them; each link is kept by the lower number of its ends.
pub struct Graph {
    /// Where the links of each node begin, and last where all end.
    starts: Vec<u32>,
    /// The higher number of each link.
    others: Vec<u32>,
    conductances: Vec<f64>,
    /// Nodes that are linked to the ground, and how well.
    grounds: Vec<(u32, f64)>,
    /// One over the sum of a node's conductances; zero of a node without links.
    inverse_diagonal: Vec<f64>,
}

impl Graph {
    /// So many nodes, their links to the ground, and those between them, which are told twice
    /// alike; links of a node to itself carry nothing that its potential decides, and are left out.
    pub fn of<I>(count: usize, grounds: Vec<(u32, f64)>, links: impl Fn() -> I) -> Graph
    where
        I: Iterator<Item = (u32, u32, f64)>,
    {
        let links = || links().filter(|(one, other, _)| one != other);
        let mut starts = vec![0_u32; count + 1];
        let mut diagonal = vec![0.0; count];
        for &(node, conductance) in &grounds {
            diagonal[node as usize] += conductance;
        }
        for (one, other, conductance) in links() {
            starts[one.min(other) as usize + 1] += 1;
            diagonal[one as usize] += conductance;
            diagonal[other as usize] += conductance;
        }
        for node in 0..count {
            starts[node + 1] += starts[node];
        }
        let all = starts[count] as usize;
        let (mut others, mut conductances) = (vec![0; all], vec![0.0; all]);
        let mut filled = starts.clone();
        for (one, other, conductance) in links() {
            let place = &mut filled[one.min(other) as usize];
            others[*place as usize] = one.max(other);
            conductances[*place as usize] = conductance;
            *place += 1;
        }
        let inverse = |sum: f64| if sum > 0.0 { 1.0 / sum } else { 0.0 };
        Graph {
            starts,
            others,
            conductances,
            grounds,
            inverse_diagonal: diagonal.into_iter().map(inverse).collect(),
        }
    }

    /// How many nodes there are.
    pub fn count(&self) -> usize {
        self.inverse_diagonal.len()
    }

    /// The links of a node to those of higher numbers.
    pub fn above(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let [start, end] = [node, node + 1].map(|node| self.starts[node] as usize);
        let others = self.others[start..end].iter().map(|other| *other as usize);
        others.zip(self.conductances[start..end].iter().copied())
    }

    /// The sum of the conductances of each node, zero where there is none.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> {
        let inverse = self.inverse_diagonal.iter();
        inverse.map(|&inverse| if inverse > 0.0 { 1.0 / inverse } else { 0.0 })
    }

    /// Links to the ground, by the node.
    pub fn grounds(&self) -> &[(u32, f64)] {
        &self.grounds
    }

    /// Every link: both ends, the lower one first, and its conductance.
    pub fn links(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.count()).flat_map(|node| {
            let above = self.above(node);
            above.map(move |(other, conductance)| (node, other, conductance))
        })
    }

    /// The currents that leave the nodes under these potentials.
    pub fn currents(&self, potentials: &[Pair], currents: &mut [Pair]) {
        currents.fill([0.0; 2]);
        self.take_off(potentials, currents);
        for current in currents {
            *current = current.map(|current| -current);
        }
    }

    /// Takes those currents off others.
    pub fn take_off(&self, potentials: &[Pair], left: &mut [Pair]) {
        for node in 0..self.count() {
            let [x, y] = potentials[node];
            let mut own = left[node];
            for (other, conductance) in self.above(node) {
                let current = [
                    conductance * (x - potentials[other][0]),
                    conductance * (y - potentials[other][1]),
                ];
                own = [own[0] - current[0], own[1] - current[1]];
                let left = &mut left[other];
                *left = [left[0] + current[0], left[1] + current[1]];
            }
            left[node] = own;
        }
        for &(node, conductance) in &self.grounds {
            let node = node as usize;
            left[node] = [0, 1].map(|of| left[node][of] - conductance * potentials[node][of]);
        }
    }

    /// Solves for the lower triangle of the matrix: potentials after one sweep of Gauss and Seidel,
    /// from none. `work` is overwritten.
    pub fn sweep_up(&self, currents: &[Pair], work: &mut [Pair], potentials: &mut [Pair]) {
        work.copy_from_slice(currents);
        for node in 0..self.count() {
            let potential = work[node].map(|current| current * self.inverse_diagonal[node]);
            potentials[node] = potential;
            for (other, conductance) in self.above(node) {
                let work = &mut work[other];
                *work = [0, 1].map(|of| work[of] + conductance * potential[of]);
            }
        }
    }

    /// What [`Graph::sweep_up`] leaves at a node of the currents that it was given.
    pub fn left_by_sweep(&self, node: usize, potentials: &[Pair]) -> Pair {
        self.with_inflow(node, [0.0; 2], potentials)
    }

    /// Adds to the potentials what the upper triangle of the matrix makes of the currents that are
    /// left, which are overwritten: the same sweep downwards.
    pub fn sweep_down(&self, left: &mut [Pair], potentials: &mut [Pair]) {
        for node in (0..self.count()).rev() {
            let inflow = self.with_inflow(node, left[node], left);
            let change = inflow.map(|current| current * self.inverse_diagonal[node]);
            left[node] = change;
            let potential = &mut potentials[node];
            *potential = [0, 1].map(|of| potential[of] + change[of]);
        }
    }

    /// So much current, and what the potentials of the nodes above send to a node.
    fn with_inflow(&self, node: usize, so_much: Pair, potentials: &[Pair]) -> Pair {
        self.above(node).fold(so_much, |sum, (other, conductance)| {
            [0, 1].map(|of| sum[of] + conductance * potentials[other][of])
        })
    }
}

/// L, row by row below its diagonal of ones, with 1/D on the diagonal.
pub struct Factors {
    count: usize,
    rows: Vec<f64>,
}

impl Factors {
    /// Those of a graph, in which every channel is linked to the ground.
    pub fn of(graph: &Graph) -> Factors {
        let count = graph.count();
        let mut rows = vec![0.0; count * count];
        for (node, sum) in graph.diagonal().enumerate() {
            rows[node * count + node] = sum;
        }
        for (low, high, conductance) in graph.links() {
            rows[high * count + low] -= conductance;
        }
        for row in 0..count {
            // So far L D stands before the diagonal of the rows above, and A in this one.
            for column in 0..row {
                let (above, own) = rows.split_at_mut(row * count);
                let other = &above[column * count..column * count + column];
                let product: f64 = own.iter().zip(other).map(|(own, other)| own * other).sum();
                own[column] -= product;
            }
            let mut pivot = rows[row * count + row];
            for column in 0..row {
                let inverse = rows[column * count + column];
                let entry = &mut rows[row * count + column];
                let scaled = *entry * inverse;
                pivot -= *entry * scaled;
                *entry = scaled;
            }
            rows[row * count + row] = if pivot > 0.0 { 1.0 / pivot } else { 0.0 };
        }
        Factors { count, rows }
    }

    /// The potentials under which these currents leave the nodes.
    pub fn solve(&self, currents: &[Pair], potentials: &mut [Pair]) {
        potentials.copy_from_slice(currents);
        let row = |node: usize| &self.rows[node * self.count..];
        for node in 0..self.count {
            let before = row(node)[..node].iter().zip(&potentials[..node]);
            let sum = before.fold(potentials[node], |sum, (entry, potential)| {
                [0, 1].map(|of| sum[of] - entry * potential[of])
            });
            potentials[node] = sum;
        }
        for node in (0..self.count).rev() {
            let inverse = row(node)[node];
            potentials[node] = potentials[node].map(|potential| potential * inverse);
        }
        for node in (0..self.count).rev() {
            let (before, own) = potentials.split_at_mut(node);
            for (potential, entry) in before.iter_mut().zip(row(node)) {
                *potential = [0, 1].map(|of| potential[of] - entry * own[0][of]);
            }
        }
    }
}

/// The directions of the last step, and the currents that they make.
pub struct Search {
    pub direction: Vec<Pair>,
    pub image: Vec<Pair>,
    /// Direction times image; zero before the first step.
    curvature: Pair,
}

/// How far a search goes, and what it gains: the square of what is taken off the error, in the norm
/// of the matrix.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn potentials_make_the_currents_that_were_given() {
        let links = [(0, 1, 1.0), (1, 2, 1e-6), (2, 3, 5.0), (0, 3, 1e-9), (1, 3, 0.3)];
        let graph = Graph::of(4, vec![(2, 2.0)], || links.into_iter());
        let currents = [[1.0, 0.0], [-2.0, 0.5], [0.0, 0.25], [1.0, -0.75]];
        let mut potentials = [[0.0; 2]; 4];
        Factors::of(&graph).solve(&currents, &mut potentials);
        let mut found = [[0.0; 2]; 4];
        graph.currents(&potentials, &mut found);
        for (found, given) in found.iter().zip(&currents) {
            assert!((found[0] - given[0]).abs() < 1e-12 && (found[1] - given[1]).abs() < 1e-12);
        }
    }
}
