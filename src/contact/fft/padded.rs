//! Maps on a corner of a larger mesh, whose other nodes are zero: what is convolved there does not
//! come around.

use super::{Real, Row, Rows};

/// The rows of a map of `nodes`, seen from the larger mesh, whose other rows may be passed over or be
/// asked for, as they fall into batches.
pub struct Padded<'a, P> {
    pub nodes: [usize; 2],
    pub rows: &'a mut P,
}

impl<T: Real, P: Rows<T>> Rows<T> for Padded<'_, P> {
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
}
