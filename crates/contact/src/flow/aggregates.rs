//! Aggregates of strongly linked nodes, and the coarser graph that they make.
//!
//! Each node joins the unaggregated neighbour to which it is linked best, unless another link of it is
//! far better: then the aggregate of that neighbour (the pairwise aggregation of Notay, *Electron. Trans.
//! Numer. Anal.* 37, 2010, 123, for matrices whose rows sum to zero). Twice over, that is about
//! four nodes to an aggregate.

use super::channels::NONE;
use super::graph::Graph;

/// A link is as good as the best one of a node from this share of its conductance on.
const STRONG: f64 = 0.1;

/// A graph of aggregates, and which aggregate each node belongs to: none, where it has no links.
pub struct Coarser {
    pub graph: Graph,
    pub aggregates: Vec<u32>,
}

impl Coarser {
    /// Pairs of pairs.
    pub fn of(graph: &Graph) -> Coarser {
        let pairs = Coarser::pairs(graph);
        let fours = Coarser::pairs(&pairs.graph);
        let through = |pair: u32| match pair {
            NONE => NONE,
            pair => fours.aggregates[pair as usize],
        };
        Coarser {
            graph: fours.graph,
            aggregates: pairs.aggregates.into_iter().map(through).collect(),
        }
    }

    fn pairs(graph: &Graph) -> Coarser {
        let (aggregates, count) = aggregates(graph);
        Coarser { graph: merged(graph, &aggregates, count), aggregates }
    }
}

/// The links of nodes to those of lower numbers.
struct Below {
    starts: Vec<u32>,
    others: Vec<(u32, f64)>,
}

impl Below {
    fn of(graph: &Graph) -> Below {
        let mut starts = vec![0_u32; graph.count() + 1];
        for (_, high, _) in graph.links() {
            starts[high + 1] += 1;
        }
        for node in 0..graph.count() {
            starts[node + 1] += starts[node];
        }
        let mut filled = starts.clone();
        let mut others = vec![(0, 0.0); starts[graph.count()] as usize];
        for (low, high, conductance) in graph.links() {
            others[filled[high] as usize] = (low as u32, conductance);
            filled[high] += 1;
        }
        Below { starts, others }
    }

    fn of_node(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let [start, end] = [node, node + 1].map(|node| self.starts[node] as usize);
        let others = self.others[start..end].iter();
        others.map(|&(other, conductance)| (other as usize, conductance))
    }
}

/// The aggregate of each node, and how many there are.
fn aggregates(graph: &Graph) -> (Vec<u32>, usize) {
    let below = Below::of(graph);
    let mut aggregates = vec![NONE; graph.count()];
    let mut count = 0;
    for node in 0..graph.count() {
        if aggregates[node] != NONE {
            continue;
        }
        let (mut best, mut free) = (None, None);
        for (other, conductance) in graph.above(node).chain(below.of_node(node)) {
            let is_better =
                |than: Option<(usize, f64)>| than.is_none_or(|(_, least)| conductance > least);
            if is_better(best) {
                best = Some((other, conductance));
            }
            if aggregates[other] == NONE && is_better(free) {
                free = Some((other, conductance));
            }
        }
        let Some((nearest, strongest)) = best else {
            continue;
        };
        match free {
            Some((other, conductance)) if conductance >= STRONG * strongest => {
                aggregates[node] = count;
                aggregates[other] = count;
                count += 1;
            }
            _ => aggregates[node] = aggregates[nearest],
        }
    }
    (aggregates, count as usize)
}

/// The graph of aggregates: between two of them, the links of their nodes in parallel.
fn merged(graph: &Graph, aggregates: &[u32], count: usize) -> Graph {
    let between = || {
        graph.links().filter_map(|(one, other, conductance)| {
            let [one, other] = [one, other].map(|node| aggregates[node]);
            (one != other).then_some((one.min(other), one.max(other), conductance))
        })
    };
    let grounds = graph.grounds().iter();
    let grounds = grounds.map(|&(node, conductance)| (aggregates[node as usize], conductance));
    let grounds = grounds.filter(|(aggregate, _)| *aggregate != NONE).collect();
    let separate = Graph::of(count, Vec::new(), between);
    let mut merged: Vec<(u32, u32, f64)> = Vec::with_capacity(count * 3);
    let mut places = vec![NONE; count];
    for node in 0..count {
        let first = merged.len();
        for (other, conductance) in separate.above(node) {
            let place = places[other] as usize;
            match merged.get_mut(place) {
                Some(link) if place >= first => link.2 += conductance,
                _ => {
                    places[other] = merged.len() as u32;
                    merged.push((node as u32, other as u32, conductance));
                }
            }
        }
    }
    drop(separate);
    Graph::of(count, grounds, || merged.iter().copied())
}
