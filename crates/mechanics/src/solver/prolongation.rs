//! Interpolation of a map from a coarser mesh to the next finer one, and the pressures at the
//! beginning of iterations.

use super::lanes::{Shared, greater, weight};
use super::passes::PendingUpdate;
use crate::fft::Row;
use crate::solver::marks::{FREE, has};

/// Weight of each of the two nearest nodes in the cubic interpolation half-way between them.
const INNER: f32 = 9.0 / 16.0;

/// Weight of each of the two nodes beyond the nearest ones.
const OUTER: f32 = -1.0 / 16.0;

/// Number of nodes from the end of a periodic row that are repeated before its beginning, for the
/// interpolation there.
const BEFORE: usize = 1;

/// Number of nodes from the beginning of a periodic row that are repeated after its end.
const AFTER: usize = 2;

/// Map on every second node along both axes.
#[derive(Clone, Copy)]
pub struct CoarseMap<'a> {
    pub values: &'a [f32],
    /// Numbers of nodes of the map along x and y.
    pub nodes: [usize; 2],
    pub is_periodic: bool,
}

/// Interpolation of a coarser map to rows of pressures on the finer mesh: clamp(`factor` × value,
/// 0, `ceiling`).
pub struct Prolonged<'a> {
    map: CoarseMap<'a>,
    /// Ratio of pressure to interpolated value.
    factor: f32,
    pub ceiling: f32,
    /// Row of the coarser mesh, interpolated between its rows, with further nodes before and after.
    coarse: Vec<f32>,
    /// Factors of the pressures at the edges, if the map is not periodic.
    edges: Option<EdgeFactors>,
}

/// Factors by which pressures rise towards the edges of a map that is not periodic, for the rows
/// and the columns of the coarser and of the finer mesh. Their quotient is interpolated.
#[derive(Clone)]
struct EdgeFactors {
    coarse: [Vec<f32>; 2],
    fine: [Vec<f32>; 2],
}

impl EdgeFactors {
    fn new(nodes: [usize; 2]) -> Self {
        let of_axes = |ratio: usize| nodes.map(|nodes| edge_factors(ratio * nodes));
        Self { coarse: of_axes(1), fine: of_axes(2) }
    }
}

/// Returns (4 x (1 − x))^(−1/4) for each node of an axis, with its position x between the edges 0
/// and 1.
///
/// Pressures at an edge in contact rise with the power −1/2 of the distance. Loads take fewest
/// pairs with −1/4, because much of an edge is not in contact: ten loads to 0.1 on 1024² nodes take
/// 16.9 pairs on average, 20.5 with −1/2 and 19.7 without factors.
fn edge_factors(nodes: usize) -> Vec<f32> {
    let positions = (0..nodes).map(|node| (node as f64 + 0.5) / nodes as f64);
    positions.map(|x| libm::pow(4.0 * x * (1.0 - x), -0.25) as f32).collect()
}

impl<'a> Prolonged<'a> {
    pub fn new(map: CoarseMap<'a>, factor: f64, ceiling: f64) -> Self {
        Self {
            map,
            factor: factor as f32,
            ceiling: ceiling as f32,
            coarse: vec![0.0; BEFORE + map.nodes[1] + AFTER],
            edges: (!map.is_periodic).then(|| EdgeFactors::new(map.nodes)),
        }
    }

    /// Writes a row of pressures of the finer mesh.
    #[inline(always)]
    pub fn set_row(&mut self, row: Row, pressure: &mut [f32]) {
        let nodes = self.map.nodes[1];
        let own = &mut self.coarse[BEFORE..][..nodes];
        let at = row.index / 2;
        if let Some(edges) = &self.edges {
            self.map.set_between_edges(row.index, edges, own);
        } else if row.index.is_multiple_of(2) {
            own.copy_from_slice(self.map.row(at, 0));
        } else {
            let [a, b, c, d] = [-1, 0, 1, 2].map(|by| self.map.row(at, by));
            let far = a.iter().zip(d);
            for ((own, (b, c)), (a, d)) in own.iter_mut().zip(b.iter().zip(c)).zip(far) {
                *own = half_way(*a, *b, *c, *d);
            }
        }
        let [first, second, last] = [own[0], own[1 % nodes], own[nodes - 1]];
        let further = match self.edges {
            None => [last, first, second],
            Some(_) => {
                let slope = last - own[nodes - 2];
                [2.0 * first - second, last + slope, last + 2.0 * slope]
            }
        };
        [self.coarse[0], self.coarse[BEFORE + nodes], self.coarse[BEFORE + nodes + 1]] = further;
        let pairs = pressure.as_chunks_mut::<2>().0;
        for (pair, near) in pairs.iter_mut().zip(self.coarse.windows(4)) {
            let [a, b, c, d] = [near[0], near[1], near[2], near[3]];
            *pair = [b, half_way(a, b, c, d)];
        }
        let (factor, ceiling) = (self.factor, self.ceiling);
        if let Some(EdgeFactors { fine: [of_rows, of_columns], .. }) = &self.edges {
            let of_row = of_rows[row.index];
            for (p, of_column) in pressure.iter_mut().zip(of_columns) {
                *p *= of_row * of_column;
            }
        }
        for p in pressure {
            *p = (factor * *p).max(0.0).min(ceiling);
        }
    }
}

impl Shared for Prolonged<'_> {
    fn split_off(&mut self, _: Row) -> Self {
        Self { coarse: self.coarse.clone(), edges: self.edges.clone(), ..*self }
    }
}

impl<'a> CoarseMap<'a> {
    /// Returns the row `by` rows after row `at`.
    #[inline(always)]
    fn row(&self, at: usize, by: isize) -> &'a [f32] {
        let rows = self.nodes[0] as isize;
        let index = at as isize + by;
        Row::new(index.rem_euclid(rows) as usize, self.nodes[1]).of(self.values)
    }

    /// Sets `own` to the row of the finer mesh with index `row`, on the nodes of the coarser mesh
    /// and divided by the factors of the coarser mesh where it is positive.
    #[inline(always)]
    fn set_between_edges(&self, row: usize, edges: &EdgeFactors, own: &mut [f32]) {
        let [of_rows, of_columns] = &edges.coarse;
        own.fill(0.0);
        for (index, weight) in rows_between_edges(row, self.nodes[0]) {
            let of_row = of_rows[index];
            let values = Row::new(index, self.nodes[1]).of(self.values);
            for ((own, value), of_column) in own.iter_mut().zip(values).zip(of_columns) {
                let factor = if *value > 0.0 { of_row * of_column } else { 1.0 };
                *own += weight * (value / factor);
            }
        }
    }
}

/// Returns the rows of a coarser mesh, and their weights, from which the row of the finer mesh with
/// index `row` is interpolated. `rows` is the number of rows of the coarser mesh, at least three.
/// Rows beyond its edges are extrapolated linearly.
fn rows_between_edges(row: usize, rows: usize) -> impl Iterator<Item = (usize, f32)> {
    let at = row / 2;
    let (indices, weights) = if row.is_multiple_of(2) {
        ([0, at, 0, 0], [0.0, 1.0, 0.0, 0.0])
    } else if at == 0 {
        ([0, 0, 1, 2], [0.0, INNER + 2.0 * OUTER, INNER - OUTER, OUTER])
    } else if at + 1 == rows {
        ([at - 1, at, 0, 0], [-0.5, 1.5, 0.0, 0.0])
    } else if at + 2 == rows {
        ([at - 1, at, at + 1, 0], [OUTER, INNER - OUTER, INNER + 2.0 * OUTER, 0.0])
    } else {
        ([at - 1, at, at + 1, at + 2], [OUTER, INNER, INNER, OUTER])
    };
    indices.into_iter().zip(weights).filter(|(_, weight)| *weight != 0.0)
}

#[inline(always)]
fn half_way(a: f32, b: f32, c: f32, d: f32) -> f32 {
    INNER * (b + c) + OUTER * (a + d)
}

/// Constants that turn increments into pressures after the pending update of the last step, for a
/// reference pressure of zero.
#[derive(Clone, Copy)]
pub struct AppliedUpdate {
    scale: f32,
    taken_back: f32,
    ceiling: f32,
}

impl AppliedUpdate {
    pub fn new(pending: PendingUpdate, ceiling: f64) -> Self {
        Self {
            scale: pending.of_pressure() as f32,
            taken_back: (1.0 - pending.part) as f32,
            ceiling: ceiling as f32,
        }
    }

    /// Returns the pressure of a node after the update, clipped at its bounds. The last step is
    /// undone in part if its flag [`FREE`] is set.
    #[inline(always)]
    pub fn pressure(&self, increment: f32, last_step: f32) -> f32 {
        let step = weight::<f32>(has(last_step, FREE)) * last_step;
        // Rounding must not leave a pressure below zero or above the ceiling.
        greater(self.scale * increment - self.taken_back * step, 0.0).min(self.ceiling)
    }
}

pub enum StartPressure<'a> {
    FromCoarserMesh(Prolonged<'a>),
    FromLastIteration(AppliedUpdate),
}

impl StartPressure<'_> {
    #[inline(always)]
    pub fn set_row(
        &mut self,
        row: Row,
        pressure: &mut [f32],
        increment: &[f32],
        last_step: &[f32],
    ) {
        match self {
            Self::FromCoarserMesh(prolonged) => prolonged.set_row(row, pressure),
            Self::FromLastIteration(update) => {
                let nodes = increment.iter().zip(last_step);
                for (p, (increment, last_step)) in pressure.iter_mut().zip(nodes) {
                    *p = update.pressure(*increment, *last_step);
                }
            }
        }
    }
}

impl Shared for StartPressure<'_> {
    fn split_off(&mut self, row: Row) -> Self {
        match self {
            Self::FromCoarserMesh(prolonged) => Self::FromCoarserMesh(prolonged.split_off(row)),
            Self::FromLastIteration(update) => Self::FromLastIteration(*update),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::solver::marks::PRESSED;

    /// Returns the positive part of the interpolated map.
    fn prolonged(values: &[f32], nodes: [usize; 2]) -> Vec<f32> {
        let map = CoarseMap { values, nodes, is_periodic: true };
        let mut prolonged = Prolonged::new(map, 1.0, f64::INFINITY);
        let row_nodes = 2 * nodes[1];
        let mut all = vec![0.0; 4 * values.len()];
        for (index, row) in all.chunks_exact_mut(row_nodes).enumerate() {
            prolonged.set_row(Row::new(index, row_nodes), row);
        }
        all
    }

    /// Samples a function of the position on a mesh of every `stride`-th node.
    fn drawn(
        [rows, row_nodes]: [usize; 2],
        stride: usize,
        value: impl Fn(f64, f64) -> f64,
    ) -> Vec<f32> {
        let places = (0..rows * row_nodes).map(|node| (node / row_nodes, node % row_nodes));
        places.map(|(i, j)| value((stride * i) as f64, (stride * j) as f64) as f32).collect()
    }

    #[test]
    fn cubics_are_exact_but_at_the_edges_where_they_do_not_repeat() {
        let cubic = |x: f64, y: f64| {
            let (x, y) = (x / 20.0, y / 32.0);
            2.0 + x * x * x - 2.0 * x * y + y * y - 0.5 * y * y * y
        };
        let found = prolonged(&drawn([10, 16], 2, cubic), [10, 16]);
        let exact = drawn([20, 32], 1, cubic);
        for (node, (found, exact)) in found.iter().zip(&exact).enumerate() {
            let [i, j] = [node / 32, node % 32];
            if (2..=16).contains(&i) && (2..=28).contains(&j) {
                assert!((found - exact).abs() < 1e-6, "{i}, {j}: {found}, {exact}");
            }
        }
    }

    #[test]
    fn waves_come_around_and_nodes_of_both_meshes_keep_their_values() {
        let nodes = [24, 32];
        let wave = |x: f64, y: f64| 2.0 + (TAU * (2.0 * x / 48.0 + y / 64.0)).sin();
        let coarse = drawn(nodes, 2, wave);
        let found = prolonged(&coarse, nodes);
        for (node, (found, exact)) in found.iter().zip(drawn([48, 64], 1, wave)).enumerate() {
            let [i, j] = [node / 64, node % 64];
            // The error is 3/128 (2 q)⁴ along x, with q = 2π/24, and negligible along y.
            assert!((found - exact).abs() < 2e-3, "{i}, {j}: {found}, {exact}");
            if i % 2 == 0 && j % 2 == 0 {
                assert_eq!(*found, coarse[i / 2 * 32 + j / 2]);
            }
        }
    }

    #[test]
    fn pressures_that_rise_towards_the_edges_are_interpolated_up_to_the_edges() {
        let nodes = [6, 9];
        let rising = |[rows, columns]: [usize; 2], stride: usize| {
            let [of_rows, of_columns] = [rows, columns].map(edge_factors);
            let mut values = drawn([rows, columns], stride, |x, y| 1.0 + 0.2 * x + 0.1 * y);
            for (node, value) in values.iter_mut().enumerate() {
                *value *= of_rows[node / columns] * of_columns[node % columns];
            }
            values
        };
        let coarse = rising(nodes, 2);
        let map = CoarseMap { values: &coarse, nodes, is_periodic: false };
        let mut prolonged = Prolonged::new(map, 1.0, f64::INFINITY);
        let mut row = [0.0; 18];
        for (index, exact) in rising([12, 18], 1).chunks_exact(18).enumerate() {
            prolonged.set_row(Row::new(index, 18), &mut row);
            for (found, exact) in row.iter().zip(exact) {
                assert!((found - exact).abs() < 1e-5, "{index}: {found}, {exact}");
            }
        }
    }

    #[test]
    fn pressures_stay_within_their_bounds() {
        let coarse = drawn([4, 4], 2, |x, y| x - y);
        let map = CoarseMap { values: &coarse, nodes: [4, 4], is_periodic: true };
        let mut prolonged = Prolonged::new(map, 0.5, 2.0);
        let mut row = [0.0; 8];
        prolonged.set_row(Row::new(6, 8), &mut row);
        // Half of 6, 4, 2 and 0, clipped at 2. Other values lie between these.
        assert_eq!([row[0], row[2], row[4], row[6]], [2.0, 2.0, 1.0, 0.0]);
        assert!(row.iter().all(|p| (0.0..=2.0).contains(p)));
    }

    #[test]
    fn a_step_taken_back_leaves_pressures_as_they_were_before_it() {
        let (before, step) = ([0.5_f32, 0.0, 2.0, 1.0], [0.25_f32, 0.75, -2.0, 0.0]);
        let marked = step.map(|by| f32::from_bits(by.to_bits() & !0b111 | FREE));
        let after = [0, 1, 2, 3].map(|node| before[node] + step[node]);
        let left = |pending, ceiling| {
            let update = AppliedUpdate::new(pending, ceiling);
            [0, 1, 2, 3].map(|node| update.pressure(after[node], marked[node]))
        };
        let close = |found: [f32; 4], exact: [f32; 4]| {
            // The lowest bits of steps hold flags.
            let apart = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
            assert!(apart.into_iter().all(|by| by < 1e-6), "{found:?}, {exact:?}");
        };
        close(left(PendingUpdate::ALL_BACK, f64::INFINITY), before);
        close(left(PendingUpdate::NONE, f64::INFINITY), after);
        let half = PendingUpdate { scale: 1.0, part: 0.5 };
        close(left(half, 0.8), [0.625, 0.375, 0.8, 0.8]);
        // Without the flag of free nodes the number is not a step.
        let update = AppliedUpdate::new(PendingUpdate::ALL_BACK, f64::INFINITY);
        let unmarked = f32::from_bits(0.25_f32.to_bits() & !FREE | PRESSED);
        assert_eq!(update.pressure(1.0, unmarked), 1.0);
    }
}
