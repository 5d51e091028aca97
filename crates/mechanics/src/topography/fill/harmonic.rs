//! Harmonic filling by Laplace's equation in the holes of a map.
//!
//! At each missing node, Σ w (h − h′) = 0 over its neighbours along x and y, with w = 1/Δx² and
//! 1/Δy². The measured heights are boundary values. At the edge of a map that is not periodic, the
//! normal derivative is zero.
//!
//! The matrix of each hole is symmetric and positive definite, because every hole has measured
//! neighbours. It is solved by conjugate gradients with an incomplete Cholesky preconditioner; the
//! number of iterations grows with the square root of the width of the hole. Holes are solved one
//! by one, and sums have the order of the nodes, so the result does not depend on threads.

use crate::topography::surface::Scan;

/// Tolerance ε of the residual of the linear system: ‖r‖ ≤ ε ‖b‖, with the right-hand side b.
///
/// Heights in b are relative to the mean of the measured neighbours of the hole.
const TOLERANCE: f64 = 1e-15;

/// Maximum number of conjugate-gradient solutions for a hole. Each solution after the first one is
/// for the residual of the previous solutions, to correct accumulated rounding errors.
const ROUNDS: usize = 3;

/// Gives heights to the missing points of a map by solving Laplace's equation in each hole.
pub fn filled(scan: Scan, is_periodic: bool) -> Scan {
    let lattice = Lattice::new(&scan, is_periodic);
    let mut index_in_hole = vec![NONE; scan.heights().len()];
    let mut solved = Vec::new();
    for node in 0..index_in_hole.len() {
        if scan.is_missing(node) && index_in_hole[node] == NONE {
            let nodes = lattice.hole(node, &scan, &mut index_in_hole);
            let heights = Hole::new(&nodes, &index_in_hole, &scan, &lattice).heights();
            solved.extend(nodes.into_iter().zip(heights));
        }
    }
    scan.with(solved)
}

/// Entry of `index_in_hole` for a node that was measured or has not been visited yet.
const NONE: u32 = u32::MAX;

struct Lattice {
    nodes: [usize; 2],
    is_periodic: bool,
    /// Weights 1/Δx² and 1/Δy², divided by the larger of both.
    weights: [f64; 2],
}

impl Lattice {
    fn new(scan: &Scan, is_periodic: bool) -> Lattice {
        let steps = scan.grid().spacing();
        let smaller = steps[0].min(steps[1]);
        Lattice {
            nodes: scan.grid().nodes(),
            is_periodic,
            weights: steps.map(|step| (smaller / step) * (smaller / step)),
        }
    }

    /// Returns the neighbours of a node along −x, x, −y and y, with their weights.
    ///
    /// A neighbour outside a map that is not periodic is replaced by the node itself, with a weight
    /// of zero.
    fn neighbours(&self, node: usize) -> [(usize, f64); 4] {
        let [nodes_x, nodes_y] = self.nodes;
        let (i, j) = (node / nodes_y, node % nodes_y);
        let beside = |axis: usize, is_edge: bool, inside: usize, around: usize| match is_edge {
            false => (inside, self.weights[axis]),
            true if self.is_periodic => (around, self.weights[axis]),
            true => (node, 0.0),
        };
        [
            beside(0, i == 0, node.wrapping_sub(nodes_y), (nodes_x - 1) * nodes_y + j),
            beside(0, i + 1 == nodes_x, node + nodes_y, j),
            beside(1, j == 0, node.wrapping_sub(1), node + nodes_y - 1),
            beside(1, j + 1 == nodes_y, node + 1, i * nodes_y),
        ]
    }

    /// Returns the nodes of the hole that contains `node`, in ascending order.
    ///
    /// Sets `index_in_hole` of each of these nodes to its index in the result.
    fn hole(&self, node: usize, scan: &Scan, index_in_hole: &mut [u32]) -> Vec<usize> {
        let mut nodes = vec![node];
        index_in_hole[node] = 0;
        let mut seen = 0;
        while seen < nodes.len() {
            for (other, weight) in self.neighbours(nodes[seen]) {
                if weight > 0.0 && scan.is_missing(other) && index_in_hole[other] == NONE {
                    index_in_hole[other] = 0;
                    nodes.push(other);
                }
            }
            seen += 1;
        }
        nodes.sort_unstable();
        for (at, &node) in nodes.iter().enumerate() {
            index_in_hole[node] = u32::try_from(at).expect("a map in memory has fewer nodes");
        }
        nodes
    }
}

/// Linear system A h = b for the heights h of one hole.
struct Hole {
    /// Indices and weights of the four neighbours of each unknown.
    ///
    /// A measured neighbour, or one outside the map, is replaced by the unknown itself with a
    /// weight of zero.
    neighbours: Vec<[(u32, f64); 4]>,
    diagonal: Vec<f64>,
    /// Diagonal D of the incomplete Cholesky factor, from [`pivots`].
    pivots: Vec<f64>,
    right_side: Vec<f64>,
    /// Mean height of the measured neighbours. The unknown heights and the right-hand side are
    /// relative to it.
    reference: f64,
}

impl Hole {
    fn new(nodes: &[usize], index_in_hole: &[u32], scan: &Scan, lattice: &Lattice) -> Hole {
        let around = nodes.iter().flat_map(|&node| lattice.neighbours(node));
        let edge = around.filter(|(node, weight)| *weight > 0.0 && !scan.is_missing(*node));
        let (sum, count) = edge
            .fold((0.0, 0.0), |(sum, count), (node, _)| (sum + scan.heights()[node], count + 1.0));
        let reference = sum / count;
        let mut hole = Hole {
            neighbours: Vec::with_capacity(nodes.len()),
            diagonal: Vec::with_capacity(nodes.len()),
            pivots: Vec::new(),
            right_side: Vec::with_capacity(nodes.len()),
            reference,
        };
        for &node in nodes {
            let own = index_in_hole[node];
            let (mut diagonal, mut right_side) = (0.0, 0.0);
            let unknown = lattice.neighbours(node).map(|(other, weight)| {
                diagonal += weight;
                if scan.is_missing(other) {
                    return (index_in_hole[other], weight);
                }
                right_side += weight * (scan.heights()[other] - reference);
                (own, 0.0)
            });
            hole.neighbours.push(unknown);
            hole.diagonal.push(diagonal);
            hole.right_side.push(right_side);
        }
        hole.pivots = pivots(&hole.neighbours, &hole.diagonal);
        hole
    }

    fn heights(&self) -> Vec<f64> {
        let mut solution = vec![0.0; self.right_side.len()];
        let tolerance = TOLERANCE * norm(&self.right_side);
        for _ in 0..ROUNDS {
            let product = self.product(&solution);
            let pairs = self.right_side.iter().zip(&product);
            let residual: Vec<f64> = pairs.map(|(given, product)| given - product).collect();
            if norm(&residual) <= tolerance {
                break;
            }
            let step = self.conjugate_gradients(residual, tolerance);
            solution.iter_mut().zip(step).for_each(|(height, step)| *height += step);
        }
        solution.iter().map(|height| self.reference + height).collect()
    }

    /// Solves A x = `residual` by conjugate gradients from x = 0, until the norm of the residual is
    /// at most `tolerance`.
    fn conjugate_gradients(&self, mut residual: Vec<f64>, tolerance: f64) -> Vec<f64> {
        let mut solution = vec![0.0; residual.len()];
        let mut direction = self.preconditioned(&residual);
        let mut power = dot(&residual, &direction);
        // In exact arithmetic, there are at most as many steps as unknowns.
        for _ in 0..2 * residual.len() + 10 {
            let product = self.product(&direction);
            let curvature = dot(&direction, &product);
            if curvature.is_nan() || curvature <= 0.0 {
                break;
            }
            let length = power / curvature;
            let steps = solution.iter_mut().zip(&direction);
            steps.for_each(|(height, direction)| *height += length * direction);
            let left = residual.iter_mut().zip(&product);
            left.for_each(|(residual, product)| *residual -= length * product);
            if norm(&residual) <= tolerance {
                break;
            }
            let towards = self.preconditioned(&residual);
            let next = dot(&residual, &towards);
            let beta = next / power;
            power = next;
            let turned = direction.iter_mut().zip(towards);
            turned.for_each(|(direction, towards)| *direction = towards + beta * *direction);
        }
        solution
    }

    /// Returns the preconditioned residual z: the solution of (D + L) D⁻¹ (D + Lᵀ) z = r with the
    /// incomplete factor of [`pivots`].
    fn preconditioned(&self, residual: &[f64]) -> Vec<f64> {
        let mut values = residual.to_vec();
        for (at, neighbours) in self.neighbours.iter().enumerate() {
            for &(other, weight) in neighbours {
                if (other as usize) < at {
                    values[at] += weight * values[other as usize];
                }
            }
            values[at] /= self.pivots[at];
        }
        for (at, neighbours) in self.neighbours.iter().enumerate().rev() {
            let mut sum = 0.0;
            for &(other, weight) in neighbours {
                if other as usize > at {
                    sum += weight * values[other as usize];
                }
            }
            values[at] += sum / self.pivots[at];
        }
        values
    }

    fn product(&self, heights: &[f64]) -> Vec<f64> {
        let rows = self.neighbours.iter().zip(&self.diagonal).zip(heights);
        let product = rows.map(|((neighbours, diagonal), height)| {
            let beside = neighbours.iter().map(|(at, weight)| weight * heights[*at as usize]);
            diagonal * height - beside.sum::<f64>()
        });
        product.collect()
    }
}

/// Returns the diagonal D of the modified incomplete Cholesky factor (D + L) D⁻¹ (D + Lᵀ).
///
/// L is the strict lower triangle of the matrix A with the given `neighbours` and `diagonal`. The
/// fraction `FILL_IN` of the neglected fill-in is subtracted from the diagonal, which makes the
/// factor accurate for smooth heights (Gustafsson 1978).
fn pivots(neighbours: &[[(u32, f64); 4]], diagonal: &[f64]) -> Vec<f64> {
    const FILL_IN: f64 = 0.97;
    const LEAST: f64 = 0.25;
    let mut pivots: Vec<f64> = Vec::with_capacity(diagonal.len());
    // The entries are Σ w over the neighbours with larger indices.
    let mut later: Vec<f64> = Vec::with_capacity(diagonal.len());
    for (at, neighbours) in neighbours.iter().enumerate() {
        let (mut pivot, mut after) = (diagonal[at], 0.0);
        for &(other, weight) in neighbours {
            let other = other as usize;
            if other < at {
                let filled = FILL_IN * (later[other] - weight);
                pivot -= weight * (weight + filled) / pivots[other];
            } else if other > at {
                after += weight;
            }
        }
        let is_safe = pivot > LEAST * diagonal[at];
        pivots.push(if is_safe { pivot } else { diagonal[at] });
        later.push(after);
    }
    pivots
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn norm(values: &[f64]) -> f64 {
    dot(values, values).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topography::surface::samples::scan;

    fn is_in_hole(i: usize, j: usize) -> bool {
        let [x, y] = [i as f64 - 14.0, j as f64 - 11.0];
        x * x + 2.0 * y * y < 60.0 || (i, j) == (2, 3) || i == 25 && (4..9).contains(&j)
    }

    #[test]
    fn a_plane_with_holes_is_restored_to_rounding() {
        let plane = |x: f64, y: f64| 5.0 + 3.0 * x - 2.0 * y;
        let holed = scan([30, 24], [1.0, 2.0], plane, is_in_hole);
        let whole = scan([30, 24], [1.0, 2.0], plane, |_, _| false);
        let filled = filled(holed, false);
        for (node, height) in whole.measured() {
            let error = filled.heights()[node] - height;
            assert!(error.abs() < 2e-14, "{error}");
        }
    }

    #[test]
    fn a_harmonic_function_of_the_lattice_is_restored() {
        // x² − y² and xy also solve the difference equation, for all steps.
        for form in [|x: f64, y: f64| x * x - y * y, |x: f64, y: f64| x * y] {
            let holed = scan([30, 24], [1.5, 0.6], form, is_in_hole);
            let whole = scan([30, 24], [1.5, 0.6], form, |_, _| false);
            let filled = filled(holed, false);
            for (node, height) in whole.measured() {
                assert!((filled.heights()[node] - height).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn the_normal_derivative_at_the_edge_of_an_open_map_is_zero() {
        // The map is a line along y with a hole at one edge.
        let form = |_: f64, y: f64| libm::sin(6.0 * y);
        let row = scan([1, 40], [0.1, 2.0], form, |_, j| j < 10);
        let open = filled(row.clone(), false);
        let beyond = open.heights()[10];
        assert!(open.heights()[..10].iter().all(|height| (height - beyond).abs() < 1e-14));
        // On the periodic map the hole has two ends, and the solution is a straight line.
        let around = filled(row, true);
        let (first, last) = (around.heights()[39], around.heights()[10]);
        for (j, height) in around.heights()[..10].iter().enumerate() {
            let expected = first + (last - first) * (j + 1) as f64 / 11.0;
            assert!((height - expected).abs() < 1e-14);
        }
    }
}
