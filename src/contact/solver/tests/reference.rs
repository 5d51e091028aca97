//! Contacts on rectangles and with free boundaries, solved to rounding by independent code.

use crate::contact::grid::Grid;
use crate::contact::grid::samples::rectangle;
use crate::contact::topography::measured::read_npy;
use crate::contact::topography::surface::Surface;

const FOLDER: &str = "data/reference/rectangular-and-free";

/// A row of the reference: one load on one surface.
pub struct Solved(Vec<String>);

impl Solved {
    pub fn all(surface: &str) -> Vec<Solved> {
        let csv = std::fs::read_to_string(format!("{FOLDER}/rectangular_and_free.csv")).unwrap();
        let rows = csv.lines().map(|line| line.split(',').map(str::to_owned));
        let rows = rows.map(|row| Solved(row.collect()));
        rows.filter(|row| row.0[0] == surface).collect()
    }

    pub fn number(&self, column: usize) -> f64 {
        self.0[column].parse().unwrap()
    }

    pub fn count(&self, column: usize) -> usize {
        self.0[column].parse().unwrap()
    }

    pub fn load(&self) -> f64 {
        self.number(7)
    }
}

pub fn heights(surface: &str, size: [f64; 2]) -> Surface {
    let bytes = std::fs::read(format!("{FOLDER}/{surface}.npy")).unwrap();
    read_npy(&bytes, rectangle([1, 1], size).cell()).unwrap()
}

/// Contact maps by load, bits most significant first, as NumPy packs them.
pub fn maps(surface: &str, grid: Grid) -> Vec<Vec<bool>> {
    let bytes = std::fs::read(format!("{FOLDER}/{surface}_contact.npy")).unwrap();
    let bits = |byte: &u8| {
        (0..8)
            .rev()
            .map(|bit| byte >> bit & 1 == 1)
            .collect::<Vec<_>>()
    };
    // The header of a small array fills 128 bytes.
    let maps = bytes[128..].chunks(grid.count().div_ceil(8));
    maps.map(|map| map.iter().flat_map(bits).collect())
        .collect()
}
