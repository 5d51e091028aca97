//! Preconditioner by aggregation-based algebraic multigrid with a direct solution of the coarsest
//! graph.
//!
//! The finest level is the grid: its passes run along rows and use vector instructions. Coarser
//! levels are graphs of aggregates (module `graph`). On each level, the cycle is a forward sweep,
//! the correction by the coarser level, and a backward sweep. A sweep on the grid visits one row
//! after the other; it uses new potentials of rows before it and old potentials of its own row. A
//! sweep on a graph is one of Gauss–Seidel.
//!
//! A graph of aggregates is too stiff for smooth currents, so its correction is enlarged
//! ([`OVERCORRECTION`]; Braess, *Computing* 55, 1995, 379). Graphs between the grid and the
//! coarsest graph are solved by two steps of conjugate gradients with a cycle as preconditioner,
//! the K-cycle of Notay & Vassilevski (*Numer. Linear Algebra Appl.* 15, 2008, 473).
//!
//! Near percolation, the conductances on coarse graphs span many decades, and cycles on them
//! converge slowly. The coarsest graph is therefore large, and its elimination exact
//! (module `elimination`).

use super::channels::Links;
use super::elimination::Elimination;
use super::graph::{Coarser, Graph, NONE, Network, Pair};
use super::ratio;

/// Maximum number of nodes of a graph that is solved directly.
const DIRECT: usize = 20_000;

/// Factor of the correction by a graph of aggregates.
const OVERCORRECTION: f64 = 1.5;

/// Relaxation of a sweep on the grid.
///
/// In a channel of single nodes along a row, a sweep without relaxation only reverses potentials of
/// alternating sign.
const RELAXATION: f64 = 0.9;

/// Damping of the Jacobi step that smooths the correction of the grid.
const DAMPING: f64 = 2.0 / 3.0;

/// Hierarchy from the grid to the coarsest graph, which is solved directly.
pub struct Multigrid<'a> {
    links: &'a Links,
    /// Inverse of the sum of the conductances at each node of the grid; one for a node without
    /// links.
    inverse_diagonal: Vec<f32>,
    /// Aggregate of each node of the grid on the first of `levels`, or [`NONE`].
    aggregates: Vec<u32>,
    levels: Vec<Level>,
    coarsest: Coarsest,
    /// Result of the last cycle, in the flow along x and in the flow along y.
    pub potentials: [Vec<f64>; 2],
}

struct Level {
    graph: Graph,
    /// Aggregate of each node on the next level, or [`NONE`].
    aggregates: Vec<u32>,
    currents: Vec<Pair>,
    potentials: Vec<Pair>,
    /// Potentials of the first step of conjugate gradients.
    first: Vec<Pair>,
}

struct Coarsest {
    elimination: Elimination,
    /// Currents, which the solution replaces by potentials.
    values: Vec<Pair>,
}

impl Multigrid<'_> {
    pub fn new(links: &Links) -> Multigrid<'_> {
        let Coarser { mut graph, aggregates } = Coarser::new(links, links.nodes, 1);
        let mut levels: Vec<Level> = Vec::new();
        while graph.count() > DIRECT {
            let coarser = Coarser::new(&graph, links.nodes, levels.len() + 2);
            levels.push(Level::new(graph, coarser.aggregates));
            graph = coarser.graph;
        }
        let elimination = Elimination::new(&graph);
        Multigrid {
            links,
            inverse_diagonal: links.inverse_diagonal(),
            aggregates,
            levels,
            coarsest: Coarsest { elimination, values: vec![[0.0; 2]; graph.count()] },
            potentials: [0, 1].map(|_| vec![0.0; links.count()]),
        }
    }

    /// Computes `potentials` under which approximately the given currents leave the nodes. Returns
    /// `None` if `is_interrupted` returns `true`.
    pub fn precondition(
        &mut self,
        currents: &[Vec<f64>; 2],
        is_interrupted: &dyn Fn() -> bool,
    ) -> Option<()> {
        self.forward_sweep(currents);
        self.restrict(currents, DAMPING);
        solve(&mut self.levels, &mut self.coarsest, is_interrupted)?;
        self.correct(OVERCORRECTION, DAMPING);
        self.backward_sweep(currents);
        Some(())
    }

    /// Computes `potentials` that are constant in each aggregate, without sweeps, for the currents
    /// of a step of the pressure at the seams. Returns `None` if `is_interrupted` returns `true`.
    ///
    /// No aggregate extends across a seam, so these potentials represent the step, which the Jacobi
    /// step of [`Multigrid::precondition`] would blur. Their dissipation is a few times that of the
    /// solution, even where a constriction far from the seam determines the flow.
    pub fn start(
        &mut self,
        currents: &[Vec<f64>; 2],
        is_interrupted: &dyn Fn() -> bool,
    ) -> Option<()> {
        self.restrict(currents, 0.0);
        solve(&mut self.levels, &mut self.coarsest, is_interrupted)?;
        self.correct(1.0, 0.0);
        Some(())
    }

    /// Sets the potentials to those of a forward sweep that starts from potentials of zero.
    fn forward_sweep(&mut self, currents: &[Vec<f64>; 2]) {
        let links = self.links;
        let [rows, row_nodes] = links.nodes;
        let mut inflow = vec![0.0; row_nodes];
        for row in 0..rows {
            let inverse_diagonal = &self.inverse_diagonal[links.row(row)];
            let [up, down, _] = links.row_conductances(row);
            let [above, below] = links.adjacent_rows(row).map(|row| links.row(row));
            for (potentials, currents) in self.potentials.iter_mut().zip(currents) {
                inflow.fill(0.0);
                for (other, conductances) in [(&above, up), (&below, down)] {
                    // Rows after this one still have potentials of zero.
                    if other.start < links.row(row).start {
                        let others = conductances.iter().zip(&potentials[other.clone()]);
                        for (inflow, (conductance, other)) in inflow.iter_mut().zip(others) {
                            *inflow += f64::from(*conductance) * other;
                        }
                    }
                }
                let balances = currents[links.row(row)].iter().zip(&inflow).zip(inverse_diagonal);
                let potentials = potentials[links.row(row)].iter_mut();
                for (potential, ((current, inflow), inverse)) in potentials.zip(balances) {
                    *potential = RELAXATION * (current + inflow) * f64::from(*inverse);
                }
            }
        }
    }

    /// Balances the currents of the rows, from the last row to the first.
    fn backward_sweep(&mut self, currents: &[Vec<f64>; 2]) {
        let links = self.links;
        let mut outflow = vec![0.0; links.nodes[1]];
        for row in (0..links.nodes[0]).rev() {
            let inverse_diagonal = &self.inverse_diagonal[links.row(row)];
            for (potentials, currents) in self.potentials.iter_mut().zip(currents) {
                links.row_outflow(row, three_rows(links, potentials, row), &mut outflow);
                let balances = currents[links.row(row)].iter().zip(&outflow).zip(inverse_diagonal);
                let potentials = potentials[links.row(row)].iter_mut();
                for (potential, ((current, outflow), inverse)) in potentials.zip(balances) {
                    *potential += RELAXATION * (current - outflow) * f64::from(*inverse);
                }
            }
        }
    }

    /// Sets the currents of the first coarse level to the sums of the residual currents, after a
    /// Jacobi step on them: the transpose of [`Multigrid::correct`].
    fn restrict(&mut self, currents: &[Vec<f64>; 2], damping: f64) {
        let links = self.links;
        let coarse = match self.levels.first_mut() {
            Some(level) => &mut level.currents,
            None => &mut self.coarsest.values,
        };
        coarse.fill([0.0; 2]);
        let mut outflow = vec![0.0; links.nodes[1]];
        for axis in [0, 1] {
            let (potentials, currents) = (&self.potentials[axis], &currents[axis]);
            let scaled_residual = |row: usize, scaled: &mut [f64]| {
                links.row_outflow(row, three_rows(links, potentials, row), scaled);
                let row = links.row(row);
                let currents = currents[row.clone()].iter().zip(&self.inverse_diagonal[row]);
                for (scaled, (current, inverse)) in scaled.iter_mut().zip(currents) {
                    *scaled = (current - *scaled) * f64::from(*inverse);
                }
            };
            visit_three_rows(links, scaled_residual, |row, scaled| {
                links.row_outflow(row, scaled, &mut outflow);
                let aggregates = self.aggregates[links.row(row)].iter();
                let nodes = aggregates.zip(&self.inverse_diagonal[links.row(row)]);
                let currents = scaled[1].iter().zip(&outflow);
                for ((aggregate, inverse), (scaled, outflow)) in nodes.zip(currents) {
                    if *aggregate != NONE {
                        coarse[*aggregate as usize][axis] +=
                            scaled / f64::from(*inverse) - damping * outflow;
                    }
                }
            });
        }
    }

    /// Adds the potentials of the aggregates to those of their nodes, after a Jacobi step on them.
    fn correct(&mut self, factor: f64, damping: f64) {
        let links = self.links;
        let corrections = potentials_of(&self.levels, &self.coarsest);
        let mut outflow = vec![0.0; links.nodes[1]];
        for axis in [0, 1] {
            let correction = |row: usize, correction: &mut [f64]| {
                for (correction, &aggregate) in
                    correction.iter_mut().zip(&self.aggregates[links.row(row)])
                {
                    *correction =
                        if aggregate == NONE { 0.0 } else { corrections[aggregate as usize][axis] };
                }
            };
            visit_three_rows(links, correction, |row, correction| {
                links.row_outflow(row, correction, &mut outflow);
                let inverse_diagonal = &self.inverse_diagonal[links.row(row)];
                let changes = correction[1].iter().zip(outflow.iter().zip(inverse_diagonal));
                let potentials = self.potentials[axis][links.row(row)].iter_mut();
                for (potential, (correction, (outflow, inverse))) in potentials.zip(changes) {
                    *potential += factor * (correction - damping * outflow * f64::from(*inverse));
                }
            });
        }
    }
}

/// Returns the row before a row of a map, the row itself, and the row after it.
pub fn three_rows<'a>(links: &Links, map: &'a [f64], row: usize) -> [&'a [f64]; 3] {
    let [before, after] = links.adjacent_rows(row);
    [before, row, after].map(|row| &map[links.row(row)])
}

/// Calls `visit` for each row with the values of three rows: the row before, the row itself, and
/// the row after. `compute` writes the values of a row. Only three rows are in memory.
fn visit_three_rows(
    links: &Links,
    mut compute: impl FnMut(usize, &mut [f64]),
    mut visit: impl FnMut(usize, [&[f64]; 3]),
) {
    let [rows, row_nodes] = links.nodes;
    let [mut before, mut own, mut after] = [0, 1, 2].map(|_| vec![0.0; row_nodes]);
    compute(rows - 1, &mut before);
    compute(0, &mut own);
    for row in 0..rows {
        compute(links.adjacent_rows(row)[1], &mut after);
        visit(row, [&before, &own, &after]);
        std::mem::swap(&mut before, &mut own);
        std::mem::swap(&mut own, &mut after);
    }
}

impl Level {
    fn new(mut graph: Graph, aggregates: Vec<u32>) -> Level {
        graph.forget_positions();
        let [currents, potentials, first] = [0, 1, 2].map(|_| vec![[0.0; 2]; graph.count()]);
        Level { graph, aggregates, currents, potentials, first }
    }
}

/// Returns the potentials of the first of `levels`, or of the coarsest graph if there is none.
fn potentials_of<'a>(levels: &'a [Level], coarsest: &'a Coarsest) -> &'a [Pair] {
    levels.first().map_or(&coarsest.values, |level| &level.potentials)
}

/// Sets the potentials of the first of `levels` for its currents, by two steps of conjugate
/// gradients with a cycle as preconditioner. Overwrites `currents`.
fn solve(
    levels: &mut [Level],
    coarsest: &mut Coarsest,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<()> {
    if is_interrupted() {
        return None;
    }
    if levels.is_empty() {
        coarsest.elimination.solve(&mut coarsest.values);
        return Some(());
    }
    cycle(levels, coarsest, is_interrupted)?;
    let Level { graph, currents, potentials, first, .. } = &mut levels[0];
    std::mem::swap(potentials, first);
    let (mut along, mut curvature) = ([0.0; 2], [0.0; 2]);
    let images = potentials;
    for (node, image) in images.iter_mut().enumerate() {
        *image = graph.outflow(node, first);
        for axis in [0, 1] {
            along[axis] += first[node][axis] * currents[node][axis];
            curvature[axis] += first[node][axis] * image[axis];
        }
    }
    let length = [0, 1].map(|axis| ratio(along[axis], curvature[axis]));
    for (current, image) in currents.iter_mut().zip(images) {
        current[0] -= length[0] * image[0];
        current[1] -= length[1] * image[1];
    }
    cycle(levels, coarsest, is_interrupted)?;
    let Level { graph, currents, potentials, first, .. } = &mut levels[0];
    let (mut common, mut second_along, mut second_curvature) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for node in 0..graph.count() {
        let image = graph.outflow(node, potentials);
        for axis in [0, 1] {
            common[axis] += first[node][axis] * image[axis];
            second_along[axis] += potentials[node][axis] * currents[node][axis];
            second_curvature[axis] += potentials[node][axis] * image[axis];
        }
    }
    let projection = [0, 1].map(|axis| ratio(common[axis], curvature[axis]));
    let second_length = [0, 1].map(|axis| {
        ratio(second_along[axis], second_curvature[axis] - projection[axis] * common[axis])
    });
    let first_length = [0, 1].map(|axis| length[axis] - second_length[axis] * projection[axis]);
    for (potential, first) in potentials.iter_mut().zip(first) {
        for axis in [0, 1] {
            potential[axis] =
                second_length[axis] * potential[axis] + first_length[axis] * first[axis];
        }
    }
    Some(())
}

/// Sets the potentials of the first of `levels` by one cycle for its currents.
fn cycle(
    levels: &mut [Level],
    coarsest: &mut Coarsest,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<()> {
    let (level, coarser) = levels.split_first_mut().expect("there is a level");
    let Level { graph, currents, potentials, aggregates, .. } = level;
    graph.forward_sweep(currents, potentials);
    let coarse = match coarser.first_mut() {
        Some(coarser) => &mut coarser.currents,
        None => &mut coarsest.values,
    };
    coarse.fill([0.0; 2]);
    for (node, &aggregate) in aggregates.iter().enumerate() {
        if aggregate != NONE {
            let (coarse, current) =
                (&mut coarse[aggregate as usize], graph.unbalanced(node, potentials));
            coarse[0] += current[0];
            coarse[1] += current[1];
        }
    }
    solve(coarser, coarsest, is_interrupted)?;
    let corrections = potentials_of(coarser, coarsest);
    for (potential, &aggregate) in potentials.iter_mut().zip(&*aggregates) {
        if aggregate != NONE {
            let correction = corrections[aggregate as usize];
            potential[0] += OVERCORRECTION * correction[0];
            potential[1] += OVERCORRECTION * correction[1];
        }
    }
    graph.backward_sweep(currents, potentials);
    Some(())
}
