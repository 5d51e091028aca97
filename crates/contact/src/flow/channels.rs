//! The links between neighbouring nodes of a periodic map of gaps: their conductances, what of them
//! goes around the cell, and the tree that spans it.
//!
//! The tree is made of the links that conduct best (Kruskal), so that whatever a solution leaves of
//! a node's balance finds a way to every other node that costs little dissipation. Counted along
//! it, each node lies in some period of the map; a link between two nodes of the tree that
//! disagrees closes a path around the cell.

use super::graph::Graph;
use crate::grid::Grid;

/// No number: of nodes that carry nothing, and of the parents of roots.
pub const NONE: u32 = u32::MAX;

/// The nodes of all channels that go around the cell, along whichever axis, numbered as the mesh
/// is.
pub struct Channels {
    /// Whether some channel goes around along x, and along y.
    pub go_around: [bool; 2],
    /// How many nodes they have.
    pub count: usize,
    /// The number of each node of the mesh.
    numbers: Vec<u32>,
    /// From the leaves of the tree to its roots, which are left out.
    pub twigs: Vec<Twig>,
    /// The roots, and what their best link conducts.
    roots: Vec<(u32, f64)>,
}

/// The link from a node to its parent in the tree.
#[derive(Debug, Clone, Copy)]
pub struct Twig {
    pub node: u32,
    pub parent: u32,
    pub conductance: f64,
    /// How often it crosses the seam of each axis in its direction, counted from node to parent.
    pub crossings: [i8; 2],
}

impl Channels {
    /// Those that links make.
    pub fn along(links: &Links) -> Channels {
        let tree = Tree::of(links);
        let around = tree.ways_around(links);
        let goes_around = |node: usize| match tree.components[node] {
            NONE => false,
            component => around[component as usize].contains(&true),
        };
        let mut count = 0;
        let numbers: Vec<u32> = (0..links.count())
            .map(|node| {
                if goes_around(node) {
                    count += 1;
                    count - 1
                } else {
                    NONE
                }
            })
            .collect();
        let twigs = tree.order.iter().rev().filter_map(|&node| {
            let twig = tree.twig(links, node as usize)?;
            (numbers[node as usize] != NONE).then(|| Twig {
                node: numbers[node as usize],
                parent: numbers[twig.parent as usize],
                ..twig
            })
        });
        let roots = tree.roots.iter().filter_map(|&(root, conductance)| {
            let number = numbers[root as usize];
            (number != NONE).then_some((number, conductance))
        });
        Channels {
            roots: roots.collect(),
            go_around: [0, 1].map(|axis| around.iter().any(|around| around[axis])),
            count: count as usize,
            twigs: twigs.collect(),
            numbers,
        }
    }

    /// The links of the channels, with the numbers of the nodes that they join.
    pub fn links<'a>(&'a self, links: &'a Links) -> impl Iterator<Item = (Link, [usize; 2])> {
        let numbered = links.each().map(|link| {
            let ends = [link.from, link.to].map(|node| self.numbers[node] as usize);
            (link, ends)
        });
        numbered.filter(|(_, ends)| ends[0] != NONE as usize)
    }

    /// They, as a graph; the roots of the tree are linked to the ground as well as to their best
    /// neighbours.
    pub fn graph(&self, links: &Links) -> Graph {
        let links = || {
            let links = self.links(links);
            links.map(|(link, [from, to])| (from as u32, to as u32, link.conductance))
        };
        Graph::of(self.count, self.roots.clone(), links)
    }
}

/// Directions in which the tree leaves a node: along x and y, and against them.
const DIRECTIONS: usize = 4;

/// Where the direction of the parent is kept, and that there is one.
const PARENT: u32 = 4;

const HAS_PARENT: u8 = 1 << 6;

/// A forest that spans the nodes of all links.
struct Tree {
    /// Of each node: in which directions it has links of the tree, and where its parent is.
    marks: Vec<u8>,
    /// Roots before what hangs on them.
    order: Vec<u32>,
    /// Which tree a node belongs to.
    components: Vec<u32>,
    /// The period that each node lies in, counted from its root.
    periods: Vec<[i32; 2]>,
    /// The root of each tree, where its best link begins, and what that one conducts.
    roots: Vec<(u32, f64)>,
}

impl Tree {
    fn of(links: &Links) -> Tree {
        let nodes = links.count();
        let ranked = ranked(links);
        let mut tree = Tree {
            marks: best_links(links, &ranked),
            order: Vec::new(),
            components: vec![NONE; nodes],
            periods: vec![[0; 2]; nodes],
            roots: Vec::new(),
        };
        for link in ranked.iter().map(|rank| by_rank(links, *rank)) {
            if tree.components[link.from] == NONE {
                tree.grow(links, link.from);
                tree.roots.push((link.from as u32, link.conductance));
            }
        }
        tree
    }

    /// Reaches all nodes from a root, the near ones first.
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

    /// The link of a node to its parent, in numbers of the mesh.
    fn twig(&self, links: &Links, node: usize) -> Option<Twig> {
        let marks = self.marks[node];
        (marks & HAS_PARENT != 0).then(|| {
            let direction = usize::from(marks >> PARENT & 3);
            let (parent, crossings) = step(links, node, direction);
            Twig {
                node: node as u32,
                parent: parent as u32,
                conductance: link(links, node, direction).conductance,
                crossings,
            }
        })
    }

    /// Along which axes each tree, with the links that it leaves out, goes around the cell.
    fn ways_around(&self, links: &Links) -> Vec<[bool; 2]> {
        let mut around = vec![[false; 2]; self.roots.len()];
        for link in links.each() {
            let [from, to] = [link.from, link.to].map(|node| self.periods[node]);
            let around = &mut around[self.components[link.from] as usize];
            for axis in [0, 1] {
                let crossing = i32::from(axis == link.axis && link.crosses_seam);
                around[axis] |= from[axis] + crossing != to[axis];
            }
        }
        around
    }
}

/// All links, those that conduct best first.
fn ranked(links: &Links) -> Vec<u64> {
    // Single precision orders them well enough, and leaves room for who they are.
    let ranked = links.each().map(|link| {
        let rank = u64::from(!(link.conductance as f32).to_bits());
        rank << 32 | (2 * link.from + link.axis) as u64
    });
    let mut ranked: Vec<u64> = ranked.collect();
    ranked.sort_unstable();
    ranked
}

fn by_rank(links: &Links, rank: u64) -> Link {
    let who = rank as u32 as usize;
    links.leaving(who / 2, who % 2)
}

/// The links that conduct best and close no path, as marks of the nodes that they join.
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

/// Where a direction leads from a node, and which seams are crossed on the way.
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

/// The links of each node to the next one along x, and to the next one along y.
pub struct Links {
    nodes: [usize; 2],
    /// By axis, and by the node that a link leaves.
    conductances: [Vec<f64>; 2],
    /// By axis: links that leave a node of this place along it cross the seam, where the next
    /// period of the pressure begins.
    seams: [usize; 2],
}

/// A link that conducts.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    pub axis: usize,
    pub from: usize,
    pub to: usize,
    pub conductance: f64,
    /// Whether the pressure of the next period begins on the way.
    pub crosses_seam: bool,
}

impl Links {
    /// Those of a map of gaps, in such a unit: none to where the gap is not positive.
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

    /// Nodes of the mesh.
    pub fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Every link that conducts, row by row.
    pub fn each(&self) -> impl Iterator<Item = Link> {
        let [rows, row_nodes] = self.nodes;
        let places = (0..rows).flat_map(move |i| (0..row_nodes).map(move |j| [i, j]));
        let links = places.enumerate().flat_map(|(from, place)| {
            [1, 0].map(|axis| Link {
                axis,
                from,
                to: self.beyond(from, place, axis),
                conductance: self.conductances[axis][from],
                crosses_seam: place[axis] == self.seams[axis],
            })
        });
        links.filter(|link| link.conductance > 0.0)
    }

    /// The link that leaves a node along an axis, whether it conducts or not.
    pub fn leaving(&self, from: usize, axis: usize) -> Link {
        let place = self.place(from);
        Link {
            axis,
            from,
            to: self.beyond(from, place, axis),
            conductance: self.conductances[axis][from],
            crosses_seam: place[axis] == self.seams[axis],
        }
    }

    /// The link that reaches a node along an axis.
    pub fn reaching(&self, to: usize, axis: usize) -> Link {
        let [rows, row_nodes] = self.nodes;
        let place = self.place(to);
        let from = match (axis, place[axis]) {
            (0, 0) => to + (rows - 1) * row_nodes,
            (0, _) => to - row_nodes,
            (_, 0) => to + row_nodes - 1,
            _ => to - 1,
        };
        self.leaving(from, axis)
    }

    fn next(&self, node: usize, axis: usize) -> usize {
        self.beyond(node, self.place(node), axis)
    }

    fn beyond(&self, node: usize, place: [usize; 2], axis: usize) -> usize {
        let [rows, row_nodes] = self.nodes;
        let is_last = place[axis] + 1 == self.nodes[axis];
        match (axis, is_last) {
            (0, false) => node + row_nodes,
            (0, true) => node - (rows - 1) * row_nodes,
            (_, false) => node + 1,
            (_, true) => node + 1 - row_nodes,
        }
    }

    fn place(&self, node: usize) -> [usize; 2] {
        [node / self.nodes[1], node % self.nodes[1]]
    }

    /// Where the links along an axis conduct least, taken together. Any section might be the seam;
    /// with this one rounding takes least from pressures that fall over a single constriction.
    fn least_conducting_section(&self, axis: usize) -> usize {
        let mut sums = vec![0.0; self.nodes[axis]];
        for (node, conductance) in self.conductances[axis].iter().enumerate() {
            sums[self.place(node)[axis]] += conductance;
        }
        let sums = sums.iter().enumerate();
        let least = sums.min_by(|one, other| one.1.total_cmp(other.1));
        least.expect("there is a node").0
    }
}

/// Twice the conductance of two in series.
fn harmonic_mean(one: f64, other: f64) -> f64 {
    if one > 0.0 && other > 0.0 { 2.0 / (1.0 / one + 1.0 / other) } else { 0.0 }
}
