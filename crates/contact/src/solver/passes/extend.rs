//! Passes before and after the convolution with the stiffness, and the nodal part of corrections,
//! which needs no transform.

use pulp::Simd;

use crate::fft::{Row, Scratch, Transform, visit_pairs};
use crate::solver::extension::{ExtendedRows, TransposeInput};
use crate::solver::flags::{ALL, ActiveGroups, FREE};
use crate::solver::lanes::{Lanes, Pass, REST, Wide, split, split_mut};
use crate::threads::Threads;

/// Pass that writes the residual of free nodes, extended to all other nodes of the mesh, as input
/// of the convolution with the stiffness.
///
/// The map may be a corner of a larger mesh.
pub struct Extend<'a> {
    pub map: [usize; 2],
    pub level: f32,
    pub gap: &'a [f32],
    pub last_step: &'a [f32],
    pub active: &'a ActiveGroups,
    pub extended: ExtendedRows<'a>,
}

impl Pass<f32> for Extend<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let [(own, of_own), (other, of_other)] = self.extended.row(row);
        let [rows, row_nodes] = self.map;
        let inside = if row.index() < rows { row_nodes } else { 0 };
        let (values, beyond) = values.split_at_mut(inside);
        continue_all([of_own, of_other], beyond, &own[inside..], &other[inside..]);
        if inside == 0 {
            return;
        }
        let row = Row::new(row.index(), row_nodes);
        let (own, last_own) = split::<S, R>(&own[..values.len()]);
        let (other, last_other) = split::<S, R>(&other[..values.len()]);
        let (values, last_values) = split_mut::<S, R>(values);
        let (gap, last_gap) = split::<S, R>(row.of(self.gap));
        let (last_step, rest_step) = split::<S, R>(row.of(self.last_step));
        let choice = Choose { level: self.level, weights: [of_own, of_other] };
        let free = self.active.free_row(row);
        choice.choose(simd, free, values, gap, last_step, own, other);
        choice.choose(
            REST,
            &ALL[..last_values.len()],
            last_values,
            last_gap,
            rest_step,
            last_own,
            last_other,
        );
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { extended: self.extended.split_off(), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[inline(always)]
fn continue_all([of_own, of_other]: [f32; 2], values: &mut [f32], own: &[f32], other: &[f32]) {
    for (value, (own, other)) in values.iter_mut().zip(own.iter().zip(other)) {
        *value = of_own * own + of_other * other;
    }
}

/// Computation of rows for [`Extend`]: the residual gap − `level` at free nodes, and elsewhere the
/// extension, interpolated between two rows with `weights`.
#[derive(Clone, Copy)]
struct Choose {
    level: f32,
    weights: [f32; 2],
}

impl Choose {
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "a row of each map")]
    fn choose<S: Simd, const R: usize>(
        self,
        simd: S,
        groups: &[bool],
        values: &mut [[S::f32s; R]],
        gap: &[[S::f32s; R]],
        last_step: &[[S::f32s; R]],
        own: &[[S::f32s; R]],
        other: &[[S::f32s; R]],
    ) {
        let level = Lanes::all(simd, self.level);
        let of_own = Lanes::all(simd, self.weights[0]);
        let of_other = Lanes::all(simd, self.weights[1]);
        let nodes = values.iter_mut().zip(gap).zip(last_step);
        let nodes = nodes.zip(own.iter().zip(other)).zip(groups);
        for ((((value, gap), last_step), (own, other)), has_free) in nodes {
            let own = of_own * Lanes::of(simd, *own);
            let continued = own.plus(of_other, Lanes::of(simd, *other));
            if !has_free {
                *value = continued.numbers();
                continue;
            }
            let free = Lanes::of(simd, *last_step).has(FREE);
            let above = Lanes::of(simd, *gap) - level;
            *value = free.choose(above, continued).numbers();
        }
    }
}

/// Pass over pressures on all nodes of the mesh that adds up, in blocks, the pressures on nodes
/// that are not free, as input of the transpose of the [extension](crate::solver::extension).
pub struct CollectFixed<'a> {
    /// Numbers of nodes of the map along x and y. The mesh may be larger; its nodes outside the map
    /// are never free.
    pub map: [usize; 2],
    pub last_step: &'a [f32],
    pub active: &'a ActiveGroups,
    pub collected: TransposeInput<'a>,
}

impl Pass<f32> for CollectFixed<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let [rows, row_nodes] = self.map;
        if row.index() < rows {
            let last_step = Row::new(row.index(), row_nodes).of(self.last_step);
            let free = self.active.free_row(row);
            self.collected.collect_row::<S, R>(simd, row, values, last_step, free);
        } else {
            self.collected.collect_row::<S, R>(simd, row, values, &[], &[]);
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { collected: self.collected.split_off(row), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Nodal part of corrections, `stiffness` × (gap − `level`) at each node.
#[derive(Clone, Copy)]
pub struct Nodal<'a> {
    pub gap: &'a [f32],
    pub level: f32,
    pub stiffness: f32,
}

impl Nodal<'_> {
    /// Passes rows 2i and 2i + 1 of the corrections to `pass`, for each i in `pairs`, in ascending
    /// order. `nodes` are the numbers of nodes of the map.
    pub fn peek<P: Pass<f32>>(
        self,
        threads: &Threads,
        pairs: &[usize],
        nodes: [usize; 2],
        pass: &mut Wide<P>,
    ) {
        self.over(nodes[1], pass, |rows| {
            visit_pairs(threads, pairs, nodes, rows);
        });
    }

    /// Passes all rows of corrections to `pass`, and begins the convolution of the rows that `pass`
    /// writes in their place.
    pub fn begin<P: Pass<f32>>(
        self,
        row_nodes: usize,
        pass: &mut Wide<P>,
        transform: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        self.over(row_nodes, pass, |rows| transform.begin(rows, scratch));
    }

    fn over<P: Pass<f32>>(
        self,
        row_nodes: usize,
        pass: &mut Wide<P>,
        visit: impl FnOnce(&mut Wide<NodalRows<P>>),
    ) {
        let mut rows = Wide(NodalRows { of: self, pass: pass.0.split_off(Row::new(0, row_nodes)) });
        visit(&mut rows);
        pass.0.append(rows.0.pass);
    }
}

/// Pass that computes rows of nodal corrections and hands them to another pass.
struct NodalRows<'a, P> {
    of: Nodal<'a>,
    pass: P,
}

impl<P: Pass<f32>> Pass<f32> for NodalRows<'_, P> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let Nodal { gap, level, stiffness } = self.of;
        for (value, gap) in values.iter_mut().zip(row.of(gap)) {
            *value = stiffness * (gap - level);
        }
        self.pass.row::<S, R>(simd, row, values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { of: self.of, pass: self.pass.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.pass.append(later.pass);
    }
}
