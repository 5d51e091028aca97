//! The matrix of a small graph, factored: L D Lᵀ, dense.

use super::graph::{Graph, Pair};

/// L, row by row below its diagonal of ones, with 1/D on the diagonal.
pub struct Factors {
    count: usize,
    rows: Vec<f64>,
}

impl Factors {
    /// Those of a graph, in which every channel is linked to the ground.
    pub fn of(graph: &Graph) -> Factors {
        let count = graph.count();
        let mut rows = vec![0.0; count * count];
        for (node, sum) in graph.diagonal().enumerate() {
            rows[node * count + node] = sum;
        }
        for (low, high, conductance) in graph.links() {
            rows[high * count + low] -= conductance;
        }
        for row in 0..count {
            // So far L D stands before the diagonal of the rows above, and A in this one.
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

    /// The potentials under which these currents leave the nodes.
    pub fn solve(&self, currents: &[Pair], potentials: &mut [Pair]) {
        potentials.copy_from_slice(currents);
        let row = |node: usize| &self.rows[node * self.count..];
        for node in 0..self.count {
            let before = row(node)[..node].iter().zip(&potentials[..node]);
            let sum = before.fold(potentials[node], |sum, (entry, potential)| {
                [0, 1].map(|of| sum[of] - entry * potential[of])
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
                *potential = [0, 1].map(|of| potential[of] - entry * own[0][of]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn potentials_make_the_currents_that_were_given() {
        let links = [(0, 1, 1.0), (1, 2, 1e-6), (2, 3, 5.0), (0, 3, 1e-9), (1, 3, 0.3)];
        let graph = Graph::of(4, vec![(2, 2.0)], || links.into_iter());
        let currents = [[1.0, 0.0], [-2.0, 0.5], [0.0, 0.25], [1.0, -0.75]];
        let mut potentials = [[0.0; 2]; 4];
        Factors::of(&graph).solve(&currents, &mut potentials);
        let mut found = [[0.0; 2]; 4];
        graph.currents(&potentials, &mut found);
        for (found, given) in found.iter().zip(&currents) {
            assert!((found[0] - given[0]).abs() < 1e-12 && (found[1] - given[1]).abs() < 1e-12);
        }
    }
}
