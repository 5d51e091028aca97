//! Map of the nodes in contact, with one bit per node.

use thiserror::Error;

use crate::grid::Boundary;
use crate::threads::Threads;

const WORD: usize = u64::BITS as usize;

/// Map of the nodes in contact, N_x × N_y bits.
///
/// A new map is periodic. [`ContactMap::with_boundary`] makes it an isolated map.
///
/// Node (i, j) is bit `i * N_y + j`. Bits are counted from the least significant bit of each byte,
/// and bits after the last node are zero.
///
/// ```
/// use asperity_mechanics::morphology::map::{ContactMap, MapError};
///
/// let map = ContactMap::from_pressures([2, 3], &[0.0, 0.7, 0.0, 0.2, 0.0, 0.0]);
/// assert!(map.get(0, 1) && map.get(1, 0));
/// assert_eq!(map.count(), 2);
/// // In Python: `numpy.unpackbits(bytes, bitorder="little")`.
/// assert_eq!(map.to_bytes(), [0b001010]);
/// assert_eq!(ContactMap::from_bytes([2, 3], &[0b001010])?, map);
/// # Ok::<(), MapError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContactMap {
    nodes: [usize; 2],
    boundary: Boundary,
    words: Vec<u64>,
}

/// Reason why bytes cannot be decoded to a contact map.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum MapError {
    #[error("a contact map of {} × {} nodes needs {needed} bytes, not {found}", nodes[0], nodes[1])]
    Length { nodes: [usize; 2], needed: usize, found: usize },
    #[error("a side of a contact map has {side} nodes; it needs at least 1 and fewer than 2³²")]
    Nodes { side: usize },
    #[error("a contact map of {} × {} nodes has bits set after its last node", nodes[0], nodes[1])]
    StrayBits { nodes: [usize; 2] },
}

impl ContactMap {
    /// Creates the map of the nodes with positive pressure.
    ///
    /// The solver sets pressures outside the contact to exactly zero.
    ///
    /// # Panics
    /// Panics if the number of pressures is not the number of nodes.
    pub fn from_pressures(nodes: [usize; 2], pressures: &[f64]) -> Self {
        Self::from_pressures_on(&Threads::one(), nodes, pressures)
    }

    /// Creates the same map as [`ContactMap::from_pressures`], with several threads.
    pub fn from_pressures_on(threads: &Threads, nodes: [usize; 2], pressures: &[f64]) -> Self {
        assert_eq!(pressures.len(), nodes[0] * nodes[1]);
        let mut words = vec![0; pressures.len().div_ceil(WORD)];
        let workers = threads.workers(pressures.len());
        let block_words = words.len().div_ceil(workers.cuts(words.len()).len());
        let mut blocks: Vec<_> =
            words.chunks_mut(block_words).zip(pressures.chunks(block_words * WORD)).collect();
        let fill = |(): &mut (), (words, pressures): &mut (&mut [u64], &[f64])| {
            for (word, pressures) in words.iter_mut().zip(pressures.chunks(WORD)) {
                *word = bits(pressures);
            }
        };
        workers.for_each(&mut Vec::new(), || (), &mut blocks, fill);
        Self { nodes, boundary: Boundary::Periodic, words }
    }

    /// Decodes a map from the ⌈N_x N_y/8⌉ bytes that [`ContactMap::to_bytes`] returns.
    ///
    /// # Errors
    /// Fails if the number of bytes does not match, if a side has no node or 2³² nodes or more, or
    /// if a bit after the last node is set.
    pub fn from_bytes(nodes: [usize; 2], bytes: &[u8]) -> Result<Self, MapError> {
        let counts = |side: usize| side > 0 && u32::try_from(side).is_ok();
        if let Some(side) = nodes.into_iter().find(|side| !counts(*side)) {
            return Err(MapError::Nodes { side });
        }
        let (needed, found) = (byte_count(nodes), bytes.len());
        if needed != found {
            return Err(MapError::Length { nodes, needed, found });
        }
        let word = |bytes: &[u8]| {
            let byte = |(index, byte): (usize, &u8)| u64::from(*byte) << (8 * index);
            bytes.iter().enumerate().map(byte).sum()
        };
        let words: Vec<u64> = bytes.chunks(8).map(word).collect();
        let bits = nodes[0] * nodes[1] % WORD;
        if bits != 0 && words.last().is_some_and(|last| last >> bits != 0) {
            return Err(MapError::StrayBits { nodes });
        }
        Ok(Self { nodes, boundary: Boundary::Periodic, words })
    }

    /// Returns the map with the given boundary condition.
    ///
    /// With [`Boundary::Free`], neighbours outside the map are missing, and the boundary of the map
    /// is not an edge of the contact.
    pub fn with_boundary(self, boundary: Boundary) -> Self {
        Self { boundary, ..self }
    }

    /// Returns the boundary condition of the map.
    pub fn boundary(&self) -> Boundary {
        self.boundary
    }

    /// Returns the bits of the map, with eight nodes per byte and the least significant bit first.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.words.iter().flat_map(|w| w.to_le_bytes()).collect();
        bytes.truncate(byte_count(self.nodes));
        bytes
    }

    /// Returns the numbers of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Returns `true` if node (i, j) is in contact.
    ///
    /// # Panics
    /// Panics if the node is outside the map.
    #[inline]
    pub fn get(&self, i: usize, j: usize) -> bool {
        assert!(i < self.nodes[0] && j < self.nodes[1]);
        let bit = i * self.nodes[1] + j;
        self.words[bit / WORD] >> (bit % WORD) & 1 == 1
    }

    /// Returns the number of nodes in contact.
    pub fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Returns the number of 64-bit words for one row, ⌈N_y/64⌉.
    pub(super) fn row_words(&self) -> usize {
        self.nodes[1].div_ceil(WORD)
    }

    /// Copies row `i` of the map to `row`, with node j at bit j. Bits after the last node become
    /// zero.
    pub(super) fn copy_row(&self, i: usize, row: &mut [u64]) {
        let first = i * self.nodes[1];
        let shift = first % WORD;
        for (word, source) in row.iter_mut().zip(first / WORD..) {
            *word = self.words[source] >> shift;
            if shift != 0
                && let Some(next) = self.words.get(source + 1)
            {
                *word |= next << (WORD - shift);
            }
        }
        mask_tail(row, self.nodes[1]);
    }
}

/// Clears the bits of `row` after the first `nodes` bits.
pub(super) fn mask_tail(row: &mut [u64], nodes: usize) {
    if let (Some(last), tail @ 1..) = (row.last_mut(), nodes % WORD) {
        *last &= (1 << tail) - 1;
    }
}

fn byte_count(nodes: [usize; 2]) -> usize {
    (nodes[0] * nodes[1]).div_ceil(8)
}

/// Returns a word in which bit k is set if pressure k (of at most 64) is positive.
fn bits(pressures: &[f64]) -> u64 {
    let bit = |(bit, pressure): (usize, &f64)| u64::from(*pressure > 0.0) << bit;
    pressures.iter().enumerate().map(bit).sum()
}

#[cfg(test)]
pub(crate) mod samples {

    use super::*;

    /// Numbers of nodes of maps. Their rows end inside, at the end of, or just after a word of 64
    /// bits.
    pub const MESHES: [[usize; 2]; 13] = [
        [1, 1],
        [2, 2],
        [3, 3],
        [5, 5],
        [8, 8],
        [63, 63],
        [64, 64],
        [65, 65],
        [130, 130],
        [1, 7],
        [9, 1],
        [5, 129],
        [70, 13],
    ];

    /// Returns the map in which node (i, j) is in contact if `contact(i, j)`.
    pub fn map(nodes: [usize; 2], contact: impl Fn(usize, usize) -> bool) -> ContactMap {
        let [rows, row_nodes] = nodes;
        let pressure = |node| f64::from(u8::from(contact(node / row_nodes, node % row_nodes)));
        let pressures: Vec<f64> = (0..rows * row_nodes).map(pressure).collect();
        ContactMap::from_pressures(nodes, &pressures)
    }

    pub fn square(nodes: usize, contact: impl Fn(usize, usize) -> bool) -> ContactMap {
        map([nodes; 2], contact)
    }

    /// Returns a map in which each node is in contact with the given probability, independently of
    /// the others.
    pub fn random(nodes: [usize; 2], probability: f64) -> ContactMap {
        let draws = crate::topography::draws::Draws::new(5, nodes[1] as u32);
        map(nodes, |i, j| (-draws.mode(i as i32, j as u32).power()).exp() < probability)
    }
}

#[cfg(test)]
mod tests {
    use super::samples::{MESHES, map, random};
    use super::*;

    #[test]
    fn contact_is_where_pressure_is_positive() {
        let map = ContactMap::from_pressures([2, 2], &[0.0, 1e-300, -1.0, f64::NAN]);
        let found = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| map.get(i, j));
        assert_eq!(found, [false, true, false, false]);
        assert_eq!(map.count(), 1);
    }

    #[test]
    fn threads_do_not_change_a_map() {
        // The map has enough nodes for several threads, and its last node is inside a word.
        let nodes = [601, 1001];
        let pressures: Vec<f64> = (0..601 * 1001).map(|node| f64::from(node).sin()).collect();
        let three = Threads::new(3.try_into().unwrap());
        let shared = ContactMap::from_pressures_on(&three, nodes, &pressures);
        assert_eq!(shared, ContactMap::from_pressures(nodes, &pressures));
        let pressed = pressures.iter().filter(|pressure| **pressure > 0.0);
        assert_eq!(shared.count(), pressed.count());
    }

    #[test]
    fn bytes_hold_eight_nodes_each_least_significant_first() {
        let map = map([3, 3], |i, j| (i, j) == (0, 1) || (i, j) == (2, 2));
        assert_eq!(map.to_bytes(), [0b0000_0010, 0b0000_0001]);
    }

    #[test]
    fn bytes_decode_to_the_encoded_map() {
        for nodes in MESHES {
            let map = random(nodes, 0.5);
            let bytes = map.to_bytes();
            assert_eq!(bytes.len(), (nodes[0] * nodes[1]).div_ceil(8));
            assert_eq!(ContactMap::from_bytes(nodes, &bytes), Ok(map));
        }
    }

    #[test]
    fn bytes_of_another_mesh_are_refused() {
        let error = ContactMap::from_bytes([3, 3], &[0; 3]).unwrap_err();
        assert_eq!(error.to_string(), "a contact map of 3 × 3 nodes needs 2 bytes, not 3");
        let stray = ContactMap::from_bytes([3, 3], &[0, 0b10]);
        assert_eq!(stray, Err(MapError::StrayBits { nodes: [3, 3] }));
        for side in [0, usize::MAX] {
            for nodes in [[side, 1], [1, side]] {
                let error = ContactMap::from_bytes(nodes, &[]);
                assert_eq!(error, Err(MapError::Nodes { side }));
            }
        }
    }

    #[test]
    fn rows_hold_the_nodes_of_the_map() {
        for nodes in MESHES {
            let map = random(nodes, 0.5);
            let mut row = vec![u64::MAX; map.row_words()];
            for i in 0..nodes[0] {
                map.copy_row(i, &mut row);
                for bit in 0..64 * row.len() {
                    let expected = bit < nodes[1] && map.get(i, bit);
                    assert_eq!(row[bit / 64] >> (bit % 64) & 1 == 1, expected);
                }
            }
        }
    }
}
