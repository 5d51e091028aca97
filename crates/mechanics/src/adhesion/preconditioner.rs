//! Preconditioner of the descent: the compliance of the free nodes while the wall holds the others.
//!
//! Forces r on the free nodes F displace these by S_FF⁻¹ r if the closed nodes C do not move. The
//! displacements are those under r and the forces x with which the wall holds the closed nodes. Of
//! all x, these forces have the least energy ½⟨(r, x) A (r, x)⟩ with the compliance A of the body.
//! For any linear x = −Xᵀ r, the matrix (1 − X) A (1 − Xᵀ) is therefore symmetric, and at least
//! S_FF⁻¹. It is close to S_FF⁻¹ if X u is about the displacement of the free nodes where the
//! closed nodes are displaced by u. This is the problem of the elastic solver with contact and
//! surroundings exchanged, and X is its pyramid of means ([`Extension`]), whose free nodes are the
//! closed nodes here. Eigenvalues of S_FF times this matrix are 1 to 1.3, except for that of the
//! mean displacement. With x = 0 they are 1 to 8.
//!
//! The pyramid has single precision, which suffices for a preconditioner.

use pulp::Simd;

use super::passes::Domain;
use crate::fft::Row;
use crate::solver::blocks::{
    ExtendedRows, Extension, ResidualRows, TransposeInput, TransposeOutput,
};
use crate::solver::lanes::{LANES, Pass, Shared, over_rows};
use crate::solver::marks::FREE;
use crate::threads::Threads;

/// Pyramid X, which continues displacements of closed nodes to the free nodes of a mesh.
pub struct Continuation {
    domain: Domain,
    pyramid: Extension,
}

impl Continuation {
    pub fn new(domain: Domain) -> Self {
        Self { domain, pyramid: Extension::new(domain.map, domain.mesh, &[]) }
    }

    /// Replaces displacements u by u − X u on the free nodes, where `free` is positive, and by zero
    /// on the closed ones.
    pub fn subtract(&mut self, threads: &Threads, free: &[f64], displacements: &mut [f64]) {
        let domain = self.domain;
        over_nodes(threads, domain, free, displacements, self.pyramid.residual_rows());
        self.pyramid.extend(threads);
        over_nodes(threads, domain, free, displacements, self.pyramid.extended_rows());
    }

    /// Sets the forces on closed nodes to −Xᵀ r, given the forces r on free nodes. The numbers of
    /// closed nodes are those of the last call of [`subtract`](Self::subtract).
    pub fn hold(&mut self, threads: &Threads, free: &[f64], forces: &mut [f64]) {
        let domain = self.domain;
        over_nodes(threads, domain, free, forces, self.pyramid.transpose_input());
        self.pyramid.collect(threads);
        over_nodes(threads, domain, free, forces, self.pyramid.transpose_output());
    }
}

/// Part of the pyramid that reads or changes rows of nodes.
trait Part: Shared {
    /// Handles a row. `marks` has the flag of each node of the map, and is empty outside the map.
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, nodes: Nodes);
}

/// Row of the mesh, with `numbers` as a buffer.
struct Nodes<'a> {
    /// Flags of the nodes of the map in this row. The closed nodes have the flag [`FREE`].
    marks: &'a [f32],
    groups: &'a [bool],
    values: &'a mut [f64],
    numbers: &'a mut [f32],
}

/// Returns whether a node with the flags `mark` is closed.
fn is_closed(mark: f32) -> bool {
    mark.to_bits() & FREE != 0
}

/// Passes all rows of the mesh to `part`.
fn over_nodes(
    threads: &Threads,
    domain: Domain,
    free: &[f64],
    values: &mut [f64],
    part: impl Part,
) {
    let nodes = domain.mesh[1];
    let buffers = [vec![0.0; nodes], vec![0.0; nodes]];
    let groups = vec![true; nodes.div_ceil(LANES)];
    let mut pass = Marked { domain, free, part, groups, buffers };
    over_rows(threads, values, nodes, &mut pass);
}

struct Marked<'a, P> {
    domain: Domain,
    free: &'a [f64],
    part: P,
    groups: Vec<bool>,
    buffers: [Vec<f32>; 2],
}

impl<P: Part> Pass<f64> for Marked<'_, P> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let [marks, numbers] = &mut self.buffers;
        let marks = &mut marks[..self.domain.inside(row)];
        for (mark, free) in marks.iter_mut().zip(row.of(self.free)) {
            *mark = f32::from_bits(if *free > 0.0 { 0 } else { FREE });
        }
        let groups = &self.groups[..marks.len().div_ceil(LANES)];
        self.part.row::<S, R>(simd, row, Nodes { marks, groups, values, numbers });
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            part: self.part.split_off(row),
            groups: self.groups.clone(),
            buffers: self.buffers.clone(),
            ..*self
        }
    }
}

/// Adds up the values of closed nodes.
impl Part for ResidualRows<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, nodes: Nodes) {
        let Nodes { marks, groups, values, numbers } = nodes;
        if marks.is_empty() {
            return;
        }
        for ((number, value), mark) in numbers.iter_mut().zip(values).zip(marks) {
            *number = if is_closed(*mark) { *value as f32 } else { 0.0 };
        }
        self.add_row::<S, R>(simd, row, &numbers[..marks.len()], marks, groups);
    }
}

/// Subtracts the continuation from the values of free nodes.
impl Part for ExtendedRows<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, nodes: Nodes) {
        let [(own, of_own), (other, of_other)] = Self::row(self, row);
        for (value, (own, other)) in nodes.values.iter_mut().zip(own.iter().zip(other)) {
            *value -= f64::from(of_own * own + of_other * other);
        }
        for (value, mark) in nodes.values.iter_mut().zip(nodes.marks) {
            *value = if is_closed(*mark) { 0.0 } else { *value };
        }
    }
}

/// Adds up the values of free nodes.
impl Part for TransposeInput<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, nodes: Nodes) {
        let Nodes { marks, groups, values, numbers } = nodes;
        for (number, value) in numbers.iter_mut().zip(values) {
            *number = *value as f32;
        }
        self.collect_row::<S, R>(simd, row, numbers, marks, groups);
    }
}

/// Sets the values of closed nodes.
impl Part for TransposeOutput<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, nodes: Nodes) {
        let Nodes { marks, groups, values, numbers } = nodes;
        if marks.is_empty() {
            return;
        }
        let numbers = &mut numbers[..marks.len()];
        numbers.fill(0.0);
        self.add_to_row(row, numbers, groups);
        for ((value, number), mark) in values.iter_mut().zip(numbers).zip(marks) {
            *value = if is_closed(*mark) { -f64::from(*number) } else { *value };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns numbers from −0.5 to 0.5.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1_u64 << 24) as f64 - 0.5
        };
        (0..count).map(|_| draw()).collect()
    }

    #[test]
    fn holding_the_closed_nodes_is_the_transpose_of_subtracting_their_continuation() {
        let threads = Threads::one();
        let corner = |map| Domain { map, mesh: [64, 48] };
        for domain in [corner([64, 48]), corner([32, 24]), corner([21, 19])] {
            let nodes = domain.mesh_nodes();
            let mut free: Vec<f64> =
                noise(3, nodes).iter().map(|x| f64::from(u8::from(*x > 0.0))).collect();
            for (row, free) in free.chunks_exact_mut(domain.mesh[1]).enumerate() {
                let inside = if row < domain.map[0] { domain.map[1] } else { 0 };
                free[inside..].fill(1.0);
            }
            let displacements = noise(1, nodes);
            let forces: Vec<f64> = noise(2, nodes).iter().zip(&free).map(|(x, f)| x * f).collect();
            let mut continuation = Continuation::new(domain);
            let (mut less, mut held) = (displacements.clone(), forces.clone());
            continuation.subtract(&threads, &free, &mut less);
            continuation.hold(&threads, &free, &mut held);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let [forth, back] = [dot(&less, &forces), dot(&displacements, &held)];
            assert!((forth - back).abs() < 1e-4, "{domain:?}: {forth} {back}");
        }
    }
}
