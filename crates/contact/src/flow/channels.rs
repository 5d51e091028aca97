//! Links between neighbouring nodes of a periodic map of gaps, and the channels that percolate.
//!
//! A maximum spanning forest of the links (Kruskal) carries the residuals of a solution to the
//! roots with little dissipation. It also assigns a periodic image of the cell to each node. A
//! channel percolates if a link outside the forest joins nodes of inconsistent images.

use super::graph::Graph;
use crate::grid::Grid;

/// Placeholder for a node without index, number or tree.
pub const NONE: u32 = u32::MAX;

/// Nodes of all channels that percolate along x or y. They are numbered in the order of the grid.
pub struct Channels {
    /// `true` if a channel percolates: one entry for x and one for y.
    pub percolates: [bool; 2],
    /// Number of nodes in all percolating channels.
    pub count: usize,
    /// Number of each node of the grid in these channels, or [`NONE`].
    numbers: Vec<u32>,
    /// Link of each node to its parent in the spanning forest, from the leaves to the roots. Roots
    /// have none.
    pub parent_links: Vec<ParentLink>,
    /// Number of the root of each channel, and the conductance of the best link of the channel.
    roots: Vec<(u32, f64)>,
}

/// Link from a node to its parent in the spanning forest.
#[derive(Debug, Clone, Copy)]
pub struct ParentLink {
    pub node: u32,
    pub parent: u32,
    pub conductance: f64,
    /// Signed number of crossings of the seams along x and along y, on the way from the node to its
    /// parent.
    pub crossings: [i8; 2],
}

impl Channels {
    /// Finds the channels that percolate along x or y.
    pub fn new(links: &Links) -> Channels {
        let forest = Forest::new(links);
        let percolation = forest.percolation(links);
        let percolates = |node: usize| match forest.components[node] {
            NONE => false,
            component => percolation[component as usize].contains(&true),
        };
        let mut count = 0;
        let numbers: Vec<u32> = (0..links.count())
            .map(|node| {
                if percolates(node) {
                    count += 1;
                    count - 1
                } else {
                    NONE
                }
            })
            .collect();
        let parent_links = forest.order.iter().rev().filter_map(|&node| {
            let link = forest.parent_link(links, node as usize)?;
            (numbers[node as usize] != NONE).then(|| ParentLink {
                node: numbers[node as usize],
                parent: numbers[link.parent as usize],
                ..link
            })
        });
        let roots = forest.roots.iter().filter_map(|&(root, conductance)| {
            let number = numbers[root as usize];
            (number != NONE).then_some((number, conductance))
        });
        Channels {
            roots: roots.collect(),
            percolates: [0, 1].map(|axis| percolation.iter().any(|along| along[axis])),
            count: count as usize,
            parent_links: parent_links.collect(),
            numbers,
        }
    }

    /// Iterates over the links of the channels, with the numbers of their ends in the channels.
    pub fn links<'a>(&'a self, links: &'a Links) -> impl Iterator<Item = (Link, [usize; 2])> {
        let numbered = links.iter().map(|link| {
            let ends = [link.from, link.to].map(|node| self.numbers[node] as usize);
            (link, ends)
        });
        numbered.filter(|(_, ends)| ends[0] != NONE as usize)
    }

    /// Returns the graph of the nodes and links of the channels.
    ///
    /// The root of each channel is linked to the ground, with the conductance of its best link.
    pub fn graph(&self, links: &Links) -> Graph {
        let links = || {
            let links = self.links(links);
            links.map(|(link, [from, to])| (from as u32, to as u32, link.conductance))
        };
        Graph::new(self.count, self.roots.clone(), links)
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
    /// Nodes of one tree after another, each in breadth-first order from its root.
    order: Vec<u32>,
    /// Index of the tree of each node, or [`NONE`] for a node without links.
    components: Vec<u32>,
    /// Periodic image of each node relative to its root, in cells along x and y.
    periods: Vec<[i32; 2]>,
    /// Root of each tree, and the conductance of the best link of the tree. The root is an end of
    /// this link.
    roots: Vec<(u32, f64)>,
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
            roots: Vec::new(),
        };
        for link in ranked.iter().map(|rank| by_rank(links, *rank)) {
            if forest.components[link.from] == NONE {
                forest.grow(links, link.from);
                forest.roots.push((link.from as u32, link.conductance));
            }
        }
        forest
    }

    /// Visits all nodes of the tree of `root`, breadth first. Sets their order, component, period
    /// and parent.
    fn grow(&mut self, links: &Links, root: usize) {
        let component = self.roots.len() as u32;
        self.components[root] = component;
        let mut next = self.order.len();
        self.order.push(root as u32);
        while let Some(&node) = self.order.get(next) {
            next += 1;
            let node = node as usize;
            for direction in 0..DIRECTIONS {
                if self.marks[node] & 1 << direction == 0 {
                    continue;
                }
                let (neighbour, crossings) = step(links, node, direction);
                if self.components[neighbour] != NONE {
                    continue;
                }
                self.components[neighbour] = component;
                let [x, y] = self.periods[node];
                self.periods[neighbour] =
                    [x + i32::from(crossings[0]), y + i32::from(crossings[1])];
                let back = (direction + 2) % DIRECTIONS;
                self.marks[neighbour] |= HAS_PARENT | (back as u8) << PARENT;
                self.order.push(neighbour as u32);
            }
        }
    }

    /// Returns the link of a node to its parent, both as indices of the grid, or `None` for a root.
    fn parent_link(&self, links: &Links, node: usize) -> Option<ParentLink> {
        let marks = self.marks[node];
        (marks & HAS_PARENT != 0).then(|| {
            let direction = usize::from(marks >> PARENT & 3);
            let (parent, crossings) = step(links, node, direction);
            ParentLink {
                node: node as u32,
                parent: parent as u32,
                conductance: link(links, node, direction).conductance,
                crossings,
            }
        })
    }

    /// Returns, for each tree, whether it percolates along x and along y through all links between
    /// the nodes of the tree, including links outside the forest.
    fn percolation(&self, links: &Links) -> Vec<[bool; 2]> {
        let mut percolation = vec![[false; 2]; self.roots.len()];
        for link in links.iter() {
            let [from, to] = [link.from, link.to].map(|node| self.periods[node]);
            let along = &mut percolation[self.components[link.from] as usize];
            for axis in [0, 1] {
                let crossing = i32::from(axis == link.axis && link.crosses_seam);
                along[axis] |= from[axis] + crossing != to[axis];
            }
        }
        percolation
    }
}

/// Returns all links in descending order of conductance. The lower 32 bits of each number are
/// 2 × node + axis.
fn ranked(links: &Links) -> Vec<u64> {
    // The upper 32 bits are the inverted bits of the conductance in single precision.
    let ranks = links.iter().map(|link| {
        let rank = u64::from(!(link.conductance as f32).to_bits());
        rank << 32 | (2 * link.from + link.axis) as u64
    });
    let mut ranked: Vec<u64> = ranks.collect();
    ranked.sort_unstable();
    ranked
}

fn by_rank(links: &Links, rank: u64) -> Link {
    let index = rank as u32 as usize;
    links.leaving(index / 2, index % 2)
}

/// Returns, for each node, the bits of the directions in which it has a link of the maximum
/// spanning forest.
fn best_links(links: &Links, ranked: &[u64]) -> Vec<u8> {
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

/// Returns the neighbour of a node in a direction, and the signed number of crossings of the seams
/// along x and y on the way to it.
fn step(links: &Links, node: usize, direction: usize) -> (usize, [i8; 2]) {
    let link = link(links, node, direction);
    let mut crossings = [0; 2];
    let (neighbour, along) = match direction {
        0 | 1 => (link.to, 1),
        _ => (link.from, -1),
    };
    crossings[link.axis] = along * i8::from(link.crosses_seam);
    (neighbour, crossings)
}

/// Conductances of the links between neighbouring nodes of a periodic map.
pub struct Links {
    nodes: [usize; 2],
    /// Conductances of the links along x and along y, indexed by the first node of the link.
    conductances: [Vec<f64>; 2],
    /// For each axis, the index i for which the links from nodes i to nodes i + 1 cross the seam.
    seams: [usize; 2],
}

/// Link from a node to the next node along an axis.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    pub axis: usize,
    pub from: usize,
    pub to: usize,
    pub conductance: f64,
    /// `true` if the link crosses the seam, where the pressure has its step.
    pub crosses_seam: bool,
}

impl Links {
    /// Computes the conductances of the links of a map of gaps: the harmonic mean of (g/`unit`)³ at
    /// both nodes, times Δy/Δx along x and Δx/Δy along y.
    ///
    /// The conductance is zero if one of the gaps is not positive.
    pub fn between(grid: Grid, gap: &[f64], unit: f64) -> Links {
        let cubed = |gap: &f64| (gap.max(0.0) / unit).powi(3);
        let cubed: Vec<f64> = gap.iter().map(cubed).collect();
        let [step_x, step_y] = grid.spacing();
        let mut links =
            Links { nodes: grid.nodes(), conductances: [Vec::new(), Vec::new()], seams: [0; 2] };
        for (axis, aspect) in [step_y / step_x, step_x / step_y].into_iter().enumerate() {
            let conductance =
                |node| aspect * harmonic_mean(cubed[node], cubed[links.next(node, axis)]);
            links.conductances[axis] = (0..cubed.len()).map(conductance).collect();
            links.seams[axis] = links.least_conducting_section(axis);
        }
        links
    }

    /// Returns the number of nodes of the grid.
    pub fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Iterates over the links with positive conductance, row by row.
    pub fn iter(&self) -> impl Iterator<Item = Link> {
        let [rows, row_nodes] = self.nodes;
        let indices = (0..rows).flat_map(move |i| (0..row_nodes).map(move |j| [i, j]));
        let links = indices.enumerate().flat_map(|(from, indices)| {
            [1, 0].map(|axis| Link {
                axis,
                from,
                to: self.neighbour(from, indices, axis),
                conductance: self.conductances[axis][from],
                crosses_seam: indices[axis] == self.seams[axis],
            })
        });
        links.filter(|link| link.conductance > 0.0)
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

    fn next(&self, node: usize, axis: usize) -> usize {
        self.neighbour(node, self.indices(node), axis)
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
            sums[self.indices(node)[axis]] += conductance;
        }
        let least = sums.iter().enumerate().min_by(|one, other| one.1.total_cmp(other.1));
        least.expect("there is a node").0
    }
}

/// Returns the harmonic mean, or zero if a number is not positive.
fn harmonic_mean(one: f64, other: f64) -> f64 {
    if one > 0.0 && other > 0.0 { 2.0 / (1.0 / one + 1.0 / other) } else { 0.0 }
}
