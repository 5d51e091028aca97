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
        Self { nodes: self.nodes, rows: self.rows.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.rows.append(later.rows);
    }
}

/// Lets the rows of a map of `nodes` be seen as rows of a larger one, of which it is a corner.
pub fn in_corner<T: Real, P: Rows<T>>(
    nodes: [usize; 2],
    rows: &mut P,
    see: impl FnOnce(&mut Padded<P>),
) {
    let mut padded = Padded { nodes, rows: rows.split_off(Row::new(0, nodes[1])) };
    see(&mut padded);
    rows.append(padded.rows);
}
