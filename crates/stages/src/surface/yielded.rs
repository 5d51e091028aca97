//! Surfaces that have yielded in a contact.
//!
//! A surface that was pressed under a largest load keeps its plastic depth d, so that its heights
//! are h − d. The recipe contains the recipe of the original surface and the settings of the
//! contact. The contact under the largest load is solved from them, without the tables of other
//! tasks.

use serde::{Deserialize, Serialize};

use super::Params;
use crate::columns::RMS_SLOPE;
use crate::reduced_units::{GivenHardness, PressureUnit, Scales};
use crate::surface_files::SurfaceFiles;
use crate::{StageError, boundary_recipe, unloading};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::solver::{Body, Hardness, Settings, Watch, cost};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;

/// The recipe of a surface that has yielded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Yielded {
    /// Recipe of the original surface.
    #[serde(rename = "from")]
    pub body: Box<Params>,
    /// Largest load, in the unit `load_unit`.
    pub load: f64,
    /// Unit of the load.
    pub load_unit: PressureUnit,
    /// Hardness of the material.
    pub hardness: GivenHardness,
    /// Effective elastic modulus E*.
    pub effective_modulus: f64,
    /// Tolerance of the solver.
    pub tolerance: f64,
    /// Maximum number of pairs of transforms.
    pub max_pairs: u32,
    /// Boundary condition at the edges of the surface.
    #[serde(
        default,
        skip_serializing_if = "Boundary::is_periodic",
        serialize_with = "boundary_recipe::serialize",
        deserialize_with = "boundary_recipe::deserialize"
    )]
    pub boundary: Boundary,
    /// Version of the numbers of solved loads.
    pub solve_version: u32,
}

impl Yielded {
    /// Draws or reads the original surface, solves its contact under the load, and subtracts the
    /// plastic depth from the heights.
    ///
    /// # Errors
    /// If the surface cannot be drawn or read, if the load is not below the hardness, if the
    /// contact does not converge, or on interruption.
    pub fn draw(
        &self,
        sources: &SurfaceFiles,
        threads: &Threads,
        watch: &dyn Watch,
    ) -> Result<Surface, StageError> {
        let surface = self.body.draw(sources, threads)?;
        let grid = surface.grid();
        let rms_slope = self.body.described(&surface).reals(RMS_SLOPE.name)?.value(0);
        let mut heights = surface.heights().to_vec();
        let (reduced, scales) = Scales::reduce(surface, rms_slope, self.effective_modulus)?;
        let hardness = scales.hardness(self.hardness)?.reduced;
        let load = scales.reduced_pressure(self.load, self.load_unit);
        hardness.check_load(load)?;
        let body = Body { elastic: self.boundary.into(), hardness: Some(hardness) };
        let mut solver = body.solver_with_threads(threads.clone(), &reduced);
        let settings = Settings { tolerance: self.tolerance, pair_limit: self.max_pairs };
        let depth = unloading::plastic_depth(&mut solver, hardness, load, &settings, watch)?;
        if !depth.is_solved {
            return Err(StageError::NotYielded { max_pairs: self.max_pairs });
        }
        for (height, depth) in heights.iter_mut().zip(depth.depths) {
            *height -= depth * scales.length();
        }
        Surface::new(grid, heights).map_err(StageError::Heights)
    }

    /// Returns a body with the costs of the contact, with the hardness in the unit in which it is
    /// given.
    fn costs(&self) -> Body {
        let hardness = Hardness::new(self.hardness.pressure).ok();
        Body { elastic: self.boundary.into(), hardness }
    }

    /// Returns the expected number of pairs of transforms for the contact.
    pub fn pairs(&self) -> f64 {
        cost::pairs_per_load(&self.costs(), self.tolerance)
    }

    /// Returns the peak memory of drawing the surface, in bytes per node.
    pub fn bytes_per_node(&self) -> f64 {
        16.0 + self.costs().bytes_per_node(self.tolerance)
    }
}
