//! Preconditioner of the conjugate gradients: Eᵀ K E, or a cheaper one of two levels.
//!
//! Eᵀ K E consists of the [`Extension`] E of the residual of free nodes to all nodes, the stiffness
//! K of the half-space, which turns it into pressures, and the transpose Eᵀ, which returns the
//! pressures of other nodes to free nodes. In the first iterations,
//! [`TwoLevel`](super::blocks::TwoLevel) takes its place.
//!
//! For periodic bodies, pressures and displacements are convolved on the mesh of the map. For an
//! isolated patch, pressures are convolved on a mesh of four times the nodes, so that periodic
//! images do not interact. Displacements need only a margin around the map, in which they decay.
//! Without the margin, corrections near the edges would be too large by a factor of up to 2.3,
//! which is the largest eigenvalue of S⁻¹ Eᵀ K E. With 1.25 times the nodes along both axes the
//! factor is 1.44, and with 1.5 or 2 times 1.37, as for periodic maps.

use pulp::Simd;

use super::blocks::{
    BlockBuffers, ExtendedRows, Extension, Nodal, ResidualRows, SIDE, TransposeInput,
    TransposeOutput,
};
use super::lanes::{Lanes, Pass, REST, Shared, Wide, split, split_mut};
use super::mesh::Mesh;
use super::passes::{Direction, FindClipped, ReferencePressure};
use crate::fft::{Band, Row, Rows, Scratch, Stored, Transform, in_corner, visit_pairs};
use crate::solver::marks::{ALL, ActiveGroups, FREE};
use crate::threads::Threads;

/// Preconditioner of one solver: it turns the residual r into corrections z ≈ S r.
///
/// z is stored row by row, and [`Corrections`] reads it. The residual is added up in blocks by the
/// pass that computes it ([`Preconditioner::residual_rows`]).
pub struct Preconditioner {
    extension: Extension,
    blocks: BlockBuffers,
    /// Compensation for clipped pressures, on bodies whose long waves are soft.
    pub clipping: Option<Clipping>,
    larger: Option<LargerMesh>,
    /// True if the present corrections were computed with the two-level preconditioner.
    is_by_blocks: bool,
}

/// Compensation for the pressures that a step clips.
///
/// Clipping adds pressure to nodes that have too little. If long waves are soft, the body sinks
/// under it, far around the clipped nodes, and a step that clips many nodes then increases the
/// energy. Clipped pressures are therefore taken from the free nodes that remain around them, which
/// almost keeps the displacements: the transpose Eᵀ of an [`Extension`] of the remaining free nodes
/// distributes them. Without it, coatings of a hundred times the modulus take three to nine times
/// the pairs, or do not converge.
pub struct Clipping {
    /// Extension of the residual of the remaining free nodes, on the mesh of the map.
    extension: Extension,
    /// Pressure that is taken from each remaining node of the smallest blocks.
    compensation: Vec<f32>,
    rounds: usize,
}

/// Displacement of some waves, relative to a half-space, above which clipped pressures are
/// compensated.
const SOFT: f64 = 1.2;

/// Displacement of waves, relative to a half-space, for which the extension that distributes
/// clipped pressures decays. With half of it, coatings take up to a sixth more pairs.
const CLIPPED_RELATIVE: f64 = 2.0;

/// Number of rounds in which clipped pressures are determined, because the compensation clips
/// further nodes. On thin coatings of a hundred times the modulus, loads take twice the pairs with
/// one round, and as many with three. With free boundaries one suffices.
const ROUNDS: usize = 2;

impl Clipping {
    /// Returns the compensation on a mesh, or `None` if no waves are soft.
    fn new(mesh: &Mesh) -> Option<Self> {
        let relative = &mesh.relative_displacements;
        if !mesh.has_margin() && relative.iter().all(|relative| *relative <= SOFT) {
            return None;
        }
        let extension =
            Extension::new(mesh.nodes, mesh.nodes, &vec![CLIPPED_RELATIVE; relative.len()]);
        let compensation = vec![0.0; extension.levels[0].values.len()];
        let rounds = if mesh.has_margin() { 1 } else { ROUNDS };
        Some(Self { extension, compensation, rounds })
    }
}

/// Buffers for convolutions with the stiffness on a mesh that is larger than the map.
struct LargerMesh {
    scratch: Scratch<f32>,
    /// Steps of the pressures, which are copied from this mesh to the mesh on which pressures are
    /// convolved.
    steps: Vec<f32>,
}

/// Kinds of preconditioners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// [Eᵀ K E](Extension), which takes a transform pair.
    Extended,
    /// K alone between the free nodes, which makes corrections local. It is needed after steps that
    /// were far too long, and takes a transform pair.
    Restricted,
    /// The [two-level preconditioner](super::blocks::TwoLevel), which takes no transform pair.
    TwoLevel,
}

/// Residual of the free nodes, gap − `level`.
#[derive(Clone, Copy)]
pub struct Residual<'a> {
    pub gap: &'a [f32],
    pub level: f64,
    /// Last steps, with the flags of the nodes.
    pub last_step: &'a [f32],
    pub active: &'a ActiveGroups,
}

impl Preconditioner {
    pub fn new(threads: &Threads, mesh: &Mesh) -> Self {
        let larger = mesh.stiffness.larger.as_ref();
        let stiffness_nodes = larger.map_or(mesh.nodes, Transform::nodes);
        Self {
            extension: Extension::new(mesh.nodes, stiffness_nodes, &mesh.relative_displacements),
            blocks: mesh.two_level.buffers(threads),
            clipping: Clipping::new(mesh),
            larger: larger.map(|transform| LargerMesh {
                scratch: transform.scratch_on(threads.clone()),
                steps: vec![0.0; mesh.cells()],
            }),
            is_by_blocks: false,
        }
    }

    pub fn set_threads(&mut self, threads: &Threads) {
        self.blocks.set_threads(threads);
        if let Some(larger) = &mut self.larger {
            larger.scratch.set_threads(threads.clone());
        }
    }

    /// Returns the sums of the residual in blocks, to which a pass adds the rows of the residual.
    pub fn residual_rows(&mut self) -> ResidualRows<'_> {
        self.extension.residual_rows()
    }

    /// Computes the corrections z from the residual, and returns the number of transform pairs that
    /// it took.
    pub fn apply(
        &mut self,
        kind: Kind,
        mesh: &Mesh,
        residual: Residual,
        scratch: &mut Scratch<f32>,
        threads: &Threads,
    ) -> u32 {
        self.is_by_blocks = kind == Kind::TwoLevel;
        self.extension.is_enabled = kind != Kind::Restricted;
        if self.is_by_blocks {
            mesh.two_level.correct(threads, &mut self.extension, &mut self.blocks);
            return 0;
        }
        let Residual { gap, level, last_step, active } = residual;
        let (transform, scratch) = match (&mesh.stiffness.larger, &mut self.larger) {
            (Some(transform), Some(larger)) => (transform, &mut larger.scratch),
            _ => (&mesh.transform, scratch),
        };
        self.extension.extend(threads);
        let extended = self.extension.extended_rows();
        let level = level as f32;
        let mut pass = Wide(Extend { map: mesh.nodes, level, gap, last_step, active, extended });
        transform.begin(&mut pass, scratch);
        transform.multiply(&mesh.stiffness.kernel, scratch);
        let collected = self.extension.transpose_input();
        let mut pass = Wide(CollectFixed { map: mesh.nodes, last_step, active, collected });
        transform.pass(Stored::Spectra, Stored::Rows, &mut pass, scratch);
        self.extension.collect(threads);
        1
    }

    /// Changes the corrections such that what clipping at zero and at `ceiling` adds to the
    /// pressures of the step along `direction` is taken from the free nodes around it.
    ///
    /// `gap` and `level` of the residual are those from which the corrections were computed.
    pub fn compensate_clipping(
        &mut self,
        mesh: &Mesh,
        (direction, ceiling): (Direction, f32),
        (reference_pressure, pressure_increment): (&ReferencePressure, &[f32]),
        residual: Residual,
        scratch: &mut Scratch<f32>,
        threads: &Threads,
    ) {
        let Some(mut clipping) = self.clipping.take() else {
            return;
        };
        let Clipping { extension, compensation, rounds } = &mut clipping;
        let blocks = extension.levels[0].blocks[1];
        compensation.fill(0.0);
        for _ in 0..*rounds {
            let (corrections, transposed) =
                self.corrections(mesh, residual.gap, residual.level, scratch, threads);
            let (clipped, remaining) = extension.transpose_input_and_free();
            let mut pass = Wide(FindClipped {
                direction,
                ceiling,
                reference_pressure,
                pressure_increment,
                last_step: residual.last_step,
                active: residual.active,
                transposed,
                compensation,
                clipped,
                remaining,
                blocks,
                rows: [vec![0.0; SIDE * blocks], vec![0.0; SIDE * blocks]],
            });
            corrections.read(&mut pass);
            extension.collect_anew(threads);
            compensation.copy_from_slice(&extension.levels[0].values);
        }
        let smallest = &mut self.extension.levels[0];
        let rows = smallest.values.chunks_mut(smallest.blocks[1]);
        for (values, compensation) in rows.zip(compensation.chunks(blocks)) {
            for (value, compensation) in values.iter_mut().zip(compensation) {
                let change = compensation / direction.step_length;
                // The steps of a load that does not converge become as short as rounding allows.
                *value += if change.is_finite() { change } else { 0.0 };
            }
        }
        self.clipping = Some(clipping);
    }

    /// Returns the stored corrections, and the output of the transpose Eᵀ, which passes over the
    /// corrections add to them.
    ///
    /// `gap` and `level` are those of the residual from which the corrections were computed.
    pub fn corrections<'a>(
        &'a mut self,
        mesh: &'a Mesh,
        gap: &'a [f32],
        level: f64,
        scratch: &'a mut Scratch<f32>,
        threads: &'a Threads,
    ) -> (Corrections<'a>, TransposeOutput<'a>) {
        let nodal = self.is_by_blocks.then(|| mesh.two_level.nodal(gap, level));
        let larger = match (&mesh.stiffness.larger, &mut self.larger) {
            (Some(transform), Some(larger)) => Some((transform, larger)),
            _ => None,
        };
        let corrections = Corrections { mesh, nodal, larger, scratch, threads };
        (corrections, self.extension.transpose_output())
    }
}

/// Stored corrections z, except for the output of the transpose Eᵀ.
pub struct Corrections<'a> {
    mesh: &'a Mesh,
    /// Nodal part of the corrections, if they were computed with the two-level preconditioner.
    nodal: Option<Nodal<'a>>,
    larger: Option<(&'a Transform<f32>, &'a mut LargerMesh)>,
    scratch: &'a mut Scratch<f32>,
    threads: &'a Threads,
}

impl Corrections<'_> {
    /// Passes rows 2i and 2i + 1 of the map to `rows`, for each i in `pairs`.
    pub fn peek<P: Pass<f32>>(&mut self, pairs: &[usize], rows: &mut Wide<P>) {
        let map = self.mesh.nodes;
        match (&self.nodal, &mut self.larger) {
            (Some(nodal), _) => nodal.over(map[1], rows, |rows| {
                visit_pairs(self.threads, pairs, map, rows);
            }),
            (None, Some((transform, larger))) => in_corner(map, rows, |rows| {
                transform.peek(Stored::Rows, pairs, rows, &mut larger.scratch);
            }),
            (None, None) => self.mesh.transform.peek(Stored::Rows, pairs, rows, self.scratch),
        }
    }

    /// Passes all rows of the map to `rows`.
    pub fn read<P: Pass<f32>>(self, rows: &mut Wide<P>) {
        let (map, single) = (self.mesh.nodes, &self.mesh.transform);
        let [from, to] = [Stored::Rows, Stored::Nothing];
        match (self.nodal, self.larger) {
            (Some(nodal), _) => {
                nodal.over(map[1], rows, |rows| single.pass(from, to, rows, self.scratch));
            }
            (None, Some((transform, larger))) => in_corner(map, rows, |rows| {
                transform.pass(from, to, rows, &mut larger.scratch);
            }),
            (None, None) => single.pass(from, to, rows, self.scratch),
        }
    }

    /// Passes all rows of the map to `rows`, which replaces them by steps of the pressures, and
    /// begins the convolution of these steps with the displacement kernel.
    pub fn begin_step<P: Pass<f32>>(self, rows: &mut Wide<P>) {
        let (map, single) = (self.mesh.nodes, &self.mesh.transform);
        match (self.nodal, self.larger) {
            (Some(nodal), _) => {
                nodal.over(map[1], rows, |rows| single.begin(rows, self.scratch));
            }
            (None, Some((transform, larger))) => {
                let mut keeping = CopyRows {
                    rows: rows.split_off(Row::new(0, map[1])),
                    steps: Band::new(&mut larger.steps),
                };
                in_corner(map, &mut keeping, |rows| {
                    transform.pass(Stored::Rows, Stored::Nothing, rows, &mut larger.scratch);
                });
                rows.append(keeping.rows);
                single.begin_with(&larger.steps, self.scratch);
            }
            (None, None) => single.pass(Stored::Rows, Stored::Spectra, rows, self.scratch),
        }
    }
}

/// Pass that runs another pass and copies the rows that it writes.
struct CopyRows<'a, P> {
    rows: P,
    steps: Band<'a, f32>,
}

impl<P: Rows<f32>> Rows<f32> for CopyRows<'_, P> {
    fn row(&mut self, row: Row, values: &mut [f32]) {
        self.rows.row(row, values);
        self.steps.row(row).copy_from_slice(values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { rows: self.rows.split_off(row), steps: self.steps.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.rows.append(later.rows);
    }
}

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
        let inside = if row.index < rows { row_nodes } else { 0 };
        let (values, beyond) = values.split_at_mut(inside);
        continue_all([of_own, of_other], beyond, &own[inside..], &other[inside..]);
        if inside == 0 {
            return;
        }
        let row = Row::new(row.index, row_nodes);
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

    fn split_off(&mut self, row: Row) -> Self {
        Self { extended: self.extended.split_off(row), ..*self }
    }
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
        let maps = values.iter_mut().zip(gap).zip(last_step);
        let nodes = maps.zip(own.iter().zip(other)).zip(groups);
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
/// that are not free, as input of the transpose of the [extension](super::blocks).
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
        if row.index < rows {
            let last_step = Row::new(row.index, row_nodes).of(self.last_step);
            let free = self.active.free_row(row);
            self.collected.collect_row::<S, R>(simd, row, values, last_step, free);
        } else {
            self.collected.collect_row::<S, R>(simd, row, values, &[], &[]);
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { collected: self.collected.split_off(row), ..*self }
    }
}
