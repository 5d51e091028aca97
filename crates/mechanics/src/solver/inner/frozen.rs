//! Preconditioner of a contact whose free nodes do not change.

use pulp::Simd;

use super::InnerSolver;
use crate::fft::{Band, Row};
use crate::solver::blocks::{ResidualRows, TransposeOutput};
use crate::solver::lanes::{LANES, Pass, Wide, over_rows};
use crate::solver::marks::{ActiveBand, ActiveGroups, FREE};
use crate::solver::preconditioner::{Kind, Residual};

impl InnerSolver {
    /// Marks these nodes as free, and no others.
    pub fn mark_free(&mut self, nodes: &[usize]) {
        self.last_step.fill(0.0);
        for node in nodes {
            self.last_step[*node] = f32::from_bits(FREE);
        }
        let mut pass = MarkGroups { groups: self.active.band() };
        over_rows(&self.threads, &mut self.last_step, self.mesh.nodes[1], &mut pass);
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
        corrections.read(&mut Wide(StoreCorrections {
            active: &self.active,
            transposed,
            corrections: Band::new(&mut self.pressure_increment),
        }));
        (nodes.iter().map(|node| f64::from(self.pressure_increment[*node])).collect(), pairs)
    }
}

/// Pass over the last steps that marks the groups with a free node.
struct MarkGroups<'a> {
    groups: ActiveBand<'a>,
}

impl Pass<f32> for MarkGroups<'_> {
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let groups = self.groups.row(row);
        let marks = groups.active.iter_mut().zip(groups.free);
        for (values, (active, free)) in values.chunks_exact(LANES).zip(marks) {
            *free = values.iter().any(|value| value.to_bits() & FREE != 0);
            *active = *free;
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { groups: self.groups.split_off(row) }
    }

    fn append(&mut self, _: Self) {}
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

    fn append(&mut self, _: Self) {}
}

/// Pass over the corrections that stores them.
struct StoreCorrections<'a> {
    active: &'a ActiveGroups,
    transposed: TransposeOutput<'a>,
    corrections: Band<'a, f32>,
}

impl Pass<f32> for StoreCorrections<'_> {
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        self.transposed.add_to_row(row, values, self.active.free_row(row));
        self.corrections.row(row).copy_from_slice(values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            transposed: self.transposed.split_off(),
            corrections: self.corrections.split_off(row),
            ..*self
        }
    }

    fn append(&mut self, _: Self) {}
}
