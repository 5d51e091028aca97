//! Preconditioner of a contact whose free nodes do not change.

use pulp::Simd;

use super::InnerSolver;
use crate::fft::{Band, Row};
use crate::solver::blocks::ResidualRows;
use crate::solver::lanes::{LANES, Pass, Shared, Visit, for_rows_with, over_rows};
use crate::solver::marks::{ActiveGroups, FREE, has};
use crate::solver::preconditioner::{Kind, Residual};

impl InnerSolver {
    /// Marks these nodes as free, and no others.
    pub fn mark_free(&mut self, nodes: &[usize]) {
        self.last_step.fill(0.0);
        for node in nodes {
            self.last_step[*node] = f32::from_bits(FREE);
        }
        let (row_nodes, band) = (self.mesh.nodes[1], self.active.band());
        for_rows_with(&self.threads, &mut self.last_step, row_nodes, band, |band, row, values| {
            let groups = band.row(row);
            let marks = groups.active.iter_mut().zip(groups.free);
            for (values, (active, free)) in values.chunks_exact(LANES).zip(marks) {
                *free = values.iter().any(|value| has(*value, FREE));
                *active = *free;
            }
        });
    }

    /// Returns the corrections z = Eᵀ K E r of the free nodes, given in the order of `nodes`, and
    /// the number of transform pairs. Overwrites the gaps and the pressures in single precision.
    pub fn corrections_of(&mut self, nodes: &[usize], residual: &[f64]) -> (Vec<f64>, u32) {
        self.gap.fill(0.0);
        for (node, residual) in nodes.iter().zip(residual) {
            self.gap[*node] = *residual as f32;
        }
        let mut pass = AddResidual {
            last_step: &self.last_step,
            active: &self.active,
            residual: self.preconditioner.residual_rows(),
        };
        over_rows(&self.threads, &mut self.gap, self.mesh.nodes[1], &mut pass);
        let free = Residual {
            gap: &self.gap,
            level: 0.0,
            last_step: &self.last_step,
            active: &self.active,
        };
        let (mesh, scratch, threads) = (&self.mesh, &mut self.scratch, &self.threads);
        let pairs = self.preconditioner.apply(Kind::Extended, mesh, free, scratch, threads);
        let (corrections, transposed) =
            self.preconditioner.corrections(mesh, &self.gap, 0.0, scratch, threads);
        let (active, stored) = (&self.active, Band::new(&mut self.pressure_increment));
        corrections.read(&mut Visit::rows(
            (transposed, stored),
            |(transposed, stored), row, values| {
                transposed.add_to_row(row, values, active.free_row(row));
                stored.row(row).copy_from_slice(values);
            },
        ));
        (nodes.iter().map(|node| f64::from(self.pressure_increment[*node])).collect(), pairs)
    }
}

/// Pass over the residual that adds it up in blocks, for the extension.
struct AddResidual<'a> {
    last_step: &'a [f32],
    active: &'a ActiveGroups,
    residual: ResidualRows<'a>,
}

impl Pass<f32> for AddResidual<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let groups = self.active.free_row(row);
        self.residual.add_row::<S, R>(simd, row, values, row.of(self.last_step), groups);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { residual: self.residual.split_off(row), ..*self }
    }
}
