use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::grid::samples::{rectangle, square};
use crate::morphology::clusters::Clusters;
use crate::morphology::map::samples::{MESHES, random};

/// Returns the conductivities along x and y of the gaps `gap(i, j)`.
fn conductivities(grid: Grid, gap: impl Fn(usize, usize) -> f64) -> [f64; 2] {
    let gap: Vec<f64> = (0..grid.count())
        .map(|node| {
            let [i, j] = grid.indices(node);
            gap(i, j)
        })
        .collect();
    flow_through(grid, &gap).map(|flow| flow.unwrap().conductivity)
}

fn assert_close(found: f64, expected: f64, within: f64) {
    let error = (found - expected).abs();
    assert!(error <= within * expected.abs(), "{found} {expected}");
}

/// Returns a gap that varies along an axis over four decades, with a period of eight nodes.
fn depth(index: usize) -> f64 {
    [1.0, 0.3, 1e-4, 2.0, 0.05, 0.7, 1.1, 0.9][index % 8]
}

#[test]
fn conductivity_of_parallel_walls_is_the_cube_of_the_gap() {
    for grid in [
        square(8, 1.0),
        square(33, 7.0),
        rectangle([12, 30], [1.0, 4.0]),
        rectangle([1, 9], [2.0, 1.0]),
        rectangle([2, 2], [1.0, 1.0]),
    ] {
        for found in conductivities(grid, |_, _| 0.3) {
            assert_close(found, 0.027, TOLERANCE);
        }
    }
}

#[test]
fn parallel_channels_have_the_mean_of_cubes_and_channels_in_series_the_harmonic_mean() {
    let cubes: Vec<f64> = (0..8).map(|index| depth(index).powi(3)).collect();
    let mean = cubes.iter().sum::<f64>() / 8.0;
    let harmonic = 8.0 / cubes.iter().map(|cube| 1.0 / cube).sum::<f64>();
    for grid in [square(64, 1.0), rectangle([16, 40], [1.0, 3.0])] {
        let [across, along] = conductivities(grid, |i, _| depth(i));
        assert_close(across, harmonic, 2.0 * TOLERANCE);
        assert_close(along, mean, 2.0 * TOLERANCE);
    }
}

#[test]
fn a_checkerboard_converges_to_the_geometric_mean() {
    // Dykhne, Sov. Phys. JETP 32, 1971, 63. The pressure is singular where four squares meet.
    let error = |nodes: usize| {
        let is_deep = |i: usize, j: usize| (i < nodes / 2) != (j < nodes / 2);
        let gap = |i: usize, j: usize| if is_deep(i, j) { 2.0 } else { 1.0 };
        let [along_x, along_y] = conductivities(square(nodes, 1.0), gap);
        assert_close(along_x, along_y, 2.0 * TOLERANCE);
        1.0 - along_x / 8.0_f64.sqrt()
    };
    let errors = [32, 64, 128, 256].map(error);
    assert!(errors[3] < 0.01, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[1] / pair[0] - 0.5).abs() < 0.1, "{errors:?}");
    }
}

/// Returns the conductivities along x and y by a dense solution of the network.
fn dense_conductivities(grid: Grid, gap: &[f64]) -> [f64; 2] {
    let [rows, row_nodes] = grid.nodes();
    let [step_x, step_y] = grid.spacing();
    let [size_x, size_y] = grid.cell().size();
    [0, 1].map(|along| {
        let mut matrix = DMatrix::<f64>::zeros(gap.len(), gap.len());
        let mut currents = DVector::<f64>::zeros(gap.len());
        let mut dissipation = 0.0;
        for node in 0..gap.len() {
            let [i, j] = grid.indices(node);
            let below = ((i + 1) % rows * row_nodes + j, i + 1 == rows, step_y / step_x);
            let after = (i * row_nodes + (j + 1) % row_nodes, j + 1 == row_nodes, step_x / step_y);
            for (axis, (other, is_seam, aspect)) in [below, after].into_iter().enumerate() {
                let [one, two] = [node, other].map(|node| gap[node].max(0.0).powi(3));
                let conductance =
                    if one * two > 0.0 { 2.0 * aspect / (1.0 / one + 1.0 / two) } else { 0.0 };
                let step = f64::from(is_seam && axis == along);
                for (row, column, sign) in [
                    (node, node, 1.0),
                    (other, other, 1.0),
                    (node, other, -1.0),
                    (other, node, -1.0),
                ] {
                    matrix[(row, column)] += sign * conductance;
                }
                currents[node] -= conductance * step;
                currents[other] += conductance * step;
                dissipation += conductance * step * step;
            }
        }
        let inverse = matrix.pseudo_inverse(1e-10).unwrap();
        let conductance = dissipation - currents.dot(&(inverse * &currents));
        conductance * if along == 0 { size_x / size_y } else { size_y / size_x }
    })
}

#[test]
fn flows_equal_those_of_a_dense_solution() {
    for (nodes, size) in [([12, 12], [1.0, 1.0]), ([9, 14], [1.0, 3.0]), ([15, 8], [4.0, 1.0])] {
        let grid = rectangle(nodes, size);
        for share in [0.0, 0.15, 0.3, 0.4] {
            let map = random(nodes, share);
            let gap: Vec<f64> = (0..grid.count())
                .map(|node| {
                    let [i, j] = grid.indices(node);
                    if map.get(i, j) { 0.0 } else { 0.1 + ((7 * i + 11 * j) % 10) as f64 / 10.0 }
                })
                .collect();
            let expected = dense_conductivities(grid, &gap);
            let found = conductivities(grid, |i, j| gap[grid.nodes()[1] * i + j]);
            for axis in [0, 1] {
                let error = (found[axis] - expected[axis]).abs();
                assert!(error <= TOLERANCE * expected[axis] + 1e-12, "{found:?} {expected:?}");
            }
        }
    }
}

#[test]
fn slight_roughness_reduces_conductivity_by_three_halves_of_its_variance() {
    // Elrod 1979; Tripp 1983: 1 + 3 (γ − 2)/(γ + 1) (σ/h)², with γ = 1 for isotropic roughness.
    let wave = |index: usize| (TAU * index as f64 / 64.0).cos();
    let loss = |height: f64| {
        let gap = |i: usize, j: usize| 1.0 + height * (wave(i) + wave(j));
        let [along_x, _] = conductivities(square(64, 1.0), gap);
        (1.0 - along_x) / (height * height)
    };
    let losses = [0.04, 0.02].map(loss);
    // The next term is proportional to the square of the height.
    let limit = losses[1] + (losses[1] - losses[0]) / 3.0;
    assert!((limit - 1.5).abs() < 1e-3, "{losses:?} {limit}");
}

/// Returns a gap like the gaps of a rough contact, of which many are zero and the others span many
/// decades.
fn contact_like(i: usize, j: usize, nodes: usize) -> f64 {
    (contact_like_height(i, j, nodes) + 0.25).max(0.0).powf(1.5)
}

fn contact_like_height(i: usize, j: usize, nodes: usize) -> f64 {
    let [x, y] = [i, j].map(|index| TAU * index as f64 / nodes as f64);
    (x + 0.3).cos() * (2.0 * y).cos() + 0.6 * (5.0 * x - 3.0 * y).sin() + 0.4 * (11.0 * y).cos()
}

#[test]
fn a_rotated_map_has_exchanged_conductivities() {
    let grid = square(96, 1.0);
    let [x, y] = conductivities(grid, |i, j| contact_like(i, j, 96));
    let turned = conductivities(grid, |i, j| contact_like(j, 95 - i, 96));
    assert!(x > 0.0 && y > 0.0 && (x / y - 1.0).abs() > 0.01);
    assert_close(turned[1], x, 2.0 * TOLERANCE);
    assert_close(turned[0], y, 2.0 * TOLERANCE);
}

#[test]
fn a_translated_map_has_the_same_conductivities() {
    let grid = square(96, 1.0);
    let here = conductivities(grid, |i, j| contact_like(i, j, 96));
    let there = conductivities(grid, |i, j| contact_like((i + 41) % 96, (j + 67) % 96, 96));
    for (here, there) in here.into_iter().zip(there) {
        assert_close(there, here, 2.0 * TOLERANCE);
    }
}

#[test]
fn conductivity_scales_with_the_cube_of_the_gap() {
    let grid = square(64, 1.0);
    let [x, _] = conductivities(grid, |i, j| contact_like(i, j, 64));
    let [deeper, _] = conductivities(grid, |i, j| 1e-9 * contact_like(i, j, 64));
    assert_close(deeper, 1e-27 * x, 2.0 * TOLERANCE);
}

#[test]
fn closing_a_node_never_increases_conductivity() {
    let grid = square(48, 1.0);
    let closed = |other: usize| {
        conductivities(grid, |i, j| if 48 * i + j == other { 0.0 } else { contact_like(i, j, 48) })
    };
    let all = closed(usize::MAX);
    for node in (0..48 * 48).step_by(97) {
        let less = closed(node);
        for axis in [0, 1] {
            assert!(less[axis] <= all[axis] * (1.0 + TOLERANCE), "{node}");
        }
    }
}

#[test]
fn conductivity_is_positive_exactly_where_the_gap_percolates() {
    for nodes in MESHES {
        for share in [0.2, 0.35, 0.4, 0.45, 0.8, 1.0] {
            let map = random(nodes, share);
            let clusters = Clusters::of_gap(&map);
            let grid = rectangle(nodes, [1.0, 2.0]);
            let found = conductivities(grid, |i, j| f64::from(!map.get(i, j)));
            let flows = found.map(|conductivity| conductivity > 0.0);
            assert_eq!(flows, [clusters.around_x, clusters.around_y], "{nodes:?} {share}");
        }
    }
}

#[test]
fn a_single_constriction_determines_the_conductivity() {
    // A wall with one open node of gap 1e-5 in a film of gap 1: two links in series, each with
    // twice the conductance of that node.
    let nodes = 40;
    let gap = |i: usize, j: usize| match (i, j) {
        (7, 13) => 1e-5,
        (7, _) => 0.0,
        _ => 1.0,
    };
    let [across, _] = conductivities(square(nodes, 1.0), gap);
    assert_close(across, 1e-15, 1e-6);
}

#[test]
fn few_iterations_are_enough_from_light_loads_to_percolation() {
    // Iterations do not depend on the mesh either.
    for nodes in [96, 192, 384] {
        for level in [1.5, 0.6, 0.25, 0.05, -0.05] {
            let grid = square(nodes, 1.0);
            let gap: Vec<f64> = (0..grid.count())
                .map(|node| {
                    let [i, j] = grid.indices(node);
                    (contact_like_height(i, j, nodes) + level).max(0.0).powf(1.5)
                })
                .collect();
            let mut links = Links::between(grid, &gap, 3.0);
            let channels = Channels::new(&mut links);
            if !channels.order.is_empty() {
                let (bounds, iterations) = conductances(&links, &channels, &|| false).unwrap();
                assert!(bounds.iter().all(|bounds| bounds.residual() <= TOLERANCE));
                assert!(iterations <= 14, "{nodes} {level} {iterations}");
            }
        }
    }
}

#[test]
fn an_interrupted_flow_is_none() {
    let grid = square(64, 1.0);
    let gap = vec![0.3; grid.count()];
    let calls = std::cell::Cell::new(0);
    let interrupt = |at: u32| {
        calls.set(0);
        flow_through_interruptible(grid, &gap, &|| {
            calls.set(calls.get() + 1);
            calls.get() == at
        })
    };
    assert!(interrupt(1).is_none());
    let all = interrupt(u32::MAX).map(|_| calls.get()).unwrap();
    assert!(interrupt(all).is_none());
}
