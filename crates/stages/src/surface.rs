//! The recipe of one surface, from which it is drawn or read again by each task that needs it.

pub mod coordinates;
pub mod description;
pub mod labels;
pub mod method;
pub mod origin;
pub mod pair;
pub mod planned;
pub mod spectrum;

use arrow::array::AsArray;
use arrow::datatypes::Float64Type;
use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use self::description::Description;
use crate::columns::HEIGHTS;
use crate::grids::{self, Grids};
use crate::per_axis::PerAxis;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, StageError};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::prescribed_heights::nodes_of_iterations;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::key::{Digest, TaskKey};
use asperity_tables::table::Table;

pub use self::origin::Origin;

/// The recipe of one surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Storage of the heights, if there are any.
    pub heights: Heights,
    /// Sides of the cell along x and y, in the unit of length of the manifest. For a measured
    /// surface, sides of the map in the file before its preparation; `None` if the file contains
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<PerAxis<f64>>,
    /// Spectrum, file or shape of the surface.
    #[serde(flatten)]
    pub origin: Origin,
}

/// Peak memory of adjusting phases to a height distribution, in bytes per node of the mesh on which
/// they are adjusted.
const BYTES_OF_ITERATIONS: f64 = 64.0;

/// The storage of the heights of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Heights {
    /// The heights are stored in the table.
    Keep,
    /// The heights are drawn, or read from their file, again when needed.
    Redraw,
    /// No heights are drawn: modes alone describe the surface, and `solve` and `measure` stages
    /// cannot read it.
    None,
}

impl Heights {
    /// Removes `"none"` from a schema, because only random self-affine surfaces can be described by
    /// their modes alone.
    pub fn not_none(schema: &mut Schema) {
        if let Some(words) = schema.get_mut("oneOf").and_then(Value::as_array_mut) {
            words.retain(|word| word["const"] != "none");
        }
    }
}

impl Params {
    /// Returns the recipe of realization `number` with otherwise equal parameters. Shapes and files
    /// have only one realization, so that their recipes stay unchanged.
    pub fn realization(&self, number: u32) -> Params {
        let mut params = self.clone();
        match &mut params.origin {
            Origin::Random { surface, .. } => surface.realization = number,
            Origin::Spectrum { surface, .. } => surface.realization = number,
            Origin::Pair(pair) => **pair = pair.realization(number),
            Origin::Yielded(yielded) => *yielded.body = yielded.body.realization(number),
            Origin::File(_) | Origin::Shape { .. } => {}
        }
        params
    }

    /// Returns the recipe with another storage of the heights.
    pub fn with(&self, heights: Heights) -> Params {
        Params { heights, ..self.clone() }
    }

    /// Returns what equal surfaces on different meshes have in common: the recipe without nodes and
    /// storage. Returns `None` if other meshes cannot show the surface.
    pub fn without_mesh(&self) -> Option<Params> {
        let mut params = self.with(Heights::Redraw);
        match &mut params.origin {
            Origin::Random { nodes, .. } | Origin::Spectrum { nodes, .. } => nodes.0 = [0; 2],
            Origin::File(_) | Origin::Shape { .. } | Origin::Pair(_) | Origin::Yielded(_) => {
                return None;
            }
        }
        Some(params)
    }

    /// Returns the key from which the name of the surface is derived. It depends neither on the
    /// storage of the heights nor on whether the manifest contains an anisotropy ratio of 1.
    pub fn surface_key(&self) -> TaskKey {
        let mut params = self.with(Heights::Redraw);
        if let Origin::Random { has_unit_ratio, .. } = &mut params.origin {
            *has_unit_ratio = false;
        }
        let kind = Kind::Generate;
        TaskKey::new(kind.name(), kind.version(), Digest::from_params(&params), &[])
    }

    /// Returns the number of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.origin.nodes()
    }

    /// Returns the sides of the cell along x and y.
    pub fn size(&self) -> [f64; 2] {
        let PerAxis(size) = match &self.origin {
            Origin::File(file) => file.seen.side,
            Origin::Pair(pair) => return pair.body.size(),
            Origin::Yielded(yielded) => return yielded.body.size(),
            Origin::Random { .. } | Origin::Spectrum { .. } | Origin::Shape { .. } => {
                self.side.unwrap_or_default()
            }
        };
        size
    }

    /// Returns the grid of the nodes of the surface.
    ///
    /// # Errors
    /// If nodes or sides are invalid, which cannot happen in a recipe from a study.
    pub fn grid(&self) -> Result<Grid, StageError> {
        grids::grid(self.nodes(), self.size())
    }

    /// Returns the sides along x and y, or `None` if the manifest does not give them.
    pub fn sides(&self) -> Option<[f64; 2]> {
        self.side.map(|PerAxis(sides)| sides)
    }

    /// Draws the surface, or reads it from its file.
    ///
    /// # Errors
    /// If the file is missing, has changed or cannot be read.
    pub fn draw(&self, sources: &SurfaceFiles, threads: &Threads) -> Result<Surface, StageError> {
        self.origin.draw(self.sides(), sources, threads)
    }

    /// Returns a map with a positive number at each node whose height was not measured but filled,
    /// and 0 at all other nodes. A node of a pair is filled if one of the bodies is filled there.
    /// Returns `None` if no node was filled.
    ///
    /// # Errors
    /// As [`Params::draw`].
    pub fn filled_nodes(&self, sources: &SurfaceFiles) -> Result<Option<Surface>, StageError> {
        match &self.origin {
            Origin::File(file) => file.filled_nodes(self.sides(), sources),
            Origin::Pair(pair) => pair.filled_nodes(sources),
            Origin::Yielded(yielded) => yielded.body.filled_nodes(sources),
            Origin::Random { .. } | Origin::Spectrum { .. } | Origin::Shape { .. } => Ok(None),
        }
    }

    /// Returns a table with one row that describes `surface`, without heights and without the
    /// columns about its file.
    pub fn described(&self, surface: &Surface) -> Table {
        let description = Description::from_surface(&self.origin, surface, &Threads::one());
        Table::new(1, description.row(self, surface.grid()))
    }

    /// Returns the surface from the heights in `table`. If the table has no heights, draws the
    /// surface again.
    ///
    /// # Errors
    /// As [`Params::draw`], and if the table is not one of a `generate` stage.
    pub fn surface(
        &self,
        table: &Table,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        if !table.has(HEIGHTS.name) {
            return self.draw(sources, threads);
        }
        let list = table.lists(HEIGHTS.name)?.value(0);
        let heights = list.as_primitive::<Float64Type>().values().to_vec();
        let grid = Grids::new(table)?.grid(0)?;
        Surface::new(grid, heights).map_err(StageError::Heights)
    }

    /// Returns the peak memory of drawing the surface, in bytes per node, measured on one thread at
    /// 512² and 1024² nodes.
    pub fn bytes_per_node(&self) -> f64 {
        match (&self.origin, self.heights) {
            (_, Heights::None) => 0.0,
            (Origin::File(file), _) => {
                let modes = if file.preparation.tests_reliability() { 24.0 } else { 0.0 };
                let repairs = file.repair_bytes_per_node();
                28.0 + modes + file.seen.extra_bytes_per_node() + repairs
            }
            (Origin::Pair(pair), _) => 16.0 + pair.bytes_per_node(),
            (Origin::Yielded(yielded), _) => yielded.bytes_per_node(),
            (Origin::Random { .. } | Origin::Spectrum { .. } | Origin::Shape { .. }, _) => {
                28.0 + BYTES_OF_ITERATIONS * self.nodes_of_iterations()
            }
        }
    }

    /// Returns the number of nodes of the mesh on which phases are adjusted to a prescribed height
    /// distribution, relative to the nodes of the surface; 0 for other surfaces.
    pub fn nodes_of_iterations(&self) -> f64 {
        let [nodes_x, nodes_y] = self.nodes();
        let max_waves = match (&self.origin, self.origin.prescribed_heights()) {
            (Origin::Random { surface, .. }, Some(_)) => {
                let cell = self.grid().map(|grid| grid.cell());
                cell.map_or([0; 2], |cell| surface.spectrum.max_waves(cell))
            }
            // At most all waves that the mesh resolves.
            (_, Some(_)) => [nodes_x, nodes_y].map(|nodes| nodes as u32 / 2),
            (_, None) => return 0.0,
        };
        nodes_of_iterations(max_waves) as f64 / (nodes_x * nodes_y) as f64
    }
}
