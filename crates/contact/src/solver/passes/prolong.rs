//! From a map of a coarser mesh to the pressures with which a search begins.

use pulp::Simd;

use super::super::in_order::InOrder;
use super::super::lanes::{Pass, total};
use crate::fft::Row;

/// Cubic interpolation half-way between nodes: shares of the two nearest, and of the two beyond.
const NEAR: f32 = 9.0 / 16.0;
const FAR: f32 = -1.0 / 16.0;

/// Nodes that a row has more, before and after.
const BEFORE: usize = 1;
const AFTER: usize = 2;

/// A map on every second node along both axes, which comes again beyond its edges.
#[derive(Clone, Copy)]
pub struct CoarseMap<'a> {
    pub values: &'a [f32],
    /// Its nodes along x and y.
    pub nodes: [usize; 2],
}

/// Rows of pressures on the finer mesh, as far as they are positive.
pub struct Prolonged<'a> {
    map: CoarseMap<'a>,
    /// Pressure over what is interpolated.
    factor: f32,
    ceiling: f32,
    /// A row between nodes of the coarser mesh, with some more before and after.
    coarse: Vec<f32>,
}

impl<'a> Prolonged<'a> {
    pub fn new(map: CoarseMap<'a>, factor: f64, ceiling: f64) -> Self {
        Self {
            map,
            factor: factor as f32,
            ceiling: ceiling as f32,
            coarse: vec![0.0; BEFORE + map.nodes[1] + AFTER],
        }
    }

    pub fn split_off(&self) -> Self {
        Self { coarse: self.coarse.clone(), ..*self }
    }

    /// Sets a row of pressures.
    #[inline(always)]
    pub fn set_row(&mut self, row: Row, pressure: &mut [f32]) {
        let nodes = self.map.nodes[1];
        let own = &mut self.coarse[BEFORE..][..nodes];
        let at = row.index() / 2;
        if row.index().is_multiple_of(2) {
            own.copy_from_slice(self.map.row(at, 0));
        } else {
            let [a, b, c, d] = [-1, 0, 1, 2].map(|by| self.map.row(at, by));
            let far = a.iter().zip(d);
            for ((own, (b, c)), (a, d)) in own.iter_mut().zip(b.iter().zip(c)).zip(far) {
                *own = half_way(*a, *b, *c, *d);
            }
        }
        let [first, second, last] = [own[0], own[1 % nodes], own[nodes - 1]];
        self.coarse[0] = last;
        self.coarse[BEFORE + nodes] = first;
        self.coarse[BEFORE + nodes + 1] = second;
        let pairs = pressure.as_chunks_mut::<2>().0;
        for (pair, near) in pairs.iter_mut().zip(self.coarse.windows(4)) {
            let [a, b, c, d] = [near[0], near[1], near[2], near[3]];
            *pair = [b, half_way(a, b, c, d)];
        }
        let (factor, ceiling) = (self.factor, self.ceiling);
        for p in pressure {
            *p = (factor * *p).max(0.0).min(ceiling);
        }
    }
}

impl<'a> CoarseMap<'a> {
    /// So many rows beyond one.
    #[inline(always)]
    fn row(&self, at: usize, by: isize) -> &'a [f32] {
        let rows = self.nodes[0] as isize;
        let index = at as isize + by;
        Row::new(index.rem_euclid(rows) as usize, self.nodes[1]).of(self.values)
    }
}

#[inline(always)]
fn half_way(a: f32, b: f32, c: f32, d: f32) -> f32 {
    NEAR * (b + c) + FAR * (a + d)
}

/// Adds up what the pressures come to.
pub struct SumProlonged<'a> {
    pub prolonged: Prolonged<'a>,
    pub row: Vec<f32>,
    pub sum: InOrder<f64>,
}

impl Pass<f32> for SumProlonged<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, _: &mut [f32]) {
        self.prolonged.set_row(row, &mut self.row);
        self.sum.push(total(&self.row));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { prolonged: self.prolonged.split_off(), row: self.row.clone(), sum: InOrder::new() }
    }

    fn append(&mut self, later: Self) {
        self.sum.append(later.sum);
    }
}

/// Sets pressures of a mesh, in double precision.
pub struct SetProlonged<'a> {
    pub prolonged: Prolonged<'a>,
    pub hardness: f64,
    pub row: Vec<f32>,
}

impl Pass<f64> for SetProlonged<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        self.prolonged.set_row(row, &mut self.row);
        for (p, prolonged) in pressure.iter_mut().zip(&self.row) {
            // Single precision may not hold the hardness.
            let bears = *prolonged >= self.prolonged.ceiling;
            *p = if bears { self.hardness } else { f64::from(*prolonged) };
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { prolonged: self.prolonged.split_off(), row: self.row.clone(), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// All rows of what is interpolated, where it is positive.
    fn prolonged(values: &[f32], nodes: [usize; 2]) -> Vec<f32> {
        let map = CoarseMap { values, nodes };
        let mut prolonged = Prolonged::new(map, 1.0, f64::INFINITY);
        let row_nodes = 2 * nodes[1];
        let mut all = vec![0.0; 4 * values.len()];
        for (index, row) in all.chunks_exact_mut(row_nodes).enumerate() {
            prolonged.set_row(Row::new(index, row_nodes), row);
        }
        all
    }

    /// A map by its places on the mesh of twice the nodes.
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
            // 3/128 (2 q)⁴ along x, with q = 2π/24, and next to nothing along y.
            assert!((found - exact).abs() < 2e-3, "{i}, {j}: {found}, {exact}");
            if i % 2 == 0 && j % 2 == 0 {
                assert_eq!(*found, coarse[i / 2 * 32 + j / 2]);
            }
        }
    }

    #[test]
    fn pressures_stay_within_their_bounds() {
        let coarse = drawn([4, 4], 2, |x, y| x - y);
        let map = CoarseMap { values: &coarse, nodes: [4, 4] };
        let mut prolonged = Prolonged::new(map, 0.5, 2.0);
        let mut row = [0.0; 8];
        prolonged.set_row(Row::new(6, 8), &mut row);
        // Half of 6, 4, 2 and 0, and between them.
        assert_eq!([row[0], row[2], row[4], row[6]], [2.0, 2.0, 1.0, 0.0]);
        assert!(row.iter().all(|p| (0.0..=2.0).contains(p)));
    }
}
