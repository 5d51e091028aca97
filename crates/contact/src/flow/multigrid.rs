//! A preconditioner: multigrid on graphs of aggregates.
//!
//! On each graph a sweep of Gauss and Seidel goes before the correction by the coarser one, and one
//! in the other order after it. The coarser graph is solved by conjugate gradients, preconditioned
//! alike, until a step gains little: three mostly, as in the K-cycle of Notay & Vassilevski
//! (*Numer. Linear Algebra Appl.* 15, 2008, 473). What is gained is measured by the dissipation:
//! near percolation the currents of a weakly linked part of the map are nothing beside others, and
//! decide what flows. The coarsest graph is solved directly.
//!
//! The nodes of the coarser graph are aggregates of strongly linked ones. Each node joins the
//! unaggregated neighbour to which it is linked best, unless another link of it is far better: then
//! the aggregate of that neighbour (the pairwise aggregation of Notay, *Electron. Trans. Numer.
//! Anal.* 37, 2010, 123, for matrices whose rows sum to zero). Twice over, that is about four nodes
//! to an aggregate.

use super::channels::NONE;
use super::graph::{Factors, Graph, Pair, Search, add};

/// Steps on a coarser graph end with one that gains no more than this share of what all have
/// gained.
const ENOUGH: f64 = 0.1;

/// The most steps on a graph of more nodes than [`SMALL`], so that all of them together cost a few
/// times as much as those on the finest one; and on one of fewer, whose aggregates are the least
/// alike.
const MOST_STEPS: usize = 6;

const MOST_STEPS_WHERE_SMALL: usize = 40;

const SMALL: usize = 1 << 13;

/// A graph of no more nodes is solved directly.
const DIRECT: usize = 600;

/// Graphs, each of aggregates of the one before, down to one that is solved directly.
pub struct Multigrid {
    levels: Vec<Level>,
}

struct Level {
    graph: Graph,
    /// The node of the next graph that each one belongs to.
    aggregates: Vec<u32>,
    /// Of the last graph alone.
    factors: Option<Factors>,
    /// What is given, less what is done.
    currents: Vec<Pair>,
    /// What the cycle has found.
    potentials: Vec<Pair>,
    work: Vec<Pair>,
    search: Search,
    solution: Vec<Pair>,
}

impl Multigrid {
    pub fn of(graph: Graph) -> Multigrid {
        let mut levels = Vec::new();
        let mut graph = graph;
        while graph.count() > DIRECT {
            let Coarser { graph: coarser, aggregates } = Coarser::of(&graph);
            levels.push(Level::new(graph, aggregates, None));
            graph = coarser;
        }
        let factors = Factors::of(&graph);
        levels.push(Level::new(graph, Vec::new(), Some(factors)));
        Multigrid { levels }
    }

    /// The graph itself.
    pub fn graph(&self) -> &Graph {
        &self.levels[0].graph
    }

    /// Finds potentials under which about these currents leave the nodes, unless it is interrupted.
    pub fn precondition(
        &mut self,
        currents: &[Pair],
        is_interrupted: &dyn Fn() -> bool,
    ) -> Option<()> {
        self.levels[0].currents.copy_from_slice(currents);
        cycle(&mut self.levels, is_interrupted)
    }

    /// What was found last.
    pub fn potentials(&self) -> &[Pair] {
        &self.levels[0].potentials
    }
}

impl Level {
    fn new(graph: Graph, aggregates: Vec<u32>, factors: Option<Factors>) -> Level {
        let count = graph.count();
        Level {
            currents: vec![[0.0; 2]; count],
            potentials: vec![[0.0; 2]; count],
            work: vec![[0.0; 2]; count],
            search: Search::new(count),
            solution: vec![[0.0; 2]; count],
            aggregates,
            factors,
            graph,
        }
    }

    fn most_steps(&self) -> usize {
        if self.graph.count() > SMALL { MOST_STEPS } else { MOST_STEPS_WHERE_SMALL }
    }
}

/// Sweep, correction by the coarser graph, sweep: potentials of the first level from its currents.
fn cycle(levels: &mut [Level], is_interrupted: &dyn Fn() -> bool) -> Option<()> {
    let (level, coarser) = levels.split_first_mut().expect("there is a level");
    let Level { graph, currents, potentials, work, .. } = level;
    if let Some(factors) = &level.factors {
        factors.solve(currents, potentials);
        return Some(());
    }
    graph.sweep_up(currents, work, potentials);
    if let Some(coarse) = coarser.first_mut() {
        coarse.currents.fill([0.0; 2]);
        for (node, &aggregate) in level.aggregates.iter().enumerate() {
            if aggregate != NONE {
                let left = graph.left_by_sweep(node, potentials);
                let current = &mut coarse.currents[aggregate as usize];
                *current = [0, 1].map(|of| current[of] + left[of]);
            }
        }
        solve(coarser, is_interrupted)?;
        for (potential, &aggregate) in potentials.iter_mut().zip(&level.aggregates) {
            if aggregate != NONE {
                let correction = coarser[0].solution[aggregate as usize];
                *potential = [0, 1].map(|of| potential[of] + correction[of]);
            }
        }
    }
    work.copy_from_slice(currents);
    graph.take_off(potentials, work);
    graph.sweep_down(work, potentials);
    Some(())
}

/// Conjugate gradients on the first level, each step preconditioned by a cycle: its solution.
fn solve(levels: &mut [Level], is_interrupted: &dyn Fn() -> bool) -> Option<()> {
    let level = &mut levels[0];
    if let Some(factors) = &level.factors {
        factors.solve(&level.currents, &mut level.solution);
        return Some(());
    }
    levels[0].solution.fill([0.0; 2]);
    levels[0].search.restart();
    let mut gained = [0.0; 2];
    for _ in 0..levels[0].most_steps() {
        if is_interrupted() {
            return None;
        }
        cycle(levels, is_interrupted)?;
        let level = &mut levels[0];
        let search = &mut level.search;
        let step = search.turn(&level.graph, &level.potentials, &level.currents);
        add(&mut level.solution, step.length, &search.direction);
        gained = [0, 1].map(|of| gained[of] + step.gain[of]);
        if [0, 1].iter().all(|&of| step.gain[of] <= ENOUGH * gained[of]) {
            break;
        }
        add(&mut level.currents, step.length.map(|length| -length), &search.image);
    }
    Some(())
}

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
