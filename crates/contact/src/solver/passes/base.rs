//! What the pressures of a search are counted from.

use crate::fft::{Band, Row};

/// Single precision holds a pressure to 6e-8 of it, and a gap to about as much of a mesh step at
/// unit rms slope. A finer search counts pressures from where it started.
const FINE: f64 = 1e-5;

/// Zero, or for a fine search a map of its own.
pub struct Base {
    /// A row of them.
    zeros: Vec<f32>,
    rows: usize,
    map: Vec<f32>,
}

impl Base {
    pub fn new([rows, row_nodes]: [usize; 2]) -> Self {
        Self { zeros: vec![0.0; row_nodes], rows, map: Vec::new() }
    }

    /// Gets ready for a search to a residual of `tolerance`.
    pub fn prepare(&mut self, tolerance: f64) {
        let cells = self.rows * self.zeros.len();
        let is_map = Self::is_map(tolerance);
        self.map.resize(if is_map { cells } else { 0 }, 0.0);
    }

    /// Counts pressures from zero.
    pub fn clear(&mut self) {
        self.map.fill(0.0);
    }

    /// Whether such a search needs a map of its own.
    pub fn is_map(tolerance: f64) -> bool {
        tolerance < FINE
    }

    /// The nodes of a row.
    #[inline(always)]
    pub fn row(&self, row: Row) -> &[f32] {
        self.map.get(row.range()).unwrap_or(&self.zeros)
    }

    /// All rows, to be set.
    pub fn band(&mut self) -> BaseBand<'_> {
        BaseBand {
            zeros: &self.zeros,
            map: (!self.map.is_empty()).then(|| Band::of(&mut self.map)),
        }
    }
}

/// Consecutive rows of a base, to be set.
pub struct BaseBand<'a> {
    zeros: &'a [f32],
    map: Option<Band<'a, f32>>,
}

impl BaseBand<'_> {
    /// Sets a row to what single precision holds of pressures, if this search is a fine one. Returns
    /// it.
    #[inline(always)]
    pub fn set_row(&mut self, row: Row, pressure: &[f64]) -> &[f32] {
        let Some(map) = &mut self.map else {
            return self.zeros;
        };
        let base = map.row(row);
        for (base, p) in base.iter_mut().zip(pressure) {
            *base = *p as f32;
        }
        base
    }

    pub fn split_off(&mut self, row: Row) -> Self {
        Self { zeros: self.zeros, map: self.map.as_mut().map(|map| map.split_off(row)) }
    }
}
