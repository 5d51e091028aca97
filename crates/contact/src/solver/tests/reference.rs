//! Contacts on rectangles, with free boundaries, and of materials that yield, solved to rounding by
//! independent code.

use crate::grid::Grid;
use crate::grid::samples::rectangle;
use crate::topography::surface::Surface;

/// A folder of surfaces in `tests/data`, and the table of what they were solved for.
pub struct Reference {
    folder: &'static str,
    table: &'static str,
}

pub const RECTANGULAR_AND_FREE: Reference =
    Reference { folder: "rectangular-and-free", table: "rectangular_and_free.csv" };

pub const HARDNESS: Reference = Reference { folder: "hardness", table: "hardness.csv" };

/// A row of the reference: one load on one surface.
pub struct Solved(Vec<String>);

impl Solved {
    pub fn number(&self, column: usize) -> f64 {
        self.0[column].parse().unwrap()
    }

    pub fn count(&self, column: usize) -> usize {
        self.0[column].parse().unwrap()
    }
}

impl Reference {
    fn file(&self, name: &str) -> Vec<u8> {
        let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
        std::fs::read(format!("{data}/{}/{name}", self.folder)).unwrap()
    }

    pub fn solved(&self, surface: &str) -> Vec<Solved> {
        let csv = String::from_utf8(self.file(self.table)).unwrap();
        let rows = csv.lines().map(|line| line.split(',').map(str::to_owned));
        let rows = rows.map(|row| Solved(row.collect()));
        rows.filter(|row| row.0[0] == surface).collect()
    }

    pub fn heights(&self, surface: &str, size: [f64; 2]) -> Surface {
        let (nodes, heights) = npy_array(&self.file(&format!("{surface}.npy")));
        Surface::new(rectangle(nodes, size), heights).unwrap()
    }

    /// Maps in the order of loads, bits most significant first, as NumPy packs them, from the file of
    /// that ending.
    pub fn maps(&self, surface: &str, ending: &str, grid: Grid) -> Vec<Vec<bool>> {
        let bytes = self.file(&format!("{surface}_{ending}.npy"));
        let bits = |byte: &u8| (0..8).rev().map(|bit| byte >> bit & 1 == 1).collect::<Vec<_>>();
        // The header of a small array fills 128 bytes.
        let maps = bytes[128..].chunks(grid.count().div_ceil(8));
        maps.map(|map| map.iter().flat_map(bits).collect()).collect()
    }
}

/// An array of doubles as NumPy writes it, row after row.
pub fn npy_array(bytes: &[u8]) -> ([usize; 2], Vec<f64>) {
    let (header, data) = bytes.split_at(128);
    let header = String::from_utf8_lossy(&header[10..]);
    let shape = header.split(['(', ')']).nth(1).unwrap().split(", ");
    let shape: Vec<usize> = shape.map(|side| side.parse().unwrap()).collect();
    let numbers = data.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()));
    (shape.try_into().unwrap(), numbers.collect())
}
