//! Links between neighbouring nodes of a periodic map of gaps, and the channels that percolate.
//!
//! A maximum spanning forest of the links (Kruskal) carries the residuals of a solution to the
//! roots with little dissipation. It also assigns a periodic image of the cell to each node. A
//! channel percolates if a link outside the forest joins nodes of inconsistent images.

use std::borrow::Cow;
use std::ops::Range;

use super::graph::{NONE, Network};
use crate::grid::Grid;

/// Channels that percolate along x or y, with the maximum spanning tree of each.
pub struct Channels {
    /// `true` if a channel percolates: one entry for x and one for y.
    pub percolates: [bool; 2],
    /// Nodes of the channels, tree by tree, each in depth-first order from its root.
    pub order: Vec<u32>,
    /// Mark of each node of the grid; see [`Forest::marks`].
    marks: Vec<u8>,
}

/// Link from a node to its parent in the spanning forest.
#[derive(Debug, Clone, Copy)]
pub struct ParentLink {
    pub node: usize,
    pub parent: usize,
    pub conductance: f64,
    /// Signed number of crossings of the seams along x and along y, on the way from the node to its
    /// parent.
    pub crossings: [i8; 2],
}

impl Channels {
    /// Finds the channels that percolate along x or y, and removes all other links.
    pub fn new(links: &mut Links) -> Channels {
        let forest = Forest::new(links);
        let percolation = forest.percolation(links);
        let percolates = |node: usize| match forest.components[node] {
            NONE => false,
            component => percolation[component as usize].contains(&true),
        };
        for conductances in &mut links.conductances {
            for (node, conductance) in conductances.iter_mut().enumerate() {
                *conductance = if percolates(node) { *conductance } else { 0.0 };
            }
        }
        let mut order = forest.order;
        order.retain(|&node| percolates(node as usize));
        order.shrink_to_fit();
        Channels {
            percolates: [0, 1].map(|axis| percolation.iter().any(|along| along[axis])),
            order,
            marks: forest.marks,
        }
    }

    /// Iterates over the links of the nodes to their parents, from the leaves to the roots. Roots
    /// have none.
    pub fn parent_links<'a>(&'a self, links: &'a Links) -> impl Iterator<Item = ParentLink> {
        let with_parent = |&&node: &&u32| self.marks[node as usize] & HAS_PARENT != 0;
        self.order.iter().rev().filter(with_parent).map(|&node| {
            let node = node as usize;
            let direction = usize::from(self.marks[node] >> PARENT & 3);
            let link = link(links, node, direction);
            let (parent, crossings) = step(&link, direction);
            ParentLink { node, parent, conductance: f64::from(link.conductance), crossings }
        })
    }
}

/// Number of directions of the links of a node: +x, +y, −x, −y.
const DIRECTIONS: usize = 4;

/// Index of the first of the two bits of a mark that contain the direction of the parent.
const PARENT: u32 = 4;

const HAS_PARENT: u8 = 1 << 6;

/// Maximum spanning forest of the links.
struct Forest {
    /// Mark of each node: a bit for each direction with a link of the forest, and the direction of
    /// its parent.
    marks: Vec<u8>,
    /// Nodes of one tree after another, each in depth-first order from its root: neighbours in
    /// this order are mostly neighbours on the grid, too.
    order: Vec<u32>,
    /// Index of the tree of each node, or [`NONE`] for a node without links.
    components: Vec<u32>,
    /// Periodic image of each node relative to its root, in cells along x and y.
    periods: Vec<[i32; 2]>,
    /// Number of trees.
    trees: u32,
}

impl Forest {
    fn new(links: &Links) -> Forest {
        let nodes = links.count();
        let ranked = ranked(links);
        let mut forest = Forest {
            marks: best_links(links, &ranked),
            order: Vec::new(),
            components: vec![NONE; nodes],
            periods: vec![[0; 2]; nodes],
            trees: 0,
        };
        for link in ranked.iter().map(|rank| by_rank(links, *rank)) {
            if forest.components[link.from] == NONE {
                forest.grow(links, link.from);
            }
        }
        forest
    }

    /// Visits all nodes of the tree of `root`, depth first. Sets their order, component, period
    /// and parent.
    fn grow(&mut self, links: &Links, root: usize) {
        let component = self.trees;
        self.trees += 1;
        self.components[root] = component;
        let mut unvisited = vec![root];
        while let Some(node) = unvisited.pop() {
            self.order.push(node as u32);
            for direction in 0..DIRECTIONS {
                if self.marks[node] & 1 << direction == 0 {
                    continue;
                }
                let link = link(links, node, direction);
                let (neighbour, crossings) = step(&link, direction);
                if self.components[neighbour] != NONE {
                    continue;
                }
                self.components[neighbour] = component;
                let [x, y] = self.periods[node];
                self.periods[neighbour] =
                    [x + i32::from(crossings[0]), y + i32::from(crossings[1])];
                let back = (direction + 2) % DIRECTIONS;
                self.marks[neighbour] |= HAS_PARENT | (back as u8) << PARENT;
                unvisited.push(neighbour);
            }
        }
    }

    /// Returns, for each tree, whether it percolates along x and along y through all links between
    /// the nodes of the tree, including links outside the forest.
    fn percolation(&self, links: &Links) -> Vec<[bool; 2]> {
        let mut percolation = vec![[false; 2]; self.trees as usize];
        links.iter().for_each(|(from, axis)| {
            let link = links.leaving(from, axis);
            let mut across = self.periods[from];
            across[axis] += i32::from(link.crosses_seam);
            let to = self.periods[link.to];
            if across != to {
                let along = &mut percolation[self.components[from] as usize];
                *along = [0, 1].map(|axis| along[axis] || across[axis] != to[axis]);
            }
        });
        percolation
    }
}

/// Returns all links as 2 × node + axis, in descending order of the upper sixteen bits of their
/// conductances: conductances that differ by less than a hundredth may be in any order.
fn ranked(links: &Links) -> Vec<u32> {
    let rank = |from: usize, axis: usize| {
        let conductance: f32 = links.conductances[axis][from];
        usize::from(!(conductance.to_bits() >> 16) as u16)
    };
    let mut starts = vec![0_u32; (1 << 16) + 1];
    links.iter().for_each(|(from, axis)| starts[rank(from, axis) + 1] += 1);
    for rank in 0..1 << 16 {
        starts[rank + 1] += starts[rank];
    }
    let mut ranked = vec![0; starts[1 << 16] as usize];
    links.iter().for_each(|(from, axis)| {
        let next = &mut starts[rank(from, axis)];
        ranked[*next as usize] = (2 * from + axis) as u32;
        *next += 1;
    });
    ranked
}

fn by_rank(links: &Links, rank: u32) -> Link {
    links.leaving(rank as usize / 2, rank as usize % 2)
}

/// Returns, for each node, the bits of the directions in which it has a link of the maximum
/// spanning forest.
fn best_links(links: &Links, ranked: &[u32]) -> Vec<u8> {
    let nodes = links.count();
    let mut parents: Vec<u32> = (0..nodes as u32).collect();
    let mut marks = vec![0; nodes];
    for link in ranked.iter().map(|rank| by_rank(links, *rank)) {
        let ends = [link.from, link.to].map(|node| root(&mut parents, node as u32));
        if ends[0] != ends[1] {
            parents[ends[0].max(ends[1]) as usize] = ends[0].min(ends[1]);
            marks[link.from] |= 1 << link.axis;
            marks[link.to] |= 1 << (link.axis + 2);
        }
    }
    marks
}

fn root(parents: &mut [u32], mut node: u32) -> u32 {
    while parents[node as usize] != node {
        let parent = parents[node as usize];
        parents[node as usize] = parents[parent as usize];
        node = parent;
    }
    node
}

fn link(links: &Links, node: usize, direction: usize) -> Link {
    match direction {
        0 | 1 => links.leaving(node, direction),
        _ => links.reaching(node, direction - 2),
    }
}

/// Returns the end of a link in a direction, and the signed number of crossings of the seams along
/// x and y on the way to it.
fn step(link: &Link, direction: usize) -> (usize, [i8; 2]) {
    let mut crossings = [0; 2];
    let (neighbour, along) = match direction {
        0 | 1 => (link.to, 1),
        _ => (link.from, -1),
    };
    crossings[link.axis] = along * i8::from(link.crosses_seam);
    (neighbour, crossings)
}

/// Minimum conductance of an open link, as a fraction of the conductance of the deepest gap.
///
/// Single precision cannot hold the product of two numbers far below it. A gap of 1e-10 of the
/// deepest has this conductance.
const LEAST_CONDUCTANCE: f32 = 1e-30;

/// Conductances of the links between neighbouring nodes of a periodic map.
pub struct Links {
    pub nodes: [usize; 2],
    /// Conductances of the links along x and along y, indexed by the first node of the link.
    conductances: [Vec<f32>; 2],
    /// For each axis, the index i for which the links from nodes i to nodes i + 1 cross the seam.
    pub seams: [usize; 2],
}

/// Link from a node to the next node along an axis.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    pub axis: usize,
    pub from: usize,
    pub to: usize,
    pub conductance: f32,
    /// `true` if the link crosses the seam, where the pressure has its step.
    pub crosses_seam: bool,
}

impl Network for Links {
    fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    fn neighbours(&self, node: usize) -> impl Iterator<Item = (usize, f32)> {
        let [rows, row_nodes] = self.nodes;
        let [i, j] = self.indices(node);
        let above = if i > 0 { node - row_nodes } else { node + (rows - 1) * row_nodes };
        let before = if j > 0 { node - 1 } else { node + row_nodes - 1 };
        let [below, after] = [0, 1].map(|axis| self.neighbour(node, [i, j], axis));
        let [along_x, along_y] = &self.conductances;
        [
            (above, along_x[above]),
            (before, along_y[before]),
            (after, along_y[node]),
            (below, along_x[node]),
        ]
        .into_iter()
    }

    fn positions(&self) -> Cow<'_, [[u32; 2]]> {
        let [rows, columns] = [0, 1].map(|axis| {
            let count = self.nodes[axis];
            (0..count).map(move |index| ((index + count - self.seams[axis] - 1) % count) as u32)
        });
        rows.flat_map(|row| columns.clone().map(move |column| [row, column])).collect()
    }
}

impl Links {
    /// Computes the conductances of the links of a map of gaps: the harmonic mean of (g/`unit`)³ at
    /// both nodes, times Δy/Δx along x and Δx/Δy along y, in single precision and at least
    /// [`LEAST_CONDUCTANCE`].
    ///
    /// The conductance is zero if one of the gaps is not positive.
    pub fn between(grid: Grid, gap: &[f64], unit: f64) -> Links {
        let [step_x, step_y] = grid.spacing();
        let mut links =
            Links { nodes: grid.nodes(), conductances: [Vec::new(), Vec::new()], seams: [0; 2] };
        for (axis, aspect) in [step_y / step_x, step_x / step_y].into_iter().enumerate() {
            let conductance = |node| {
                let [one, other] =
                    [gap[node], gap[links.neighbour(node, links.indices(node), axis)]];
                if one > 0.0 && other > 0.0 {
                    let [one, other] = [one / unit, other / unit].map(|gap| gap * gap * gap);
                    let mean = 2.0 * one * (other / (one + other));
                    ((aspect * mean) as f32).max(LEAST_CONDUCTANCE)
                } else {
                    0.0
                }
            };
            links.conductances[axis] = (0..gap.len()).map(conductance).collect();
            links.seams[axis] = links.least_conducting_section(axis);
        }
        links
    }

    /// Iterates over the links with positive conductance, as pairs of first node and axis.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize)> {
        [0, 1].into_iter().flat_map(|axis| {
            let conductances = self.conductances[axis].iter().enumerate();
            let open = conductances.filter(|(_, conductance)| **conductance > 0.0);
            open.map(move |(from, _)| (from, axis))
        })
    }

    /// Returns the link from a node to the next node along an axis. Its conductance may be zero.
    pub fn leaving(&self, from: usize, axis: usize) -> Link {
        let indices = self.indices(from);
        Link {
            axis,
            from,
            to: self.neighbour(from, indices, axis),
            conductance: self.conductances[axis][from],
            crosses_seam: indices[axis] == self.seams[axis],
        }
    }

    /// Returns the link from the previous node along an axis to node `to`. Its conductance may be
    /// zero.
    pub fn reaching(&self, to: usize, axis: usize) -> Link {
        let [rows, row_nodes] = self.nodes;
        let indices = self.indices(to);
        let from = match (axis, indices[axis]) {
            (0, 0) => to + (rows - 1) * row_nodes,
            (0, _) => to - row_nodes,
            (_, 0) => to + row_nodes - 1,
            _ => to - 1,
        };
        self.leaving(from, axis)
    }

    /// Returns the nodes of a row.
    pub fn row(&self, row: usize) -> Range<usize> {
        row * self.nodes[1]..(row + 1) * self.nodes[1]
    }

    /// Returns the rows before and after a row.
    pub fn adjacent_rows(&self, row: usize) -> [usize; 2] {
        let rows = self.nodes[0];
        [if row == 0 { rows - 1 } else { row - 1 }, if row + 1 == rows { 0 } else { row + 1 }]
    }

    /// Writes the current that leaves each node of a row to `outflow`, where `potentials` are those
    /// of the row before, of the row itself and of the row after.
    ///
    /// Currents are computed from differences, so that rounding errors are small compared with the
    /// currents where neighbours have nearly equal potentials.
    pub fn row_outflow(&self, row: usize, potentials: [&[f64]; 3], outflow: &mut [f64]) {
        let count = self.nodes[1];
        let [above, own, below] = potentials.map(|potentials| &potentials[..count]);
        let [up, down, right] = self.row_conductances(row);
        let outflow = &mut outflow[..count];
        let between = |links: [f32; 4], [above, below, before, after]: [f64; 4], own: f64| {
            let [up, down, left, right] = links.map(f64::from);
            up * (own - above)
                + down * (own - below)
                + right * (own - after)
                + left * (own - before)
        };
        let last = count - 1;
        for j in 1..last {
            let links = [up[j], down[j], right[j - 1], right[j]];
            outflow[j] = between(links, [above[j], below[j], own[j - 1], own[j + 1]], own[j]);
        }
        for j in [0, last] {
            let (before, after) = ((j + last) % count, (j + 1) % count);
            let links = [up[j], down[j], right[before], right[j]];
            outflow[j] = between(links, [above[j], below[j], own[before], own[after]], own[j]);
        }
    }

    /// Returns the inverse of the sum of the conductances at each node, or one for a node without
    /// links.
    pub fn inverse_diagonal(&self) -> Vec<f32> {
        let rows = (0..self.nodes[0]).flat_map(|row| {
            let [up, down, right] = self.row_conductances(row);
            let mut left = right[right.len() - 1];
            up.iter().zip(down).zip(right).map(move |((up, down), right)| {
                let sum = up + down + right + left;
                left = *right;
                if sum > 0.0 { 1.0 / sum } else { 1.0 }
            })
        });
        rows.collect()
    }

    /// Returns the conductances from the nodes of a row to the row before, to the row after, and to
    /// the next node of the row.
    pub fn row_conductances(&self, row: usize) -> [&[f32]; 3] {
        let [before, _] = self.adjacent_rows(row);
        let [along_x, along_y] = &self.conductances;
        [&along_x[self.row(before)], &along_x[self.row(row)], &along_y[self.row(row)]]
    }

    fn neighbour(&self, node: usize, indices: [usize; 2], axis: usize) -> usize {
        let [rows, row_nodes] = self.nodes;
        let is_last = indices[axis] + 1 == self.nodes[axis];
        match (axis, is_last) {
            (0, false) => node + row_nodes,
            (0, true) => node - (rows - 1) * row_nodes,
            (_, false) => node + 1,
            (_, true) => node + 1 - row_nodes,
        }
    }

    fn indices(&self, node: usize) -> [usize; 2] {
        [node / self.nodes[1], node % self.nodes[1]]
    }

    /// Returns the index i along `axis` for which the conductances of the links from nodes i to
    /// nodes i + 1 have the smallest sum.
    ///
    /// The seam could be at any index. At this one, rounding errors are smallest if the pressure
    /// drops over a single constriction.
    fn least_conducting_section(&self, axis: usize) -> usize {
        let mut sums = vec![0.0; self.nodes[axis]];
        for (node, conductance) in self.conductances[axis].iter().enumerate() {
            sums[self.indices(node)[axis]] += f64::from(*conductance);
        }
        let least = sums.iter().enumerate().min_by(|one, other| one.1.total_cmp(other.1));
        least.expect("there is a node").0
    }
}
