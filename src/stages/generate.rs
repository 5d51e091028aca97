//! Draws a surface, or reads one, and describes it.

use arrow::array::{AsArray, Float64Array};
use arrow::datatypes::Float64Type;
use serde::{Deserialize, Serialize};

use self::description::Description;
use super::columns::{HEIGHTS, NODES, SIDE};
use super::{Context, Effort, Footprint, Kind, Recipe, StageError};
use crate::contact::grid::Grid;
use crate::contact::topography::measured;
use crate::contact::topography::periodic::Edges;
use crate::contact::topography::random::RandomSurface;
use crate::contact::topography::shapes::Shape;
use crate::contact::topography::surface::Surface;
use crate::store::column::{Column, Value, lists};
use crate::store::key::{Digest, TaskKey};
use crate::store::table::Table;
use crate::surface_files::{ContentHash, SurfaceFiles};

mod description;

/// Raise it when the numbers change.
pub const VERSION: u32 = 3;

/// One surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Whether the heights are stored, drawn again when needed, or never looked at.
    pub heights: Heights,
    /// Side of the periodic cell, in the user's unit of length.
    pub side: f64,
    /// What the surface looks like.
    #[serde(flatten)]
    pub form: Form,
}

/// What becomes of the heights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Heights {
    /// They are a column of the stored table.
    Keep,
    /// They are drawn again by whoever needs them.
    Redraw,
    /// There are none: a random surface is described by its modes, which need no mesh.
    None,
}

/// Where a surface comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Form {
    /// A random self-affine surface.
    Random {
        /// Nodes per side.
        nodes: u32,
        /// Spectrum, draw and scale.
        #[serde(flatten)]
        surface: RandomSurface,
    },
    /// A measured surface.
    File(MeasuredSurface),
    /// A shape with a closed-form solution.
    Shape {
        /// Nodes per side.
        nodes: u32,
        /// Which one.
        #[serde(flatten)]
        shape: Shape,
    },
}

/// A map of heights in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "file")]
pub struct MeasuredSurface {
    /// Hash of the file's content; its path decides nothing.
    pub content: ContentHash,
    /// Unit of length, a label.
    pub unit: String,
    /// Factor that turns the file's numbers into lengths.
    pub height_scale: f64,
    /// How the map's edges are made to meet.
    #[serde(flatten)]
    pub edges: Edges,
    /// Nodes per side once its edges meet, as the content has them: for forecasts alone.
    #[serde(skip)]
    pub nodes: u32,
}

impl Params {
    /// The same surface of another realization; shapes and files have but one.
    pub fn realization(&self, number: u32) -> Params {
        let mut params = self.clone();
        if let Form::Random { surface, .. } = &mut params.form {
            surface.realization = number;
        }
        params
    }

    /// The same row with its heights not kept: what later stages' keys are built on. A surface
    /// without heights stays one, for its row holds less.
    pub fn essence(&self) -> Params {
        match self.heights {
            Heights::Keep | Heights::Redraw => self.with(Heights::Redraw),
            Heights::None => self.clone(),
        }
    }

    /// Whether its heights are stored.
    pub fn keeps_heights(&self) -> bool {
        self.heights == Heights::Keep
    }

    fn with(&self, heights: Heights) -> Params {
        Params {
            heights,
            ..self.clone()
        }
    }

    /// What places the surface among others.
    pub fn coordinates(&self) -> Vec<(Column, Value)> {
        description::coordinates(self)
    }

    /// The surface's name, the same whatever becomes of its heights.
    fn surface_key(&self) -> TaskKey {
        let recipe = Recipe::Generate(self.with(Heights::Redraw));
        TaskKey::of(Kind::Generate.name(), VERSION, Digest::of(&recipe), &[])
    }

    /// See [`Recipe::effort`]: drawing and describing take a few transforms, moments of modes none.
    pub fn effort(&self) -> Effort {
        match (&self.form, self.heights) {
            (Form::Random { surface, .. }, Heights::None) => {
                let modes = 1.6 * f64::from(surface.spectrum.k_upper).powi(2);
                Effort::seconds(5e-8 * modes)
            }
            _ => Effort::pairs(6.0),
        }
    }

    /// See [`Recipe::footprint`]: the peak of a run on one thread, at 512² and 1024².
    pub fn footprint(&self) -> Footprint {
        Footprint {
            work: match self.heights {
                Heights::Keep | Heights::Redraw => 28.0,
                Heights::None => 0.0,
            },
            table: match self.heights {
                Heights::Keep => 8.0,
                Heights::Redraw | Heights::None => 0.0,
            },
        }
    }

    /// Nodes per side.
    pub fn nodes(&self) -> usize {
        match &self.form {
            Form::Random { nodes, .. } | Form::Shape { nodes, .. } => *nodes as usize,
            Form::File(file) => file.nodes as usize,
        }
    }

    /// Where its nodes lie.
    ///
    /// # Errors
    /// When the recipe is not one that a study made, and has no such grid.
    pub fn grid(&self) -> Result<Grid, StageError> {
        grid(self.nodes(), self.side)
    }

    /// Draws the surface, or reads it.
    ///
    /// # Errors
    /// When the file is gone, has changed, or is no map of heights.
    pub fn draw(&self, sources: &SurfaceFiles) -> Result<Surface, StageError> {
        match &self.form {
            Form::Random { surface, .. } => Ok(surface.draw(self.grid()?)),
            Form::Shape { shape, .. } => Ok(shape.draw(self.grid()?)),
            Form::File(file) => {
                let bytes = sources.read(&file.content)?;
                let cell = grid(1, self.side)?.cell();
                let map = measured::read_npy(&bytes, cell).map_err(|source| {
                    let path = sources.path_of(&file.content);
                    StageError::Measured {
                        path: path
                            .map(|path| path.display().to_string())
                            .unwrap_or_default(),
                        source,
                    }
                })?;
                let map = map.scaled(file.height_scale).map_err(StageError::Heights)?;
                Ok(file.edges.close(map))
            }
        }
    }

    /// The heights that `table` kept, or else the surface drawn again.
    ///
    /// # Errors
    /// As [`Params::draw`], and when the table is not one of this stage.
    pub fn surface(&self, table: &Table, sources: &SurfaceFiles) -> Result<Surface, StageError> {
        if !table.has(HEIGHTS.name) {
            return self.draw(sources);
        }
        let nodes = table.integers(NODES.name)?.value(0);
        let side = table.reals(SIDE.name)?.value(0);
        let list = table.lists(HEIGHTS.name)?.value(0);
        let heights = list.as_primitive::<Float64Type>().values().to_vec();
        let grid = grid(nodes.unsigned_abs() as usize, side)?;
        Surface::new(grid, heights).map_err(StageError::Heights)
    }
}

/// So many nodes on a square cell.
///
/// # Errors
/// When there is no node, or no cell.
pub fn grid(nodes: usize, side: f64) -> Result<Grid, StageError> {
    Grid::square(nodes, side).map_err(|error| StageError::Heights(error.into()))
}

/// The columns that place a surface among others of its method.
pub fn own_columns(form: &Form) -> Vec<Column> {
    let coordinates = description::own_coordinates(form).into_iter();
    coordinates.map(|(column, _)| column).collect()
}

/// What places a surface among others of its method, in one row.
pub fn own_row(form: &Form) -> Table {
    Table::row(&description::own_coordinates(form))
}

/// Draws one surface and describes it in one row.
///
/// # Errors
/// When the file of a measured surface is gone, has changed, or is no map of heights.
pub fn run(params: &Params, context: &Context) -> Result<Table, StageError> {
    if let (Form::Random { surface, .. }, Heights::None) = (&params.form, params.heights) {
        let grid = params.grid()?;
        let description = Description::of_modes(surface, grid.cell());
        let columns = description.row(params, grid);
        return Ok(Table::new(1, columns));
    }
    let surface = params.draw(context.sources)?;
    let description = Description::of_surface(&params.form, &surface);
    let mut columns = description.row(params, surface.grid());
    if params.keeps_heights() {
        let heights = Float64Array::from(surface.into_heights());
        let length = heights.len();
        columns.push((HEIGHTS, lists(heights, [length])));
    }
    Ok(Table::new(1, columns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::topography::random::Amplitude;
    use crate::contact::topography::spectrum::Spectrum;

    #[test]
    fn a_surface_is_known_from_its_recipe() {
        let spectrum = Spectrum {
            hurst: 0.8,
            k_lower: 4,
            k_rolloff: 4,
            k_upper: 32,
        };
        let surface = RandomSurface {
            spectrum,
            amplitude: Amplitude::Deterministic,
            rms_slope: 0.02,
            seed: i64::MAX as u64,
            realization: 7,
        };
        let measured = MeasuredSurface {
            content: ContentHash::of(b"heights"),
            unit: "µm".to_owned(),
            height_scale: 1e-3,
            edges: Edges::Taper {
                taper_fraction: 0.1,
            },
            nodes: 0,
        };
        let shape = Shape::Punch {
            radius: 0.25,
            depth: 0.5,
        };
        let nodes = 128;
        for form in [
            Form::Random { nodes, surface },
            Form::File(measured),
            Form::Shape { nodes, shape },
        ] {
            let params = Params {
                heights: Heights::Redraw,
                side: 1.0,
                form,
            };
            let recipe = serde_json::to_string(&params).unwrap();
            assert_eq!(serde_json::from_str::<Params>(&recipe).unwrap(), params);
        }
    }
}
