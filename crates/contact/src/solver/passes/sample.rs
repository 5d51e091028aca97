//! Rows that are looked at where a sum over all would cost a pass of its own.

use crate::fft::{Band, Row};

/// The fewest pairs of rows in a sample: on smaller meshes, it is the whole mesh.
const FEWEST: usize = 32;

/// The sparsest sample, one pair of rows in so many.
const SPARSEST: usize = 8;

/// Rows of a map, evenly spread over it in pairs.
pub struct Sample {
    geometry: Geometry,
    kept: Vec<f32>,
}

/// Which rows are in a sample.
#[derive(Clone, Copy)]
struct Geometry {
    rows: usize,
    row_nodes: usize,
    stride: usize,
}

impl Sample {
    pub fn new([rows, row_nodes]: [usize; 2]) -> Self {
        let pairs = rows.div_ceil(2);
        let stride = (pairs / FEWEST).clamp(1, SPARSEST);
        Self {
            geometry: Geometry { rows, row_nodes, stride },
            kept: vec![0.0; 2 * pairs.div_ceil(stride) * row_nodes],
        }
    }

    /// The pairs of rows in the sample.
    pub fn pairs(&self) -> Vec<usize> {
        let Geometry { rows, stride, .. } = self.geometry;
        (stride / 2..rows.div_ceil(2)).step_by(stride).collect()
    }

    /// The pairs of rows that are not.
    pub fn other_pairs(&self) -> Vec<usize> {
        let Geometry { rows, stride, .. } = self.geometry;
        let pairs = 0..rows.div_ceil(2);
        pairs.filter(|pair| pair % stride != stride / 2).collect()
    }

    /// What is kept of a row, if it is in the sample.
    #[inline(always)]
    pub fn row(&self, row: Row) -> Option<&[f32]> {
        let place = self.geometry.place(row)?;
        Some(place.of(&self.kept))
    }

    /// All rows, to be kept.
    pub fn band(&mut self) -> SampleBand<'_> {
        SampleBand { geometry: self.geometry, kept: Band::of(&mut self.kept) }
    }
}

impl Geometry {
    /// Where a row of the sample is kept.
    fn place(&self, row: Row) -> Option<Row> {
        let (pair, second) = (row.index() / 2, row.index() % 2);
        let sampled = pair % self.stride == self.stride / 2;
        sampled.then(|| Row::new(pair / self.stride * 2 + second, self.row_nodes))
    }

    /// Where rows are kept from this one on, which begins a pair or ends them.
    fn places_before(&self, row: Row) -> Row {
        let pairs = row.index().div_ceil(2);
        let sampled = (pairs + self.stride - 1 - self.stride / 2) / self.stride;
        Row::new(2 * sampled, self.row_nodes)
    }
}

/// What is kept of consecutive rows.
pub struct SampleBand<'a> {
    geometry: Geometry,
    kept: Band<'a, f32>,
}

impl SampleBand<'_> {
    #[inline(always)]
    pub fn keep(&mut self, row: Row, values: &[f32]) {
        if let Some(place) = self.geometry.place(row) {
            self.kept.row(place).copy_from_slice(values);
        }
    }

    /// Keeps the rows before one, which begins a pair, and hands on the others.
    pub fn split_off(&mut self, row: Row) -> Self {
        Self {
            geometry: self.geometry,
            kept: self.kept.split_off(self.geometry.places_before(row)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_meshes_are_sampled_whole() {
        for nodes in [1, 2, 7, 64, 126] {
            let pairs = Sample::new([nodes; 2]).pairs();
            assert_eq!(pairs, Vec::from_iter(0..nodes.div_ceil(2)));
        }
    }

    #[test]
    fn large_meshes_are_sampled_evenly() {
        for (nodes, stride) in [(128, 2), (250, 3), (256, 4), (1024, 8), (4096, 8)] {
            let pairs = Sample::new([nodes; 2]).pairs();
            assert!(pairs.windows(2).all(|pair| pair[1] - pair[0] == stride));
            assert!(pairs.len().abs_diff(nodes / 2 / stride) <= 1);
        }
    }

    #[test]
    fn rows_of_the_sample_are_kept_and_no_others() {
        for cut in [0, 2, 4, 6, 100, 254, 256] {
            let mut sample = Sample::new([256; 2]);
            let mut above = sample.band();
            let mut below = above.split_off(Row::new(cut, 256));
            for row in 0..256 {
                let band = if row < cut { &mut above } else { &mut below };
                band.keep(Row::new(row, 256), &[row as f32; 256]);
            }
            let rows = sample.pairs().into_iter();
            let rows = rows.flat_map(|pair| [2 * pair, 2 * pair + 1]);
            let kept: Vec<f32> = rows.map(|row| row as f32).collect();
            let first = sample.kept.iter().step_by(256);
            assert_eq!(Vec::from_iter(first.copied()), kept);
        }
    }
}
