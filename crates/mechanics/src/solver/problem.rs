//! Surface, body and material, prepared once and shared by all solvers of the surface.

use std::iter::successors;
use std::sync::Arc;

use super::Hardness;
use super::lanes::{Totals, for_rows, highest_by, highest_of, sum_rows, total};
use super::mesh::Mesh;
use crate::elasticity::{self, ElasticOperator, Factor};
use crate::fft::{Kernel, Transform};
use crate::grid::Grid;
use crate::threads::Threads;

/// Data of a surface that no load changes.
pub struct Problem {
    pub body: Box<dyn ElasticOperator>,
    pub hardness: Option<Hardness>,
    /// Heights of zero mean.
    pub heights: Vec<f64>,
    pub lowest: f64,
    pub highest: f64,
    pub full_contact: Option<FullContact>,
    /// Load above which the material is expected to yield; infinite without a hardness, or if no
    /// formula gives it.
    pub yield_load: f64,

    pub transform: Transform<f64>,
    pub displacement: Kernel<f64>,
    /// The same mesh in single precision.
    pub mesh: Arc<Mesh>,
    /// Coarser meshes; `None` if the mesh is small or the body has no coarser version.
    pub coarser: Option<CoarserMeshes>,
}

/// Extremes of the pressure p of zero mean that flattens the surface.
#[derive(Debug, Clone, Copy)]
pub struct FullContact {
    /// Smallest load that brings every node into contact: −min p.
    pub load: f64,
    pub peak: f64,
}

impl Problem {
    pub fn new(
        threads: &Threads,
        body: Box<dyn ElasticOperator>,
        hardness: Option<Hardness>,
        heights: &[f64],
    ) -> Self {
        let (nodes, cells) = (body.grid().nodes(), body.grid().count());
        assert_eq!(heights.len(), cells, "one height per node");
        let CentredHeights { heights, single_heights, lowest, highest } =
            CentredHeights::new(threads, heights, nodes[1]);
        let transform = elasticity::transform(&*body);
        let (mut full_contact, mut yield_load) = (None, f64::INFINITY);
        if body.is_periodic() {
            let mut pressure = vec![0.0; cells];
            let mut scratch = transform.scratch_on(threads.clone());
            let stiffness = elasticity::kernel(threads, &*body, Factor::Stiffness);
            transform.convolve(&stiffness, &heights, &mut pressure, &mut scratch);
            let [lowest, peak] = range(threads, &mut pressure, nodes[1]);
            let full = FullContact { load: -lowest, peak };
            if let Some(hardness) = hardness {
                yield_load = full.yield_load(hardness, &pressure);
            }
            full_contact = Some(full);
        }
        Self {
            full_contact,
            yield_load,
            displacement: elasticity::kernel(threads, &*body, Factor::Displacement),
            mesh: Arc::new(Mesh::new(threads, &*body, single_heights, highest)),
            coarser: CoarserMeshes::new(threads, &*body, &heights),
            body,
            hardness,
            heights,
            lowest,
            highest,
            transform,
        }
    }

    /// Returns whether all nodes are in contact under `load` without yielding; false if no formula
    /// gives the load of full contact.
    pub fn reaches_full_contact(&self, load: f64) -> bool {
        let ceiling = self.hardness.map_or(f64::INFINITY, Hardness::pressure);
        self.full_contact.is_some_and(|full| load >= full.load && load + full.peak <= ceiling)
    }
}

impl FullContact {
    /// Returns the load above which the material is expected to yield.
    ///
    /// Let p be `pressure`, shifted so that its peak equals the hardness. The result is the mean of
    /// max(p, 0). This clipped pressure has a larger contact than the solution under the same load,
    /// and usually a lower peak.
    fn yield_load(self, hardness: Hardness, pressure: &[f64]) -> f64 {
        let shift = hardness.pressure() - self.peak;
        let sum: f64 = pressure.iter().map(|p| (p + shift).max(0.0)).sum();
        sum / pressure.len() as f64
    }
}

/// Minimum number of nodes along the shorter side of the smallest mesh. With 32, loads take as many
/// pairs.
const MIN_NODES: usize = 64;

/// Coarser meshes of a surface, shared by its solvers.
pub struct CoarserMeshes {
    /// Intermediate meshes from the finest to the coarsest.
    pub levels: Vec<Arc<Mesh>>,
    /// Smallest mesh, without a hardness.
    pub coarsest: Arc<Problem>,
}

impl CoarserMeshes {
    /// Prepares the coarser meshes of a surface.
    ///
    /// Returns `None` if the mesh is too small or cannot be halved often enough, or if the body has
    /// no coarser version.
    pub fn new(threads: &Threads, body: &dyn ElasticOperator, heights: &[f64]) -> Option<Self> {
        let row_nodes = body.grid().nodes()[1];
        let grids = coarser_grids(body.grid());
        let coarser: Option<Vec<_>> = grids.iter().map(|grid| body.on_coarser(*grid)).collect();
        let mut bodies = coarser?;
        let coarsest = bodies.pop()?;
        let mut stride = 1;
        let mut sampled = || -> Vec<f64> {
            stride *= 2;
            every_so_many(stride, heights, row_nodes)
        };
        let meshes =
            bodies.iter().map(|body| Arc::new(Mesh::from_heights(threads, &**body, &sampled())));
        let levels = meshes.collect();
        let coarsest = Problem::new(threads, coarsest, None, &sampled());
        Some(Self { levels, coarsest: Arc::new(coarsest) })
    }
}

fn coarser_grids(grid: Grid) -> Vec<Grid> {
    successors(coarsened(&grid), coarsened).collect()
}

/// Returns the grid of every second node along both axes, if it is large enough.
fn coarsened(grid: &Grid) -> Option<Grid> {
    let coarser = grid.coarsened()?;
    let is_large = coarser.nodes().into_iter().all(|nodes| nodes >= MIN_NODES);
    is_large.then_some(coarser)
}

/// Returns the heights of every `stride`-th node along both axes.
fn every_so_many(stride: usize, heights: &[f64], row_nodes: usize) -> Vec<f64> {
    let mut sampled = Vec::with_capacity(heights.len() / (stride * stride));
    for row in heights.chunks_exact(row_nodes).step_by(stride) {
        sampled.extend(row.iter().step_by(stride));
    }
    sampled
}

pub struct CentredHeights {
    pub heights: Vec<f64>,
    /// Heights minus the highest.
    pub single_heights: Vec<f32>,
    pub lowest: f64,
    pub highest: f64,
}

impl CentredHeights {
    pub fn new(threads: &Threads, heights: &[f64], row_nodes: usize) -> Self {
        let cells = heights.len();
        let (mut own, mut single_heights) = (vec![0.0; cells], vec![0.0; cells]);
        let sum = sum_rows(threads, &mut own, row_nodes, |row, own| {
            own.copy_from_slice(row.of(heights));
            total(own)
        });
        let mean = sum / cells as f64;
        for_rows(threads, &mut own, row_nodes, |_, own| {
            own.iter_mut().for_each(|height| *height -= mean);
        });
        let [lowest, highest] = range(threads, &mut own, row_nodes);
        for_rows(threads, &mut single_heights, row_nodes, |row, single| {
            for (single, height) in single.iter_mut().zip(row.of(&own)) {
                *single = (height - highest) as f32;
            }
        });
        Self { heights: own, single_heights, lowest, highest }
    }
}

/// Returns the lowest and the highest number of a map.
pub fn range(threads: &Threads, map: &mut [f64], row_nodes: usize) -> [f64; 2] {
    let extremes = sum_rows(threads, map, row_nodes, |_, row| Totals {
        sums: [],
        highest: [highest_by(row, |number| -number), highest_of(row)],
    });
    let [lowest, highest] = extremes.highest;
    [-lowest, highest]
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::{range, *};

    #[test]
    fn heights_are_centred_and_their_range_is_found_on_any_threads() {
        // Rows of whole groups and some further nodes, with enough nodes for several threads.
        let (rows, row_nodes) = (600, 1000);
        let bump = |node: usize| 3.0 + (node as f64).sin();
        let given: Vec<f64> = (0..rows * row_nodes).map(bump).collect();
        let three = Threads::new(NonZeroUsize::new(3).unwrap());
        let [alone, shared] = [Threads::one(), three.clone()]
            .map(|threads| CentredHeights::new(&threads, &given, row_nodes));
        assert_eq!(alone.heights, shared.heights);
        assert_eq!(alone.single_heights, shared.single_heights);

        let mut heights = shared.heights;
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        // Bound on the sum of all rounding errors.
        assert!(mean.abs() < heights.len() as f64 * f64::EPSILON, "{mean}");
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert_eq!([shared.lowest, shared.highest], [lowest, highest]);
        assert_eq!(range(&three, &mut heights, row_nodes), [lowest, highest]);
        assert!((highest - lowest - 2.0).abs() < 1e-6);
        let mut single = heights.iter().zip(&shared.single_heights);
        assert!(single.all(|(height, single)| (height - highest) as f32 == *single));
    }
}
