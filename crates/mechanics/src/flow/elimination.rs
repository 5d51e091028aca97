//! Direct solution of a graph of resistors by nested dissection.
//!
//! Eliminating a node with the conductances kᵢ to its neighbours joins each pair of neighbours by
//! the conductance kᵢ kⱼ/Σk (the transformation of a star to a mesh; Rosen, *Bull. AIEE* 1924,
//! 916). This is Gaussian elimination of the matrix, written for its conductances. All terms are
//! positive and nothing cancels, so single precision is accurate however many decades the
//! conductances span. The last node of each connected part has no neighbours left and gets the
//! potential zero.
//!
//! The order of elimination is nested dissection by position (George, *SIAM J. Numer. Anal.* 10,
//! 1973, 345): a line divides the nodes into two sets, and the nodes on one side of the line that
//! have links across it, the separator, are eliminated after both sets. Each separator is
//! eliminated in a dense matrix of its nodes and of their neighbours (the multifrontal method of
//! Duff & Reid, *ACM Trans. Math. Softw.* 9, 1983, 302).

use super::graph::{Graph, Network, Pair};

/// Maximum number of nodes that are eliminated together without dissection.
const LEAF: usize = 12;

/// Number of nodes that are eliminated before their conductances are added to the rest of the
/// matrix.
const PANEL: usize = 32;

/// Numbers of rows and columns of the block of the matrix that registers hold.
const BLOCK: [usize; 2] = [4, 16];

/// Index of a node that is in no matrix.
const ABSENT: u32 = u32::MAX;

/// Elimination of all nodes of a graph.
pub struct Elimination {
    /// Parts in the order of elimination.
    parts: Vec<Part>,
    /// For each eliminated node, the weights kⱼ/Σk of the nodes after it in its part.
    weights: Vec<f32>,
}

/// Nodes that are eliminated together, and their neighbours.
struct Part {
    /// The eliminated nodes, followed by their neighbours.
    nodes: Vec<u32>,
    pivots: Vec<Pivot>,
}

struct Pivot {
    /// Inverse of the sum of the conductances; zero for the last node of a connected part.
    inverse: f32,
    /// Index of the node with the largest weight.
    best: u32,
    /// Difference between one and the sum of the weights, which is added to the largest weight.
    ///
    /// With it, the elimination conserves currents, and equal potentials stay equal, to rounding
    /// errors of double precision.
    remainder: f64,
}

impl Elimination {
    /// Eliminates the nodes of a graph.
    pub fn new(graph: &Graph) -> Elimination {
        let count = graph.count();
        let mut dissection = Dissection {
            graph,
            is_right: vec![false; count],
            is_eliminated: vec![false; count],
            indices: vec![ABSENT; count],
            result: Elimination { parts: Vec::new(), weights: Vec::new() },
        };
        let mut nodes: Vec<u32> = (0..count as u32).collect();
        dissection.eliminate(&mut nodes);
        dissection.result.weights.shrink_to_fit();
        dissection.result
    }

    /// Replaces the currents that leave the nodes by the potentials of the nodes.
    pub fn solve(&self, values: &mut [Pair]) {
        // The values of the nodes of a part, for each axis.
        let mut local: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        let mut remaining = &self.weights[..];
        for part in &self.parts {
            part.read(values, &mut local);
            for (index, pivot) in part.pivots.iter().enumerate() {
                let (weights, rest) = remaining.split_at(part.nodes.len() - index - 1);
                remaining = rest;
                for local in &mut local {
                    let own = local[index];
                    for (other, weight) in local[index + 1..].iter_mut().zip(weights) {
                        *other += f64::from(*weight) * own;
                    }
                    local[pivot.best as usize] += pivot.remainder * own;
                }
            }
            part.write(&local, values);
        }
        let mut remaining = &self.weights[..];
        for part in self.parts.iter().rev() {
            part.read(values, &mut local);
            for (index, pivot) in part.pivots.iter().enumerate().rev() {
                let count = part.nodes.len() - index - 1;
                let (rest, weights) = remaining.split_at(remaining.len() - count);
                remaining = rest;
                for local in &mut local {
                    let own = f64::from(pivot.inverse) * local[index];
                    let corrected = own + pivot.remainder * local[pivot.best as usize];
                    local[index] = corrected + weighted_sum(weights, &local[index + 1..]);
                }
            }
            part.write(&local, values);
        }
    }
}

impl Part {
    fn read(&self, values: &[Pair], local: &mut [Vec<f64>; 2]) {
        for (axis, local) in local.iter_mut().enumerate() {
            local.clear();
            local.extend(self.nodes.iter().map(|node| values[*node as usize][axis]));
        }
    }

    fn write(&self, local: &[Vec<f64>; 2], values: &mut [Pair]) {
        for (index, &node) in self.nodes.iter().enumerate() {
            values[node as usize] = [local[0][index], local[1][index]];
        }
    }
}

/// Returns the sum of the products, as the sum of four sums.
fn weighted_sum(weights: &[f32], values: &[f64]) -> f64 {
    let (weight_chunks, last_weights) = weights.as_chunks::<4>();
    let (chunks, last) = values.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (weights, values) in weight_chunks.iter().zip(chunks) {
        for lane in 0..4 {
            sums[lane] += f64::from(weights[lane]) * values[lane];
        }
    }
    let rest = last_weights.iter().zip(last).map(|(weight, value)| f64::from(*weight) * value);
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}

struct Dissection<'a> {
    graph: &'a Graph,
    is_right: Vec<bool>,
    is_eliminated: Vec<bool>,
    /// Index of each node in the matrix in work, or [`ABSENT`].
    indices: Vec<u32>,
    result: Elimination,
}

/// Conductances between the neighbours of eliminated nodes.
struct Mesh {
    nodes: Vec<u32>,
    matrix: Matrix,
}

/// Conductances between pairs of nodes, above the diagonal of a square matrix.
struct Matrix {
    /// Distance between rows: a multiple of the columns of a block.
    stride: usize,
    conductances: Vec<f32>,
}

impl Dissection<'_> {
    /// Eliminates all of `nodes`, and returns the conductances between their neighbours.
    fn eliminate(&mut self, nodes: &mut [u32]) -> Mesh {
        if nodes.len() <= LEAF {
            return self.eliminate_together(nodes, &[]);
        }
        let middle = self.divide(nodes);
        let (left, right) = nodes.split_at_mut(middle);
        for &node in &*right {
            self.is_right[node as usize] = true;
        }
        let inner = partition(left, |node| {
            let mut neighbours = self.graph.neighbours(node as usize);
            !neighbours.any(|(other, _)| self.is_right[other])
        });
        for &node in &*right {
            self.is_right[node as usize] = false;
        }
        let (left, separator) = left.split_at_mut(inner);
        let meshes = [self.eliminate(left), self.eliminate(right)];
        self.eliminate_together(separator, &meshes)
    }

    /// Divides the nodes by a line across the longer side of the rectangle that contains them.
    /// Reorders them, and returns the number of nodes before the line.
    fn divide(&self, nodes: &mut [u32]) -> usize {
        let positions = self.graph.positions();
        let position = |node: u32, axis: usize| positions[node as usize][axis];
        let lengths = [0, 1].map(|axis| {
            let along = || nodes.iter().map(|node| position(*node, axis));
            along().max().unwrap_or(0) - along().min().unwrap_or(0)
        });
        let axis = usize::from(lengths[1] > lengths[0]);
        let key = |node: u32| (position(node, axis), position(node, 1 - axis));
        let middle = nodes.len() / 2;
        let (_, pivot, _) = nodes.select_nth_unstable_by_key(middle, |node| key(*node));
        let line = position(*pivot, axis);
        let before = partition(nodes, |node| position(node, axis) < line);
        // The line is along the first of the nodes if half of them are on it.
        if before > 0 { before } else { middle }
    }

    /// Eliminates `nodes`, where `meshes` are the conductances that eliminated nodes have left.
    fn eliminate_together(&mut self, nodes: &[u32], meshes: &[Mesh]) -> Mesh {
        let eliminated = nodes.len();
        let mut nodes = self.with_neighbours(nodes, meshes);
        nodes.shrink_to_fit();
        let matrix = self.assembled(&nodes, eliminated, meshes);
        for &node in &nodes {
            self.indices[node as usize] = ABSENT;
        }
        for &node in &nodes[..eliminated] {
            self.is_eliminated[node as usize] = true;
        }
        let neighbours = nodes[eliminated..].to_vec();
        if eliminated == 0 {
            return Mesh { nodes: neighbours, matrix };
        }
        let (pivots, left) = matrix.eliminate(nodes.len(), eliminated, &mut self.result.weights);
        self.result.parts.push(Part { nodes, pivots });
        Mesh { nodes: neighbours, matrix: left }
    }

    /// Returns `nodes`, followed by their neighbours that are not eliminated yet, and sets
    /// `indices`.
    fn with_neighbours(&mut self, nodes: &[u32], meshes: &[Mesh]) -> Vec<u32> {
        let mut all = nodes.to_vec();
        for (index, &node) in nodes.iter().enumerate() {
            self.indices[node as usize] = index as u32;
        }
        let links = nodes.iter().flat_map(|node| self.graph.neighbours(*node as usize));
        let neighbours = links.map(|(other, _)| other as u32);
        for other in neighbours.chain(meshes.iter().flat_map(|mesh| mesh.nodes.iter().copied())) {
            let index = &mut self.indices[other as usize];
            if *index == ABSENT && !self.is_eliminated[other as usize] {
                *index = all.len() as u32;
                all.push(other);
            }
        }
        all
    }

    /// Returns the conductances between `nodes`: those of the links of the first `eliminated`
    /// nodes, and those of `meshes`.
    fn assembled(&self, nodes: &[u32], eliminated: usize, meshes: &[Mesh]) -> Matrix {
        let mut matrix = Matrix::zero(nodes.len());
        for (row, &node) in nodes[..eliminated].iter().enumerate() {
            for (other, conductance) in self.graph.neighbours(node as usize) {
                let column = self.indices[other] as usize;
                if !self.is_eliminated[other] && column > row {
                    matrix.conductances[row * matrix.stride + column] += conductance;
                }
            }
        }
        for mesh in meshes {
            let indices: Vec<usize> =
                mesh.nodes.iter().map(|node| self.indices[*node as usize] as usize).collect();
            for (row, &one) in indices.iter().enumerate() {
                let conductances = &mesh.matrix.conductances[row * mesh.matrix.stride..];
                for (&other, conductance) in indices.iter().zip(conductances).skip(row + 1) {
                    let index = one.min(other) * matrix.stride + one.max(other);
                    matrix.conductances[index] += conductance;
                }
            }
        }
        matrix
    }
}

impl Matrix {
    fn zero(count: usize) -> Matrix {
        let [rows, columns] = BLOCK;
        let stride = count.next_multiple_of(columns);
        Matrix { stride, conductances: vec![0.0; count.next_multiple_of(rows) * stride] }
    }

    /// Eliminates the first `eliminated` of `count` nodes. Appends their weights to `weights`, and
    /// returns the conductances between the other nodes.
    fn eliminate(
        mut self,
        count: usize,
        eliminated: usize,
        weights: &mut Vec<f32>,
    ) -> (Vec<Pivot>, Matrix) {
        let stride = self.stride;
        let mut pivots = Vec::with_capacity(eliminated);
        let mut panel = vec![0.0; PANEL.min(eliminated) * stride];
        for first in (0..eliminated).step_by(PANEL) {
            let end = eliminated.min(first + PANEL);
            for row in first..end {
                let (own, after) = self.conductances[row * stride..].split_at_mut(stride);
                let row_weights = &mut panel[(row - first) * stride..][..stride];
                row_weights[..=row].fill(0.0);
                let (pivot, own) = (Pivot::new(row, &own[..count], row_weights), &*own);
                pivots.push(pivot);
                weights.extend_from_slice(&row_weights[row + 1..count]);
                for (other, after) in (row + 1..end).zip(after.chunks_exact_mut(stride)) {
                    let conductance = own[other];
                    for (sum, weight) in after[other..].iter_mut().zip(&row_weights[other..]) {
                        *sum += conductance * weight;
                    }
                }
            }
            self.add_panel(first..end, &panel);
        }
        let mut left = Matrix::zero(count - eliminated);
        for row in 0..count - eliminated {
            let from = (eliminated + row) * stride + eliminated;
            let columns = count - eliminated;
            left.conductances[row * left.stride..][..columns]
                .copy_from_slice(&self.conductances[from..from + columns]);
        }
        (pivots, left)
    }

    /// Adds the conductances that the elimination of the rows `panel` leaves to all rows after
    /// them, block by block. `weights` are the weights of these rows.
    fn add_panel(&mut self, panel: std::ops::Range<usize>, weights: &[f32]) {
        const ROWS: usize = BLOCK[0];
        const COLUMNS: usize = BLOCK[1];
        let stride = self.stride;
        let (before, after) = self.conductances.split_at_mut(panel.end * stride);
        let own = &before[panel.start * stride..];
        let rows = after.len() / stride;
        for row in (0..rows).step_by(ROWS) {
            let height = ROWS.min(rows - row);
            let first = panel.end + row;
            for column in (first / COLUMNS * COLUMNS..stride).step_by(COLUMNS) {
                let mut sums = [[0.0_f32; COLUMNS]; ROWS];
                for (own, weights) in own.chunks_exact(stride).zip(weights.chunks_exact(stride)) {
                    let weights = &weights[column..column + COLUMNS];
                    let mut factors = [0.0; ROWS];
                    factors[..height].copy_from_slice(&own[first..first + height]);
                    for (sums, factor) in sums.iter_mut().zip(factors) {
                        for (sum, weight) in sums.iter_mut().zip(weights) {
                            *sum += factor * weight;
                        }
                    }
                }
                for (sums, row) in sums[..height].iter().zip(row..) {
                    let target = &mut after[row * stride + column..][..COLUMNS];
                    for (target, sum) in target.iter_mut().zip(sums) {
                        *target += sum;
                    }
                }
            }
        }
    }
}

impl Pivot {
    /// Writes the weights of the nodes after node `index` to `weights`, from its conductances.
    fn new(index: usize, conductances: &[f32], weights: &mut [f32]) -> Pivot {
        let after = &conductances[index + 1..];
        let sum: f32 = after.iter().sum();
        if sum < f32::MIN_POSITIVE {
            weights.fill(0.0);
            return Pivot { inverse: 0.0, best: index as u32, remainder: 0.0 };
        }
        let (mut best, mut total) = (index + 1, 0.0);
        for (other, (weight, conductance)) in
            (index + 1..).zip(weights[index + 1..].iter_mut().zip(after))
        {
            *weight = conductance / sum;
            total += f64::from(*weight);
            if *conductance > conductances[best] {
                best = other;
            }
        }
        Pivot { inverse: 1.0 / sum, best: best as u32, remainder: 1.0 - total }
    }
}

/// Moves the nodes that fulfil the condition to the front, and returns their number.
fn partition(nodes: &mut [u32], is_first: impl Fn(u32) -> bool) -> usize {
    let mut count = 0;
    for index in 0..nodes.len() {
        if is_first(nodes[index]) {
            nodes.swap(index, count);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::channels::Links;
    use crate::flow::graph::Coarser;
    use crate::grid::samples::square;

    #[test]
    fn solved_potentials_reproduce_the_currents_over_many_decades() {
        let grid = square(40, 1.0);
        let wave = |index: usize, count: f64| (count * index as f64).sin();
        let gap: Vec<f64> = (0..grid.count())
            .map(|node| {
                let [i, j] = grid.indices(node);
                // Walls of gap 1e-4 and closed nodes between wider parts.
                let height = 0.3 + wave(i, 0.9) * wave(j, 0.7) + wave(j, 0.25);
                if i % 13 == 5 { 1e-4 } else { height.max(0.0) }
            })
            .collect();
        let links = Links::between(grid, &gap, 2.3);
        let graph = Coarser::new(&links, links.nodes, 1).graph;
        let expected: Vec<Pair> =
            (0..graph.count()).map(|node| [wave(node, 3.1), wave(node / 30, 1.0)]).collect();
        let currents = |potentials: &[Pair]| -> Vec<Pair> {
            (0..graph.count()).map(|node| graph.outflow(node, potentials)).collect()
        };
        let mut found = currents(&expected);
        Elimination::new(&graph).solve(&mut found);
        // The error is small compared with the potentials in the norm of the matrix.
        let energy = |potentials: &[Pair], axis: usize| -> f64 {
            let products = currents(potentials);
            potentials.iter().zip(&products).map(|(one, other)| one[axis] * other[axis]).sum()
        };
        let errors: Vec<Pair> = found
            .iter()
            .zip(&expected)
            .map(|(found, expected)| [0, 1].map(|axis| found[axis] - expected[axis]))
            .collect();
        for axis in [0, 1] {
            let [error, all] = [&errors, &expected].map(|potentials| energy(potentials, axis));
            assert!(error < 1e-10 * all, "{error:e} {all:e}");
        }
    }
}
