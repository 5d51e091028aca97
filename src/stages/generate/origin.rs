//! Where a surface comes from.

use serde::{Deserialize, Serialize};

use super::per_axis::PerAxis;
use super::spectrum::SpectrumSurface;
use crate::contact::grid::Cell;
use crate::contact::topography::measured;
use crate::contact::topography::periodic::Edges;
use crate::contact::topography::random::RandomSurface;
use crate::contact::topography::shapes::Shape;
use crate::contact::topography::surface::Surface;
use crate::stages::StageError;
use crate::stages::grids::grid;
use crate::surface_files::{ContentHash, SurfaceFiles};

/// Where a surface comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// A random self-affine surface.
    Random {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Spectrum, draw and scale.
        #[serde(flatten)]
        surface: RandomSurface,
    },
    /// A measured surface.
    File(MeasuredSurface),
    /// A random surface with a given spectrum.
    Spectrum {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Spectrum and draw.
        #[serde(flatten)]
        surface: SpectrumSurface,
    },
    /// A shape with a closed-form solution.
    Shape {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
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
    /// Nodes along x and y once its edges meet, as the content has them: for forecasts alone.
    #[serde(skip)]
    pub nodes: PerAxis<u32>,
}

impl Origin {
    /// Nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        let PerAxis(nodes) = match self {
            Origin::Random { nodes, .. }
            | Origin::Spectrum { nodes, .. }
            | Origin::Shape { nodes, .. } => *nodes,
            Origin::File(file) => file.nodes,
        };
        nodes.map(|nodes| nodes as usize)
    }

    /// Whether it is a measured map that is not periodic and has not been made so.
    pub fn is_open(&self) -> bool {
        matches!(self, Origin::File(file) if file.edges == Edges::Open)
    }

    /// Whether its spectrum is in the table of another task, which must be read to draw it.
    pub fn reads_stage(&self) -> bool {
        matches!(self, Origin::Spectrum { surface, .. } if surface.source.is_stage())
    }

    /// Draws the surface, or reads it.
    ///
    /// # Errors
    /// When the file is gone, has changed, or is no map of heights or no spectrum; and where the
    /// spectrum is another task's.
    pub fn draw(&self, side: [f64; 2], sources: &SurfaceFiles) -> Result<Surface, StageError> {
        match self {
            Origin::Random { surface, .. } => Ok(surface.draw(grid(self.nodes(), side)?)),
            Origin::Shape { shape, .. } => Ok(shape.draw(grid(self.nodes(), side)?)),
            Origin::Spectrum { surface, .. } => {
                let density = surface.density_of_file(sources)?;
                surface.draw(&density, grid(self.nodes(), side)?)
            }
            Origin::File(file) => {
                let bytes = sources.read(&file.content)?;
                let cell = Cell::new(side).map_err(|error| StageError::Heights(error.into()))?;
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
}
