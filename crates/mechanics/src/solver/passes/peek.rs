//! Passes over a sample of the rows of corrections or gaps, because sums over all rows would take a
//! separate pass over memory.

use pulp::Simd;

use super::ReferencePressure;
use crate::fft::{Band, Row};
use crate::solver::blocks::TransposeOutput;
use crate::solver::candidates::Candidates;
use crate::solver::lanes::{InOrder, LANES, Pass, Shared, Totals, sum_over_groups, weight};
use crate::solver::marks::{ActiveGroups, FREE, has};

/// Minimum number of free nodes in a sample; with fewer, the pass visits all rows.
pub const MIN_SAMPLE_NODES: f64 = 64.0;

/// Means over the free nodes of the visited rows, or zero if there are none.
pub struct Means {
    pub correction: f64,
    /// Mean of the last step, without its scaling.
    pub last_step: f64,
    /// Mean correction over the free nodes of the sampled rows only.
    pub sampled_correction: f64,
    /// Mean of z A s over the free nodes of the sampled rows, with the correction z and the
    /// displacement A s under the last step s.
    pub correction_on_image: f64,
}

/// Pass over rows of corrections that adds up the sums for [`Means`].
pub struct Peek<'a> {
    last_step: &'a [f32],
    groups: &'a ActiveGroups,
    sample: &'a Sample,
    /// Output of the transpose of the extension, which is added to the corrections.
    transposed: TransposeOutput<'a>,
    /// Numbers of free nodes and of free nodes with an image, and the four sums over free nodes.
    sums: InOrder<Totals<6, 0>>,
    /// Collector of free nodes, if the material yields.
    candidates: Option<GatherCandidates<'a>>,
}

/// Collector of free nodes, whose pressures and changes determine how a direction is balanced.
pub struct GatherCandidates<'a> {
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
    /// Multiple of the last step that is still to be added to pressures.
    pub of_step: f32,
    /// Collected nodes, each with its pressure, its change (the negative of its correction) and its
    /// last step.
    pub nodes: Candidates,
    pub rows: usize,
}

impl GatherCandidates<'_> {
    #[inline(always)]
    fn gather(&mut self, row: Row, corrections: &[f32], last_step: &[f32], free: &[bool]) {
        let (corrections, last_corrections) = corrections.as_chunks::<LANES>();
        let (last_step, rest_step) = last_step.as_chunks::<LANES>();
        let (reference_pressure, last_base) = self.reference_pressure.row(row).as_chunks::<LANES>();
        let (increment, last_increment) = row.of(self.pressure_increment).as_chunks::<LANES>();
        let pressure = reference_pressure.iter().zip(increment);
        let groups = corrections.iter().zip(last_step).zip(pressure).zip(free);
        for (((corrections, last_step), (reference_pressure, increment)), free) in groups {
            if *free {
                self.gather_nodes(corrections, last_step, reference_pressure, increment);
            }
        }
        self.gather_nodes(last_corrections, rest_step, last_base, last_increment);
        self.rows += 1;
    }

    /// Collects free nodes among at most [`LANES`] nodes, without a branch for each.
    #[inline(always)]
    fn gather_nodes(
        &mut self,
        corrections: &[f32],
        last_step: &[f32],
        reference_pressure: &[f32],
        increment: &[f32],
    ) {
        let mut gathered = [[0.0; LANES]; 3];
        let mut count = 0;
        let pressure = reference_pressure.iter().zip(increment);
        for ((correction, last_step), (reference_pressure, increment)) in
            corrections.iter().zip(last_step).zip(pressure)
        {
            gathered[0][count] = reference_pressure + (increment + self.of_step * last_step);
            gathered[1][count] = -correction;
            gathered[2][count] = *last_step;
            count += usize::from(has(*last_step, FREE));
        }
        self.nodes.extend(&gathered, count);
    }
}

impl Shared for GatherCandidates<'_> {
    fn split_off(&mut self, _: Row) -> Self {
        Self { nodes: Candidates::default(), rows: 0, ..*self }
    }

    fn append(&mut self, later: Self) {
        self.nodes.append(later.nodes);
        self.rows += later.rows;
    }
}

impl<'a> Peek<'a> {
    pub fn new(
        last_step: &'a [f32],
        groups: &'a ActiveGroups,
        sample: &'a Sample,
        transposed: TransposeOutput<'a>,
        candidates: Option<GatherCandidates<'a>>,
    ) -> Self {
        Self { last_step, groups, sample, transposed, sums: InOrder::new(), candidates }
    }

    /// Returns whether the visited rows have too few free nodes to estimate means.
    ///
    /// With a wrong mean, a direction does not keep the mean pressure and may lose all of it.
    pub fn is_too_small(&self) -> bool {
        self.sums.total().sums[0] < MIN_SAMPLE_NODES
    }

    /// Takes the collector of free nodes, if the material yields.
    pub fn candidates(&mut self) -> Option<GatherCandidates<'a>> {
        self.candidates.take()
    }

    pub fn means(&self) -> Means {
        let [nodes, sampled, correction, last_step, sampled_correction, on_image] =
            self.sums.total().sums;
        let [nodes, sampled] = [nodes, sampled].map(|count| count.max(1.0));
        Means {
            correction: correction / nodes,
            last_step: last_step / nodes,
            sampled_correction: sampled_correction / sampled,
            correction_on_image: on_image / sampled,
        }
    }
}

impl Pass<f32> for Peek<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let last_step = row.of(self.last_step);
        let groups = self.groups.free_row(row);
        self.transposed.add_to_row(row, values, groups);
        if let Some(candidates) = &mut self.candidates {
            candidates.gather(row, values, last_step, groups);
        }
        let free = |last_step| weight::<f32>(has(last_step, FREE));
        let nodes = sum_over_groups(groups, last_step, last_step, |last_step, _| free(last_step));
        let correction =
            sum_over_groups(groups, values, last_step, |value, last_step| value * free(last_step));
        let of_last_step = sum_over_groups(groups, last_step, last_step, |last_step, _| {
            free(last_step) * last_step
        });
        let mut sums = [nodes, 0.0, correction, of_last_step, 0.0, 0.0];
        if let Some(image) = self.sample.row(row) {
            for (value, last_step) in values.iter_mut().zip(last_step) {
                *value *= free(*last_step);
            }
            let on_image = sum_over_groups(groups, values, image, |z, image| z * image);
            (sums[1], sums[4], sums[5]) = (nodes, correction, on_image);
        }
        self.sums.push(Totals { sums, highest: [] });
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            transposed: self.transposed.split_off(row),
            sums: InOrder::new(),
            candidates: self.candidates.as_mut().map(|candidates| candidates.split_off(row)),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sums.append(later.sums);
        if let (Some(candidates), Some(later)) = (&mut self.candidates, later.candidates) {
            candidates.append(later);
        }
    }
}

/// Minimum number of pairs of rows in a sample; smaller meshes are sampled completely.
const MIN_PAIRS: usize = 32;

/// Maximum distance between sampled pairs of rows, in pairs.
const MAX_STRIDE: usize = 8;

/// Sample of the rows of a map, in evenly distributed pairs, and values stored for these rows.
pub struct Sample {
    geometry: Geometry,
    kept: Vec<f32>,
}

#[derive(Clone, Copy)]
struct Geometry {
    rows: usize,
    row_nodes: usize,
    stride: usize,
}

impl Sample {
    pub fn new([rows, row_nodes]: [usize; 2]) -> Self {
        let pairs = rows.div_ceil(2);
        let stride = (pairs / MIN_PAIRS).clamp(1, MAX_STRIDE);
        Self {
            geometry: Geometry { rows, row_nodes, stride },
            kept: vec![0.0; 2 * pairs.div_ceil(stride) * row_nodes],
        }
    }

    pub fn pairs(&self) -> Vec<usize> {
        let Geometry { rows, stride, .. } = self.geometry;
        (stride / 2..rows.div_ceil(2)).step_by(stride).collect()
    }

    pub fn other_pairs(&self) -> Vec<usize> {
        let Geometry { rows, stride, .. } = self.geometry;
        let pairs = 0..rows.div_ceil(2);
        pairs.filter(|pair| pair % stride != stride / 2).collect()
    }

    /// Returns the stored values of a row of the map, if the row belongs to the sample.
    #[inline(always)]
    pub fn row(&self, row: Row) -> Option<&[f32]> {
        let kept_row = self.geometry.kept_row(row)?;
        Some(kept_row.of(&self.kept))
    }

    pub fn band(&mut self) -> SampleBand<'_> {
        SampleBand { geometry: self.geometry, kept: Band::new(&mut self.kept) }
    }
}

impl Geometry {
    /// Returns the row of stored values that belongs to a row of the map, if this row is in the
    /// sample.
    fn kept_row(&self, row: Row) -> Option<Row> {
        let (pair, second) = (row.index / 2, row.index % 2);
        let sampled = pair % self.stride == self.stride / 2;
        sampled.then(|| Row::new(pair / self.stride * 2 + second, self.row_nodes))
    }

    /// Returns the row of stored values that belongs to the first sampled row of the map at or
    /// after `row`. `row` must be the first row of a pair or the end of the map.
    fn kept_before(&self, row: Row) -> Row {
        let pairs = row.index.div_ceil(2);
        let sampled = (pairs + self.stride - 1 - self.stride / 2) / self.stride;
        Row::new(2 * sampled, self.row_nodes)
    }
}

/// Mutable access to consecutive rows of a sample.
pub struct SampleBand<'a> {
    geometry: Geometry,
    kept: Band<'a, f32>,
}

impl SampleBand<'_> {
    #[inline(always)]
    pub fn keep(&mut self, row: Row, values: &[f32]) {
        if let Some(kept_row) = self.geometry.kept_row(row) {
            self.kept.row(kept_row).copy_from_slice(values);
        }
    }
}

impl Shared for SampleBand<'_> {
    /// Splits the band before `row`, the first row of a pair, and returns the part from `row` on.
    fn split_off(&mut self, row: Row) -> Self {
        Self { geometry: self.geometry, kept: self.kept.split_off(self.geometry.kept_before(row)) }
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
