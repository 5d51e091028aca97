//! Preconditioner by aggregation-based algebraic multigrid with K-cycles.
//!
//! On each level, the cycle is a forward Gauss–Seidel sweep, the correction by the coarser level,
//! and a backward sweep. The coarser level is solved by preconditioned conjugate gradients until a
//! step gains little, mostly in three steps: the K-cycle of Notay & Vassilevski (*Numer. Linear
//! Algebra Appl.* 15, 2008, 473). The gain of a step is the decrease of the squared error in the
//! norm of the matrix (the dissipation), because near percolation small currents in weakly linked
//! parts of the map determine the flow. The coarsest level is solved directly.
//!
//! Nodes of the coarser graph are aggregates of strongly linked nodes. Each node joins the
//! neighbour without aggregate to which it has the best link. If another of its links is much
//! better, it joins the aggregate of that neighbour. This is the pairwise aggregation of Notay
//! (*Electron. Trans. Numer. Anal.* 37, 2010, 123) for matrices with zero row sums. Two passes give
//! about four nodes per aggregate.

use super::channels::NONE;
use super::graph::{ConjugateDirection, Factors, Graph, Pair, add};

/// Minimum gain of a conjugate-gradient step, as a fraction of the gain of all steps so far. After
/// a step with less gain, the iteration ends.
const LEAST_GAIN: f64 = 0.1;

/// Maximum number of conjugate-gradient steps on a graph of more than [`SMALL`] nodes.
///
/// This limit keeps the total cost of all coarser levels below a few times the cost of the finest
/// level.
const MAX_STEPS: usize = 6;

/// Maximum number of conjugate-gradient steps on a graph of at most [`SMALL`] nodes.
///
/// These coarse graphs have the most varied conductances.
const MAX_STEPS_SMALL: usize = 40;

const SMALL: usize = 1 << 13;

/// Maximum number of nodes of a graph that is solved directly.
const DIRECT: usize = 600;

/// Hierarchy of graphs from fine to coarse; the coarsest is solved directly.
pub struct Multigrid {
    levels: Vec<Level>,
}

struct Level {
    graph: Graph,
    /// For each node, the index of its aggregate, which is a node of the coarser graph, or
    /// [`NONE`].
    aggregates: Vec<u32>,
    /// Factorisation of the graph on the coarsest level; `None` on other levels.
    factors: Option<Factors>,
    currents: Vec<Pair>,
    /// Result of the last cycle.
    potentials: Vec<Pair>,
    work: Vec<Pair>,
    conjugate: ConjugateDirection,
    solution: Vec<Pair>,
}

impl Multigrid {
    pub fn new(graph: Graph) -> Multigrid {
        let mut levels = Vec::new();
        let mut graph = graph;
        while graph.count() > DIRECT {
            let Coarser { graph: coarser, aggregates } = Coarser::new(&graph);
            levels.push(Level::new(graph, aggregates, None));
            graph = coarser;
        }
        let factors = Factors::new(&graph);
        levels.push(Level::new(graph, Vec::new(), Some(factors)));
        Multigrid { levels }
    }

    pub fn graph(&self) -> &Graph {
        &self.levels[0].graph
    }

    /// Computes potentials under which approximately the given currents leave the nodes;
    /// [`Multigrid::potentials`] returns them. Returns `None` if `is_interrupted` returns `true`.
    pub fn precondition(
        &mut self,
        currents: &[Pair],
        is_interrupted: &dyn Fn() -> bool,
    ) -> Option<()> {
        self.levels[0].currents.copy_from_slice(currents);
        cycle(&mut self.levels, is_interrupted)
    }

    /// Returns the potentials that the last call of [`Multigrid::precondition`] computed.
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
            conjugate: ConjugateDirection::new(count),
            solution: vec![[0.0; 2]; count],
            aggregates,
            factors,
            graph,
        }
    }

    fn max_steps(&self) -> usize {
        if self.graph.count() > SMALL { MAX_STEPS } else { MAX_STEPS_SMALL }
    }
}

/// Sets the `potentials` of the first of `levels` by one cycle for its `currents`.
fn cycle(levels: &mut [Level], is_interrupted: &dyn Fn() -> bool) -> Option<()> {
    let (level, coarser) = levels.split_first_mut().expect("there is a level");
    let Level { graph, currents, potentials, work, .. } = level;
    if let Some(factors) = &level.factors {
        factors.solve(currents, potentials);
        return Some(());
    }
    graph.forward_sweep(currents, work, potentials);
    if let Some(coarse) = coarser.first_mut() {
        coarse.currents.fill([0.0; 2]);
        for (node, &aggregate) in level.aggregates.iter().enumerate() {
            if aggregate != NONE {
                let residual = graph.residual_after_sweep(node, potentials);
                let current = &mut coarse.currents[aggregate as usize];
                *current = [0, 1].map(|axis| current[axis] + residual[axis]);
            }
        }
        solve(coarser, is_interrupted)?;
        for (potential, &aggregate) in potentials.iter_mut().zip(&level.aggregates) {
            if aggregate != NONE {
                let correction = coarser[0].solution[aggregate as usize];
                *potential = [0, 1].map(|axis| potential[axis] + correction[axis]);
            }
        }
    }
    work.copy_from_slice(currents);
    graph.subtract_currents(potentials, work);
    graph.backward_sweep(work, potentials);
    Some(())
}

/// Sets the `solution` of the first of `levels` for its `currents`, by conjugate gradients with a
/// cycle as preconditioner. Overwrites `currents`.
fn solve(levels: &mut [Level], is_interrupted: &dyn Fn() -> bool) -> Option<()> {
    let level = &mut levels[0];
    if let Some(factors) = &level.factors {
        factors.solve(&level.currents, &mut level.solution);
        return Some(());
    }
    levels[0].solution.fill([0.0; 2]);
    levels[0].conjugate.restart();
    let mut gained = [0.0; 2];
    for _ in 0..levels[0].max_steps() {
        if is_interrupted() {
            return None;
        }
        cycle(levels, is_interrupted)?;
        let level = &mut levels[0];
        let conjugate = &mut level.conjugate;
        let step = conjugate.step(&level.graph, &level.potentials, &level.currents);
        add(&mut level.solution, step.length, &conjugate.direction);
        gained = [0, 1].map(|axis| gained[axis] + step.gain[axis]);
        if [0, 1].iter().all(|&axis| step.gain[axis] <= LEAST_GAIN * gained[axis]) {
            break;
        }
        add(&mut level.currents, step.length.map(|length| -length), &conjugate.image);
    }
    Some(())
}

/// Minimum conductance of a link between two nodes that form an aggregate, as a fraction of the
/// best link of one of them.
const STRONG: f64 = 0.1;

/// Coarser graph, in which each node is an aggregate of nodes of a finer graph.
///
/// `aggregates` contains the index of the aggregate of each finer node, or [`NONE`] for a node
/// without links.
pub struct Coarser {
    pub graph: Graph,
    pub aggregates: Vec<u32>,
}

impl Coarser {
    /// Aggregates the nodes of a graph by two passes of pairwise aggregation, to about four nodes
    /// per aggregate.
    pub fn new(graph: &Graph) -> Coarser {
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

/// Links of each node to nodes of lower index.
struct LowerLinks {
    starts: Vec<u32>,
    others: Vec<(u32, f64)>,
}

impl LowerLinks {
    fn new(graph: &Graph) -> LowerLinks {
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
        LowerLinks { starts, others }
    }

    fn of_node(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let [start, end] = [node, node + 1].map(|node| self.starts[node] as usize);
        let others = self.others[start..end].iter();
        others.map(|&(other, conductance)| (other as usize, conductance))
    }
}

/// Returns the index of the aggregate of each node, and the number of aggregates, after one pass of
/// pairwise aggregation.
fn aggregates(graph: &Graph) -> (Vec<u32>, usize) {
    let lower_links = LowerLinks::new(graph);
    let mut aggregates = vec![NONE; graph.count()];
    let mut count = 0;
    for node in 0..graph.count() {
        if aggregates[node] != NONE {
            continue;
        }
        let (mut best, mut free) = (None, None);
        for (other, conductance) in graph.above(node).chain(lower_links.of_node(node)) {
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

/// Returns the graph of the `count` aggregates.
///
/// The conductance between two aggregates is the sum of the conductances between their nodes.
fn merged(graph: &Graph, aggregates: &[u32], count: usize) -> Graph {
    let between = || {
        graph.links().filter_map(|(one, other, conductance)| {
            let [one, other] = [one, other].map(|node| aggregates[node]);
            (one != other).then_some((one.min(other), one.max(other), conductance))
        })
    };
    let grounds = graph.grounds().iter().filter_map(|&(node, conductance)| {
        let aggregate = aggregates[node as usize];
        (aggregate != NONE).then_some((aggregate, conductance))
    });
    let separate = Graph::new(count, Vec::new(), between);
    let mut merged: Vec<(u32, u32, f64)> = Vec::with_capacity(count * 3);
    let mut link_of = vec![NONE; count];
    for node in 0..count {
        let first = merged.len();
        for (other, conductance) in separate.above(node) {
            let index = link_of[other] as usize;
            match merged.get_mut(index) {
                Some(link) if index >= first => link.2 += conductance,
                _ => {
                    link_of[other] = merged.len() as u32;
                    merged.push((node as u32, other as u32, conductance));
                }
            }
        }
    }
    drop(separate);
    Graph::new(count, grounds.collect(), || merged.iter().copied())
}
