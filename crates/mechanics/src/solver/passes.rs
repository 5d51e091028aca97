//! Passes over the rows of the mesh between two transforms, and the reference pressure.

use super::lanes::Shared;
use crate::fft::{Band, Row};

mod clipped;
mod evaluate;
mod peek;
mod update_gap;
mod update_pressure;

pub use clipped::FindClipped;
pub use evaluate::{GapOutput, GapStatistics, StepOutput, StepScaling, promote};
pub use peek::{GatherCandidates, MIN_SAMPLE_NODES, Means, Peek, Sample};
pub use update_gap::{Convergence, GapSums, GapUpdate, InitialResidual, UpdateGap};
pub use update_pressure::{Ceiling, Direction, PendingUpdate, Sums, UpdatePressure};

/// Tolerance below which pressures are stored as increments to a reference pressure.
///
/// Single precision rounds a pressure by 6e-8 of its value, and a gap by about 6e-8 mesh steps at
/// unit rms slope.
const FINE: f64 = 1e-5;

/// Reference pressure of the iterations: zero, or a map if the tolerance is small.
pub struct ReferencePressure {
    zeros: Vec<f32>,
    rows: usize,
    map: Vec<f32>,
}

impl ReferencePressure {
    pub fn new([rows, row_nodes]: [usize; 2]) -> Self {
        Self { zeros: vec![0.0; row_nodes], rows, map: Vec::new() }
    }

    /// Allocates the map if iterations to a residual of `tolerance` require one, and otherwise
    /// empties it.
    pub fn prepare(&mut self, tolerance: f64) {
        let cells = self.rows * self.zeros.len();
        let is_map = Self::is_map(tolerance);
        self.map.resize(if is_map { cells } else { 0 }, 0.0);
    }

    pub fn clear(&mut self) {
        self.map.fill(0.0);
    }

    /// Returns whether iterations to this tolerance require a map instead of zero.
    pub fn is_map(tolerance: f64) -> bool {
        tolerance < FINE
    }

    #[inline(always)]
    pub fn row(&self, row: Row) -> &[f32] {
        self.map.get(row.range()).unwrap_or(&self.zeros)
    }

    pub fn band(&mut self) -> ReferenceBand<'_> {
        ReferenceBand {
            zeros: &self.zeros,
            map: (!self.map.is_empty()).then(|| Band::new(&mut self.map)),
        }
    }
}

/// Mutable access to consecutive rows of a reference pressure.
pub struct ReferenceBand<'a> {
    zeros: &'a [f32],
    map: Option<Band<'a, f32>>,
}

impl ReferenceBand<'_> {
    /// Sets a row of the map to `pressure` in single precision, and returns it. Without a map,
    /// returns a row of zeros.
    #[inline(always)]
    pub fn set_row(&mut self, row: Row, pressure: &[f64]) -> &[f32] {
        let Some(map) = &mut self.map else {
            return self.zeros;
        };
        let reference_pressure = map.row(row);
        for (reference_pressure, p) in reference_pressure.iter_mut().zip(pressure) {
            *reference_pressure = *p as f32;
        }
        reference_pressure
    }
}

impl Shared for ReferenceBand<'_> {
    fn split_off(&mut self, row: Row) -> Self {
        Self { zeros: self.zeros, map: self.map.as_mut().map(|map| map.split_off(row)) }
    }
}
