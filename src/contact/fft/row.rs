//! One row of a map, and its nodes in every map of the same grid.

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
