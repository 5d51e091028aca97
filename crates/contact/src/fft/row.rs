//! One row of a map, and its nodes in every map of the same grid; and rows that one thread writes.

use std::ops::Range;

/// A row of a map: what a pass works on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    index: usize,
    nodes: usize,
}

impl Row {
    /// Row `index` of maps with so many nodes in a row.
    #[inline(always)]
    pub fn new(index: usize, nodes: usize) -> Self {
        Self { index, nodes }
    }

    /// Which row it is, from 0.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.index
    }

    /// Its elements.
    #[inline(always)]
    pub fn range(self) -> Range<usize> {
        self.index * self.nodes..(self.index + 1) * self.nodes
    }

    /// The row of a map.
    #[inline(always)]
    pub fn of<V>(self, map: &[V]) -> &[V] {
        &map[self.range()]
    }

    /// The row of a map, to be written.
    #[inline(always)]
    pub fn of_mut<V>(self, map: &mut [V]) -> &mut [V] {
        &mut map[self.range()]
    }
}

/// Consecutive rows of a map, to be written.
pub struct Band<'a, V> {
    /// The first row.
    first: usize,
    values: &'a mut [V],
}

impl<'a, V> Band<'a, V> {
    /// All rows of a map.
    pub fn of(map: &'a mut [V]) -> Self {
        Self { first: 0, values: map }
    }

    /// Row of the map, one of these.
    #[inline(always)]
    pub fn row(&mut self, row: Row) -> &mut [V] {
        Row::new(row.index - self.first, row.nodes).of_mut(self.values)
    }

    /// Keeps the rows before one, and hands on the others.
    pub fn split_off(&mut self, row: Row) -> Self {
        let own = (row.index - self.first) * row.nodes;
        let (own, others) = std::mem::take(&mut self.values).split_at_mut(own);
        self.values = own;
        Self { first: row.index, values: others }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_every_row_once() {
        let mut map: Vec<usize> = (0..15).collect();
        let mut first = Band::of(&mut map);
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
