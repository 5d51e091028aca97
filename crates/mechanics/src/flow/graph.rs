//! Graph of resistors on a coarse level, and the aggregation of nodes that makes it.
//!
//! Nodes of a coarser graph are aggregates of strongly linked nodes, made by two passes of pairwise
//! aggregation (Notay, *Electron. Trans. Numer. Anal.* 37, 2010, 123) with about four nodes per
//! aggregate. The conductance between two aggregates is the sum of the conductances between their
//! nodes. A pass pairs each node with
//!
//! - the neighbour in its block of the grid, if the link is good compared with the best link,
//! - otherwise the neighbour without aggregate to which it has the best link.
//!
//! If another of its links is much better, it joins the aggregate of that neighbour instead. Where
//! links are alike, the aggregates are therefore the blocks of 2 × 2, 4 × 4 … nodes. No aggregate
//! extends across a seam, so that coarse graphs represent the step of the pressure exactly.
//!
//! Access to the matrix dominates the time, so the flows along x and y are solved together, as
//! pairs of values.

use std::borrow::Cow;

/// Placeholder for a node without tree or aggregate.
pub const NONE: u32 = u32::MAX;

/// Values in the flow along x and in the flow along y.
pub type Pair = [f64; 2];

/// Minimum conductance of a link between two nodes that form an aggregate, as a fraction of the
/// best link of one of them.
const STRONG: f32 = 0.1;

/// Resistors between nodes that have positions on the grid.
pub trait Network {
    /// Returns the number of nodes.
    fn count(&self) -> usize;

    /// Iterates over the links of a node, as pairs of neighbour and conductance.
    fn neighbours(&self, node: usize) -> impl Iterator<Item = (usize, f32)>;

    /// Returns the row and column of each node, counted from the seams.
    fn positions(&self) -> Cow<'_, [[u32; 2]]>;
}

/// Graph of resistors. Each link is stored at both of its ends.
pub struct Graph {
    /// Index of the first link of each node, followed by the number of links.
    starts: Vec<u32>,
    /// Other end of each link, in ascending order for each node.
    others: Vec<u32>,
    conductances: Vec<f32>,
    /// Inverse of the sum of the conductances at each node; zero for a node without links.
    inverse_diagonal: Vec<f64>,
    /// Position of the first node of the grid in each aggregate, until the hierarchy is complete.
    positions: Vec<[u32; 2]>,
}

impl Network for Graph {
    fn count(&self) -> usize {
        self.inverse_diagonal.len()
    }

    #[inline]
    fn neighbours(&self, node: usize) -> impl Iterator<Item = (usize, f32)> {
        let links = self.starts[node] as usize..self.starts[node + 1] as usize;
        let others = self.others[links.clone()].iter().map(|other| *other as usize);
        others.zip(self.conductances[links].iter().copied())
    }

    fn positions(&self) -> Cow<'_, [[u32; 2]]> {
        (&self.positions).into()
    }
}

/// Graph in which each node is an aggregate of nodes of a finer network.
pub struct Coarser {
    pub graph: Graph,
    /// Aggregate of each finer node, or [`NONE`] for a node without links.
    pub aggregates: Vec<u32>,
}

impl Coarser {
    /// Aggregates the nodes of a network, where the grid has `nodes` rows and columns, to blocks of
    /// about 2^`level` rows and columns of the grid.
    pub fn new(network: &impl Network, nodes: [usize; 2], level: usize) -> Coarser {
        let mut pairs = Coarser::pairs(network, nodes, [level - 1, level]);
        let fours = Coarser::pairs(&pairs.graph, nodes, [level; 2]);
        for aggregate in pairs.aggregates.iter_mut().filter(|aggregate| **aggregate != NONE) {
            *aggregate = fours.aggregates[*aggregate as usize];
        }
        Coarser { graph: fours.graph, aggregates: pairs.aggregates }
    }

    /// Performs one pass of pairwise aggregation. The blocks have 2^`levels` rows and columns.
    fn pairs(network: &impl Network, nodes: [usize; 2], levels: [usize; 2]) -> Coarser {
        let mut aggregates = vec![NONE; network.count()];
        let finer_positions = network.positions();
        let mut positions = Vec::new();
        let is_across_seam = |one: [u32; 2], other: [u32; 2]| {
            [0, 1].iter().any(|&axis| 2 * one[axis].abs_diff(other[axis]) as usize > nodes[axis])
        };
        let block = |position: [u32; 2]| [0, 1].map(|axis| position[axis] >> levels[axis]);
        for node in 0..network.count() {
            if aggregates[node] != NONE {
                continue;
            }
            let own = finer_positions[node];
            let none = (node, 0.0);
            let (mut best, mut free, mut inside, mut strongest) = (none, none, none, 0.0);
            for link in network.neighbours(node).filter(|(other, _)| *other != node) {
                strongest = link.1.max(strongest);
                let other = finer_positions[link.0];
                if is_across_seam(own, other) {
                    continue;
                }
                let is_better = |than: (usize, f32)| link.1 > than.1;
                let is_free = aggregates[link.0] == NONE;
                best = if is_better(best) { link } else { best };
                free = if is_free && is_better(free) { link } else { free };
                let is_inside = is_free && block(own) == block(other);
                inside = if is_inside && is_better(inside) { link } else { inside };
            }
            if strongest == 0.0 {
                continue;
            }
            let is_strong = |link: &(usize, f32)| link.1 >= STRONG * strongest;
            let partner = [inside, free].into_iter().find(is_strong);
            if partner.is_none() && is_strong(&best) {
                aggregates[node] = aggregates[best.0];
                continue;
            }
            aggregates[node] = positions.len() as u32;
            if let Some((partner, _)) = partner {
                aggregates[partner] = positions.len() as u32;
            }
            positions.push(own);
        }
        let graph = Graph::of_aggregates(network, &aggregates, positions);
        Coarser { graph, aggregates }
    }
}

impl Graph {
    /// Creates the graph of aggregates of a network.
    fn of_aggregates(
        network: &impl Network,
        aggregates: &[u32],
        positions: Vec<[u32; 2]>,
    ) -> Graph {
        let count = positions.len();
        let (member_starts, members) = members(aggregates, count);
        let mut starts = Vec::with_capacity(count + 1);
        starts.push(0);
        let mut inverse_diagonal = Vec::with_capacity(count);
        let (mut others, mut conductances): (Vec<u32>, Vec<f32>) = (Vec::new(), Vec::new());
        let mut link_of = vec![NONE; count];
        for node in 0..count {
            let first = others.len();
            let own_members = member_starts[node] as usize..member_starts[node + 1] as usize;
            for &member in &members[own_members] {
                for (other, conductance) in network.neighbours(member as usize) {
                    let other = aggregates[other];
                    if conductance == 0.0 || other as usize == node {
                        continue;
                    }
                    let index = link_of[other as usize] as usize;
                    if index >= first && index < others.len() {
                        conductances[index] += conductance;
                    } else {
                        link_of[other as usize] = others.len() as u32;
                        others.push(other);
                        conductances.push(conductance);
                    }
                }
            }
            starts.push(others.len() as u32);
            sort_pairs(&mut others[first..], &mut conductances[first..]);
            let sum: f64 = conductances[first..].iter().map(|one| f64::from(*one)).sum();
            inverse_diagonal.push(if sum > 0.0 { 1.0 / sum } else { 0.0 });
        }
        others.shrink_to_fit();
        conductances.shrink_to_fit();
        Graph { starts, others, conductances, inverse_diagonal, positions }
    }

    /// Releases the memory of the positions.
    pub fn forget_positions(&mut self) {
        self.positions = Vec::new();
    }

    /// Returns the current that leaves a node under the given potentials.
    #[inline(always)]
    pub fn outflow(&self, node: usize, potentials: &[Pair]) -> Pair {
        let [x, y] = potentials[node];
        let mut outflow = [0.0; 2];
        for (other, conductance) in self.neighbours(node) {
            let [other_x, other_y] = potentials[other];
            outflow[0] += f64::from(conductance) * (x - other_x);
            outflow[1] += f64::from(conductance) * (y - other_y);
        }
        outflow
    }

    /// Sets the potentials to those of a forward Gauss–Seidel sweep from potentials of zero.
    pub fn forward_sweep(&self, currents: &[Pair], potentials: &mut [Pair]) {
        for (node, current) in currents.iter().enumerate() {
            let mut sum = *current;
            for (other, conductance) in self.neighbours(node).take_while(|(other, _)| *other < node)
            {
                let potential = potentials[other];
                sum[0] += f64::from(conductance) * potential[0];
                sum[1] += f64::from(conductance) * potential[1];
            }
            let inverse = self.inverse_diagonal[node];
            potentials[node] = [inverse * sum[0], inverse * sum[1]];
        }
    }

    /// Returns the current that the potentials of [`Graph::forward_sweep`] leave unbalanced at a
    /// node: the current from the nodes that were swept after it.
    #[inline(always)]
    pub fn unbalanced(&self, node: usize, potentials: &[Pair]) -> Pair {
        let mut sum = [0.0; 2];
        let links = self.starts[node] as usize..self.starts[node + 1] as usize;
        let others = self.others[links.clone()].iter().zip(&self.conductances[links]);
        for (other, conductance) in others.rev().take_while(|(other, _)| **other as usize > node) {
            let potential = potentials[*other as usize];
            sum[0] += f64::from(*conductance) * potential[0];
            sum[1] += f64::from(*conductance) * potential[1];
        }
        sum
    }

    /// Balances the currents of the nodes, from the last node to the first (a backward Gauss–Seidel
    /// sweep).
    pub fn backward_sweep(&self, currents: &[Pair], potentials: &mut [Pair]) {
        for node in (0..self.count()).rev() {
            let outflow = self.outflow(node, potentials);
            let inverse = self.inverse_diagonal[node];
            let (current, potential) = (currents[node], &mut potentials[node]);
            potential[0] += inverse * (current[0] - outflow[0]);
            potential[1] += inverse * (current[1] - outflow[1]);
        }
    }
}

/// Sorts a few keys by insertion, with their values.
fn sort_pairs(keys: &mut [u32], values: &mut [f32]) {
    for end in 1..keys.len() {
        let mut index = end;
        while index > 0 && keys[index - 1] > keys[index] {
            keys.swap(index - 1, index);
            values.swap(index - 1, index);
            index -= 1;
        }
    }
}

/// Returns the index of the first node of each aggregate in the list that follows, with the number
/// of nodes at the end, and the list of the nodes, one aggregate after another.
fn members(aggregates: &[u32], count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; count + 1];
    for &aggregate in aggregates.iter().filter(|&&aggregate| aggregate != NONE) {
        starts[aggregate as usize + 1] += 1;
    }
    for node in 0..count {
        starts[node + 1] += starts[node];
    }
    let mut members = vec![0; starts[count] as usize];
    let mut filled = starts.clone();
    for (node, &aggregate) in aggregates.iter().enumerate() {
        if aggregate != NONE {
            let index = &mut filled[aggregate as usize];
            members[*index as usize] = node as u32;
            *index += 1;
        }
    }
    (starts, members)
}
