//! Graph of resistors, and the matrix that maps its potentials to currents.
//!
//! One node of each channel is linked to the ground (potential zero), so that the matrix is
//! regular. No current flows to the ground if the given currents sum to zero. Access to the matrix
//! dominates the time, so the flows along x and y are solved together, as pairs of values.
//!
//! [`Factors`] solves a small graph directly. [`ConjugateDirection`] computes the steps of the
//! conjugate-gradient method on a large graph.

/// Values in the flow along x and in the flow along y.
pub type Pair = [f64; 2];

/// Graph of resistors: nodes, links between them, and links to the ground. Each link is stored at
/// its end of lower index.
pub struct Graph {
    /// Index of the first link of each node, followed by the number of links.
    starts: Vec<u32>,
    /// For each link, its end of higher index.
    others: Vec<u32>,
    conductances: Vec<f64>,
    /// Nodes that are linked to the ground, each with its conductance to the ground.
    grounds: Vec<(u32, f64)>,
    /// Inverse of the sum of the conductances at each node; zero for a node without links.
    inverse_diagonal: Vec<f64>,
}

impl Graph {
    /// Creates a graph of `count` nodes.
    ///
    /// `grounds` contains nodes that are linked to the ground, with the conductance of this link.
    /// `links` returns the two ends and the conductance of each link between nodes. It is called
    /// twice and must return the same links. Links of a node to itself are omitted, because they do
    /// not affect potentials.
    pub fn new<I>(count: usize, grounds: Vec<(u32, f64)>, links: impl Fn() -> I) -> Graph
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
            let index = &mut filled[one.min(other) as usize];
            others[*index as usize] = one.max(other);
            conductances[*index as usize] = conductance;
            *index += 1;
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

    pub fn count(&self) -> usize {
        self.inverse_diagonal.len()
    }

    /// Iterates over the links of `node` to nodes of higher index, as pairs of node and
    /// conductance.
    pub fn above(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let [start, end] = [node, node + 1].map(|node| self.starts[node] as usize);
        let others = self.others[start..end].iter().map(|other| *other as usize);
        others.zip(self.conductances[start..end].iter().copied())
    }

    /// Iterates over the diagonal of the matrix: the sum of the conductances at each node.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> {
        let inverse = self.inverse_diagonal.iter();
        inverse.map(|&inverse| if inverse > 0.0 { 1.0 / inverse } else { 0.0 })
    }

    /// Returns the nodes that are linked to the ground, each with its conductance to the ground.
    pub fn grounds(&self) -> &[(u32, f64)] {
        &self.grounds
    }

    /// Iterates over the links, as triples of lower end, higher end and conductance.
    pub fn links(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.count()).flat_map(|node| {
            let above = self.above(node);
            above.map(move |(other, conductance)| (node, other, conductance))
        })
    }

    /// Writes the current that leaves each node under the given potentials to `currents`.
    pub fn currents(&self, potentials: &[Pair], currents: &mut [Pair]) {
        currents.fill([0.0; 2]);
        self.subtract_currents(potentials, currents);
        for current in currents {
            *current = current.map(|current| -current);
        }
    }

    /// Subtracts the current that leaves each node under the given potentials from `residual`.
    pub fn subtract_currents(&self, potentials: &[Pair], residual: &mut [Pair]) {
        for node in 0..self.count() {
            let [x, y] = potentials[node];
            let mut own = residual[node];
            for (other, conductance) in self.above(node) {
                let current = [
                    conductance * (x - potentials[other][0]),
                    conductance * (y - potentials[other][1]),
                ];
                own = [own[0] - current[0], own[1] - current[1]];
                let residual = &mut residual[other];
                *residual = [residual[0] + current[0], residual[1] + current[1]];
            }
            residual[node] = own;
        }
        for &(node, conductance) in &self.grounds {
            let node = node as usize;
            residual[node] =
                [0, 1].map(|axis| residual[node][axis] - conductance * potentials[node][axis]);
        }
    }

    /// Writes the result of one forward Gauss–Seidel sweep from zero potentials to `potentials`.
    /// The content of `work` is lost.
    pub fn forward_sweep(&self, currents: &[Pair], work: &mut [Pair], potentials: &mut [Pair]) {
        work.copy_from_slice(currents);
        for node in 0..self.count() {
            let potential = work[node].map(|current| current * self.inverse_diagonal[node]);
            potentials[node] = potential;
            for (other, conductance) in self.above(node) {
                let work = &mut work[other];
                *work = [0, 1].map(|axis| work[axis] + conductance * potential[axis]);
            }
        }
    }

    /// Returns the residual current of a node, where `potentials` is the result of
    /// [`Graph::forward_sweep`].
    pub fn residual_after_sweep(&self, node: usize, potentials: &[Pair]) -> Pair {
        self.with_inflow(node, [0.0; 2], potentials)
    }

    /// Performs one backward Gauss–Seidel sweep: adds its changes to `potentials`.
    ///
    /// `residual` contains the residual currents under `potentials` before the sweep. Its content
    /// is lost.
    pub fn backward_sweep(&self, residual: &mut [Pair], potentials: &mut [Pair]) {
        for node in (0..self.count()).rev() {
            let inflow = self.with_inflow(node, residual[node], residual);
            let change = inflow.map(|current| current * self.inverse_diagonal[node]);
            residual[node] = change;
            let potential = &mut potentials[node];
            *potential = [0, 1].map(|axis| potential[axis] + change[axis]);
        }
    }

    /// Returns `current` + Σ k φ over the neighbours of `node` with higher indices, with their
    /// potentials φ and the conductances k of the links.
    fn with_inflow(&self, node: usize, current: Pair, potentials: &[Pair]) -> Pair {
        self.above(node).fold(current, |sum, (other, conductance)| {
            [0, 1].map(|axis| sum[axis] + conductance * potentials[other][axis])
        })
    }
}

/// Factorisation L D Lᵀ of the matrix of a small graph.
///
/// Rows contain L below the diagonal and 1/D on the diagonal.
pub struct Factors {
    count: usize,
    rows: Vec<f64>,
}

impl Factors {
    /// Factorises the matrix of a graph in which every channel is linked to the ground.
    pub fn new(graph: &Graph) -> Factors {
        let count = graph.count();
        let mut rows = vec![0.0; count * count];
        for (node, sum) in graph.diagonal().enumerate() {
            rows[node * count + node] = sum;
        }
        for (low, high, conductance) in graph.links() {
            rows[high * count + low] -= conductance;
        }
        for row in 0..count {
            // The rows above are factorised; this row still contains the matrix.
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

    /// Writes the potentials under which the given currents leave the nodes to `potentials`.
    pub fn solve(&self, currents: &[Pair], potentials: &mut [Pair]) {
        potentials.copy_from_slice(currents);
        let row = |node: usize| &self.rows[node * self.count..];
        for node in 0..self.count {
            let before = row(node)[..node].iter().zip(&potentials[..node]);
            let sum = before.fold(potentials[node], |sum, (entry, potential)| {
                [0, 1].map(|axis| sum[axis] - entry * potential[axis])
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
                *potential = [0, 1].map(|axis| potential[axis] - entry * own[0][axis]);
            }
        }
    }
}

/// Direction t of the last conjugate-gradient step, and its image A t under the matrix A of the
/// graph.
pub struct ConjugateDirection {
    pub direction: Vec<Pair>,
    pub image: Vec<Pair>,
    /// Scalar product tᵀ A t; zero before the first step and after a restart.
    curvature: Pair,
}

/// Length τ of a step along the direction t, and its gain τ² tᵀ A t: the decrease of the squared
/// error in the norm of the matrix A.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub length: Pair,
    pub gain: Pair,
}

impl ConjugateDirection {
    pub fn new(count: usize) -> ConjugateDirection {
        ConjugateDirection {
            direction: vec![[0.0; 2]; count],
            image: vec![[0.0; 2]; count],
            curvature: [0.0; 2],
        }
    }

    /// Resets the method: the next step is not made conjugate to the last direction.
    pub fn restart(&mut self) {
        self.curvature = [0.0; 2];
    }

    /// Makes the preconditioned residual (`correction`) conjugate to the last direction, and
    /// returns the optimal step along the new direction.
    ///
    /// Sets `direction` and `image`. The preconditioner may change from step to step (flexible
    /// conjugate gradients).
    pub fn step(&mut self, graph: &Graph, correction: &[Pair], residual: &[Pair]) -> Step {
        let common = dot(correction, &self.image);
        let projection = [0, 1].map(|axis| ratio(common[axis], self.curvature[axis]));
        for (direction, correction) in self.direction.iter_mut().zip(correction) {
            *direction = [0, 1].map(|axis| correction[axis] - projection[axis] * direction[axis]);
        }
        graph.currents(&self.direction, &mut self.image);
        self.curvature = dot(&self.direction, &self.image);
        let along = dot(&self.direction, residual);
        let length = [0, 1].map(|axis| ratio(along[axis], self.curvature[axis]));
        Step { length, gain: [0, 1].map(|axis| length[axis] * length[axis] * self.curvature[axis]) }
    }
}

/// Adds `factor` × `others` to `values`.
pub fn add(values: &mut [Pair], factor: Pair, others: &[Pair]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value = [0, 1].map(|axis| value[axis] + factor[axis] * other[axis]);
    }
}

/// Returns the quotient, or zero if the denominator is not positive.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

/// Returns the scalar product for the flow along x and the one for the flow along y.
fn dot(one: &[Pair], other: &[Pair]) -> Pair {
    let pairs = one.iter().zip(other);
    pairs.fold([0.0; 2], |sum, (one, other)| [0, 1].map(|axis| sum[axis] + one[axis] * other[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solved_potentials_reproduce_the_currents() {
        let links = [(0, 1, 1.0), (1, 2, 1e-6), (2, 3, 5.0), (0, 3, 1e-9), (1, 3, 0.3)];
        let graph = Graph::new(4, vec![(2, 2.0)], || links.into_iter());
        let currents = [[1.0, 0.0], [-2.0, 0.5], [0.0, 0.25], [1.0, -0.75]];
        let mut potentials = [[0.0; 2]; 4];
        Factors::new(&graph).solve(&currents, &mut potentials);
        let mut found = [[0.0; 2]; 4];
        graph.currents(&potentials, &mut found);
        for (found, given) in found.iter().zip(&currents) {
            assert!((found[0] - given[0]).abs() < 1e-12 && (found[1] - given[1]).abs() < 1e-12);
        }
    }
}
