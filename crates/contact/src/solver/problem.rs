//! Surface, body and material, prepared once and shared by all solvers of the surface.

use std::sync::Arc;

use super::Hardness;
use super::heights::{CentredHeights, range};
use super::inner_solver::Mesh;
use super::nested::CoarserMeshes;
use crate::elasticity;
use crate::elasticity::ElasticOperator;
use crate::fft::{Kernel, Transform};
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
        if body.stiffness_is_exact() {
            let mut pressure = vec![0.0; cells];
            let mut scratch = transform.scratch_on(threads.clone());
            let stiffness = elasticity::stiffness_on(threads, &*body);
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
            displacement: elasticity::displacement_on(threads, &*body),
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
