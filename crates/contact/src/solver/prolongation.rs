//! Contact on a coarser mesh, and its pressures interpolated to the next finer mesh.

use pulp::Simd;

use super::balance::Balance;
use super::evaluation::{Convergence, Evaluation};
use super::inner_solver::InnerSolver;
use super::lanes::{InOrder, Pass, Wide, over_rows, total};
use super::passes::{AppliedUpdate, BeginPressed, PendingUpdate, PressureLessGap, StartPressure};
use super::start::Start;
use super::{Outcome, Settings, Solver};
use crate::fft::{Band, Row};

/// Ratio of the numbers of nodes of a mesh and of the next coarser mesh.
pub const RATIO: f64 = 4.0;

/// Ratio of the factor s in the map s p − g to the displacement of one node of the finer mesh under
/// unit pressure on itself. Ratios of 1 and 2 take as many pairs.
const COMPLIANCES: f64 = 1.5;

pub struct CoarseContact {
    /// Map s p − g of the pressure p and the gap g, with a compliance s.
    pressure_less_gap: Vec<f32>,
    nodes: [usize; 2],
    pub reference: f64,
    pub peak_pressure: f64,
    /// Number of transform pairs used; pairs on coarser meshes count in proportion to their nodes.
    pub pairs: f64,
}

impl CoarseContact {
    pub fn empty(nodes: [usize; 2]) -> Self {
        Self {
            pressure_less_gap: Vec::new(),
            nodes,
            reference: 0.0,
            peak_pressure: 0.0,
            pairs: 0.0,
        }
    }

    pub fn map(&self) -> CoarseMap<'_> {
        CoarseMap { values: &self.pressure_less_gap, nodes: self.nodes }
    }

    /// Returns the number of pairs on the next finer mesh that take as long as the transform pairs
    /// used so far.
    pub fn finer_pairs(&self) -> u32 {
        (self.pairs / RATIO).round() as u32
    }

    pub fn clear(&mut self) {
        self.pressure_less_gap.clear();
        self.pressure_less_gap.resize(self.nodes[0] * self.nodes[1], 0.0);
        self.peak_pressure = 0.0;
    }

    /// Sets the map to s p − g of `inner` after the update `pending`, with s = `compliance`. Gaps
    /// are measured from `offset`, approximately the mean gap in contact.
    pub fn take_iterate(
        &mut self,
        inner: &InnerSolver,
        pending: PendingUpdate,
        offset: f64,
        compliance: f64,
    ) {
        self.pressure_less_gap.resize(inner.cells(), 0.0);
        let mut pass = PressureLessGap {
            compliance: compliance as f32,
            offset: offset as f32,
            update: AppliedUpdate::new(pending, inner.ceiling()),
            pressure_increment: &inner.pressure_increment,
            last_step: &inner.last_step,
            gap: &inner.gap,
            peak_pressure: 0.0,
        };
        let map = &mut self.pressure_less_gap;
        over_rows(&inner.threads, map, self.nodes[1], &mut pass);
        self.peak_pressure = f64::from(pass.peak_pressure);
        self.reference = inner.reference + offset;
    }

    /// Sets the map to s p − g of the last solution of `solver`, which has this outcome, with s =
    /// `compliance`.
    pub fn take_solution(&mut self, solver: &Solver, outcome: &Outcome, compliance: f64) {
        let (gap, offset) = (&solver.inner.gap, solver.offset);
        let nodes = solver.pressure.iter().zip(gap);
        let less_gap = nodes.map(|(p, gap)| (compliance * p - (f64::from(*gap) - offset)) as f32);
        self.pressure_less_gap.clear();
        self.pressure_less_gap.extend(less_gap);
        self.reference = solver.inner.reference + offset;
        self.peak_pressure = outcome.peak_pressure;
        self.pairs = f64::from(outcome.pairs);
    }
}

impl InnerSolver {
    /// Returns the factor s of the map s p − g with which iterations on this mesh begin, where p
    /// and g are the pressure and the gap on the next coarser mesh.
    pub fn compliance(&self) -> f64 {
        COMPLIANCES * self.mesh.nodal_compliance
    }
}

/// Assumed error of the gaps under interpolated pressures, in mesh steps at unit rms slope. If the
/// material yields, open and saturated nodes within this error take part in the estimate of the
/// first offset.
const NEAR: f64 = 1.0;

impl Solver {
    /// Sets the pressures to those interpolated from a coarser mesh, imposes the load and evaluates
    /// them. Returns `None` if no interpolated pressure is positive.
    pub(super) fn evaluate_prolonged(
        &mut self,
        coarse: &CoarseContact,
        settings: &Settings,
    ) -> Option<Evaluation> {
        let prolonged = self.inner.prolonged(coarse)?;
        let row_nodes = self.inner.mesh.nodes[1];
        let mut pass =
            SetProlonged { prolonged, hardness: self.inner.ceiling(), row: vec![0.0; row_nodes] };
        let pressure = &mut self.pressure;
        over_rows(&self.inner.threads, pressure, row_nodes, &mut pass);
        self.impose_load();
        self.inner.reference = coarse.reference;
        Some(self.evaluate_guess(settings))
    }
}

impl InnerSolver {
    /// Begins iterations in single precision with pressures interpolated from a coarser mesh; takes
    /// one transform pair. Returns `None` if no interpolated pressure is positive.
    pub fn begin_from(&mut self, coarse: &CoarseContact) -> Option<Start> {
        let prolonged = self.prolonged(coarse)?;
        self.reference_pressure.clear();
        self.reference = coarse.reference;
        Some(self.begin_pressed(StartPressure::FromCoarserMesh(prolonged)))
    }

    /// Begins new iterations from the present pressures after the update `pending`; takes one
    /// transform pair. Adds `offset`, approximately the mean gap in contact, to the reference of
    /// the gaps.
    pub fn begin_again(&mut self, pending: PendingUpdate, offset: f64) -> Start {
        self.reference += offset;
        let update = AppliedUpdate::new(pending, self.ceiling());
        self.begin_pressed(StartPressure::FromLastIteration(update))
    }

    fn begin_pressed(&mut self, start: StartPressure) -> Start {
        match self.bound {
            None => self.begin_pressed_as::<false>(start),
            Some(_) => self.begin_pressed_as::<true>(start),
        }
    }

    fn begin_pressed_as<const YIELDS: bool>(&mut self, start: StartPressure) -> Start {
        let reference = self.reference + self.mesh.highest;
        let hardness = self.ceiling();
        let mut pass = Wide(BeginPressed::<YIELDS> {
            start,
            ceiling: hardness as f32,
            heights: &self.mesh.heights,
            reference: reference as f32,
            gap: Band::new(&mut self.gap),
            pressure_increment: Band::new(&mut self.pressure_increment),
            last_step: Band::new(&mut self.last_step),
            active: self.active.band(),
            sums: InOrder::new(),
        });
        self.mesh.transform.begin(&mut pass, &mut self.buffers.scratch);
        let sums = pass.0.sums.total();
        let work = self.mesh.transform.multiply(&self.mesh.displacement, &mut self.buffers.scratch);
        self.pairs += 1;
        let offset = if YIELDS {
            let near = Convergence { offset: 0.0, error: NEAR / self.mesh.steps_per_side };
            self.peek_offset(1.0, near, false)
        } else {
            (work - sums.pressure_on_height) / sums.pressure - reference
        };
        let (convergence, free_offset) = self.update_gap::<YIELDS>(PendingUpdate::NONE, offset);
        let balance = YIELDS.then(|| Balance {
            sum: sums.pressure + sums.saturated_nodes * (hardness - f64::from(hardness as f32)),
            free_offset,
        });
        Start { convergence, reference_sum: 0.0, balance }
    }

    /// Returns the pressures interpolated from a coarser mesh, or `None` if none of them is
    /// positive.
    ///
    /// Without an upper bound, they are scaled so that their mean is the load.
    fn prolonged<'a>(&mut self, coarse: &'a CoarseContact) -> Option<Prolonged<'a>> {
        let ceiling = self.ceiling();
        let per_pressure = 1.0 / self.compliance();
        let row_nodes = self.mesh.nodes[1];
        let mut pass = SumProlonged {
            prolonged: Prolonged::new(coarse.map(), per_pressure, ceiling),
            row: vec![0.0; row_nodes],
            sum: InOrder::new(),
        };
        let cells = self.cells();
        let rows = &mut self.gap[..cells];
        over_rows(&self.threads, rows, row_nodes, &mut pass);
        let sum = pass.sum.total();
        let scale = match self.bound {
            None => self.load * self.cells() as f64 / sum,
            Some(_) => 1.0,
        };
        let is_some = sum > 0.0 && scale.is_finite();
        is_some.then(|| Prolonged::new(coarse.map(), scale * per_pressure, ceiling))
    }
}

/// Weight of each of the two nearest nodes in the cubic interpolation half-way between them.
const INNER: f32 = 9.0 / 16.0;

/// Weight of each of the two nodes beyond the nearest ones.
const OUTER: f32 = -1.0 / 16.0;

/// Number of nodes from the end of a periodic row that are repeated before its beginning, for the
/// interpolation there.
const BEFORE: usize = 1;

/// Number of nodes from the beginning of a periodic row that are repeated after its end.
const AFTER: usize = 2;

/// Periodic map on every second node along both axes.
#[derive(Clone, Copy)]
pub struct CoarseMap<'a> {
    pub values: &'a [f32],
    /// Numbers of nodes of the map along x and y.
    pub nodes: [usize; 2],
}

/// Interpolation of a coarser map to rows of pressures on the finer mesh: clamp(`factor` × value,
/// 0, `ceiling`).
pub struct Prolonged<'a> {
    map: CoarseMap<'a>,
    /// Ratio of pressure to interpolated value.
    factor: f32,
    ceiling: f32,
    /// Row of the coarser mesh, interpolated between its rows, with repeated nodes before and
    /// after.
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

    /// Writes a row of pressures of the finer mesh.
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
    /// Returns the row `by` rows after row `at`.
    #[inline(always)]
    fn row(&self, at: usize, by: isize) -> &'a [f32] {
        let rows = self.nodes[0] as isize;
        let index = at as isize + by;
        Row::new(index.rem_euclid(rows) as usize, self.nodes[1]).of(self.values)
    }
}

#[inline(always)]
fn half_way(a: f32, b: f32, c: f32, d: f32) -> f32 {
    INNER * (b + c) + OUTER * (a + d)
}

/// Pass that adds up the interpolated pressures, without writing them.
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

/// Pass over pressures in double precision that sets them to the interpolated pressures.
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
            // The hardness may not be a single-precision number.
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

    /// Returns the positive part of the interpolated map.
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
    fn pressures_stay_within_their_bounds() {
        let coarse = drawn([4, 4], 2, |x, y| x - y);
        let map = CoarseMap { values: &coarse, nodes: [4, 4] };
        let mut prolonged = Prolonged::new(map, 0.5, 2.0);
        let mut row = [0.0; 8];
        prolonged.set_row(Row::new(6, 8), &mut row);
        // Half of 6, 4, 2 and 0, clipped at 2. Other values lie between these.
        assert_eq!([row[0], row[2], row[4], row[6]], [2.0, 2.0, 1.0, 0.0]);
        assert!(row.iter().all(|p| (0.0..=2.0).contains(p)));
    }
}
