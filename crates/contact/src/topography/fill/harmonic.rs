//! Laplace's equation in the holes of a map.
//!
//! At each missing node Σ w (h − h′) = 0 over its neighbours along x and y, with w = 1/Δx² and
//! 1/Δy²; heights that were measured are given, and beyond the edge of a map that is not periodic
//! there is no neighbour, so that nothing flows over it. The matrix of each hole is symmetric and
//! positive definite, since every hole has an edge: conjugate gradients, preconditioned by an
//! incomplete Cholesky factor, in numbers of steps that grow with the root of a hole's width. Holes
//! are solved one by one and all sums go in the order of the nodes, so that the result is the same
//! whatever computes it.

use crate::topography::surface::Scan;

/// Norm of the residual, over that of the right-hand side, at which a solution ends; heights are
/// counted from the mean of the hole's edge.
const TOLERANCE: f64 = 1e-15;

/// Solutions, each for the residual that the one before has left: rounding within a long one is
/// then made good.
const ROUNDS: usize = 3;

/// The map with its holes filled.
pub fn filled(scan: Scan, is_periodic: bool) -> Scan {
    let lattice = Lattice::of(&scan, is_periodic);
    let mut place = vec![NONE; scan.heights().len()];
    let mut solved = Vec::new();
    for node in 0..place.len() {
        if scan.is_missing(node) && place[node] == NONE {
            let nodes = lattice.hole(node, &scan, &mut place);
            let heights = Hole::of(&nodes, &place, &scan, &lattice).heights();
            solved.extend(nodes.into_iter().zip(heights));
        }
    }
    scan.with(solved)
}

/// No place in a hole: a node that was measured, or has not been looked at.
const NONE: u32 = u32::MAX;

/// Which nodes are neighbours, and how they weigh.
struct Lattice {
    nodes: [usize; 2],
    is_periodic: bool,
    /// Along x and y, over the larger of both.
    weights: [f64; 2],
}

impl Lattice {
    fn of(scan: &Scan, is_periodic: bool) -> Lattice {
        let steps = scan.grid().spacing();
        let smaller = steps[0].min(steps[1]);
        Lattice {
            nodes: scan.grid().nodes(),
            is_periodic,
            weights: steps.map(|step| (smaller / step) * (smaller / step)),
        }
    }

    /// The neighbours of a node along −x, x, −y and y, with their weights; a weight of zero where
    /// there is none.
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

    /// The nodes of the hole around a node, ascending; `place` tells where in it each of them is.
    fn hole(&self, node: usize, scan: &Scan, place: &mut [u32]) -> Vec<usize> {
        let mut nodes = vec![node];
        place[node] = 0;
        let mut seen = 0;
        while seen < nodes.len() {
            for (other, weight) in self.neighbours(nodes[seen]) {
                if weight > 0.0 && scan.is_missing(other) && place[other] == NONE {
                    place[other] = 0;
                    nodes.push(other);
                }
            }
            seen += 1;
        }
        nodes.sort_unstable();
        for (at, &node) in nodes.iter().enumerate() {
            place[node] = u32::try_from(at).expect("a map in memory has fewer nodes");
        }
        nodes
    }
}

/// The equations of one hole.
struct Hole {
    /// The unknown neighbours of each unknown, itself where there is none, and their weights.
    neighbours: Vec<[(u32, f64); 4]>,
    diagonal: Vec<f64>,
    /// The diagonal of the incomplete factor.
    pivots: Vec<f64>,
    given: Vec<f64>,
    /// The mean of the measured neighbours, from which heights are counted.
    reference: f64,
}

impl Hole {
    fn of(nodes: &[usize], place: &[u32], scan: &Scan, lattice: &Lattice) -> Hole {
        let edge = nodes.iter().flat_map(|&node| lattice.neighbours(node));
        let edge = edge.filter(|(node, weight)| *weight > 0.0 && !scan.is_missing(*node));
        let (sum, count) = edge
            .fold((0.0, 0.0), |(sum, count), (node, _)| (sum + scan.heights()[node], count + 1.0));
        let reference = sum / count;
        let mut hole = Hole {
            neighbours: Vec::with_capacity(nodes.len()),
            diagonal: Vec::with_capacity(nodes.len()),
            pivots: Vec::new(),
            given: Vec::with_capacity(nodes.len()),
            reference,
        };
        for &node in nodes {
            let own = place[node];
            let (mut diagonal, mut given) = (0.0, 0.0);
            let unknown = lattice.neighbours(node).map(|(other, weight)| {
                diagonal += weight;
                if scan.is_missing(other) {
                    return (place[other], weight);
                }
                given += weight * (scan.heights()[other] - reference);
                (own, 0.0)
            });
            hole.neighbours.push(unknown);
            hole.diagonal.push(diagonal);
            hole.given.push(given);
        }
        hole.pivots = pivots(&hole.neighbours, &hole.diagonal);
        hole
    }

    fn heights(&self) -> Vec<f64> {
        let mut solution = vec![0.0; self.given.len()];
        let least = TOLERANCE * norm(&self.given);
        for _ in 0..ROUNDS {
            let product = self.product(&solution);
            let residual = self.given.iter().zip(&product);
            let residual: Vec<f64> = residual.map(|(given, product)| given - product).collect();
            if norm(&residual) <= least {
                break;
            }
            let step = self.solution_of(residual, least);
            solution.iter_mut().zip(step).for_each(|(height, step)| *height += step);
        }
        solution.iter().map(|height| self.reference + height).collect()
    }

    /// Conjugate gradients from zero until the residual has become small.
    fn solution_of(&self, mut residual: Vec<f64>, least: f64) -> Vec<f64> {
        let mut solution = vec![0.0; residual.len()];
        let mut direction = self.preconditioned(&residual);
        let mut power = dot(&residual, &direction);
        // In exact arithmetic there are no more steps than unknowns.
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
            if norm(&residual) <= least {
                break;
            }
            let towards = self.preconditioned(&residual);
            let next = dot(&residual, &towards);
            let share = next / power;
            power = next;
            let turned = direction.iter_mut().zip(towards);
            turned.for_each(|(direction, towards)| *direction = towards + share * *direction);
        }
        solution
    }

    /// The residual through both triangles of the incomplete factor.
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

/// The diagonal of the modified incomplete Cholesky factor, (D + L) D⁻¹ (D + Lᵀ) with the L of the
/// matrix: what a complete one would fill in is taken off the diagonal, nearly all of it, so that
/// smooth heights are all but solved for (Gustafsson 1978).
fn pivots(neighbours: &[[(u32, f64); 4]], diagonal: &[f64]) -> Vec<f64> {
    const TAKEN_OFF: f64 = 0.97;
    const LEAST: f64 = 0.25;
    let mut pivots: Vec<f64> = Vec::with_capacity(diagonal.len());
    // Σ w over the neighbours that come later.
    let mut later: Vec<f64> = Vec::with_capacity(diagonal.len());
    for (at, neighbours) in neighbours.iter().enumerate() {
        let (mut pivot, mut after) = (diagonal[at], 0.0);
        for &(other, weight) in neighbours {
            let other = other as usize;
            if other < at {
                let filled = TAKEN_OFF * (later[other] - weight);
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
        // x² − y² and xy solve the difference equation, too, whatever the steps are.
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
    fn nothing_flows_over_the_edge_of_a_map_unless_it_is_periodic() {
        // A hole from one edge inwards, heights given on a line along y: none of them changes with
        // x.
        let form = |_: f64, y: f64| libm::sin(6.0 * y);
        let row = scan([1, 40], [0.1, 2.0], form, |_, j| j < 10);
        let open = filled(row.clone(), false);
        let beyond = open.heights()[10];
        assert!(open.heights()[..10].iter().all(|height| (height - beyond).abs() < 1e-14));
        // Around the cell the hole has two ends: a straight line from one to the other.
        let around = filled(row, true);
        let (first, last) = (around.heights()[39], around.heights()[10]);
        for (j, height) in around.heights()[..10].iter().enumerate() {
            let expected = first + (last - first) * (j + 1) as f64 / 11.0;
            assert!((height - expected).abs() < 1e-14);
        }
    }
}
