//! From a map of a coarser mesh to the pressures with which a search begins.

use pulp::Simd;

use super::super::active_groups::ActiveBand;
use super::super::flags::{FREE, PRESSED, SATURATED, has};
use super::super::in_order::{Found, InOrder};
use super::super::lanes::{LANES, Pass, greater, sum_by, total, weight};
use super::update_pressure::PendingUpdate;
use crate::contact::fft::{Band, Row};

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

    fn split_off(&self) -> Self {
        Self {
            coarse: self.coarse.clone(),
            ..*self
        }
    }

    /// Sets a row of pressures.
    #[inline(always)]
    fn set_row(&mut self, row: Row, pressure: &mut [f32]) {
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
        Self {
            prolonged: self.prolonged.split_off(),
            row: self.row.clone(),
            sum: InOrder::new(),
        }
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
            *p = if bears {
                self.hardness
            } else {
                f64::from(*prolonged)
            };
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self {
            prolonged: self.prolonged.split_off(),
            row: self.row.clone(),
            ..*self
        }
    }

    fn append(&mut self, _: Self) {}
}

/// What makes pressures of increments and moves when a search ends, where increments are all there is of pressures.
#[derive(Clone, Copy)]
pub struct LastMoveDone {
    scale: f32,
    taken_back: f32,
    ceiling: f32,
}

impl LastMoveDone {
    pub fn new(pending: PendingUpdate, ceiling: f64) -> Self {
        Self {
            scale: pending.of_pressure() as f32,
            taken_back: (1.0 - pending.part) as f32,
            ceiling: ceiling as f32,
        }
    }

    /// Of an increment, and a move if it is marked as that of a free node.
    #[inline(always)]
    fn pressure(&self, increment: f32, carry: f32) -> f32 {
        let last_move = weight::<f32>(has(carry, FREE)) * carry;
        // Rounding must not leave a pressure below zero, or above the ceiling.
        greater(self.scale * increment - self.taken_back * last_move, 0.0).min(self.ceiling)
    }
}

/// The pressures from which a search is to go on.
pub enum StartPressure<'a> {
    OfCoarserMesh(Prolonged<'a>),
    OfLastMove(LastMoveDone),
}

impl StartPressure<'_> {
    #[inline(always)]
    fn set_row(&mut self, row: Row, pressure: &mut [f32], increment: &[f32], carry: &[f32]) {
        match self {
            Self::OfCoarserMesh(prolonged) => prolonged.set_row(row, pressure),
            Self::OfLastMove(done) => {
                let nodes = increment.iter().zip(carry);
                for (p, (increment, carry)) in pressure.iter_mut().zip(nodes) {
                    *p = done.pressure(*increment, *carry);
                }
            }
        }
    }

    fn split_off(&self) -> Self {
        match self {
            Self::OfCoarserMesh(prolonged) => Self::OfCoarserMesh(prolonged.split_off()),
            Self::OfLastMove(done) => Self::OfLastMove(*done),
        }
    }
}

/// Begins the convolution of the pressures, from which the search is to go on: with the gap that there is
/// without any, which their displacement is to be added to.
pub struct BeginPressed<'a, const YIELDS: bool> {
    pub start: StartPressure<'a>,
    pub ceiling: f32,
    pub heights: &'a [f32],
    /// Subtracted from gaps.
    pub reference: f32,
    pub gap: Band<'a, f32>,
    pub increment: Band<'a, f32>,
    /// Marked by pressure; no node has moved yet.
    pub carry: Band<'a, f32>,
    /// Set where there is pressure.
    pub active: ActiveBand<'a>,
    pub sums: InOrder<PressedSums>,
}

/// Sums over the mesh.
#[derive(Clone, Copy)]
pub struct PressedSums {
    pub pressure: f64,
    /// Σ pressure × height.
    pub pressure_on_height: f64,
    pub saturated_nodes: f64,
}

impl Found for PressedSums {
    const NOTHING: Self = Self {
        pressure: 0.0,
        pressure_on_height: 0.0,
        saturated_nodes: 0.0,
    };

    fn add(&mut self, later: Self) {
        self.pressure += later.pressure;
        self.pressure_on_height += later.pressure_on_height;
        self.saturated_nodes += later.saturated_nodes;
    }
}

impl<const YIELDS: bool> Pass<f32> for BeginPressed<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let (increment, carry) = (self.increment.row(row), self.carry.row(row));
        self.start.set_row(row, values, increment, carry);
        let heights = row.of(self.heights);
        for (gap, height) in self.gap.row(row).iter_mut().zip(heights) {
            *gap = -(height + self.reference);
        }
        let ceiling = self.ceiling;
        let saturated = if YIELDS { SATURATED } else { 0 };
        let mut saturated_nodes = 0;
        for (carry, p) in carry.iter_mut().zip(&*values) {
            let bears = u32::from(*p >= ceiling);
            let pressed = PRESSED * u32::from(*p > 0.0);
            *carry = f32::from_bits(pressed | (saturated * bears));
            saturated_nodes += bears;
        }
        increment.copy_from_slice(values);
        let always = self.active.always;
        let groups = self.active.row(row);
        groups.free.fill(false);
        let increments = increment.as_chunks_mut::<LANES>().0;
        for (active, increments) in groups.active.iter_mut().zip(increments) {
            *active = always || increments.iter().any(|increment| *increment > 0.0);
            if !*active {
                // As clipping leaves them.
                increments.fill(-0.0);
            }
        }
        self.sums.push(PressedSums {
            pressure: total(values),
            pressure_on_height: sum_by(values, heights, |p, height| p * height),
            saturated_nodes: f64::from(saturated_nodes),
        });
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            start: self.start.split_off(),
            gap: self.gap.split_off(row),
            increment: self.increment.split_off(row),
            carry: self.carry.split_off(row),
            active: self.active.split_off(row),
            sums: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sums.append(later.sums);
    }
}

/// Sets s × pressure − gap, of pressures that are increments. Goes over that map.
pub struct PressureLessGap<'a> {
    /// s
    pub compliance: f32,
    /// From which gaps are counted.
    pub offset: f32,
    pub done: LastMoveDone,
    pub increment: &'a [f32],
    pub carry: &'a [f32],
    pub gap: &'a [f32],
    pub peak_pressure: f32,
}

impl Pass<f32> for PressureLessGap<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let pressed = row.of(self.increment).iter().zip(row.of(self.carry));
        let nodes = pressed.zip(row.of(self.gap));
        let mut peak = 0.0_f32;
        for (value, ((increment, carry), gap)) in values.iter_mut().zip(nodes) {
            let p = self.done.pressure(*increment, *carry);
            *value = self.compliance * p - (gap - self.offset);
            peak = greater(peak, p);
        }
        self.peak_pressure = greater(self.peak_pressure, peak);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, later: Self) {
        self.peak_pressure = greater(self.peak_pressure, later.peak_pressure);
    }
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
        places
            .map(|(i, j)| value((stride * i) as f64, (stride * j) as f64) as f32)
            .collect()
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
        let map = CoarseMap {
            values: &coarse,
            nodes: [4, 4],
        };
        let mut prolonged = Prolonged::new(map, 0.5, 2.0);
        let mut row = [0.0; 8];
        prolonged.set_row(Row::new(6, 8), &mut row);
        // Half of 6, 4, 2 and 0, and between them.
        assert_eq!([row[0], row[2], row[4], row[6]], [2.0, 2.0, 1.0, 0.0]);
        assert!(row.iter().all(|p| (0.0..=2.0).contains(p)));
    }

    #[test]
    fn a_move_taken_back_leaves_pressures_as_they_were_before_it() {
        let (before, last_move) = ([0.5_f32, 0.0, 2.0, 1.0], [0.25_f32, 0.75, -2.0, 0.0]);
        let marked = last_move.map(|by| f32::from_bits(by.to_bits() & !0b111 | FREE));
        let after = [0, 1, 2, 3].map(|node| before[node] + last_move[node]);
        let left = |pending, ceiling| {
            let done = LastMoveDone::new(pending, ceiling);
            [0, 1, 2, 3].map(|node| done.pressure(after[node], marked[node]))
        };
        let close = |found: [f32; 4], exact: [f32; 4]| {
            // Marks are in the lowest bits of moves.
            let apart = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
            assert!(
                apart.into_iter().all(|by| by < 1e-6),
                "{found:?}, {exact:?}"
            );
        };
        close(left(PendingUpdate::ALL_BACK, f64::INFINITY), before);
        close(left(PendingUpdate::NOTHING, f64::INFINITY), after);
        let half = PendingUpdate {
            scale: 1.0,
            part: 0.5,
        };
        close(left(half, 0.8), [0.625, 0.375, 0.8, 0.8]);
        // What is no move is not taken back.
        let done = LastMoveDone::new(PendingUpdate::ALL_BACK, f64::INFINITY);
        let unmarked = f32::from_bits(0.25_f32.to_bits() & !FREE | PRESSED);
        assert_eq!(done.pressure(1.0, unmarked), 1.0);
    }
}
