//! Pairs of surfaces that are pressed against each other.
//!
//! The contact of two rough bodies is that of the sum of their heights towards each other with a
//! flat body: h(x) = h₁(x) + h₂(x − s), both in common axes. The recipe of a pair holds the recipes
//! of both surfaces, so that the sum can be drawn again without the tables of other tasks.

use serde::{Deserialize, Serialize};

use crate::columns::RMS_SLOPE;
use crate::per_axis::PerAxis;
use crate::reduced_units::{GivenHardness, PressureUnit, Scales};
use crate::surface::{Heights, Origin, Params};
use crate::surface_files::SurfaceFiles;
use crate::{Recipe, StageError, unloading};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::solver::{Body, Hardness, Settings, Watch, cost};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::{Axis, Surface};
use asperity_mechanics::topography::translation::{reversed, sum, translated};

/// The recipe of the summed heights of two surfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Recipe of the surface of the stage in `from`.
    #[serde(rename = "from")]
    pub body: Box<Params>,
    /// Recipe of the surface of the stage in `against`.
    pub against: Box<Params>,
    /// Lateral shift of the surface of `against` along x and y, in fractions of the sides.
    pub shift: PerAxis<f64>,
    /// Axis along which the map of `against` is reversed before it is shifted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mirror: Option<MirrorAxis>,
    /// True for a body with a single surface, which belongs to all pairs. The recipes of both
    /// surfaces hold everything else, so it is not part of the recipe.
    #[serde(skip)]
    pub is_single: [bool; 2],
}

/// An axis along which the map of a surface is reversed, the value of `mirror`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MirrorAxis {
    /// The map is reversed along x: the body was turned over about the y axis.
    X,
    /// The map is reversed along y: the body was turned over about the x axis.
    Y,
}

impl MirrorAxis {
    pub fn axis(self) -> Axis {
        match self {
            MirrorAxis::X => Axis::X,
            MirrorAxis::Y => Axis::Y,
        }
    }
}

impl Pair {
    /// Creates the first pair of two surfaces. Their heights are drawn again for the sum, so that
    /// its recipe does not depend on whether they are stored.
    pub fn new(
        [body, against]: [&Params; 2],
        shift: PerAxis<f64>,
        mirror: Option<MirrorAxis>,
        is_single: [bool; 2],
    ) -> Pair {
        let [body, against] =
            [body, against].map(|params| Box::new(params.realization(0).with(Heights::Redraw)));
        Pair { body, against, shift, mirror, is_single }
    }

    /// Returns the pair of the surfaces with this number, or of the single surface of a body.
    pub fn realization(&self, number: u32) -> Pair {
        let of = |params: &Params, is_single: bool| {
            Box::new(if is_single { params.clone() } else { params.realization(number) })
        };
        let [body, against] = self.is_single;
        Pair { body: of(&self.body, body), against: of(&self.against, against), ..self.clone() }
    }

    /// Returns whether one of the bodies is the first surface with the recipe `surfaces`.
    pub fn has_body(&self, surfaces: &Params) -> bool {
        let first = surfaces.realization(0).with(Heights::Redraw);
        *self.body == first || *self.against == first
    }

    /// Draws or reads both surfaces, and returns the sum of their heights.
    ///
    /// # Errors
    /// If one of the surfaces cannot be drawn or read, or if their maps differ in size.
    pub fn draw(&self, sources: &SurfaceFiles, threads: &Threads) -> Result<Surface, StageError> {
        let body = self.body.draw(sources, threads)?;
        let against = self.placed(self.against.draw(sources, threads)?);
        sum(&body, &against).map_err(StageError::Heights)
    }

    /// Returns the map of `against` in the position in which its heights are added: reversed, and
    /// then shifted.
    pub fn placed(&self, against: Surface) -> Surface {
        let against = match self.mirror {
            Some(axis) => reversed(&against, axis.axis()),
            None => against,
        };
        translated(&against, self.shift.0)
    }

    /// Returns a map with a positive number at each node that is filled on one of the bodies, and 0
    /// at all other nodes, or `None` if there is no such node. The shift is rounded to whole nodes.
    ///
    /// # Errors
    /// As [`Pair::draw`].
    pub fn filled_nodes(&self, sources: &SurfaceFiles) -> Result<Option<Surface>, StageError> {
        let [body, against] =
            [&self.body, &self.against].map(|params| params.filled_nodes(sources));
        let moved = against?.map(|mut filled| {
            if let Some(axis) = self.mirror {
                filled = reversed(&filled, axis.axis());
            }
            let [nodes_x, nodes_y] = filled.grid().nodes().map(|nodes| nodes as f64);
            let [x, y] = self.shift.0;
            translated(&filled, [(x * nodes_x).round() / nodes_x, (y * nodes_y).round() / nodes_y])
        });
        match (body?, moved) {
            (Some(body), Some(moved)) => sum(&body, &moved).map(Some).map_err(StageError::Heights),
            (body, moved) => Ok(body.or(moved)),
        }
    }

    /// Returns the peak memory of drawing the surfaces one after the other, in bytes per node.
    pub fn bytes_per_node(&self) -> f64 {
        let work = [&self.body, &self.against].map(|params| params.bytes_per_node());
        work[0].max(work[1])
    }
}

/// Returns whether a surface is a pair with this shift, or if `shift` is `None` any surface.
pub fn is_at(shift: Option<PerAxis<f64>>, surface: &Recipe) -> bool {
    match surface {
        Recipe::Generate(Params { origin: Origin::Pair(pair), .. }) => Some(pair.shift) == shift,
        _ => true,
    }
}

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
        serialize_with = "crate::reduced_units::serialize_free_boundary",
        deserialize_with = "crate::reduced_units::deserialize_free_boundary"
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
            return Err(StageError::Unsuitable(format!(
                "the contact in which the surface yields did not converge within {} pairs of \
                 transforms; raise `max_pairs` in its `solve` stage",
                self.max_pairs
            )));
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
