//! Tests of extensions on meshes of all sizes.

use pulp::Scalar512b;

use super::*;
use crate::fft::Row;
use crate::solver::blocks::{ResidualRows, TransposeInput};
use crate::solver::lanes::{Shared, weight};
use crate::solver::marks::{FREE, has};

/// Returns numbers from −0.5 to 0.5, the same for the same seed.
pub fn noise(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1_u64 << 24) as f32 - 0.5
    };
    (0..count).map(|_| draw()).collect()
}

fn rows([rows, row_nodes]: [usize; 2]) -> impl Iterator<Item = Row> {
    (0..rows).map(move |index| Row::new(index, row_nodes))
}

/// Calls `visit` on all rows, with the pass `P` split at each of `cuts`.
fn over<P>(
    nodes: [usize; 2],
    cuts: &[usize],
    whole: P,
    split_off: impl Fn(&mut P, Row) -> P,
    mut visit: impl FnMut(&mut P, Row),
) {
    let mut parts = vec![whole];
    let mut firsts = vec![0];
    for cut in cuts.iter().rev().map(|cut| *cut.min(&nodes[0])) {
        let part = split_off(&mut parts[0], Row::new(cut, nodes[1]));
        parts.insert(1, part);
        firsts.insert(1, cut);
    }
    for row in rows(nodes) {
        let part = firsts.partition_point(|first| *first <= row.index) - 1;
        visit(&mut parts[part], row);
    }
}

/// Returns the extension of the residual of free nodes over the mesh of which the map is a
/// corner.
fn continued(
    extension: &mut Extension,
    cuts: &[usize],
    residual: &[f32],
    last_step: &[f32],
) -> Vec<f32> {
    let [map, nodes] = [extension.map, extension.nodes];
    over(map, cuts, extension.residual_rows(), ResidualRows::split_off, |part, row| {
        part.add_row::<_, 1>(Scalar512b, row, row.of(residual), row.of(last_step), &[true; 64])
    });
    extension.extend(&Threads::one());
    let mut values = vec![0.0; nodes[0] * nodes[1]];
    over(
        nodes,
        cuts,
        extension.extended_rows(),
        |part, row| part.split_off(row),
        |part, row| {
            let [(own, of_own), (other, of_other)] = part.row(row);
            for (value, (own, other)) in
                row.of_mut(&mut values).iter_mut().zip(own.iter().zip(other))
            {
                *value = of_own * own + of_other * other;
            }
        },
    );
    values
}

fn handed_back(
    extension: &mut Extension,
    cuts: &[usize],
    values: &[f32],
    last_step: &[f32],
) -> Vec<f32> {
    let [map, nodes] = [extension.map, extension.nodes];
    over(nodes, cuts, extension.transpose_input(), TransposeInput::split_off, |part, row| {
        let inside = row.index < map[0];
        let marks = inside.then(|| Row::new(row.index, map[1]).of(last_step));
        let marks = marks.unwrap_or_default();
        part.collect_row::<_, 1>(Scalar512b, row, row.of(values), marks, &[true; 64])
    });
    extension.collect(&Threads::one());
    let mut given = vec![0.0; last_step.len()];
    over(
        map,
        cuts,
        extension.transpose_output(),
        |part, row| part.split_off(row),
        |part, row| part.add_to_row(row, row.of_mut(&mut given), &[true; 64]),
    );
    given
}

fn marks(seed: u64, count: usize, share: f32) -> Vec<f32> {
    let free = |draw: f32| u32::from(draw + 0.5 < share) * FREE;
    let marked = |draw| f32::from_bits(free(draw));
    noise(seed, count).into_iter().map(marked).collect()
}

/// Returns a map in the corner of a mesh, with the value `beyond` around it.
fn in_corner(map: &[f32], [own, nodes]: [[usize; 2]; 2], beyond: f32) -> Vec<f32> {
    let mut all = vec![beyond; nodes[0] * nodes[1]];
    for (values, row) in all.chunks_mut(nodes[1]).zip(rows(own)) {
        values[..own[1]].copy_from_slice(row.of(map));
    }
    all
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
}

#[test]
fn collecting_is_the_transpose_of_extending() {
    let whole = [[64, 64], [50, 37], [128, 6], [6, 90], [9, 12], [1, 9], [3, 3], [1, 1]];
    let corners =
        [[[40, 48], [64, 64]], [[50, 37], [96, 64]], [[33, 5], [33, 10]], [[1, 1], [2, 2]]];
    let meshes = whole.map(|nodes| [nodes; 2]).into_iter().chain(corners);
    for (seed, [map, nodes]) in meshes.enumerate() {
        let count = map[0] * map[1];
        let last_step = marks(7 + seed as u64, count, 0.2);
        let free: Vec<f32> =
            last_step.iter().map(|last_step| weight(has(*last_step, FREE))).collect();
        let product = |values: Vec<f32>, weights: &[f32]| -> Vec<f32> {
            let weighed = values.iter().zip(weights);
            weighed.map(|(value, weight)| value * weight).collect()
        };
        let fixed: Vec<f32> = free.iter().map(|free| 1.0 - free).collect();
        let fixed = in_corner(&fixed, [map, nodes], 1.0);
        let residual = product(noise(1, count), &free);
        let outside = product(noise(2, fixed.len()), &fixed);
        let mut extension = Extension::new(map, nodes, &[]);
        let forth = dot(&continued(&mut extension, &[], &residual, &last_step), &outside);
        let back = dot(&residual, &handed_back(&mut extension, &[], &outside, &last_step));
        assert!((forth - back).abs() < 1e-5 * (1.0 + forth.abs()), "{nodes:?}: {forth} {back}");
    }
}

#[test]
fn a_residual_on_all_nodes_is_extended_almost_unchanged() {
    let nodes = [96, 80];
    let residual = vec![2.0; 96 * 80];
    let last_step = vec![f32::from_bits(FREE); 96 * 80];
    let values = continued(&mut Extension::new(nodes, nodes, &[]), &[], &residual, &last_step);
    // The outer value has a weight of a fifth in each block. The outer value of the largest
    // block is zero.
    assert!(values.iter().all(|value| (1.99..=2.0).contains(value)));
}

#[test]
fn the_residual_of_one_node_decays_with_distance() {
    let nodes = [64, 64];
    let (mut residual, mut last_step) = (vec![0.0; 64 * 64], vec![0.0; 64 * 64]);
    (residual[0], last_step[0]) = (1.0, f32::from_bits(FREE));
    let values = continued(&mut Extension::new(nodes, nodes, &[]), &[], &residual, &last_step);
    let diagonal = [1, 4, 8, 16, 31].map(|place| values[place * 65]);
    assert!(diagonal.is_sorted_by(|near, far| near > far), "{diagonal:?}");
    assert!(diagonal[0] < 0.5 && diagonal[4] > 0.0);
}

#[test]
fn the_map_repeats() {
    let nodes = [64, 64];
    let from = |node: usize| {
        let (mut residual, mut last_step) = (vec![0.0; 64 * 64], vec![0.0; 64 * 64]);
        (residual[node], last_step[node]) = (1.0, f32::from_bits(FREE));
        continued(&mut Extension::new(nodes, nodes, &[]), &[], &residual, &last_step)
    };
    // Shifted by half a side, all blocks except the largest are as before.
    let (corner, middle) = (from(0), from(32 * 65));
    for x in 0..64 {
        for y in 0..64 {
            let moved = middle[(x + 32) % 64 * 64 + (y + 32) % 64];
            assert_eq!(corner[64 * x + y], moved);
        }
    }
}

#[test]
fn rows_of_several_threads_give_the_same_bits() {
    for (map, nodes) in [([64, 48], [64, 48]), ([50, 37], [50, 37]), ([50, 37], [64, 64])] {
        let count = map[0] * map[1];
        let last_step = marks(3, count, 0.3);
        let residual: Vec<f32> = noise(4, count)
            .iter()
            .zip(&last_step)
            .map(|(residual, last_step)| weight::<f32>(has(*last_step, FREE)) * residual)
            .collect();
        let values = noise(5, nodes[0] * nodes[1]);
        let both = |cuts: &[usize]| {
            let mut extension = Extension::new(map, nodes, &[]);
            let continued = continued(&mut extension, cuts, &residual, &last_step);
            let given = handed_back(&mut extension, cuts, &values, &last_step);
            [continued, given].map(|map| map.into_iter().map(f32::to_bits).collect::<Vec<_>>())
        };
        let alone = both(&[]);
        // The last part may have no rows.
        for cuts in [vec![8], vec![24, 32], vec![16, 40, nodes[0]]] {
            assert_eq!(both(&cuts), alone);
        }
    }
}
