//! Corrections that are each node's own, with no transform between the gap and a pass that sees them.

use pulp::Simd;

use super::super::lanes::{Pass, Wide};
use crate::fft::{Row, Scratch, Transform, see_pairs};
use crate::threads::Threads;

/// A stiffness times the gap above a level.
#[derive(Clone, Copy)]
pub struct Nodal<'a> {
    pub gap: &'a [f32],
    pub level: f32,
    pub stiffness: f32,
}

impl Nodal<'_> {
    /// Lets a pass see these pairs of rows of a map of `nodes`. Pairs ascend.
    pub fn peek<P: Pass<f32>>(
        self,
        threads: &Threads,
        pairs: &[usize],
        nodes: [usize; 2],
        pass: &mut Wide<P>,
    ) {
        self.over(nodes[1], pass, |rows| {
            see_pairs(threads, pairs, nodes, rows);
        });
    }

    /// Begins the convolution of the map by which a pass replaces them.
    pub fn turn<P: Pass<f32>>(
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
        see: impl FnOnce(&mut Wide<NodalRows<P>>),
    ) {
        let mut rows = Wide(NodalRows { of: self, pass: pass.0.split_off(Row::new(0, row_nodes)) });
        see(&mut rows);
        pass.0.append(rows.0.pass);
    }
}

/// Rows of them, and the pass that sees them.
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
