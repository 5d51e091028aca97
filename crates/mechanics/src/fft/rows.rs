//! Rows of maps, passes over them, and aligned buffers.
//!
//! - [`Row`]: index of a row, the same in all maps of a grid;
//! - [`Band`]: consecutive rows that one thread writes;
//! - [`Padded`]: map in the corner of a larger mesh, whose other nodes are zero;
//! - [`Aligned`]: buffer that begins on a cache line, so that no register is loaded from two lines.

use std::ops::{Deref, DerefMut, Range};

use super::{Real, Rows};
use crate::threads::{Threads, Workers};

/// Index of a row, with the number of nodes in a row. It selects the same row in all maps of a
/// grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Index of the row on its mesh.
    pub index: usize,
    nodes: usize,
}

impl Row {
    /// Creates row `index` of maps with `nodes` nodes in a row.
    #[inline(always)]
    pub fn new(index: usize, nodes: usize) -> Self {
        Self { index, nodes }
    }

    /// Returns the indices of the row's elements in a map.
    #[inline(always)]
    pub fn range(self) -> Range<usize> {
        self.index * self.nodes..(self.index + 1) * self.nodes
    }

    /// Returns this row of `map`.
    #[inline(always)]
    pub fn of<V>(self, map: &[V]) -> &[V] {
        &map[self.range()]
    }

    /// Returns this row of `map` for writing.
    #[inline(always)]
    pub fn of_mut<V>(self, map: &mut [V]) -> &mut [V] {
        &mut map[self.range()]
    }
}

/// Mutable access to consecutive rows of a map.
pub struct Band<'a, V> {
    /// Index of the first row.
    first: usize,
    values: &'a mut [V],
}

impl<'a, V> Band<'a, V> {
    /// Creates a band of all rows of a map.
    pub fn new(map: &'a mut [V]) -> Self {
        Self { first: 0, values: map }
    }

    /// Returns the values of `row`, which must belong to the band.
    #[inline(always)]
    pub fn row(&mut self, row: Row) -> &mut [V] {
        Row::new(row.index - self.first, row.nodes).of_mut(self.values)
    }

    /// Keeps the rows before `row`, and returns a band of the other rows.
    pub fn split_off(&mut self, row: Row) -> Self {
        let own = (row.index - self.first) * row.nodes;
        let (own, others) = std::mem::take(&mut self.values).split_at_mut(own);
        self.values = own;
        Self { first: row.index, values: others }
    }
}

/// Splits a pass over maps with `nodes` nodes in a row into parts that begin at the ascending rows
/// `firsts`. No row before `firsts[0]` is visited, so nothing remains for `rows` itself.
pub fn cut<T, P: Rows<T>>(rows: &mut P, firsts: &[usize], nodes: usize) -> Vec<P> {
    let split = |&first: &usize| rows.split_off(Row::new(first, nodes));
    let mut parts: Vec<P> = firsts.iter().rev().map(split).collect();
    parts.reverse();
    parts
}

/// Divides `pairs` into blocks for the threads of `workers`, and splits the pass accordingly.
///
/// Number k in `pairs` stands for the rows 2k and 2k + 1 of maps with `nodes` nodes in a row.
/// Returns the part of the pass and the pairs of each block.
pub fn cut_pairs<'p, T, P: Rows<T>>(
    rows: &mut P,
    pairs: &'p [usize],
    workers: &Workers,
    nodes: usize,
) -> (Vec<P>, Vec<&'p [usize]>) {
    let cuts = workers.cuts(pairs.len());
    let ends = cuts[1..].iter().copied().chain([pairs.len()]);
    let blocks: Vec<&[usize]> =
        cuts.iter().zip(ends).map(|(&first, end)| &pairs[first..end]).collect();
    let firsts: Vec<usize> = blocks.iter().map(|pairs| 2 * pairs.first().unwrap_or(&0)).collect();
    (cut(rows, &firsts, nodes), blocks)
}

/// Visits the rows 2k and 2k + 1 (if it exists) for each k in `pairs`, which must be ascending.
///
/// The map has `rows` × `row_nodes` nodes. For each row the pass receives a buffer with arbitrary
/// content, and what it writes there is discarded.
pub fn visit_pairs<T: Real, P: Rows<T>>(
    threads: &Threads,
    pairs: &[usize],
    [rows, row_nodes]: [usize; 2],
    pass: &mut P,
) {
    let workers = threads.workers(2 * pairs.len() * row_nodes);
    let (parts, pairs) = cut_pairs(pass, pairs, &workers, row_nodes);
    let mut blocks: Vec<(P, &[usize])> = parts.into_iter().zip(pairs).collect();
    let new = || vec![T::zero(); row_nodes];
    workers.for_each(&mut Vec::new(), new, &mut blocks, |values, (part, pairs)| {
        let seen = pairs.iter().flat_map(|pair| [2 * pair, 2 * pair + 1]);
        for row in seen.filter(|row| *row < rows) {
            part.row(Row::new(row, row_nodes), values);
        }
    });
    for (part, _) in blocks {
        pass.append(part);
    }
}

/// Adapter of a pass over a map of `nodes`, which lets it visit the rows of a larger mesh.
///
/// It appends zeros to each row. Rows of the mesh outside the map are set to zero, and the inner
/// pass does not visit them.
pub struct Padded<P> {
    pub nodes: [usize; 2],
    pub rows: P,
}

impl<T: Real, P: Rows<T>> Rows<T> for Padded<P> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        let [rows, row_nodes] = self.nodes;
        let mut beyond = 0;
        if row.index < rows {
            let row = Row::new(row.index, row_nodes);
            self.rows.row(row, &mut values[..row_nodes]);
            beyond = row_nodes;
        }
        values[beyond..].fill(T::zero());
    }

    fn split_off(&mut self, row: Row) -> Self {
        let [rows, row_nodes] = self.nodes;
        let row = Row::new(row.index.min(rows), row_nodes);
        Self { nodes: self.nodes, rows: self.rows.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.rows.append(later.rows);
    }
}

/// Calls `visit` with the pass `rows`, adapted from a map of `nodes` to a mesh that contains the
/// map in a corner.
pub fn in_corner<T: Real, P: Rows<T>>(
    nodes: [usize; 2],
    rows: &mut P,
    visit: impl FnOnce(&mut Padded<P>),
) {
    let mut padded = Padded { nodes, rows: rows.split_off(Row::new(0, nodes[1])) };
    visit(&mut padded);
    rows.append(padded.rows);
}

/// Number of bytes of a cache line, and of the widest register.
const LINE: usize = 64;

/// Heap-allocated slice aligned to a cache line.
pub struct Aligned<T> {
    storage: Vec<T>,
    start: usize,
    len: usize,
}

impl<T: Real> Aligned<T> {
    pub fn zeros(len: usize) -> Self {
        let slack = LINE / size_of::<T>();
        let storage = vec![T::zero(); len + slack];
        let start = storage.as_ptr().align_offset(LINE).min(slack);
        Self { storage, start, len }
    }
}

impl<T: Real> FromIterator<T> for Aligned<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        let own: Vec<T> = values.into_iter().collect();
        let mut aligned = Self::zeros(own.len());
        aligned.copy_from_slice(&own);
        aligned
    }
}

impl<T> Deref for Aligned<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.storage[self.start..][..self.len]
    }
}

impl<T> DerefMut for Aligned<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.storage[self.start..][..self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_every_row_once() {
        let mut map: Vec<usize> = (0..15).collect();
        let mut first = Band::new(&mut map);
        let mut last = first.split_off(Row::new(4, 3));
        let mut middle = first.split_off(Row::new(1, 3));
        assert_eq!(first.row(Row::new(0, 3)), [0, 1, 2]);
        assert_eq!(middle.row(Row::new(1, 3)), [3, 4, 5]);
        assert_eq!(middle.row(Row::new(3, 3)), [9, 10, 11]);
        assert_eq!(last.row(Row::new(4, 3)), [12, 13, 14]);
        let mut none = middle.split_off(Row::new(4, 3));
        assert!(none.split_off(Row::new(4, 3)).values.is_empty());
    }
}
