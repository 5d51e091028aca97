//! Isotropic half-space without periodic images: displacements at the centres of rectangular cells.
//!
//! A unit pressure on a cell of Δx × Δy displaces the centre of another cell by Love's integral
//! (*Phil. Trans. R. Soc. A* 228, 1929, 377). The discrete convolution with this kernel is exact if
//! the mesh has twice the nodes along both axes and pressures are padded with zeros, because
//! periodic images then do not overlap (Hockney 1970; Liu, Wang & Liu, *Wear* 243, 2000, 101).

use std::f64::consts::PI;

use super::ElasticOperator;
use crate::fft::Transform;
use crate::grid::{Grid, magnitude};

/// Width of the margin for the convolution with the stiffness, as a fraction of the longer side.
///
/// With margins of 1/8, 1/4 and 1/2, a light contact on 1024² nodes takes 162, 158 and 151 pairs of
/// transforms, and a heavy one 209, 185 and 183.
const MARGIN: f64 = 0.25;

/// Divisor of the fast transform lengths. These lengths have the prime factors 2, 3 and 5 only.
const NODES_TOGETHER: usize = 32;

/// Isotropic half-space under a pressure that is zero outside the map.
///
/// Displacements are relative to points far away. The stiffness is approximate. No finite pressure
/// flattens a surface completely, because the flattening pressure is infinite at the edges of the
/// map, positive or negative.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeHalfSpace {
    grid: Grid,
    /// Factors û/p̂ of the waves of the mesh with 2N_x × 2N_y nodes: (k_x, k_y) at index k_x (N_y +
    /// 1) + k_y, for k_x = 0, …, N_x and k_y = 0, …, N_y.
    factors: Vec<f64>,
    /// Numbers of nodes along x and y of the grid with its margin.
    stiffness_nodes: [usize; 2],
}

impl FreeHalfSpace {
    /// Creates the half-space below a grid. Nodes are the centres of cells with uniform pressure.
    ///
    /// Only the ratio of the sides L_x and L_y matters.
    pub fn new(grid: Grid) -> Self {
        let doubled = grid.nodes().map(|nodes| 2 * nodes);
        let [step_x, step_y] = grid.spacing().map(|step| step / grid.cell().longer_side());
        // The kernel is symmetric along both axes.
        let [rows, columns] = grid.nodes().map(|nodes| nodes + 1);
        let of_distance = |at: usize| {
            let [i, j] = [at / columns, at % columns].map(|steps| steps as f64);
            displacement_beside_cell([i * step_x, j * step_y], [step_x, step_y])
        };
        let quarter: Vec<f64> = (0..rows * columns).map(of_distance).collect();
        let of_node = |node: usize| {
            let i = magnitude(node / doubled[1], doubled[0]);
            let j = magnitude(node % doubled[1], doubled[1]);
            quarter[i * columns + j]
        };
        let displacements: Vec<f64> = (0..doubled[0] * doubled[1]).map(of_node).collect();
        drop(quarter);
        let transform = Transform::new(doubled);
        let mut spectrum = transform.spectrum(&displacements);
        // The transform of an even map is real, except for rounding. Rows k_x > N_x repeat earlier
        // rows.
        spectrum.truncate((grid.nodes()[0] + 1) * transform.spectrum_columns());
        let mut factors: Vec<f64> = spectrum.into_iter().map(|value| value.re).collect();
        // `collect` may have reused the allocation of the spectrum, which is four times as large.
        factors.shrink_to_fit();
        let steps = grid.spacing();
        let margin = MARGIN * grid.cell().longer_side();
        let stiffness_nodes = std::array::from_fn(|axis| {
            with_margin(grid.nodes()[axis], (margin / steps[axis]).ceil() as usize)
        });
        Self { grid, factors, stiffness_nodes }
    }
}

/// Returns `nodes` + `margin`, rounded up to the next fast transform length, but at most 2 `nodes`.
fn with_margin(nodes: usize, margin: usize) -> usize {
    let has_small_factors = |count: &usize| {
        let mut rest = *count;
        for factor in [2, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        rest == 1
    };
    let fewest = (nodes + margin).div_ceil(NODES_TOGETHER);
    let fast = (fewest..).find(has_small_factors);
    let fast = NODES_TOGETHER * fast.expect("there are powers of two");
    fast.min(2 * nodes)
}

/// Returns the displacement, by Love's integral, at (x, y) from the centre of a cell of
/// `step_x` × `step_y` under unit pressure on the cell, with E* = 1.
fn displacement_beside_cell([x, y]: [f64; 2], [step_x, step_y]: [f64; 2]) -> f64 {
    let [a, b] = [x - step_x / 2.0, x + step_x / 2.0];
    let [c, d] = [y - step_y / 2.0, y + step_y / 2.0];
    (corner(b, d) - corner(a, d) - corner(b, c) + corner(a, c)) / PI
}

/// Returns s asinh(t/|s|) + t asinh(s/|t|), the antiderivative in Love's integral. Its form with
/// logarithms would lose digits far from the cell.
fn corner(s: f64, t: f64) -> f64 {
    let term = |s: f64, t: f64| {
        if s == 0.0 { 0.0 } else { s * libm::asinh(t / s.abs()) }
    };
    term(s, t) + term(t, s)
}

impl ElasticOperator for FreeHalfSpace {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn on_coarser(&self, grid: Grid) -> Option<Box<dyn ElasticOperator>> {
        Some(Box::new(Self::new(grid)))
    }

    fn convolved_nodes(&self) -> [usize; 2] {
        self.grid.nodes().map(|nodes| 2 * nodes)
    }

    fn displacement(&self, [k_x, k_y]: [usize; 2]) -> f64 {
        self.factors[k_x * (self.grid.nodes()[1] + 1) + k_y]
    }

    fn stiffness_nodes(&self) -> [usize; 2] {
        self.stiffness_nodes
    }

    /// Returns |q|/2 for a wave of `waves` periods on the grid with its margin, as if this were
    /// periodic.
    fn stiffness(&self, waves: [usize; 2]) -> f64 {
        let (nodes, all) = (self.grid.nodes(), self.stiffness_nodes());
        let waves = [0, 1].map(|axis| waves[axis] as f64 * nodes[axis] as f64 / all[axis] as f64);
        PI * self.grid.cell().wavenumber(waves)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::{Factor, kernel, transform};
    use crate::grid::samples::{rectangle, square};
    use crate::threads::Threads;

    fn sunk(grid: Grid, pressure: &[f64]) -> Vec<f64> {
        let body = FreeHalfSpace::new(grid);
        let transform = transform(&body);
        let mut out = vec![0.0; pressure.len()];
        let kernel = kernel::<f64>(&Threads::one(), &body, Factor::Displacement);
        transform.convolve(&kernel, pressure, &mut out, &mut transform.scratch());
        out
    }

    #[test]
    fn a_cell_sinks_below_its_own_pressure_as_love_has_it() {
        // (4/π) ln(1 + √2) times the side of a square, here a fifth of the longer side.
        let side = 0.2;
        let expected = 4.0 / PI * (1.0 + 2_f64.sqrt()).ln() * side;
        let body = FreeHalfSpace::new(rectangle([3, 5], [0.6, 1.0]));
        assert!((body.nodal(Factor::Displacement, &Threads::one()) - expected).abs() < 1e-14);
        assert!((displacement_beside_cell([0.0; 2], [side; 2]) - expected).abs() < 1e-15);
        // A corner of the square is the centre of a square of twice the side, of which this square
        // is a quarter. The displacement is half the displacement at the centre.
        let corner = displacement_beside_cell([side / 2.0; 2], [side; 2]);
        assert!((corner / expected - 0.5).abs() < 1e-14);
    }

    #[test]
    fn far_away_a_cell_is_a_point() {
        let far = displacement_beside_cell([3.0, 4.0], [0.01, 0.02]);
        let point = 0.01 * 0.02 / (PI * 5.0);
        // The error is about (Δ/r)²/24.
        assert!((far / point - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_margin_is_a_quarter_of_the_longer_side_or_as_wide_as_the_map() {
        for (grid, expected) in [
            (square(1024, 1.0), [1280, 1280]),
            (square(1000, 3.0), [1280, 1280]),
            (square(257, 1.0), [384, 384]),
            // Cells of 1/480 × 1/640.
            (rectangle([480, 640], [1.0, 1.0]), [640, 800]),
            (rectangle([1024, 64], [16.0, 1.0]), [1280, 128]),
            (square(5, 1.0), [10, 10]),
        ] {
            assert_eq!(FreeHalfSpace::new(grid).stiffness_nodes(), expected);
        }
    }

    #[test]
    fn displacements_are_sums_over_cells_without_periodic_images() {
        for grid in [square(1, 1.0), square(8, 1.0), rectangle([5, 12], [1.0, 3.0])] {
            let pressure: Vec<f64> =
                (0..grid.count()).map(|node| libm::sin(7.0 + (node * node) as f64).abs()).collect();
            let steps = grid.spacing().map(|step| step / grid.cell().longer_side());
            for (node, found) in sunk(grid, &pressure).into_iter().enumerate() {
                let [i, j] = grid.indices(node);
                let of_cell = |(other, pressure): (usize, &f64)| {
                    let [k, l] = grid.indices(other);
                    let distance = [i.abs_diff(k), j.abs_diff(l)];
                    let [x, y] = [0, 1].map(|axis| distance[axis] as f64 * steps[axis]);
                    pressure * displacement_beside_cell([x, y], steps)
                };
                let sum: f64 = pressure.iter().enumerate().map(of_cell).sum();
                assert!((found / sum - 1.0).abs() < 1e-13, "{grid:?}, node {node}");
            }
        }
    }

    #[test]
    fn all_cells_together_sink_as_much_as_each_does_under_all() {
        let grid = rectangle([5, 12], [1.0, 3.0]);
        let pressure: Vec<f64> =
            (0..grid.count()).map(|node| libm::sin(3.0 + (node * node) as f64).abs()).collect();
        let together: f64 = sunk(grid, &pressure).iter().sum();
        let each = sunk(grid, &vec![1.0; grid.count()]);
        let sum: f64 = pressure.iter().zip(&each).map(|(p, sunk)| p * sunk).sum();
        assert!((sum / together - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_disc_sinks_more_in_the_middle_than_at_its_edge_by_half_pi() {
        // u = 2a in the centre and 4a/π at the edge of a disc of radius a under unit pressure.
        let (nodes, radius) = (256, 0.25);
        let from_centre = |index: usize| (index as f64 + 0.5) / nodes as f64 - 0.5;
        let grid = square(nodes, 1.0);
        let pressure: Vec<f64> = (0..grid.count())
            .map(|node| {
                let [x, y] = grid.indices(node).map(from_centre);
                f64::from(u8::from(x.hypot(y) < radius))
            })
            .collect();
        let sunk = sunk(grid, &pressure);
        let centre = sunk[128 * 256 + 128];
        assert!((centre / (2.0 * radius) - 1.0).abs() < 2e-3);
        // Half a cell outside the edge, where the slope of the displacement diverges
        // logarithmically.
        let edge = 0.5 * (sunk[128 * 256 + 191] + sunk[128 * 256 + 192]);
        assert!((edge / (4.0 * radius / PI) - 1.0).abs() < 1e-2);
    }
}
