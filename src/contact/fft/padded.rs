//! Maps on a corner of a larger mesh, whose other nodes are zero: what is convolved there does not
//! come around.

use super::{Real, Row, Rows};

/// The rows of a map of `nodes`, seen from the whole mesh, whose other rows may be passed over or be
/// asked for, as they fall into batches.
pub struct Padded<P> {
    pub nodes: [usize; 2],
    pub rows: P,
}

impl<T: Real, P: Rows<T>> Rows<T> for Padded<P> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        let [rows, row_nodes] = self.nodes;
        let mut beyond = 0;
        if row.index() < rows {
            let row = Row::new(row.index(), row_nodes);
            self.rows.row(row, &mut values[..row_nodes]);
            beyond = row_nodes;
        }
        values[beyond..].fill(T::zero());
    }

    fn split_off(&mut self, row: Row) -> Self {
        let [rows, row_nodes] = self.nodes;
        let row = Row::new(row.index().min(rows), row_nodes);
        Self {
            nodes: self.nodes,
            rows: self.rows.split_off(row),
        }
    }

    fn append(&mut self, later: Self) {
        self.rows.append(later.rows);
    }
}
